//! The words that stand for values of options on a command line. Each parser returns what is wrong with a
//! word, in a phrase that goes on after the word.

use crate::options::canonical_uuid;
use clap::builder::{BoolValueParser, MapValueParser, TypedValueParser};
use s3d_geom::NormalAxes;
use s3d_io::dataset::XyzType;
use s3d_render::Normals;

/// Parses anything that has a name.
pub fn parsed<T: std::str::FromStr>(text: &str) -> Result<T, String>
where
    T::Err: std::fmt::Display,
{
    text.trim().parse().map_err(|e: T::Err| e.to_string())
}

/// Parses a finite number.
pub fn finite(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err("not a number".to_owned()),
    }
}

/// Parses a finite number above 0.
pub fn positive(text: &str) -> Result<f64, String> {
    let v = finite(text)?;
    if v > 0.0 {
        Ok(v)
    } else {
        Err("must be above 0".to_owned())
    }
}

/// Parses a finite number from 0.
pub fn not_negative(text: &str) -> Result<f64, String> {
    let v = finite(text)?;
    if v >= 0.0 {
        Ok(v)
    } else {
        Err("must not be below 0".to_owned())
    }
}

/// Parses the width of a panorama.
pub fn even_width(text: &str) -> Result<u32, String> {
    match text.trim().parse::<u32>() {
        Ok(v) if (8..=32_768).contains(&v) && v % 2 == 0 => Ok(v),
        _ => Err("must be an even number from 8 to 32768".to_owned()),
    }
}

/// Parses the stored numbers of world coordinates.
pub(crate) fn stored_xyz(word: &str) -> Result<XyzType, String> {
    match word.parse() {
        Ok(kind @ (XyzType::Half | XyzType::Float)) => Ok(kind),
        _ => Err("must be half or float".to_owned()),
    }
}

/// Parses the axes of normals.
pub fn normal_axes(word: &str) -> Result<NormalAxes, String> {
    NormalAxes::from_name(word).ok_or_else(|| "must be paper or opencv".to_owned())
}

/// Parses the uuid of a scan location.
pub(super) fn uuid(text: &str) -> Result<String, String> {
    canonical_uuid(text).map_err(|_| "no uuid of 32 hexadecimal digits; scene files come first".to_owned())
}

/// Parses a switch: smooth normals if it is set, flat ones if not.
pub(crate) fn smooth_normals() -> MapValueParser<BoolValueParser, fn(bool) -> Normals> {
    let normals: fn(bool) -> Normals = |smooth| if smooth { Normals::Smooth } else { Normals::Flat };
    BoolValueParser::new().map(normals)
}
