//! Derivatives of measurements in words.

use super::{si, table};
use crate::analysis::{Bound, Gradient, Sensitivity, Worst};

/// Digits shown.
const DIGITS: usize = 6;

/// Of the measurement and of what 1 % of the value that counts most changes, what counts as no influence: the rounding of a difference.
const NO_INFLUENCE: f64 = 1e-9;

impl Sensitivity {
    /// For each measurement a table of values, derivatives, and what 1 % of a value changes, the most first; and what has no influence.
    #[must_use]
    pub fn words(&self) -> String {
        let mut text = String::new();
        for Gradient {
            name, value, to, ..
        } in &self.of
        {
            match value {
                Ok(value) => text.push_str(&format!("{name} = {}\n", si::plain(*value, DIGITS))),
                Err(why) => {
                    text.push_str(&format!("{name} failed: {why}\n"));
                    continue;
                }
            }
            let all = to
                .iter()
                .zip(&self.at)
                .map(|((name, derivative), (_, at))| {
                    let change = derivative.map(|d| 0.01 * d * at);
                    (name, *at, *derivative, change)
                });
            let mut all: Vec<_> = all.collect();
            // Those without a derivative come first.
            let size = |change: Option<f64>| change.map_or(f64::INFINITY, f64::abs);
            all.sort_by(|a, b| size(b.3).total_cmp(&size(a.3)));
            let changes = all.iter().filter_map(|(.., change)| *change);
            let own = value.as_ref().map_or(0.0, |value| 0.01 * value.abs());
            let least = NO_INFLUENCE * changes.fold(own, |m, change| m.max(change.abs()));
            let counting = all.partition_point(|(.., change)| size(*change) > least);
            let rows = all[..counting]
                .iter()
                .map(|(name, at, derivative, change)| {
                    let cell = |x: f64| si::plain(x, DIGITS);
                    let known = |x: Option<f64>| x.map_or("-".into(), cell);
                    vec![
                        (*name).clone(),
                        cell(*at),
                        known(*derivative),
                        known(*change),
                    ]
                });
            let rows: Vec<Vec<String>> = rows.collect();
            if !rows.is_empty() {
                let header = ["to", "value", "derivative", "by 1 %"];
                text.push_str(&table::aligned(&header, &rows));
            }
            let others: Vec<&str> = all[counting..]
                .iter()
                .map(|(name, ..)| name.as_str())
                .collect();
            if !others.is_empty() {
                text.push_str(&format!("no influence: {}\n", others.join(", ")));
            }
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

#[cfg(test)]
mod tests {
    use crate::analysis::{SensitivityOptions, sensitivity};
    use crate::model::Model;

    /// v(b) = 9 V of 10 V, with r2 and r4 as 1 kΩ: by 1 % v1 changes 90 mV, r1 −9 mV, r2 6 mV, r4 3 mV.
    #[test]
    fn the_largest_influence_comes_first_and_what_has_none_is_named() {
        let text = "divider\nv1 a 0 10\nr4 b 0 27k\nr2 b 0 13.5k\nr1 a b 1k\nr3 a 0 1k\n.tran 1m 2m\n.meas tran v find v(b) at=1m\n.end\n";
        let model = Model::parse(text, "divider.cir").expect("a divider");
        let found = sensitivity(&model, &SensitivityOptions::default()).expect("derivatives");
        let words = found.words();
        let rows = words.lines().skip(2).map(|line| line.split(' ').next());
        let rows: Vec<&str> = rows.flatten().collect();
        assert_eq!(rows, ["v1", "r1", "r2", "r4", "no"], "{words}");
        assert!(words.ends_with("no influence: r3\n"), "{words}");
    }
}
