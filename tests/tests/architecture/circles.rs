//! That no two files import names of each other in a circle, be it parent and child. `mod` lines do not count, nor does what
//! a file only hands on.
#![allow(
    clippy::unwrap_used,
    reason = "it is the body of a test, which fails by panicking"
)]

use std::collections::{BTreeMap, BTreeSet};

use syn::visit::{self, Visit};
use syn::{Ident, ItemMod, ItemUse, Macro, MetaList, Path, UseTree, Visibility};

use crate::harness::rules::{Files, hold};

/// A crate and modules in it, or a name in a module.
type Place = Vec<String>;

type Sources = BTreeMap<Place, Source>;

/// The paths that a file names, and whether it hands them on; and the words of its code.
#[derive(Default)]
struct Source {
    uses: Vec<(bool, Place)>,
    words: BTreeSet<String>,
}

impl Source {
    /// Takes the leaves of a tree of imports.
    fn import(&mut self, handed_on: bool, mut place: Place, tree: &UseTree) {
        let name = match tree {
            UseTree::Path(path) => {
                place.push(path.ident.to_string());
                return self.import(handed_on, place, &path.tree);
            }
            UseTree::Group(group) => {
                let trees = group.items.iter();
                return trees.for_each(|tree| self.import(handed_on, place.clone(), tree));
            }
            UseTree::Name(leaf) => Some(&leaf.ident),
            UseTree::Rename(leaf) => Some(&leaf.ident),
            UseTree::Glob(_) => None,
        };
        place.extend(name.filter(|name| *name != "self").map(Ident::to_string));
        self.uses.push((handed_on, place));
    }

    /// Takes tokens that are no syntax yet.
    fn tokens(&mut self, tokens: &str) {
        let text = tokens.replace(" :: ", "::");
        for path in text.split(|c: char| !c.is_alphanumeric() && !"_:".contains(c)) {
            let parts = path.split("::").filter(|part| !part.is_empty());
            let parts: Place = parts.map(str::to_owned).collect();
            self.words.extend(parts.iter().cloned());
            self.uses
                .extend(path.contains("::").then_some((false, parts)));
        }
    }
}

impl<'ast> Visit<'ast> for Source {
    fn visit_item_use(&mut self, item: &'ast ItemUse) {
        let handed_on = !matches!(item.vis, Visibility::Inherited);
        self.import(handed_on, Vec::new(), &item.tree);
    }

    fn visit_item_mod(&mut self, item: &'ast ItemMod) {
        let items = item.content.iter().flat_map(|(_, items)| items);
        let code = items.filter(|_| item.ident != "tests");
        code.for_each(|item| self.visit_item(item));
    }

    fn visit_path(&mut self, path: &'ast Path) {
        let parts: Place = path
            .segments
            .iter()
            .map(|part| part.ident.to_string())
            .collect();
        self.uses
            .extend((parts.len() > 1).then_some((false, parts)));
        visit::visit_path(self, path);
    }

    fn visit_macro(&mut self, call: &'ast Macro) {
        self.tokens(&call.tokens.to_string());
        visit::visit_macro(self, call);
    }

    fn visit_meta_list(&mut self, list: &'ast MetaList) {
        self.tokens(&list.tokens.to_string());
    }

    fn visit_ident(&mut self, ident: &'ast Ident) {
        self.words.insert(ident.to_string());
    }

    /// Who may see something is no import.
    fn visit_visibility(&mut self, _: &'ast Visibility) {}
}

/// The module that a file is; none of tests and of what is no source of a crate.
fn module(path: &str) -> Option<Place> {
    let (root, inside) = path.strip_suffix(".rs")?.split_once("/src/")?;
    let parts = [root].into_iter().chain(inside.split('/'));
    let mut parts: Place = parts.map(str::to_owned).collect();
    parts.pop_if(|last| ["lib", "main", "mod"].contains(&last.as_str()));
    let tests = parts.iter().skip(1).any(|part| part == "tests");
    (!tests).then_some(parts)
}

/// Where a path of a module leads: to a place in its own crate; none if to another crate.
fn absolute(sources: &Sources, module: &[String], path: &[String]) -> Option<Place> {
    let supers = path.iter().take_while(|part| *part == "super").count();
    let child = [module, path.get(..1)?].concat();
    let (base, skipped) = match path.first()?.as_str() {
        "crate" => (module.get(..1)?, 1),
        "self" => (module, 1),
        "super" => (module.get(..module.len().checked_sub(supers)?)?, supers),
        _ if sources.contains_key(&child) => (module, 0),
        _ => return None,
    };
    Some([base, path.get(skipped..)?].concat())
}

/// The file that what stands at a place comes from, past those that hand it on.
fn home(sources: &Sources, mut place: Place) -> Option<Place> {
    for _ in 0..8 {
        let known = |length: &usize| sources.contains_key(place.get(..*length).unwrap_or_default());
        let (module, inner) = place.split_at((1..=place.len()).rev().find(known)?);
        let Some(name) = inner.first() else {
            return Some(place);
        };
        let mut uses = sources.get(module)?.uses.iter();
        let handed = uses.find(|(_, path)| path.len() > 1 && path.last() == Some(name));
        match handed.and_then(|(_, path)| absolute(sources, module, path)) {
            Some(next) if next != place => place = next,
            _ => return Some(module.to_vec()),
        }
    }
    None
}

/// The modules that stand in a circle of imports, or between two, each with what it imports.
fn circles(files: &Files) -> Vec<String> {
    let mut sources = Sources::new();
    for (path, text) in files {
        if let Some(module) = module(path) {
            let file = syn::parse_file(text).map_err(|why| (path, why)).unwrap();
            sources.entry(module).or_default().visit_file(&file);
        }
    }
    let imports = |(module, source): (&Place, &Source)| {
        let counts = |(handed_on, path): &&(bool, Place)| {
            !handed_on || path.last().is_some_and(|name| source.words.contains(name))
        };
        let places = source.uses.iter().filter(counts).map(|(_, path)| path);
        let homes = places.filter_map(|path| home(&sources, absolute(&sources, module, path)?));
        (
            module.clone(),
            homes.filter(|home| home != module).collect(),
        )
    };
    let mut graph: BTreeMap<Place, BTreeSet<Place>> = sources.iter().map(imports).collect();
    loop {
        let before = graph.len();
        let named: BTreeSet<Place> = graph.values().flatten().cloned().collect();
        let left: BTreeSet<Place> = graph.keys().cloned().collect();
        graph.retain(|module, homes| {
            homes.retain(|home| left.contains(home));
            !homes.is_empty() && named.contains(module)
        });
        if graph.len() == before {
            break;
        }
    }
    let shown = |(module, homes)| format!("{module:?} imports from {homes:?}");
    graph.iter().map(shown).collect()
}

#[test]
fn no_two_files_import_names_of_each_other_in_a_circle() {
    hold(
        "no_two_files_import_names_of_each_other_in_a_circle",
        circles,
    );
}
