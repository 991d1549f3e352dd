//! Whether two multiports are one circuit but for names, waveforms and initial values.

use crate::mna::{LatchPort, StandardMultiport, StaticMultiport};

impl StandardMultiport {
    /// Whether it differs from another in names, waveforms of sources and initial values alone: every system of one is the other's.
    pub(crate) fn is_alike(&self, other: &Self) -> bool {
        let (a, b): (&StaticMultiport, &StaticMultiport) = (self, other);
        let counts = |m: &StaticMultiport| {
            let ports = [
                m.storage.len(),
                m.sources.len(),
                m.pairs.len(),
                m.switches.len(),
            ];
            let rest = [m.columns.len(), m.observed.len(), m.probes, m.power.len()];
            (ports, rest)
        };
        counts(a) == counts(b)
            && a.equations == b.equations
            && a.internal == b.internal
            && a.metric == b.metric
            && a.inexact == b.inexact
            && all(&a.storage, &b.storage, |a, b| {
                (a.capacitor, a.state, a.flow) == (b.capacitor, b.state, b.flow)
            })
            && all(&a.sources, &b.sources, |a, b| {
                (a.value, a.other, a.rate, a.input.unit) == (b.value, b.other, b.rate, b.input.unit)
            })
            && all(&a.pairs, &b.pairs, |a, b| {
                (a.reverse, a.forward, a.fixed_role) == (b.reverse, b.forward, b.fixed_role)
                    && (a.port.role, &a.port.law) == (b.port.role, &b.port.law)
            })
            && all(&a.switches, &b.switches, |a, b| {
                (a.v, a.i, a.control, a.ron, a.roff) == (b.v, b.i, b.control, b.ron, b.roff)
                    && (a.on_above, a.off_below) == (b.on_above, b.off_below)
            })
            && all(&a.observed, &b.observed, |a, b| {
                (a.column, a.unit) == (b.column, b.unit)
            })
            && all(&a.power, &b.power, |a, b| {
                (a.kind, a.v, a.i) == (b.kind, b.v, b.i)
            })
            && all(&a.switches, &b.switches, |x, y| {
                match (&x.latch, &y.latch) {
                    (None, None) => true,
                    (Some(LatchPort::Rest(x)), Some(LatchPort::Rest(y))) => x == y,
                    (
                        Some(LatchPort::Hold { gates, valve }),
                        Some(LatchPort::Hold {
                            gates: others,
                            valve: other,
                        }),
                    ) => gates == others && pairs_of(a, valve) == pairs_of(b, other),
                    _ => false,
                }
            })
    }
}

fn all<T>(a: &[T], b: &[T], same: impl Fn(&T, &T) -> bool) -> bool {
    a.len() == b.len() && a.iter().zip(b).all(|(a, b)| same(a, b))
}

/// The pairs of a device.
fn pairs_of(multiport: &StaticMultiport, device: &str) -> Vec<usize> {
    let pairs = multiport.pairs.iter().enumerate();
    let own = pairs.filter(|(_, pair)| pair.port.device == device);
    own.map(|(k, _)| k).collect()
}
