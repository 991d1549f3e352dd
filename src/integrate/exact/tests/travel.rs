//! Flows and spans by themselves.

use nalgebra::DMatrix;

use crate::integrate::exact::energy_integral::Term;
use crate::integrate::exact::exosystem::Exosystem;
use crate::integrate::exact::flow::Flow;
use crate::integrate::exact::magnitudes::Magnitudes;
use crate::integrate::exact::travel::Travel;

fn flow(rate: f64, h: f64) -> Flow {
    let generator = DMatrix::from_element(1, 1, rate);
    Flow::new(generator, 1, &[], &DMatrix::zeros(0, 1), h, &[]).expect("a flow")
}

#[test]
fn a_step_beyond_doubles_is_refused() {
    let (mut flow, mut next) = (flow(100.0, 1.0), vec![0.0; 8]);
    assert!(!flow.leap(0, &[1.0], &mut next));
    assert!(flow.leap(flow.bottom(), &[1.0], &mut next) && next[0] > 1.0);
}

/// 1 W for 1 s and 2⁻³⁰ s, which is as good as the second that recurs, at a time that is no better known: 2²⁰ s.
#[test]
fn the_energy_of_a_span_is_that_of_its_own_length() {
    let mut flow = flow(0.0, 0.7);
    flow.set_work(vec![Term {
        v: vec![(0, 1.0)],
        i: vec![(0, 1.0)],
        source: false,
    }]);
    let (begin, more) = (f64::from(1 << 20), 0.5_f64.powi(30));
    let (mut travel, mut magnitudes) = (Travel::at(begin), Magnitudes::default());
    magnitudes.take(&flow, &[1.0], |_| ());
    travel.enter(&flow, begin, &[1.0], &magnitudes);
    let met = (0..100).find_map(|_| travel.leap_span(&mut flow, begin + 1.0));
    met.expect("a span that recurs");
    let leap = travel.leap_span(&mut flow, begin + 1.0 + more);
    travel.take_span(
        &mut flow,
        &Exosystem::default(),
        leap.expect("the same span"),
    );
    let [_, dissipated] = travel.take_energy(&mut flow);
    assert!((dissipated - 1.0 - more).abs() < 1e-15, "{dissipated}");
}
