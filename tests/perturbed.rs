//! Small-signal responses of circuits that switch, against orbits of the same circuits with a small sine in the source.
#![allow(missing_docs, reason = "tests")]

use circ::Model;
use circ::analysis::{About, PeriodicOptions, SmallSignalOptions, periodic_measured, small_signal};
use circ::settings::Settings;
use nalgebra::Complex;

/// A circuit with `@value@` where its source has that value at rest.
#[derive(Clone, Copy)]
struct Case<'a> {
    name: &'static str,
    cards: &'a str,
    /// What is looked at.
    out: &'static str,
    /// Its sources repeat after this, s.
    period: f64,
    /// The sine repeats `cycles` times in `periods` of these: no half of a multiple, where a sine and its mirror image in the switching frequency are one.
    cycles: usize,
    periods: usize,
    /// The larger one of two sines.
    size: f64,
}

const CASES: [Case<'_>; 13] = [
    Case {
        name: "buck in discontinuous conduction, control",
        cards: "v1 1 0 12\ns1 1 2 vc saw sw\nd1 0 2 d\nl1 2 3 4.7u\nrc 3 b 0.03\nc1 b 0 10u\nr1 3 0 50\nvc vc 0 @0.8@\n\
                vsaw saw 0 pulse(0 2 0 10u 0 0 10u)\n.model sw sw(vt=0 vh=0 ron=10m roff=1meg)\n.model d d(ron=10m roff=1meg vfwd=0.4)",
        out: "v(3)",
        period: 10e-6,
        cycles: 3,
        periods: 4,
        size: 8e-3,
    },
    Case {
        name: "buck in discontinuous conduction, input",
        cards: "v1 1 0 @12@\ns1 1 2 vc saw sw\nd1 0 2 d\nl1 2 3 4.7u\nrc 3 b 0.03\nc1 b 0 10u\nr1 3 0 50\nvc vc 0 0.8\n\
                vsaw saw 0 pulse(0 2 0 10u 0 0 10u)\n.model sw sw(vt=0 vh=0 ron=10m roff=1meg)\n.model d d(ron=10m roff=1meg vfwd=0.4)",
        out: "i(l1)",
        period: 10e-6,
        cycles: 2,
        periods: 5,
        size: 0.2,
    },
    Case {
        name: "boost, control",
        cards: "v1 in 0 12\nl1 in sw 47u\ns1 sw 0 c saw m\nd1 sw out d\nc1 out 1 10u\nrc 1 0 5m\nrload out 0 10\nvc c 0 @0.8@\n\
                vsaw saw 0 pulse(0 2 0 9.9u 0 0.1u 10u)\n.model m sw(vt=0 vh=0 ron=10m roff=1meg)\n.model d d(ron=10m roff=1meg vfwd=0.4)",
        out: "v(out)",
        period: 10e-6,
        cycles: 1,
        periods: 3,
        size: 8e-3,
    },
    Case {
        name: "boost in discontinuous conduction, load",
        cards: "v1 in 0 12\nl1 in sw 5u\ns1 sw 0 c saw m\nd1 sw out d\nc1 out 1 4.7u\nrc 1 0 50m\nrload out 0 100\nvc c 0 0.8\niload out 0 @0@\n\
                vsaw saw 0 pulse(0 2 0 9.9u 0 0.1u 10u)\n.model m sw(vt=0 vh=0 ron=10m roff=1meg)\n.model d d(ideal)",
        out: "v(out)",
        period: 10e-6,
        cycles: 4,
        periods: 3,
        size: 2e-2,
    },
    Case {
        name: "flyback, control",
        cards: "v1 in 0 48\nl1 in sw 100u\nl2 0 s 25u\nk1 l1 l2 1\ns1 sw 0 c saw m\nd1 s out d\nc1 out 1 10u\nrc 1 0 20m\nrload out 0 8\nvc c 0 @0.7@\n\
                vsaw saw 0 pulse(0 2 0 9.9u 0 0.1u 10u)\n.model m sw(vt=0 vh=0 ron=50m roff=10meg)\n.model d d(ron=10m roff=10meg vfwd=0.5)",
        out: "v(out)",
        period: 10e-6,
        cycles: 2,
        periods: 3,
        size: 8e-3,
    },
    Case {
        name: "inverting converter, control",
        cards: "v1 in 0 15\ns1 in sw c saw m\nl1 sw x 33u\nrl x 0 20m\nd1 out sw d\nc1 out 0 10u\nrload out 0 12\nvc c 0 @0.9@\n\
                vsaw saw 0 pulse(0 2 0 5u 4.9u 0.1u 10u)\n.model m sw(vt=0 vh=0 ron=20m roff=1meg)\n.model d d(ideal)",
        out: "v(out)",
        period: 10e-6,
        cycles: 3,
        periods: 5,
        size: 8e-3,
    },
    Case {
        name: "Cuk converter, control",
        cards: "v1 in 0 12\nl1 in a 100u\ns1 a 0 c saw m\nc1 a b 4.7u\nd1 b 0 d\nl2 b y 100u\nrl y out 30m\nc2 out 0 10u\nrload out 0 10\nvc c 0 @0.8@\n\
                vsaw saw 0 pulse(0 2 0 9.9u 0 0.1u 10u)\n.model m sw(vt=0 vh=0 ron=20m roff=1meg)\n.model d d(ron=20m roff=1meg vfwd=0.3)",
        out: "v(out)",
        period: 10e-6,
        cycles: 1,
        periods: 4,
        size: 8e-3,
    },
    Case {
        name: "buck with its loop closed, reference",
        cards: "v1 in 0 12\ns1 in sw c saw m\nd1 0 sw d\nl1 sw 1 47u\nrl 1 out 20m\nc1 out 2 100u\nrc 2 0 30m\nrload out 0 2\nrf1 out fb 10k\nrf2 fb 0 10k\n\
                vref ref 0 @2.5@\ne1 eo 0 ref fb 10k\nci fb ci 330n\nri ci eo 1\nro eo c 10\nco c 0 100p\nvsaw saw 0 pulse(0 2 0 9.9u 0 0.1u 10u)\n\
                .model m sw(vt=0 vh=0 ron=10m roff=1meg)\n.model d d(ron=10m roff=1meg vfwd=0.4)",
        out: "v(out)",
        period: 10e-6,
        cycles: 1,
        periods: 5,
        size: 4e-3,
    },
    Case {
        name: "boost with peak-current control, peak",
        cards: "vin vin 0 10\nl1 vin sw 1m ic=0.5\ns1 sw 0 g 0 m\nd1 sw out d\nc1 out 0 12u ic=15\nrl out 0 20\nvclk clk 0 pulse(0 1 0 0 0 1u 100u)\n\
                bsense sense 0 v=i(l1)\nvpeak peak 0 @1@\na1 sense peak 0 0 0 0 over 0 schmitt vt=0 vh=1u\na2 clk over 0 0 0 0 g 0 srflop vhigh=10 ref=0.5\n\
                .model m sw(ideal vt=5)\n.model d d(ideal)",
        out: "v(out)",
        period: 100e-6,
        cycles: 1,
        periods: 3,
        size: 8e-3,
    },
    Case {
        name: "half-wave rectifier",
        cards: "v1 1 0 sin(0 20 50)\nvs 1 2 @0@\nd1 2 3 d\nrs 3 out 0.5\nc1 out 0 470u\nrload out 0 100\n.model d d(ron=50m roff=1meg vfwd=0.6)",
        out: "v(out)",
        period: 20e-3,
        cycles: 3,
        periods: 4,
        size: 0.2,
    },
    Case {
        name: "half-wave rectifier with a choke and a free-wheeling diode",
        cards: "v1 a b sin(0 30 50)\nvs b 0 @0@\nd1 a p d\nd2 0 p d\nl1 p q 30m\nc1 q 0 220u\nrload q 0 40\n.model d d(ideal)",
        out: "i(l1)",
        period: 20e-3,
        cycles: 4,
        periods: 3,
        size: 0.4,
    },
    Case {
        name: "voltage doubler",
        cards: "v1 1 0 sin(0 10 1k)\nvs 1 2 @0@\nrs 2 3 2\nc1 3 4 10u\nd1 0 4 d\nd2 4 out d\nc2 out 0 10u\nrload out 0 500\n.model d d(ron=0.1 roff=10meg vfwd=0.6)",
        out: "v(out)",
        period: 1e-3,
        cycles: 2,
        periods: 5,
        size: 0.1,
    },
    Case {
        name: "half bridge with a double edge, control",
        cards: "vp p 0 50\nvn n 0 -50\ns1 p x c tri m\ns2 x n tri c m\nl1 x y 200u\nr1 y out 0.1\nc1 out 0 5u\nrload out 0 10\nvc c 0 @0.2@\n\
                vtri tri 0 pulse(-1 1 0 5u 5u 0 10u)\n.model m sw(vt=0 vh=0 ron=20m roff=1meg)",
        out: "i(l1)",
        period: 10e-6,
        cycles: 2,
        periods: 3,
        size: 1.6e-2,
    },
];

