//! What the manifest tells of a data set, as far as it is checked; older manifests tell less.

use super::report::{Report, Topic};
use s3d_geom::NormalAxes;
use s3d_io::dataset::{Conventions, DepthUnits, Domain, Layout, XyzType};
use s3d_io::fs::{Checksum, read_json};
use s3d_render::Normals;
use serde::Deserialize;

/// The manifest.
#[derive(Debug, Deserialize)]
pub(crate) struct ReadManifest {
    pub(crate) generator: String,
    pub(crate) version: String,
    pub(crate) status: String,
    pub(crate) seed: u64,
    pub(crate) options: ManifestOptions,
    pub(crate) area_numbers: Vec<u32>,
    #[serde(default)]
    pub(crate) areas: Vec<ManifestArea>,
    pub(crate) labels: usize,
    #[serde(default)]
    pub(crate) labels_padded_to: usize,
    #[serde(default)]
    pub(crate) files: Option<ManifestFiles>,
    #[serde(default)]
    pub(crate) xyz_from_depth: Option<serde_json::Value>,
}

/// What is told of the list of files.
#[derive(Debug, Deserialize)]
pub(crate) struct ManifestFiles {
    pub(crate) count: u64,
    pub(crate) bytes: u64,
    pub(crate) xxh3_128: Checksum,
}

/// The options that decide what is there.
#[derive(Debug, Deserialize)]
pub(crate) struct ManifestOptions {
    pub(crate) size: u32,
    pub(crate) pano_width: u32,
    pub(crate) pool: String,
    #[serde(default = "published_stride")]
    pub(crate) entropy_stride: u32,
    modalities: Vec<String>,
    pub(crate) keep_all: bool,
    pub(crate) only: Vec<String>,
    pub(crate) normals: String,
    #[serde(default)]
    xyz: String,
    #[serde(default)]
    normal_axes: String,
    #[serde(default)]
    depth_units: String,
    #[serde(default)]
    profiles: Vec<String>,
}

/// What is told of an area.
#[derive(Debug, Deserialize)]
pub(crate) struct ManifestArea {
    pub(crate) area: u32,
    pub(crate) faces: usize,
    pub(crate) points: u64,
    pub(crate) annotated_points: u64,
    pub(crate) rooms: usize,
    pub(crate) locations: usize,
    pub(crate) panoramas: u64,
    pub(crate) views: u64,
    #[serde(default = "texture")]
    pub(crate) rgb: String,
}

fn published_stride() -> u32 {
    4
}

fn texture() -> String {
    "texture".to_owned()
}

impl ReadManifest {
    /// Reads the manifest; `None`, and a fault, if it is none or that of an export that did not finish:
    /// nothing more can be said then.
    pub(crate) fn read(layout: &Layout, report: &Report) -> Option<Self> {
        let path = layout.manifest();
        let manifest: Self = report.read(Topic::Manifest, read_json(&path))?;
        let ours = manifest.generator == "s3d";
        report.check(ours, (Topic::Manifest, "origin"), &path, || {
            format!("written by {:?}, not by s3d", manifest.generator)
        });
        let complete = manifest.status == "complete";
        report.check(complete, (Topic::Manifest, "status"), &path, || {
            format!(
                "status {:?}: the export into this folder did not finish, and what is there is not checked; run it again",
                manifest.status
            )
        });
        (ours && complete).then_some(manifest)
    }

    /// Whether this program wrote it, so that what it always writes is known to the byte.
    pub(crate) fn is_of_this_version(&self) -> bool {
        self.version == env!("CARGO_PKG_VERSION")
    }

    /// In which forms numbers are written.
    pub(crate) fn conventions(&self) -> Conventions {
        let o = &self.options;
        let xyz = self.xyz_from_depth.as_ref().and_then(|x| x["type"].as_str()).unwrap_or(&o.xyz);
        Conventions {
            depth_units: o.depth_units.parse().unwrap_or(DepthUnits::Per512),
            normal_axes: NormalAxes::from_name(&o.normal_axes).unwrap_or(NormalAxes::Paper),
            xyz: xyz.parse().unwrap_or(XyzType::Half),
        }
    }

    /// The domains that every image has, in their order.
    pub(crate) fn domains(&self) -> Vec<Domain> {
        let asked = |d: &Domain| self.options.modalities.iter().any(|m| *m == d.to_string());
        let made_later = |d: &Domain| *d == Domain::GlobalXyz && self.xyz_from_depth.is_some();
        Domain::ALL.into_iter().filter(|d| asked(d) || made_later(d)).collect()
    }

    /// The profiles that are there.
    pub(crate) fn profiles(&self) -> &[String] {
        &self.options.profiles
    }

    /// Which normals faces have.
    pub(crate) fn normals(&self) -> Normals {
        if self.options.normals == "smooth" { Normals::Smooth } else { Normals::Flat }
    }

    /// What is told of an area.
    pub(crate) fn area(&self, number: u32) -> Option<&ManifestArea> {
        self.areas.iter().find(|a| a.area == number)
    }

    /// Whether a location's images were asked for.
    pub(crate) fn is_chosen(&self, uuid: &str) -> bool {
        self.options.only.is_empty() || self.options.only.iter().any(|o| o == uuid)
    }
}
