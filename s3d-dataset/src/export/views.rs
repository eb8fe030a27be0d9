//! Which views are taken: candidates at every location, their entropies, the selection, and their numbers.

use crate::context::Context;
use crate::error::{InputError, Result};
use crate::export::modality::class_index;
use crate::parallel::for_each_in_order;
use crate::record::journal::Finished;
use crate::record::request::Request;
use crate::summary::ViewTally;
use crate::survey::candidate::Candidate;
use glam::{Vec3, vec3};
use rayon::prelude::*;
use s3d_geom::TriMesh;
use s3d_io::camera::ScanLocation;
use s3d_label::{LabelId, LabelTable, MAX_CLASSES};
use s3d_render::{Caster, Hits, NO_FACE, Scene};
use s3d_sample::{Pool, PoolItem, Selection, View, ViewDistribution, draw_view, entropy, select_pooled};
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

/// What a view shows in a pixel, by the face seen there. Views are scored by its entropy.
pub(crate) enum Kinds {
    /// The index of each face's class or [`NO_CLASS`](crate::export::modality::NO_CLASS), and the number of
    /// classes.
    Classes(Vec<u8>, usize),
    /// Without labels: which of the [`DIRECTIONS`] each face's normal is nearest to.
    Directions(Vec<u8>),
}

/// The directions to the faces, edges and corners of a cube.
const DIRECTIONS: usize = 26;

impl Kinds {
    /// Returns the kinds of a mesh's faces: their classes, or their directions if the table has no labels.
    pub(crate) fn of(table: &LabelTable, label_of_face: &[LabelId], mesh: &TriMesh) -> Self {
        if table.len() > 1 {
            let class_of_face = label_of_face.iter().map(|label| class_index(table, *label)).collect();
            return Self::Classes(class_of_face, table.taxonomy().classes().len());
        }

        let steps = [-1.0, 0.0, 1.0];
        let all = steps
            .iter()
            .flat_map(|x| steps.iter().flat_map(move |y| steps.map(|z| vec3(*x, *y, z))));
        let directions: Vec<Vec3> = all.filter_map(Vec3::try_normalize).collect();

        let faces = (0..mesh.faces().len() as u32).into_par_iter();
        Self::Directions(faces.map(|face| nearest(&directions, mesh.normal(face))).collect())
    }

    /// The entropy of what a view's hits show, in nats.
    fn entropy_of(&self, hits: &Hits) -> f64 {
        let seen = hits.face.pixels().iter().filter(|face| **face != NO_FACE);
        match self {
            Self::Classes(class_of_face, classes) => {
                let mut histogram = [0u64; MAX_CLASSES + 1];
                seen.for_each(|face| histogram[usize::from(class_of_face[*face as usize])] += 1);
                entropy(&histogram[..*classes])
            }
            Self::Directions(direction_of_face) => {
                let mut histogram = [0u64; DIRECTIONS];
                seen.for_each(|face| histogram[usize::from(direction_of_face[*face as usize])] += 1);
                entropy(&histogram)
            }
        }
    }
}

/// The index of the direction nearest to a normal. The first wins a tie.
fn nearest(directions: &[Vec3], normal: Vec3) -> u8 {
    let cosines = directions.iter().map(|d| d.dot(normal));
    let best = cosines
        .enumerate()
        .max_by(|(i, a), (j, b)| a.total_cmp(b).then(j.cmp(i)));
    best.map_or(0, |(index, _)| index as u8)
}

/// How candidates are drawn and scored.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Scoring {
    /// The area of the locations.
    pub(crate) area: u32,
    /// Candidates per location.
    pub(crate) views: u32,
    /// Image size in pixels.
    pub(crate) size: u32,
    /// The step between the pixels that are looked at, along both axes.
    pub(crate) stride: u32,
    pub(crate) seed: u64,
}

