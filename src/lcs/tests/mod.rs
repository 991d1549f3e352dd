//! Hand-derived systems, independent nodal analysis, and invariants.

mod hand;
mod laws;
mod netlists;
mod nodal;
mod papers;
mod random;

use super::*;
use crate::mna::behaviour;
use crate::mna::fixture::circuit;

fn free(text: &str) -> Lcs {
    let behaviour = behaviour(&circuit(text)).unwrap();
    reduce(&behaviour, &Position::free(&behaviour, Vec::new())).unwrap()
}

fn held(text: &str, pattern: &str) -> Lcs {
    try_held(text, pattern).unwrap()
}

/// A mode: one letter per device, `c` conducting, `o` open, `f` free.
fn try_held(text: &str, pattern: &str) -> Result<Lcs, ReduceError> {
    let behaviour = behaviour(&circuit(text)).unwrap();
    let devices = pattern
        .chars()
        .map(|c| match c {
            'c' => Hold::Closed,
            'o' => Hold::Open,
            _ => Hold::Free,
        })
        .collect();
    reduce(
        &behaviour,
        &Position {
            devices,
            ..Position::free(&behaviour, Vec::new())
        },
    )
}

fn close(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-12 * a.abs().max(b.abs())
}

#[track_caller]
fn assert_matrix(name: &str, found: &DMatrix<f64>, expected: &[&[f64]]) {
    assert_eq!(found.nrows(), expected.len(), "{name}: {found}");
    for (r, row) in expected.iter().enumerate() {
        assert_eq!(found.ncols(), row.len(), "{name}: {found}");
        for (c, &x) in row.iter().enumerate() {
            assert!(
                close(found[(r, c)], x),
                "{name}[{r},{c}] = {} ≠ {x}\n{found}",
                found[(r, c)]
            );
        }
    }
}
