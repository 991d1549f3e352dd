//! Ways to write a card that other programs accept, each beside the plain one that means the same.

use circ::circuit::{Diodes, ElaborateOptions};
use circ::diagnostic::Severity;
use circ::{Error, Model, SimOptions};

/// The model of these cards below a title.
fn model(cards: &str) -> Result<Model, Error> {
    Model::parse(&format!("title\n{cards}\n.end\n"), "a.cir")
}

/// The elements of these cards, a line each, and the transient.
fn elements(cards: &str) -> String {
    let model = model(cards).unwrap_or_else(|e| panic!("{cards}: {:?}", e.findings()));
    let circuit = model.circuit();
    let element = |e: &circ::circuit::Element| {
        format!("{} {:?} {:?} {:?} {:?}", e.name, e.p, e.n, e.kind, e.ic)
    };
    let elements: Vec<String> = circuit.elements.iter().map(element).collect();
    format!("{}\n{:?}", elements.join("\n"), circuit.tran)
}

/// Codes and severities of everything that is said of these cards.
fn said(cards: &str) -> Vec<(&'static str, Severity)> {
    let findings = match &model(cards) {
        Ok(model) => model.findings().to_vec(),
        Err(error) => error.findings().to_vec(),
    };
    findings.iter().map(|d| (d.code, d.severity)).collect()
}

/// The measurements of a run, by name; NaN where there is none.
fn measured(cards: &str) -> Vec<(String, f64)> {
    let model = model(cards).unwrap_or_else(|e| panic!("{cards}: {:?}", e.findings()));
    let done = circ::analysis::transient(&model, SimOptions::default());
    let found = done.run.unwrap().1.measured;
    let value = |m: &circ::circuit::Measured| m.result.as_ref().map_or(f64::NAN, |f| f.value);
    found.iter().map(|m| (m.name.clone(), value(m))).collect()
}

#[test]
fn cards_without_their_signs() {
    for (written, plain) in [
        ("r1 a 0 1k noiseless\nv1 a 0 1", "r1 a 0 1k\nv1 a 0 1"),
        ("v1 a 0 DC (5)\nr1 a 0 1", "v1 a 0 5\nr1 a 0 1"),
        ("v1 a 0 (5)\nr1 a 0 1", "v1 a 0 5\nr1 a 0 1"),
        ("i1 a 0 dc=(2*3)\nr1 a 0 1", "i1 a 0 6\nr1 a 0 1"),
        (
            "v1 a 0 1\nd1 a 0 m\n.model m D {Ron=2 Vfwd={0.5+0.1}}",
            "v1 a 0 1\nd1 a 0 m\n.model m D(Ron=2 Vfwd={0.5+0.1})",
        ),
        (
            ".param r 100 c {2*r} d=3 e -4\nv1 a 0 {e}\nr1 a 0 {r+c+d}",
            "v1 a 0 -4\nr1 a 0 {100+200+3}",
        ),
        (
            ".global_param r=7\n.csparam s={r}\nv1 a 0 1\nr1 a 0 {r}",
            "v1 a 0 1\nr1 a 0 7",
        ),
        (
            "v1 a 0 1\ns1 a 0 a 0 m\n.model m SW(Ron=1 Roff=2 Vt=0.5 noiseless)",
            "v1 a 0 1\ns1 a 0 a 0 m\n.model m SW(Ron=1 Roff=2 Vt=0.5)",
        ),
    ] {
        assert_eq!(elements(written), elements(plain), "{written}");
        assert!(
            said(written).iter().all(|(_, s)| *s == Severity::Note),
            "{written}: {:?}",
            said(written)
        );
    }
}

