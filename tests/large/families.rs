//! Circuits of any size, written as netlists: the families whose cost is watched as they grow.
//!
//! Every generator is deterministic: the same size gives the same text. Switches are `SW(Ron=1m Roff=1meg)` and diodes
//! `D(Ron=1m Roff=1meg)` unless a family says otherwise; every netlist saves one to three signals.

use std::fmt::Write as _;

const MODELS: &str = ".model sw sw(ron=1m roff=1meg vt=0 vh=0)\n.model di d(ron=1m roff=1meg)\n";

/// A family: its name, what its size counts, and its text at a size.
pub(crate) struct Family {
    /// As it is asked for.
    pub(crate) name: &'static str,
    /// What one more of its size adds.
    pub(crate) unit: &'static str,
    /// The netlist of a size.
    pub(crate) netlist: fn(usize) -> String,
}

/// All families.
pub(crate) const FAMILIES: &[Family] = &[
    Family {
        name: "mmc",
        unit: "submodules an arm",
        netlist: mmc,
    },
    Family {
        name: "dab",
        unit: "dual-active-bridge cells",
        netlist: dab,
    },
    Family {
        name: "six-pulse",
        unit: "rectifiers on one bus",
        netlist: six_pulse,
    },
    Family {
        name: "cockcroft-walton",
        unit: "stages",
        netlist: cockcroft_walton,
    },
    Family {
        name: "cockcroft-walton-ideal",
        unit: "stages of ideal diodes",
        netlist: cockcroft_walton_ideal,
    },
    Family {
        name: "pv",
        unit: "strings of ten panels",
        netlist: pv,
    },
    Family {
        name: "marx",
        unit: "stages",
        netlist: marx,
    },
    Family {
        name: "h-bridges",
        unit: "cascaded H-bridges",
        netlist: h_bridges,
    },
    Family {
        name: "microgrid",
        unit: "converters on one bus",
        netlist: microgrid,
    },
    Family {
        name: "led-matrix",
        unit: "rows and columns",
        netlist: led_matrix,
    },
    Family {
        name: "mesh",
        unit: "nodes a side",
        netlist: mesh,
    },
    Family {
        name: "interleaved",
        unit: "phases",
        netlist: interleaved,
    },
    Family {
        name: "ladder",
        unit: "sections",
        netlist: ladder,
    },
    Family {
        name: "copies",
        unit: "separate buck converters",
        netlist: copies,
    },
];

/// One leg of a modular multilevel converter: two arms of `cells` half bridges each between the rails of a dc link and a load, every
/// submodule with a triangular carrier of its own, shifted by 1/`cells` of its period, against a sine of 50 Hz.
pub(crate) fn mmc(cells: usize) -> String {
    let mut out = format!("* modular multilevel converter, {cells} submodules an arm\n{MODELS}");
    let link = 1000.0;
    let each = link / cells as f64;
    let _ = write!(
        out,
        "vp p 0 {}\nvn n 0 {}\nlu au mid 1m\nll mid al 1m\nrl mid lo 10\nllo lo 0 1m\nvru ru 0 sin(0.5 -0.45 50)\nvrl rl 0 sin(0.5 0.45 50)\n",
        link / 2.0,
        -link / 2.0
    );
    for (arm, top, bottom) in [("u", "p", "au"), ("l", "al", "n")] {
        for k in 0..cells {
            let from = if k == 0 {
                top.to_string()
            } else {
                format!("{arm}{k}")
            };
            let to = if k + 1 == cells {
                bottom.to_string()
            } else {
                format!("{arm}{}", k + 1)
            };
            let period = 1.0 / 1850.0;
            let delay = -period * k as f64 / cells as f64;
            let _ = write!(
                out,
                "v{arm}{k} t{arm}{k} 0 pulse(0 1 {delay:e} {half:e} {half:e} 0 {period:e})\n\
                 s{arm}{k}a {from} c{arm}{k} r{arm} t{arm}{k} sw\n\
                 s{arm}{k}b {from} {to} t{arm}{k} r{arm} sw\n\
                 c{arm}{k} c{arm}{k} {to} {cap:e} ic={each}\n",
                half = period / 2.0,
                cap = 2e-3,
            );
        }
    }
    out + ".tran 20u 20m uic\n.save i(lu) v(mid) v(cu0)\n.end\n"
}

