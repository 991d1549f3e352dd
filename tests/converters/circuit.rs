//! A circuit as the tests hold it: cards that are written as text for `circ` and ngspice, and that the oracle reads without
//! any part of `circ`.

use std::collections::BTreeSet;
use std::fmt::Write;

/// A source's waveform; times in s.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Wave {
    Dc(f64),
    /// offset, amplitude, Hz, degrees.
    Sin(f64, f64, f64, f64),
    Pulse {
        levels: [f64; 2],
        delay: f64,
        rise: f64,
        fall: f64,
        width: f64,
        period: f64,
    },
    /// Corners; two of one time are an edge.
    Pwl(Vec<(f64, f64)>),
}

impl Wave {
    /// The largest magnitude it may have.
    pub(crate) fn largest(&self) -> f64 {
        match self {
            Self::Dc(v) => v.abs(),
            Self::Sin(offset, amplitude, ..) => offset.abs() + amplitude.abs(),
            Self::Pulse { levels: [a, b], .. } => a.abs().max(b.abs()),
            Self::Pwl(corners) => corners.iter().fold(0.0, |m, c| m.max(c.1.abs())),
        }
    }
}

/// How a comparator is written.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Writing {
    Ternary,
    If,
    Step,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct SwitchModel {
    pub(crate) ron: f64,
    /// Infinite where there is none.
    pub(crate) roff: f64,
    pub(crate) vt: f64,
    pub(crate) vh: f64,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum DiodeModel {
    /// Vfwd, Ron, Roff (infinite where there is none).
    Lines(f64, f64, f64),
    /// Is, N, Rs.
    Curved(f64, f64, f64),
}

/// A MOSFET as a switch with a body diode.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct MosModel {
    /// Negative for a p-channel one.
    pub(crate) vto: f64,
    pub(crate) p_channel: bool,
    pub(crate) ron: f64,
    pub(crate) roff: f64,
    /// In series with the body diode.
    pub(crate) rb: f64,
}

/// A thyristor whose gate draws nothing: Vfwd, Ron, Roff of its diode, and what its gate needs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ThyristorModel {
    pub(crate) lines: [f64; 3],
    pub(crate) vgt: f64,
}

/// An inductor that saturates: its inductance up to a current of either sign, and beyond.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Core {
    pub(crate) henries: f64,
    pub(crate) knee: f64,
    pub(crate) saturated: f64,
    /// A at the start.
    pub(crate) ic: f64,
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) enum Part {
    R(f64),
    /// F, V at the start.
    C(f64, f64),
    /// H, A at the start.
    L(f64, f64),
    /// The coupling of two inductors.
    K(String, String, f64),
    V(Wave),
    I(Wave),
    /// Nodes p n a b: v(p,n) = gain·v(a,b).
    Gain(f64),
    /// Nodes p n a b: v(p,n) is the first level where v(a,b) > 0, else the second.
    Comparator([f64; 2], Writing),
    /// Nodes p n a b.
    S(SwitchModel),
    /// Nodes anode, cathode.
    D(DiodeModel),
    /// Nodes drain, gate, source.
    M(MosModel),
    /// Nodes anode, cathode, gate.
    Thyristor(ThyristorModel),
    Core(Core),
}

#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Card {
    pub(crate) name: String,
    pub(crate) nodes: Vec<String>,
    pub(crate) part: Part,
}

#[derive(Debug, Clone, Default)]
pub(crate) struct Circuit {
    pub(crate) title: String,
    pub(crate) cards: Vec<Card>,
    /// Rows are `stop`/`rows` apart.
    pub(crate) stop: f64,
    pub(crate) rows: usize,
}

/// What is recorded: capacitor voltages and inductor currents.
pub(crate) fn states(circuit: &Circuit) -> Vec<String> {
    let coupled = wholly_coupled(circuit);
    let state = |card: &Card| match card.part {
        Part::C(..) => Some(voltage(&card.nodes[0], &card.nodes[1])),
        Part::L(..) if !coupled.contains(&card.name) => Some(format!("i({})", card.name)),
        // Its flux, as the current that it would have in the inductance of small ones.
        Part::Core(..) => Some(format!("i({}.flux)", card.name)),
        _ => None,
    };
    circuit.cards.iter().filter_map(state).collect()
}

/// Inductors whose current may jump alone, as another one is coupled to them without leakage.
pub(crate) fn wholly_coupled(circuit: &Circuit) -> BTreeSet<String> {
    let pair = |card: &Card| match &card.part {
        Part::K(a, b, k) if k.abs() >= 1.0 => Some([a.clone(), b.clone()]),
        _ => None,
    };
    circuit.cards.iter().filter_map(pair).flatten().collect()
}

fn voltage(p: &str, n: &str) -> String {
    match (p, n) {
        (p, "0") => format!("v({p})"),
        (p, n) => format!("v({p},{n})"),
    }
}

impl Circuit {
    /// The distance of rows, s.
    pub(crate) fn step(&self) -> f64 {
        self.stop / self.rows as f64
    }

    /// As a netlist, with the states recorded.
    pub(crate) fn text(&self) -> String {
        self.text_saving(&states(self), self.rows)
    }

