//! Rows, files and interruption.