/// Dual active bridges, inputs in series and outputs in parallel, 20 kHz, all with the same phase shift.
pub(crate) fn dab(cells: usize) -> String {
    let mut out = format!(
        "* {cells} dual-active-bridge cells, inputs in series, outputs in parallel\n{MODELS}"
    );
    let _ = write!(
        out,
        "vin in0 0 {}\nvg g 0 pulse(-1 1 0 0 0 25u 50u)\nvh h 0 pulse(-1 1 4u 0 0 25u 50u)\nco out 0 {:e} ic=100\nro out 0 {:e}\n",
        100 * cells,
        1e-4 * cells as f64,
        10.0 / cells as f64
    );
    for k in 0..cells {
        let (p, n) = (
            format!("in{k}"),
            if k + 1 == cells {
                "0".into()
            } else {
                format!("in{}", k + 1)
            },
        );
        let _ = write!(
            out,
            "ci{k} {p} {n} 100u ic=100\n\
             sa{k} {p} a{k} g 0 sw\nsb{k} a{k} {n} 0 g sw\nsc{k} {p} b{k} 0 g sw\nsd{k} b{k} {n} g 0 sw\n\
             ll{k} a{k} x{k} {leak:e}\nlp{k} x{k} b{k} 10m\nls{k} y{k} z{k} 10m\nk{k} lp{k} ls{k} 1\n\
             se{k} out y{k} h 0 sw\nsf{k} y{k} 0 0 h sw\nsg{k} out z{k} 0 h sw\nsh{k} z{k} 0 h 0 sw\n",
            leak = 20e-6 * (1.0 + 0.001 * (k % 7) as f64),
        );
    }
    out + ".tran 10u 1m uic\n.save v(out) i(ll0) v(in0)\n.end\n"
}

/// Six-pulse rectifiers with source inductances of their own on one dc bus.
pub(crate) fn six_pulse(count: usize) -> String {
    let mut out = format!("* {count} six-pulse rectifiers on one bus\n{MODELS}");
    let _ = write!(
        out,
        "cb bus 0 {:e}\nrb bus 0 {:e}\n",
        1e-3 * count as f64,
        20.0 / count as f64
    );
    for k in 0..count {
        let shift = 60.0 * k as f64 / count as f64;
        for (phase, angle) in [("a", 0.0), ("b", -120.0), ("c", -240.0)] {
            let _ = write!(
                out,
                "v{phase}{k} s{phase}{k} w{k} sin(0 325 50 0 0 {})\nl{phase}{k} s{phase}{k} m{phase}{k} 1m\nr{phase}{k} m{phase}{k} n{phase}{k} 0.1\n\
                 du{phase}{k} n{phase}{k} bus di\ndl{phase}{k} 0 n{phase}{k} di\n",
                angle + shift
            );
        }
    }
    out + ".tran 50u 40m uic\n.save v(bus) i(la0)\n.end\n"
}

fn multiplier(stages: usize, diode: &str, span: &str) -> String {
    let mut out = format!(
        "* Cockcroft-Walton multiplier, {stages} stages\n{MODELS}.model ideal d(ron=0)\nv1 a0 0 sin(0 100 1k)\nrs a0 a 1\n"
    );
    let node = |side: char, k: usize| match (side, k) {
        ('a', 0) => "a".to_string(),
        ('b', 0) => "0".to_string(),
        _ => format!("{side}{k}"),
    };
    for k in 1..=stages {
        let (a, b, c, d) = (
            node('a', k - 1),
            node('a', k),
            node('b', k - 1),
            node('b', k),
        );
        let _ = write!(
            out,
            "ca{k} {a} {b} 1u\ncb{k} {c} {d} 1u\nda{k} {c} {b} {diode}\ndb{k} {b} {d} {diode}\n"
        );
    }
    let _ = write!(
        out,
        "rl b{stages} 0 {:e}\n.tran {span} uic\n.save v(b{stages}) v(b1)\n.end\n",
        1e6 * stages as f64
    );
    out
}

/// A Cockcroft-Walton multiplier of diodes with 1 mΩ.
pub(crate) fn cockcroft_walton(stages: usize) -> String {
    multiplier(stages, "di", "10u 10m")
}

/// The same of ideal diodes.
pub(crate) fn cockcroft_walton_ideal(stages: usize) -> String {
    multiplier(stages, "ideal", "10u 10m")
}

