//! Waveforms that repeat for good.

use super::Wave;

impl Wave {
    /// Whether it varies and does not repeat for good. A pulse whose period is longer than the run, `span` s, or is the run as SPICE fills it in with its width, is a step.
    pub(crate) fn is_once(&self, span: f64) -> bool {
        match *self {
            Self::Dc(_) | Self::Arriving { .. } | Self::Sffm { .. } | Self::Am { .. } => false,
            Self::Exp { .. } => true,
            Self::Sin {
                damping, cycles, ..
            } => damping != 0.0 || cycles.is_some(),
            Self::Pulse {
                width,
                period,
                count,
                ..
            } => {
                count.is_some()
                    || period <= 0.0
                    || period > span
                    || (period == span && width >= period)
            }
            Self::Pwl {
                ref points, repeat, ..
            } => points.len() > 1 && (repeat.is_none() || self.period().is_none()),
        }
    }

    /// Where it repeats for good and begins to after t = 0, has it do so `by` seconds earlier, a multiple of its period.
    pub(crate) fn begin_earlier(&mut self, by: f64, span: f64) {
        if self.is_once(span) {
            return;
        }
        let (delay, repeats) = match self {
            Self::Sin { delay, .. } | Self::Pulse { delay, .. } | Self::Am { delay, .. } => {
                (delay, 0.0)
            }
            Self::Pwl {
                delay,
                repeat: Some(from),
                ..
            } => (delay, *from),
            _ => return,
        };
        if *delay + repeats > 0.0 {
            *delay -= by;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn wave(text: &str) -> Wave {
        let deck = format!("w\nv1 1 0 {text}\nr1 1 0 1\n.tran 1u 1m\n.end\n");
        let model = crate::Model::parse(&deck, "w.cir").expect("a circuit");
        match &model.circuit().elements[0].kind {
            crate::circuit::Kind::VoltageSource(source) => source.wave.clone(),
            kind => panic!("{kind:?}"),
        }
    }

    /// From t = 0 on they are what they were two periods of 10 µs later, and those that come once stay.
    #[test]
    fn what_repeats_has_begun_before() {
        for text in [
            "pulse(0 1 7.5u 10n 20n 4u 10u)",
            "pulse(1 -1 12.5u 0 0 9u 10u)",
            "pulse(0 1 0 10n 20n 4u 10u)",
            "sin(1 2 100k 3u 0 30)",
            "am(2 1 100k 200k 3u)",
            "pwl(0 0 2u 1 5u 3 15u 1) r=5u td=1u",
            "pulse(0 1 7.5u 10n 20n 4u 10u 3)",
            "pulse(0 1 0.5m 10n 20n 1 2)",
            "sin(1 2 100k 3u 1k)",
            "exp(0 1 3u 1u)",
        ] {
            let (own, mut begun) = (wave(text), wave(text));
            let once = own.is_once(1e-3);
            begun.begin_earlier(2e-5, 1e-3);
            assert_eq!(own == begun, once || text.contains("1 0 10n"), "{text}");
            for k in 0..2000 {
                let t = 1.37e-8 * f64::from(k);
                let exact = own.value(if once { t } else { t + 2e-5 });
                let apart = (begun.value(t) - exact).abs();
                assert!(apart < 1e-9, "{text} at {t}: {} {exact}", begun.value(t));
            }
        }
    }
}
