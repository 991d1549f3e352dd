//! The method for curved laws whose steps are chosen: ARK4(3)6L\[2\]SA-ESDIRK.
//!
//! ```text
//! X_j = B_j + γh f(X_j),      B_j = x + h Σ_{k<j} a_jk f_k,      f₁ = f(x),      x⁺ = X₆
//! ```
//!
//! C. A. Kennedy, M. H. Carpenter, "Additive Runge-Kutta schemes for convection-diffusion-reaction equations", Applied Numerical Mathematics
//! 44, 2003: order 4 with an embedded method of order 3, stages of order 2, L-stable, stiffly accurate. All implicit stages have one γ, so that
//! one factorisation serves all, and the first is the last of the step before.

/// Stages, the explicit one included.
pub(crate) const STAGES: usize = 6;

/// The diagonal.
pub(crate) const GAMMA: f64 = 0.25;

/// Where the stages are.
pub(crate) const NODES: [f64; STAGES] = [0.0, 0.5, 83.0 / 250.0, 31.0 / 50.0, 17.0 / 20.0, 1.0];

/// a_jk, k < j.
pub(crate) const LOWER: [&[f64]; STAGES] = [
    &[],
    &[0.25],
    &[8611.0 / 62500.0, -1743.0 / 31250.0],
    &[
        5_012_029.0 / 34_652_500.0,
        -654_441.0 / 2_922_500.0,
        174_375.0 / 388_108.0,
    ],
    &[
        15_267_082_809.0 / 155_376_265_600.0,
        -71_443_401.0 / 120_774_400.0,
        730_878_875.0 / 902_184_768.0,
        2_285_395.0 / 8_070_912.0,
    ],
    &[WEIGHTS[0], WEIGHTS[1], WEIGHTS[2], WEIGHTS[3], WEIGHTS[4]],
];

/// b_j.
pub(crate) const WEIGHTS: [f64; STAGES] = [
    82_889.0 / 524_892.0,
    0.0,
    15_625.0 / 83_664.0,
    69_875.0 / 102_672.0,
    -2260.0 / 8211.0,
    GAMMA,
];

/// The embedded method's.
const EMBEDDED: [f64; STAGES] = [
    4_586_570_599.0 / 29_645_900_160.0,
    0.0,
    178_811_875.0 / 945_068_544.0,
    814_220_225.0 / 1_159_782_912.0,
    -3_700_637.0 / 11_593_932.0,
    61_727.0 / 225_920.0,
];

/// b_j − b̂_j: what the error of a step is estimated by, which shrinks with h⁴.
pub(crate) const ERROR: [f64; STAGES] = [
    WEIGHTS[0] - EMBEDDED[0],
    WEIGHTS[1] - EMBEDDED[1],
    WEIGHTS[2] - EMBEDDED[2],
    WEIGHTS[3] - EMBEDDED[3],
    WEIGHTS[4] - EMBEDDED[4],
    WEIGHTS[5] - EMBEDDED[5],
];

/// What Hermite's cubic through both ends and their slopes has as its mean over a step more than Σ b_j X_j, the mean of the stages, in slopes of the
/// stages times h: zero for the slopes of cubics.
pub(crate) const STRAY: [f64; STAGES] = stray();

const fn stray() -> [f64; STAGES] {
    let mut all = [0.0; STAGES];
    let mut k = 0;
    while k < STAGES {
        let mut of_stages = if k > 0 { WEIGHTS[k] * GAMMA } else { 0.0 };
        let mut j = k + 1;
        while j < STAGES {
            of_stages += WEIGHTS[j] * LOWER[j][k];
            j += 1;
        }
        all[k] = 0.5 * WEIGHTS[k] - of_stages;
        k += 1;
    }
    all[0] += 1.0 / 12.0;
    all[STAGES - 1] -= 1.0 / 12.0;
    all
}

/// The stages that λ at a stage is extrapolated from: their indices. The first implicit stage has none before it.
const FROM: [&[usize]; STAGES] = [&[], &[0], &[0, 1], &[0, 1, 2], &[0, 2, 3], &[0, 1, 4]];

/// The weights with which λ at a stage follows from earlier ones, by Lagrange's polynomial.
pub(crate) fn extrapolation(stage: usize) -> impl Iterator<Item = (usize, f64)> {
    let (from, at) = (FROM[stage], NODES[stage]);
    let weight = move |k: usize| -> f64 {
        let others = from.iter().filter(move |other| **other != k);
        others
            .map(|&other| (at - NODES[other]) / (NODES[k] - NODES[other]))
            .product()
    };
    from.iter().map(move |&k| (k, weight(k)))
}

/// The stages through which λ is interpolated; at the others the polynomial is tested.
pub(crate) const THROUGH: [usize; 4] = [0, 2, 3, 5];

/// Lagrange's weights of [`THROUGH`] at a part of the step.
pub(crate) fn interpolation(part: f64) -> [f64; 4] {
    std::array::from_fn(|k| {
        let others = THROUGH.iter().filter(|other| **other != THROUGH[k]);
        others
            .map(|&other| (part - NODES[other]) / (NODES[THROUGH[k]] - NODES[other]))
            .product()
    })
}

