use super::Part;
use crate::mna::behaviour;
use crate::mna::fixture::circuit;

fn parts(text: &str) -> Vec<Part> {
    probed(text, &[])
}

fn probed(text: &str, probes: &[&str]) -> Vec<Part> {
    let mut circuit = circuit(text);
    circuit.probes = probes.iter().map(|p| circuit.probe(p).unwrap()).collect();
    behaviour(&circuit).unwrap().standard().parts()
}

/// The sources and powers of each part.
fn contents(parts: &[Part]) -> Vec<(Vec<&str>, Vec<&str>)> {
    let of = |part: &'_ Part| -> (Vec<String>, Vec<String>) {
        let sources = part.multiport.sources.iter().map(|s| s.input.name.clone());
        let powers = part.multiport.power.iter().map(|p| p.element.clone());
        (sources.collect(), powers.collect())
    };
    let leaked = |names: Vec<String>| -> Vec<&'static str> {
        let names = names.into_iter();
        names
            .map(|name| &*Box::leak(name.into_boxed_str()))
            .collect()
    };
    let all = parts.iter().map(of);
    all.map(|(a, b)| (leaked(a), leaked(b))).collect()
}

const RC: &str = "v1 a 0 1\n r1 a b 1k\n c1 b 0 1u\n";

#[test]
fn what_hangs_on_one_source_is_apart() {
    let text = format!("{RC} r2 a d 1k\n c2 d 0 1u\n");
    let parts = parts(&text);
    let expected = [
        (vec!["v1"], vec!["v1", "r1"]),
        (vec!["v1"], vec!["v1", "r2"]),
    ];
    assert_eq!(contents(&parts), expected);
    let places: Vec<&[usize]> = parts.iter().map(|part| &*part.storage).collect();
    assert_eq!(places, [[0], [1]]);
    assert!(parts[0].multiport.is_alike(&parts[1].multiport));
}

#[test]
fn other_values_make_another_kind() {
    let text = format!("{RC} r2 a d 2k\n c2 d 0 1u\n");
    let parts = parts(&text);
    assert_eq!(parts.len(), 2);
    assert!(!parts[0].multiport.is_alike(&parts[1].multiport));
}

#[test]
fn one_circuit_has_no_parts() {
    assert!(parts(RC).is_empty());
    // What moves by itself nowhere is no part.
    assert!(parts(&format!("{RC} v2 x 0 1\n r2 x y 1k\n r3 y 0 1k")).is_empty());
    // Resistors, controls, devices and switches join.
    let two = format!("{RC} c2 d 0 1u\n r2 d 0 1k\n");
    assert_eq!(parts(&two).len(), 2);
    for joint in [
        "r3 b d 1k",
        "e1 x 0 b 0 2\n r3 x d 1k",
        "d1 b d",
        "s1 b d 1 1k",
    ] {
        assert!(parts(&format!("{two} {joint}")).is_empty(), "{joint}");
    }
}

#[test]
fn a_current_that_controls_something_joins_what_draws_it() {
    let two = format!("{RC} r2 a d 1k\n c2 d 0 1u\n");
    assert_eq!(parts(&two).len(), 2);
    assert!(parts(&format!("{two} f1 x 0 v1 1\n r3 x 0 1k")).is_empty());
}

#[test]
fn sources_in_series_and_between_parts_join_nothing() {
    let series = "v1 a 0 1\n v2 b a 1\n r1 a x 1k\n c1 x 0 1u\n r2 b y 1k\n c2 y 0 1u\n";
    let series = parts(series);
    let expected = [
        (vec!["v1"], vec!["v1", "r1"]),
        (vec!["v1", "v2"], vec!["v1", "v2", "r2"]),
    ];
    assert_eq!(contents(&series), expected);
    let between = format!("{RC} c2 d 0 1u\n r2 d 0 1k\n i1 b d 1m");
    let expected = [
        (vec!["v1", "i1"], vec!["v1", "r1", "i1"]),
        (vec!["i1"], vec!["r2", "i1"]),
    ];
    assert_eq!(contents(&parts(&between)), expected);
}

#[test]
fn what_sources_do_to_each_other_belongs_to_the_first() {
    let text = format!("{RC} c2 d 0 1u\n r2 d 0 1k\n r3 a 0 1k\n v2 g 0 1");
    let parts = parts(&text);
    // A source without a load has no power.
    let expected = [(vec!["v1"], vec!["v1", "r1", "r3"]), (vec![], vec!["r2"])];
    assert_eq!(contents(&parts), expected);
}

#[test]
fn a_probe_is_the_sum_of_what_parts_add() {
    let text = format!("{RC} r2 a d 1k\n c2 d 0 1u\n");
    let parts = probed(&text, &["i(v1)", "v(b,d)", "v(d)", "v(a)"]);
    let probes: Vec<&[usize]> = parts.iter().map(|part| &*part.probes).collect();
    assert_eq!(probes, [&[0, 1, 3][..], &[0, 1, 2][..]]);
}
