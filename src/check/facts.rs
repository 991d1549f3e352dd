//! What the theorems ask about, computed once: the normal form of the ports, constants apart from driven terms, the
//! verdict on passivity, and the role swaps under which a hypothesis may be tried.

use nalgebra::{DMatrix, DVector};

use super::excitation::Excitation;
use super::feedthrough::Feedthrough;
use super::laws::{PortLaw, port_law};
use crate::law::Law;
use crate::lcs::{Lcs, Role};
use crate::passivity::{self, Certificate, Strict, System, Verdict, gradient, strict};

/// Ports up to which every set of role swaps is tried; beyond it none and single ones.
const ALL_SWAPS: usize = 8;

/// Numbers held for all swaps together beyond which fewer are tried (160 MB).
const SWAP_NUMBERS: usize = 20_000_000;

/// A system with λ and y exchanged at some ports, and the laws to go with it.
#[derive(Debug, Clone)]
pub(super) struct Swap {
    /// The exchanged ports.
    pub(super) ports: Vec<usize>,
    pub(super) system: System,
    /// Constant part of y.
    pub(super) f: DVector<f64>,
    /// Driven part of y: columns for the sources that change.
    pub(super) g: DMatrix<f64>,
    pub(super) laws: Vec<PortLaw>,
}

impl Swap {
    /// "" or " (λ and y exchanged at d1, d3)".
    pub(super) fn note(&self) -> String {
        if self.ports.is_empty() {
            return String::new();
        }
        let names: Vec<&str> = self
            .ports
            .iter()
            .map(|&j| self.laws[j].device.as_str())
            .collect();
        format!(" (with λ and y exchanged at {})", names.join(", "))
    }
}

/// Everything the theorems are checked against.
#[derive(Debug, Clone)]
pub(super) struct Facts {
    /// Normal form: constant offsets of diodes moved into F and e, on-resistances into D.
    pub(super) system: System,
    /// n: constant term of x', constant sources included.
    pub(super) e: DVector<f64>,
    /// m: constant term of y, constant sources and forward drops included.
    pub(super) f: DVector<f64>,
    /// n×q and m×q: columns of the sources that change in time.
    pub(super) e_driven: DMatrix<f64>,
    pub(super) g_driven: DMatrix<f64>,
    /// Names and ranges of those sources.
    pub(super) driven: Vec<(String, Excitation)>,
    pub(super) laws: Vec<PortLaw>,
    /// What was added to λ of each port in the normal form.
    pub(super) offsets: Vec<f64>,
    pub(super) energy: DMatrix<f64>,
    pub(super) verdict: Verdict,
    pub(super) strict: Option<Strict>,
    pub(super) feedthrough: Feedthrough,
    pub(super) state_names: Vec<String>,
    /// [`Swap`]s to try, the given roles first.
    pub(super) swaps: Vec<Swap>,
}

impl Facts {
    /// Collects the facts; decides passivity.
    pub(super) fn collect(lcs: &Lcs) -> Self {
        let (n, m) = (lcs.n(), lcs.m());
        let mut system = System::of(lcs);
        let (mut e, mut f) = (lcs.e0.clone(), lcs.f.clone());
        let mut laws = Vec::with_capacity(m);
        let mut offsets = vec![0.0; m];
        for (j, port) in lcs.ports.iter().enumerate() {
            let mut law = port_law(&port.device, port.role, &port.law);
            if port.role == Role::Function {
                system.b.column_mut(j).neg_mut();
                system.d.column_mut(j).neg_mut();
            }
            if let (
                Law::Diode {
                    vfwd,
                    ron,
                    roff: None,
                },
                Role::Current | Role::Voltage,
            ) = (&port.law, port.role)
            {
                let offset = vfwd.f64;
                match port.role {
                    // y + vfwd + ron λ ≥ 0 ⟂ λ ≥ 0.
                    Role::Current => {
                        system.d[(j, j)] += ron.f64;
                        f[j] += offset;
                        law.half_line = true;
                    }
                    // λ + vfwd ≥ 0 ⟂ y ≥ 0; an on-resistance would mix y into λ and stays a law.
                    _ if ron.f64 == 0.0 => {
                        f -= system.d.column(j) * offset;
                        e -= system.b.column(j) * offset;
                        offsets[j] = offset;
                        law.half_line = true;
                    }
                    _ => {}
                }
                if law.half_line {
                    (law.lambda, law.y) = ((0.0, f64::INFINITY), (0.0, f64::INFINITY));
                    // φ^{*,−}(z) = Fz on z ≥ 0 once the offset F is counted in: the theorems look at F.
                    (law.through_origin, law.strictly, law.strictly_swapped) = (true, false, false);
                }
            }
            laws.push(law);
        }
        let mut driven = Vec::new();
        let mut columns = Vec::new();
        for (k, input) in lcs.inputs.iter().enumerate() {
            let excitation = Excitation::of(&input.source);
            if excitation.is_constant() {
                e += lcs.e.column(k) * excitation.low;
                f += lcs.g.column(k) * excitation.low;
            } else {
                driven.push((input.name.clone(), excitation));
                columns.push(k);
            }
        }
        let verdict = passivity::decide(&system, Some(&lcs.energy));
        let strict = verdict
            .certificate()
            .map(|c| strict::maximise(&system, &c.p, c.from));
        let g_driven = lcs.g.select_columns(&columns);
        let mut facts = Self {
            e_driven: lcs.e.select_columns(&columns),
            feedthrough: Feedthrough::of(&lcs.d),
            swaps: Vec::new(),
            // A system file need not name its energy.
            energy: if lcs.energy.shape() == (n, n) {
                lcs.energy.clone()
            } else {
                DMatrix::zeros(n, n)
            },
            state_names: lcs.states.iter().map(|s| s.name.clone()).collect(),
            system,
            e,
            f,
            g_driven,
            driven,
            laws,
            offsets,
            verdict,
            strict,
        };
        facts.swaps = facts.all_swaps();
        facts
    }

