//! Energy, stated errors and verification.