/// The stages in the order of their times.
pub(super) const IN_TIME: [usize; STAGES] = [0, 2, 1, 3, 4, 5];

/// The stages before and after a part of the step, and the weight of the second one on the straight line between them.
pub(crate) fn between_stages(part: f64) -> (usize, usize, f64) {
    let at = IN_TIME[1..STAGES - 1].partition_point(|&k| NODES[k] <= part);
    let (a, b) = (IN_TIME[at], IN_TIME[at + 1]);
    (a, b, (part - NODES[a]) / (NODES[b] - NODES[a]))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// a_jk with the diagonal.
    fn matrix() -> [[f64; STAGES]; STAGES] {
        std::array::from_fn(|j| {
            std::array::from_fn(|k| match LOWER[j].get(k) {
                Some(a) => *a,
                None if k == j && j > 0 => GAMMA,
                None => 0.0,
            })
        })
    }

    fn times(a: &[[f64; STAGES]; STAGES], v: &[f64; STAGES]) -> [f64; STAGES] {
        std::array::from_fn(|j| a[j].iter().zip(v).map(|(a, v)| a * v).sum())
    }

    fn dot(a: &[f64; STAGES], b: &[f64; STAGES]) -> f64 {
        a.iter().zip(b).map(|(a, b)| a * b).sum()
    }

    #[test]
    fn cubics_have_the_mean_of_their_stages() {
        for (power, expected) in [(0, 0.0), (1, 0.0), (2, 0.0), (3, -0.005_288_333)] {
            let sum: f64 = (STRAY.iter().zip(NODES))
                .map(|(weight, node)| weight * node.powi(power))
                .sum();
            assert!((sum - expected).abs() < 1e-9, "{power}: {sum}");
        }
    }

    #[test]
    fn order_conditions_hold() {
        let a = matrix();
        let ones = [1.0; STAGES];
        let c = times(&a, &ones);
        let squares = c.map(|c| c * c);
        let (ac, ac2) = (times(&a, &c), times(&a, &squares));
        let product: [f64; STAGES] = std::array::from_fn(|j| c[j] * ac[j]);
        for (seen, node) in c.iter().zip(NODES) {
            assert!((seen - node).abs() < 1e-15);
        }
        // Stage order 2, of the implicit stages.
        for (seen, c) in ac.iter().zip(c) {
            assert!((seen - 0.5 * c * c).abs() < 1e-14, "{seen} {c}");
        }
        let third = |b: &[f64; STAGES]| {
            [
                dot(b, &ones) - 1.0,
                dot(b, &c) - 0.5,
                dot(b, &squares) - 1.0 / 3.0,
                dot(b, &ac) - 1.0 / 6.0,
            ]
        };
        let cubes = c.map(|c| c * c * c);
        let fourth = [
            dot(&WEIGHTS, &cubes) - 0.25,
            dot(&WEIGHTS, &product) - 0.125,
            dot(&WEIGHTS, &ac2) - 1.0 / 12.0,
            dot(&WEIGHTS, &times(&a, &ac)) - 1.0 / 24.0,
        ];
        for left in third(&WEIGHTS)
            .into_iter()
            .chain(third(&EMBEDDED))
            .chain(fourth)
        {
            assert!(left.abs() < 1e-14, "{left}");
        }
        assert!((dot(&EMBEDDED, &cubes) - 0.25).abs() > 1e-3);
    }

    #[test]
    fn stages_enclose_every_part_of_a_step() {
        assert_eq!(between_stages(0.0), (0, 2, 0.0));
        assert_eq!(between_stages(1.0), (4, 5, 1.0));
        assert_eq!(between_stages(0.5), (1, 3, 0.0));
        for k in 0..=100 {
            let part = f64::from(k) / 100.0;
            let (a, b, weight) = between_stages(part);
            assert!((0.0..=1.0).contains(&weight), "{part}");
            let there = NODES[a] + weight * (NODES[b] - NODES[a]);
            assert!((there - part).abs() < 1e-15, "{part}");
        }
    }

    #[test]
    fn polynomials_are_met() {
        let square = |t: f64| 1.0 + t * (2.0 - 3.0 * t);
        for (stage, node) in NODES.iter().enumerate().skip(3) {
            let guess: f64 = extrapolation(stage)
                .map(|(k, w)| w * square(NODES[k]))
                .sum();
            assert!((guess - square(*node)).abs() < 1e-13, "{stage}");
        }
        let cube = |t: f64| square(t) + 4.0 * t * t * t;
        for part in [0.0, 0.1, 0.7, 1.0] {
            let value: f64 = (interpolation(part).iter().zip(THROUGH))
                .map(|(w, k)| w * cube(NODES[k]))
                .sum();
            assert!((value - cube(part)).abs() < 1e-13, "{part}");
        }
    }
}
