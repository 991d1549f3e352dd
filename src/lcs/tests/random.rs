//! Random networks: the reduced system against nodal analysis, exact arithmetic, and the laws of passive networks.

use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

use super::nodal::{Branch, C64, Nodal};
use crate::circuit::{Circuit, Kind, Output};
use crate::lcs::LcsParts;
use crate::lcs::reduce::oracle::both;
use crate::lcs::{Hold, Lcs, Position, ReduceError, Role, reduce};
use crate::mna::fixture::circuit;
use crate::mna::{StaticMultiport, behaviour};

/// A branch: kind, nodes, further nodes, value.
type Part = (usize, u8, u8, u8, u8, u32);

fn parts(kinds: usize, count: std::ops::Range<usize>) -> impl Strategy<Value = Vec<Part>> {
    prop::collection::vec((0..kinds, 0u8..6, 0u8..6, 0u8..6, 0u8..6, 1u32..100), count)
}

/// Kinds 0–7 are passive with at most one source of each sort; 8–11 are controlled sources, the last two by the current of an earlier branch.
fn netlist(parts: &[Part], spread: bool) -> String {
    let mut text = String::new();
    let (mut voltage, mut current) = (false, false);
    let mut names: Vec<String> = Vec::new();
    for (k, &(kind, p, n, a, b, value)) in parts.iter().enumerate() {
        let wide = |units: [&'static str; 3]| {
            if spread {
                units[value as usize % 3]
            } else {
                units[1]
            }
        };
        let line = match kind {
            0 | 1 => format!("r{k} {p} {n} {value}{}", wide(["e-4", "0", "e7"])),
            2 => format!("c{k} {p} {n} {value}{}", wide(["e-15", "n", "e-3"])),
            3 => format!("l{k} {p} {n} {value}{}", wide(["n", "u", ""])),
            4 | 5 => format!("d{k} {p} {n}"),
            6 if !voltage => {
                voltage = true;
                format!("v{k} {p} {n} 1")
            }
            7 if !current => {
                current = true;
                format!("i{k} {p} {n} 1")
            }
            8 => format!("e{k} {p} {n} {a} {b} {}", f64::from(value) / 50.0),
            9 => format!("g{k} {p} {n} {a} {b} {}", f64::from(value) / 5000.0),
            10 | 11 if !names.is_empty() => {
                let letter = if kind == 10 { 'f' } else { 'h' };
                let control = &names[a as usize % names.len()];
                format!("{letter}{k} {p} {n} {control} {}", f64::from(value) / 50.0)
            }
            _ => format!("r{k} {p} {n} {value}0"),
        };
        names.extend(line.split(' ').next().map(str::to_string));
        text += &line;
        text.push('\n');
    }
    text
}

/// Agreement to 1e-9 of the value or 1e-12 of the terms it is a sum of, above the rounding of nodal analysis.
fn agree(a: C64, b: C64, terms: f64, floor: f64) -> bool {
    (a - b).norm() <= 1e-9 * (a.norm() + b.norm()) + 1e-12 * terms + floor
}

/// (sI − A)⁻¹ applied to a column, as doubles scaled by the storage of each state.
fn resolvent(s: &Lcs, frequency: C64, column: &DVector<f64>) -> Option<DVector<C64>> {
    let n = s.n();
    if n == 0 {
        return Some(DVector::zeros(0));
    }
    let m = DMatrix::from_fn(n, n, |r, c| {
        let diagonal = if r == c {
            frequency
        } else {
            C64::new(0.0, 0.0)
        };
        diagonal - C64::new(s.a[(r, c)], 0.0)
    });
    m.full_piv_lu().solve(&column.map(|x| C64::new(x, 0.0)))
}

fn complex(row: &[f64], x: &DVector<C64>) -> (C64, f64) {
    row.iter()
        .zip(x.iter())
        .fold((C64::new(0.0, 0.0), 0.0), |(sum, size), (a, b)| {
            (sum + b * *a, size + (b * *a).norm())
        })
}

