//! The fixtures are those that tests speak of, and what runs on outside data has a twin that always
//! runs.

use std::collections::BTreeSet;
use std::fs;
use std::path::{Path, PathBuf};

use super::dense_by_others::{FACTS, RAW};
use super::{deep_by_others, nanovdb_fixtures, vdb_fixtures};
use crate::support::{fixture, project};

/// Files below a folder, in order.
fn files(folder: &Path) -> Vec<PathBuf> {
    let mut found = Vec::new();
    for entry in fs::read_dir(folder).unwrap() {
        let path = entry.unwrap().path();
        if path.is_dir() {
            found.extend(files(&path));
        } else {
            found.push(path);
        }
    }
    found.sort();
    found
}

/// Names in the tables of facts.
fn listed() -> BTreeSet<String> {
    let dense = FACTS.iter().chain([&RAW]);
    let dense = dense.flat_map(|fact| [Some(fact.file), fact.beside]).flatten();
    let nano = nanovdb_fixtures::BUMPS.iter().map(|(name, _)| *name);
    let deep = deep_by_others::FILES.iter().map(|(name, _)| *name);
    let names = dense.chain(nano).chain([nanovdb_fixtures::SLAB]).chain(deep).map(str::to_owned);
    let vdb = vdb_fixtures::FILES.iter().map(|name| format!("vdb/{name}"));
    names.chain(vdb).collect()
}

/// What makes the fixtures, and tells of them.
fn is_fixture(path: &Path) -> bool {
    !path.extension().is_some_and(|ending| ["md", "py", "cc"].iter().any(|other| ending == *other))
}

#[test]
fn the_fixtures_are_those_that_the_tests_know() {
    let root = fixture("");
    let there: BTreeSet<String> = files(&root)
        .iter()
        .filter(|path| is_fixture(path))
        .map(|path| {
            let parts: Vec<_> = path.strip_prefix(&root).unwrap().iter().collect();
            parts.iter().map(|part| part.to_string_lossy()).collect::<Vec<_>>().join("/")
        })
        .collect();
    assert_eq!(there, listed());
}

#[test]
fn fixtures_stay_small() {
    let bytes: u64 = files(&fixture("")).iter().map(|path| path.metadata().unwrap().len()).sum();
    assert!(bytes < 250_000, "{bytes} bytes");
}

/// The word that `cargo test` prints beside a test on outside data.
const REASON: &str = "#[ignore = \"needs DEEPSHADOW_DATA\"]";

#[test]
fn every_test_on_outside_data_names_a_twin_that_always_runs() {
    let sources: Vec<(PathBuf, String)> = files(&project().join("tests"))
        .into_iter()
        .filter(|path| path.extension().is_some_and(|ending| ending == "rs"))
        .filter(|path| !path.ends_with("formats/fixture_list.rs"))
        .map(|path| (path.clone(), fs::read_to_string(&path).unwrap()))
        .collect();
    let always_runs = |name: &str| {
        let test = format!("#[test]\nfn {name}() {{");
        sources.iter().any(|(_, text)| text.contains(&test))
    };
    let mut outside = 0;
    for (path, text) in &sources {
        let path = path.display();
        for (at, _) in text.match_indices("data::outside") {
            let before = &text[..at];
            assert!(before.contains("mod outside {"), "{path} reads outside data elsewhere");
        }
        for (at, _) in text.match_indices(REASON) {
            let before = &text[..at];
            assert!(before.contains("mod outside {"), "{path}: `--ignored outside` misses a test");
            let comment = before.rsplit("\n\n").next().unwrap();
            let twin = comment.split("Twin: `").nth(1).and_then(|rest| rest.split('`').next());
            let twin = twin.unwrap_or_else(|| panic!("{path}: no twin is named in '{comment}'"));
            assert!(always_runs(twin), "{path}: `{twin}` is no test that always runs");
            outside += 1;
        }
    }
    assert!(outside > 0);
}
