//! Reads a data set back: does it match its manifest, is it free of contradictions, and do its images show
//! its mesh?
//!
//! No fault stops a check: all go to the [report](VerifyReport). Only a fault that prevents every other
//! check, such as a manifest that cannot be read, ends it early.
//!
//! Images are rendered again from the exported mesh. Its files hold every coordinate to the bit and every
//! face in order, and pose files hold the rotation to the bit. So every pixel of every image must be equal to
//! the bit, colours included. Rendering costs less than reading the files, so every image is checked. `full`
//! also scores the candidate views again, and reads the points in all their forms.

mod files;
pub(crate) mod images;
mod instances;
mod labels;
mod mesh;
mod pairs;
mod photographs;
mod points;
mod pose;
mod report;
mod same_bytes;
mod scores;
mod tables;
mod views;
mod votes;

use crate::context::Context;
use crate::error::{Result, TemporaryError, UsageError};
use crate::export::images::objects::{InstanceFinder, instance_meshes};
use crate::export::modality::{Channels, NO_CLASS};
use crate::parallel::for_each_in_order;
use crate::record::manifest::Manifest;
use crate::store::lock::Lock;
use crate::survey::surface_boxes::boxes_of_faces;
use files::Files;
use images::picture_colors;
use images::{ImageCheck, Mismatch, Reference, Scratch, UnlabelledPixels};
use labels::Labels;
use mesh::{LabelledMesh, NOT_IN_TABLE};
use photographs::Photographs;
pub use report::{FaultGroup, VerifyReport};
use report::{Report, Topic};
use s3d_geom::Camera;
use s3d_io::dataset::{DatasetImage, Domain, Layout, dataset_images};
use s3d_io::fs::{Checksum, checksum_of_file};
use s3d_io::image::{Compression, pretty_color};
use s3d_render::{MipMaps, Scene, face_curvatures};
use std::collections::BTreeMap;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::PathBuf;
use std::sync::atomic::Ordering;
use std::sync::{Mutex, PoisonError};
use views::Views;

/// The kind of fault that ends a check early.
const BROKEN_OFF: &str = "checks that broke off";

/// The number of mismatching files of a domain that are diagnosed.
const MAX_DIAGNOSES: usize = 25;

/// How a data set is checked.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct VerifyOptions {
    /// Also score all candidate views again, and compare the S3DIS tree and pointcloud.mat with the point
    /// cloud. Every pixel of every image is compared in either case.
    pub full: bool,
}

/// The inputs that all areas share.
struct Common<'a> {
    ctx: &'a Context,
    layout: &'a Layout,
    manifest: &'a Manifest,
    labels: Option<&'a Labels>,
    views: &'a Views,
    photographs: &'a Photographs,
    files: &'a Files,
    full: bool,
    report: &'a Report,
}

/// Checks the data set in the folder `root`. Faults are not errors: the report has them.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) if no data set is there;
/// [`Error::Temporary`](crate::Error::Temporary) if faults are found while another process changes it;
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub fn verify(root: impl Into<PathBuf>, options: &VerifyOptions, ctx: &Context) -> Result<VerifyReport> {
    let layout = &Layout::new(root.into());
    if !layout.manifest().is_file() {
        return Err(UsageError::NoDataSet { folder: layout.root().to_owned() }.into());
    }
    let before = manifest_checksum(layout);
    let report = check_all(ctx, layout, options.full)?.finish();

    // Every change ends with a new manifest, and holds the lock until then.
    if report.fault_count() > 0 && (Lock::is_held(layout) || manifest_checksum(layout) != before) {
        let root = layout.root().display();
        let what = format!("{root}: another process changed it while it was checked: check it again later");
        return Err(TemporaryError::Changed { what }.into());
    }
    Ok(report)
}

fn manifest_checksum(layout: &Layout) -> Option<Checksum> {
    checksum_of_file(&layout.manifest()).ok().map(|(_, checksum)| checksum)
}