/// Compares y, λ ↦ y and u ↦ y and every output at one frequency with nodal analysis.
pub(super) fn compare(
    circuit: &Circuit,
    s: &Lcs,
    held: &dyn Fn(&str) -> Branch,
) -> Result<usize, TestCaseError> {
    let frequency = C64::new(3e4, 2e5);
    let function = |name: &str| {
        let id = circuit.element(name)?;
        match &circuit.elements[id.index()].kind {
            Kind::Function { output, input, .. } => Some((*output, input)),
            _ => None,
        }
    };
    let mut compared = 0;
    for column in 0..s.m() + s.p() {
        let (b, d, u, lambda) = if column < s.m() {
            (
                s.b.column(column).into_owned(),
                s.d.column(column).into_owned(),
                None,
                Some(column),
            )
        } else {
            let k = column - s.m();
            (
                s.e.column(k).into_owned(),
                s.g.column(k).into_owned(),
                Some(k),
                None,
            )
        };
        let source = |name: &str| match u {
            Some(k) if s.inputs[k].name == name => 1.0,
            _ => 0.0,
        };
        let branch = |name: &str| match s.ports.iter().position(|p| p.device == name) {
            Some(k) => {
                let value = if lambda == Some(k) { 1.0 } else { 0.0 };
                match (s.ports[k].role, function(name)) {
                    (Role::Current, _) => Branch::Current(value),
                    (Role::Function, Some((Output::Voltage, _))) => Branch::Voltage(value),
                    (Role::Function, _) => Branch::Current(value),
                    (Role::Voltage, _) => Branch::Voltage(-value),
                }
            }
            None => held(name),
        };
        let Some(nodal) = Nodal::solve(circuit, frequency, &source, &branch) else {
            continue;
        };
        if nodal.condition > 1e11 {
            continue;
        }
        let Some(x) = resolvent(s, frequency, &b) else {
            continue;
        };
        for (k, port) in s.ports.iter().enumerate() {
            let row: Vec<f64> = s.c.row(k).iter().copied().collect();
            let (y, size) = complex(&row, &x);
            let y = y + C64::new(d[k], 0.0);
            let expected = match port.role {
                Role::Current => -nodal.voltage(circuit, &port.device),
                Role::Voltage => nodal.current(circuit, &port.device),
                Role::Function => match function(&port.device) {
                    Some((_, input)) => nodal.affine(input),
                    None => unreachable!("{} has no input", port.device),
                },
            };
            let floor = if port.role != Role::Voltage {
                nodal.floor().0
            } else {
                nodal.floor().1
            };
            prop_assert!(
                agree(y, expected, size + d[k].abs(), floor),
                "{}: {y} ≠ {expected}",
                port.y
            );
            compared += 1;
        }
        for (k, name) in s.outputs.names.iter().enumerate() {
            let rows = &s.outputs.rows;
            let row: Vec<f64> = rows.x.row(k).iter().copied().collect();
            let (value, size) = complex(&row, &x);
            let direct = match (lambda, u) {
                (Some(j), _) => C64::new(rows.lambda[(k, j)], 0.0),
                (_, Some(j)) => C64::new(rows.u[(k, j)], 0.0) + frequency * rows.du[(k, j)],
                _ => C64::new(0.0, 0.0),
            };
            let inside = &name[2..name.len() - 1];
            let node = |name: &str| nodal.potential(circuit.node(name).unwrap().index());
            let expected = match (name.starts_with("v("), inside.split_once(',')) {
                (true, Some((a, b))) => node(a) - node(b),
                (true, None) => node(inside),
                _ => nodal.current(circuit, inside),
            };
            let floor = if name.starts_with('v') {
                nodal.floor().0
            } else {
                nodal.floor().1
            };
            prop_assert!(
                agree(value + direct, expected, size + direct.norm(), floor),
                "{name}: {} ≠ {expected} (condition {:e})",
                value + direct,
                nodal.condition
            );
            compared += 1;
        }
    }
    Ok(compared)
}

fn everything(circuit: &Circuit) -> StaticMultiport {
    behaviour(circuit).unwrap()
}

