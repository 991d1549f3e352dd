//! Published circuits as systems written down by hand, for tests and benches of the steppers.
//!
//! Used from integration tests and, by path, from the library's own tests.
#![allow(
    dead_code,
    missing_docs,
    unreachable_pub,
    reason = "every user takes its part"
)]

use nalgebra::{DMatrix, DVector, dmatrix};

use circ::law::Law;
use circ::lcs::{Lcs, LcsParts, Outputs, Port, PowerKind, PowerTerm, Role, Rows, State, Storage};

pub const R: f64 = 1e3;
pub const C: f64 = 1e-6;
pub const L: f64 = 1e-2;
pub const CF: f64 = 300e-9;

/// A system without inputs; states are voltages and currents by `units`, ports are named with their roles, probes are the
/// states themselves.
pub fn system(
    states: &[(&str, &'static str)],
    ports: &[(&str, Role)],
    [a, b, c, d]: [DMatrix<f64>; 4],
    stored: &[f64],
) -> Lcs {
    let (n, m) = (a.nrows(), d.nrows());
    let metric = DMatrix::from_diagonal(&DVector::from_row_slice(stored));
    Lcs::new(LcsParts {
        states: states
            .iter()
            .map(|(s, unit)| State {
                name: (*s).into(),
                unit,
            })
            .collect(),
        ports: ports.iter().map(|(name, role)| port(name, *role)).collect(),
        a,
        b,
        c,
        d,
        e: DMatrix::zeros(n, 0),
        g: DMatrix::zeros(m, 0),
        e0: DVector::zeros(n),
        f: DVector::zeros(m),
        shift: DMatrix::zeros(n, 0),
        energy: metric.clone(),
        outputs: Outputs {
            names: states.iter().map(|(s, _)| (*s).into()).collect(),
            units: states.iter().map(|(_, unit)| *unit).collect(),
            rows: Rows {
                x: DMatrix::identity(n, n),
                lambda: DMatrix::zeros(n, m),
                u: DMatrix::zeros(n, 0),
                du: DMatrix::zeros(n, 0),
                one: DVector::zeros(n),
            },
            ..Outputs::default()
        },
        storage: Storage {
            names: states.iter().map(|(s, _)| (*s).into()).collect(),
            elements: states.iter().map(|(s, _)| (*s).into()).collect(),
            units: states.iter().map(|(_, unit)| *unit).collect(),
            x: DMatrix::identity(n, n),
            lambda: DMatrix::zeros(n, m),
            u: DMatrix::zeros(n, 0),
            one: DVector::zeros(n),
            metric,
            inject: DMatrix::identity(n, n),
            inject_one: DVector::zeros(n),
            initial: DVector::zeros(n),
        },
        ..LcsParts::default()
    })
    .expect("parts that fit")
}

fn port(name: &str, role: Role) -> Port {
    let (i, v) = (format!("i({name})"), format!("-v({name})"));
    let (lambda, y) = if role == Role::Voltage {
        (v, i)
    } else {
        (i, v)
    };
    Port {
        device: name.into(),
        role,
        lambda,
        y,
        law: Law::ideal_diode(),
    }
}

/// Adds a resistor to the energy balance whose voltage is `weights`·λ.
fn resistor(lcs: Lcs, ohms: f64, weights: &[f64], x: &[f64]) -> Lcs {
    let row = |scale: f64| Rows {
        x: DMatrix::from_row_slice(1, x.len(), x) * scale,
        lambda: DMatrix::from_row_slice(1, weights.len(), weights) * scale,
        u: DMatrix::zeros(1, 0),
        du: DMatrix::zeros(1, 0),
        one: DVector::zeros(1),
    };
    lcs.changed(|parts| {
        parts.outputs.power = vec![PowerTerm {
            element: "r1".into(),
            kind: PowerKind::Dissipated,
        }];
        parts.outputs.power_v = row(1.0);
        parts.outputs.power_i = row(1.0 / ohms);
    })
    .expect("rows that fit")
}

/// Half-wave rectifier RLCD: x = (v_C, i_L), λ = i_D.
pub fn rlcd() -> Lcs {
    let lcs = system(
        &[("v(c1)", "V"), ("i(l1)", "A")],
        &[("d1", Role::Current)],
        [
            dmatrix![0.0, -1.0 / C; 1.0 / L, 0.0],
            dmatrix![-1.0 / C; 0.0],
            dmatrix![-1.0, 0.0],
            dmatrix![R],
        ],
        &[C, L],
    );
    resistor(lcs, R, &[R], &[0.0, 0.0])
}

/// Diode bridge with a resistor: x = (v_C, i_L), λ = (−v_DR1, −v_DF2, i_DF1, i_DR2).
pub fn bridge() -> Lcs {
    let g = 1.0 / R;
    let lcs = system(
        &[("v(c1)", "V"), ("i(l1)", "A")],
        &[
            ("dr1", Role::Voltage),
            ("df2", Role::Voltage),
            ("df1", Role::Current),
            ("dr2", Role::Current),
        ],
        [
            dmatrix![0.0, -1.0 / C; 1.0 / L, 0.0],
            dmatrix![0.0, 0.0, -1.0 / C, 1.0 / C; 0.0, 0.0, 0.0, 0.0],
            dmatrix![0.0, 0.0; 0.0, 0.0; -1.0, 0.0; 1.0, 0.0],
            dmatrix![g, g, -1.0, 0.0; g, g, 0.0, -1.0; 1.0, 0.0, 0.0, 0.0; 0.0, 1.0, 0.0, 0.0],
        ],
        &[C, L],
    );
    resistor(lcs, R, &[1.0, 1.0, 0.0, 0.0], &[0.0, 0.0])
}

/// Bridge with capacitor filter: x = (v_C, i_L, v_f), λ = (i_DR1, −v_DF2, i_DF1, i_DR2); D is skew.
pub fn bridge_cap_filter() -> Lcs {
    let c = 1.0 / C;
    let f = 1.0 / CF;
    let lcs = system(
        &[("v(c1)", "V"), ("i(l1)", "A"), ("v(cf)", "V")],
        &[
            ("dr1", Role::Current),
            ("df2", Role::Voltage),
            ("df1", Role::Current),
            ("dr2", Role::Current),
        ],
        [
            dmatrix![0.0, -c, 0.0; 1.0 / L, 0.0, 0.0; 0.0, 0.0, -f / R],
            dmatrix![0.0, 0.0, -c, c; 0.0, 0.0, 0.0, 0.0; f, 0.0, f, 0.0],
            dmatrix![0.0, 0.0, 1.0; 0.0, 0.0, 0.0; -1.0, 0.0, 1.0; 1.0, 0.0, 0.0],
            dmatrix![
                0.0, -1.0, 0.0, 0.0; 1.0, 0.0, 1.0, -1.0; 0.0, -1.0, 0.0, 0.0; 0.0, 1.0, 0.0, 0.0
            ],
        ],
        &[C, L, CF],
    );
    resistor(lcs, R, &[0.0; 4], &[0.0, 0.0, 1.0])
}

/// A diode across a capacitor of 1 µF: x = v_C, λ = i_D, y = −v_C.
pub fn clamped_capacitor() -> Lcs {
    system(
        &[("v(c1)", "V")],
        &[("d1", Role::Current)],
        [
            dmatrix![0.0],
            dmatrix![-1.0 / C],
            dmatrix![-1.0],
            dmatrix![0.0],
        ],
        &[C],
    )
}
