//! Every code of a finding is explained, and shows in its example.
#![cfg(feature = "cli")]
#![allow(missing_docs, reason = "tests")]

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;

use circ::diagnostic::explain::{AREAS, Example, Explanation, explain};
use syn::visit::{self, Visit};

/// Functions that make a finding of the code that is their first argument.
const MAKERS: [&str; 7] = ["error", "fault", "new", "note", "plain", "told", "warning"];
/// The calls that take a code from such a function, a structure or a tuple: by file, how many.
const PASSED_ON: [(&str, usize); 5] = [
    ("circuit/eval.rs", 1),
    ("circuit/pin.rs", 1),
    ("cli/render.rs", 1),
    ("integrate/located.rs", 1),
    ("netlist/card/passive.rs", 1),
];

/// The codes that a file makes findings of.
#[derive(Default)]
struct Codes {
    codes: BTreeSet<String>,
    passed_on: usize,
    /// Within a function that gives codes.
    is_code: bool,
}

fn literal(expr: &syn::Expr) -> Option<String> {
    match expr {
        syn::Expr::Lit(syn::ExprLit {
            lit: syn::Lit::Str(text),
            ..
        }) => Some(text.value()),
        _ => None,
    }
}

fn is_test(attributes: &[syn::Attribute]) -> bool {
    let test = |a: &syn::Attribute| matches!(&a.meta, syn::Meta::List(list) if list.path.is_ident("cfg") && list.tokens.to_string() == "test");
    attributes.iter().any(test)
}

impl<'s> Visit<'s> for Codes {
    fn visit_item_mod(&mut self, module: &'s syn::ItemMod) {
        if !is_test(&module.attrs) {
            visit::visit_item_mod(self, module);
        }
    }

    fn visit_expr_call(&mut self, call: &'s syn::ExprCall) {
        if let syn::Expr::Path(function) = &*call.func {
            let names: Vec<String> = function
                .path
                .segments
                .iter()
                .map(|s| s.ident.to_string())
                .collect();
            let name = names.last().map_or("", String::as_str);
            let of_diagnostic = names.len() == 2 && names[0] == "Diagnostic";
            let own = names.len() == 1 && ["plain", "told"].contains(&name);
            let of = |kind, makers: &[&str]| {
                names.len() == 2 && names[0] == kind && makers.contains(&name)
            };
            let other =
                of("Failure", &["told"]) || of("Note", &["of", "run"]) || of("Self", &["of"]);
            if other || (of_diagnostic || own) && MAKERS.contains(&name) {
                match call.args.first().and_then(literal) {
                    Some(code) => drop(self.codes.insert(code)),
                    None if of_diagnostic => self.passed_on += 1,
                    None => {}
                }
            }
        }
        visit::visit_expr_call(self, call);
    }

    fn visit_expr_method_call(&mut self, call: &'s syn::ExprMethodCall) {
        let of_streams =
            call.args.len() == 2 && (call.method == "note" || call.method == "warning");
        if call.method == "fault" || of_streams {
            self.codes.extend(call.args.first().and_then(literal));
        }
        visit::visit_expr_method_call(self, call);
    }

    /// `fn code(…) -> &'static str { match … { … => "file" } }`.
    fn visit_signature(&mut self, signature: &'s syn::Signature) {
        self.is_code = signature.ident == "code";
        visit::visit_signature(self, signature);
    }

    fn visit_arm(&mut self, arm: &'s syn::Arm) {
        if self.is_code {
            self.codes.extend(literal(&arm.body));
        }
        visit::visit_arm(self, arm);
    }

    /// `vec![Diagnostic::error("set", …)]`.
    fn visit_macro(&mut self, call: &'s syn::Macro) {
        let list = syn::punctuated::Punctuated::<syn::Expr, syn::Token![,]>::parse_terminated;
        let mut inner = Self::default();
        for expr in call.parse_body_with(list).iter().flatten() {
            inner.visit_expr(expr);
        }
        self.codes.extend(inner.codes);
        self.passed_on += inner.passed_on;
    }

    fn visit_field_value(&mut self, field: &'s syn::FieldValue) {
        if matches!(&field.member, syn::Member::Named(name) if name == "code") {
            self.codes.extend(literal(&field.expr));
        }
        visit::visit_field_value(self, field);
    }

    /// `let (code, …) = match … { … => ("suffix-m", …) }`.
    fn visit_local(&mut self, local: &'s syn::Local) {
        let first = match &local.pat {
            syn::Pat::Tuple(tuple) => tuple.elems.first(),
            _ => None,
        };
        if let (Some(syn::Pat::Ident(name)), Some(init)) = (first, &local.init)
            && name.ident == "code"
            && let syn::Expr::Match(choice) = &*init.expr
        {
            for arm in &choice.arms {
                if let syn::Expr::Tuple(tuple) = &*arm.body {
                    self.codes.extend(tuple.elems.first().and_then(literal));
                }
            }
        }
        visit::visit_local(self, local);
    }
}

fn codes_of(text: &str) -> Codes {
    let mut codes = Codes::default();
    codes.visit_file(&syn::parse_file(text).expect("Rust"));
    codes
}

