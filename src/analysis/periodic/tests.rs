//! The derivative of the flow over a period by its variational equation, and by differences.

use std::path::Path;

use super::search::Search;
use super::shooting::Return;
use super::{PeriodicOptions, period, simulation};
use crate::circuit::ElaborateOptions;
use crate::mna::behaviour;
use crate::model::Model;

/// Converters and rectifiers: clocks, diodes that end by themselves, jumps, state-controlled switches, thyristors, coupled inductors.
const CIRCUITS: [&str; 20] = [
    "netlists/buck-open-loop.cir",
    "netlists/flyback.cir",
    "netlists/buck.cir",
    "netlists/cockcroft-walton.cir",
    "netlists/capacitor-loop.cir",
    "netlists/clamp.cir",
    "netlists/isolated-rectifier.cir",
    "netlists/isolated-rectifier-ideal.cir",
    "netlists/maffezzoni.cir",
    "netlists/maffezzoni-ideal.cir",
    "netlists/rectifier.cir",
    "netlists/rlc.cir",
    "netlists/scr-bridge.cir",
    "netlists/three-phase-rectifier.cir",
    "netlists/triac-dimmer.cir",
    "netlists/voltage-doubler.cir",
    "netlists/parallel-inverters.cir",
    "netlists/inductor-cut-set.cir",
    "tests/findings/multiphase_buck_8.cir",
    "tests/findings/six_pulse_large_roff.cir",
];

#[test]
fn the_variational_equation_agrees_with_differences() {
    for name in CIRCUITS {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(name);
        let model = Model::load(path, ElaborateOptions::default()).expect("a circuit");
        let options = PeriodicOptions::default();
        let (circuit, _) = period::repeating(model.circuit());
        let period = period::common(&circuit).expect("a period");
        let multiport = behaviour(&circuit).expect("a multiport");
        let seconds = period.seconds.expect("a driven circuit");
        let parts = (&circuit, &multiport);
        let mut simulation =
            simulation(parts, period.seconds, 1.0, &options).expect("a simulation");
        let mut search = Search::of(&mut simulation, &options);
        let found = search.driven(seconds, period.from).expect("an orbit");
        let mut shooting = search.shooting(found.from, Return::After(seconds));
        shooting.amplitudes.clone_from(&found.amplitudes);
        let stand = &found.fixed.stand;
        let closing = shooting.close(stand).expect("a period");
        let by_equation = shooting.variation(stand, &closing);
        let by_equation = by_equation.unwrap_or_else(|error| panic!("{name}: {error}"));
        let by_equation = by_equation.expect("a derivative");
        let by_differences = shooting
            .differences(stand, &closing.after)
            .expect("differences");
        let apart = (&by_equation - &by_differences).amax();
        assert!(
            apart < 1e-5,
            "{name}: {apart:e}, {by_equation}{by_differences}"
        );
    }
}
