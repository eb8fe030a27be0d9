//! The names of files in a glTF file: relative references with escapes.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use std::borrow::Cow;
use std::path::{Component, Path};

/// Returns whether no part of a path leads out of the folder in which it starts.
pub(super) fn stays_inside(path: &Path) -> bool {
    let mut depth: u32 = 0;
    path.components().all(|component| {
        let next = match component {
            Component::CurDir => Some(depth),
            Component::Normal(_) => depth.checked_add(1),
            Component::ParentDir => depth.checked_sub(1),
            Component::RootDir | Component::Prefix(_) => None,
        };
        depth = next.unwrap_or(depth);
        next.is_some()
    })
}

/// Replaces escapes such as `%20`. Anything else stays.
pub(super) fn percent_decode(text: &str) -> Cow<'_, str> {
    if !text.contains('%') {
        return Cow::Borrowed(text);
    }
    let mut out = Vec::new();
    let mut rest = text.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let escaped = Some(after).filter(|_| byte == b'%').and_then(escape);
        out.push(escaped.unwrap_or(byte));
        rest = if escaped.is_some() {
            after.get(2..).unwrap_or_default()
        } else {
            after
        };
    }
    String::from_utf8(out).map_or(Cow::Borrowed(text), Cow::Owned)
}

/// Reads the byte of two hexadecimal digits.
fn escape(rest: &[u8]) -> Option<u8> {
    let [high, low] = *rest.first_chunk()?;
    let digits = [high, low].iter().all(u8::is_ascii_hexdigit).then_some([high, low])?;
    u8::from_str_radix(std::str::from_utf8(&digits).ok()?, 16).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn escapes() {
        assert_eq!(percent_decode("a%20b%C3%A4"), "a bä");
        assert_eq!(percent_decode("100%"), "100%");
        assert_eq!(percent_decode("%zz%4"), "%zz%4");
        assert_eq!(percent_decode("%ff"), "%ff");
    }

    #[test]
    fn paths_that_lead_out_are_known() {
        for inside in ["a.bin", "parts/../a.bin", "./a/b"] {
            assert!(stays_inside(Path::new(inside)), "{inside}");
        }
        for outside in ["../a.bin", "parts/../../a.bin", "/a.bin"] {
            assert!(!stays_inside(Path::new(outside)), "{outside}");
        }
    }
}