/// Strings of ten panels with bypass diodes on one bus; a shade moves over them.
pub(crate) fn pv(strings: usize) -> String {
    let mut out = format!(
        "* {strings} strings of 10 panels\n{MODELS}cb bus 0 {:e}\nrb bus 0 {:e}\n",
        1e-3 * strings as f64,
        60.0 / strings as f64
    );
    for s in 0..strings {
        for k in 0..10 {
            let (low, high) = (
                if k == 0 {
                    "0".into()
                } else {
                    format!("s{s}_{k}")
                },
                format!("s{s}_{}", k + 1),
            );
            let start = 0.1 + 0.8 * ((s * 10 + k) as f64) / (strings as f64 * 10.0);
            let _ = write!(
                out,
                "i{s}_{k} {low} {high} pwl(0 8 {start} 8 {} 3 {} 3 {} 8)\nr{s}_{k} {low} {high} 300\n\
                 dp{s}_{k} {high} m{s}_{k} dp\nvp{s}_{k} m{s}_{k} {low} 30\ndb{s}_{k} {low} {high} di\n",
                start + 0.02,
                start + 0.1,
                start + 0.12
            );
        }
        let _ = write!(out, "do{s} s{s}_10 t{s} di\nl{s} t{s} bus 1m\n");
    }
    out + ".model dp d(ron=0.1 roff=1meg)\n.tran 1m 1.2 uic\n.save v(bus) i(l0)\n.end\n"
}

/// A Marx generator: capacitors charged in parallel and discharged in series.
pub(crate) fn marx(stages: usize) -> String {
    let mut out = format!(
        "* Marx generator, {stages} stages\n{MODELS}vs s 0 1k\nrs s a1 100\nvg g 0 pulse(-1 1 1m 0 0 20u 2m)\n"
    );
    for k in 1..=stages {
        let _ = writeln!(out, "c{k} a{k} b{k} 100n");
        if k < stages {
            let _ = write!(
                out,
                "da{k} a{k} a{} di\ndb{k} b{} b{k} di\ns{k} a{k} b{} g 0 sw\n",
                k + 1,
                k + 1,
                k + 1
            );
        }
    }
    let _ = write!(
        out,
        "rg b1 0 1m\nso a{stages} o g 0 sw\nro o 0 {:e}\n.tran 1u 1.1m uic\n.save v(o) v(a1)\n.end\n",
        100.0 * stages as f64
    );
    out
}

/// Cascaded H-bridges with phase-shifted carriers on an inductive load.
pub(crate) fn h_bridges(cells: usize) -> String {
    let mut out = format!(
        "* {cells} cascaded H-bridges\n{MODELS}vr r 0 sin(0 0.9 50)\nvri ri 0 sin(0 -0.9 50)\n"
    );
    let each = 400.0 / cells as f64;
    for k in 0..cells {
        let (from, to) = (
            if k == 0 {
                "out".into()
            } else {
                format!("n{k}")
            },
            if k + 1 == cells {
                "0".into()
            } else {
                format!("n{}", k + 1)
            },
        );
        let period = 1e-3;
        let delay = -period * k as f64 / (2 * cells) as f64;
        let _ = write!(
            out,
            "vt{k} t{k} 0 pulse(-1 1 {delay:e} {half:e} {half:e} 0 {period:e})\nvc{k} p{k} c{k} {each}\nrc{k} c{k} d{k} 10m\ncc{k} p{k} d{k} 2m ic={each}\n\
             sa{k} p{k} {from} r t{k} sw\nsb{k} {from} d{k} t{k} r sw\nsc{k} p{k} {to} ri t{k} sw\nsd{k} {to} d{k} t{k} ri sw\n",
            half = period / 2.0
        );
    }
    out + "ll out lo 5m\nrl lo 0 10\n.tran 20u 20m uic\n.save v(out) i(ll)\n.end\n"
}

/// Buck converters with clocks of incommensurate frequencies from one dc bus behind a cable.
pub(crate) fn microgrid(count: usize) -> String {
    let mut out = format!(
        "* {count} converters with clocks of their own on one dc bus\n{MODELS}vs s 0 400\nrs s q {:e}\nlc q bus {:e}\ncb bus 0 {:e} ic=400\n",
        0.2 / count as f64,
        20e-6 / count as f64,
        50e-6 * count as f64
    );
    for k in 0..count {
        let period = 50e-6 * (1.0 + 0.2 * ((k as f64 + 1.0) * 0.618_033_988_749).fract());
        let on = period * (0.3 + 0.3 * ((k as f64 + 1.0) * 0.414_213_562_373).fract());
        let _ = write!(
            out,
            "vg{k} g{k} 0 pulse(-1 1 0 0 0 {on:e} {period:e})\ns{k} bus x{k} g{k} 0 sw\nd{k} 0 x{k} di\nl{k} x{k} o{k} 500u\nc{k} o{k} 0 100u\nr{k} o{k} 0 {}\n",
            10 + k % 5
        );
    }
    out + ".tran 10u 5m uic\n.save v(bus) v(o0)\n.end\n"
}

