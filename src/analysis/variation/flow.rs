//! A stretch in one mode with a change beside it, as one linear equation w' = 𝒢 w, w = [x | z | δx], z the state of the sources.
//!
//! A circuit that switches periodically comes to few such equations, and passes through them in few lengths of time: the exponentials that recur are kept.

use nalgebra::{DMatrix, DVector};

use super::System;
use super::linear::beyond_doubles;
use super::system::apart;
use crate::integrate::Error;
use crate::linalg::decouple::Decoupled;
use crate::linalg::expm::Ladders;
use crate::settings::tolerances::exponentials::SQUARED;

/// What the sources are to an equation.
#[derive(Debug, PartialEq)]
pub(super) struct Sources {
    /// u over z, p×dz.
    pub(super) own: DMatrix<f64>,
    /// δu over z.
    pub(super) change: DMatrix<f64>,
    /// z' over z.
    pub(super) generator: DMatrix<f64>,
}

/// An equation, in the basis in which fast states owe nothing to the others, and the exponentials that were made of it.
#[derive(Debug)]
pub(super) struct Flow {
    system: usize,
    sources: Sources,
    generator: DMatrix<f64>,
    basis: Option<Decoupled>,
    fast: Vec<usize>,
    /// δy over w.
    rows: DMatrix<f64>,
    /// exp(𝒢 t) − 1 by t, s; the oldest first.
    steps: Vec<(f64, DMatrix<f64>)>,
}

/// The equations so far.
#[derive(Debug, Default)]
pub(super) struct Flows(Vec<Flow>);

impl Flows {
    /// Values of exponentials that an equation keeps.
    const KEPT: usize = 1 << 20;
    /// Equations that are kept.
    const MOST: usize = 64;

    /// The place of the equation of a system, by its number, with these sources, which is made where it is not known.
    pub(super) fn place(
        &mut self,
        (number, system): (usize, &System),
        sources: Sources,
        equation: impl FnOnce(&Sources) -> (DMatrix<f64>, DMatrix<f64>),
    ) -> usize {
        let known = |flow: &Flow| flow.system == number && flow.sources == sources;
        if let Some(at) = self.0.iter().position(known) {
            return at;
        }
        if self.0.len() == Self::MOST {
            self.0.remove(0);
        }
        let (mut generator, mut rows) = equation(&sources);
        // Of x and of δx.
        let second = generator.nrows() - system.lcs.n();
        let both = |fast: &[usize]| {
            let again = fast.iter().map(|k| second + k);
            fast.iter().copied().chain(again).collect()
        };
        let (basis, fast) = apart(&generator, [both(&system.fast), both(&system.lcs.fast)]);
        if let Some(basis) = &basis {
            generator.copy_from(&basis.generator);
            rows *= &basis.to;
        }
        self.0.push(Flow {
            system: number,
            sources,
            generator,
            basis,
            fast,
            rows,
            steps: Vec::new(),
        });
        self.0.len() - 1
    }

    pub(super) fn at(&mut self, place: usize) -> &mut Flow {
        &mut self.0[place]
    }
}

impl Flow {
    /// [x | z | δx] in the basis of the equation.
    pub(super) fn entered(&self, w: DVector<f64>) -> DVector<f64> {
        match &self.basis {
            Some(basis) => &basis.from * w,
            None => w,
        }
    }

    /// The last n components of [x | z | δx].
    pub(super) fn left(&self, w: &DVector<f64>, n: usize) -> DVector<f64> {
        let first = w.len() - n;
        match &self.basis {
            Some(basis) => basis.to.rows(first, n) * w,
            None => w.rows(first, n).into_owned(),
        }
    }

    /// Takes w so many seconds further, with what is known for a time that differs by no more than `same`, s.
    ///
    /// # Errors
    /// [`Reason::NotSmooth`](crate::integrate::Reason::NotSmooth) where the exponential does not exist in doubles.
    pub(super) fn advance(
        &mut self,
        w: &mut DVector<f64>,
        seconds: f64,
        same: f64,
    ) -> Result<(), Error> {
        let near = |(known, _): &(f64, DMatrix<f64>)| (known - seconds).abs() <= same;
        let at = match self.steps.iter().position(near) {
            Some(at) => at,
            None => {
                let step = self.step(seconds)?;
                if self.steps.len() * step.len() >= Flows::KEPT {
                    self.steps.remove(0);
                }
                self.steps.push((seconds, step));
                self.steps.len() - 1
            }
        };
        *w += &self.steps[at].1 * &*w;
        Ok(())
    }

    /// exp(𝒢 t) − 1.
    fn step(&self, seconds: f64) -> Result<DMatrix<f64>, Error> {
        let dim = self.generator.nrows();
        let increment = Ladders::new(&self.generator, &self.fast, seconds, SQUARED, 0).increment(0);
        let increment = increment.ok_or_else(beyond_doubles)?;
        Ok(DMatrix::from_fn(dim, dim, |i, j| increment.column(j)[i]))
    }

    /// δy at w.
    pub(super) fn sample(&self, w: &DVector<f64>) -> DVector<f64> {
        &self.rows * w
    }

    /// How many outputs there are.
    pub(super) fn outputs(&self) -> usize {
        self.rows.nrows()
    }
}
