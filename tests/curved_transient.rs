//! Random transients of R, L, C and exponential diodes: never refused, whatever the step, and as an integrator says that shares nothing with the
//! library: extrapolated implicit Euler steps of nodal equations.
#![allow(missing_docs, reason = "tests")]

use circ::circuit::{ElaborateOptions, elaborate};
use circ::diagnostic::SourceMap;
use circ::integrate::{Error, Method, Reason, Run, SimOptions, simulate};
use circ::mna::behaviour;
use circ::netlist::parse;
use circ::settings::Settings;
use nalgebra::{DMatrix, DVector};
use proptest::prelude::*;

/// k T/q at 27 °C, V.
const THERMAL: f64 = 1.380_649e-23 / 1.602_176_634e-19 * 300.15;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Resistor(f64),
    Capacitor(f64),
    Inductor(f64),
    /// IS, N, RS.
    Diode(f64, f64, f64),
}

/// Elements between nodes, node 0 ground, node 1 at the source amplitude · sin(2π t) (in periods of one second, scaled in the netlist).
#[derive(Debug, Clone)]
struct Network {
    nodes: usize,
    elements: Vec<(Kind, usize, usize)>,
    amplitude: f64,
    offset: f64,
    /// s.
    period: f64,
}

impl Network {
    fn source(&self, t: f64) -> f64 {
        self.offset + self.amplitude * (std::f64::consts::TAU * t / self.period).sin()
    }

    fn text(&self, step: f64, stop: f64) -> String {
        let mut text = format!(
            "random\nv1 1 0 sin({} {} {})\n",
            self.offset,
            self.amplitude,
            1.0 / self.period
        );
        for (k, (kind, a, b)) in self.elements.iter().enumerate() {
            text += &match kind {
                Kind::Resistor(r) => format!("r{k} {a} {b} {r}\n"),
                Kind::Capacitor(c) => format!("c{k} {a} {b} {c}\n"),
                Kind::Inductor(l) => format!("l{k} {a} {b} {l}\n"),
                Kind::Diode(is, n, rs) => {
                    format!("d{k} {a} {b} m{k}\n.model m{k} d(is={is} n={n} rs={rs})\n")
                }
            };
        }
        text + &format!(".tran {step} {stop} uic\n.end\n")
    }
}

/// A source, a first element in series, a tree of more of them, and some across; every node has a resistor to ground.
fn network() -> impl Strategy<Value = Network> {
    let element = (
        0..8_u8,
        any::<usize>(),
        any::<usize>(),
        -1.5..1.0f64,
        (-15.0..-5.0f64, 1.0..2.0f64, prop::option::of(-3.0..1.0f64)),
    );
    (
        (3..6_usize, prop::collection::vec(element, 5..9)),
        (0.0..2.5f64, prop::option::of(-0.5..0.5f64)),
        -5.0..-2.0f64,
        0.0..3.0f64,
    )
        .prop_map(|((nodes, elements), (volts, offset), period, ohms)| {
            let (period, z) = (10_f64.powf(period), 10_f64.powf(ohms));
            let amplitude = 10_f64.powf(volts);
            let mut network = Network {
                nodes,
                elements: Vec::new(),
                amplitude,
                offset: offset.unwrap_or(0.0) * amplitude,
                period,
            };
            for (k, (kind, a, b, decades, diode)) in elements.into_iter().enumerate() {
                let size = 10_f64.powf(decades);
                // The first ones make a tree.
                let tree = k + 2 < nodes;
                let (a, b) = if tree {
                    (1 + a % (k + 1), k + 2)
                } else {
                    (a % nodes, b % nodes)
                };
                if a == b {
                    continue;
                }
                let kind = match kind {
                    0..=2 => Kind::Diode(
                        10_f64.powf(diode.0),
                        diode.1,
                        diode.2.map_or(0.0, |d| 10_f64.powf(d)),
                    ),
                    3 | 4 if tree => Kind::Inductor(z * period * size),
                    5 if !(a < 2 && b < 2) => Kind::Capacitor(period / z * size),
                    _ => Kind::Resistor(z * size),
                };
                // A diode straight across the source carries what it likes; one more node keeps it ordinary.
                if matches!(kind, Kind::Diode(..)) && a < 2 && b < 2 {
                    continue;
                }
                network.elements.push((kind, a, b));
            }
            for node in 2..nodes {
                network.elements.push((Kind::Resistor(z * 100.0), node, 0));
            }
            network
                .elements
                .push((Kind::Capacitor(period / z), nodes - 1, 0));
            network
        })
}