/// What steps err is not what is compared.
fn precise() -> Settings {
    Settings {
        tol: 1e-6,
        ..Settings::default()
    }
}

impl Case<'_> {
    fn frequency(&self) -> f64 {
        self.cycles as f64 / (self.periods as f64 * self.period)
    }

    /// The circuit with a source that `written` makes of its value at rest.
    fn model(&self, written: impl Fn(f64) -> String, cards: &str) -> Model {
        let parts: Vec<&str> = self.cards.split('@').collect();
        let [before, value, after] = parts[..] else {
            panic!("{}: one source", self.name);
        };
        let source = written(value.parse().expect("a value"));
        let text = format!(
            "t\n{before}{source}{after}\n.save {}\n{cards}\n.end\n",
            self.out
        );
        Model::parse(&text, "t.cir").unwrap_or_else(|e| panic!("{}: {e:?}", self.name))
    }

    fn response(&self) -> Complex<f64> {
        let sweep = format!(".ac list {:e}", self.frequency());
        let model = self.model(|value| format!("dc {value} ac 1"), &sweep);
        let options = SmallSignalOptions {
            about: Some(About::Orbit),
            settings: precise(),
            ..SmallSignalOptions::default()
        };
        let found = small_signal(&model, &options);
        let found = found.unwrap_or_else(|e| panic!("{}: {e}", self.name));
        found.phasors.column(0).next().expect("a value")
    }

    /// The part of the output at the frequency of a sine of this size in the source, in the periodic steady state.
    fn part(&self, size: f64) -> Complex<f64> {
        let (f, length) = (self.frequency(), self.periods as f64 * self.period);
        // The spectrum of a run in steps is that of its rows.
        let rows = if self.cards.contains("is=") { 1e4 } else { 1e2 };
        let cards = format!(
            ".tran {:e} {:e}\n.four {:e} {} {}",
            self.period / rows,
            8.0 * length,
            length.recip(),
            self.cycles,
            self.out
        );
        let model = self.model(|value| format!("sin({value} {size} {f:e} 0 0 0)"), &cards);
        let found = periodic_measured(
            &model,
            &PeriodicOptions {
                settings: precise(),
                ..PeriodicOptions::default()
            },
        );
        let (orbit, _, found) = found.unwrap_or_else(|e| panic!("{}: {e}", self.name));
        assert!(
            (orbit.period / length - 1.0).abs() < 1e-12,
            "{}: {orbit:?}",
            self.name
        );
        let spectrum = found.harmonics[0].result.as_ref().expect("a spectrum");
        let harmonic = spectrum.harmonics.last().expect("a harmonic");
        Complex::from_polar(harmonic.magnitude, harmonic.phase.to_radians())
    }

    /// Half of what sines of ±`size` differ by, over the size: the response, and an error that goes with the square of the size.
    fn difference(&self, size: f64) -> Complex<f64> {
        (self.part(size) - self.part(-size)) / (2.0 * size)
    }
}

