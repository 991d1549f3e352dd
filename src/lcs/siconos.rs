//! A system as a Python script that Siconos runs: its Moreau–Jean time stepping, with the same matrices.
//!
//! Acary, Brogliato, *Numerical Methods for Nonsmooth Dynamical Systems* (2008), chapter 9: x' = A x + b + r, y = C x + D λ + e with 0 ≤ y ⟂ λ ≥ 0 and
//! r = B λ are Siconos's `FirstOrderLinearDS`, `FirstOrderLinearTIR` and `ComplementarityConditionNSL`.

use std::fmt::Write as _;

use nalgebra::{DMatrix, DVector};

use super::format::{Format, format};
use super::{Lcs, Rows};
use crate::circuit::Tran;
use crate::circuit::source::Wave;
use crate::law::Law;

/// Why Siconos's complementarity conditions do not hold a system.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
pub enum SiconosError {
    /// A law other than 0 ≤ λ ⟂ y ≥ 0.
    #[error(
        "the law of `{device}` is `{kind}`, not that of an ideal diode; `--diodes ideal` reads every diode as one"
    )]
    Law {
        /// The device of the port.
        device: String,
        /// The kind of its law.
        kind: &'static str,
    },
    /// A waveform without a counterpart in the script.
    #[error("the source `{0}` is none of a constant, SIN, PULSE and PWL")]
    Wave(String),
    /// There is no state, or no port.
    #[error("Siconos wants a state and a diode; this system has {states} states and {ports} ports")]
    Small {
        /// Their number.
        states: usize,
        /// Their number.
        ports: usize,
    },
    /// There is no time to end at.
    #[error("there is no `.tran`, which says how long to run")]
    NoEnd,
}