    /// As a netlist; an empty list of signals leaves the choice to the program.
    pub(crate) fn text_saving(&self, signals: &[String], rows: usize) -> String {
        let mut text = format!("{}\n", self.title);
        let mut models = Vec::new();
        for card in &self.cards {
            let line = card_text(card, &mut models);
            text += &line;
            text.push('\n');
        }
        for (k, model) in models.iter().enumerate() {
            writeln!(text, ".model m{k} {model}").expect("memory");
        }
        if !signals.is_empty() {
            writeln!(text, ".save {}", signals.join(" ")).expect("memory");
        }
        let step = self.stop / rows as f64;
        text + &format!(".tran {step:e} {:e} uic\n.end\n", self.stop)
    }
}

fn model(models: &mut Vec<String>, text: String) -> String {
    let k = models.iter().position(|m| *m == text).unwrap_or_else(|| {
        models.push(text);
        models.len() - 1
    });
    format!("m{k}")
}

fn ohms(key: &str, value: f64) -> String {
    if value.is_finite() {
        format!(" {key}={value:e}")
    } else {
        format!(" {key}=inf")
    }
}

fn card_text(card: &Card, models: &mut Vec<String>) -> String {
    let (name, nodes) = (&card.name, card.nodes.join(" "));
    match &card.part {
        Part::R(r) => format!("{name} {nodes} {r:e}"),
        Part::C(c, ic) => format!("{name} {nodes} {c:e} ic={ic:e}"),
        Part::L(l, ic) => format!("{name} {nodes} {l:e} ic={ic:e}"),
        Part::K(a, b, k) => format!("{name} {a} {b} {k:e}"),
        Part::V(wave) | Part::I(wave) => format!("{name} {nodes} {}", wave_text(wave)),
        Part::Gain(gain) => format!("{name} {nodes} {gain:e}"),
        Part::Comparator([high, low], writing) => {
            let (out, v) = (
                card.nodes[..2].join(" "),
                format!("v({},{})", card.nodes[2], card.nodes[3]),
            );
            match writing {
                Writing::Ternary => format!("b{name} {out} V={v} > 0 ? {high:e} : {low:e}"),
                Writing::If => format!("e{name} {out} VALUE={{if({v}>0,{high:e},{low:e})}}"),
                Writing::Step => format!("b{name} {out} V={low:e}+{:e}*u({v})", high - low),
            }
        }
        Part::S(s) => {
            let ideal = s.ron == 0.0 && s.roff.is_infinite();
            let resistances = if ideal {
                " ideal".to_string()
            } else {
                ohms("ron", s.ron) + &ohms("roff", s.roff)
            };
            let text = format!("sw({resistances} vt={:e} vh={:e})", s.vt, s.vh);
            format!("{name} {nodes} {}", model(models, text))
        }
        Part::D(DiodeModel::Lines(vfwd, ron, roff)) => {
            let text = if *vfwd == 0.0 && *ron == 0.0 && roff.is_infinite() {
                "d(n=0.01)".to_string()
            } else if roff.is_infinite() {
                format!("d(ron={ron:e} vfwd={vfwd:e})")
            } else {
                format!("d(ron={ron:e} vfwd={vfwd:e} roff={roff:e})")
            };
            format!("{name} {nodes} {}", model(models, text))
        }
        Part::D(DiodeModel::Curved(is, n, rs)) => {
            let text = format!("d(is={is:e} n={n} rs={rs:e})");
            format!("{name} {nodes} {}", model(models, text))
        }
        Part::Thyristor(t) => {
            let [vfwd, ron, roff] = t.lines;
            let text = format!(
                "scr(vgt={:e} vfwd={vfwd:e} ron={ron:e}{})",
                t.vgt,
                if roff.is_finite() {
                    ohms("roff", roff)
                } else {
                    String::new()
                }
            );
            let [anode, cathode, gate] = [0, 1, 2].map(|k| &card.nodes[k]);
            format!("{name} {anode} {gate} {cathode} {}", model(models, text))
        }
        Part::Core(core) => {
            let (i, flux) = (core.knee, core.knee * core.henries);
            let [i2, flux2] = [2.0 * i, flux + i * core.saturated];
            let points = [(-i2, -flux2), (-i, -flux), (i, flux), (i2, flux2)];
            let points = points.map(|(i, flux)| format!("{i:e},{flux:e}"));
            format!(
                "{name} {nodes} flux=pwl(x,{}) ic={:e}",
                points.join(","),
                core.ic
            )
        }
        Part::M(m) => {
            let kind = if m.p_channel { "pmos" } else { "nmos" };
            let mut text = format!("{kind}(vto={:e} ron={:e}", m.vto, m.ron);
            if m.roff.is_finite() {
                text += &ohms("rds", m.roff);
            }
            if m.rb > 0.0 {
                text += &ohms("rb", m.rb);
            }
            format!("{name} {nodes} {}", model(models, text + ")"))
        }
    }
}

fn wave_text(wave: &Wave) -> String {
    match wave {
        Wave::Dc(v) => format!("{v:e}"),
        Wave::Sin(offset, amplitude, f, phase) => {
            format!("sin({offset:e} {amplitude:e} {f:e} 0 0 {phase:e})")
        }
        Wave::Pulse {
            levels: [a, b],
            delay,
            rise,
            fall,
            width,
            period,
        } => format!("pulse({a:e} {b:e} {delay:e} {rise:e} {fall:e} {width:e} {period:e})"),
        Wave::Pwl(corners) => {
            let corners: Vec<String> = corners
                .iter()
                .map(|(t, v)| format!("{t:e} {v:e}"))
                .collect();
            format!("pwl({})", corners.join(" "))
        }
    }
}