/// The smallest eigenvalue of a symmetric matrix after scaling its diagonal to 1.
fn least_eigenvalue(m: &DMatrix<f64>) -> f64 {
    if m.is_empty() {
        return 0.0;
    }
    let largest = m.diagonal().amax();
    let scale = m.diagonal().map(|x| {
        if x > 1e-13 * largest {
            x.sqrt().recip()
        } else {
            1.0
        }
    });
    let s = DMatrix::from_fn(m.nrows(), m.ncols(), |r, c| m[(r, c)] * scale[r] * scale[c]);
    s.symmetric_eigenvalues().min()
}

fn passivity(s: &Lcs) -> Result<(), TestCaseError> {
    let symmetric = &s.d + s.d.transpose();
    prop_assert!(least_eigenvalue(&symmetric) > -1e-9, "D + Dᵀ = {symmetric}");
    // States and ports in units of their energies and powers: P^{-1/2} Cᵀ − P^{1/2} B on the kernel of D + Dᵀ.
    let gap = &s.energy * &s.b - s.c.transpose();
    if s.m() > 0 && s.n() > 0 {
        let eigen = symmetric.clone().symmetric_eigen();
        let largest = eigen.eigenvalues.amax().max(1e-300);
        let size = s.c.amax();
        for (k, value) in eigen.eigenvalues.iter().enumerate() {
            if value.abs() < 1e-12 * largest || *value == 0.0 {
                let image = &gap * eigen.eigenvectors.column(k);
                prop_assert!(image.amax() <= 1e-7 * size, "P B N − Cᵀ N = {image}");
            }
        }
    }
    let dissipation = -(s.a.transpose() * &s.energy + &s.energy * &s.a);
    prop_assert!(
        least_eigenvalue(&dissipation) > -1e-9,
        "−AᵀP − PA = {dissipation}"
    );
    Ok(())
}

fn config(cases: u32) -> ProptestConfig {
    ProptestConfig {
        cases,
        failure_persistence: Some(Box::new(
            proptest::test_runner::FileFailurePersistence::WithSource("regressions"),
        )),
        ..Default::default()
    }
}

