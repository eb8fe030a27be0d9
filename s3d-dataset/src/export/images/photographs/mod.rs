//! Views of photographs: their own colours, and what the mesh shows from where they were taken.

pub(crate) mod agreement;

use crate::condition::Condition;
use crate::context::Context;
use crate::error::Result;
use crate::export::images::bundle::UnitBundle;
use crate::export::images::{ImageJob, ImageWriter, Memory, count};
use crate::export::input::photographs::{Photograph, Photographs};
use crate::export::location::room_name;
use crate::export::modality::picture_colors::PictureColors;
use crate::export::modality::{Channels, Image};
use crate::record::journal::PhotographDone;
use crate::summary::{ImageTally, UnitTally};
use crate::useful::{judge_of, poses_findings};
use agreement::Agreement;
use rayon::prelude::*;
use s3d_geom::Aabb;
use s3d_io::dataset::{Domain, Frame, PhotographRecord};
use s3d_label::Room;
use s3d_render::{Caster, Hits, NO_FACE, Scene};
use std::time::Instant;

/// A photograph whose view is to be written.
pub(crate) struct Shot<'a> {
    pub(crate) photograph: &'a Photograph,
    /// The room it was taken in; `None` if rooms are not known.
    pub(crate) room: Option<Room>,
}

/// A photograph whose files are all written, and when the first was begun.
pub(crate) struct WrittenPhotograph {
    pub(crate) done: PhotographDone,
    pub(crate) started: Instant,
}

/// Refuses photographs if none of them sees the mesh, and warns if some do not.
pub(crate) fn judge_sight(
    ctx: &Context,
    photographs: &Photographs,
    scene: &Scene<'_>,
    allow: &[Condition],
) -> Result<()> {
    /// Pixels that are looked at along the width.
    const ACROSS: u32 = 48;
    let see = photographs.all.par_iter().map_init(
        || (Caster::new(scene), Hits::default()),
        |(caster, hits), photograph| {
            let camera = &photograph.camera;
            caster.cast_into(camera, (camera.width / ACROSS).max(1), hits);
            u64::from(hits.face.pixels().iter().all(|face| *face == NO_FACE))
        },
    );

    let blind: u64 = see.sum();
    let all = photographs.all.len() as u64;

    let places = Aabb::from_points(photographs.all.iter().map(|p| p.camera.pose.location.as_vec3()));
    let hint = "up and transform under [frames]";
    let findings = poses_findings(blind, all, &places, &scene.mesh().aabb(), hint);
    judge_of(("the photographs", "take them"), ctx, &findings, allow)
}

/// Writes the files of a photograph's view.
pub(crate) fn write_photograph(
    job: &ImageJob<'_>,
    shot: &Shot<'_>,
    memory: &mut Memory<'_>,
) -> Result<WrittenPhotograph> {
    let started = Instant::now();
    let Memory { caster, hits, buffers, objects } = memory;
    let Shot { photograph, room } = shot;
    let Photograph { name, uuid, taken, camera, .. } = photograph;
    let room = room_name(*room);
    let frame = taken.frame();
    let bundle = job.is_bundled.then(|| UnitBundle::new(job.layout, job.area, uuid));
    let writer = ImageWriter { job, uuid, room: &room, frame, bundle: bundle.as_ref() };

    let images: Vec<Image> = job.modalities.iter().filter_map(|&domain| Image::of(domain)).collect();
    let mut of_image = ImageTally { images: 1, ..ImageTally::default() };
    let mut files = Vec::new();
    let mut agreement = Agreement::default();
    let mut masked = 0.0;
    let mut seen = 0.0;

    // Poses alone need no photograph.
    if !images.is_empty() || job.instances.is_some() {
        let picture = photograph.read()?;
        agreement = Agreement::of(&picture, photograph, job.channels.scene, job.channels.textures);
        let colors = photograph.colors(&picture, camera);
        drop(picture);
        caster.cast_into(camera, 1, hits);

        let channels = Channels { pictures: Some(PictureColors::Photograph(&colors)), ..job.channels };
        files = channels
            .encode(&images, hits, camera, buffers, |image, file| writer.write(image.domain(), &file))?;
        files.extend(writer.write_objects(objects, hits, camera)?);

        let pixels = count(job, &images, hits, buffers);
        let black = colors.pixels().iter().filter(|color| **color == [0; 3]).count();
        masked = black as f64 / colors.len() as f64;
        seen = 1.0 - pixels.pixels_missing as f64 / colors.len() as f64;
        of_image += pixels;
    }

    if job.modalities.contains(&Domain::Pose) {
        files.push(writer.write_pose(camera, &camera.pose)?);
    }

    files.sort();
    let none = ImageTally::default();
    let is_panorama = frame == Frame::Panorama;
    let tally = UnitTally {
        files: files.len() as u64,
        bytes: files.iter().map(|f| f.bytes).sum(),
        panoramas: if is_panorama { of_image } else { none },
        views: if is_panorama { none } else { of_image },
    };
    if let Some(bundle) = &bundle {
        files = bundle.finish()?;
    }

    let record = PhotographRecord {
        camera_uuid: uuid.clone(),
        name: name.clone(),
        room,
        width: camera.width,
        height: camera.height,
        masked: rounded(masked),
        seen: rounded(seen),
        agreement: agreement.correlation.map(rounded),
        chance: agreement.chance.map(rounded),
        panorama: is_panorama,
    };
    Ok(WrittenPhotograph { done: PhotographDone { area: job.area, record, tally, files }, started })
}