/// E z' + G z + i(z) = b(t) in node voltages, inductor currents and the source's current.
struct Nodal {
    e: DMatrix<f64>,
    g: DMatrix<f64>,
    /// IS, N k T/q, and the two nodes of the junction.
    diodes: Vec<(f64, f64, usize, usize)>,
    source: usize,
}

impl Nodal {
    fn of(network: &Network) -> Self {
        // Node 0 has the last place, which is removed at the end.
        let inner = network
            .elements
            .iter()
            .filter(|(kind, ..)| matches!(kind, Kind::Diode(.., rs) if *rs > 0.0))
            .count();
        let chokes = network
            .elements
            .iter()
            .filter(|(kind, ..)| matches!(kind, Kind::Inductor(_)))
            .count();
        let nodes = network.nodes - 1 + inner;
        let size = nodes + chokes + 1;
        let place = |node: usize| if node == 0 { size } else { node - 1 };
        let (mut e, mut g) = (
            DMatrix::zeros(size + 1, size + 1),
            DMatrix::zeros(size + 1, size + 1),
        );
        let stamp = |m: &mut DMatrix<f64>, a: usize, b: usize, value: f64| {
            m[(a, a)] += value;
            m[(b, b)] += value;
            m[(a, b)] -= value;
            m[(b, a)] -= value;
        };
        let (mut next_node, mut next_choke) = (network.nodes - 1, nodes);
        let mut diodes = Vec::new();
        for &(kind, a, b) in &network.elements {
            let (a, b) = (place(a), place(b));
            match kind {
                Kind::Resistor(r) => stamp(&mut g, a, b, 1.0 / r),
                Kind::Capacitor(c) => stamp(&mut e, a, b, c),
                Kind::Inductor(l) => {
                    let i = next_choke;
                    next_choke += 1;
                    e[(i, i)] = l;
                    g[(i, a)] -= 1.0;
                    g[(i, b)] += 1.0;
                    g[(a, i)] += 1.0;
                    g[(b, i)] -= 1.0;
                }
                Kind::Diode(is, n, rs) => {
                    let mut anode = a;
                    if rs > 0.0 {
                        anode = next_node;
                        next_node += 1;
                        stamp(&mut g, a, anode, 1.0 / rs);
                    }
                    diodes.push((is, n * THERMAL, anode, b));
                }
            }
        }
        let source = size - 1;
        g[(0, source)] = 1.0;
        g[(source, 0)] = 1.0;
        Self {
            e,
            g,
            diodes,
            source,
        }
    }

    fn size(&self) -> usize {
        self.source + 1
    }

    /// z after one implicit Euler step to a source voltage, from z; None where Newton's method does not end.
    fn euler(&self, z: &DVector<f64>, h: f64, source: f64) -> Option<DVector<f64>> {
        let size = self.size();
        let full = |z: &DVector<f64>| z.clone().resize_vertically(size + 1, 0.0);
        let linear = &self.e / h + &self.g;
        let mut right = &self.e * full(z) / h;
        right[self.source] += source;
        let across = |z: &DVector<f64>, a: usize, b: usize| z[a] - z[b];
        let mut now = full(z);
        let mut junctions: Vec<f64> = self
            .diodes
            .iter()
            .map(|&(is, slope, a, b)| across(&now, a, b).min(slope * (1.0 / is).ln()))
            .collect();
        for _ in 0..500 {
            let (mut matrix, mut b) = (linear.clone(), right.clone());
            for (&v, &(is, slope, p, n)) in junctions.iter().zip(&self.diodes) {
                let g = is / slope * (v / slope).exp();
                let rest = is * (v / slope).exp_m1() - g * v;
                matrix[(p, p)] += g;
                matrix[(n, n)] += g;
                matrix[(p, n)] -= g;
                matrix[(n, p)] -= g;
                b[p] -= rest;
                b[n] += rest;
            }
            let solved = matrix
                .view((0, 0), (size, size))
                .into_owned()
                .lu()
                .solve(&b.rows(0, size).into_owned())?;
            let next = full(&solved);
            // Newton's method squares the last change.
            let mut settled = (&next - &now).amax() <= 1e-6 * (1e-6 + next.amax());
            for (v, &(is, slope, p, n)) in junctions.iter_mut().zip(&self.diodes) {
                let wanted = across(&next, p, n);
                // Nagel's limit of what a junction may rise in one iteration.
                let critical = slope * (slope / (is * 2.0_f64.sqrt())).ln();
                let allowed = if wanted > critical && wanted - *v > 2.0 * slope {
                    if *v > 0.0 {
                        *v + slope * (1.0 + (wanted - *v) / slope).ln()
                    } else {
                        slope * (wanted / slope).ln()
                    }
                } else {
                    wanted
                };
                settled &= (allowed - wanted).abs() <= 1e-6 * slope
                    && (allowed - *v).abs() <= 1e-4 * slope;
                *v = allowed;
            }
            now = next;
            if settled {
                return Some(solved);
            }
        }
        None
    }

