//! What an event makes of a variation.
//!
//! At an event that a guard γ(x, u, u') = 0 decides, with rates f⁻ and f⁺ on its two sides, x⁺ = J⁺ s⁻ + j⁺ and s⁻ = X⁻ x⁻ + U⁻ u + k⁻,
//!
//! ```text
//! δt  = −(γ_x δx⁻ + γ_u δu + γ_u' δu')/γ̇,
//! δx⁺ = J⁺ (X⁻ (δx⁻ + f⁻ δt) + U⁻ (δu + u' δt)) − f⁺ δt
//! ```
//!
//! at the time at which the event was without the variation (R. I. Leine, H. Nijmeijer, Dynamics and Bifurcations of Non-Smooth Mechanical
//! Systems, 2004, section 7.5). Where sources alone decide it, and jump, δt = 0.

use nalgebra::{Complex, DMatrix, DVector, RowDVector};

use super::instant::Inputs;
use super::system::{Row, System};
use crate::integrate::exact::Owner;
use crate::linalg::product::{add_product, product};

/// When an event happens: δt = x δx⁻ + u δu + u' δu'.
#[derive(Debug, Clone)]
pub(crate) struct Timing {
    pub(crate) x: RowDVector<f64>,
    pub(crate) u: RowDVector<f64>,
    pub(crate) du: RowDVector<f64>,
    /// Whose guard it is, which of that one's, and γ̇.
    pub(super) guard: (Owner, usize),
    pub(super) slope: f64,
}

/// δx⁺ = X δx⁻ + U δu + U' δu'.
#[derive(Debug, Clone)]
pub(crate) struct Saltation {
    /// Time, s.
    pub(crate) t: f64,
    /// n⁺×n⁻; this, what follows sources and the step of the outputs are empty where events that coincide by chance are kept, as nothing takes them there.
    pub(crate) x: DMatrix<f64>,
    /// n⁺×p.
    pub(crate) u: DMatrix<f64>,
    /// n⁺×p.
    pub(crate) du: DMatrix<f64>,
    /// `None` where δt = 0.
    pub(crate) timing: Option<Timing>,
    /// Guards that fall through zero at the same time, and part when some source varies alone.
    pub(super) others: Vec<Timing>,
    /// The place of the system in whose directions the storage jumps, where that is not the one that follows.
    pub(super) through: Option<usize>,
    /// Of the outputs: y⁻ − y⁺.
    pub(crate) step: DVector<f64>,
    /// Areas of the outputs' impulses, and what they are made of.
    pub(crate) impulse: Option<Impulse>,
}

/// The areas a = I (s⁻ − s⁺) of the outputs' impulses: δa = I (δs⁻ + ṡ⁻ δt − δs⁺ − ṡ⁺ δt).
#[derive(Debug, Clone)]
pub(crate) struct Impulse {
    pub(crate) areas: DVector<f64>,
    /// I, outputs×q.
    rows: DMatrix<f64>,
    /// X⁻, U⁻, X⁺, U⁺.
    storage: [DMatrix<f64>; 4],
    /// ṡ⁻ − ṡ⁺.
    rate: DVector<f64>,
}

/// One side of an event.
pub(super) struct Side<'a> {
    pub(super) system: &'a System,
    pub(super) x: DVector<f64>,
    pub(super) inputs: Inputs,
}

impl Side<'_> {
    pub(super) fn rate(&self) -> DVector<f64> {
        self.system.rate(&self.x, &self.inputs.u)
    }

    /// ṡ.
    pub(super) fn storage_rate(&self) -> DVector<f64> {
        let mut rate = product(&self.system.storage_inputs, &self.inputs.du);
        let x = self.rate();
        add_product(
            rate.as_mut_slice(),
            &self.system.lcs.storage.x,
            x.as_slice(),
        );
        rate
    }
}

impl Timing {
    /// Of a guard that falls through zero at `rate`.
    pub(super) fn of(owner: (Owner, usize), guard: &Row, rate: f64) -> Self {
        Self {
            guard: owner,
            slope: rate,
            x: guard.x.transpose() / -rate,
            u: guard.u.transpose() / -rate,
            du: guard.du.transpose() / -rate,
        }
    }

    /// The same where these sources vary alone.
    pub(super) fn of_sources(&self, vary: impl Fn(usize) -> bool) -> Self {
        let mut timing = self.clone();
        for input in (0..self.u.len()).filter(|&input| !vary(input)) {
            (timing.u[input], timing.du[input]) = (0.0, 0.0);
        }
        timing
    }
}