/// Rounds to the sixth digit, so that the last bits of a sum do not show.
fn rounded(value: f64) -> f64 {
    (value * 1e6).round() / 1e6
}

/// Returns what is doubtful about the masks and poses of an area's photographs, a sentence each.
pub(crate) fn doubts(area: u32, records: &[&PhotographRecord]) -> Vec<String> {
    let mut doubts: Vec<String> = mask_doubt(area, records).into_iter().collect();
    doubts.extend(agreement_doubt(area, records));
    doubts
}

/// Returns a sentence if photographs fill little of their views.
fn mask_doubt(area: u32, records: &[&PhotographRecord]) -> Option<String> {
    let count = records.iter().filter(|r| r.masked > 0.5).count();
    let worst = records
        .iter()
        .max_by(|a, b| a.masked.total_cmp(&b.masked))
        .filter(|_| count > 0)?;
    Some(format!(
        "area {area}: {count} of {} photographs fill less than half of their views, {} {:.0} %: are focal \
         lengths and \
         distortion those of the lens?",
        records.len(),
        worst.name,
        100.0 * (1.0 - worst.masked)
    ))
}

/// Returns a sentence if the edges of photographs and mesh show that poses do not fit.
fn agreement_doubt(area: u32, records: &[&PhotographRecord]) -> Option<String> {
    let mut known: Vec<(f64, f64, &str)> = records
        .iter()
        .filter_map(|r| Some((r.agreement?, r.chance.unwrap_or(0.0), r.name.as_str())))
        .collect();
    known.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.2.cmp(b.2)));

    let &(median, of_chance, _) = known.get(known.len() / 2)?;
    if Agreement::is_chance(median, of_chance) {
        return Some(format!(
            "area {area}: photographs and mesh agree no more than by chance: the median correlation of \
             their edges is \
             {median:.2}, and {of_chance:.2} where the two are displaced. Are the poses in the mesh's \
             frame, is a matrix \
             transposed, or camera axes exchanged? frames.json has each one's"
        ));
    }

    let bad: Vec<&(f64, f64, &str)> = known.iter().filter(|(a, c, _)| Agreement::is_chance(*a, *c)).collect();
    let named: Vec<String> = bad
        .iter()
        .take(3)
        .map(|(a, _, name)| format!("{name} ({a:.2})"))
        .collect();
    if bad.is_empty() {
        return None;
    }
    Some(format!(
        "area {area}: {} of {} photographs agree with the mesh no more than by chance, the worst {}; the \
         median correlation \
         of edges is {median:.2}. frames.json has each one's",
        bad.len(),
        known.len(),
        named.join(", ")
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn record(name: &str, agreement: Option<f64>) -> PhotographRecord {
        PhotographRecord {
            camera_uuid: "a".into(),
            name: name.into(),
            room: "unknown_1".into(),
            width: 8,
            height: 8,
            masked: 0.0,
            seen: 1.0,
            agreement,
            chance: Some(0.1),
            panorama: false,
        }
    }

    /// Returns the doubts about photographs that agree with the mesh as well as `scores` say.
    fn doubts_of(scores: &[Option<f64>]) -> Vec<String> {
        let records: Vec<_> = scores
            .iter()
            .zip(1..)
            .map(|(s, i)| record(&format!("{i}.jpg"), *s))
            .collect();
        doubts(3, &records.iter().collect::<Vec<_>>())
    }

    #[test]
    fn a_few_bad_poses_are_named_and_many_are_told_as_one() {
        assert!(
            doubts_of(&[]).is_empty()
                && doubts_of(&[None]).is_empty()
                && doubts_of(&[Some(0.5), Some(0.4), None]).is_empty()
        );
        let some = doubts_of(&[Some(0.5), Some(0.12), Some(0.4), Some(0.6)]);
        assert!(
            some[0].contains("1 of 4 photographs") && some[0].contains("the worst 2.jpg (0.12)"),
            "{some:?}"
        );

        let masked = PhotographRecord { masked: 0.75, ..record("m.jpg", Some(0.5)) };
        let of_mask = doubts(3, &[&record("a.jpg", Some(0.5)), &masked]);
        assert!(of_mask[0].contains("1 of 2 photographs fill less than half of their views, m.jpg 25 %"));

        let most = doubts_of(&[Some(0.5), Some(0.12), Some(0.0)]);
        assert!(
            most[0].contains("no more than by chance: the median") && most[0].contains("0.12"),
            "{most:?}"
        );
    }
}
