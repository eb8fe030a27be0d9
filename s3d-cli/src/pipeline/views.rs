//! Which views are taken: candidates at every location, their entropies, the selection, and their numbers.

use super::work::for_each_in_order;
use crate::console::Progress;
use crate::failure::Outcome;
use s3d_geom::Camera;
use s3d_io::ScanLocation;
use s3d_label::{Class, LabelId, LabelTable};
use s3d_render::{Caster, Hits, NO_FACE, Scene};
use s3d_sample::{Pool, PoolItem, Selection, View, ViewDistribution, draw_view, entropy, select_pooled};
use serde::Serialize;
use std::sync::OnceLock;

/// A candidate view of a scan location.
#[derive(Clone, Debug, Serialize)]
pub(crate) struct Candidate {
    /// Number of its area.
    #[serde(skip)]
    pub(crate) area: u32,
    /// Index of its location in the area's camera table.
    #[serde(skip)]
    pub(crate) location: usize,
    pub(crate) camera_uuid: String,
    /// From 0: what its draw is keyed by.
    pub(crate) candidate: u32,
    pub(crate) yaw_rad: f64,
    pub(crate) pitch_rad: f64,
    pub(crate) fov_rad: f64,
    /// Shannon entropy of the classes of its pixels, nats.
    pub(crate) entropy: f64,
    /// The number in its files' names, if it is kept: kept views of a location count from 0.
    pub(crate) frame_num: Option<u32>,
}

impl Candidate {
    /// The camera that takes it, `size` × `size` pixels.
    pub(crate) fn camera(&self, location: &ScanLocation, size: u32) -> Camera {
        let pose = location.pose.turned(self.yaw_rad, self.pitch_rad);
        Camera::perspective(pose, self.fov_rad, size, size)
    }
}

/// How candidates are drawn and scored.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scoring {
    /// Candidates a location.
    pub(crate) views: u32,
    /// Image size in pixels.
    pub(crate) size: u32,
    /// Every which pixel of both axes is looked at.
    pub(crate) stride: u32,
    pub(crate) seed: u64,
}

/// Draws the candidates of an area and scores each by the entropy of what it sees.
pub(crate) fn score_area(
    area: u32,
    locations: &[ScanLocation],
    scene: &Scene<'_>,
    face_labels: &[LabelId],
    table: &LabelTable,
    scoring: Scoring,
) -> Outcome<Vec<Candidate>> {
    let distribution = ViewDistribution::default();
    let mut candidates = Vec::with_capacity(locations.len() * scoring.views as usize);
    for (index, location) in locations.iter().enumerate() {
        for candidate in 0..scoring.views {
            let View { yaw_rad, pitch_rad, fov_rad } =
                draw_view(&distribution, scoring.seed, &location.uuid, candidate);
            let camera_uuid = location.uuid.clone();
            candidates.push(Candidate {
                area,
                location: index,
                camera_uuid,
                candidate,
                yaw_rad,
                pitch_rad,
                fov_rad,
                entropy: 0.0,
                frame_num: None,
            });
        }
    }
    let classes: Vec<Option<Class>> = face_labels.iter().map(|l| table.class_of(*l)).collect();
    let progress = Progress::new("scoring", "views", candidates.len() as u64);
    let scores: Vec<OnceLock<f64>> = candidates.iter().map(|_| OnceLock::new()).collect();
    let items: Vec<usize> = (0..candidates.len()).collect();
    let memory = || (Caster::new(scene), Hits::default());
    for_each_in_order(&items, memory, |(caster, hits), &i| {
        let c = &candidates[i];
        let camera = c.camera(&locations[c.location], scoring.size);
        caster.cast_into(&camera, scoring.stride, hits);
        let mut histogram = [0u64; 13];
        for &face in hits.face.pixels() {
            if face != NO_FACE
                && let Some(class) = classes[face as usize]
            {
                histogram[class.index()] += 1;
            }
        }
        let _ = scores[i].set(entropy(&histogram));
        progress.add(1);
        Ok(())
    })?;
    for (c, score) in candidates.iter_mut().zip(scores) {
        c.entropy = score.into_inner().unwrap_or(0.0);
    }
    Ok(candidates)
}

/// Selects views over the pool, or all of them, and numbers the kept ones of each location from 0.
pub(crate) fn select(candidates: &mut [Candidate], pool: Pool, keep_all: bool, seed: u64) {
    let kept = if keep_all {
        vec![true; candidates.len()]
    } else {
        let items: Vec<PoolItem<'_>> = candidates
            .iter()
            .map(|c| PoolItem { area: c.area, location: &c.camera_uuid, view: c.candidate, score: c.entropy })
            .collect();
        select_pooled(&items, pool, &Selection::default(), seed)
    };
    let mut of_location = (u32::MAX, usize::MAX);
    let mut next = 0;
    for (c, kept) in candidates.iter_mut().zip(kept) {
        if of_location != (c.area, c.location) {
            of_location = (c.area, c.location);
            next = 0;
        }
        if kept {
            c.frame_num = Some(next);
            next += 1;
        }
    }
}