#[test]
fn measurements_without_their_signs() {
    let circuit = "v1 a 0 PULSE(0 2 1m 1m 1m 2m 8m)\nr1 a 0 1\n.tran 1u 16m\n";
    for (written, plain) in [
        ("avg v(a) from 0 to 4m", "avg v(a) from=0 to=4m"),
        ("avg v(a) FROM = 1m TO = {2*2m}", "avg v(a) from=1m to=4m"),
        ("find v(a) at 1.5m", "find v(a) at=1.5m"),
        ("when v(a)=1 td 5m", "when v(a)=1 td=5m"),
        ("when v(a)=1 rise 2", "when v(a)=1 rise=2"),
        ("when v(a)=1 fall last", "when v(a)=1 fall=last"),
        (
            "trig v(a) val 0.5 rise 1 targ v(a) val 0.5 fall last",
            "trig v(a) val=0.5 rise=1 targ v(a) val=0.5 fall=last",
        ),
        (
            "trig at 1m targ v(a) val=1 cross=2",
            "trig at=1m targ v(a) val=1 cross=2",
        ),
        ("eqn {2*3}", "param 2*3"),
    ] {
        let cards = format!("{circuit}.meas tran x {written}\n.measure y {plain}");
        let found = measured(&cards);
        assert!(found[0].1.is_finite(), "{written}: {found:?}");
        assert_eq!(found[0].1, found[1].1, "{written}");
        assert_eq!(said(&cards), [], "{written}");
    }
}

#[test]
fn a_chain_of_parameters_in_any_order() {
    let cards = "v1 a 0 SIN(1 2 1k)\nr1 a 0 4\n.tran 1u 1m\n\
        .meas eff param '100*pout/pin'\n.meas pout param 0.5*pin\n.meas pin avg v(a)*i(r1)";
    let found = measured(cards);
    let expected = [50.0, 0.5 * 0.75, 0.75];
    for ((_, value), expected) in found.iter().zip(expected) {
        // (1 + 2²/2)/4 W, from straight lines between 1000 rows a period.
        assert!((value / expected - 1.0).abs() < 1e-5, "{found:?}");
    }
}

#[test]
fn a_faulty_measurement_is_a_warning() {
    for faulty in [
        ".meas tran",
        ".meas tran x foo v(a)",
        ".meas tran x avg",
        ".meas tran x avg v(nowhere)",
        ".meas tran x avg v(a) from",
        ".meas tran x find v(a) at 1m 2m",
        ".meas tran x trig v(a) val=1",
        ".meas tran x param nothing*2",
        ".meas tran x avg Ix(x1:p)",
        ".meas tran x avg Ix(r1)",
        ".meas tran x avg Id(r1)",
        ".measure tran x when",
        ".four v(a)",
        ".four 0 v(a)",
        ".four 1k 1.5 v(a)",
    ] {
        let cards = format!("v1 a 0 1\nr1 a 0 1\n.tran 1u 1m\n{faulty}\n.meas y avg v(a)");
        let told = said(&cards);
        assert_eq!(told.len(), 1, "{faulty}: {told:?}");
        assert_eq!(told[0].1, Severity::Warning, "{faulty}: {told:?}");
        let found = measured(&cards);
        assert_eq!(found.last(), Some(&("y".into(), 1.0)), "{faulty}");
    }
}

#[test]
fn currents_into_pins() {
    let cards = "v1 a 0 10\nr0 a b 1\nx1 b c part\nr2 c 0 1\n.subckt part p n\nr1 p n 8\nr2 p m 4\nr3 m n 4\n.ends\n\
        .tran 1m 2m\n.save Ix(x1:p)\n.meas p avg Ix(x1:p)\n.meas n avg -ix(X1:n)\n.meas all avg i(r0)";
    // 8 Ω beside 8 Ω, and 2 Ω: 10/6 A.
    for (name, value) in measured(cards) {
        assert!((value - 10.0 / 6.0).abs() < 1e-12, "{name} {value}");
    }
    // What is measured can be shown.
    assert_eq!(said(cards), []);
    let bipolar = "v1 c 0 5\nrc c cc 1k\nvb bb 0 2\nrb bb b 10k\nq1 cc b e m\nre e 0 100\n.model m NPN\n.tran 1m 2m\n\
        .meas ic avg Ic(q1)\n.meas ib avg Ib(q1)\n.meas ie avg Ie(q1)\n.meas rc avg i(rc)\n.meas rb avg i(rb)\n.meas re avg -i(re)";
    let found = measured(bipolar);
    for k in 0..3 {
        let [a, b] = [found[k].1, found[k + 3].1];
        assert!(a != 0.0 && (a - b).abs() < 1e-9 * b.abs(), "{found:?}");
    }
    let mos = "v1 d 0 5\nr1 d dd 9\nvg g 0 10\nm1 dd g s m\nr2 s 0 1\n.model m NMOS(Ron=0 Vto=2)\n.tran 1m 2m\n.save Id(M1)\n\
        .meas d avg Id(m1)\n.meas g avg Ig(m1)\n.meas s avg -Is(m1)";
    let found: Vec<f64> = measured(mos).iter().map(|(_, value)| *value).collect();
    assert!(
        (found[0] - 0.5).abs() < 1e-12 && found[1] == 0.0 && (found[2] - 0.5).abs() < 1e-12,
        "{found:?}"
    );
    // With a pin at ground the elements inside may be there without it.
    let grounded = "v1 a 0 1\nx1 a 0 part\n.subckt part p n\nr1 p n 8\nr2 p 0 4\n.ends\n.tran 1m 2m\n.meas n avg Ix(x1:n)";
    assert_eq!(said(grounded), [("bad-meas", Severity::Warning)]);
}

