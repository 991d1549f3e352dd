//! Whether an operating point stands on the laws of its devices.

use crate::integrate::Note;
use crate::lcs::{Port, Role};
use crate::settings::tolerances::complementarity::{BARELY, ON_LAWS};

/// What is to be told of an operating point with these voltages of `nodes` whose ports, at (v, i), have voltages that the currents through them leave no digits of: two junctions without a resistance
/// across a source carry what their laws say, 10¹¹ A and more, and their voltages are what rounding makes of products with those.
///
/// The voltage of a port in which the current is sought is off by |v − v′|, where (v′, i′) is the point of its law with v′ + ρ i′ = v + ρ i and ρ is the
/// ratio of the largest voltage to the largest current of all ports. What leaks through a port that blocks is known to few digits without harm.
pub(super) fn off_laws(ports: &[Port], points: &[(f64, f64)], nodes: &[f64]) -> Option<Note> {
    let largest = |of: fn(&(f64, f64)) -> f64| points.iter().map(of).fold(0.0, f64::max);
    let (volts, amperes) = (largest(|p| p.0.abs()), largest(|p| p.1.abs()));
    if !(volts > 0.0 && amperes > 0.0) {
        return None;
    }
    let rho = volts / amperes;
    let off = |(port, &(v, i)): (&Port, &(f64, f64))| {
        let of_law = port.law.resolvent(rho, v + rho * i).v;
        (port.role == Role::Current).then(|| (v - of_law).abs())
    };
    let all = ports.iter().zip(points);
    let offs = all.filter_map(|both| Some((off(both)?, both.0)));
    let (off, port) = offs.max_by(|a, b| a.0.total_cmp(&b.0))?;
    let of_nodes = nodes.iter().fold(volts, |m, v| m.max(v.abs()));
    (off > BARELY * ON_LAWS * of_nodes).then(|| {
        let text = format!(
            "at its operating point the law of {} holds to {off:.1e} V only, as currents of {amperes:.0e} A are subtracted from each other: voltages may be off by as much",
            port.device
        );
        Note::of("cancellation", [&port.device], text)
    })
}
