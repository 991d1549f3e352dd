//! Where the state can jump, and in which metric: impulses live in the solution cone of LCP(0, D).

use nalgebra::{DMatrix, DVector};

use super::facts::Facts;
use super::program::Inequalities;
use crate::passivity::scale;
use crate::settings::tolerances::ranks::RANK;

/// Which impulses the devices can carry and which states they move.
#[derive(Debug, Clone, Default, PartialEq, Eq, serde::Serialize)]
pub struct Jumps {
    /// Devices whose λ can be an impulse.
    pub devices: Vec<String>,
    /// States that such impulses change.
    pub states: Vec<String>,
    /// Sources whose edges can cause a jump (an inadmissible initial state can as well).
    pub sources: Vec<String>,
    /// `stored energy`, `P of the passivity inequality`, or `none`: the metric in which x⁺ is the projection of x⁻.
    pub metric: String,
    /// Whether the impulses could be analysed (D ⪰ 0 or D a P-matrix).
    pub analysed: bool,
}

/// Ports beyond which the cone of impulses is not analysed: it takes one linear program per port.
const LARGEST: usize = 60;

/// Finds the support of {λ ≥ 0 : Dλ ≥ 0, λᵀDλ = 0} (Brogliato-Thibault (24)-(26) is the case D = 0).
pub(super) fn find(facts: &Facts) -> Jumps {
    let metric = match facts.certificate() {
        Some(c) if c.from == crate::passivity::Origin::StoredEnergy => "stored energy",
        Some(_) => "P of the passivity inequality",
        None => "none",
    };
    let mut jumps = Jumps {
        metric: metric.into(),
        analysed: true,
        ..Jumps::default()
    };
    let system = &facts.system;
    let (n, m) = (system.n(), system.m());
    if facts.feedthrough.p_matrix == Some(true) || m == 0 {
        return jumps;
    }
    if m > LARGEST || !facts.feedthrough.psd || facts.laws.iter().any(|l| !l.half_line) {
        jumps.analysed = false;
        return jumps;
    }
    let (values, vectors) = scale::eigen(&(&system.d + system.d.transpose()));
    let size = system.d.amax();
    let kernel: Vec<usize> = (0..m).filter(|&k| values[k].abs() <= RANK * size).collect();
    let basis = vectors.select_columns(&kernel);
    let mut g = DMatrix::zeros(2 * m, basis.ncols());
    g.view_mut((0, 0), basis.shape()).copy_from(&basis);
    // Dλ for λ in the kernel, cleaned of rounding so that its signs mean something.
    let image = &system.d * &basis;
    g.view_mut((m, 0), basis.shape())
        .copy_from(&image.map(|v| if v.abs() <= RANK * size { 0.0 } else { v }));
    for j in 0..m {
        let mut strict = vec![false; 2 * m];
        strict[j] = true;
        let cone = Inequalities {
            g: g.clone(),
            h: DVector::zeros(2 * m),
            strict,
        };
        if basis.row(j).amax() > RANK && cone.widest().is_some_and(|p| p.is_strict()) {
            jumps.devices.push(facts.laws[j].device.clone());
            for i in 0..n {
                if system.b[(i, j)] != 0.0 && !jumps.states.contains(&facts.state_names[i]) {
                    jumps.states.push(facts.state_names[i].clone());
                }
            }
        }
    }
    jumps.sources = facts.edges().into_iter().map(String::from).collect();
    jumps
}
