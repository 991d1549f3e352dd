//! A sweep: the ripple of a buck converter over its inductance, from one parsed netlist.
#![allow(clippy::print_stdout, reason = "an example prints")]

use circ::{Model, SimOptions};

const BUCK: &str = "buck
vin in 0 24
s1 in sw g 0 sw
d1 0 sw d
l1 sw out 47u
c1 out 0 220u
r1 out 0 3
vg g 0 pulse(0 1 0 0 0 4u 10u)
.model sw sw(vt=0.5 vh=0 ron=5m roff=1meg)
.model d d(ideal)
.save i(l1)
.tran 0.1u 6m 5.98m
.end
";

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut model = Model::parse(BUCK, "buck.cir")?;
    let mut before = f64::INFINITY;
    for henries in [22e-6, 33e-6, 47e-6, 68e-6, 100e-6] {
        model.set("l1", henries)?;
        let run = model.transient(SimOptions::default())?;
        let (least, most) = run
            .waveforms
            .column(0)
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), i| {
                (a.min(i), b.max(i))
            });
        println!("{:5.0} µH: {:.3} A", henries * 1e6, most - least);
        assert!(most - least < before);
        before = most - least;
    }
    Ok(())
}
