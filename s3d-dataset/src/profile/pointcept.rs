//! Pointcept: the S3DIS tree as its preprocessing expects it.
//!
//! `preprocess_s3dis.py --splits Area_1 Area_2 … --dataset_root profiles/pointcept` reads
//! `Area_k/Area_k_alignmentAngle.txt` of each named area with `numpy.loadtxt`. For every room in that file it
//! reads all `Area_k/ROOM/Annotations/*.txt`, also with `numpy.loadtxt`. So it stops
//! - at an area without an angle file: areas 1 to 6 that are not in the data set get a file without rooms
//!   (versions up to 1.5.1 read all six);
//! - at an angle file with one room, since its two words are not read as a table: the room is named twice,
//!   and processed twice with the same result;
//! - at a room of the angle file without points: the room is left out;
//! - at an instance of one point, whose numbers are not read as a table: the point is written twice.
//!
//! All other files are second names of the files in `s3dis/` (copies if the file system has no hard links).
//!
//! For normals, `--parse_normal --raw_root profiles/pointcept/raw`, it reads `Area_k/3d/rgb.obj` (`area_k` up
//! to version 1.5.1). For area 5 it reads `Area_5a` and `Area_5b`, and moves 5b. Area 5 of a data set is in
//! one frame already and comes as `Area_5a` alone.

use super::room::{TreeRoom, count_and_min};
use super::{AREAS_OF_LOADERS, Source, write_lines};
use crate::error::Result;
use s3d_io::Error as FileError;
use s3d_io::fs::{create_dir, write_bytes};
use std::collections::BTreeMap;
use std::path::Path;

/// Writes the tree.
pub(super) fn write(source: &Source<'_>, dir: &Path, areas: &[u32], rooms: &[TreeRoom]) -> Result<()> {
    let ctx = source.ctx;
    for area in areas.iter().filter(|a| !AREAS_OF_LOADERS.contains(*a)) {
        ctx.warn(format_args!("area {area}: Pointcept's preprocessing reads areas 1 to 6 only"));
    }

    for area in AREAS_OF_LOADERS {
        let tree = dir.join(format!("Area_{area}"));
        create_dir(&tree)?;
        let mut named = Vec::new();
        if areas.contains(&area) {
            let angles = read_angles(source, area)?;
            for room in rooms.iter().filter(|r| r.area == area) {
                write_room(source, &tree.join(&room.name), room)?;
                named.push(format!("{} {}", room.name, angles.get(&room.name).map_or("0", String::as_str)));
            }
            link_mesh(source, area, &dir.join("raw"))?;
        }

        if let [only] = &named[..] {
            ctx.warn(format_args!(
                "area {area} has one room: Pointcept's preprocessing stops at such an area, so its angle \
                 file in {} names the room twice",
                dir.display()
            ));
            named.push(only.clone());
        }

        let header = [
            format!("## Global alignment angle per disjoint space in Area_{area} ##"),
            "## Disjoint Space Name Global Alignment Angle ##".to_owned(),
        ];
        write_lines(&tree.join(format!("Area_{area}_alignmentAngle.txt")), header.into_iter().chain(named))?;
    }
    Ok(())
}

/// Returns the angle of each room, as it is written in the tree.
fn read_angles(source: &Source<'_>, area: u32) -> Result<BTreeMap<String, String>> {
    let path = source
        .layout
        .s3dis_area_dir(area)
        .join(format!("Area_{area}_alignmentAngle.txt"));
    let text = String::from_utf8(source.files.read_bytes(&path)?)
        .map_err(|_| FileError::format(&path, "is no text in UTF-8"))?;
    let lines = text.lines().filter(|line| !line.starts_with('#'));
    Ok(lines
        .filter_map(|l| l.split_once(' '))
        .map(|(room, deg)| (room.into(), deg.into()))
        .collect())
}

fn write_room(source: &Source<'_>, dir: &Path, room: &TreeRoom) -> Result<()> {
    create_dir(&dir.join("Annotations"))?;
    let name = format!("{}.txt", room.name);
    source.link(&source.layout.s3dis_area_dir(room.area).join(&room.name).join(&name), &dir.join(&name))?;
    for instance in &room.instances {
        let to = dir.join("Annotations").join(&instance.name);
        // One line has at most some hundred bytes, so larger files have more points.
        let size = source.files.bytes(&instance.path)?;
        if size < 1024 && count_and_min(source, &instance.path)?.0 == 1 {
            let line = source.files.read_bytes(&instance.path)?;
            write_bytes(&to, &line.repeat(2))?;
        } else {
            source.link(&instance.path, &to)?;
        }
    }
    Ok(())
}

/// Links the mesh of an area, with its materials and textures, to where the preprocessing looks for it.
fn link_mesh(source: &Source<'_>, area: u32, raw: &Path) -> Result<()> {
    let from = source.layout.mesh_dir(area);
    let name = if area == 5 {
        "Area_5a".to_owned()
    } else {
        format!("Area_{area}")
    };
    let to = raw.join(name).join("3d");
    create_dir(&to)?;
    let textures = from.join("rgb_textures");
    for path in source.files.below(&from) {
        let Ok(below) = path.strip_prefix(&from) else { continue };
        if path.starts_with(&textures) {
            create_dir(&to.join("rgb_textures"))?;
        } else if below != Path::new("rgb.obj") && below != Path::new("rgb.mtl") {
            continue;
        }
        source.link(&path, &to.join(below))?;
    }
    Ok(())
}
