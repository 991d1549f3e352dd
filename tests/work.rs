//! How much work each netlist is, counted: an algorithm that becomes slower shows here without a clock.
//!
//! `INSTA_UPDATE=always cargo test --test work` writes the table anew; a change of it belongs to the commit that made it.
#![allow(missing_docs, clippy::expect_used, reason = "tests")]

use std::path::Path;

use circ::{ElaborateOptions, Model, SimOptions};

#[test]
fn the_work_of_every_netlist_is_known() {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("netlists");
    let mut names: Vec<String> = std::fs::read_dir(&folder)
        .expect("the netlists")
        .filter_map(|entry| entry.ok()?.file_name().into_string().ok())
        .filter(|name| name.ends_with(".cir"))
        .collect();
    names.sort();
    let mut table = format!(
        "{:<28}{:>7}{:>9}{:>9}{:>8}{:>7}{:>7}{:>9}{:>9}\n",
        "netlist", "method", "steps", "rejected", "events", "jumps", "modes", "problems", "factors"
    );
    for name in names {
        let path = folder.join(&name);
        let model = Model::load(&path, ElaborateOptions::default()).expect(&name);
        let run = model.transient(SimOptions::default()).expect(&name);
        let s = &run.stats;
        table += &format!(
            "{:<28}{:>7}{:>9}{:>9}{:>8}{:>7}{:>7}{:>9}{:>9}\n",
            name.trim_end_matches(".cir"),
            run.method,
            s.steps,
            s.rejected,
            s.events,
            s.jumps,
            s.modes,
            s.lcp_solves,
            s.factorisations
        );
    }
    insta::assert_snapshot!(table);
}