/// Half the size has a quarter of the error or less, until rounding is reached, and what three sizes are extrapolated to is the response.
#[test]
fn responses_are_those_of_orbits_with_a_sine_as_it_becomes_small() {
    let mut fall = 0;
    for case in CASES {
        let response = case.response();
        let [a, b, c] = [1.0, 0.5, 0.25].map(|part| case.difference(part * case.size));
        let apart = |found: Complex<f64>| (found - response).norm() / response.norm();
        let once = [(b * 4.0 - a) / 3.0, (c * 4.0 - b) / 3.0];
        let limit = (once[1] * 16.0 - once[0]) / 15.0;
        let name = case.name;
        assert!(apart(limit) < 1e-9, "{name}: {response} {limit}");
        if apart(a) > 1e-8 {
            fall += 1;
            let found = [apart(a), apart(b), apart(c)];
            let falls = found[0] > 3.9 * found[1] && found[1] > 3.9 * found[2];
            assert!(falls, "{name}: {found:?}");
        }
    }
    assert!(fall >= 10, "{fall}");
}

/// The same circuits with exponential diodes, whose orbits are made of steps: what the orbits with a sine leave is their steps' error.
#[test]
fn responses_about_orbits_in_steps_are_those_of_orbits_with_a_sine() {
    let compared = [
        ("buck in discontinuous conduction, control", 2e-6),
        ("boost, control", 1e-6),
        ("buck with its loop closed, reference", 3e-7),
        ("boost with peak-current control, peak", 1e-5),
        (
            "half-wave rectifier with a choke and a free-wheeling diode",
            2e-4,
        ),
        ("voltage doubler", 5e-7),
    ];
    for (name, tolerance) in compared {
        let ideal = CASES.iter().find(|case| case.name == name);
        let ideal = ideal.expect("a case");
        let (cards, _) = ideal.cards.split_once(".model d d(").expect("diodes");
        let cards = format!("{cards}.model d d(is=1e-12 n=1.2 rs=10m)");
        let case = Case {
            cards: &cards,
            ..*ideal
        };
        let response = case.response();
        let [a, b] = [1.0, 0.5].map(|part| case.difference(part * case.size));
        let limit = (b * 4.0 - a) / 3.0;
        let apart = (limit - response).norm() / response.norm();
        assert!(apart < tolerance, "{name}: {response} {limit} {apart:e}");
    }
}

