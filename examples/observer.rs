//! A custom observer of the output: the RMS of a current over a hundred thousand rows, none of which is kept.
#![allow(clippy::print_stdout, reason = "an example prints")]

use std::ops::ControlFlow;

use circ::integrate::Block;
use circ::{Model, SimOptions};

const DIMMER: &str = "half a wave
v1 in 0 sin(0 1 50)
d1 in out d
r1 out 0 1
.model d d(ideal)
.save i(r1)
.tran 10u 1
.end
";

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let (mut sum, mut count) = (0.0, 0_u64);
    let mut observe = |rows: Block<'_>| {
        for (_, values, _) in rows.rows() {
            sum += values[0] * values[0];
            count += 1;
        }
        // `Break` would end the run.
        ControlFlow::Continue(())
    };
    let run = Model::parse(DIMMER, "dimmer.cir")?.transient(SimOptions {
        rows: Some(&mut observe),
        discard: true,
        ..SimOptions::default()
    })?;
    let rms = (sum / count as f64).sqrt();
    println!(
        "{rms:.6} A over {count} rows, {} of them kept",
        run.waveforms.time.len()
    );
    assert!((rms - 0.5).abs() < 1e-5 && run.waveforms.time.is_empty());
    Ok(())
}
