//! Changes of mode: switches that move together, and jumps.
