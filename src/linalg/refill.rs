//! Vectors that are filled anew again and again.

/// `to` = `from`. [`Vec`] puts its growth into each place that fills one; a loop that passes many of them waits for code.
#[inline(never)]
pub(crate) fn refill(to: &mut Vec<f64>, from: &[f64]) {
    to.clear();
    to.extend_from_slice(from);
}
