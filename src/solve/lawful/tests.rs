use nalgebra::{dmatrix, dvector};
use proptest::prelude::*;

use super::*;
use crate::law::{Breakdown, Exponential};

const TOLERANCE: f64 = 1e-9;

fn diode(is: f64, slope: f64, rs: f64, bv: Option<f64>) -> Law {
    Law::Exponential(Exponential {
        is,
        slope,
        rs,
        leak: 0.0,
        breakdown: bv.map(|bv| Breakdown {
            bv,
            ibv: 1e-3,
            slope,
        }),
    })
}

/// The laws that reach the solver: straight pieces come as ideal pairs.
fn any_law() -> impl Strategy<Value = Law> {
    let exponential = (
        -16.0..-6.0f64,
        0.02..0.1f64,
        prop::option::of(-3.0..1.0f64),
        prop::option::of(2.0..100.0f64),
    )
        .prop_map(|(is, slope, rs, bv)| {
            diode(
                10_f64.powf(is),
                slope,
                rs.map_or(0.0, |r| 10_f64.powf(r)),
                bv,
            )
        });
    prop_oneof![exponential, Just(Law::ideal_diode())]
}

/// A monotone matrix: positive semidefinite of any rank from 1 on plus skew, with rows and columns over decades of impedance; a law,
/// a role and a point of the law for every port.
#[derive(Debug, Clone)]
struct Network {
    m: DMatrix<f64>,
    ports: Vec<PortLaw>,
    q: DVector<f64>,
}

fn network() -> impl Strategy<Value = Network> {
    (1..9_usize).prop_flat_map(|size| {
        let entries = prop::collection::vec(-1.0..1.0f64, 2 * size * size);
        let ports = prop::collection::vec(
            (any_law(), prop::bool::ANY, -20.0..20.0f64, -2.0..3.0f64),
            size,
        );
        (entries, ports, 1..=size).prop_map(move |(entries, ports, rank)| {
            let g = DMatrix::from_fn(size, rank, |i, j| entries[i * size + j]);
            let k = DMatrix::from_fn(size, size, |i, j| {
                // Sparse, as in circuits.
                let x = entries[size * size + i * size + j];
                if x.abs() < 0.5 { 0.0 } else { x }
            });
            let scale = DMatrix::from_diagonal(&DVector::from_iterator(
                size,
                ports.iter().map(|(_, current, _, decades)| {
                    10_f64.powf(if *current { *decades } else { -decades } / 2.0)
                }),
            ));
            let m = &scale * (&g * g.transpose() + &k - k.transpose()) * &scale;
            let mut lambda = DVector::zeros(size);
            let mut y = DVector::zeros(size);
            for (j, (law, current, z, decades)) in ports.iter().enumerate() {
                let at = law.resolvent(10_f64.powf(*decades), *z);
                (lambda[j], y[j]) = if *current {
                    (at.i, -at.v)
                } else {
                    (-at.v, at.i)
                };
            }
            let q = &y - &m * &lambda;
            let ports = ports
                .into_iter()
                .map(|(law, current, _, _)| PortLaw { law, current });
            Network {
                m,
                ports: ports.collect(),
                q,
            }
        })
    })
}

fn solve(network: &Network) -> Solution {
    let scaling = Scaling::of(&network.m);
    Lawful::new(&network.m, &scaling, network.ports.clone(), TOLERANCE).solve(&network.q)
}

/// Every pair on its law and y = Mλ + q, each relative to its own sizes.
fn check(network: &Network, found: &Solution) {
    assert_eq!(found.status, Status::Solved, "residual {}", found.residual);
    let d = Scaling::of(&network.m).d;
    for (j, port) in network.ports.iter().enumerate() {
        let (v, i) = if port.current {
            (-found.y[j], found.lambda[j])
        } else {
            (-found.lambda[j], found.y[j])
        };
        let rho = if port.current {
            d[j].powi(-2)
        } else {
            d[j].powi(2)
        };
        let at = port.law.resolvent(rho, v + rho * i);
        let size = v.abs() + rho * i.abs();
        assert!(
            (at.v - v).abs() <= 1e-12 * (1.0 + size),
            "port {j}: {v} V, {i} A, {at:?}"
        );
    }
    let balance = (&network.m * &found.lambda + &network.q - &found.y).component_mul(&d);
    let size = found
        .lambda
        .component_div(&d)
        .amax()
        .max(network.q.component_mul(&d).amax());
    // The bend of an exponential counts as size where all else is smaller.
    let bend = d.amax().max(1.0 / d.min()) * 0.1;
    assert!(balance.amax() <= TOLERANCE * size.max(bend), "{balance}");
}

proptest! {
    #![proptest_config(ProptestConfig {
        cases: 1000,
        failure_persistence: Some(Box::new(proptest::test_runner::FileFailurePersistence::WithSource("regressions"))),
        ..Default::default()
    })]

    #[test]
    fn random_monotone_networks_never_fail(network in network()) {
        check(&network, &solve(&network));
    }
}

