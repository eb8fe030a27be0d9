//! Depth of sequences whose frames are files side by side: 3RScan, BundleFusion and 7-Scenes.
//!
//! - 3RScan has `frame-000000.depth.pgm` and `_info.txt`, BundleFusion `frame-000000.depth.png` and
//!   `info.txt`. The pose is the colour camera's, with which the depth is aligned. Sources:
//!   WaldJohannaU/3RScan, FAQ.md; Dai et al., "BundleFusion", the page of its data.
//! - 7-Scenes has `frame-000000.depth.png` in millimetres, 65,535 where nothing was measured, and no
//!   intrinsics. Its documentation says that neither camera was calibrated, and that KinectFusion ran with
//!   focal lengths of 585 px and the principal point (320, 240). Source: Microsoft Research, "RGB-D Dataset
//!   7-Scenes".

use crate::camera::programs::sequence::{Info, find, info_of, read};
use crate::camera::{Distortion, Optics, PosedCamera};
use crate::error::Result;
use crate::fs::open::list_folder;
use crate::raw::depth::file::DepthPlace;
use crate::raw::depth::list::{Entry, Listed};
use crate::raw::form::RawForm;
use s3d_geom::glam::{DVec2, dvec2};
use std::path::{Path, PathBuf};

/// The ends of the names of depth pictures.
const DEPTHS: [&str; 2] = [".depth.pgm", ".depth.png"];

/// The number of 7-Scenes for nothing measured.
const SEVEN_SCENES_MISSING: u16 = 65_535;

/// The size of 7-Scenes' pictures, and the lens that its documentation has for them.
const SEVEN_SCENES: [u32; 2] = [640, 480];
const SEVEN_SCENES_FOCAL_PX: f64 = 585.0;

/// Returns the form of the sequence in a folder, if it has one with depth.
pub(super) fn form_of(dir: &Path) -> Result<Option<RawForm>> {
    for folder in folders(dir)? {
        let Some(files) = find(&folder)? else { continue };
        if !files.iter().any(|(_, pose)| depth_of(pose).is_some()) {
            continue;
        }
        return Ok(Some(match info_of(&files) {
            Some(_) => RawForm::Sequence,
            None => RawForm::SevenScenes,
        }));
    }
    Ok(None)
}

/// Returns the folders of sequences: `dir`, or the folders `seq-01`… in it, which have one frame in
/// 7-Scenes.
fn folders(dir: &Path) -> Result<Vec<PathBuf>> {
    if find(dir)?.is_some() {
        return Ok(vec![dir.to_owned()]);
    }
    let entries = list_folder(dir)?;
    let is_sequence = |path: &PathBuf| {
        let name = path.file_name().unwrap_or_default().to_string_lossy().into_owned();
        name.starts_with("seq-") && path.is_dir()
    };
    Ok(entries.into_iter().filter(is_sequence).collect())
}

/// Lists the pictures of a sequence, or of all sequences of a scene.
pub(super) fn list(dir: &Path, form: RawForm) -> Result<Listed> {
    let mut listed = Listed::new(form, dir.to_owned());
    let folders = folders(dir)?;
    let are_several = folders.len() > 1;
    for folder in folders {
        let before = match are_several {
            true => format!("{}/", folder.file_name().unwrap_or_default().to_string_lossy()),
            false => String::new(),
        };
        list_sequence(&folder, &before, &mut listed)?;
    }

    if form == RawForm::SevenScenes {
        listed.assumed_lens = Some(format!(
            "{}: has no file of intrinsics, and is taken for a sequence of 7-Scenes: focal lengths of \
             {SEVEN_SCENES_FOCAL_PX} px and the centre of 640 × 480 pixels, as its documentation has them",
            dir.display()
        ));
    }
    Ok(listed)
}

fn list_sequence(folder: &Path, before: &str, listed: &mut Listed) -> Result<()> {
    let Some(poses) = find(folder)? else { return Ok(()) };
    let info = info_of(&poses).map(|path| Info::read(&path)).transpose()?;
    let with_depth = poses.iter().filter(|(_, pose)| depth_of(pose).is_some()).count();
    let folder_of_poses = poses.first().and_then(|(_, pose)| pose.parent().map(Path::to_owned));
    let (cameras, unknown, files) = read(poses)?;
    listed.files.extend(files);

    let is_seven_scenes = listed.form == RawForm::SevenScenes;
    let mut found = 0;
    for color in cameras {
        let pose = folder_of_poses
            .as_deref()
            .unwrap_or(folder)
            .join(format!("{}.pose.txt", color.name));
        let Some(depth) = depth_of(&pose) else {
            listed.unpictured += 1;
            continue;
        };
        found += 1;
        let entry = match (&info, is_seven_scenes) {
            (Some(info), _) => of_info(color, depth, info),
            (None, true) => of_seven_scenes(color, depth)?,
            (None, false) => super::in_millimetres(color, depth),
        };
        let name = format!("{before}{}", entry.camera.name);
        let camera = PosedCamera { name, ..entry.camera };
        listed.entries.push(Entry { camera, ..entry });
    }
    listed.untracked += with_depth.saturating_sub(found).min(unknown);
    Ok(())
}

/// Returns the depth picture of the frame with this pose.
fn depth_of(pose: &Path) -> Option<PathBuf> {
    let name = pose.file_name()?.to_str()?.strip_suffix(".pose.txt")?;
    DEPTHS
        .iter()
        .map(|ending| pose.with_file_name(format!("{name}{ending}")))
        .find(|path| path.is_file())
}

/// Returns the entry of a frame with a file of intrinsics.
fn of_info(color: PosedCamera, depth: PathBuf, info: &Info) -> Entry {
    let mut camera = color.clone();
    if info.depth_optics.is_some() {
        camera.size = info.depth_size;
        camera.optics = info.depth_optics;
    }
    let entry = super::in_millimetres(camera, depth);
    let unit_m = info.depth_scale.map_or(entry.unit_m, |scale| 1.0 / scale);
    Entry { color: Some(color), unit_m, ..entry }
}

/// Returns the entry of a frame of 7-Scenes. Its colour pictures are not aligned with the depth, but nearly.
/// Pictures of another size are another sensor's, whose lens is not known.
fn of_seven_scenes(color: PosedCamera, depth: PathBuf) -> Result<Entry> {
    let place = DepthPlace::File(depth);
    let size = place.size()?;
    let [width, height] = SEVEN_SCENES.map(f64::from);
    let optics = (size == SEVEN_SCENES).then(|| Optics::Pinhole {
        focal_px: DVec2::splat(SEVEN_SCENES_FOCAL_PX),
        center_px: Some(0.5 * dvec2(width, height)),
        distortion: Distortion::None,
    });
    let color = PosedCamera { size: Some(size), optics, ..color };
    Ok(Entry {
        camera: color.clone(),
        place,
        unit_m: super::MILLIMETRE,
        missing: Some(SEVEN_SCENES_MISSING),
        confidence: None,
        color: Some(color),
    })
}
