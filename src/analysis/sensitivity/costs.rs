//! Derivatives of losses by tables and of temperatures: differences of tables, as no waveform shows them.

use super::survey::beside_value;
use super::{Beside, Gradient, Sensitivity};
use crate::analysis::table::{Table, TableOptions, periodic_table, table};
use crate::analysis::variation::difference_by;
use crate::integrate::{Error, Note};
use crate::settings::tolerances::periodic::{RUN_STEP, VALUE_STEP};

impl Beside<'_> {
    /// To these values.
    pub(super) fn costs(&self, to: &[(String, f64)]) -> Result<Sensitivity, Error> {
        let own = self.table(None)?;
        let part = if own.exact { VALUE_STEP } else { RUN_STEP };
        let of = own.costs().into_iter().map(|(name, value)| Gradient {
            name,
            value: Ok(value),
            to: vec![],
            terms: vec![],
        });
        let mut of: Vec<Gradient> = of.collect();
        for (name, value) in to {
            self.go_on()?;
            let (values, step) = beside_value(*value, part);
            let [a, b, c, d] = values.map(|value| self.table(Some((name, value))));
            let beside = [a?, b?, c?, d?].map(|table| table.costs());
            for gradient in &mut of {
                let at = |costs: &Vec<(String, f64)>| {
                    let entry = costs.iter().find(|(name, _)| *name == gradient.name);
                    entry.map_or(f64::NAN, |(_, value)| *value)
                };
                let derivative = difference_by(beside.each_ref().map(at), step);
                let derivative = Some(derivative).filter(|derivative| derivative.is_finite());
                gradient.to.push((name.clone(), derivative));
            }
        }
        let text = format!(
            "losses by tables and temperatures have differences of tables with values {} and {} % aside",
            100.0 * part,
            200.0 * part
        );
        Ok(Sensitivity {
            of,
            at: to.to_vec(),
            exact: own.exact,
            notes: vec![Note::run("not-exact", text)],
            ..Sensitivity::default()
        })
    }

    /// The table with this value.
    fn table(&self, change: Option<(&str, f64)>) -> Result<Table, Error> {
        let mut model = self.model.clone();
        if let Some((name, value)) = change {
            model.set(name, value)?;
        }
        let options = self.options;
        if options.steady {
            let ends = (&options.inputs[..], &options.outputs[..]);
            return periodic_table(&model, ends, &self.periodic());
        }
        let options = TableOptions {
            inputs: options.inputs.clone(),
            outputs: options.outputs.clone(),
            cancel: options.cancel,
            settings: options.settings.clone(),
            ..TableOptions::default()
        };
        table(&model, &options)
    }
}