#[test]
fn a_diode_on_a_resistor_carries_what_wright_says() {
    // 5 V through 1 kΩ: y = −v = 1000 i − 5.
    let law = diode(1e-14, 0.025, 0.0, None);
    let mut lawful = Lawful::new(
        &dmatrix![1e3],
        &Scaling::of(&dmatrix![1e3]),
        vec![PortLaw { law, current: true }],
        TOLERANCE,
    );
    let found = lawful.solve(&dvector![-5.0]);
    let i = found.lambda[0];
    assert!((1e3 * i + 0.025 * (i / 1e-14).ln_1p() - 5.0).abs() < 1e-13);
    assert_eq!((found.by, found.active[0]), (Answered::Newton, None));
    // The other role: λ = −v, y = i = λ/1000 + 5/1000.
    let law = diode(1e-14, 0.025, 0.0, None);
    let mut lawful = Lawful::new(
        &dmatrix![1e-3],
        &Scaling::of(&dmatrix![1e-3]),
        vec![PortLaw {
            law,
            current: false,
        }],
        TOLERANCE,
    );
    let other = lawful.solve(&dvector![5e-3]);
    assert!((other.y[0] - i).abs() < 1e-15);
}

#[test]
fn splitting_alone_comes_to_the_same_point() {
    let ports = vec![
        PortLaw {
            law: diode(1e-9, 0.05, 0.1, Some(6.0)),
            current: true,
        },
        PortLaw {
            law: Law::ideal_diode(),
            current: true,
        },
    ];
    let m = dmatrix![2.0, 1.0; -1.0, 3.0];
    let q = dvector![-4.0, 1.0];
    let scaling = Scaling::of(&m);
    let mut lawful = Lawful::new(&m, &scaling, ports, TOLERANCE);
    let found = lawful.solve(&q);
    let scaled = q.component_mul(&scaling.d);
    let start = lawful.at(DVector::zeros(2), &scaled);
    let split = lawful.split(start, &scaled, 2000);
    assert!(split.size < 1e-9, "{}", split.size);
    assert!((split.lambda.component_mul(&scaling.d) - found.lambda).amax() < 1e-8);
}

#[test]
fn a_current_that_no_law_carries_is_no_solution() {
    // −1 A forced through a diode: y = i = −1.
    let law = diode(1e-14, 0.025, 0.0, None);
    let network = Network {
        m: dmatrix![0.0],
        ports: vec![PortLaw {
            law,
            current: false,
        }],
        q: dvector![-1.0],
    };
    assert_eq!(solve(&network).status, Status::Failed);
}

#[test]
fn the_kernel_of_a_rounded_matrix_is_followed_the_right_way() {
    // Rank one but for the last digit, which makes the determinant −7.5e-20. With the ideal diode conducting, 0 V across it,
    // i = q₂ − q₁ m₂₁/m₁₁ = 15.07 nA through the junction; from where it blocks only the kernel of M leads there.
    let m = dmatrix![0.002780450822413297, 9.289188481070114e-5; 9.289188481070115e-5, 3.103418407592942e-6];
    let q = dvector![-1.9679974845688268, -0.06574867365459573];
    let law = diode(5.951870501769332e-9, 0.05325030127862577, 0.0, None);
    let ports = vec![
        PortLaw {
            law: Law::ideal_diode(),
            current: true,
        },
        PortLaw {
            law,
            current: false,
        },
    ];
    let network = Network { m, ports, q };
    let found = solve(&network);
    check(&network, &found);
    assert!((found.y[1] - 1.507e-8).abs() < 1e-11, "{found:?}");
}

/// At a breakdown of 100 V the current is small, but known to the rounding of w = v + i alone: a residual elsewhere counts relative to that.
#[test]
fn a_residual_counts_relative_to_what_the_rounding_of_a_port_makes_of_it() {
    let law = diode(1e-14, 0.025, 0.0, Some(100.0));
    let at = law.resolvent(1.0, -100.0);
    let ports = vec![
        PortLaw { law, current: true },
        PortLaw {
            law: Law::ideal_diode(),
            current: true,
        },
    ];
    let m = dmatrix![1.0, 0.0; 1.0, 1.0];
    let scaling = Scaling {
        d: dvector![1.0, 1.0],
    };
    let lawful = Lawful::new(&m, &scaling, ports, TOLERANCE);
    // The first equation holds; the second lacks i.
    let q = dvector![-at.v - at.i, 0.0];
    let found = lawful.at(dvector![-100.0, 0.0], &q);
    let truth = at.i.abs() / (100.0 * at.di);
    assert!(
        truth < 0.1 && (found.size / truth - 1.0).abs() < 1e-12,
        "{} {truth}",
        found.size
    );
}

/// With M ⪰ 0 a small resistance everywhere leaves xᵀMx ≥ 0: what nothing determines goes where it is pushed.
#[test]
fn a_direction_that_nothing_determines_is_followed_and_not_reversed() {
    let matrix = dmatrix![1.0, 0.0; 0.0, 0.0];
    let right = dvector![1.0, 1e-12];
    let x = solved(matrix, &right).expect("a solution");
    assert!((x[0] - 1.0).abs() < 1e-9 && x[1] > 0.0, "{x}");
}
