//! `manifest.json`: what made a data set, from what, with which options, and what was lost on the way.

use super::images::ImageCount;
use crate::args::ExportOptions;
use crate::failure::Outcome;
use s3d_geom::Aabb;
use s3d_io::{Domain, Error, Layout, write_json};
use serde::{Deserialize, Serialize};
use std::path::Path;

const GENERATOR: &str = "s3d";
const RUNNING: &str = "running";
const COMPLETE: &str = "complete";

/// The manifest. It names neither threads nor times nor folders of the machine: the same input and options give the
/// same bytes.
#[derive(Debug, Serialize)]
pub(crate) struct Manifest {
    generator: &'static str,
    version: &'static str,
    /// `"running"` from the first file on, `"complete"` after the last.
    status: &'static str,
    seed: u64,
    options: Options,
    /// The areas that are in the folder, or will be.
    area_numbers: Vec<u32>,
    areas: Vec<AreaEntry>,
    labels: usize,
}

#[derive(Debug, Serialize)]
struct Options {
    views: u32,
    size: u32,
    pano_width: u32,
    pool: String,
    points_per_m2: f64,
    entropy_stride: u32,
    modalities: Vec<String>,
    keep_all: bool,
    only: Vec<String>,
    normals: &'static str,
    compression: &'static str,
}

/// What the manifest tells of an area.
#[derive(Debug, Serialize)]
pub(crate) struct AreaEntry {
    pub(crate) area: u32,
    pub(crate) faces: usize,
    /// Faces of the input that are not in the data set: without area, or with the corners of an earlier one.
    pub(crate) faces_left_out: usize,
    pub(crate) points: u64,
    pub(crate) annotated_points: u64,
    pub(crate) rooms: usize,
    pub(crate) locations: usize,
    pub(crate) panoramas: u64,
    pub(crate) views: u64,
    pub(crate) xyz: XyzLoss,
    /// What its RGB images are made from.
    pub(crate) rgb: &'static str,
}

/// What storing world coordinates as half floats loses.
#[derive(Debug, Serialize)]
pub(crate) struct XyzLoss {
    #[serde(rename = "type")]
    kind: &'static str,
    /// The farthest that a coordinate of the mesh is from 0, metres.
    largest_coordinate_m: f32,
    /// The distance between neighbouring half floats there, metres; the error is at most half of it.
    largest_step_m: f64,
}

impl XyzLoss {
    /// The loss in a mesh with this box.
    pub(crate) fn of(bbox: Aabb) -> Self {
        let largest = bbox.to_array().iter().fold(0.0f32, |m, c| m.max(c.abs()));
        Self { kind: "half", largest_coordinate_m: largest, largest_step_m: half_step(largest) }
    }
}

/// The distance between neighbouring half floats at `value`: they have 11 significant bits, down to 2⁻²⁴.
pub(crate) fn half_step(value: f32) -> f64 {
    let mut step = 2f64.powi(-24);
    while step * 2048.0 <= f64::from(value) {
        step *= 2.0;
    }
    step
}

impl Manifest {
    /// The manifest of an export that has begun.
    pub(crate) fn begin(options: &ExportOptions, areas: &[u32], labels: usize) -> Self {
        Self {
            generator: GENERATOR,
            version: env!("CARGO_PKG_VERSION"),
            status: RUNNING,
            seed: options.seed,
            options: Options {
                views: options.views,
                size: options.size,
                pano_width: options.pano_width,
                pool: options.pool.to_string(),
                points_per_m2: options.points_per_m2,
                entropy_stride: options.entropy_stride,
                modalities: options.modalities.iter().map(Domain::to_string).collect(),
                keep_all: options.keep_all,
                only: options.only.clone(),
                normals: if options.smooth_normals { "smooth" } else { "flat" },
                compression: options.compression.name(),
            },
            area_numbers: areas.to_vec(),
            areas: Vec::new(),
            labels,
        }
    }

    /// Writes it as it stands.
    pub(crate) fn write(&self, layout: &Layout) -> Outcome<()> {
        write_json(&layout.manifest(), self)?;
        Ok(())
    }

    /// Writes that the export is complete, with what it holds.
    pub(crate) fn complete(mut self, layout: &Layout, areas: Vec<AreaEntry>) -> Outcome<()> {
        self.areas = areas;
        self.status = COMPLETE;
        self.write(layout)
    }
}

impl AreaEntry {
    /// Adds what was rendered.
    pub(crate) fn with_images(mut self, images: ImageCount) -> Self {
        (self.panoramas, self.views) = (images.panoramas, images.views);
        self
    }
}

/// What a manifest tells of the data set beside it.
#[derive(Debug, Deserialize)]
pub(crate) struct Head {
    generator: String,
    status: String,
    /// Its areas.
    pub(crate) area_numbers: Vec<u32>,
}

impl Head {
    /// The manifest at `path`, if there is one and it is ours, of a complete data set or of one that was begun.
    pub(crate) fn read(path: &Path) -> Option<Self> {
        let head: Self = serde_json::from_slice(&std::fs::read(path).ok()?).ok()?;
        (head.generator == GENERATOR).then_some(head)
    }

    /// The manifest of a folder that must hold a complete data set of ours.
    pub(crate) fn require(layout: &Layout) -> Outcome<Self> {
        let path = layout.manifest();
        let head = Self::read(&path).ok_or_else(|| {
            Error::format(&path, "not there, or not written by s3d: give the folder of a data set")
        })?;
        if head.is_complete() {
            return Ok(head);
        }
        Err(Error::format(&path, "the export into this folder did not finish: export again with --overwrite")
            .into())
    }

    /// Whether the export ended.
    pub(crate) fn is_complete(&self) -> bool {
        self.status == COMPLETE
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn steps_of_half_floats() {
        // formats.md: 1.6 cm at 20 m, 6.3 cm at 100 m.
        assert_eq!(half_step(20.0), 1.0 / 64.0);
        assert_eq!(half_step(100.0), 1.0 / 16.0);
        assert_eq!(half_step(1.0), 1.0 / 1024.0);
    }
}
