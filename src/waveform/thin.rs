//! Fewer points for a picture, without losing a peak.

/// Of the points (time, value) that fall on one of `pixels` columns of a picture: the first, the lowest, the highest and the last, in order
/// of time, and of values that are no numbers (NaN) the first of those side by side. They are returned as they are when there are at most four a pixel.
pub(crate) fn thinned(points: Vec<(f64, f64)>, pixels: usize) -> Vec<(f64, f64)> {
    let pixels = pixels.max(1);
    if points.len() <= pixels.saturating_mul(4) {
        return points;
    }
    let (first, last) = (points[0].0, points[points.len() - 1].0);
    let scale = if last > first {
        pixels as f64 / (last - first)
    } else {
        0.0
    };
    let pixel = |t: f64| (((t - first) * scale) as usize).min(pixels - 1);
    let mut kept = Vec::with_capacity(4 * pixels);
    let together =
        |a: &(f64, f64), b: &(f64, f64)| pixel(a.0) == pixel(b.0) && a.1.is_nan() == b.1.is_nan();
    for bin in points.chunk_by(together) {
        if bin[0].1.is_nan() {
            kept.push(bin[0]);
            continue;
        }
        let by_value = |&a: &usize, &b: &usize| bin[a].1.total_cmp(&bin[b].1);
        let lowest = (0..bin.len()).min_by(by_value).unwrap_or(0);
        let highest = (0..bin.len()).max_by(by_value).unwrap_or(0);
        let mut chosen = [0, lowest, highest, bin.len() - 1];
        chosen.sort_unstable();
        let mut previous = None;
        for k in chosen {
            if previous != Some(k) {
                kept.push(bin[k]);
            }
            previous = Some(k);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_single_spike_among_a_million_rows_survives() {
        let value = |k| if k == 345_678 { 9.0 } else { 0.0 };
        let all = (0..1_000_000).map(|k| (f64::from(k), value(k)));
        let points = thinned(all.collect(), 500);
        assert!(points.len() <= 2000);
        assert!(points.contains(&(345_678.0, 9.0)));
        assert_eq!(points.first(), Some(&(0.0, 0.0)));
        assert_eq!(points.last(), Some(&(999_999.0, 0.0)));
        assert!(points.windows(2).all(|w| w[0].0 < w[1].0));
    }

    #[test]
    fn a_gap_stays_one_and_hides_no_peak() {
        let value = |k| match k {
            400..500 => f64::NAN,
            399 => 9.0,
            _ => 0.0,
        };
        let points = thinned((0..1000).map(|k| (f64::from(k), value(k))).collect(), 1);
        let shown: Vec<String> = points.iter().map(|p| format!("{p:?}")).collect();
        assert_eq!(
            shown,
            [
                "(0.0, 0.0)",
                "(399.0, 9.0)",
                "(400.0, NaN)",
                "(500.0, 0.0)",
                "(999.0, 0.0)"
            ]
        );
    }

    #[test]
    fn few_rows_and_no_rows_stay_as_they_are() {
        let two = vec![(0.0, 2.0), (1.0, 3.0)];
        assert_eq!(thinned(two.clone(), 10), two);
        assert!(thinned(Vec::new(), 10).is_empty());
    }
}