impl Saltation {
    /// Nothing happens, in the states of a system.
    pub(super) fn none(t: f64, system: &System) -> Self {
        let (n, p) = (system.lcs.n(), system.lcs.p());
        Self {
            t,
            x: DMatrix::identity(n, n),
            u: DMatrix::zeros(n, p),
            du: DMatrix::zeros(n, p),
            timing: None,
            others: Vec::new(),
            through: None,
            step: DVector::zeros(system.lcs.outputs.rows.one.len()),
            impulse: None,
        }
    }

    /// When the event between two sides happens, and its impulse.
    pub(super) fn happens(
        t: f64,
        (before, after): (&Side<'_>, &Side<'_>),
        timing: Option<Timing>,
    ) -> Self {
        Self {
            t,
            x: DMatrix::default(),
            u: DMatrix::default(),
            du: DMatrix::default(),
            timing,
            others: Vec::new(),
            through: None,
            step: DVector::default(),
            impulse: Impulse::of(before, after),
        }
    }

    /// The event between two sides, where the storage jumps as J⁺ s if `through` is none, else first as in that mode.
    pub(super) fn of(
        t: f64,
        (before, after): (&Side<'_>, &Side<'_>),
        timing: Option<Timing>,
        through: Option<&System>,
    ) -> Self {
        let (left, right) = (&before.system.lcs, &after.system.lcs);
        let inject = match through {
            Some(jump) => &right.storage.inject * &jump.lcs.storage.x * &jump.lcs.storage.inject,
            None => right.storage.inject.clone(),
        };
        let mut x = &inject * &left.storage.x;
        let mut u = &inject * &before.system.storage_inputs;
        if let Some(jump) = through {
            u += &right.storage.inject * &jump.storage_inputs;
        }
        let mut du = DMatrix::zeros(x.nrows(), u.ncols());
        if let Some(timing) = &timing {
            let drift = &inject * before.storage_rate() - after.rate();
            x += &drift * &timing.x;
            u += &drift * &timing.u;
            du += &drift * &timing.du;
        }
        let outputs = |side: &Side<'_>| side.system.outputs(&side.x, &side.inputs);
        Self {
            x,
            u,
            du,
            step: outputs(before) - outputs(after),
            ..Self::happens(t, (before, after), timing)
        }
    }
}

impl Impulse {
    fn of(before: &Side<'_>, after: &Side<'_>) -> Option<Self> {
        let rows = &after.system.lcs.outputs.impulse;
        let storage = |side: &Side<'_>| side.system.storage(&side.x, &side.inputs.u);
        if rows.is_empty() {
            return None;
        }
        let jump = storage(before) - storage(after);
        if rows.ncols() != jump.len() || jump.iter().all(|d| *d == 0.0) {
            return None;
        }
        let areas = rows * &jump;
        let parts = |side: &Side<'_>| {
            let system = side.system;
            [system.lcs.storage.x.clone(), system.storage_inputs.clone()]
        };
        let ([x, u], [x_after, u_after]) = (parts(before), parts(after));
        Some(Self {
            areas,
            rows: rows.clone(),
            storage: [x, u, x_after, u_after],
            rate: before.storage_rate() - after.storage_rate(),
        })
    }

    /// How the areas vary.
    pub(crate) fn variation(
        &self,
        (before, after): (&DVector<Complex<f64>>, &DVector<Complex<f64>>),
        du: &DVector<Complex<f64>>,
        dt: Complex<f64>,
    ) -> DVector<Complex<f64>> {
        let [x, u, x_after, u_after] = &self.storage;
        let left = times(x, before) + times(u, du);
        let right = times(x_after, after) + times(u_after, du);
        times(
            &self.rows,
            &(left - right + self.rate.map(|rate| dt * rate)),
        )
    }
}

/// A real matrix times a complex vector.
pub(crate) fn times(
    matrix: &DMatrix<f64>,
    vector: &DVector<Complex<f64>>,
) -> DVector<Complex<f64>> {
    let row = |i: usize, _| {
        let terms = matrix.row(i);
        let terms = terms.iter().zip(vector.iter());
        terms.map(|(entry, value)| value * *entry).sum()
    };
    DVector::from_fn(matrix.nrows(), row)
}