/// Draws the candidates of a location. `entropies` are their scores, if they are scored already.
fn draw(
    area: u32,
    location: usize,
    uuid: &str,
    views: u32,
    seed: u64,
    entropies: Option<&[f64]>,
) -> Vec<Candidate> {
    let distribution = ViewDistribution::default();

    let mut candidates = Vec::with_capacity(views as usize);
    for candidate in 0..views {
        let View { yaw_rad, pitch_rad, fov_rad } = draw_view(&distribution, seed, uuid, candidate);
        let entropy = entropies.and_then(|e| e.get(candidate as usize)).copied();
        candidates.push(Candidate {
            area,
            location,
            camera_uuid: uuid.to_owned(),
            candidate,
            yaw_rad,
            pitch_rad,
            fov_rad,
            entropy: entropy.unwrap_or(0.0),
            frame_num: None,
        });
    }
    candidates
}

/// Draws the candidates of some locations of an area, and scores each by the entropy of what it sees. The
/// thread that completes a location calls `each` with its uuid and the entropies of its candidates.
pub(crate) fn score_area(
    ctx: &Context,
    locations: &[&ScanLocation],
    scene: &Scene<'_>,
    kinds: &Kinds,
    scoring: Scoring,
    each: impl Fn(&str, Vec<f64>) -> Result<()> + Sync,
) -> Result<()> {
    let mut candidates = Vec::with_capacity(locations.len() * scoring.views as usize);
    for (index, location) in locations.iter().enumerate() {
        candidates.extend(draw(scoring.area, index, &location.uuid, scoring.views, scoring.seed, None));
    }

    if scoring.views == 0 {
        return locations
            .iter()
            .try_for_each(|location| each(&location.uuid, Vec::new()));
    }

    let left: Vec<AtomicU32> = locations.iter().map(|_| AtomicU32::new(scoring.views)).collect();
    let progress = ctx.progress("scoring", "views", candidates.len() as u64);
    let scores: Vec<OnceLock<f64>> = candidates.iter().map(|_| OnceLock::new()).collect();
    let items: Vec<usize> = (0..candidates.len()).collect();

    for_each_in_order(
        ctx,
        &items,
        || (Caster::new(scene), Hits::default()),
        |(caster, hits), &i| {
            let c = &candidates[i];
            let camera = c.camera(locations[c.location], scoring.size);
            caster.cast_into(&camera, scoring.stride, hits);
            let _ = scores[i].set(kinds.entropy_of(hits));
            progress.add(1);

            // The thread that scores the last candidate of a location hands the location on.
            if left[c.location].fetch_sub(1, Ordering::AcqRel) == 1 {
                let views = scoring.views as usize;
                let of_location = scores.iter().skip(c.location * views).take(views);
                let entropies = of_location.map(|score| score.get().copied().unwrap_or(0.0)).collect();
                each(&c.camera_uuid, entropies)?;
            }

            Ok(())
        },
    )
}

/// Returns all candidates of a request after the selection, and what became of them. The areas must be
/// labelled and the locations scored.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) if labels or scores are missing.
pub(crate) fn select_requested(
    request: &Request,
    finished: &Finished,
) -> Result<(Vec<Candidate>, ViewTally)> {
    let options = &request.options;
    let mut candidates = Vec::new();
    for area in request.numbers() {
        let missing = |what: &str| InputError::UnfitArea { area, why: format!("{what} missing") };
        let labels = finished.labels(area).ok_or_else(|| missing("its labels are"))?;

        for (index, uuid) in labels.locations.iter().enumerate() {
            let entropies = finished.scores(area, uuid);
            let entropies = entropies.ok_or_else(|| missing(&format!("the scores of {uuid} are")))?;

            // No more candidates are drawn than were scored, whatever a request claims.
            if entropies.len() != options.views as usize {
                return Err(InputError::UnfitArea {
                    area,
                    why: format!(
                        "location {uuid} has {} scores instead of {}, one a candidate view",
                        entropies.len(),
                        options.views
                    ),
                }
                .into());
            }

            candidates.extend(draw(area, index, uuid, options.views, request.seed, Some(entropies)));
        }
    }

    let pool = options.pool;
    select(&mut candidates, pool, options.keep_all, request.seed);
    let tally = tally(&candidates, pool, options.keep_all, &options.only);
    Ok((candidates, tally))
}