#[test]
fn parameters_of_models_are_swept() {
    let cards = "v1 a 0 5\nr1 a b 1\nd1 b 0 dm\n.model dm D(Ron={2*u} Vfwd=1)\n.param u=1\n.tran 1m 2m\n.save v(b)\n";
    let stepped = model(&format!(
        "{cards}.step D dm(Ron) list 1 3\n.step dm dm(roff) 10 20 10"
    ))
    .unwrap();
    let names: Vec<String> = stepped
        .circuit()
        .steps
        .iter()
        .map(|s| format!("{:?} {:?}", s.what, s.values))
        .collect();
    assert_eq!(
        names,
        [
            "Param(\"dm(ron)\") [1.0, 3.0]",
            "Param(\"dm(roff)\") [10.0, 20.0]"
        ]
    );
    let at = |values: &[f64]| stepped.at(&stepped.circuit().steps, values, None).unwrap();
    let law = |model: &Model| format!("{:?}", model.circuit().elements[2].kind);
    let plain = |ron: f64, roff: f64| {
        model(&cards.replace("{2*u}", &format!("{ron} Roff={roff}"))).unwrap()
    };
    // As they stand: the value on the card, and the first one of what is not there.
    assert!(law(&stepped).contains("f64: 2.0") && law(&stepped).contains("f64: 10.0"));
    for (ron, roff) in [(1.0, 10.0), (3.0, 20.0)] {
        let v = |model: &Model| model.operating_point().unwrap().nodes[1].1;
        assert_eq!(v(&at(&[ron, roff])), v(&plain(ron, roff)));
    }
    assert_eq!(
        said(&format!("{cards}.step D other(Ron) list 1 3"))[0].0,
        "unknown-model"
    );
}

#[test]
fn ideal_diodes_stand_for_missing_models() {
    let options = ElaborateOptions {
        diodes: Diodes::Ideal,
        ..ElaborateOptions::default()
    };
    let text = "title\nv1 a 0 5\nd1 a b dx\nd2 a b dx\nr1 b 0 1\n.end\n";
    let model = Model::parse_with(text, "a.cir", options).unwrap();
    let told: Vec<&str> = model
        .findings()
        .iter()
        .map(|d| d.message.as_str())
        .collect();
    assert!(
        told[0].ends_with("unknown model `dx` of `d1`, the first of 2 that do"),
        "{told:?}"
    );
}

/// What LTspice's `.tran 0 Tstop 0 dTmax` asks for: rows as close as that.
#[test]
fn a_largest_step_alone_says_how_far_rows_are_apart() {
    let tran = |card: &str| {
        let model = model(&format!("v1 a 0 1\nr1 a 0 1\n{card}")).expect("a circuit");
        let tran = model.circuit().tran.expect("a transient");
        (tran.tstep, tran.prints)
    };
    assert_eq!(tran(".tran 5m"), (5e-6, false));
    assert_eq!(tran(".tran 0 5m 0 1u"), (1e-6, false));
    assert_eq!(tran(".tran 0 5m 0 1m"), (5e-6, false));
    assert_eq!(tran(".tran 0 5m 0 1p"), (5e-8, false));
    assert_eq!(tran(".tran 10u 5m 0 1u"), (1e-5, true));
}

