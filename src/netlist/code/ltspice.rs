//! LTspice's special functions: gates, Schmitt triggers and flip-flops of eight terminals.
//!
//! Terminals 1 to 5 are inputs, 6 the inverted output, 7 the output, 8 the common; what is connected to the common is not used. An
//! input is true above `Ref` (half of Vhigh + Vlow). Each output is Vhigh or Vlow behind `Rout`. Inside, a true input is 1 A through a
//! switch of 1 Ω at 1 V, so that counts and states are currents of sources.

use std::fmt::Write;

use super::{Built, Refused, refused};
use crate::netlist::ast::{Assign, Element, Name, PinGroup};

/// What is simulated.
pub(super) const KNOWN: [&str; 7] = ["buf", "and", "or", "xor", "schmitt", "srflop", "dflop"];
/// Symbols of LTspice's that are a device of another name: terminals tell which outputs and how many inputs they have.
const SAME: [(&str, &str); 5] = [
    ("schmtbuf", "schmitt"),
    ("schmtinv", "schmitt"),
    ("diffschmitt", "schmitt"),
    ("diffschmtbuf", "schmitt"),
    ("diffschmtinv", "schmitt"),
];
/// What is known by name and refused.
const REFUSED: [(&str, &str); 8] = [
    ("inv", "write BUF: terminal 6 is its inverted output"),
    (
        "samplehold",
        "write it with a switch, a capacitor and E sources",
    ),
    (
        "counter",
        "write it with DFLOP, the inverted output to its input",
    ),
    ("phasedet", "write it with DFLOP and AND"),
    ("modulate", "frequency modulation is not piecewise linear"),
    ("modulator", "frequency modulation is not piecewise linear"),
    ("varistor", "write it as a resistor with a breakdown diode"),
    ("ota", "write it as a G source"),
];

/// Parameters with their defaults; `ref` where Vt and Vh do not take its place.
const OUTPUT: &str = "vhigh=1 vlow=0 rout=1";
/// Parameters that change when something happens, which is at once here.
const LEFT_OUT: [&str; 5] = ["td", "trise", "tfall", "tau", "cout"];
/// Hints to the time step of LTspice.
const HINTS: [&str; 2] = ["tripdt", "tripdv"];

pub(super) fn is_known(name: &str) -> bool {
    KNOWN.contains(&device(name)) || REFUSED.iter().any(|(refused, _)| *refused == name)
}

/// The device that a name means.
fn device(name: &str) -> &str {
    let same = SAME.iter().find(|(own, _)| *own == name);
    same.map_or(name, |(_, device)| device)
}

/// The subcircuit of a card.
pub(super) fn build(
    card: &Element,
    ports: &[PinGroup],
    function: &Name,
    args: &[Assign],
) -> Result<Built, Refused> {
    let name = &card.name.text;
    let kind = device(&function.text);
    if let Some((_, instead)) = REFUSED.iter().find(|(refused, _)| *refused == kind) {
        let message = format!("`{name}` is a {kind}, which is not simulated");
        let fault = refused(function, message, "not supported");
        return Err(Box::new(fault.help(*instead)));
    }
    let plain = ports.iter().all(|p| p.sort.is_none() && !p.vector);
    let nodes: Vec<&Name> = ports
        .iter()
        .filter_map(|p| p.elements.first()?.first())
        .collect();
    let &[.., common] = nodes.as_slice() else {
        return Err(refused(
            function,
            format!("`{name}` has no nodes"),
            "eight are needed",
        ));
    };
    if nodes.len() != 8 || !plain {
        let message = format!("`{name}` has {} nodes, a {kind} has 8", nodes.len());
        let fault = refused(function, message, "wrong number of nodes");
        return Err(Box::new(fault.help(
            "five inputs, the inverted output, the output, the common; the common stands where nothing is connected",
        )));
    }
    let ground = |n: &str| {
        if n == "gnd" {
            "0".to_owned()
        } else {
            n.to_owned()
        }
    };
    let is_used = |n: &Name| ground(&n.text) != ground(&common.text);
    let used: Vec<bool> = nodes.iter().map(|n| is_used(n)).collect();
    let wrong = |what: &str| {
        let message = format!("`{name}` is a {kind} {what}");
        Err(refused(function, message, "not simulated"))
    };
    let inputs: Vec<usize> = (0..5).filter(|k| used[*k]).collect();
    let allowed: &[usize] = match kind {
        "schmitt" | "srflop" => &[0, 1],
        "dflop" => &[0, 2, 3, 4],
        _ => &[0, 1, 2, 3, 4],
    };
    if inputs.is_empty() {
        return wrong("without an input");
    } else if inputs.iter().any(|k| !allowed.contains(k)) {
        return wrong("with an input at a terminal that it does not have");
    } else if kind == "buf" && inputs.len() > 1 {
        return wrong("with more than one input");
    } else if kind == "dflop" && !used[2] {
        return wrong("without a clock at terminal 3");
    }
    let (own, left_out) = parameters(card, kind, args)?;
    let logic = match kind {
        "schmitt" => schmitt(&used),
        "srflop" => set_and_reset(&used),
        "dflop" => flip_flop(&used),
        _ => gate(kind, &inputs),
    };
    let mut cards = logic;
    for (k, output) in [
        (5, "vhigh-(vhigh-vlow)*i(vq)"),
        (6, "vlow+(vhigh-vlow)*i(vq)"),
    ] {
        if used[k] {
            let pin = k + 1;
            _ = write!(
                cards,
                "b{pin} o{pin} com V={output}\nr{pin} o{pin} p{pin} {{rout}}\n"
            );
        }
    }
    let pins = (0..7)
        .filter(|k| used[*k])
        .map(|k| (format!("p{}", k + 1), nodes[k].clone()));
    let pins = pins.chain([("com".to_owned(), common.clone())]).collect();
    let levels = if kind == "schmitt" {
        "vh=0"
    } else {
        "ref={0.5*(vhigh+vlow)}"
    };
    Ok(Built {
        title: kind.to_uppercase(),
        cards,
        pins,
        defaults: format!("{OUTPUT} {levels}"),
        args: own,
        left_out,
    })
}

