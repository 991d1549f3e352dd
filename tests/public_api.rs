//! What the library offers, as a list that a change of it must change: `INSTA_UPDATE=always cargo test --test public_api`.
#![allow(missing_docs, reason = "tests")]

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};

use syn::{Attribute, Item, UseTree, Visibility};

/// Public items by path, with their kind. Items of private modules count where a public one passes them on.
struct Offer(BTreeMap<String, &'static str>);

impl Offer {
    fn of_the_library() -> Self {
        let mut offer = Self(BTreeMap::new());
        let source = Path::new(env!("CARGO_MANIFEST_DIR")).join("src");
        offer.read(&source.join("lib.rs"), &source, "circ");
        offer
    }

    /// The items of a file whose submodules stand in `folder`.
    fn read(&mut self, file: &Path, folder: &Path, path: &str) {
        let text = std::fs::read_to_string(file).expect("a source file");
        let parsed = syn::parse_file(&text).expect("Rust");
        for item in parsed.items {
            self.take(&item, folder, path);
        }
    }

    fn take(&mut self, item: &Item, folder: &Path, path: &str) {
        let (visibility, attributes, name, kind) = match item {
            Item::Const(i) => (&i.vis, &i.attrs, i.ident.to_string(), "const"),
            Item::Enum(i) => (&i.vis, &i.attrs, i.ident.to_string(), "enum"),
            Item::Fn(i) => (&i.vis, &i.attrs, i.sig.ident.to_string(), "fn"),
            Item::Mod(i) => (&i.vis, &i.attrs, i.ident.to_string(), "mod"),
            Item::Static(i) => (&i.vis, &i.attrs, i.ident.to_string(), "static"),
            Item::Struct(i) => (&i.vis, &i.attrs, i.ident.to_string(), "struct"),
            Item::Trait(i) => (&i.vis, &i.attrs, i.ident.to_string(), "trait"),
            Item::Type(i) => (&i.vis, &i.attrs, i.ident.to_string(), "type"),
            Item::Use(i) => {
                if matches!(i.vis, Visibility::Public(_)) && !is_of_tests(&i.attrs) {
                    for name in names(&i.tree) {
                        self.0.insert(format!("{path}::{name}"), "use");
                    }
                }
                return;
            }
            _ => return,
        };
        // The command line is no library, and tests may do what they like.
        let is_apart = is_of_tests(attributes) || name == "cli" || name == "Readme";
        if !matches!(visibility, Visibility::Public(_)) || is_apart {
            return;
        }
        let inside = format!("{path}::{name}");
        self.0.insert(inside.clone(), kind);
        if kind == "mod" {
            let own: PathBuf = folder.join(&name);
            let file = folder.join(format!("{name}.rs"));
            let file = if file.exists() {
                file
            } else {
                own.join("mod.rs")
            };
            self.read(&file, &own, &inside);
        }
    }
}

fn is_of_tests(attributes: &[Attribute]) -> bool {
    attributes.iter().any(|a| {
        a.path().is_ident("cfg")
            && a.meta
                .require_list()
                .is_ok_and(|list| list.tokens.to_string().contains("test"))
    })
}

/// What a `use` passes on.
fn names(tree: &UseTree) -> Vec<String> {
    match tree {
        UseTree::Path(path) => names(&path.tree),
        UseTree::Name(name) => vec![name.ident.to_string()],
        UseTree::Rename(rename) => vec![rename.rename.to_string()],
        UseTree::Glob(_) => vec!["*".into()],
        UseTree::Group(group) => group.items.iter().flat_map(names).collect(),
    }
}

#[test]
fn what_the_library_offers_is_known() {
    let offer = Offer::of_the_library();
    let lines: Vec<String> = (offer.0.iter())
        .map(|(path, kind)| format!("{kind:6} {path}"))
        .collect();
    insta::assert_snapshot!(lines.join("\n"));
}

/// The front page has the names that most programs need, and no more.
#[test]
fn the_facade_is_small() {
    let offer = Offer::of_the_library();
    let front = |path: &&String| path.matches("::").count() == 1;
    let facade = offer.0.keys().filter(front).count();
    assert!(facade <= 45, "{facade} names stand on the front page");
}

/// Names that several public types share: of a netlist as it is written and of the circuit, and a few more. None may come to them.
const SHARED: [&str; 13] = [
    "Block",
    "Control",
    "Edge",
    "Element",
    "Line",
    "Model",
    "Outcome",
    "Point",
    "Signal",
    "SignalError",
    "Step",
    "Tran",
    "Verdict",
];

/// A type name says which type: no two public types share one.
#[test]
fn a_type_name_is_used_once() {
    let offer = Offer::of_the_library();
    let types = (offer.0.iter())
        .filter(|(_, kind)| ["enum", "struct", "trait", "type"].contains(kind))
        .map(|(path, _)| path.rsplit("::").next().unwrap_or_default());
    let mut seen = BTreeSet::new();
    let shared: BTreeSet<&str> = types.filter(|name| !seen.insert(*name)).collect();
    assert_eq!(shared, SHARED.into());
}