const BUCK: &str = "v1 vin 0 48 rser=20m\nv2 gate 0 pulse(0 10 0 10n 10n 2.5u 10u)\ns1 vin sw gate 0 mysw\nd1 0 sw myd\nl1 sw out 33u rser=25m ic=0\n\
                    c1 out 0 220u rser=12m ic=0\nc2 vin 0 10u rser=5m\nrload out 0 2.4\n.model mysw sw(ron=15m roff=10meg vt=5 vh=0)\n\
                    .model myd d(ron=20m roff=10meg vfwd=0.5)\n.meas tran pin avg -v(vin)*i(v1) from 4m to 5m\n";

/// The finer rows that measurements see put an edge an ulp beside the row that is shown there.
#[test]
fn times_of_rows_never_go_back() {
    for tran in [
        ".tran 0 2m uic",
        ".tran 0 3m uic",
        ".tran 0 5m 0 1u uic",
        ".tran 2u 2m uic",
    ] {
        let model = model(&format!("{BUCK}{tran}")).expect("a circuit");
        let done = circ::analysis::transient(&model, SimOptions::default());
        let (run, _) = done.run.expect("a run");
        let times = &run.waveforms.time;
        assert!(times.windows(2).all(|pair| pair[0] <= pair[1]), "{tran}");
    }
}

/// The input current flows within 0.25 µs after each edge; rows 2.5 µs apart made 67 W of 57. Rows are computed closer, once; where a fixed step forbids that a
/// note says so.
#[test]
fn rows_are_close_enough_for_measurements_or_a_note_says_so() {
    let of = |tran: &str, step: Option<f64>| {
        let model = model(&format!("{BUCK}{tran}")).expect("a circuit");
        let options = SimOptions {
            method: step.map_or_else(Default::default, |_| circ::integrate::Method::Theta),
            step,
            ..SimOptions::default()
        };
        let (run, found) = circ::analysis::transient(&model, options)
            .run
            .expect("a run");
        let told = run
            .notes
            .iter()
            .any(|note| note.text.contains("too far apart for pin"));
        (
            found.measured[0].result.as_ref().expect("a value").value,
            told,
        )
    };
    let (fine, told) = of(".tran 20n 5m 0 20n uic", None);
    assert!(!told);
    for tran in [".tran 5m uic", ".tran 10u 5m uic", ".tran 3u 5m uic"] {
        let (value, told) = of(tran, None);
        assert!(
            !told && (value / fine - 1.0).abs() < 1e-3,
            "{tran}: {value} {fine}"
        );
    }
    let (value, told) = of(".tran 2u 5m uic", Some(1e-7));
    assert!(told && (value / fine - 1.0).abs() > 0.01, "{value} {fine}");
    // Where nothing is between rows nothing is said.
    let plain =
        ".meas tran top max v(a)\n.meas tran mean avg v(a)\nv1 a 0 sin(0 1 1k)\nr1 a 0 1\n.tran 1m";
    let (run, _) =
        circ::analysis::transient(&model(plain).expect("a circuit"), SimOptions::default())
            .run
            .expect("a run");
    assert!(run.notes.is_empty(), "{:?}", run.notes);
}

/// At its events alone the output of a converter stands at its mean: 0.14 mV of 16.2 mV were seen of this ripple. Rows of a file are the same with
/// measurements, whose closer rows fall on corners.
#[test]
fn measurements_see_a_ripple_between_events() {
    let cards = "v1 in 0 24\ns1 in sw g 0 mysw\nd1 0 sw myd\nl1 sw out 47u\nc1 out 0 100u\nr1 out 0 4\nvg g 0 pulse(0 5 0 10n 10n 4.99u 10u)\n\
                 .model mysw sw(ron=10m roff=1meg vt=2.5 vh=0)\n.model myd d(ron=10m roff=1meg vfwd=0.4)\n.tran 20m";
    let measure = ".meas tran vpp pp v(out) from 18m to 20m";
    let of = |cards: &str| {
        let model = model(cards).expect("a circuit");
        let done = circ::analysis::transient(&model, SimOptions::default());
        done.run.expect("a run")
    };
    let (plain, _) = of(cards);
    let (run, found) = of(&format!("{cards}\n{measure}"));
    let vpp = found.measured[0].result.as_ref().expect("a value").value;
    // ΔI / (8 f C).
    assert!((vpp / 16.231e-3 - 1.0).abs() < 1e-3, "{vpp}");
    let waves = &plain.waveforms;
    let with = &run.waveforms.time;
    assert_eq!(waves.time.len(), with.len());
    assert!(
        waves
            .time
            .iter()
            .zip(with)
            .all(|(a, b)| (a - b).abs() < 1e-12)
    );
}

