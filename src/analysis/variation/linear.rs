//! A stretch of a run as w' = 𝒜 w, w = [x | z] with the sources z, and what is read of it as rows over w.

use nalgebra::{DMatrix, DVector};

use super::System;
use super::course::Stretch;
use super::system::apart;
use crate::integrate::exact::{Exosystem, Shape, Spectrum, over_w};
use crate::integrate::{Error, Reason};
use crate::linalg::decouple::Decoupled;
use crate::linalg::expm::Ladders;
use crate::linalg::powers::halvings;
use crate::linalg::product::add_product;
use crate::measure::{INTERVALS, VALUES};
use crate::settings::tolerances::exponentials::{SERIES, SQUARED};

/// w' = 𝒜 w, in the basis in which fast states owe nothing to the others.
#[derive(Debug, Clone)]
pub(crate) struct Linear {
    /// The system, and the sources that it was made for.
    pub(super) system: usize,
    pub(super) exosystem: Exosystem,
    /// 𝒜.
    pub(crate) generator: DMatrix<f64>,
    pub(super) basis: Option<Decoupled>,
    fast: Vec<usize>,
    /// The outputs, their rates and the rates of these over w.
    pub(crate) rows: [DMatrix<f64>; 3],
    pub(crate) spectrum: Spectrum,
}

/// Halvings of a piece that lead from one of its values to the next.
pub(super) const LEVELS: u32 = INTERVALS.ilog2();

/// Motion over a span of time, halved again and again.
pub(crate) struct Motion<'a> {
    pub(crate) linear: &'a Linear,
    /// s.
    pub(crate) seconds: f64,
    ladders: Ladders,
    /// By halving: exp(𝒜 t/2^k) − I and its transpose.
    steps: Vec<Option<[DMatrix<f64>; 2]>>,
    /// By halving: the outputs and their rates at the nodes of a piece.
    readings: Vec<Option<Readings>>,
    /// Halvings after which Taylor's series holds.
    pub(crate) bottom: u32,
}

/// Outputs and their rates at the nodes of a piece over w where it begins, and the transpose of the outputs'.
#[derive(Default)]
struct Readings {
    values: DMatrix<f64>,
    rates: DMatrix<f64>,
    back: DMatrix<f64>,
}

/// A piece of a stretch in one mode that outputs are seen in.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Part {
    /// Since the mode began, s.
    pub(crate) age: f64,
    /// How often the unit of all pieces is halved for its length.
    pub(crate) level: u32,
    /// Its length, s; the last one ends beyond the stretch.
    pub(crate) length: f64,
}

/// The pieces of a stretch of so many seconds from an age on: their lengths are halvings of `unit`, which double with the age and resolve what still turns, as steps
/// of the integrator do, and are no shorter than what is left where that is allowed.
pub(crate) fn parts(
    spectrum: &Spectrum,
    unit: f64,
    (from, seconds): (f64, f64),
) -> impl Iterator<Item = Part> {
    let at = move |age: f64| {
        let limit = spectrum.curve_limit(age);
        let level = (unit / limit.min(seconds - age)).log2().floor().max(0.0);
        let beyond = unit * (-level).exp2() > limit;
        let level = level as u32 + u32::from(beyond);
        let length = unit * (-f64::from(level)).exp2();
        (age < seconds).then_some(Part { age, level, length })
    };
    std::iter::successors(at(from), move |part| at(part.age + part.length))
}

/// The span of which all lengths of pieces are halvings, s, where the longest stretch takes so many seconds.
pub(crate) fn unit(longest: f64) -> f64 {
    longest.log2().ceil().exp2()
}

/// The flow of a mode cannot be computed.
pub(super) fn beyond_doubles() -> Error {
    let what = "the exponential of a mode does not exist in doubles";
    Error::before(Reason::NotSmooth(what.into()))
}