/// A matrix of light-emitting diodes scanned row by row; the diodes are piecewise linear with a forward voltage.
pub(crate) fn led_matrix(side: usize) -> String {
    let mut out = format!(
        "* {side} by {side} light-emitting diodes, scanned\n{MODELS}.model led d(vfwd=2 ron=10 roff=10meg)\nvs s 0 5\n"
    );
    let slot = 1e-3 / side as f64;
    for r in 0..side {
        let _ = write!(
            out,
            "vr{r} gr{r} 0 pulse(-1 1 {:e} 0 0 {slot:e} 1m)\nsr{r} s row{r} gr{r} 0 sw\ncr{r} row{r} 0 100p\n",
            slot * r as f64
        );
    }
    for c in 0..side {
        let on = slot * (0.2 + 0.6 * ((c as f64 + 1.0) * 0.618_033_988_749).fract());
        let _ = write!(
            out,
            "vc{c} gc{c} 0 pulse(-1 1 0 0 0 {on:e} {slot:e})\nsc{c} col{c} k{c} gc{c} 0 sw\nrc{c} k{c} 0 100\ncc{c} col{c} 0 100p\n"
        );
        for r in 0..side {
            let _ = writeln!(out, "d{r}_{c} row{r} col{c} led");
        }
    }
    out + ".tran 10u 2m uic\n.save v(row0) v(col0)\n.end\n"
}

/// A mesh of resistors with a capacitor at each node, fed by a buck converter at one corner and loaded at the other.
pub(crate) fn mesh(side: usize) -> String {
    let mut out = format!(
        "* mesh of {side} by {side} nodes fed by a buck converter\n{MODELS}vi in 0 12\nvg g 0 pulse(-1 1 0 0 0 0.4u 1u)\ns1 in x g 0 sw\nd1 0 x di\nl1 x n0_0 1u\n"
    );
    for i in 0..side {
        for j in 0..side {
            if i + 1 < side {
                let _ = writeln!(out, "rh{i}_{j} n{i}_{j} n{}_{j} 10m", i + 1);
            }
            if j + 1 < side {
                let _ = writeln!(out, "rv{i}_{j} n{i}_{j} n{i}_{} 10m", j + 1);
            }
            let _ = writeln!(out, "c{i}_{j} n{i}_{j} 0 1u");
        }
    }
    let _ = write!(
        out,
        "rl n{e}_{e} 0 1\n.tran 50n 50u uic\n.save v(n{e}_{e}) v(n0_0)\n.end\n",
        e = side - 1
    );
    out
}

/// Buck phases with interleaved clocks on one output.
pub(crate) fn interleaved(phases: usize) -> String {
    let mut out = format!(
        "* {phases} interleaved buck phases\n{MODELS}vi in 0 12\nco out 0 {:e}\nro out 0 {:e}\n",
        10e-6 * phases as f64,
        1.0 / phases as f64
    );
    for k in 0..phases {
        let delay = 1e-6 * k as f64 / phases as f64;
        let _ = write!(
            out,
            "vg{k} g{k} 0 pulse(-1 1 {delay:e} 0 0 0.2u 1u)\ns{k} in x{k} g{k} 0 sw\nd{k} 0 x{k} di\nl{k} x{k} out 1u\n"
        );
    }
    out + ".tran 0.1u 50u uic\n.save v(out) i(l0)\n.end\n"
}

/// A ladder of series resistors and shunt capacitors behind a rectifier.
pub(crate) fn ladder(sections: usize) -> String {
    let mut out = format!(
        "* RC ladder of {sections} sections behind a rectifier\n{MODELS}v1 in 0 sin(0 10 1k)\nd1 in n0 di\n"
    );
    for k in 0..sections {
        let _ = write!(out, "r{k} n{k} n{} 10\nc{k} n{} 0 10n\n", k + 1, k + 1);
    }
    let _ = write!(
        out,
        "rl n{sections} 0 10k\n.tran 10u 5m uic\n.save v(n{sections}) v(n1)\n.end\n"
    );
    out
}

/// Buck converters that share nothing but ground.
pub(crate) fn copies(count: usize) -> String {
    let mut out = format!("* {count} separate buck converters\n{MODELS}");
    for k in 0..count {
        let _ = write!(
            out,
            "vi{k} in{k} 0 12\nvg{k} g{k} 0 pulse(-1 1 0 0 0 4u 10u)\ns{k} in{k} x{k} g{k} 0 sw\nd{k} 0 x{k} di\nl{k} x{k} o{k} 22u\nc{k} o{k} 0 47u\nr{k} o{k} 0 3\n"
        );
    }
    out + ".tran 1u 1m uic\n.save v(o0) i(l0)\n.end\n"
}