/// Parts that nobody wrote are not among the signals that are shown without being asked for.
#[test]
fn parasitic_parts_are_shown_where_they_are_asked_for() {
    let names = |more: &str| {
        let model = model(&format!("{BUCK}.tran 10u 100u uic\n{more}")).expect("a circuit");
        model
            .transient(SimOptions::default())
            .expect("a run")
            .waveforms
            .names
    };
    assert_eq!(
        names(""),
        [
            "v(vin)", "v(gate)", "v(sw)", "v(out)", "i(v1)", "i(v2)", "i(l1)"
        ]
    );
    assert_eq!(names(".save v(l1.rser)"), ["v(l1.rser)"]);
}

#[test]
fn a_slip_in_the_name_of_a_parameter_is_a_warning() {
    let diode = |model: &str| {
        said(&format!(
            "v1 a 0 1\nd1 a b m\nd2 a b m\nr1 b 0 1\n.tran 1u 1m\n.model m {model}"
        ))
    };
    let slip = [("unknown-parameter", Severity::Warning)];
    assert_eq!(diode("d(ron=20m roff=1meg vfdw=0.45)"), slip);
    assert_eq!(diode("d(ron=20m rof=1meg)"), slip);
    assert_eq!(
        diode("d(ron=20m vfwd=0.4 mfg=maker type=si vpk=100 iave=1 ilimit=3)")
            .iter()
            .filter(|f| f.0 == slip[0].0)
            .count(),
        0
    );
    let switch = |model: &str| {
        said(&format!(
            "v1 a 0 1\ns1 a b a 0 m\nr1 b 0 1\n.tran 1u 1m\n.model m {model}"
        ))
    };
    assert_eq!(switch("sw(ron=1 vonn=0.5 vt=0.5)"), slip);
    assert_eq!(switch("sw(ron=1 vt=0.5 vh=0.1)"), []);
}

/// What no dialect has would be read as if it were not there, near to another name or not.
#[test]
fn what_no_model_has_is_a_warning_with_what_was_meant() {
    let helps = |cards: &str| -> Vec<String> {
        let model = model(&format!("v1 a 0 1\nr1 b 0 1\n.tran 1u 1m\n{cards}")).expect("a circuit");
        let slips = model
            .findings()
            .iter()
            .filter(|d| d.code == "unknown-parameter");
        slips.map(|d| d.help.clone().expect("a help")).collect()
    };
    for (cards, meant) in [
        ("s1 a b a 0 m\n.model m sw(ron=1 vthreshold=0.5)", "`vt`"),
        ("s1 a b a 0 m\n.model m sw(ron=1 vth=0.5)", "`vt`"),
        ("d1 a b m\n.model m d(ron=1m vf=0.6)", "`vfwd`"),
        ("m1 a a2 b m\nr2 a2 0 1\n.model m vdmos(vth=2)", "`vto`"),
        ("q1 a a2 b m\nr2 a2 a 1k\n.model m npn(hfe=200)", "`bf`"),
        ("d1 a b m\n.model m d(is=1n foo=3)", "those that count"),
        (
            "x1 a b p rtpo=3k\n.subckt p i o params: rtop=1k\nr1 i o {rtop}\n.ends",
            "`rtop`",
        ),
    ] {
        let found = helps(cards);
        assert!(
            found.len() == 1 && found[0].contains(meant),
            "{cards}: {found:?}"
        );
    }
    // What a subcircuit asks for needs no default, and what it defines may be replaced.
    for cards in [
        "x1 a b p r=3k\n.subckt p i o\nr1 i o {r}\n.ends",
        "x1 a b p s=3k\n.subckt p i o\n.param s=1k\nr1 i o {s}\n.ends",
        "q1 a a2 b m\nr2 a2 a 1k\n.model m npn(bf=200 vceo=40 trb1=1m mfg=x)",
    ] {
        assert_eq!(helps(cards), Vec::<String>::new(), "{cards}");
    }
}