    /// The certificate, if the system is passive.
    pub(super) fn certificate(&self) -> Option<&Certificate> {
        self.verdict.certificate()
    }

    /// Whether nothing moves by itself: no source changes in time.
    pub(super) fn is_autonomous(&self) -> bool {
        self.e_driven.amax() == 0.0 && self.g_driven.amax() == 0.0
    }

    /// x = 0 with λ = 0 is a solution and every law passes through it (Assumption 7); not asked of driven terms.
    pub(super) fn rests_at_zero(&self) -> bool {
        self.e.amax() == 0.0
            && self.laws.iter().zip(self.f.iter()).all(|(law, &f)| {
                if law.half_line {
                    f >= 0.0
                } else {
                    law.through_origin && f == 0.0
                }
            })
    }

    /// Whether a changing source enters y.
    pub(super) fn drives_y(&self) -> bool {
        !self.g_driven.is_empty() && self.g_driven.amax() > 0.0
    }

    /// The sources that enter y and have edges.
    pub(super) fn edges(&self) -> Vec<&str> {
        self.driven
            .iter()
            .enumerate()
            .filter(|(k, (_, x))| x.jumps && self.g_driven.column(*k).amax() > 0.0)
            .map(|(_, (name, _))| name.as_str())
            .collect()
    }

    /// Some P ≻ 0 with PB = Cᵀ for the given ports of a swap: the stored energy if it fits, then the certificate's P, then
    /// any.
    pub(super) fn storage(&self, swap: &Swap, ports: &[usize]) -> Option<DMatrix<f64>> {
        let b = swap.system.b.select_columns(ports);
        let c = swap.system.c.select_rows(ports);
        gradient::storage(&b, &c, Some(&self.energy)).or_else(|| {
            self.certificate()
                .and_then(|p| gradient::storage(&b, &c, Some(&p.p)))
        })
    }

    fn all_swaps(&self) -> Vec<Swap> {
        let (n, m) = (self.system.n(), self.system.m());
        let each = (n + m) * (n + m);
        let sets: Vec<Vec<usize>> = if m <= ALL_SWAPS && each << m <= SWAP_NUMBERS {
            let mut masks: Vec<usize> = (0..1_usize << m).collect();
            masks.sort_by_key(|mask| mask.count_ones());
            masks
                .iter()
                .map(|mask| (0..m).filter(|j| mask >> j & 1 == 1).collect())
                .collect()
        } else {
            let singles = if each * m <= SWAP_NUMBERS { m } else { 0 };
            std::iter::once(Vec::new())
                .chain((0..singles).map(|j| vec![j]))
                .collect()
        };
        sets.into_iter()
            .filter_map(|ports| self.swap(ports))
            .collect()
    }

    /// Exchanges λ and y at some ports.
    fn swap(&self, ports: Vec<usize>) -> Option<Swap> {
        // The terms of y besides Cx and Dλ pivot like further columns of C.
        let (n, m) = (self.system.n(), self.system.m());
        let extra = 1 + self.g_driven.ncols();
        let mut wide = self.system.clone();
        wide.a = wide.a.resize(n + extra, n + extra, 0.0);
        wide.b = wide.b.resize_vertically(n + extra, 0.0);
        wide.c = wide.c.resize_horizontally(n + extra, 0.0);
        wide.c.set_column(n, &self.f);
        for k in 0..self.g_driven.ncols() {
            wide.c.set_column(n + 1 + k, &self.g_driven.column(k));
        }
        let pivoted = wide.pivot(&ports)?;
        let mut laws = self.laws.clone();
        for &j in &ports {
            laws[j] = laws[j].swapped();
        }
        Some(Swap {
            ports,
            f: pivoted.c.column(n).into_owned(),
            g: pivoted.c.columns(n + 1, extra - 1).into_owned(),
            system: System {
                a: pivoted.a.view((0, 0), (n, n)).into_owned(),
                b: pivoted.b.rows(0, n).into_owned(),
                c: pivoted.c.columns(0, n).into_owned(),
                d: pivoted.d.view((0, 0), (m, m)).into_owned(),
            },
            laws,
        })
    }
}
