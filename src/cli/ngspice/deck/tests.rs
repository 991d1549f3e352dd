//! Decks as text.

use super::*;
use crate::circuit::{ElaborateOptions, elaborate};
use crate::diagnostic::SourceMap;
use crate::netlist;

fn circuit(text: &str) -> Circuit {
    let mut sources = SourceMap::default();
    let root = sources.add("test.cir", text);
    let missing = |_: &std::path::Path| Err(std::io::ErrorKind::NotFound.into());
    let (parsed, faults) = netlist::parse(&mut sources, root, &missing);
    assert!(faults.is_empty(), "{faults:?}");
    let (circuit, faults) = elaborate(&parsed, &ElaborateOptions::default());
    circuit.unwrap_or_else(|| panic!("{faults:?}"))
}

fn options(realisation: Realisation) -> Options {
    Options {
        reltol: 1e-4,
        max_step: 1e-6,
        method: "gear",
        realisation,
    }
}

#[test]
fn ideal_devices_become_what_ngspice_has() {
    let circuit = circuit(
        "rectifier with a switch\n\
         v1 in 0 pulse(0 5 0 0 0 1m 2m)\n\
         d1 in out dideal\n\
         s1 out load c 0 sw1\n\
         vc c 0 dc 5\n\
         x1 load 0 filter\n\
         .subckt filter a b\n\
         r1 a b 1k\n\
         c1 a b 1u ic=1\n\
         .ends\n\
         .model dideal d(ron=0.1 vfwd=0.7 roff=1meg)\n\
         .model sw1 sw(vt=1 vh=0.5 ron=1m roff=1g)\n\
         .tran 1u 4m uic\n\
         .save v(load) v(in,out) i(d1) i(x1.r1)\n\
         .end\n",
    );
    let deck = deck(&circuit, &options(Realisation::N001)).unwrap();
    insta::assert_snapshot!(format!("{}{}", deck.text, deck.notes.join("\n")), @r"
    * rectifier with a switch
    v1 in 0 dc 0e0 pulse(0e0 5e0 0e0 4e-10 4e-10 1e-3 2e-3)
    v.d1_sense in d1_sense 0
    v.d1_drop d1_sense d1_drop 7e-1
    d1 d1_drop out m.d1
    .model m.d1 d(is=1e-12 n=0.01 rs=1e-1)
    r.d1_off d1_sense out 1e6
    b.s1_control s1_control 0 v=(0e0 + (1e0)*v(c))
    s1 out load s1_control 0 m.s1
    .model m.s1 sw(vt=1e0 vh=5e-1 ron=1e-3 roff=1e9)
    vc c 0 dc 5e0
    v.x1.r1_sense load x1.r1_sense 0
    r.x1.r1 x1.r1_sense 0 1e3
    c.x1.c1 load 0 1e-6 ic=1e0
    .options reltol=1e-4 method=gear
    .tran 1e-6 4e-3 0e0 1e-6 uic
    .save i(v.d1_sense) i(v.x1.r1_sense) v(in) v(load) v(out)
    .end
    edges of zero width take 4e-10 s
    ideal diodes are D models with N = 0.01
    ");
}

#[test]
fn code_model_diodes_are_measured_in_series() {
    let circuit =
        circuit("t\nv1 a 0 1\nd1 a 0 di\n.model di d(ideal)\n.tran 1u 1m\n.save i(d1)\n.end\n");
    let deck = deck(&circuit, &options(Realisation::Sidiode)).unwrap();
    assert!(
        deck.text
            .contains("v.d1_sense a d1_sense 0\na.d1 d1_sense 0 m.d1\n"),
        "{}",
        deck.text
    );
    assert_eq!(
        deck.probes,
        [("i(d1)".to_owned(), Reading::Vector("i(v.d1_sense)".into()))]
    );
}

#[test]
fn without_a_transient_there_is_no_deck() {
    let error = deck(&Circuit::default(), &options(Realisation::Default)).unwrap_err();
    assert_eq!(error, DeckError::NoTran);
}

/// ngspice couples two inductors with a card, whose name it wants once.
#[test]
fn three_windings_on_one_card_are_three_cards_with_names_of_their_own() {
    let circuit = circuit(
        "transformer\n\
         v1 a 0 sin(0 1 50)\n\
         l1 a 0 1m\n\
         l2 b 0 4m\n\
         l3 c 0 9m\n\
         r2 b 0 1\n\
         r3 c 0 1\n\
         k1 l1 l2 l3 0.9\n\
         .tran 1u 1m uic\n\
         .end\n",
    );
    let deck = deck(&circuit, &options(Realisation::N001)).unwrap();
    let cards = deck.text.lines().filter(|line| line.starts_with('k'));
    let cards: Vec<Vec<&str>> = cards.map(|card| card.split(' ').collect()).collect();
    let pairs: Vec<&[&str]> = cards.iter().map(|card| &card[1..3]).collect();
    assert_eq!(pairs, [["l1", "l2"], ["l1", "l3"], ["l2", "l3"]]);
    let names: BTreeSet<&str> = cards.iter().map(|card| card[0]).collect();
    assert_eq!(names.len(), 3, "{names:?}");
}

#[test]
fn transistors_are_what_they_are_here_and_a_note_says_so() {
    let circuit = circuit(
        "t\nv1 a 0 1\nm1 a g 0 0 n w=1 l=1\nvg g 0 5\n.model n nmos(vto=1 kp=1)\n.tran 1u 1m\n.end\n",
    );
    let deck = deck(&circuit, &options(Realisation::N001)).unwrap();
    let told = deck
        .notes
        .iter()
        .filter(|note| note.contains("transistors (m1)"));
    assert_eq!(told.count(), 1, "{:?}", deck.notes);
}
