//! What is different in a program without feature `gpu`: it lists no adapters, refuses the GPU by
//! name, and draws with the processor. All else is the code that the other tests run.
#![allow(clippy::unwrap_used)]
#![cfg(not(feature = "gpu"))]

use std::process::{Command, Output};

fn run(folder: &tempfile::TempDir, arguments: &str) -> Output {
    let program = env!("CARGO_BIN_EXE_deepshadow");
    let arguments = arguments.split_whitespace();
    Command::new(program).args(arguments).current_dir(folder).output().unwrap()
}

fn text(bytes: &[u8]) -> String {
    String::from_utf8_lossy(bytes).into_owned()
}

#[test]
fn the_processor_draws_where_nothing_else_can() {
    let folder = tempfile::tempdir().unwrap();
    for map in ["threshold", "fragments"] {
        let picture = format!("render box --size 32x32 --map-size 32 --map {map} -o {map}.png");
        let output = run(&folder, &picture);
        assert!(output.status.success(), "{}", text(&output.stderr));
        assert!(text(&output.stderr).contains("cpu"), "{}", text(&output.stderr));
        assert!(folder.path().join(format!("{map}.png")).metadata().unwrap().len() > 100);
    }
}

#[test]
fn a_gpu_that_is_not_built_in_is_refused_in_one_line() {
    let folder = tempfile::tempdir().unwrap();
    let output = run(&folder, "render box --size 32x32 --backend gpu -o x.png");
    let said = text(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert_eq!(said.trim_end().lines().count(), 1, "{said}");
    assert!(said.contains("no GPU backend"), "{said}");
    assert!(!folder.path().join("x.png").exists());
    let output = run(&folder, "adapters");
    let said = text(&output.stdout) + &text(&output.stderr);
    assert!(said.contains("no GPU backend"), "{said}");
}
