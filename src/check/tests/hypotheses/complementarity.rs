//! Sweeping processes and complementarity systems: Brogliato-Thibault, Camlibel-Heemels-Schumacher, P-matrices.

use super::*;

#[test]
fn theorem_3_5_asks_for_a_set_that_is_never_empty() {
    // |x| ≤ 1 − u.
    let channel = |f: [f64; 2]| with_offsets(antiparallel(), &f);
    holds(&channel([0.0, 0.0]), SWEEPING);
    fails_by(&channel([-1.0, -1.0]), SWEEPING, "S(t) is empty");
    // u ∈ [−½, ½] leaves room, u ∈ [−½, 3/2] does not at its upper end, nor −u at its lower one.
    let swept = |wave: Wave, sign: f64| driven(channel([1.0, 1.0]), wave, 0.0, &[sign, sign]);
    holds(&swept(sine(0.0, 0.5, 0.0), -1.0), SWEEPING);
    fails_by(&swept(sine(0.5, 1.0, 0.0), -1.0), SWEEPING, "S(t) is empty");
    fails_by(&swept(sine(-0.5, 1.0, 0.0), 1.0), SWEEPING, "S(t) is empty");
    // Two sources: empty only where one is high and the other low.
    let two = driven(
        swept(sine(0.0, 0.6, 0.0), -1.0),
        sine(0.0, 0.6, 0.0),
        0.0,
        &[1.0, 1.0],
    );
    fails_by(&two, SWEEPING, "S(t) is empty");
    let two = driven(
        swept(sine(0.0, 0.4, 0.0), -1.0),
        sine(0.0, 0.4, 0.0),
        0.0,
        &[1.0, 1.0],
    );
    holds(&two, SWEEPING);
    // A swing that grows leaves any channel some day: not decided by corners.
    let (decided, because) = verdict(&swept(sine(0.0, 0.5, -1.0), -1.0), SWEEPING);
    assert_eq!(decided, None, "{because}");
    assert!(because.contains("v1 is unbounded"));
    // Where (22) holds S(t) is never empty, bounded or not.
    let free = leaky(&[1.0, 2.0], DMatrix::zeros(2, 2));
    holds(
        &driven(free, sine(0.0, 0.5, -1.0), 0.0, &[-1.0, 1.0]),
        SWEEPING,
    );
}

#[test]
fn theorem_3_5_asks_for_complementary_pairs_and_no_feedthrough() {
    fails_by(
        &leaky(&[1.0], dmatrix![1.0]),
        SWEEPING,
        "D ≠ 0 (largest entry 1.00e0)",
    );
    let resistor = curve((0.0, 0.0), (1.0, 1.0), (1.0, 1.0));
    fails_by(
        &with_laws(leaky(&[1.0], dmatrix![0.0]), &[resistor]),
        SWEEPING,
        "not a complementary pair: d1",
    );
}

#[test]
fn section_3_3_asks_for_blocks_and_a_p_matrix() {
    let blocks = |d: DMatrix<f64>| leaky(&[1.0, 0.5], d);
    holds(&blocks(dmatrix![0.0, 0.0; 0.0, 1.0]), BLOCKS);
    fails_by(&blocks(DMatrix::zeros(2, 2)), BLOCKS, "this is Theorem 3.5");
    fails_by(
        &blocks(dmatrix![0.0, 0.0; 0.0, -1.0]),
        BLOCKS,
        "D₁ (1×1) is not a P-matrix",
    );
    // A row of zeros without its column, and the other way round, is no block.
    for d in [dmatrix![0.0, 0.0; 1.0, 1.0], dmatrix![0.0, 1.0; 0.0, 1.0]] {
        fails_by(&blocks(d.clone()), BLOCKS, "D₁ (2×2) is not a P-matrix");
        // RR-7158 (6) splits the same way: with D + Dᵀ indefinite nothing is left for Theorem 1.
        fails_by(&blocks(d), KATO, "neither positive semidefinite");
    }
}

#[test]
fn passive_systems_with_inputs_ask_for_rank_pairs_and_pieces() {
    const INPUTS: &str = "Camlibel-Heemels-Schumacher 2002";
    holds(&leaky(&[1.0], dmatrix![1.0]), INPUTS);
    // Two diodes in parallel: [B; D + Dᵀ] = (1, 1; 0; 0).
    let (holds_here, because) = verdict(&leaky(&[1.0, 1.0], DMatrix::zeros(2, 2)), INPUTS);
    assert_eq!(holds_here, Some(false));
    assert!(
        because.starts_with("[B; D + Dᵀ] lacks 1 of full column rank"),
        "{because}"
    );
    let resistor = curve((0.0, 0.0), (1.0, 1.0), (1.0, 1.0));
    let circuit = with_laws(leaky(&[1.0], dmatrix![1.0]), &[resistor]);
    fails_by(&circuit, INPUTS, "not a complementary pair: d1");
    let mut active = leaky(&[1.0], dmatrix![1.0]);
    change(&mut active, |s| s.a[(0, 0)] = 1.0);
    fails_by(&active, INPUTS, "not passive");
    // Frequency modulation is no sum of polynomials, exponentials and sinusoids; a sine is.
    let modulated = Wave::Sffm {
        offset: 0.0,
        amplitude: 1.0,
        carrier: 10.0,
        index: 2.0,
        signal: 1.0,
        carrier_phase: 0.0,
        signal_phase: 0.0,
    };
    let circuit = leaky(&[1.0], dmatrix![1.0]);
    fails_by(
        &driven(circuit.clone(), modulated, 1.0, &[1.0]),
        INPUTS,
        "v1 is no sum of polynomials",
    );
    holds(&driven(circuit, sine(0.0, 1.0, 0.0), 1.0, &[1.0]), INPUTS);
}

#[test]
fn p_matrices_are_asked_for_by_their_two_theorems() {
    const ORDINARY: &str = "Brogliato-Thibault section A.4";
    const MARKOV: &str = "Leading Markov";
    holds(&leaky(&[1.0, 0.5], dmatrix![1.0, 3.0; 0.0, 1.0]), ORDINARY);
    fails_by(
        &leaky(&[1.0, 0.5], dmatrix![1.0, 3.0; 1.0, 1.0]),
        ORDINARY,
        "D is not a P-matrix",
    );
    let resistor = curve((0.0, 0.0), (1.0, 1.0), (1.0, 1.0));
    let circuit = with_laws(
        leaky(&[1.0], dmatrix![1.0]),
        std::slice::from_ref(&resistor),
    );
    fails_by(&circuit, ORDINARY, "not a complementary pair: d1");
    holds(&leaky(&[1.0], dmatrix![0.0]), MARKOV);
    fails_by(&antiparallel(), MARKOV, "CB is not a P-matrix");
    fails_by(&leaky(&[1.0], dmatrix![1.0]), MARKOV, "D ≠ 0");
    fails_by(
        &with_laws(leaky(&[1.0], dmatrix![0.0]), &[resistor]),
        MARKOV,
        "not a complementary pair: d1",
    );
}
