//! Gramians over a finite time, which doubles: Γ = ∫₀ᵗ exp(𝒜ᵀs) Q exp(𝒜s) ds of two forms Q.

use nalgebra::DMatrix;

use super::dense::Dense;
use super::expm::Ladders;
use super::powers::{halved, halvings};
use super::quadratic::Quadratics;
use crate::settings::tolerances::exponentials::{ENERGY_SQUARED, SERIES};

/// Terms of the series over a step with ‖𝒜‖ h ≤ [`SERIES`]; (2·0.125)^k/k! is below rounding beyond, in every entry: their sizes are not comparable.
const TERMS: usize = 15;

/// See the [module](self).
#[derive(Debug, Clone)]
pub(crate) struct Gramians {
    longest: f64,
    /// t is the longest over 2^k.
    k: u32,
    grams: [Dense; 2],
    /// What it takes to double t, once that is asked for: a short span is done with its series.
    along: Option<Along>,
}

/// exp(𝒜t) − I for t that doubles.
#[derive(Debug, Clone)]
struct Along {
    /// exp(𝒜 longest/2^k) − I.
    ladder: Ladders,
    /// From here on exp(𝒜t) is a square.
    squared: u32,
    /// That of this k.
    k: u32,
    increment: Dense,
    buffers: [Dense; 3],
}

impl Gramians {
    /// Over 2^−`k` of the longest time, doubled from where ‖𝒜‖ t ≤ [`SERIES`]: Q_{j+1} = (𝒜ᵀ Q_j + Q_j 𝒜) t/(j + 1).
    pub(crate) fn new(
        (generator, fast): (&DMatrix<f64>, &[usize]),
        powers: &[Dense; 2],
        longest: f64,
        k: u32,
    ) -> Self {
        let dim = generator.nrows();
        let norm = halved(Dense::of(generator).norm_1() * longest, k);
        let halvings = halvings(norm / SERIES);
        let t = halved(longest, k + halvings);
        let a = Dense::from_fn(dim, dim, |i, j| generator[(i, j)] * t);
        let mut buffer = Dense::zeros(dim, dim);
        let mut series = |power: &Dense| {
            let mut term = power.clone();
            term.combine(t, 0.0, power);
            let mut sum = term.clone();
            for j in 2..TERMS {
                buffer.set_product(&term, &a);
                term.set_symmetric(1.0 / j as f64, &buffer);
                sum.add(&term);
            }
            sum
        };
        let grams = powers.each_ref().map(&mut series);
        let mut gramians = Self {
            longest,
            k: k + halvings,
            grams,
            along: None,
        };
        for _ in 0..halvings {
            gramians.double((generator, fast));
        }
        gramians
    }

    /// Φ = I + E: Γ ← Γ + Φᵀ Γ Φ.
    pub(crate) fn double(&mut self, (generator, fast): (&DMatrix<f64>, &[usize])) {
        let (k, longest) = (self.k, self.longest);
        let along = (self.along).get_or_insert_with(|| Along::new(generator, fast, longest, k));
        while along.k > k {
            along.go_on();
        }
        let [first, second, transposed] = &mut along.buffers;
        let e = &along.increment;
        transposed.set_transposed(e);
        for gram in &mut self.grams {
            first.set_product(gram, e);
            first.add(gram);
            second.set_product(transposed, first);
            gram.add(first);
            gram.add(second);
        }
        self.k = k.saturating_sub(1);
    }

    /// wᵀΓw of both.
    pub(crate) fn forms(&self) -> Quadratics {
        Quadratics::of(&self.grams)
    }
}

impl Along {
    fn new(generator: &DMatrix<f64>, fast: &[usize], longest: f64, k: u32) -> Self {
        let dim = generator.nrows();
        let mut ladder = Ladders::new(generator, fast, longest, ENERGY_SQUARED, 0);
        let squared = halvings(ladder.norm() / ENERGY_SQUARED);
        let nothing = Dense::zeros(dim, dim);
        Self {
            increment: ladder.increment(k).unwrap_or_else(|| nothing.clone()),
            ladder,
            squared,
            k,
            buffers: [nothing.clone(), nothing.clone(), nothing],
        }
    }

    /// exp(𝒜t) − I from that of half the time; where it is computed anew and beyond doubles, as the flow itself is then, nothing.
    fn go_on(&mut self) {
        self.k -= 1;
        if self.k >= self.squared {
            let square = &mut self.buffers[0];
            square.set_product(&self.increment, &self.increment);
            self.increment.combine(2.0, 1.0, square);
        } else if let Some(increment) = self.ladder.increment(self.k) {
            self.increment = increment;
        }
    }
}
