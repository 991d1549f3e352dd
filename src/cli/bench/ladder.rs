//! The ladders of our own methods: steps and tolerances.

use crate::circuit::Tran;
use crate::cli::request::Request;
use crate::integrate::Method;

/// Halvings of the print step on the ladder of steps.
const HALVINGS: i32 = 10;
/// No run of more steps.
const MOST_STEPS: f64 = 2e6;
/// Nor one of more steps that are chosen: a tolerance that is out of reach ends so, not with the day.
const MOST_CHOSEN: u64 = 20_000_000;
/// Tolerances of the error-controlled ladders.
const TOLERANCES: [f64; 7] = [1e-2, 1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8];
/// The error of implicit Euler is of first order: tighter tolerances cost more than they show.
const EULER_TOLERANCES: usize = 4;

/// θ = ½ and γ = 1: λ is implicit where the rest is the midpoint rule.
pub(super) const IMPLICIT: &str = "theta:gamma=1";

/// A method with a setting.
pub(super) struct Rung {
    /// Its name for `--methods`.
    pub(super) method: &'static str,
    /// The ladder.
    pub(super) series: &'static str,
    pub(super) parameter: String,
    pub(super) request: Request,
    /// Where the rows are not at the print step, their distance, s.
    pub(super) rows: Option<f64>,
}

/// Rows of the second exact run per print step: the fewest that ngspice's ladder has, so that runs with as many rows can be
/// compared.
const SPARSE: f64 = 0.1;

/// The ladders of our own methods.
pub(super) fn rungs(tran: Tran) -> Vec<Rung> {
    let request = |method| Request {
        method,
        theta: None,
        gamma: None,
        step: None,
        tol: None,
        events: false,
        unestimated: true,
        most_steps: Some(MOST_CHOSEN),
    };
    let exact = |rows: Option<f64>| Rung {
        method: "exact",
        series: "exact",
        parameter: rows.map_or_else(String::new, |rows| format!("rows={rows:e}")),
        request: request(Method::Exact),
        rows,
    };
    let mut rungs = vec![exact(None), exact(Some(tran.tstep / SPARSE))];
    let implicit = Request {
        theta: Some(0.5),
        gamma: Some(1.0),
        ..request(Method::Theta)
    };
    let stepping = [
        (
            "euler",
            "euler-tol",
            request(Method::Euler),
            EULER_TOLERANCES,
        ),
        (
            "theta",
            "theta-tol",
            request(Method::Theta),
            TOLERANCES.len(),
        ),
        (IMPLICIT, "", implicit, 0),
    ];
    for (method, controlled, request, n_tolerances) in stepping {
        for k in 0..=HALVINGS {
            let step = tran.tstep * 0.5f64.powi(k);
            if tran.tstop / step <= MOST_STEPS {
                let request = Request {
                    step: Some(step),
                    ..request.clone()
                };
                rungs.push(Rung {
                    method,
                    series: method,
                    parameter: format!("step={step:e}"),
                    request,
                    rows: None,
                });
            }
        }
        for tol in TOLERANCES.into_iter().take(n_tolerances) {
            let request = Request {
                tol: Some(tol),
                ..request.clone()
            };
            rungs.push(Rung {
                method,
                series: controlled,
                parameter: format!("tol={tol:e}"),
                request,
                rows: None,
            });
        }
    }
    rungs
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn ladders_halve_the_print_step_and_stay_affordable() {
        let tran = Tran {
            tstep: 1e-6,
            prints: true,
            tstop: 0.1,
            tstart: 0.0,
            tmax: None,
            uic: false,
        };
        let rungs = rungs(tran);
        let steps: Vec<f64> = rungs
            .iter()
            .filter(|r| r.series == "euler")
            .filter_map(|r| r.request.step)
            .collect();
        assert_eq!(steps, [1e-6, 5e-7, 2.5e-7, 1.25e-7, 6.25e-8]);
        // A tolerance that is out of reach ends.
        let most = |r: &Rung| r.request.settings().max_steps;
        assert!(rungs.iter().all(|r| most(r) == 20_000_000));
    }
}