/// The parameters that count, and those that have no effect.
fn parameters(
    card: &Element,
    kind: &str,
    args: &[Assign],
) -> Result<(Vec<Assign>, Vec<Name>), Refused> {
    let levels: &[&str] = if kind == "schmitt" {
        &["vt", "vh"]
    } else {
        &["ref"]
    };
    let (mut own, mut left_out) = (Vec::new(), Vec::new());
    for arg in args {
        let text = arg.name.text.as_str();
        if ["vhigh", "vlow", "rout"].contains(&text) || levels.contains(&text) {
            own.push(arg.clone());
        } else if LEFT_OUT.contains(&text) {
            left_out.push(arg.name.clone());
        } else if !HINTS.contains(&text) {
            let message = format!("`{text}` of `{}` is not simulated", card.name.text);
            return Err(refused(&arg.name, message, "not supported"));
        }
    }
    if kind == "schmitt" && !own.iter().any(|a| a.name.text == "vt") {
        let message = format!("`{}` names no Vt", card.name.text);
        let fault = refused(&card.name, message, "without a level");
        return Err(Box::new(
            fault.help("write `Vt=level Vh=half of the hysteresis`"),
        ));
    }
    Ok((own, left_out))
}

/// The state or result is the current of `vq`, 0 or 1 A.
const RESULT: &str = "vq 0 q -1\n";
/// A switch that is on while an input is true.
const TRUE: &str = ".model true SW(Ron=1 Roff=inf Vt={ref})\n";
/// A switch that keeps its state while its current is 0.
const KEEP: &str = ".model keep CSW(Ron=1 Roff=inf It=0 Ih=0.5)\n";

/// So many inputs are true: all, one at least, exactly one.
fn gate(kind: &str, inputs: &[usize]) -> String {
    let mut cards = format!("vcount 0 src -1\nvless one src 0\n{RESULT}{TRUE}");
    for k in inputs {
        _ = writeln!(cards, "s{0} one 0 p{0} com true", k + 1);
    }
    let least = match kind {
        "and" => inputs.len() as f64 - 0.5,
        _ => 0.5,
    };
    cards.push_str(&match kind {
        "xor" => "w1 q mid vcount some\nw2 mid 0 vless few\n\
                  .model some CSW(Ron=0.5 Roff=inf It=0.5)\n.model few CSW(Ron=0.5 Roff=inf It=-1.5)\n"
            .to_owned(),
        _ => format!("w1 q 0 vcount enough\n.model enough CSW(Ron=1 Roff=inf It={least})\n"),
    });
    cards
}

fn schmitt(used: &[bool]) -> String {
    let plus = if used[0] { "p1" } else { "com" };
    let minus = if used[1] { "p2" } else { "com" };
    format!(
        "{RESULT}s1 q 0 {plus} {minus} trip\n.model trip SW(Ron=1 Roff=inf Vt={{vt}} Vh={{vh}})\n"
    )
}

/// On while set alone, off while reset, else as before.
fn set_and_reset(used: &[bool]) -> String {
    let mut cards =
        format!("vone one 0 1\nvtwo two 0 -2\nvm m 0 0\n{RESULT}{TRUE}{KEEP}wq q 0 vm keep\n");
    for (k, from) in [(0, "one"), (1, "two")] {
        if used[k] {
            _ = writeln!(cards, "s{0} {from} m p{0} com true", k + 1);
        }
    }
    cards
}

/// A master that follows D while the clock is false, and a slave that follows the master while it is true; preset and clear set both.
fn flip_flop(used: &[bool]) -> String {
    let mut cards = format!(
        "vd 0 d -1\nvc 0 c -1\nvm m 0 0\nvn n 0 0\n{RESULT}{TRUE}{KEEP}.model false SW(Ron=1 Roff=inf Vt={{-ref}})\n"
    );
    if used[0] {
        cards.push_str("sd d 0 p1 com true\n");
    }
    cards.push_str(
        "bd x 0 V=2*i(vd)-1\nsm x m com p3 false\nwm c 0 vm keep\n\
         bc y 0 V=2*i(vc)-1\nsn y n p3 com true\nwq q 0 vn keep\n",
    );
    for (k, volts) in [(3, 3), (4, -7)] {
        if used[k] {
            let pin = k + 1;
            _ = write!(
                cards,
                "v{pin} f{pin} 0 {volts}\nsm{pin} f{pin} m p{pin} com true\nsn{pin} f{pin} n p{pin} com true\n"
            );
        }
    }
    cards
}