    /// z at these times from z = 0, with an error of about `tolerance` of the largest of each z.
    fn run(&self, network: &Network, times: &[f64], tolerance: f64) -> Option<Vec<DVector<f64>>> {
        let size = self.size();
        let (mut t, mut z) = (0.0, DVector::zeros(size));
        let mut rows = Vec::new();
        let mut largest = DVector::from_element(size, 0.0);
        let mut h = times[times.len() - 1] * 1e-6;
        for &stop in times {
            while t < stop {
                let step = h.min(stop - t);
                // Aitken and Neville's scheme on 1, 2, 3, 4 steps.
                let mut table: Vec<DVector<f64>> = Vec::new();
                for n in 1..=4_usize {
                    let part = step / n as f64;
                    let mut at = z.clone();
                    for k in 1..=n {
                        at = self.euler(&at, part, network.source(t + part * k as f64))?;
                    }
                    let mut row = vec![at];
                    for j in 1..n {
                        let ratio = n as f64 / (n - j) as f64;
                        let next = &row[j - 1] + (&row[j - 1] - &table[j - 1]) / (ratio - 1.0);
                        row.push(next);
                    }
                    // Only the last row is needed.
                    table = row;
                }
                let (best, second) = (&table[3], &table[2]);
                let sizes = largest.zip_map(best, |a: f64, b| a.max(b.abs()));
                // What is stored decides.
                let of_storage = |k: usize| self.e.row(k).amax() > 0.0;
                let error = (0..size)
                    .filter(|&k| of_storage(k))
                    .map(|k| (best[k] - second[k]).abs() / (sizes[k] + 1e-12))
                    .fold(0.0, f64::max);
                if error <= tolerance || step < 1e-12 * times[times.len() - 1] {
                    t = if step == stop - t { stop } else { t + step };
                    z.copy_from(best);
                    largest = sizes;
                }
                h = step * (0.8 * (tolerance / error.max(1e-30)).powf(0.25)).clamp(0.2, 3.0);
            }
            rows.push(z.clone());
        }
        Some(rows)
    }
}

fn run(text: &str, options: SimOptions<'_>) -> Result<Run, Error> {
    let mut sources = SourceMap::default();
    let root = sources.add("test.cir", text);
    let (netlist, _) = parse(&mut sources, root, &|_| {
        Err(std::io::ErrorKind::NotFound.into())
    });
    let (circuit, findings) = elaborate(&netlist, &ElaborateOptions::default());
    let circuit = circuit.unwrap_or_else(|| panic!("{findings:?}\n{text}"));
    simulate(&circuit, &behaviour(&circuit).unwrap(), options)
}

