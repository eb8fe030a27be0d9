//! Reads the three statements of a material library that say how a face looks: `newmtl`, `Kd` and `map_Kd`.
//!
//! tobj reads these files too. But it panics on a `Kd` of fewer than three numbers, gives up a whole library
//! because of one malformed line of no interest, reports no lines, and takes the options of `map_Kd` for a
//! part of the file name (`tobj_gives_a_library_up`). Every line would have to be rewritten before tobj and
//! read again after it.

use crate::fs::quote::quote;
use crate::fs::text::words;
use crate::mesh::obj::lines::{Line, after, logical_lines, parse_f32, text, without_comment};
use s3d_geom::{DEFAULT_COLOR, Wrap};

/// The start of a comment that tells our own reader how the next texture continues beyond its edges. It is
/// written where MTL files cannot say so, and where the MTL option is left out for other readers.
pub(crate) const WRAP_COMMENT: &str = "# s3d wrap";

/// Returns the word for a wrap in such a comment.
pub(crate) const fn wrap_name(wrap: Wrap) -> &'static str {
    match wrap {
        Wrap::Repeat => "repeat",
        Wrap::Mirror => "mirror",
        Wrap::Clamp => "clamp",
    }
}

/// A material, as its library describes it.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MtlMaterial {
    pub(crate) name: String,
    /// `Kd`, as encoded.
    pub(crate) color: [u8; 3],
    pub(crate) map: Option<MtlMap>,
}

/// The texture that `map_Kd` names.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct MtlMap {
    /// The name of the image, as written.
    pub(crate) file: String,
    pub(crate) wrap: [Wrap; 2],
    pub(crate) line: u64,
}

/// Returns the materials of a library in its order, and warnings, each with its line.
pub(crate) fn parse_mtl(bytes: &[u8]) -> (Vec<MtlMaterial>, Vec<String>) {
    let mut materials: Vec<MtlMaterial> = Vec::new();
    let mut warnings = Vec::new();
    // What our comment says of the next texture.
    let mut wrap = None;

    for Line { number, text: line, .. } in logical_lines(bytes) {
        let line = &*line;
        let Some(keyword) = words(line).next() else { continue };
        let rest = after(line, keyword).trim_ascii();
        if keyword.eq_ignore_ascii_case(b"newmtl") {
            materials.push(MtlMaterial { name: text(rest), color: DEFAULT_COLOR, map: None });
            continue;
        }
        if let Some(words) = line.strip_prefix(WRAP_COMMENT.as_bytes()) {
            wrap = parse_wrap(words);
            continue;
        }

        // Statements before the first `newmtl` belong to no material.
        let Some(material) = materials.last_mut() else { continue };
        if keyword == b"Kd" {
            match parse_color(rest) {
                Some(color) => material.color = color,
                None => warnings.push(format!("line {number}: {} is no colour", quote(line))),
            }
        } else if keyword.eq_ignore_ascii_case(b"map_Kd") {
            let (mut map, ignored) = parse_map(rest, number);
            if let (Some(map), Some(wrap)) = (&mut map, wrap.take()) {
                map.wrap = wrap;
            }
            if let Some(option) = ignored {
                warnings.push(format!("line {number}: {} is not applied to the texture", quote(option)));
            }
            if map.is_none() {
                warnings.push(format!("line {number}: {} names no file", quote(line)));
            }
            material.map = map;
        }
    }
    (materials, warnings)
}

/// Reads two words, for u and v.
fn parse_wrap(rest: &[u8]) -> Option<[Wrap; 2]> {
    let mut words = words(rest);
    let u = wrap_of_name(words.next()?)?;
    let v = wrap_of_name(words.next()?)?;
    Some([u, v])
}

fn wrap_of_name(word: &[u8]) -> Option<Wrap> {
    [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp]
        .into_iter()
        .find(|wrap| wrap_name(*wrap).as_bytes() == word)
}

/// Reads up to three numbers from 0 to 1; one number stands for all three. Returns `None` for anything else,
/// such as `Kd spectral …`.
fn parse_color(rest: &[u8]) -> Option<[u8; 3]> {
    let values: Option<Vec<f32>> = words(without_comment(rest)).take(3).map(parse_f32).collect();
    match values?.as_slice() {
        [r, g, b] => Some([r, g, b].map(|&v| to_byte(v))),
        [gray] => Some([to_byte(*gray); 3]),
        _ => None,
    }
}

fn to_byte(value: f32) -> u8 {
    (value.clamp(0.0, 1.0) * 255.0).round() as u8
}