fn check_all(ctx: &Context, layout: &Layout, full: bool) -> Result<Report> {
    let report = Report::new(layout);
    let Some(manifest) = report.ok(Topic::Manifest, Manifest::read(layout)) else { return Ok(report) };

    // Whatever happens, the report tells what was found until then.
    let checked = catch_unwind(AssertUnwindSafe(|| check_content(ctx, layout, &manifest, full, &report)));
    match checked {
        Ok(result) => result?,
        Err(panic) => {
            let why = panic.downcast_ref::<String>().map(String::as_str);
            let why = why.or_else(|| panic.downcast_ref().copied()).unwrap_or("no message");
            report.fault(
                Topic::Files,
                BROKEN_OFF,
                layout.root(),
                format!("further checks were not made, because of a mistake in s3d; please report it: {why}"),
            );
        }
    }
    Ok(report)
}

fn check_content(
    ctx: &Context,
    layout: &Layout,
    manifest: &Manifest,
    full: bool,
    report: &Report,
) -> Result<()> {
    let change = report.ok(Topic::Manifest, Manifest::change_of(&layout.manifest()));
    if let Some(Some(message)) = change {
        report.fault(Topic::Manifest, "the checksum of the manifest", &layout.manifest(), message);
    }
    let files = Files::read(layout, manifest, report);
    let labels = Labels::read(layout, manifest, report);
    tables::conventions(layout, manifest, report);
    let views = Views::read(layout, manifest, report);
    let photographs = Photographs::read(layout, manifest, report);

    let common = Common {
        ctx,
        layout,
        manifest,
        labels: labels.as_ref(),
        views: &views,
        photographs: &photographs,
        files: &files,
        full,
        report,
    };

    let mut all = Vec::new();
    for &area in &manifest.area_numbers {
        let images = report
            .ok(Topic::Images, dataset_images(layout, area))
            .unwrap_or_default();
        check_area(&common, area, &images)?;
        all.extend(images);
    }

    // Checks that need the images of all areas.
    views.check_images(layout, manifest, &all, &photographs, report);
    tables::splits(layout, manifest, &all, report);
    tables::statistics(layout, manifest, report);
    files.check_rest(ctx, layout, manifest, report)
}

fn check_area(common: &Common<'_>, area: u32, images: &[DatasetImage]) -> Result<()> {
    let Common { layout, manifest, labels, report, .. } = *common;
    let instances = labels
        .filter(|_| manifest.is_labelled())
        .and_then(|labels| instances::check(layout, area, manifest, labels, report));
    if manifest.is_labelled() {
        tables::rooms(layout, area, manifest, labels, instances.as_deref(), report);
    }

    let mesh = labels.and_then(|labels| {
        mesh::read_and_check(layout, area, manifest, (labels, instances.as_deref()), report)
    });

    let (Some(labels), Some(mesh)) = (labels, &mesh) else {
        report.note(format!("area {area}: images were not held against the mesh, which cannot be used"));
        return check_images(common, area, images, None);
    };

    let scene = Scene::new(&mesh.file.mesh);
    let textures = MipMaps::new(&mesh.file.mesh);
    let mut pretty_of_face: Vec<[u8; 3]> = Vec::with_capacity(mesh.label_of_face.len());
    let mut class_of_face: Vec<u8> = Vec::with_capacity(mesh.label_of_face.len());
    for label in &mesh.label_of_face {
        let is_known = *label != NOT_IN_TABLE;
        pretty_of_face.push(if is_known { pretty_color(*label) } else { [0; 3] });
        class_of_face.push(labels.classes.get(*label as usize).copied().unwrap_or(NO_CLASS));
    }

    let mut curvature_of_face = Vec::new();
    if manifest.domains().contains(&Domain::PrincipalCurvature) {
        curvature_of_face = face_curvatures(&mesh.file.mesh);
    }

    // Colours that were not drawn from the mesh cannot be compared.
    let source = manifest.area(area).map_or("texture", |a| a.rgb.as_str());
    let domains = manifest.domains();
    if source != "texture" && domains.contains(&Domain::Rgb) {
        report.note(format!(
            "area {area}: the colours of its images come from pictures ({source}), which are not in the data \
             set; views were held against panoramas alone"
        ));
    }

    let photographs = common.photographs.count(area);
    if photographs > 0 && domains.contains(&Domain::Rgb) {
        report.note(format!(
            "area {area}: the colours of {photographs} photographs are their own, which are not in the data \
             set; they were \
             not compared"
        ));
    }

    if !domains.is_empty() && !domains.contains(&Domain::Pose) {
        report.note(format!("area {area}: images were not held against the mesh: they have no poses"));
    }

    let wants_objects = domains.contains(&Domain::Objects) && mesh.all_in_table;
    let meshes = if wants_objects {
        Some(instance_meshes(&mesh.file.mesh, &mesh.label_of_face))
    } else {
        None
    };
    let boxes = boxes_of_faces(&mesh.file.mesh, &mesh.label_of_face);
    if let Some(instances) = &instances {
        instances::check_surfaces(&layout.instances_json(area), instances, &boxes, report);
    }
    let label_of = |index| labels.label(index);
    let finder = meshes
        .as_ref()
        .map(|meshes| InstanceFinder::new(meshes, &mesh.label_of_face, &boxes, &label_of));

    let reference = Reference {
        layout,
        manifest,
        labels,
        mesh,
        channels: Channels {
            scene: &scene,
            textures: &textures,
            pictures: None,
            normals: manifest.options.normals,
            rgb_samples: manifest.options.rgb_samples,
            label_of_face: &mesh.label_of_face,
            pretty_of_face: &pretty_of_face,
            class_of_face: &class_of_face,
            curvature_of_face: &curvature_of_face,
            palette: &[],
            // Nothing is written.
            compression: Compression::default(),
            conventions: manifest.conventions(),
        },
        rgb_from_mesh: source == "texture",
        instances: finder.as_ref(),
        report,
    };
    check_images(common, area, images, Some((&reference, mesh, labels)))
}