/// A table behind the controlling nodes, as LTspice writes it, is that of their voltage.
#[test]
fn a_table_of_the_controlling_nodes() {
    let table = |form: &str| {
        let text = format!(
            "v1 a 0 sin(0 2 1k)\nr1 a 0 1k\ne1 b 0 {form}\nr2 b 0 1k\n.tran 10u 1m\n.save v(b)"
        );
        let run = model(&text)
            .expect("a circuit")
            .transient(SimOptions::default());
        run.expect("a run").waveforms.values
    };
    let plain = table("table {v(a)} = (-1,-1) (0,0) (1,3)");
    for form in [
        "a 0 table=(-1 -1, 0 0, 1 3)",
        "a 0 table(-1,-1,0,0,1,3)",
        "a 0 TABLE = (-1,-1) (0,0) (1,3)",
    ] {
        assert_eq!(table(form), plain, "{form}");
    }
}

/// 10 A through a body diode of 0.7 V beside a channel of 50 mΩ that is on: all of it in the channel.
#[test]
fn a_body_diode_has_the_drop_of_its_model() {
    let drop = |vfwd: &str| {
        let text = format!(
            "i1 0 a 10\nm1 0 g a a md\nvg g 0 10\n.model md vdmos(vto=2 kp=1k rd=50m {vfwd})\n.tran 1u 1m\n.save v(a)"
        );
        let run = model(&text)
            .expect("a circuit")
            .transient(SimOptions::default());
        *run.expect("a run").waveforms.values.last().expect("rows")
    };
    assert!(drop("").abs() < 1e-9);
    assert!(
        (drop("vfwd=0.7") - 0.5).abs() < 0.01,
        "{}",
        drop("vfwd=0.7")
    );
    assert!((drop("vfwd=0.3") - 0.3).abs() < 1e-9);
}

/// R(T) = R (1 + TC1 ΔT + TC2 ΔT²) with ΔT from 27 °C on, as ngspice's `op` has it: 1.6667 V in the first case.
#[test]
fn resistances_follow_their_temperature() {
    let ohms = |card: &str, more: &str| {
        let text = format!("v1 a 0 1\n{card}\n.tran 1u 1m\n{more}");
        let model = model(&text).expect("a circuit");
        let circuit = model.circuit();
        match circuit.elements[circuit.element("r1").expect("r1").index()].kind {
            circ::circuit::Kind::Resistor(ohms) => ohms.f64,
            ref other => panic!("{other:?}"),
        }
    };
    for (card, more, expected) in [
        ("r1 a 0 1k tc=0.01", ".temp 127", 2e3),
        ("r1 a 0 1k tc1=1m tc2=1u", ".temp 127", 1.11e3),
        ("r1 a 0 1k tc=0.01,0.001", ".temp 37", 1.2e3),
        ("r1 a 0 1k tc = 0.01 , 0.001 temp=37", "", 1.2e3),
        ("r1 a 0 1k tc1=0.01,tc2=0.001", ".temp 37", 1.2e3),
        ("r1 a 0 1k tce=2", ".temp 77", 1e3 * 1.01_f64.powi(100)),
        (
            "r1 a 0 rm 1k",
            ".model rm r(tc=0.01,0.001)\n.temp 37",
            1.2e3,
        ),
        ("r1 a 0 1k tc1=1m temp=77", "", 1.05e3),
        ("r1 a 0 1k tc1=1m dtemp=10", "", 1.01e3),
        ("r1 a 0 rm 1k", ".model rm r(tc1=0.01)\n.temp 37", 1.1e3),
        ("r1 a 0 1k tc1=1m", "", 1e3),
    ] {
        let found = ohms(card, more);
        assert!(
            (found - expected).abs() < 1e-9 * expected,
            "{card} {more}: {found}"
        );
    }
}