impl Linear {
    /// Of a stretch, from those that are known; and w where it begins.
    pub(crate) fn of(
        known: &mut Vec<Self>,
        systems: &[System],
        stretch: &Stretch,
    ) -> (usize, DVector<f64>) {
        let own = |l: &&Self| l.system == stretch.system;
        let held = |l: &Self| own(&l) && l.exosystem.holds(&stretch.pieces);
        let at = known.iter().position(held).unwrap_or_else(|| {
            let shapes: Vec<Shape> = stretch.pieces.iter().map(|p| Shape::of([p])).collect();
            let exosystem = Exosystem::new(&shapes, stretch.pieces.clone());
            let alike = |l: &Self| own(&l) && l.exosystem.is_alike(&exosystem);
            known.iter().position(alike).unwrap_or_else(|| {
                let system = &systems[stretch.system];
                known.push(Self::new(system, stretch.system, exosystem));
                known.len() - 1
            })
        });
        let exosystem = &mut known[at].exosystem;
        exosystem.set_pieces(&stretch.pieces);
        let n = stretch.start.len();
        let mut w = stretch
            .start
            .clone()
            .resize_vertically(n + exosystem.dim(), 0.0);
        exosystem.write(stretch.from, &mut w.as_mut_slice()[n..]);
        if let Some(basis) = &known[at].basis {
            w = &basis.from * w;
        }
        (at, w)
    }

    fn new(system: &System, at: usize, exosystem: Exosystem) -> Self {
        let lcs = &system.lcs;
        let (n, dz) = (lcs.n(), exosystem.dim());
        let mut generator = DMatrix::zeros(n + dz, n + dz);
        generator.view_mut((0, 0), (n, n)).copy_from(&lcs.a);
        let mut input = &system.inputs * exosystem.output();
        let mut constant = input.column_mut(0);
        constant += &lcs.e0;
        generator.view_mut((0, n), (n, dz)).copy_from(&input);
        generator
            .view_mut((n, n), (dz, dz))
            .copy_from(exosystem.generator());
        let (basis, fast) = apart(&generator, [system.fast.clone(), lcs.fast.clone()]);
        let mut rows = over_w(&lcs.outputs.rows, n, &exosystem);
        if let Some(basis) = &basis {
            generator.copy_from(&basis.generator);
            rows *= &basis.to;
        }
        let rates = &rows * &generator;
        let second = &rates * &generator;
        let moves = generator.view((0, 0), (n, n)).into_owned();
        Self {
            system: at,
            fast,
            basis,
            rows: [rows, rates, second],
            spectrum: Spectrum::new(&moves, exosystem.rates()),
            exosystem,
            generator,
        }
    }

    /// Of a generator alone, with the outputs, their rates and the rates of these.
    #[cfg(test)]
    pub(super) fn of_generator(
        generator: DMatrix<f64>,
        rows: [DMatrix<f64>; 3],
        spectrum: Spectrum,
    ) -> Self {
        Self {
            system: 0,
            exosystem: Exosystem::default(),
            fast: Vec::new(),
            basis: None,
            rows,
            spectrum,
            generator,
        }
    }

    /// Motion over so many seconds.
    pub(crate) fn over(&self, seconds: f64) -> Motion<'_> {
        let ladders = Ladders::new(&self.generator, &self.fast, seconds, SQUARED, 0);
        Motion {
            linear: self,
            seconds,
            steps: Vec::new(),
            readings: Vec::new(),
            bottom: halvings(ladders.norm() / SERIES),
            ladders,
        }
    }
}

/// The transposes of rows over w at the nodes of a piece over w where it begins, N×(rows·[`VALUES`]), by row and node, where `step_back` leads from one node to the one
/// before.
fn at_nodes(rows: &DMatrix<f64>, step_back: &DMatrix<f64>) -> DMatrix<f64> {
    let dim = rows.ncols();
    let mut all = DMatrix::zeros(dim, rows.nrows() * VALUES);
    for (row, nodes) in rows
        .row_iter()
        .zip(all.as_mut_slice().chunks_mut((dim * VALUES).max(1)))
    {
        let mut own = row.transpose();
        for node in nodes.chunks_exact_mut(dim) {
            node.copy_from_slice(own.as_slice());
            add_product(own.as_mut_slice(), step_back, node);
        }
    }
    all
}

