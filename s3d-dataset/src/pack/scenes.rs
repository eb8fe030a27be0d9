//! Packages that are made from scenes, without a data set on the disk.

use super::destination::Destination;
use super::options::{Package, PackageKind};
use super::source::Source;
use crate::context::Context;
#[cfg(doc)]
use crate::error::Error;
use crate::error::{Result, UsageError};
use crate::export::Export;
use crate::export::bundled::PackageJob;
use crate::record::listing::walk;
use crate::summary::Summary;
use s3d_io::dataset::Domain;
use s3d_io::package::HuggingfaceSet;
use std::fs::metadata;
use std::path::{Path, PathBuf};

/// What is exported for a package.
struct Needs {
    /// Whether the modality is of any use to the package.
    is_used: fn(Domain) -> bool,
    /// The modalities without which there is no package.
    required: &'static [Domain],
    /// Whether it needs the mesh besides images.
    meshes: bool,
}

impl Needs {
    /// Returns what is exported for packages of a kind; `None` if they point to files of a data set, or need
    /// most of them.
    fn of(kind: PackageKind) -> Option<Self> {
        const VIEWS: &[Domain] = &[Domain::Rgb, Domain::Depth, Domain::Pose];
        match kind {
            PackageKind::Webdataset => Some(Self { is_used: |_| true, required: &[], meshes: false }),
            PackageKind::Huggingface => Some(Self {
                is_used: |domain| domain == Domain::Pose || HuggingfaceSet::can_hold(domain),
                required: &[],
                meshes: false,
            }),
            PackageKind::Dust3r | PackageKind::Wai | PackageKind::Vggt => {
                Some(Self { is_used: |domain| VIEWS.contains(&domain), required: VIEWS, meshes: true })
            }
            _ => None,
        }
    }
}

/// Makes a package from the scenes of `export`, with the bytes of [`Export::run`] and
/// [`pack`](super::pack()). While it is made, the images wait in a hidden folder beside `place`, those of a
/// scan location in one file. After a kill, the same call goes on there. An earlier package at `place` is
/// replaced if [`Export::overwrite`] says so. Only the kinds `webdataset`,
/// `huggingface`, `dust3r`, `wai` and `vggt` can be made like that.
///
/// # Errors
/// [`Error::Usage`] if it is of another kind, lacks a modality that it needs, or something is in the way; the
/// errors of [`Export::run`] and [`pack`](super::pack()). A failed run leaves no partial package.
pub fn pack_scenes(export: &Export, package: &Package, place: &Path, ctx: &Context) -> Result<Summary> {
    let kind = package.kind();
    let needs = Needs::of(kind).ok_or_else(|| {
        let why = "such a package is made from a data set: export, and call `s3d pack`".to_owned();
        UsageError::InvalidValue { option: "to", value: kind.to_string(), why }
    })?;
    let export = export.keeping(needs.is_used, kind.title())?;
    export.check_packable(needs.required, kind.title(), place)?;

    let destination = Destination::begin_of_scenes(ctx, place, export.overwrites())?;
    let work = destination.kept();
    let pack = |data| {
        let source = Source::of(ctx, data, &[], package.images())?;
        super::fill(ctx, &source, &destination, package)?;
        Ok(move || {
            let files = walk(destination.path())?;
            let bytes = files.iter().map(|file| metadata(file).map_or(0, |found| found.len()));
            let size = (files.len() as u64, bytes.sum());
            destination.finish()?;
            Ok(size)
        })
    };
    let job = PackageJob { with_meshes: needs.meshes, place, pack };
    export.run_bundled(work.clone(), job, ctx).inspect_err(|_| {
        if work.exists() {
            let at = work.display();
            ctx.info(format_args!("what is finished is kept in {at}: the same call goes on with it"));
        }
    })
}

/// Returns the default place of what is made of a scene, beside it: `…/scene_2d3ds` for a data set, and
/// `…/scene_2d3ds_KIND` for a package.
pub fn default_output(scene: &Path, package: Option<PackageKind>) -> PathBuf {
    let mut name = scene.file_stem().unwrap_or("scene".as_ref()).to_owned();
    name.push("_2d3ds");
    if let Some(kind) = package {
        name.push(format!("_{kind}"));
    }
    scene.with_file_name(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_default_lies_beside_the_scene() {
        assert_eq!(default_output("a/scan.toml".as_ref(), None), Path::new("a/scan_2d3ds"));
        let package = default_output("scene.toml".as_ref(), Some(PackageKind::Wai));
        assert_eq!(package, Path::new("scene_2d3ds_wai"));
    }
}
