//! What netlists say: sources, start values, devices.
