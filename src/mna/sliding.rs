//! A switch on its threshold: between closing and opening, where each contradicts the other.

use super::{Coefficient, Pair, StandardMultiport, StaticMultiport};
use crate::algebra::Value;
use crate::law::Law;
use crate::lcs::{Port, Role};

impl StandardMultiport {
    /// The multiport with switch `k` on its threshold: instead of v = Ron i or i = v/Roff its control stays at `level`,
    /// and its voltage and current are whatever that takes (the equivalent control of Utkin, Sliding Modes, ch. 2).
    ///
    /// The switch leaves [`StaticMultiport::switches`]; the last pair, to be held closed, has the control's deviation from the level as
    /// its reverse and the switch's current as its forward quantity. `None` if there is no such switch.
    #[must_use]
    pub fn sliding(&self, k: usize, level: f64) -> Option<Self> {
        let switch = self.switches.get(k)?.clone();
        let control = self.observed.get(switch.control)?.column;
        let mut out = StaticMultiport {
            ball: std::sync::OnceLock::new(),
            rational: std::sync::OnceLock::new(),
            ..self.0.clone()
        };
        out.switches.remove(k);
        let deviation = out.column(format!("{}.deviation", switch.name));
        // Observed columns occur in their definitions only: Σ terms − control = 0.
        let definition = self
            .equations
            .iter()
            .find(|e| e.iter().any(|term| term.1 == control))?;
        let mut equation = definition.clone();
        equation.retain(|term| term.1 != control);
        equation.push((
            Coefficient::Minus(Value::binary(level)),
            StaticMultiport::ONE,
        ));
        equation.push((Coefficient::MINUS_ONE, deviation));
        out.equations.push(equation);
        out.internal.push(switch.v);
        let (forward, reverse) = (
            format!("i({})", switch.name),
            out.columns[deviation].clone(),
        );
        out.pairs.push(Pair {
            port: Port {
                device: switch.name,
                role: Role::Current,
                lambda: forward.clone(),
                y: reverse.clone(),
                law: Law::ideal_diode(),
            },
            reverse: deviation,
            forward: switch.i,
            fixed_role: false,
            reverse_name: reverse,
            forward_name: forward,
            units: ("V", "A"),
        });
        Some(Self(out))
    }
}