impl Motion<'_> {
    fn both(&mut self, k: u32) -> Result<&[DMatrix<f64>; 2], Error> {
        let at = k as usize;
        if self.steps.len() <= at {
            self.steps.resize(at + 1, None);
        }
        if self.steps[at].is_none() {
            let increment = self.ladders.increment(k).ok_or_else(beyond_doubles)?;
            let dim = self.linear.generator.nrows();
            let step = DMatrix::from_fn(dim, dim, |i, j| increment.column(j)[i]);
            let transposed = step.transpose();
            self.steps[at] = Some([step, transposed]);
        }
        Ok(self.steps[at].get_or_insert_default())
    }

    /// exp(𝒜 t/2^k) − I.
    ///
    /// # Errors
    /// It does not exist in doubles.
    pub(crate) fn step(&mut self, k: u32) -> Result<&DMatrix<f64>, Error> {
        Ok(&self.both(k)?[0])
    }

    /// Its transpose, which takes costates back.
    ///
    /// # Errors
    /// It does not exist in doubles.
    pub(super) fn step_back(&mut self, k: u32) -> Result<&DMatrix<f64>, Error> {
        Ok(&self.both(k)?[1])
    }

    fn readings(&mut self, k: u32) -> Result<&Readings, Error> {
        let at = k as usize;
        if self.readings.len() <= at {
            self.readings.resize_with(at + 1, || None);
        }
        if self.readings[at].is_none() {
            let [values, rates, _] = &self.linear.rows;
            let step = self.step_back(k + LEVELS)?;
            let [back, rates] = [values, rates].map(|rows| at_nodes(rows, step));
            self.readings[at] = Some(Readings {
                values: back.transpose(),
                rates: rates.transpose(),
                back,
            });
        }
        Ok(self.readings[at].get_or_insert_default())
    }

    /// The m outputs, and their rates, at the nodes of a piece of t/2^k seconds over w where it begins: by output and node, m·[`VALUES`]×N.
    ///
    /// # Errors
    /// The exponential does not exist in doubles.
    pub(crate) fn seen(&mut self, k: u32) -> Result<[&DMatrix<f64>; 2], Error> {
        let Readings { values, rates, .. } = self.readings(k)?;
        Ok([values, rates])
    }

    /// The transpose of the outputs' there, which takes what weighs them to costates.
    ///
    /// # Errors
    /// The exponential does not exist in doubles.
    pub(super) fn seen_back(&mut self, k: u32) -> Result<&DMatrix<f64>, Error> {
        Ok(&self.readings(k)?.back)
    }

    /// w after t/2^k seconds.
    pub(crate) fn after(&mut self, k: u32, w: &DVector<f64>) -> Result<DVector<f64>, Error> {
        let mut after = w.clone();
        add_product(after.as_mut_slice(), self.step(k)?, w.as_slice());
        Ok(after)
    }

    /// s at halving k.
    pub(crate) fn part(&self, k: u32) -> f64 {
        self.seconds * (-f64::from(k)).exp2()
    }

    /// Taylor's coefficients of w over so many seconds, at most the bottom's, as columns: w(s t) = Σ s^k w_k.
    pub(crate) fn series(&self, w: &DVector<f64>, seconds: f64) -> DMatrix<f64> {
        series(&self.linear.generator, w.as_slice(), seconds)
    }
}

/// Terms of a series beyond which nothing is left where ‖𝒜‖ t ≤ ⅛.
pub(super) const TERMS: usize = 16;

/// The same of w' = 𝒜 w.
pub(super) fn series(generator: &DMatrix<f64>, w: &[f64], seconds: f64) -> DMatrix<f64> {
    let mut terms = DMatrix::zeros(w.len(), TERMS);
    if w.is_empty() {
        return terms;
    }
    let mut columns = terms.as_mut_slice().chunks_exact_mut(w.len());
    let mut before: &[f64] = w;
    if let Some(first) = columns.next() {
        first.copy_from_slice(w);
    }
    for (k, term) in columns.enumerate() {
        add_product(term, generator, before);
        term.iter_mut()
            .for_each(|value| *value *= seconds / (k + 1) as f64);
        before = term;
    }
    terms
}