/// Whether a run was refused as currents leave nothing of the voltages between them.
fn drowned(found: &Result<Run, Error>) -> bool {
    matches!(found, Err(error) if matches!(error.reason, Reason::Cancellation { .. }))
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 8, max_shrink_iters: 20, failure_persistence: None, ..Default::default() })]

    #[test]
    fn transients_are_those_of_another_integrator(network in network()) {
        const ROWS: usize = 50;
        let stop = 1.5 * network.period;
        let step = stop / ROWS as f64;
        let text = network.text(step, stop);

        let settings = Settings { tol: 1e-6, ..Settings::default() };
        let found = run(&text, SimOptions { method: Method::Theta, settings, ..SimOptions::default() });
        if drowned(&found) {
            return Ok(());
        }
        let found = found.map_err(|e| TestCaseError::fail(format!("{e}\n{text}")))?;

        let times: Vec<f64> = found.waveforms.time[1..].to_vec();
        let oracle = Nodal::of(&network);

        let Some(expected) = oracle.run(&network, &times, 1e-7) else {
            return Err(TestCaseError::fail(format!("the oracle fails\n{text}")));
        };

        for node in 2..network.nodes {
            let Some(column) = found.waveforms.find(&format!("v({node})")) else { continue };
            let values: Vec<f64> = found.waveforms.column(column).collect();
            let error = (0..times.len()).map(|k| (values[k + 1] - expected[k][node - 1]).abs()).fold(0.0, f64::max);
            let size = network.amplitude + network.offset.abs();
            prop_assert!(error < 1e-4 * size, "v({node}) is off by {error} V of {size} V\n{text}");
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..Default::default() })]

    #[test]
    fn no_step_is_refused(network in network(), decades in -9.0..-1.0f64, euler in any::<bool>()) {
        let step = network.period * 10_f64.powf(decades);
        let text = network.text(10.0 * step, 30.0 * step);
        let method = if euler { Method::Euler } else { Method::Theta };
        let found = run(&text, SimOptions { method, step: Some(step), ..SimOptions::default() });
        prop_assert!(found.is_ok() || drowned(&found), "{}\n{text}", found.unwrap_err());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 24, failure_persistence: None, ..Default::default() })]

    /// Dense output: of forty rows in place of one those in common are the same but for the errors of both runs, 1e-4 each of what a column reaches.
    #[test]
    fn rows_are_what_they_are_among_fewer(network in network()) {
        const ROWS: usize = 50;
        const MORE: usize = 40;
        prop_assume!(network.elements.iter().any(|(kind, ..)| matches!(kind, Kind::Diode(..))));
        let stop = 1.5 * network.period;
        let of = |rows: usize| run(&network.text(stop / rows as f64, stop), SimOptions { method: Method::Theta, unestimated: true, ..SimOptions::default() });
        let (Ok(few), Ok(many)) = (of(ROWS), of(ROWS * MORE)) else {
            return Ok(());
        };
        for (column, name) in few.waveforms.names.iter().enumerate() {
            let [one, other]: [Vec<f64>; 2] = [&few, &many].map(|run| run.waveforms.column(column).collect());
            let size = other.iter().fold(0.0_f64, |m, v| m.max(v.abs()));
            // At once after the start a current that charges a capacitor through a diode alone has no value.
            let both = one.iter().zip(other.iter().step_by(MORE)).skip(1);
            let off = both.map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            prop_assert!(off <= 2e-4 * size, "{name} is off by {off} of {size}\n{}", network.text(stop / ROWS as f64, stop));
        }
    }
}

/// By their laws two diodes without a resistance carry 10⁷⁰ A at these voltages, beside which the charge between them is rounding. Prescribed
/// steps and chosen ones say so, also where no runs are made beside them; with a resistance of 1 mΩ they run.
#[test]
fn currents_that_drown_the_charge_between_them_are_refused() {
    let text = |rs: &str| {
        format!(
            "drowned\nv1 1 0 sin(0 16.6 8.9k)\nd0 1 2 ma\nd2 2 0 mb\nc3 1 2 12.6n\nr4 2 0 43k\n\
             .model ma d(is=5.3u n=1.78{rs})\n.model mb d(is=5.4p n=1.18{rs})\n.tran 3.4u 170u uic\n.end\n"
        )
    };
    for step in [Some(1e-6), None] {
        let options = || SimOptions {
            method: Method::Theta,
            step,
            unestimated: true,
            ..SimOptions::default()
        };
        let error = run(&text(""), options()).unwrap_err();
        assert!(
            matches!(error.reason, Reason::Cancellation { .. }),
            "{step:?}: {error}"
        );
        assert_eq!(error.elements, ["d0", "d2"], "{step:?}");
        assert!(run(&text(" rs=1m"), options()).is_ok(), "{step:?}");
    }
}
