//! Images of numbers, one a photograph or a view: their pixels vote for the faces that they see.

mod join;
mod meaning;
mod view;

use super::names::ClassNames;
use super::{Key, Target};
use join::Instances;
use meaning::{Meaning, Numbers};
use s3d_dataset::parallel::map_in_order;
use s3d_dataset::{Context, Result};
use s3d_io::Error as FileError;
use s3d_label::Class;
use s3d_render::{Caster, Hits, NO_FACE, Scene};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};
use view::{Mask, numbers_of};

/// Images whose votes are in memory at once.
const AT_ONCE: usize = 64;

/// What a picture says of a face: the number that most of its pixels have there, and how many these are.
struct Seen {
    face: u32,
    number: u32,
    pixels: u32,
}

/// Returns what each face belongs to by the images of a folder; `None` if it is no folder of images.
///
/// # Errors
/// [`FileError`] for images without a camera, of another size than their photograph, or that are no numbers,
/// and for the first number without a meaning.
pub(super) fn keys(
    folder: &Path,
    target: &Target<'_>,
    names: &ClassNames<'_>,
    ctx: &Context,
) -> Result<Option<Vec<Option<Key>>>> {
    let Some(masks) = find(folder, target, ctx)? else { return Ok(None) };
    let shown = folder.display();
    ctx.info(format_args!("{shown}: the pixels of {} images vote for the faces that they see", masks.len()));

    let mut classes: HashMap<(u32, Class), u32> = HashMap::new();
    let mut instances = Instances::new(target.mesh);
    let progress = ctx.progress("looking at masks", "images", masks.len() as u64);
    let scene = Scene::new(target.mesh);
    for some in masks.chunks(AT_ONCE) {
        let memory = || (Caster::new(&scene), Hits::default());
        let seen = map_in_order(ctx, some, memory, |(caster, hits), mask| {
            let seen = votes(mask, target, caster, hits)?;
            progress.add(1);
            Ok(seen)
        })?;

        // One after another, so that the result does not depend on threads.
        for (mask, seen) in some.iter().zip(seen) {
            let meanings = Numbers::of(mask.path(), names)?;
            let mut of_instances: BTreeMap<(Class, u32), Vec<(u32, u32)>> = BTreeMap::new();
            let mut visible = Vec::new();
            for Seen { face, number, pixels } in seen {
                visible.push(face);
                match meanings.of_number(number)? {
                    Meaning::Nothing => {}
                    Meaning::Class(class) => *classes.entry((face, class)).or_insert(0) += pixels,
                    Meaning::Instance(class) => {
                        of_instances.entry((class, number)).or_default().push((face, pixels));
                    }
                }
            }
            if meanings.have_instances() {
                instances.add(&visible, of_instances);
            }
        }
    }
    Ok(Some(winners(target.mesh.faces().len(), classes, instances)))
}

/// Returns what has most pixels on each face: a class, or an instance. Of equals it is the class, then the
/// first.
fn winners(faces: usize, classes: HashMap<(u32, Class), u32>, instances: Instances<'_>) -> Vec<Option<Key>> {
    let of_classes = classes
        .into_iter()
        .map(|((face, class), pixels)| (face, (class, None), pixels));
    let mut votes: Vec<(u32, Key, u32)> = of_classes.chain(instances.finish()).collect();
    votes.sort_unstable_by_key(|(face, (class, instance), _)| (*face, *instance, class.index()));

    let mut best: Vec<Option<(Key, u32)>> = vec![None; faces];
    for (face, key, pixels) in votes {
        if let Some(best) = best.get_mut(face as usize)
            && best.is_none_or(|(_, most)| pixels > most)
        {
            *best = Some((key, pixels));
        }
    }
    best.into_iter().map(|best| best.map(|(key, _)| key)).collect()
}

/// Casts the camera of an image, and counts the numbers of the pixels that see each face.
fn votes(
    mask: &Mask<'_>,
    target: &Target<'_>,
    caster: &mut Caster<'_, '_>,
    hits: &mut Hits,
) -> Result<Vec<Seen>> {
    let image = numbers_of(mask.path())?;
    let view = mask.view([image.width(), image.height()], target.offset_m)?;
    caster.cast_into(&view.camera, 1, hits);

    let mut pixels: Vec<(u32, u32)> = Vec::new();
    for (j, row) in (0u32..).zip(hits.face.rows()) {
        for (i, face) in (0u32..).zip(row).filter(|(_, face)| **face != NO_FACE) {
            if let Some([x, y]) = view.pixel(i, j) {
                pixels.push((*face, image.at(x, y)));
            }
        }
    }
    pixels.sort_unstable();

    let mut seen: Vec<Seen> = Vec::new();
    for same in pixels.chunk_by(|a, b| a == b) {
        let Some(&(face, number)) = same.first() else { continue };
        let found = Seen { face, number, pixels: same.len() as u32 };
        match seen.last_mut() {
            Some(last) if last.face == face => {
                if found.pixels > last.pixels {
                    *last = found;
                }
            }
            _ => seen.push(found),
        }
    }
    Ok(seen)
}

/// Finds the images of a folder and their cameras: those of the scene's photographs, and those of pose files
/// in the folder `pose` beside it.
fn find<'t>(folder: &Path, target: &'t Target<'_>, ctx: &Context) -> Result<Option<Vec<Mask<'t>>>> {
    if !folder.is_dir() {
        return Ok(None);
    }
    let mut masks: Vec<Mask<'t>> = Vec::new();
    for photograph in &target.photographs {
        let is_image = |path: &PathBuf| is_png(path) && path.is_file();
        if let Some(path) = photograph.named_in(folder).into_iter().find(is_image) {
            masks.push(Mask::of_photograph(path, *photograph));
        }
    }

    let entries = std::fs::read_dir(folder).map_err(|e| FileError::io(folder, "read the folder", e))?;
    let mut files = Vec::new();
    for entry in entries {
        files.push(entry.map_err(|e| FileError::io(folder, "read the folder", e))?.path());
    }
    files.sort();
    let mut images: Vec<&PathBuf> = files.iter().filter(|path| is_png(path)).collect();
    images.retain(|path| !masks.iter().any(|mask| mask.path() == path.as_path()));
    let mut without = Vec::new();
    for path in images {
        match Mask::of_pose_file(path) {
            Some(mask) => masks.push(mask),
            None => without.push(path),
        }
    }

    let Some(first) = without.first() else { return Ok((!masks.is_empty()).then_some(masks)) };
    let what = "has the name of no photograph of [frames], and there is no pose file of it in the folder \
                pose beside its own";
    if masks.is_empty() {
        // Folders of other kinds hold images, too.
        let is_plain =
            |path: &PathBuf| is_png(path) || path.extension().is_some_and(|e| e == "json" || e == "csv");
        return match files.iter().all(is_plain) {
            true => Err(FileError::format(first, what).into()),
            false => Ok(None),
        };
    }
    ctx.warn(format_args!(
        "{}: {} images do not vote: {} {what}",
        folder.display(),
        without.len(),
        first.file_name().unwrap_or_default().display()
    ));
    Ok(Some(masks))
}

fn is_png(path: &Path) -> bool {
    path.extension()
        .is_some_and(|ending| ending.eq_ignore_ascii_case("png"))
}
