//! What `.meas ac` may call besides the functions of all expressions: the parts of a signal that is a complex number at every frequency.

use super::builder::Builder;
use super::formula::{Formula, Reading};
use crate::netlist::ast::{Expr, ExprKind, Name, Signal};

/// Functions of one complex number, as programs call them, and as [`Formula::Call`] does.
const PARTS: [(&str, &str); 11] = [
    ("mag", "mag"),
    ("magnitude", "mag"),
    ("ph", "ph"),
    ("phase", "ph"),
    ("arg", "ph"),
    ("re", "re"),
    ("real", "re"),
    ("im", "im"),
    ("imag", "im"),
    ("db", "db"),
    ("conj", "conj"),
];

/// The part that the letters after `v` or `i` mean in `vdb(out)`, `ip(v1)`.
const LETTERS: [(&str, &str); 5] = [
    ("m", "mag"),
    ("p", "ph"),
    ("r", "re"),
    ("i", "im"),
    ("db", "db"),
];

/// The function of a complex number that a name means.
pub(super) fn part(name: &str) -> Option<&'static str> {
    let known = PARTS.iter().find(|(own, _)| *own == name);
    known.map(|(_, part)| *part)
}

/// The names of [`part`].
pub(super) fn names() -> impl Iterator<Item = &'static str> {
    PARTS.iter().map(|(name, _)| *name)
}

impl<'n> Builder<'n, '_> {
    /// `vdb(out)`, `vp(a,b)`, `im(v1)`: the part of a voltage or current. `None` where the call is none of these, `Some(None)` after a reported fault.
    pub(super) fn part_of_signal(
        &mut self,
        name: &Name,
        args: &'n [Expr],
        reading: &Reading<'_>,
    ) -> Option<Option<Formula>> {
        let (kind, letters) = name.text.split_at_checked(1)?;
        let (_, part) = LETTERS.iter().find(|(own, _)| *own == letters)?;
        let mut names = args.iter().map(called);
        let signal = match (kind, names.next().flatten(), names.next()) {
            ("v", Some(a), None) => Signal::Voltage(a, None),
            ("v", Some(a), Some(Some(b))) => Signal::Voltage(a, Some(b)),
            // `im` and `ir` of what is no element are functions of a complex number, if at all.
            ("i", Some(element), None) if self.is_element(&element, reading) => {
                Signal::Current(element)
            }
            _ => return None,
        };
        let signal = self.formula_signal(&signal, reading);
        Some(signal.map(|signal| Formula::Call((*part).to_owned(), vec![signal])))
    }
}

impl Builder<'_, '_> {
    fn is_element(&self, name: &Name, reading: &Reading<'_>) -> bool {
        let found = self
            .names
            .expect_element(name, &self.scopes, reading.scope, "element", &[]);
        found.is_ok()
    }
}

/// The name that an argument is, of a node like `1` too.
fn called(arg: &Expr) -> Option<Name> {
    let text = match &arg.kind {
        ExprKind::Name(text) | ExprKind::Text(text) => text.clone(),
        ExprKind::Number(value) if value.f64 >= 0.0 && value.f64.fract() == 0.0 => {
            value.f64.to_string()
        }
        _ => return None,
    };
    Some(Name {
        text,
        span: arg.span,
    })
}