/// Counts candidates after their selection. The candidates of an area follow each other, and so do the
/// candidates of each of its locations. `only` are the locations whose images are asked for; all are if it is
/// empty.
pub(crate) fn tally(candidates: &[Candidate], pool: Pool, keep_all: bool, only: &[String]) -> ViewTally {
    let kept: Vec<&Candidate> = candidates.iter().filter(|c| c.frame_num.is_some()).collect();

    let selection = Selection::default();
    let pools = candidates.chunk_by(|a, b| match pool {
        Pool::Dataset => true,
        Pool::Area => a.area == b.area,
        Pool::Location => (a.area, a.location) == (b.area, b.location),
    });
    let dropped_lowest = if keep_all {
        0
    } else {
        pools.map(|pool| selection.discarded(pool.len()) as u64).sum()
    };

    let asked = kept
        .iter()
        .filter(|c| only.is_empty() || only.contains(&c.camera_uuid))
        .count();
    ViewTally {
        candidates: candidates.len() as u64,
        kept: kept.len() as u64,
        dropped_lowest,
        dropped_not_drawn: (candidates.len() - kept.len()) as u64 - dropped_lowest,
        not_asked: (kept.len() - asked) as u64,
    }
}

/// Selects views from each pool, or all of them, and numbers the kept ones of each location from 0.
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::journal::{Done, LabelsDone, ScoresDone};
    use crate::record::request::tests::request;
    use s3d_geom::Raster;

    #[test]
    fn directions_are_counted_where_there_are_no_labels() {
        // A floor, a wall and a face between the two.
        let corners = [[0., 0., 0.], [1., 0., 0.], [0., 1., 0.], [0., 0., 1.], [0., -1., 1.]];
        let mesh = TriMesh::from_faces(
            corners.map(Vec3::from_array).to_vec(),
            vec![[0, 1, 2], [0, 1, 3], [0, 1, 4]],
        );
        let mesh = mesh.unwrap();
        let table = LabelTable::from_labels([]).unwrap();
        let Kinds::Directions(kinds) = Kinds::of(&table, &[LabelId::NULL; 3], &mesh) else { panic!() };
        assert!(kinds.iter().all(|kind| usize::from(*kind) < DIRECTIONS));
        assert!(kinds[0] != kinds[1] && kinds[1] != kinds[2] && kinds[0] != kinds[2]);

        let kinds = Kinds::Directions(kinds);
        let entropy_of = |face| kinds.entropy_of(&Hits { face, ..Hits::default() });
        let all = Raster::from_vec(4, 2, vec![0, 0, 1, 1, 2, 2, NO_FACE, NO_FACE]);
        assert!((entropy_of(all) - 3f64.ln()).abs() < 1e-12);
        assert_eq!(entropy_of(Raster::filled(4, 2, 1)), 0.0);
    }

    #[test]
    fn as_many_views_are_drawn_as_were_scored() {
        let mut request = request();
        request.areas.truncate(1);
        request.options.views = 3;
        let area = request.areas[0].area;
        let entry = serde_json::json!({
            "area": area, "faces": 0, "faces_left_out": 0, "points": 0, "annotated_points": 0, "rooms": 0,
            "locations": 1, "panoramas": 0, "views": 0, "rgb": "texture", "place_cameras": null,
            "xyz": { "type": "half", "largest_coordinate_m": 0.0, "largest_step_m": null },
        });

        let mut finished = Finished::default();
        finished.insert(Done::Labels(LabelsDone {
            entry: Box::new(serde_json::from_value(entry).unwrap()),
            locations: vec!["a".into()],
            photographs: Vec::new(),
            files: Vec::new(),
        }));

        let scores = |n| Done::Scores(ScoresDone { area, location: "a".into(), entropies: vec![1.0; n] });
        finished.insert(scores(3));
        assert_eq!(select_requested(&request, &finished).unwrap().0.len(), 3);
        for n in [2, 4] {
            finished.insert(scores(n));
            let e = select_requested(&request, &finished).unwrap_err().to_string();
            assert!(e.contains(&format!("{n} scores instead of 3")), "{e}");
        }

        request.options.views = u32::MAX;
        assert!(select_requested(&request, &finished).is_err());
    }
}
