//! Large circuits as problems: which they are, and how their steps begin.

use super::system::System;
use super::{Rule, Setup, Sparse};
use crate::circuit::Tran;
use crate::integrate::error::Error;
use crate::integrate::inputs::Inputs;
use crate::integrate::problem::Problem;
use crate::integrate::reading::Point;
use crate::integrate::step::Scheme;
use crate::integrate::switching::{Part, Threshold, Watched, at_start};
use crate::integrate::theta::Stepping;
use crate::lcs::Input;
use crate::settings::Settings;

impl Problem {
    /// Whether steps of this scheme are made on matrices without their zeros: of a circuit of many elements, whose devices are ideal pairs.
    pub(in crate::integrate) fn is_large(&self, scheme: Scheme, settings: &Settings) -> bool {
        let multiport = &self.systems.multiport;
        let ideal = || {
            let mut laws = multiport.pairs.iter().map(|pair| &pair.port.law);
            laws.all(|law| law.is_ideal_diode())
        };
        multiport.storage.len() + multiport.pairs.len() >= settings.large
            && scheme.theta == scheme.gamma
            && !self.has_lines()
            && !self.free_sources
            && self.steps.is_empty()
            && multiport
                .switches
                .iter()
                .all(|switch| switch.latch.is_none())
            && ideal()
    }

    /// Gives switches without `ON`/`OFF` positions that agree with their controls at the start; returns the sources, nothing where a control follows the state: such
    /// switches are not looked for in sparse steps.
    ///
    /// # Errors
    /// The reduction's.
    pub(in crate::integrate) fn prepare_large(
        &mut self,
        settings: &Settings,
    ) -> Result<Option<Vec<Input>>, Error> {
        let multiport = &self.systems.multiport;
        let mut system = System::new(multiport, &self.start.switches, settings)?;
        let mut seen = Vec::new();
        loop {
            let mut parts = [Part::States, Part::Devices, Part::Slopes].into_iter();
            let free =
                |part| (0..multiport.switches.len()).all(|k| system.control_is_free_of(k, part));
            if !parts.all(free) {
                return Ok(None);
            }
            if !self.settle.contains(&true) {
                break;
            }
            let u = Inputs::new(&system.lcs.inputs).all(0.0);
            let at = Point {
                x: &[],
                lambda: &[],
                u: &u,
                du: &[],
            };
            let switches = multiport.switches.iter().zip(&self.start.switches);
            let asked = switches.enumerate().map(|(k, (switch, &on))| {
                if self.settle[k] {
                    Threshold::of(switch).position(on, system.control(k, at))
                } else {
                    on
                }
            });
            let wanted = at_start(&multiport.switches, asked.collect());
            // Positions that contradict each other are left to the run.
            if wanted == self.start.switches || seen.contains(&wanted) {
                break;
            }
            let Ok(next) = System::new(multiport, &wanted, settings) else {
                break;
            };
            system = next;
            seen.push(std::mem::replace(&mut self.start.switches, wanted));
        }
        Ok(Some(system.lcs.inputs))
    }

    /// The stepper of a large circuit at its start.
    ///
    /// # Errors
    /// The reduction's.
    pub(in crate::integrate) fn sparse(
        &self,
        tran: &Tran,
        scheme: Scheme,
        stepping: Stepping,
        settings: &Settings,
    ) -> Result<Sparse, Error> {
        let rule = match stepping {
            Stepping::Controlled { .. } if scheme == Scheme::MIDPOINT => Rule::Stages,
            _ => Rule::Theta(scheme.theta),
        };
        Sparse::new(Setup {
            multiport: std::sync::Arc::clone(&self.systems.multiport),
            position: self.start.switches.clone(),
            conducting: self.conducting.clone(),
            t: self.start.t,
            storage: self.start.storage.as_slice().to_vec(),
            rule,
            stepping,
            longest: tran.tmax.unwrap_or(f64::INFINITY),
            span: tran.tstop,
            settings: settings.clone(),
        })
    }
}