/// Where all devices together interrupt a current, and what they let through is rounding beside their voltages; a transformer, and resistances that are
/// decades apart; a switch that passes its threshold so slowly that steps as long as rounding of the time do not move its control.
const INTERRUPTED: [Case<'_>; 5] = [
    Case {
        name: "flyback with a clamp, whose transistor has a body diode",
        cards: "vin in 0 @12@\nl1 in sw 47u\nl2 0 s 11.75u\nk1 l1 l2 1\nm1 sw g 0 0 mm\nd1 s out d\nc1 out 0 4.7u\n\
                vgg g 0 pulse(0 12 0 50n 50n 15u 50u)\nrload out 0 100\ndz sw cl d\nrc cl in 2k\ncc cl in 10n\n\
                .model mm vdmos(rg=3 vto=3.5 rd=15m rs=5m rb=7m kp=35 cgs=.3n cjo=.4n is=4p)\n.model d d(is=1e-12 n=1.3 rs=10m)",
        out: "v(out)",
        period: 50e-6,
        ..CASES[0]
    },
    Case {
        name: "Cuk converter with a large resistance of its switch",
        cards: "v1 in 0 @12@\nl1 in a 100u\ns1 a 0 g 0 sw\nc1 a b 10u\nd1 b 0 d\nl2 b out 100u\nc2 out 0 100u\nr1 out 0 100\n\
                vg g 0 pulse(0 1 0 0 0 2u 10u)\n.model sw sw(vt=0.5 vh=0 ron=1m roff=1e15)\n.model d d(is=1e-12 n=1.3 rs=10m)",
        out: "v(out)",
        period: 10e-6,
        ..CASES[0]
    },
    Case {
        name: "forward converter with hardly any load",
        cards: "v1 6 0 @400@\nl1 6 1 1.1\nl2 2 6 1.1\nl3 3 0 4.4\nk1 l1 l2 0.98\nk2 l1 l3 0.98\nk3 l2 l3 0.98\nm1 1 8 0 m0\n\
                v3 8 0 pulse(0 5 0 0 0 0.45m 1m)\nr1 1 9 28\nc1 9 0 33n\nd1 0 2 d\nd2 3 4 d\nd3 0 4 d\nl4 4 10 180m\nr2 10 out 0.92\n\
                c2 out 0 170u\nr3 out 0 92\n.model m0 nmos(vto=2.5 ron=10m rds=1meg)\n.model d d(is=1e-12 n=1.3 rs=10m)",
        out: "v(out)",
        period: 1e-3,
        ..CASES[0]
    },
    Case {
        name: "Cuk converter whose switch lies 18 decades apart from itself",
        cards: "v1 4 0 @5@\nl1 4 6 350u\nr1 6 1 50m\nm1 1 7 0 m0\nv3 7 0 pulse(0 15 10u 0 0 2u 20u)\nr2 1 8 1.5\nc1 8 0 12n\nc2 1 2 16u\n\
                d1 2 0 d\nl2 3 2 34u\nc3 3 0 470u\nr3 3 0 5\n.model m0 nmos(vto=7.5 ron=1n rds=1e9)\n.model d d(is=1e-12 n=1.3 rs=10m)",
        out: "v(3)",
        period: 20e-6,
        ..CASES[0]
    },
    Case {
        name: "boost with peak-current control, input",
        cards: "vin vin 0 @10@\nl1 vin sw 1m ic=0.5\ns1 sw 0 g 0 m\nd1 sw out d\nc1 out 0 12u ic=15\nrl out 0 20\n\
                vclk clk 0 pulse(0 1 0 0 0 1u 100u)\nbsense sense 0 v=i(l1)\nvpeak peak 0 1\na1 sense peak 0 0 0 0 over 0 schmitt vt=0 vh=1u\n\
                a2 clk over 0 0 0 0 g 0 srflop vhigh=10 ref=0.5\n.model m sw(ideal vt=5)\n.model d d(is=1e-12 n=1.3 rs=10m)",
        out: "v(out)",
        period: 100e-6,
        ..CASES[0]
    },
];

/// At a frequency that is next to none the response is what another value of the source makes of the mean over a period.
#[test]
fn static_responses_about_orbits_in_steps_are_differences_of_means() {
    for case in INTERRUPTED {
        let mean = |part: f64| {
            let four = format!(
                ".tran 1u 1m\n.four {:e} 1 {}",
                case.period.recip(),
                case.out
            );
            let model = case.model(|value| format!("{:e}", value * (1.0 + part)), &four);
            let found = periodic_measured(&model, &PeriodicOptions::default());
            let (.., found) = found.unwrap_or_else(|e| panic!("{}: {e}", case.name));
            found.harmonics[0].result.as_ref().expect("a spectrum").mean
        };
        let slope = |part: f64| {
            let value: f64 = case
                .cards
                .split('@')
                .nth(1)
                .and_then(|v| v.parse().ok())
                .expect("a value");
            (mean(part) - mean(-part)) / (2.0 * part * value)
        };
        let found = slope(1e-3);
        let slow = Case {
            cycles: 1,
            periods: 1_000_000,
            ..case
        };
        let response = slow.response().re;
        let apart = (response / found - 1.0).abs();
        assert!(apart < 2e-4, "{}: {response} {found} {apart:e}", case.name);
    }
}
