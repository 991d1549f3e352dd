//! Netlist to matrices: the complementarity system of a rectifier.
#![allow(clippy::print_stdout, reason = "an example prints")]

use circ::Model;

const RECTIFIER: &str = "half-wave rectifier
v1 in 0 sin(0 10 50)
d1 in out dideal
c1 out 0 100u
r1 out 0 1k
.model dideal d(ideal)
.end
";

pub(crate) fn main() -> Result<(), Box<dyn std::error::Error>> {
    let system = Model::parse(RECTIFIER, "rectifier.cir")?.lcs()?;
    println!(
        "x = {:?}, λ and y of {}",
        system.states, system.ports[0].device
    );
    println!(
        "A ={}B ={}C ={}D ={}",
        system.a, system.b, system.c, system.d
    );
    // v(out)' = −v(out)/RC + i(d1)/C, and y = −v(d1) = v(out) − v(in).
    assert!((system.a[(0, 0)] + 10.0).abs() < 1e-12 && (system.b[(0, 0)] - 1e4).abs() < 1e-8);
    assert_eq!(
        (system.c[(0, 0)], system.d[(0, 0)], system.g[(0, 0)]),
        (1.0, 0.0, -1.0)
    );
    Ok(())
}
