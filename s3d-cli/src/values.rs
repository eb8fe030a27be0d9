//! The parsers of the values of options.

use glam::DVec3;
pub(crate) use s3d_dataset::options::words::{even_width, finite, parsed, positive};

pub(crate) fn field_of_view(text: &str) -> Result<f64, String> {
    let v = finite(text)?;
    if v > 0.0 && v < 180.0 {
        Ok(v)
    } else {
        Err("must be between 0 and 180 degrees".to_owned())
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
