//! A controller in the loop: a sampled PI controller sets the duty cycle of a buck converter, whose load doubles on the way.
#![allow(clippy::print_stdout, reason = "an example prints")]

use circ::{Model, SimulationOptions};

const BUCK: &str = "buck with a digital controller
vin in 0 24
s1 in sw g 0 sw
d1 0 sw d
l1 sw out 47u
c1 out 0 220u
r1 out 0 6
s2 out x load 0 sw
r2 x 0 6
* On while the duty cycle, which the controller sets, is above the carrier.
vd duty 0 0
vc carrier 0 pulse(0 1 0 10u 0 0 10u)
bg g 0 v=v(duty)-v(carrier)+0.5
vl load 0 pulse(0 1 5m 0 0 1 2)
.model sw sw(vt=0.5 vh=0 ron=5m roff=1meg)
.model d d(ideal)
.tran 1u 10m uic
.end
";

/// V, 1/V, 1/(V·s), s.
const TARGET: f64 = 12.0;
const PROPORTIONAL: f64 = 0.005;
const INTEGRAL: f64 = 30.0;
const SAMPLE: f64 = 10e-6;

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let model = Model::parse(BUCK, "buck.cir")?;
    let mut simulation = model.simulation(SimulationOptions::default())?;
    let mut integral = 0.0;
    for k in 1..=1000 {
        simulation.advance_to(f64::from(k) * SAMPLE)?;
        let error = TARGET - simulation.value("v(out)")?;
        integral = (integral + INTEGRAL * SAMPLE * error).clamp(0.0, 1.0);
        simulation.set_source("vd", (PROPORTIONAL * error + integral).clamp(0.0, 0.95))?;
        if k % 100 == 0 {
            println!(
                "{:4.1} ms: {:.4} V",
                f64::from(k) * SAMPLE * 1e3,
                TARGET - error
            );
        }
    }
    let out = simulation.value("v(out)")?;
    assert!((out - TARGET).abs() < 0.1, "{out}");
    Ok(())
}