/// The script. It prints a line of the outputs for every step, `θ` = 1 (implicit Euler) unless it is changed.
///
/// # Errors
/// See [`SiconosError`].
pub fn siconos(lcs: &Lcs, x0: &DVector<f64>, tran: Option<Tran>) -> Result<String, SiconosError> {
    let tran = tran.ok_or(SiconosError::NoEnd)?;
    let (states, ports) = (lcs.n(), lcs.m());
    if states == 0 || ports == 0 {
        return Err(SiconosError::Small { states, ports });
    }
    if let Some(port) = lcs.ports.iter().find(|port| !is_complementarity(&port.law)) {
        return Err(SiconosError::Law {
            device: port.device.clone(),
            kind: port.law.kind(),
        });
    }
    let mut sources = String::new();
    for input in &lcs.inputs {
        let wave = wave(&input.source.wave, tran.tstop);
        let wave = wave.ok_or_else(|| SiconosError::Wave(input.name.clone()))?;
        let _ = writeln!(sources, "        {wave},  # {}", input.name);
    }
    let held = match lcs.held_switches() {
        held if held.is_empty() => held,
        held => format!("# Switches stay as they are: {held}\n"),
    };
    let step = tran.tmax.unwrap_or(tran.tstep);
    let Outputs {
        names,
        rows,
        left_out,
    } = outputs(lcs);
    Ok(format!(
        "{matrices}{held}{left_out}\
x0 = np.array({x0:?}, dtype=float)
step, end, theta = {step:?}, {end:?}, 1.0
outputs = {names:?}
{rows}

def sin(t, offset, amplitude, frequency, delay, damping, phase, cycles):
    since = t - delay
    if since < 0 or since * frequency > cycles:
        since = 0.0
    return offset + amplitude * math.exp(-damping * since) * math.sin(2 * math.pi * frequency * since + math.radians(phase))


def pulse(t, v1, v2, delay, rise, fall, width, period, count):
    if t < delay or (t - delay) / period >= count:
        return v1
    since = math.fmod(t - delay, period)
    if since < rise:
        return v1 + (v2 - v1) * since / rise
    if since < rise + width:
        return v2
    if since < rise + width + fall:
        return v2 + (v1 - v2) * (since - rise - width) / fall
    return v1


def pwl(t, *points):
    return float(np.interp(t, [p[0] for p in points], [p[1] for p in points]))


def u(t):
    return np.array([
{sources}    ], dtype=float)


def column(m):
    return m.reshape(-1)


system = kernel.FirstOrderLinearDS(x0, A, E @ u(0.0) + column(e))
relation = kernel.FirstOrderLinearTIR(C, B)
relation.setDPtr(D)
relation.setePtr(G @ u(0.0) + column(F))
interaction = kernel.Interaction(kernel.ComplementarityConditionNSL(len(y)), relation)
model = kernel.NonSmoothDynamicalSystem(0.0, end)
model.insertDynamicalSystem(system)
model.link(interaction, system)
integrator = kernel.EulerMoreauOSI(theta)
simulation = kernel.TimeStepping(model, kernel.TimeDiscretisation(0.0, step), integrator, kernel.LCP())
table = csv.writer(sys.stdout)
table.writerow([\"time\", *outputs])
while simulation.hasNextEvent():
    t = simulation.nextTime()
    # What happens at the end of a step has happened, whatever the rounding of the time.
    now = u(t * (1 + 2.0**-43))
    system.setbPtr(E @ now + column(e))
    relation.setePtr(G @ now + column(F))
    simulation.computeOneStep()
    row = outputs_x @ system.x() + outputs_lambda @ interaction.lambda_(0) + outputs_u @ now + outputs_one
    table.writerow([t, *row.tolist()])
    simulation.nextStep()
",
        matrices = format(lcs, Format::Numpy).replacen(
            "import numpy as np\n",
            "import csv\nimport math\nimport sys\n\nimport numpy as np\nfrom siconos import kernel\n\n",
            1
        ),
        x0 = x0.as_slice(),
        end = tran.tstop,
    ))
}

/// Whether it is 0 ≤ λ ⟂ y ≥ 0.
fn is_complementarity(law: &Law) -> bool {
    matches!(law, Law::Diode { vfwd, ron, roff: None } if vfwd.f64 == 0.0 && ron.f64 == 0.0)
}

/// A call in Python that gives the value at `t`; none where there is no such function.
fn wave(wave: &Wave, end: f64) -> Option<String> {
    let number = |x: f64| {
        if x.is_finite() {
            format!("{x:?}")
        } else {
            "math.inf".into()
        }
    };
    let call = |name: &str, values: &[f64]| {
        let values: Vec<String> = values.iter().map(|x| number(*x)).collect();
        Some(format!("{name}(t, {})", values.join(", ")))
    };
    match wave {
        Wave::Dc(value) => Some(number(*value)),
        &Wave::Sin {
            offset,
            amplitude,
            frequency,
            delay,
            damping,
            phase,
            cycles,
        } => {
            let cycles = cycles.unwrap_or(f64::INFINITY);
            let values = [offset, amplitude, frequency, delay, damping, phase, cycles];
            call("sin", &values)
        }
        &Wave::Pulse {
            v1,
            v2,
            delay,
            rise,
            fall,
            width,
            period,
            count,
        } => {
            let period = if period > 0.0 && period.is_finite() {
                period
            } else {
                delay.abs() + 2.0 * end
            };
            let width = width.min(period);
            let count = count.unwrap_or(f64::INFINITY);
            call("pulse", &[v1, v2, delay, rise, fall, width, period, count])
        }
        Wave::Pwl {
            points,
            repeat: None,
            delay,
        } => {
            let points = points
                .iter()
                .map(|(t, v)| format!("({:?}, {v:?})", t + delay));
            let points: Vec<String> = points.collect();
            Some(format!("pwl(t, {})", points.join(", ")))
        }
        _ => None,
    }
}

/// The rows of the outputs that Siconos knows all terms of.
struct Outputs {
    names: Vec<String>,
    rows: String,
    left_out: String,
}

fn outputs(lcs: &Lcs) -> Outputs {
    let (names, rows) = (&lcs.outputs.names, &lcs.outputs.rows);
    let known = |k: &usize| rows.du.row(*k).iter().all(|v| *v == 0.0);
    let (kept, others): (Vec<usize>, Vec<usize>) = (0..names.len()).partition(known);
    let left_out: Vec<&str> = others.iter().map(|&k| names[k].as_str()).collect();
    let left_out = match left_out.len() {
        0 => String::new(),
        _ => format!(
            "# Left out, as they depend on derivatives of sources: {}\n",
            left_out.join(", ")
        ),
    };
    let Rows {
        x, lambda, u, one, ..
    } = rows;
    let matrix = |m: &DMatrix<f64>| {
        let row = |k: &usize| m.row(*k).iter().map(|v| v + 0.0).collect::<Vec<_>>();
        let values: Vec<Vec<f64>> = kept.iter().map(row).collect();
        format!(
            "np.array({values:?}, dtype=float).reshape{:?}",
            (kept.len(), m.ncols())
        )
    };
    let constant: Vec<f64> = kept.iter().map(|k| one[*k] + 0.0).collect();
    Outputs {
        names: kept.iter().map(|k| names[*k].clone()).collect(),
        rows: format!(
            "outputs_x = {}\noutputs_lambda = {}\noutputs_u = {}\noutputs_one = np.array({constant:?}, dtype=float)\n",
            matrix(x),
            matrix(lambda),
            matrix(u),
        ),
        left_out,
    }
}
