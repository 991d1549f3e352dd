//! Form files and the systems they become.

use super::*;

const INPUT: &str =
    r#""inputs":[{"name":"u1","unit":"V","waveform":{"kind":"sin","args":[0,1,1]}}]"#;

fn form(body: &str) -> Result<SystemFile, FormError> {
    read(&format!(r#"{{"schema":"circ-form/1",{body}}}"#))
}

#[test]
fn sweeping_process_becomes_a_gradient_system() {
    let file = form(&format!(
        r#""form":"sweeping_process","A":[[-1]],"H":[[2]],"G":[[-1]],"F":[0.5],"x0":[1],{INPUT}"#
    ))
    .unwrap();
    assert_eq!(
        (file.lcs.b[(0, 0)], file.lcs.c[(0, 0)], file.lcs.d[(0, 0)]),
        (2.0, 2.0, 0.0)
    );
    assert_eq!(
        (file.lcs.g[(0, 0)], file.lcs.f[0], file.x0[0]),
        (-1.0, 0.5, 1.0)
    );
    let report = crate::check::system(&file.lcs);
    let sweeping = report
        .theorems
        .iter()
        .find(|t| t.statement.contains("Theorem 3.5"))
        .unwrap();
    assert_eq!(sweeping.holds, Some(true), "{report}");
}

#[test]
fn projected_and_unilateral_forms_differ_by_the_sign_of_their_set() {
    let projected = form(r#""form":"projected","M":[[1]],"c":[2],"H":[[1]],"k":[3]"#)
        .unwrap()
        .lcs;
    let unilateral =
        form(r#""form":"complementarity_dynamics","M":[[1]],"c":[2],"H":[[-1]],"k":[-3]"#)
            .unwrap()
            .lcs;
    assert_eq!(
        (&projected.a, &projected.b, &projected.c),
        (&unilateral.a, &unilateral.b, &unilateral.c)
    );
    assert_eq!((projected.e0[0], projected.f[0]), (-2.0, 3.0));
    assert_eq!((unilateral.e0[0], unilateral.f[0]), (-2.0, 3.0));
}

#[test]
fn lure_system_expands_relays_with_their_driven_terms() {
    let lcs = form(&format!(
        r#""form":"multivalued_lure","A":[[0]],"B":[[1]],"C":[[1]],"E":[[0.5]],"G":[[0.25]],
           "phi":[{{"kind":"relay","gain":2}}],{INPUT}"#
    ))
    .unwrap()
    .lcs;
    assert_eq!(lcs.m(), 2);
    assert_eq!(lcs.e[(0, 0)], 0.5);
    assert_eq!((lcs.g[(0, 0)], lcs.g[(1, 0)]), (0.25, 0.0));
    // λ = μ₁ − g: the constant drift is −g.
    assert_eq!((lcs.e0[0], lcs.f[0], lcs.f[1]), (-2.0, 0.0, 4.0));
}

#[test]
fn cone_observer_and_feedback_forms_are_systems() {
    let cone = form(
        r#""form":"cone_complementarity","A":[[-1]],"B":[[1,0]],"C":[[1],[0]],"V":[[1,1],[0,1]],"D_bar":[[1,0],[0,0]]"#,
    )
    .unwrap()
    .lcs;
    assert_eq!(
        (cone.d[(0, 0)], cone.d[(0, 1)], cone.d[(1, 1)]),
        (1.0, 0.0, 0.0)
    );
    let plant = r#""A":[[-0.2,-1],[1,-0.1]],"B":[[-1],[0]],"C":[[-1,0]],"D":[[0.5]]"#;
    let observer = form(&format!(
        r#""form":"observer",{plant},"Z":[[0,1]],"Y":[[0.3]],"rate":0.25"#
    ))
    .unwrap()
    .lcs;
    assert_eq!((observer.n(), observer.m()), (4, 2));
    let active = r#""A":[[0.5,-1],[1,-0.2]],"B":[[1],[0]],"C":[[0.4,0.3]],"D":[[0]]"#;
    let closed = form(&format!(
        r#""form":"output_feedback",{active},"E_control":[[1],[0.2]]"#
    ))
    .unwrap()
    .lcs;
    assert_eq!(crate::check::system(&closed).passive, Some(true));
}

#[test]
fn mistakes_are_named() {
    let message = |body: &str| form(body).unwrap_err().to_string();
    assert!(message(r#""form":"nothing""#).contains("unknown form"));
    assert!(message(r#""form":"sweeping_process""#).contains("`A` is missing"));
    assert!(message(r#""form":"sweeping_process","A":[[1]],"H":[[1,2]]"#).contains("H is 1×2"));
    assert!(message(r#""form":"projected","M":[[1]],"H":[[1]],"k":["x"]"#).contains("`k`"));
    assert!(read("{").is_err());
}
