//! `s3d compare` reports every difference by name and number, nothing that is equal, and every file that it
//! cannot read by name.

mod exports;
mod images;
mod relabelled;
mod wrong;

use crate::common;
use common::{s3d, text};
use serde_json::Value;
use std::path::Path;

/// Runs `s3d compare`. Returns its text, its JSON and its exit code, which must agree.
#[track_caller]
fn compare_with(a: &Path, b: &Path, more: &[&str]) -> (String, Value, i32) {
    let said = s3d(&[&["compare", text(a), text(b)], more].concat());
    let log = String::from_utf8_lossy(&said.stderr).into_owned();
    assert!(!log.contains("panicked"), "{log}");
    let answer = String::from_utf8(said.stdout).unwrap();
    let json = s3d(&[&["compare", text(a), text(b), "--json", "-"], more].concat());
    assert_eq!(json.status.code(), said.status.code(), "{answer}{log}");
    let code = said.status.code().unwrap();
    let json: Value = serde_json::from_slice(&json.stdout).unwrap_or_else(|e| panic!("{e}: {log}"));
    assert_eq!(json["equal"], code == 0, "{answer}");
    assert_eq!(answer.lines().last().unwrap().starts_with("equal: "), code == 0, "{answer}");
    assert_eq!(log.contains("ERROR"), code != 0, "{log}");
    (answer, json, code)
}

fn compare(a: &Path, b: &Path) -> (String, Value, i32) {
    compare_with(a, b, &[])
}

/// The entry of a list that has this value under a key.
#[track_caller]
fn entry<'v>(list: &'v Value, key: &str, value: &str) -> &'v Value {
    let found = list.as_array().unwrap().iter().find(|entry| entry[key] == value);
    found.unwrap_or_else(|| panic!("no {key} {value:?} in {list:#}"))
}

/// The number of entries.
fn count(list: &Value) -> usize {
    list.as_array().unwrap().len()
}
