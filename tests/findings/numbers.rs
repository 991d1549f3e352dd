//! Extreme values: resistances over many decades, equal eigenvalues, long chains.
