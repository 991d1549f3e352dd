//! netlist
