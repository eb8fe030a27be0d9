//! What words of the command line mean: the parsers of options' values.

use glam::DVec3;
use s3d_geom::NormalAxes;
use s3d_io::dataset::XyzType;

pub(crate) fn normal_axes(word: &str) -> Result<NormalAxes, String> {
    NormalAxes::from_name(word).ok_or_else(|| "must be paper or opencv".to_owned())
}

pub(crate) fn stored_xyz(word: &str) -> Result<XyzType, String> {
    match word.parse() {
        Ok(kind @ (XyzType::Half | XyzType::Float)) => Ok(kind),
        _ => Err("must be half or float".to_owned()),
    }
}

pub(crate) fn parsed<T: std::str::FromStr>(text: &str) -> Result<T, String>
where
    T::Err: std::fmt::Display,
{
    text.trim().parse().map_err(|e: T::Err| e.to_string())
}

pub(crate) fn finite(text: &str) -> Result<f64, String> {
    match text.trim().parse::<f64>() {
        Ok(v) if v.is_finite() => Ok(v),
        _ => Err("not a number".to_owned()),
    }
}

pub(crate) fn positive(text: &str) -> Result<f64, String> {
    let v = finite(text)?;
    if v > 0.0 {
        Ok(v)
    } else {
        Err("must be above 0".to_owned())
    }
}

pub(crate) fn field_of_view(text: &str) -> Result<f64, String> {
    let v = finite(text)?;
    if v > 0.0 && v < 180.0 {
        Ok(v)
    } else {
        Err("must be between 0 and 180 degrees".to_owned())
    }
}

pub(crate) fn uuid(text: &str) -> Result<String, String> {
    s3d_dataset::canonical_uuid(text)
        .map_err(|_| "no uuid of 32 hexadecimal digits; scene files come before --only".to_owned())
}

pub(crate) fn even_width(text: &str) -> Result<u32, String> {
    match text.trim().parse::<u32>() {
        Ok(v) if (8..=32_768).contains(&v) && v % 2 == 0 => Ok(v),
        _ => Err("must be an even number from 8 to 32768".to_owned()),
    }
}

/// Focal lengths and principal point.
pub(crate) fn intrinsics(text: &str) -> Result<[f64; 4], String> {
    let v = text.split(',').map(finite).collect::<Result<Vec<_>, _>>()?;
    match <[f64; 4]>::try_from(v) {
        Ok([fx, fy, ..]) if fx <= 0.0 || fy <= 0.0 => Err("focal lengths must be above 0".to_owned()),
        Ok(k) => Ok(k),
        Err(_) => Err("must be four numbers: fx,fy,cx,cy".to_owned()),
    }
}

pub(crate) fn point(text: &str) -> Result<DVec3, String> {
    let v = text.split(',').map(finite).collect::<Result<Vec<_>, _>>()?;
    <[f64; 3]>::try_from(v)
        .map(DVec3::from_array)
        .map_err(|_| "must be three numbers: x,y,z".to_owned())
}