/// Takes the options off the front of a `map_Kd` line. The rest is the name of the file, spaces included.
/// Also returns the first option that moves or scales the image, which is not applied.
fn parse_map(mut rest: &[u8], line: u64) -> (Option<MtlMap>, Option<&[u8]>) {
    let mut wrap = Wrap::Repeat;
    let mut ignored = None;
    while rest.first() == Some(&b'-') {
        let option = words(rest).next().unwrap_or_default();
        let (fewest, most) = match option {
            b"-o" | b"-s" | b"-t" => (1, 3),
            b"-mm" => (2, 2),
            b"-blendu" | b"-blendv" | b"-boost" | b"-cc" | b"-clamp" | b"-texres" | b"-bm" | b"-imfchan"
            | b"-type" | b"-colorspace" => (1, 1),
            _ => break,
        };

        let mut behind = after(rest, option).trim_ascii_start();
        let mut values = Vec::new();
        while values.len() < most {
            let Some(word) = words(behind).next() else { break };
            if values.len() >= fewest && parse_f32(word).is_none() {
                break;
            }
            values.push(word);
            behind = after(behind, word).trim_ascii_start();
        }

        let neutral = if option == b"-s" { 1.0 } else { 0.0 };
        match option {
            b"-clamp" if values.first() == Some(&&b"on"[..]) => wrap = Wrap::Clamp,
            b"-s" | b"-o" if ignored.is_none() && values.iter().any(|v| parse_f32(v) != Some(neutral)) => {
                ignored = rest.strip_suffix(behind).map(<[u8]>::trim_ascii_end);
            }
            _ => {}
        }
        rest = behind;
    }

    // Some programs put the name into quotes.
    let name = rest
        .strip_prefix(b"\"")
        .and_then(|r| r.strip_suffix(b"\""))
        .unwrap_or(rest);
    ((!name.is_empty()).then(|| MtlMap { file: text(name), wrap: [wrap; 2], line }), ignored)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_and_maps() {
        let (m, warnings) = parse_mtl(
            b"# head\nKd 1 1 1\nnewmtl a b \n\tKd 0.5 0 2 # note\n map_Kd  my photo #1.jpg \r\nnewmtl\nKd 1\n\
              illum x\n",
        );
        assert!(warnings.is_empty(), "{warnings:?}");
        assert_eq!(m[0].name, "a b");
        assert_eq!(m[0].color, [128, 0, 255]);
        let map = m[0].map.as_ref().unwrap();
        assert_eq!((map.file.as_str(), map.line), ("my photo #1.jpg", 5));
        assert_eq!((m[1].name.as_str(), m[1].color), ("", [255; 3]));
    }

    fn found(file: &str, wrap: Wrap) -> Option<(String, Wrap)> {
        Some((file.to_owned(), wrap))
    }

    fn map_of(line: &str) -> (Option<(String, Wrap)>, usize) {
        let (m, warnings) = parse_mtl(format!("newmtl m\nmap_Kd {line}").as_bytes());
        (m[0].map.as_ref().map(|m| (m.file.clone(), m.wrap[0])), warnings.len())
    }

    #[test]
    fn options_are_taken_from_the_name() {
        assert_eq!(map_of("-s 1 1 1 -o 0 0 a.png"), (found("a.png", Wrap::Repeat), 0));
        assert_eq!(map_of("-clamp on -mm 0 1 a b.png"), (found("a b.png", Wrap::Clamp), 0));
        assert_eq!(map_of("-s 2 2 a.png"), (found("a.png", Wrap::Repeat), 1));
        assert_eq!(map_of("-s 1 1.png"), (found("1.png", Wrap::Repeat), 0));
        assert_eq!(map_of("-odd.png"), (found("-odd.png", Wrap::Repeat), 0));
        assert_eq!(map_of("\"C:\\my scans\\a.png\""), (found("C:\\my scans\\a.png", Wrap::Repeat), 0));
        assert_eq!(map_of("-clamp on"), (None, 1));
    }

    #[test]
    fn a_comment_of_ours_tells_how_a_texture_goes_on() {
        let (m, warnings) = parse_mtl(
            b"newmtl a\n# s3d wrap mirror clamp\nmap_Kd a.png\nnewmtl b\nmap_Kd b.png\n# s3d wrap odd clamp\n\
              map_Kd c.png\n",
        );
        assert!(warnings.is_empty());
        let wraps: Vec<_> = m.iter().map(|m| m.map.as_ref().unwrap().wrap).collect();
        assert_eq!(wraps, [[Wrap::Mirror, Wrap::Clamp], [Wrap::Repeat; 2]]);
    }

    fn tobj_library(text: &str) -> tobj::MTLLoadResult {
        tobj::load_mtl_buf(&mut text.as_bytes())
    }

    #[test]
    fn tobj_gives_a_library_up() {
        assert!(tobj_library("newmtl a\nKd 1 0 0\nillum x\n").is_err());
        assert!(tobj_library("newmtl\nKd 1 0 0\n").is_err());
        assert!(std::panic::catch_unwind(|| tobj_library("newmtl a\nKd 1\n")).is_err());
        let (materials, _) = tobj_library("newmtl a\nmap_Kd -clamp on a.png\n").unwrap();
        assert_eq!(materials[0].diffuse_texture.as_deref(), Some("-clamp on a.png"));
    }

    #[test]
    fn a_bad_line_costs_only_itself() {
        let (m, warnings) = parse_mtl(b"newmtl a\nKd 0.5 x\nKd spectral file.rfl 1\nnewmtl b\nKd 0 0 1\n");
        assert_eq!(m[0].color, DEFAULT_COLOR);
        assert_eq!(m[1].color, [0, 0, 255]);
        assert!(warnings[0].starts_with("line 2: `Kd 0.5 x`") && warnings[1].starts_with("line 3"));
    }
}