/// One piece of the work of checking an area.
#[derive(Clone, Copy)]
enum CheckItem {
    Points,
    Image(usize),
}

/// Compares the manifest's counts of pixels without votes and without a label with the images, if all of them
/// could be read.
fn check_unlabelled(common: &Common<'_>, area: u32, images: &[DatasetImage], found: &UnlabelledPixels) {
    let UnlabelledPixels { images: read, without_votes, without_label } = found;
    let [read, without_votes, without_label] =
        [read, without_votes, without_label].map(|count| count.load(Ordering::Relaxed));
    let with_labels = images.iter().filter(|image| image.has(Domain::Semantic)).count() as u64;
    let told = common.manifest.area(area).and_then(|entry| entry.unlabelled);
    let Some(told) = told.filter(|_| read == with_labels) else { return };
    for (what, told, found) in [
        ("votes", told.without_votes.pixels, without_votes),
        ("a label", told.without_label.pixels, without_label),
    ] {
        let Some(told) = told else { continue };
        common.report.check(
            told == found,
            (Topic::Manifest, "pixels without a label"),
            &common.layout.manifest(),
            || format!("area {area}: {told} pixels without {what}, and images have {found}"),
        );
    }
}

fn check_images(
    common: &Common<'_>,
    area: u32,
    images: &[DatasetImage],
    reference: Option<(&Reference<'_>, &LabelledMesh, &Labels)>,
) -> Result<()> {
    let ctx = common.ctx;
    let Common { layout, manifest, labels, views, photographs, files, report, .. } = *common;
    let mismatches = Mutex::new(Vec::new());
    let cameras = Mutex::new(Vec::new());
    let view_colors = Mutex::new(Vec::new());
    let unlabelled = UnlabelledPixels::default();
    let domains = manifest.domains();
    let check = ImageCheck {
        layout,
        manifest,
        labels,
        views,
        photographs,
        files,
        reference: reference.map(|(reference, ..)| reference),
        report,
        domains: &domains,
        mismatches: &mismatches,
        view_colors: &view_colors,
        cameras: &cameras,
        unlabelled: &unlabelled,
    };

    let progress = ctx.progress("verifying", "images", images.len() as u64);
    let items: Vec<CheckItem> = std::iter::once(CheckItem::Points)
        .chain((0..images.len()).map(CheckItem::Image))
        .collect();

    for_each_in_order(
        ctx,
        &items,
        || Scratch::new(check.reference),
        |memory, item| {
            match *item {
                CheckItem::Points => {
                    if let Some((_, mesh, labels)) = reference {
                        points::check(common, area, mesh, labels)?;
                    }
                }
                CheckItem::Image(index) => {
                    check.check(index, &images[index], memory);
                    progress.add(1);
                }
            }
            Ok(())
        },
    )?;

    drop(progress);
    check_unlabelled(common, area, images, &unlabelled);
    let mut cameras = cameras.into_inner().unwrap_or_else(PoisonError::into_inner);
    cameras.sort_by_key(|(index, _)| *index);

    let view_colors = view_colors.into_inner().unwrap_or_else(PoisonError::into_inner);
    picture_colors::check(ctx, layout, images, &cameras, &view_colors, report)?;
    pairs::check(layout, area, images, &cameras, report);

    let Some((reference, ..)) = reference else { return Ok(()) };
    if manifest.is_labelled() {
        tables::location_rooms(ctx, reference, images, &cameras)?;
    }
    if common.full {
        scores::check(ctx, reference, area, images, &cameras, views)?;
    }

    diagnose_mismatches(
        ctx,
        reference,
        images,
        &cameras,
        mismatches.into_inner().unwrap_or_else(PoisonError::into_inner),
        photographs,
    )
}

/// Reports the files that differ from the mesh, with a guess at what is wrong with them.
fn diagnose_mismatches(
    ctx: &Context,
    reference: &Reference<'_>,
    images: &[DatasetImage],
    cameras: &[(usize, Camera)],
    mut mismatches: Vec<Mismatch>,
    photographs: &Photographs,
) -> Result<()> {
    let report = reference.report;
    mismatches.sort_by_key(|o| (o.domain, o.image));
    let mut looks: BTreeMap<Domain, usize> = BTreeMap::new();
    let chosen: Vec<bool> = mismatches
        .iter()
        .map(|o| {
            let n = looks.entry(o.domain).or_default();
            *n += 1;
            *n <= MAX_DIAGNOSES
        })
        .collect();

    let works: Vec<usize> = (0..mismatches.len()).collect();
    let guesses: Mutex<BTreeMap<usize, Vec<Option<String>>>> = Mutex::default();
    let progress = ctx.progress("looking again", "files", mismatches.len() as u64);
    for_each_in_order(
        ctx,
        &works,
        || (),
        |(), &i| {
            let o = &mismatches[i];
            let image = &images[o.image];
            let guess = if chosen[i] {
                images::diagnosis::diagnose(reference, images, cameras, o)
            } else {
                None
            };

            let mut sentence = o.difference.sentence("what the mesh shows there");
            if let Some(guess) = &guess {
                sentence += &format!("; {guess}");
            }

            let kind = o.domain.folder();
            report.fault(Topic::Rays, kind, &image.path(reference.layout, o.domain), sentence);
            let mut all = guesses.lock().unwrap_or_else(PoisonError::into_inner);
            all.entry(o.image).or_default().push(guess);
            progress.add(1);
            Ok(())
        },
    )?;

    // If all files of an image have the same diagnosis, its pose is wrong.
    for (image, guesses) in guesses.into_inner().unwrap_or_else(PoisonError::into_inner) {
        let image = &images[image];
        let rgb_from_mesh = reference.rgb_from_mesh && photographs.of(image).is_none();
        let files = image
            .domains
            .iter()
            .filter(|d| d.pixels().is_some() && (rgb_from_mesh || **d != Domain::Rgb));
        if let Some(Some(first)) = guesses.first()
            && guesses.len() == files.count()
            && guesses.iter().all(|g| g.as_ref() == Some(first))
        {
            let path = image.path(reference.layout, Domain::Pose);
            let message = format!(
                "all images of it differ from the mesh in the same way: {first}; is it the pose that is \
                 wrong?"
            );
            report.fault(Topic::Poses, "poses that do not fit their images", &path, message);
        }
    }

    Ok(())
}
