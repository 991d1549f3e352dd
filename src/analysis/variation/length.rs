//! The lengths of the stretches of a run: a circuit that switches periodically has few.

/// The length of a stretch.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Length {
    /// s; the same number where it is the same length.
    pub(super) seconds: f64,
    /// Whether more stretches of the equation are as long than it has dimensions: an exponential and an integral of its own take as many products of matrices as the digits of a
    /// length take products of matrices and vectors.
    pub(super) recurs: bool,
}

impl Length {
    /// Of stretches by their equations and seconds, where those of an equation that differ by no more than `same`, s, are one.
    pub(super) fn of(stretches: &[(usize, f64)], dims: &[usize], same: f64) -> Vec<Self> {
        let mut order: Vec<usize> = (0..stretches.len()).collect();
        order.sort_by(|a, b| {
            let ((e, s), (f, t)) = (stretches[*a], stretches[*b]);
            e.cmp(&f).then(s.total_cmp(&t))
        });
        let mut found = vec![
            Self {
                seconds: 0.0,
                recurs: false
            };
            stretches.len()
        ];
        let mut rest = &order[..];
        while let Some(first) = rest.first() {
            let (equation, seconds) = stretches[*first];
            let alike =
                |k: &usize| stretches[*k].0 == equation && stretches[*k].1 - seconds <= same;
            let (alike, others) = rest.split_at(rest.partition_point(alike));
            let recurs = alike.len() > dims[equation];
            alike
                .iter()
                .for_each(|k| found[*k] = Self { seconds, recurs });
            rest = others;
        }
        found
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lengths_recur_beyond_the_dimensions_of_their_equation() {
        let near = 1.0 + f64::EPSILON;
        let stretches = [(0, 1.0), (1, 1.0), (0, near), (0, 2.0), (1, near), (1, 1.0)];
        let found = Length::of(&stretches, &[1, 3], 4.0 * f64::EPSILON);
        let of = |seconds, recurs| Length { seconds, recurs };
        let [short, long] = [of(1.0, true), of(2.0, false)];
        let other = of(1.0, false);
        assert_eq!(found, [short, other, short, long, other, other]);
    }
}