proptest! {
    #![proptest_config(config(250))]

    #[test]
    fn passive_networks_agree_with_nodal_analysis(parts in parts(8, 3..14)) {
        let circuit = circuit(&netlist(&parts, false));
        let behaviour = everything(&circuit);
        match reduce(&behaviour, &Position::free(&behaviour, Vec::new())) {
            Ok(s) => {
                compare(&circuit, &s, &|_| Branch::Current(0.0))?;
                passivity(&s)?;
            }
            Err(ReduceError::Sources { .. }) => {}
            Err(other) => prop_assert!(false, "{other}"),
        }
    }

    #[test]
    fn active_networks_agree_with_nodal_analysis(parts in parts(12, 3..14)) {
        let circuit = circuit(&netlist(&parts, false));
        let behaviour = everything(&circuit);
        if let Ok(s) = reduce(&behaviour, &Position::free(&behaviour, Vec::new())) {
            compare(&circuit, &s, &|_| Branch::Current(0.0))?;
        }
    }

    #[test]
    fn a_choice_of_roles_is_found_where_there_is_one(parts in parts(12, 3..14)) {
        // No storage, and devices in its place.
        let parts: Vec<Part> = parts
            .into_iter()
            .map(|(kind, p, n, a, b, value)| (if matches!(kind, 2 | 3) { 4 } else { kind }, p, n, a, b, value))
            .collect();
        let circuit = circuit(&netlist(&parts, false));
        let behaviour = everything(&circuit);
        let names: Vec<&str> = behaviour.pairs.iter().map(|p| p.port.device.as_str()).collect();
        let regular = |choice: u32| {
            let branch = |name: &str| {
                let k = names.iter().position(|n| *n == name).unwrap();
                if choice >> k & 1 == 1 { Branch::Voltage(0.0) } else { Branch::Current(0.0) }
            };
            Nodal::solve(&circuit, C64::new(1.0, 0.0), &|_| 0.0, &branch).is_some_and(|n| n.condition < 1e8)
        };
        if let Err(error) = reduce(&behaviour, &Position::free(&behaviour, Vec::new())) {
            let choice = (0..1_u32 << names.len()).find(|&choice| regular(choice));
            prop_assert_eq!(choice, None, "{}", error);
        }
    }

    #[test]
    fn modes_agree_with_nodal_analysis_and_conserve_charge(parts in parts(8, 3..14), conducting in any::<u32>()) {
        let circuit = circuit(&netlist(&parts, false));
        let behaviour = everything(&circuit);
        let closed = |k: usize| conducting >> (k % 32) & 1 == 1;
        let devices = (0..behaviour.pairs.len())
            .map(|k| if closed(k) { Hold::Closed } else { Hold::Open })
            .collect();
        let position = Position { devices, ..Position::free(&behaviour, Vec::new()) };
        let s = reduce(&behaviour, &position);
        if let Err(ReduceError::Sources { .. }) = s {
            return Ok(());
        }
        let s = s.map_err(|e| TestCaseError::fail(e.to_string()))?;
        let names: Vec<&str> = behaviour.pairs.iter().map(|p| p.port.device.as_str()).collect();
        if s.held.constraints.u.nrows() == 0 {
            compare(&circuit, &s, &|name| {
                let k = names.iter().position(|n| *n == name);
                if k.is_some_and(closed) { Branch::Voltage(0.0) } else { Branch::Current(0.0) }
            })?;
        }
        passivity(&s)?;
        // J is the projection in the energy metric: J S = 1, and P (s − S J s) ⟂ S.
        let identity = &s.storage.inject * &s.storage.x;
        prop_assert!((&identity - DMatrix::identity(s.n(), s.n())).amax() < 1e-9, "{identity}");
        let gram = s.storage.x.transpose() * &s.storage.metric;
        let defect = &gram - &gram * &s.storage.x * &s.storage.inject;
        prop_assert!(defect.amax() <= 1e-9 * gram.amax().max(1e-300), "{defect}");
    }

    #[test]
    fn balls_and_rationals_give_the_same_doubles(parts in parts(12, 3..12), conducting in any::<u32>()) {
        let circuit = circuit(&netlist(&parts, true));
        let behaviour = everything(&circuit);
        let devices = (0..behaviour.pairs.len())
            .map(|k| [Hold::Free, Hold::Closed, Hold::Open][(conducting >> (k % 16 * 2) & 3).min(2) as usize])
            .collect();
        let position = Position { devices, ..Position::free(&behaviour, Vec::new()) };
        let (ball, exact) = both(&behaviour, &position);
        match (ball, exact) {
            (Ok((found, precise)), Ok((truth, _))) => {
                prop_assert_eq!(&found.states, &truth.states);
                for (x, y) in numbers(&found).zip(numbers(&truth)) {
                    prop_assert_eq!(x == 0.0, y == 0.0);
                    if precise {
                        prop_assert!((x - y).abs() <= 2e-14 * y.abs(), "{} {}", x, y);
                    }
                }
            }
            (Err(a), Err(b)) => prop_assert_eq!(a, b),
            (a, b) => prop_assert!(false, "{:?} but {:?}", a.err(), b.err()),
        }
    }
}

fn numbers(s: &LcsParts) -> impl Iterator<Item = f64> + '_ {
    [
        &s.a,
        &s.b,
        &s.c,
        &s.d,
        &s.e,
        &s.g,
        &s.shift,
        &s.storage.inject,
        &s.outputs.rows.x,
        &s.outputs.rows.du,
    ]
    .into_iter()
    .chain([
        &s.held.guard.x,
        &s.held.guard.u,
        &s.held.kernel,
        &s.held.impulse,
    ])
    .flat_map(|m| m.iter().copied())
}

#[test]
fn the_comparison_sees_a_wrong_entry() {
    let circuit = circuit("v1 1 0 1\n r1 1 2 1k\n c1 2 0 1n\n d1 2 0");
    let behaviour = everything(&circuit);
    let mut s = reduce(&behaviour, &Position::free(&behaviour, Vec::new())).unwrap();
    assert_eq!(compare(&circuit, &s, &|_| Branch::Current(0.0)).unwrap(), 8);
    s = s.changed(|s| s.a[(0, 0)] *= 1.0 + 1e-6).unwrap();
    assert!(compare(&circuit, &s, &|_| Branch::Current(0.0)).is_err());
    assert!(matches!(circuit.elements[3].kind, Kind::Device(_)));
}
