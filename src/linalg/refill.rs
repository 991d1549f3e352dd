//! Vectors that are filled anew again and again.

/// `to` = `from`. [`Vec`] puts its growth into each place that fills one; a loop that passes many of them waits for code. Most are short, and
/// copied faster than by a call.
#[inline(never)]
pub(crate) fn refill(to: &mut Vec<f64>, from: &[f64]) {
    match (to.as_mut_slice(), from) {
        ([a, b], [x, y]) => (*a, *b) = (*x, *y),
        ([a, b, c], [x, y, z]) => (*a, *b, *c) = (*x, *y, *z),
        _ => {
            to.clear();
            to.extend_from_slice(from);
        }
    }
}

/// Raises `to` to |`from`|, as far as both go.
#[inline(never)]
pub(crate) fn raise(to: &mut [f64], from: &[f64]) {
    // As `f64::max` where neither is NaN, in one instruction, for two at a time.
    let raised = |to: f64, from: f64| if to > from.abs() { to } else { from.abs() };
    let count = to.len().min(from.len());
    let (pairs, last) = to[..count].as_chunks_mut::<2>();
    let (theirs, others) = from[..count].as_chunks::<2>();
    for ([a, b], [x, y]) in pairs.iter_mut().zip(theirs) {
        (*a, *b) = (raised(*a, *x), raised(*b, *y));
    }
    if let ([to], [from]) = (last, others) {
        *to = raised(*to, *from);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn vectors_of_any_length() {
        for (count, others) in (0..9).flat_map(|count| (0..9).map(move |others| (count, others))) {
            let from: Vec<f64> = (0..others).map(|k| f64::from(k) - 3.5).collect();
            let mut to = vec![2.0; count];
            raise(&mut to, &from);
            for (k, to) in to.iter().enumerate() {
                assert_eq!(*to, from.get(k).map_or(2.0, |v| v.abs().max(2.0)));
            }
            refill(&mut to, &from);
            assert_eq!(to, from);
        }
    }
}
