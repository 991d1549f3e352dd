//! Derivatives of measurements in words.

use super::{si, table};
use crate::analysis::{Bound, Gradient, Sensitivity, Worst};

/// Digits shown.
const DIGITS: usize = 6;

impl Sensitivity {
    /// For each measurement a table of values, derivatives, and what 1 % of a value changes.
    #[must_use]
    pub fn words(&self) -> String {
        let mut text = String::new();
        for Gradient { name, value, to } in &self.of {
            match value {
                Ok(value) => text.push_str(&format!("{name} = {}\n", si::plain(*value, DIGITS))),
                Err(why) => {
                    text.push_str(&format!("{name} failed: {why}\n"));
                    continue;
                }
            }
            let rows = to
                .iter()
                .zip(&self.at)
                .map(|((name, derivative), (_, at))| {
                    let cell = |x: f64| si::plain(x, DIGITS);
                    let known = |x: Option<f64>| x.map_or("-".into(), cell);
                    vec![
                        name.clone(),
                        cell(*at),
                        known(*derivative),
                        known(derivative.map(|d| 0.01 * d * at)),
                    ]
                });
            let rows: Vec<Vec<String>> = rows.collect();
            let header = ["to", "value", "derivative", "by 1 %"];
            text.push_str(&table::aligned(&header, &rows));
        }
        text
    }
}

impl Worst {
    /// The range, where its ends are, and what contributes to it.
    #[must_use]
    pub fn words(&self) -> String {
        let Self {
            measurement,
            nominal,
            least,
            greatest,
            contributions,
            ..
        } = self;
        let plain = |x: f64| si::plain(x, DIGITS);
        let mut text = format!(
            "{measurement} = {}, from {} to {} within tolerances ({} to {} by derivatives)\n",
            plain(*nominal),
            plain(least.value),
            plain(greatest.value),
            plain(least.estimate),
            plain(greatest.estimate),
        );
        let end = |bound: &Bound, k: usize| bound.at.get(k).map_or("-".into(), |(_, v)| plain(*v));
        let rows = contributions.iter().enumerate().map(|(k, (name, part))| {
            vec![
                name.clone(),
                plain(part.abs()),
                end(least, k),
                end(greatest, k),
            ]
        });
        let rows: Vec<Vec<String>> = rows.collect();
        text.push_str(&table::aligned(
            &["of", "±", "at least", "at greatest"],
            &rows,
        ));
        text
    }
}