#[test]
fn what_two_cards_step_is_a_fault() {
    let stepped = |cards: &str| {
        said(&format!(
            "v1 a 0 1\nr1 a 0 {{r}}\n.param r=1 q=1\n{cards}\n.tran 1u 1m"
        ))
    };
    assert_eq!(
        stepped(".step param r list 1 2\n.step param r list 3 4"),
        [("bad-sweep", Severity::Error)]
    );
    assert_eq!(stepped(".step param r list 1 2\n.step v1 1 2 1"), []);
}

/// The card of a flip-flop or gate stands for its parts.
#[test]
fn findings_about_a_gate_name_its_card() {
    let text = "title\nv1 in 0 1\na1 in 0 0 0 0 0 q 0 buf rout=0\nv2 q 0 0.3\n.tran 1u 1m\n.end\n";
    let model = Model::parse(text, "a.cir").expect("a circuit");
    let error = model.transient(SimOptions::default()).expect_err("a loop");
    let finding = error.diagnostic(model.circuit());
    assert_eq!(finding.message, "v2 is shorted by a1");
    let line = finding.span.map(|span| model.sources().line_column(span).0);
    assert_eq!(line, Some(3));
}

/// What can be written where a value is to follow a voltage, and a model of another program, which cannot be read.
#[test]
fn what_is_not_read_has_a_remedy() {
    let error = model("v1 a 0 1\nr1 a 0 R=1k*(1+V(a)/10)\n.tran 1u 1m").expect_err("no number");
    let help = error.findings()[0].help.clone().unwrap_or_default();
    assert!(help.contains("TABLE {V(a,b)}"), "{help}");
    // As the help has it: 4 mA at 2 V.
    let cards =
        "v1 a 0 2\ng1 a 0 TABLE {V(a)} = (0,0) (1,1m) (2,4m)\n.tran 1u 1m\n.meas tran i avg i(v1)";
    assert_eq!(measured(cards), [("i".to_owned(), -4e-3)]);
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("buck.plecs");
    std::fs::write(&path, "Plecs {\n}\n").expect("a file");
    let loaded = circ::netlist::load(&path, &ElaborateOptions::default());
    let help = loaded.diagnostics[0].help.clone().unwrap_or_default();
    assert!(help.contains("docs/from-plecs.md"), "{help}");
}

#[test]
fn an_initial_condition_without_uic_is_told_once() {
    let text = "title\nv1 a 0 1\nr1 a b 1k\nc1 b 0 1u ic=5\nr2 b c 1k\nc2 c 0 1u ic=4\n.tran 1u 1m\n.end\n";
    let model = Model::parse(text, "a.cir").expect("a circuit");
    let findings = model
        .findings()
        .iter()
        .filter(|d| d.code == "ic-without-uic");
    let told: Vec<&str> = findings.map(|d| &d.message[..]).collect();
    assert_eq!(
        told,
        ["`IC=` of `c1` and `c2` has no effect: the run starts from the operating point"]
    );
    let run = model.transient(SimOptions::default()).expect("a run");
    assert_eq!(run.notes, []);
}

/// Probes as LTspice and PSpice write them, by pins and with colons.
#[test]
fn signals_inside_and_at_pins_of_subcircuits() {
    let cards = "v1 a 0 4\nx1 a b half\nr2 b 0 1\n.subckt half p out\nr1 p out 1\n.ends\n.tran 1u 1m\n\
        .meas tran x avg V(X1:out)\n.meas tran y avg I(X1:R1)";
    assert_eq!(
        measured(cards),
        [("x".to_owned(), 2.0), ("y".to_owned(), 2.0)]
    );
    let model = model(cards).expect("a circuit");
    let named = |text: &str| model.circuit().probe(text).map(|probe| probe.name);
    for (text, name) in [
        ("V(X1:out)", "v(b)"),
        ("V(R2:1)", "v(b)"),
        ("I(X1:R1)", "i(x1.r1)"),
    ] {
        assert_eq!(named(text).as_deref(), Some(name), "{text}");
    }
    assert_eq!(named("V(X1:in)"), None);
}
