//! That no two files import names of each other in a circle, be it parent and child. `mod` lines do not count, nor does what
//! a file only hands on.

use std::collections::{BTreeMap, BTreeSet};

use super::{File, repository};

/// A crate and modules in it, or a name in a module.
type Place = Vec<String>;

/// What a file imports, and the words of its code.
struct Source {
    uses: Vec<(bool, Place)>,
    words: BTreeSet<String>,
}

type Sources = BTreeMap<Place, Source>;

/// The module that a file is; none of tests and of what is no source of a crate.
fn module(path: &str) -> Option<Place> {
    let (root, inside) = path.strip_suffix(".rs")?.split_once("/src/")?;
    let mut parts: Place = [root]
        .into_iter()
        .chain(inside.split('/'))
        .map(str::to_owned)
        .collect();
    if ["lib", "main", "mod"].contains(&parts.last()?.as_str()) {
        parts.pop();
    }
    let tests = parts.iter().skip(1).any(|part| part == "tests");
    (!tests).then_some(parts)
}

/// The places that a tree of imports names.
fn leaves(tree: &str, prefix: &[String], found: &mut Vec<Place>) {
    let parts = |text: &str| -> Vec<String> {
        let plain = text.split(" as ").next().unwrap_or_default();
        let parts = plain.split("::").map(|part| part.trim().to_owned());
        parts.filter(|part| !part.is_empty()).collect()
    };
    let (head, inner) = tree.split_once('{').unwrap_or((tree, ""));
    let mut place = [prefix, &parts(head)].concat();
    let Some((inner, _)) = inner.rsplit_once('}') else {
        place.pop_if(|last| last == "self" || last == "*");
        found.push(place);
        return;
    };
    let mut depth = 0;
    let branches = inner.split(|c: char| {
        depth += i32::from(c == '{') - i32::from(c == '}');
        c == ',' && depth == 0
    });
    for branch in branches.filter(|branch| !branch.trim().is_empty()) {
        leaves(branch, &place, found);
    }
}

fn source(text: &str) -> Source {
    let code = text.split("#[cfg(test)]\nmod tests {").next();
    let lines = code.unwrap_or_default().lines();
    let code: Vec<&str> = lines.filter_map(|line| line.split("//").next()).collect();
    let body = code.join("\n");
    let (mut uses, mut rest, mut left) = (Vec::new(), String::new(), body.as_str());
    while let Some(at) = left.find("use ") {
        let (before, after) = left.split_at(at);
        let line = before.rsplit('\n').next().unwrap_or_default().trim();
        let (tree, behind) = after.split_once(';').unwrap_or((after, ""));
        if line.is_empty() || line.starts_with("pub") {
            let mut found = Vec::new();
            leaves(tree.trim_start_matches("use "), &[], &mut found);
            uses.extend(found.into_iter().map(|place| (!line.is_empty(), place)));
            rest.push_str(before);
            left = behind;
        } else {
            rest.push_str(before);
            left = after.trim_start_matches("use ");
        }
    }
    rest.push_str(left);
    // who may see it is no import
    let rest = rest.replace("(in crate::", "(in ");
    let inline = rest.split(|c: char| !c.is_alphanumeric() && !"_:".contains(c));
    let inline = inline.filter(|path| path.contains("::"));
    uses.extend(inline.map(|path| {
        let parts = path.split("::").map(str::to_owned);
        (false, parts.filter(|part| !part.is_empty()).collect())
    }));
    let without_mods = rest.lines().filter(|line| !line.contains("mod "));
    let words =
        without_mods.flat_map(|line| line.split(|c: char| !c.is_alphanumeric() && c != '_'));
    let words = words.map(str::to_owned).collect();
    Source { uses, words }
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

/// The modules that stand in a circle of imports, or between two.
fn circles(files: &[File]) -> Vec<String> {
    let read = |file: &File| Some((module(&file.path)?, source(&file.text)));
    let sources: Sources = files.iter().filter_map(read).collect();
    let imports = |(module, source): (&Place, &Source)| {
        let named = source.uses.iter().filter(|(handed_on, path)| {
            !handed_on || path.last().is_some_and(|name| source.words.contains(name))
        });
        let homes = named.filter_map(|(_, path)| home(&sources, absolute(&sources, module, path)?));
        let homes: BTreeSet<Place> = homes.filter(|home| home != module).collect();
        (module.clone(), homes)
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
            let shown = |(module, homes): (&Place, &BTreeSet<Place>)| {
                let homes: Vec<String> = homes.iter().map(|home| home.join("::")).collect();
                format!("{} imports from {}", module.join("::"), homes.join(", "))
            };
            return graph.iter().map(shown).collect();
        }
    }
}

#[test]
fn no_two_files_import_names_of_each_other_in_a_circle() {
    let of = |texts: &[(&str, &str)]| {
        let file = |(path, text): &(&str, &str)| File::new(&format!("a/src/{path}.rs"), text);
        circles(&texts.iter().map(file).collect::<Vec<_>>()).len()
    };
    let parent = ("b", "mod c;\nuse c::C;\nfn f(c: C) {}");
    assert_eq!(of(&[parent, ("b/c", "use super::B;")]), 2);
    assert_eq!(of(&[parent, ("b/c", "fn f(b: crate::b::B) {}")]), 2);
    assert_eq!(
        of(&[
            ("b", "use crate::c::{d, C};"),
            ("c", "use crate::e::E;"),
            ("e", "use crate::b::B;")
        ]),
        3
    );
    let handed = ("b", "mod c;\nmod d;\npub use c::C;\npub use d::D;");
    assert_eq!(
        of(&[handed, ("b/c", "use super::D;"), ("b/d", "use super::C;")]),
        2
    );
    assert_eq!(
        of(&[
            handed,
            ("b/c", "use super::{B, d::D};"),
            ("b/d", "use std::fmt;")
        ]),
        0
    );
    let tested = (
        "b/c",
        "struct C;\n#[cfg(test)]\nmod tests {\n    use crate::b::B;\n}",
    );
    assert_eq!(of(&[parent, tested, ("lib", "mod b;")]), 0);
    assert_eq!(circles(&repository()), [""; 0]);
}
