//! Random networks of R, L, C and diodes on a source, without a plan.

use crate::random::Random;

/// k T/q at 27 °C is 25.9 mV; a netlist with all node voltages and currents of inductors and diodes recorded.
pub(crate) fn network(random: &mut Random, curved: bool) -> String {
    let nodes = 3 + random.below(4);
    let z = random.value(1.0, 1e3);
    let period = random.value(1e-5, 1e-2);
    let volts = random.value(1.0, 300.0);
    let mut text = String::from("random network\n");
    text += &match random.below(3) {
        0 => format!(
            "v1 1 0 pulse(0 {volts} {:e} {:e} {:e} {:e} {period:e})\n",
            0.1 * period,
            0.01 * period,
            0.01 * period,
            random.pick(&[0.2, 0.37, 0.5]) * period
        ),
        1 => format!(
            "v1 1 0 pulse({:e} {volts} {:e} 0 0 {:e} {period:e})\n",
            -volts,
            0.13 * period,
            random.pick(&[0.2, 0.37, 0.5]) * period
        ),
        _ => format!("v1 1 0 sin(0 {volts} {:e})\n", 1.0 / period),
    };
    let mut saved: Vec<String> = (1..nodes).map(|k| format!("v({k})")).collect();
    let count = nodes + 2 + random.below(4);
    let mut name = |letter: char, k: usize| {
        let name = format!("{letter}{k}");
        if letter != 'r' && letter != 'c' {
            saved.push(format!("i({name})"));
        }
        name
    };
    for k in 0..count {
        // The first ones make a tree.
        let tree = k + 2 < nodes;
        let (a, b) = if tree {
            (1 + random.below(k + 1), k + 2)
        } else {
            (random.below(nodes), random.below(nodes))
        };
        let size = random.value(0.03, 10.0);
        if a == b || a < 2 && b < 2 {
            continue;
        }
        text += &match random.below(8) {
            0..=2 => {
                let (p, n) = if random.one_in(2) { (a, b) } else { (b, a) };
                format!("{} {p} {n} dm\n", name('d', k))
            }
            3 | 4 => format!("{} {a} {b} {:e}\n", name('l', k), z * period * size * 0.1),
            5 => format!("{} {a} {b} {:e}\n", name('c', k), period / z * size * 0.1),
            _ => format!("{} {a} {b} {:e}\n", name('r', k), z * size),
        };
    }
    for node in 2..nodes {
        text += &format!("rg{node} {node} 0 {:e}\n", z * random.value(3.0, 300.0));
    }
    text += &format!(
        "cl {} 0 {:e}\n",
        nodes - 1,
        period / z * random.value(0.01, 1.0)
    );
    text += &if curved {
        let is = random.pick(&[1e-14, 1e-12, 1e-9, 1e-6]);
        let rs = random.pick(&[0.0, 1e-3, 1e-2]) * z;
        format!(
            ".model dm d(is={is:e} n={} rs={rs:e})\n",
            random.pick(&[1.0, 1.05, 1.8])
        )
    } else {
        match random.below(3) {
            0 => ".model dm d(ideal)\n".to_string(),
            1 => format!(
                ".model dm d(ron={:e} roff={:e} vfwd=0.7)\n",
                z * 1e-3,
                z * 1e4
            ),
            _ => format!(".model dm d(ron={:e} vfwd=0.3)\n", z * 1e-2),
        }
    };
    let periods = random.pick(&[1.3, 2.0, 3.7]);
    let rows = random.pick(&[50.0, 130.0, 400.0, 1000.0]);
    let stop = periods * period;
    text + &format!(
        ".save {}\n.tran {:e} {stop:e} uic\n.end\n",
        saved.join(" "),
        stop / rows
    )
}
