//! Reads one statement of an OBJ file, strictly. [`crate::mesh::obj::normal`] rewrites what this reads,
//! [`crate::mesh::obj::diagnose`] looks for what this refuses.

use crate::fs::quote::quote;
use crate::fs::text::number;
use crate::mesh::obj::lines::{next_word, without_comment};
use s3d_geom::glam::{DVec3, Vec3};

/// What is wrong with a statement.
pub(crate) type Why = String;

/// The columns that the corners of a face index.
const COLUMNS: [&str; 3] = ["vertex", "texture coordinate", "normal"];

/// The words that start a statement without vertices, faces and other shapes: groups and display, what
/// belongs to curves and surfaces, points and lines. Source: Advanced Visualizer Manual, appendix B1.
const OTHER_WORDS: &str = "g s mg o bevel c_interp d_interp lod usemap usemtl maplib mtllib shadow_obj \
     trace_obj ctech stech vp cstype deg bmat step p l parm trim hole scrv sp end con res";

/// The words that bring shapes of their own, or another file.
const GEOMETRY_WORDS: &str = "curv curv2 surf bsp bzp cdc cdp call csh";

/// What a statement without vertices and faces is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Other {
    /// It says nothing about shapes.
    Nothing,
    /// It brings a shape that is not read.
    Geometry,
}

/// Returns what a word starts that is not one of `v`, `vt`, `vn`, `f` and `fo`. Comments and empty lines are
/// no statements.
pub(crate) fn other(keyword: &[u8]) -> Result<Other, Why> {
    let is_among = |words: &str, word: &[u8]| words.split_ascii_whitespace().any(|of| of.as_bytes() == word);
    let keyword = without_comment(keyword);
    if keyword.is_empty() || is_among(OTHER_WORDS, keyword) {
        return Ok(Other::Nothing);
    }
    if is_among(GEOMETRY_WORDS, keyword) {
        return Ok(Other::Geometry);
    }
    let lower = keyword.to_ascii_lowercase();
    let is_known = ["v vt vn f fo", OTHER_WORDS, GEOMETRY_WORDS]
        .iter()
        .any(|words| is_among(words, &lower));
    let word = quote(keyword);
    Err(if is_known {
        format!("{word} is no word of the format, which has {} in lower case", quote(&lower))
    } else {
        format!("{word} is no word of the format")
    })
}

/// Reads a `v` line without its keyword: the position, divided by its weight, and the colour as written. A
/// colour that is not finite, as programs write where nothing was seen, is none.
pub(crate) fn vertex(mut rest: &[u8]) -> Result<(Vec3, Option<[f32; 3]>), Why> {
    let words: Vec<&[u8]> = std::iter::from_fn(|| next_word(&mut rest)).take(8).collect();
    // A seventh number is the alpha of the colour.
    let (position, weight, color) = match words[..] {
        [x, y, z] => ([x, y, z], None, None),
        [x, y, z, w] => ([x, y, z], Some(w), None),
        [x, y, z, r, g, b] | [x, y, z, r, g, b, _] => ([x, y, z], None, Some([r, g, b])),
        _ => {
            let n = words.len();
            return Err(format!(
                "a vertex has three coordinates, and a colour has three numbers; here are {n}"
            ));
        }
    };

    let mut position = Vec3::from_array(numbers(position)?);
    if let Some(weight) = weight {
        let [weight] = numbers([weight])?;
        if weight == 0.0 {
            return Err("the vertex has the weight 0".into());
        }
        position /= weight;
    }

    let color = color.map(numbers).transpose()?;
    Ok((position, color.filter(|color| color.iter().all(|c| c.is_finite()))))
}

/// Reads the position like [`vertex`], in `f64`. Returns `None` if the statement has a fault.
pub(crate) fn exact_vertex(mut rest: &[u8]) -> Option<DVec3> {
    let words: Vec<&[u8]> = std::iter::from_fn(|| next_word(&mut rest)).take(8).collect();
    let (&[x, y, z], more) = words.split_first_chunk()?;
    let position = DVec3::new(parse_f64(x)?, parse_f64(y)?, parse_f64(z)?);
    match more {
        [weight] => Some(position / parse_f64(weight)?),
        _ => Some(position),
    }
}

fn parse_f64(word: &[u8]) -> Option<f64> {
    std::str::from_utf8(word).ok()?.parse().ok()
}

/// Reads a `vt` line without its keyword. The second coordinate is 0 if the texture has one dimension.
pub(crate) fn uv(mut rest: &[u8]) -> Result<[f32; 2], Why> {
    let u = next_word(&mut rest).ok_or("a texture coordinate without a number")?;
    numbers([u, next_word(&mut rest).unwrap_or(b"0")])
}

/// Reads a `vn` line without its keyword.
pub(crate) fn normal(mut rest: &[u8]) -> Result<[f32; 3], Why> {
    let mut words = [&b""[..]; 3];
    for word in &mut words {
        *word = next_word(&mut rest).ok_or("a normal needs three numbers")?;
    }
    numbers(words)
}

fn numbers<const N: usize>(words: [&[u8]; N]) -> Result<[f32; N], Why> {
    let mut numbers = [0.0; N];
    for (value, word) in numbers.iter_mut().zip(words) {
        *value = number(word).ok_or_else(|| format!("{} is no number", quote(word)))?;
    }
    Ok(numbers)
}

/// Reads the indices of a face's corner: from 1, or 0 if there is none. `counts` is how many values each
/// column has so far.
pub(crate) fn corner(corner: &[u8], counts: [u64; 3]) -> Result<[u64; 3], Why> {
    let mut indices = [0; 3];
    let mut parts = corner.split(|&b| b == b'/');
    for (column, (index, count)) in indices.iter_mut().zip(counts).enumerate() {
        let part = parts.next().unwrap_or_default();
        if part.is_empty() {
            continue;
        }

        let written = std::str::from_utf8(part).ok().and_then(|part| part.parse::<i64>().ok());
        let written = written.ok_or_else(|| format!("the index {} is no whole number", quote(part)))?;
        // No file has more values than 63 bits count.
        let absolute = if written < 0 {
            count as i64 + written + 1
        } else {
            written
        };
        if absolute < 1 {
            return Err(out_of_range(column, written, count));
        }
        *index = absolute as u64;
    }

    if parts.next().is_some() {
        return Err(format!("the corner {} has more than three indices", quote(corner)));
    }
    if indices[0] == 0 {
        return Err(format!("the corner {} has no vertex", quote(corner)));
    }
    Ok(indices)
}

/// Says that a column of `count` values has no value `index`.
pub(crate) fn out_of_range(column: usize, index: i64, count: u64) -> Why {
    let what = COLUMNS.get(column).copied().unwrap_or_default();
    match index {
        0 => format!("{what} 0: indices count from 1"),
        _ => format!("{what} {index} is not there; there are {count}"),
    }
}
