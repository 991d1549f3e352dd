//! Values on both sides of every corner.

use super::*;

/// f just left and just right of u, from the pieces.
fn both(f: &Piecewise, u: f64) -> (f64, f64) {
    let left = f.knots.partition_point(|&x| x < u);
    let right = f.knots.partition_point(|&x| x <= u);
    (f.at(left, u), f.at(right, u))
}

fn value(f: &Piecewise, u: f64) -> f64 {
    both(f, u).1
}

#[test]
fn composition_is_pointwise() {
    let tent = Piecewise::through(&[(-1.0, 0.0), (0.0, 2.0), (1.0, 0.0)], 0.0, -3.0);
    let outer = Piecewise::through(&[(0.5, 1.0), (0.5, 2.0), (1.5, 4.0)], 1.0, 0.5);
    let both = tent.then(&outer).expect("few knots");
    for k in -40..40 {
        let u = f64::from(k) * 0.077;
        let expected = value(&outer, value(&tent, u));
        assert!((value(&both, u) - expected).abs() < 1e-12, "{u}");
    }
    let product = tent.times(&Piecewise::step(0.3)).expect("a step");
    assert_eq!(value(&product, 0.2), 0.0);
    assert!((value(&product, 0.5) - 1.0).abs() < 1e-15);
    assert_eq!(tent.times(&tent), None);
}

#[test]
fn a_steep_clamp_keeps_its_numbers() {
    let clamp = Piecewise::through(&[(-4.8, -4.8), (4.8, 4.8)], 0.0, 0.0);
    let f = Piecewise::line(1e5, 0.0).then(&clamp).expect("two knots");
    let (linear, parts) = f.monotone();
    assert_eq!((linear, parts.len(), parts[0].sign), (0.0, 1, 1.0));
    let curve = &parts[0].curve;
    assert_eq!(curve.kind, "saturation");
    let corners: Vec<(f64, f64)> = curve.vertices.iter().map(|(u, y)| (u.f64, y.f64)).collect();
    assert_eq!(corners, [(-4.8e-5, -4.8), (4.8e-5, 4.8)]);
    assert_eq!((curve.first.1.f64, curve.last.1.f64), (0.0, 0.0));
}

#[test]
fn knots_that_do_nothing_vanish() {
    let ramp = Piecewise::ramp();
    let line = ramp.plus(&Piecewise::line(-1.0, 0.0).then(&ramp).unwrap().scaled(-1.0));
    assert_eq!(line.as_line(), Some((1.0, 0.0)));
    let shifted = Piecewise::line(1.0, -2.0).then(&ramp).unwrap();
    let other = Piecewise::line(-1.0, 2.0).then(&ramp).unwrap();
    assert_eq!(
        shifted.plus(&other.scaled(-1.0)).as_line(),
        Some((1.0, -2.0))
    );
}

#[test]
fn sums_of_monotone_parts() {
    let window = Piecewise::step(1.0).plus(&Piecewise::step(2.0).scaled(-1.0));
    let (linear, parts) = window.monotone();
    assert_eq!((linear, parts.len()), (0.0, 2));
    assert_eq!((parts[0].sign, parts[1].sign), (1.0, -1.0));
    assert_eq!(
        (parts[0].curve.kind, parts[1].curve.kind),
        ("relay", "relay")
    );
    let ramp = Piecewise::ramp();
    let magnitude = ramp.plus(&Piecewise::line(-1.0, 0.0).then(&ramp).unwrap());
    let (linear, parts) = magnitude.monotone();
    assert_eq!((linear, parts.len(), parts[0].sign), (-1.0, 1, 1.0));
    assert_eq!(parts[0].curve.last.1.f64, 2.0);
}

#[test]
fn waveform_points() {
    let f = Piecewise::step(1.0).scaled(5.0);
    assert_eq!(
        f.points(0.0, 3.0),
        [(0.0, 0.0), (1.0, 0.0), (1.0, 5.0), (3.0, 5.0)]
    );
    assert_eq!(
        Piecewise::line(2.0, 1.0).points(0.0, 2.0),
        [(0.0, 1.0), (2.0, 5.0)]
    );
}
