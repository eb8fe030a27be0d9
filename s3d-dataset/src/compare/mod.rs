//! Compares two data sets, first by their lists of files, then by their contents.
//!
//! Areas are matched by number, scan locations by uuid, views by their number among the candidates of their
//! location, classes by name, instances by the surface that they share. Files with the same bytes in both
//! lists are not read, except label images whose indices differ in meaning. Unreadable files are reported,
//! and the rest is compared.

pub(crate) mod comparison;
mod faces;
mod files;
mod images;
mod instances;
mod lines;
mod matching;
mod names;
mod pixels;
mod poses;
mod sides;
mod text;
mod views;

pub use comparison::{
    AreaChanges, ChangedPatch, ClassPair, ClassPixels, ComparedSet, Comparison, FaceChange, FileKindChanges,
    Geometry, ImageChange, InputChange, InstanceChange, InstanceChangeKind, LabelChanges, LabelCounts,
    LocationName, ModalityChanges, PixelChanges, PoseChange, PoseChanges, RenamedInstance, SettingChange,
    Side, UnreadFile, ViewChanges, ViewName,
};

use crate::context::Context;
use crate::error::Result;
use comparison::LabelPairs;
use images::Images;
use names::Names;
use s3d_io::dataset::Domain;
use sides::{Sides, about};
use std::path::Path;

/// How two data sets are compared.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CompareOptions {
    /// Also read every file of both data sets and compare it with its checksum. Otherwise all sizes are
    /// compared, and the checksums of the files that are read.
    pub full: bool,
}

/// Compares the two data sets in the folders `a` and `b`. Neither is changed.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) if one is not there; [`Error::File`](crate::Error::File) if one is
/// not complete, or its manifest, list of files or conventions are damaged;
/// [`Error::Cancelled`](crate::Error::Cancelled). Other missing or damaged files are not errors:
/// [`Comparison::unread`] has them.
pub fn compare(a: &Path, b: &Path, options: &CompareOptions, ctx: &Context) -> Result<Comparison> {
    let sides = Sides::open(a, b)?;
    files::check(&sides, options.full, ctx)?;
    let (settings, inputs) = files::made(&sides)?;
    let files = files::changes(&sides);

    let mut names = Names::read(&sides)?;
    let mut pairs = LabelPairs::new();
    let areas = faces::compare(&sides, names.as_mut(), &mut pairs, ctx)?;
    let views = views::compare(&sides)?;
    let images = images::compare_all(&sides, &views, names.as_ref(), &mut pairs, ctx)?;

    let mut notes = notes(&sides, &images);
    notes.extend(areas.iter().filter(|of| of.geometry == Geometry::Other).map(by_place));

    let same = files.iter().all(|kind| kind.changed + kind.only_a + kind.only_b == 0);
    let about_a = about(a, &sides.a);
    let about_b = about(b, &sides.b);
    let unread = sides.into_unread();

    Ok(Comparison {
        equal: same && unread.is_empty(),
        full: options.full,
        a: about_a,
        b: about_b,
        settings,
        inputs,
        files,
        areas,
        labels: names.map(|names| names.changes(&pairs)),
        views: views.changes,
        modalities: images.modalities,
        images: images.changed,
        poses: images.poses,
        notes,
        unread,
    })
}

/// The note on an area whose meshes differ.
fn by_place(of: &AreaChanges) -> String {
    let alone = [("A", of.m2_only_a), ("B", of.m2_only_b)]
        .map(|(name, m2)| format!("{} m² of {name}", lines::significant(m2)));
    let [a, b] = alone;
    format!(
        "area {}: the meshes differ; faces were compared by place, and {a} and {b} are over 10 cm from the \
         other mesh",
        of.area
    )
}

/// Notes on what was not compared, or only together with something else.
fn notes(sides: &Sides, images: &Images) -> Vec<String> {
    let mut notes = Vec::new();
    for (name, side, other) in [("A", &sides.a, &sides.b), ("B", &sides.b, &sides.a)] {
        let alone: Vec<String> = side
            .areas()
            .iter()
            .filter(|area| !other.areas().contains(area))
            .map(u32::to_string)
            .collect();
        if !alone.is_empty() {
            notes.push(format!("only {name} has area {}", alone.join(", ")));
        }
        if side.taxonomy().is_some() && other.taxonomy().is_none() {
            notes.push(format!("only {name} has labels"));
        }
    }

    if let (Some(a), Some(b)) = (sides.a.taxonomy(), sides.b.taxonomy())
        && a.definition() != b.definition()
    {
        let a = a.name();
        let b = b.name();
        notes.push(format!("classes are those of {a} in A and of {b} in B; they were compared by name"));
    }

    let forms = [sides.a.options().conventions(), sides.b.options().conventions()];
    let other_forms = images.modalities.iter().filter(|of| of.other_form > 0);
    let [has_other_depth, has_other_normals] = [Domain::Depth, Domain::Normal]
        .map(|domain| other_forms.clone().any(|of| of.modality == domain.folder()));
    if has_other_depth && forms[0].depth_units != forms[1].depth_units {
        let [a, b] = forms.map(|form| form.depth_units);
        notes.push(format!("depth is in units of {a} in A and {b} in B; its pixels were not compared"));
    }
    if has_other_normals && forms[0].normal_axes != forms[1].normal_axes {
        let [a, b] = forms.map(|form| form.normal_axes.name());
        notes.push(format!("normals have the axes {a} in A and {b} in B; their pixels were not compared"));
    }

    if images.without_poses > 0 {
        let images = images.without_poses;
        notes.push(format!(
            "{images} images have no poses in both; those of the same name among their location's images \
             were taken to see the same"
        ));
    }

    notes
}
