//! What happens at one instant of a run.

use std::fmt::{Display, Formatter, Result};
use std::sync::Arc;

use crate::lcs::Port;

/// A switch or device that changed its state.
#[derive(Debug, Clone, PartialEq, Eq, PartialOrd, Ord)]
pub enum Change {
    /// A switch moved.
    Switch {
        /// The switch.
        name: Arc<str>,
        /// Its position now.
        on: bool,
    },
    /// A switch stays on its threshold from now on.
    Slides(Arc<str>),
    /// A device began to conduct or to block.
    Device {
        /// The device.
        name: Arc<str>,
        /// Whether a current may flow now.
        conducts: bool,
    },
}

impl Change {
    /// Whose it is.
    #[must_use]
    pub fn name(&self) -> &str {
        match self {
            Self::Switch { name, .. } | Self::Slides(name) | Self::Device { name, .. } => name,
        }
    }
}

/// The devices one of whose ports began or ceased to conduct, each once; a device conducts where one of its ports does.
pub(crate) fn changes_of_devices(ports: &[Port], before: &[bool], after: &[bool]) -> Vec<Change> {
    let mut changes: Vec<Change> = Vec::new();
    for (j, port) in ports.iter().enumerate() {
        let known = || changes.iter().any(|change| change.name() == port.device);
        if after[j] != before[j] && !known() {
            let own = |k: &usize| ports[*k].device == port.device;
            changes.push(Change::Device {
                name: port.device.as_str().into(),
                conducts: (0..ports.len()).filter(own).any(|k| after[k]),
            });
        }
    }
    changes
}

impl Display for Change {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        match self {
            Self::Switch { name, on } => write!(f, "{name} {}", if *on { "on" } else { "off" }),
            Self::Slides(name) => write!(f, "{name} slides"),
            Self::Device { name, conducts } => {
                write!(
                    f,
                    "{name} {}",
                    if *conducts { "conducts" } else { "blocks" }
                )
            }
        }
    }
}

/// All changes of one instant; prints as `s1 on, d2 blocks, jump`.
#[derive(Debug, Clone, PartialEq)]
pub struct Event {
    /// Time, s.
    pub t: f64,
    /// Switches first, each device once.
    pub changes: Arc<[Change]>,
    /// Whether the state jumped.
    pub jump: bool,
}

impl Event {
    /// Whether this switch moved, to this position.
    #[must_use]
    pub fn turns(&self, switch: &str, to: bool) -> bool {
        let is = |change: &Change| matches!(change, Change::Switch { name, on } if **name == *switch && *on == to);
        self.changes.iter().any(is)
    }

    /// Whether a switch or device of this name changed.
    #[must_use]
    pub fn concerns(&self, name: &str) -> bool {
        self.changes.iter().any(|change| change.name() == name)
    }
}

impl Display for Event {
    fn fmt(&self, f: &mut Formatter<'_>) -> Result {
        let words = self.changes.iter().map(ToString::to_string);
        let jump = self.jump.then(|| "jump".to_string());
        f.write_str(&words.chain(jump).collect::<Vec<_>>().join(", "))
    }
}

/// The event of a device that begins to conduct.
#[cfg(test)]
pub(crate) fn conducts(device: &str, t: f64) -> Event {
    let name = device.into();
    let conducts = true;
    Event {
        t,
        changes: Arc::new([Change::Device { name, conducts }]),
        jump: false,
    }
}

#[cfg(test)]
mod device_tests {
    use super::*;
    use crate::law::Law;
    use crate::lcs::Role;

    #[test]
    fn a_device_conducts_where_one_of_its_ports_does() {
        let port = |device: &str| Port {
            device: device.into(),
            role: Role::Current,
            lambda: String::new(),
            y: String::new(),
            law: Law::ideal_diode(),
        };
        let ports = [port("z1"), port("d1"), port("z1")];
        let changes = changes_of_devices(&ports, &[true, false, true], &[false, true, true]);
        let told: Vec<String> = changes.iter().map(ToString::to_string).collect();
        assert_eq!(told, ["z1 conducts", "d1 conducts"]);
    }
}
