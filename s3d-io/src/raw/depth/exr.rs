//! Depth in OpenEXR files: the channel that is named after it, or the only one, or the first of R G B.

use crate::error::{Error, Result};
use crate::fs::read_file;
use crate::guarded::guarded;
use exr::meta::MetaData;
use exr::prelude::{ReadChannels, ReadLayers};
use s3d_geom::Raster;
use std::io::Cursor;
use std::path::Path;

/// Names of channels of depth, the surest first. Blender has V, others Y or R.
const NAMES: [&str; 6] = ["Z", "depth", "V", "Y", "L", "R"];

/// The longest side of a picture, pixels.
const LONGEST_SIDE: usize = 65_535;

/// The most samples that a byte of a file can hold: deflate shrinks at most 1,032 times, and a sample has at
/// least two bytes.
const SAMPLES_PER_BYTE: usize = 1032 / 2;

/// Returns the width and height of a picture in pixels.
pub(super) fn size(path: &Path) -> Result<[u32; 2]> {
    checked_size(&read_file(path)?, path)
}

/// Reads the depth of each pixel, in the file's unit.
pub(super) fn read(path: &Path) -> Result<Raster<f32>> {
    let bytes = read_file(path)?;
    let [width, height] = checked_size(&bytes, path)?;

    let read = guarded(|| {
        exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes()
            .non_parallel()
            .from_buffered(Cursor::new(&bytes))
    });
    let image = read
        .ok_or_else(|| Error::format(path, "no readable OpenEXR file: its blocks are damaged"))?
        .map_err(|e| unreadable(path, &e))?;
    let channels = image.layer_data.channel_data.list;

    let named = NAMES.iter().find_map(|name| {
        let is_it = |channel: &&exr::prelude::AnyChannel<_>| {
            let full = channel.name.to_string();
            full.rsplit('.')
                .next()
                .is_some_and(|last| last.eq_ignore_ascii_case(name))
        };
        channels.iter().find(is_it)
    });
    let only = channels.first().filter(|_| channels.len() == 1);
    let Some(channel) = named.or(only) else {
        let names: Vec<String> = channels.iter().map(|channel| channel.name.to_string()).collect();
        let message = format!("has the channels {}, and none is called Z or depth", names.join(", "));
        return Err(Error::format(path, message));
    };
    let values: Vec<f32> = channel.sample_data.values_as_f32().collect();
    if values.len() != width as usize * height as usize {
        let message = format!("its channel {} has no value for each pixel", channel.name);
        return Err(Error::format(path, message));
    }
    Ok(Raster::from_vec(width, height, values))
}

/// Returns the size of the first layer, if the file can hold what all layers claim.
fn checked_size(bytes: &[u8], path: &Path) -> Result<[u32; 2]> {
    let meta = guarded(|| MetaData::read_from_buffered(bytes, false))
        .ok_or_else(|| Error::format(path, "no readable OpenEXR file: its header is damaged"))?
        .map_err(|e| unreadable(path, &e))?;

    let mut samples = 0usize;
    for header in &meta.headers {
        let [width, height] = [header.layer_size.x(), header.layer_size.y()];
        let claimed = width
            .checked_mul(height)
            .and_then(|pixels| pixels.checked_mul(header.channels.list.len().max(1)))
            .and_then(|count| samples.checked_add(count));
        samples = claimed.unwrap_or(usize::MAX);
        if width > LONGEST_SIDE || height > LONGEST_SIDE || samples / SAMPLES_PER_BYTE > bytes.len() {
            let message = format!("claims {width} × {height} pixels in {} bytes", bytes.len());
            return Err(Error::format(path, message));
        }
    }
    let first = meta.headers.first();
    let size = first.map(|header| [header.layer_size.x(), header.layer_size.y()].map(|side| side as u32));
    size.ok_or_else(|| Error::format(path, "no readable OpenEXR file: it has no layer"))
}

fn unreadable(path: &Path, error: &exr::error::Error) -> Error {
    Error::format(path, format!("no readable OpenEXR file: {error}"))
}