/// The codes of all sources, each with a file that has it.
fn codes() -> BTreeMap<String, String> {
    let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
    let mut folders = vec![source.clone()];
    let (mut codes, mut passed_on) = (BTreeMap::new(), BTreeMap::new());
    while let Some(folder) = folders.pop() {
        for entry in fs::read_dir(folder).expect("a folder") {
            let path = entry.expect("an entry").path();
            let below = path.strip_prefix(&source).expect("below src");
            let below = below.to_string_lossy().replace('\\', "/");
            if path.is_dir() {
                folders.push(path);
            } else if path.extension().is_some_and(|e| e == "rs")
                && !below.ends_with("tests.rs")
                && below != "diagnostic.rs"
            {
                let found = codes_of(&fs::read_to_string(&path).expect("a source file"));
                if found.passed_on > 0 {
                    passed_on.insert(below.clone(), found.passed_on);
                }
                codes.extend(found.codes.into_iter().map(|code| (code, below.clone())));
            }
        }
    }
    let known: BTreeMap<String, usize> = PASSED_ON.map(|(f, n)| (f.to_owned(), n)).into();
    assert_eq!(
        passed_on, known,
        "findings whose code is no literal: is it collected?"
    );
    codes
}

fn all() -> impl Iterator<Item = &'static Explanation> {
    AREAS.iter().flat_map(|area| area.codes)
}

#[test]
fn every_code_is_explained_and_every_explanation_has_its_code() {
    let codes = codes();
    assert!(codes.len() > 100, "the codes are found");
    let unexplained: Vec<_> = codes
        .iter()
        .filter(|(code, _)| explain(code).is_none())
        .collect();
    assert!(
        unexplained.is_empty(),
        "belong into src/diagnostic/explain: {unexplained:?}"
    );
    let mut seen = BTreeSet::new();
    for explanation in all() {
        let code = explanation.code;
        assert!(codes.contains_key(code), "no finding has the code {code}");
        assert!(seen.insert(code), "{code} is explained twice");
        for text in [explanation.meaning, explanation.cause, explanation.remedy] {
            assert!(text.len() > 7 && text.ends_with('.'), "{code}: {text}");
        }
    }
    for area in AREAS {
        assert!(area.codes.is_sorted_by_key(|e| e.code), "{}", area.title);
    }
}

#[test]
fn codes_are_collected_from_every_form() {
    let found = codes_of(
        r#"
        fn f() {
            let a = Diagnostic::error("one", None, "…");
            let (code, text) = match a { _ => ("two", "…") };
            let b = Diagnostic::warning(code, None, text);
            self.fault::<()>("three", a, "…");
            let c = Told { code: "four", help: "…" };
            let d = plain("five", None);
            let e = vec![Diagnostic::note("seven", None, "…")];
            let f = Note::run("eight", "…");
            let g = Failure::told("nine", text);
            streams.note("ten", "…");
        }
        fn code(kind: Kind) -> &'static str {
            match kind { _ => "eleven" }
        }
        fn other(kind: Kind) -> &'static str {
            match kind { _ => "no-code" }
        }
        #[cfg(test)]
        mod tests { fn f() { Diagnostic::error("six", None, "…"); } }
        "#,
    );
    let expected: BTreeSet<String> = [
        "eight", "eleven", "five", "four", "nine", "one", "seven", "ten", "three", "two",
    ]
    .map(str::to_owned)
    .into();
    assert_eq!((found.codes, found.passed_on), (expected, 1));
}

fn circ(folder: &Path, arguments: &str) -> (i32, String) {
    let ran = Command::new(env!("CARGO_BIN_EXE_circ"))
        .current_dir(folder)
        .args(arguments.split_whitespace())
        .output()
        .expect("circ");
    let text = [ran.stdout, ran.stderr].concat();
    (
        ran.status.code().unwrap_or(-1),
        String::from_utf8_lossy(&text).into_owned(),
    )
}

/// The codes that the command tells of the netlist.
fn told(folder: &Path, example: &Example) -> BTreeSet<String> {
    let file: PathBuf = folder.join("example.cir");
    fs::write(file, example.netlist).expect("a file");
    let (command, options) = example
        .command
        .split_once(' ')
        .unwrap_or((example.command, ""));
    let json = if command == "check" { "--json" } else { "" };
    let (_, text) = circ(
        folder,
        &format!("{command} example.cir {options} {json} --message-format json"),
    );
    let parts = text.split("\"code\":\"").skip(1);
    parts
        .filter_map(|part| Some(part.split_once('"')?.0.to_owned()))
        .collect()
}

#[test]
fn examples_show_their_codes() {
    let folder = tempfile::tempdir().expect("a folder");
    let mut faults = Vec::new();
    let mut count = 0;
    for explanation in all() {
        let Some(example) = &explanation.example else {
            continue;
        };
        count += 1;
        let told = told(folder.path(), example);
        if !told.contains(explanation.code) {
            faults.push(format!("{}: {told:?}", explanation.code));
        }
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
    assert!(count > 80, "{count} examples");
}

#[test]
fn the_command_lists_explains_and_suggests() {
    let folder = tempfile::tempdir().expect("a folder");
    let (status, list) = circ(folder.path(), "explain");
    assert_eq!(status, 0);
    for explanation in all() {
        assert!(list.contains(explanation.code), "{}", explanation.code);
        assert!(list.contains(explanation.meaning), "{}", explanation.code);
    }
    let page = circ(folder.path(), "explain unknown-model");
    assert_eq!(page.0, 0);
    insta::assert_snapshot!(page.1);
    assert_eq!(circ(folder.path(), "explain error[Unknown-Model]:"), page);
    let (status, text) = circ(folder.path(), "explain unknown-modle");
    assert_eq!(status, 2);
    assert_eq!(
        text,
        "error[unknown-code]: there is no code `unknown-modle`: did you mean `unknown-model`?\n  help: `circ explain` lists all\n"
    );
    let (status, text) = circ(folder.path(), "explain x");
    assert_eq!(
        (status, text.as_str()),
        (
            2,
            "error[unknown-code]: there is no code `x`\n  help: `circ explain` lists all\n"
        )
    );
}
