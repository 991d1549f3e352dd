//! Curved laws: diodes and transistors that take part in jumps.
