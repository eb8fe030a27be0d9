//! Where to stand to see something.

use super::surroundings::Surroundings;
use s3d_geom::TriMesh;
use s3d_geom::glam::Vec3;

/// So many places on the surface are looked at.
const SAMPLES: usize = 12;

/// Directions from which the surface may be looked at: so many around it, at these elevations, as the sines.
const AROUND: u32 = 12;
const RISES: [f32; 3] = [0.35, 0.75, -0.45];

/// Distances, in sizes of the surface, and their limits in metres.
const DISTANCES: [f32; 3] = [1.6, 1.1, 0.7];
const NEAREST_M: f32 = 0.6;
const FARTHEST_M: f32 = 3.5;

/// Surface so near to a place does not hide it, metres.
const SLACK_M: f32 = 0.15;

/// A place on some surface, and a place from which it is seen. World metres.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct View {
    pub(super) face: u32,
    pub(super) at: Vec3,
    pub(super) from: Vec3,
}

/// Finds a place from which much of some faces is seen, from the front. Behind other surface, or if nothing
/// of it is seen from anywhere, the place is in front of the middle all the same. `faces` has at least one.
///
/// Rays walk over the cells of about 5 cm, so they may miss a gap of this size, but no wall.
pub(super) fn view_of(mesh: &TriMesh, surroundings: &Surroundings, faces: &[u32]) -> View {
    let samples = samples(mesh, faces);
    let middle = samples.iter().map(|(_, place)| *place).sum::<Vec3>() / samples.len() as f32;
    let near_middle = |a: &&(u32, Vec3), b: &&(u32, Vec3)| {
        a.1.distance_squared(middle).total_cmp(&b.1.distance_squared(middle))
    };
    let size_m = 2.0 * samples.iter().map(|(_, place)| place.distance(middle)).fold(0f32, f32::max);

    let mut best: Option<(f32, View)> = None;
    for distance in DISTANCES {
        let distance_m = (distance * size_m).clamp(NEAREST_M, FARTHEST_M);
        for direction in directions() {
            let from = middle + direction * distance_m;
            if !is_room_to_stand(surroundings, from) {
                continue;
            }
            let seen = samples.iter().filter_map(|(face, place)| {
                let to_eye = (from - *place).try_normalize()?;
                let front = mesh.normal(*face).dot(to_eye);
                // The back of a surface is worth little: a scan may be turned inside out.
                let worth = if front > 0.0 { front } else { -0.05 * front };
                is_free(surroundings, from, *place).then_some((worth, (*face, *place)))
            });
            let seen: Vec<(f32, (u32, Vec3))> = seen.collect();
            let worth: f32 = seen.iter().map(|(worth, _)| worth).sum();
            if worth > best.map_or(0.0, |(worth, _)| worth)
                && let Some(&(face, at)) =
                    seen.iter().filter(|(worth, _)| *worth > 0.1).map(|(_, seen)| seen).min_by(near_middle)
            {
                best = Some((worth, View { face, at, from }));
            }
        }
    }

    let in_front = || {
        let (face, at) = samples.iter().min_by(near_middle).copied().unwrap_or_default();
        View { face, at, from: at + mesh.normal(face) * NEAREST_M }
    };
    best.map_or_else(in_front, |(_, view)| view)
}

/// Faces at equal distances along the area of all, with their middles.
fn samples(mesh: &TriMesh, faces: &[u32]) -> Vec<(u32, Vec3)> {
    let total_m2: f64 = faces.iter().map(|face| mesh.area(*face)).sum();
    let step_m2 = total_m2 / SAMPLES as f64;
    let mut samples: Vec<(u32, Vec3)> = Vec::with_capacity(SAMPLES);
    let mut sum_m2 = 0.0;
    for &face in faces {
        sum_m2 += mesh.area(face);
        if sum_m2 >= (samples.len() as f64 + 0.5) * step_m2 && samples.len() < SAMPLES {
            samples.push((face, mesh.triangle(face).iter().sum::<Vec3>() / 3.0));
        }
    }
    samples
}

fn directions() -> impl Iterator<Item = Vec3> {
    RISES.into_iter().flat_map(|rise| {
        let across = (1.0 - rise * rise).sqrt();
        (0..AROUND).map(move |i| {
            let (sin, cos) = libm::sincosf(i as f32 * std::f32::consts::TAU / AROUND as f32);
            Vec3::new(across * cos, across * sin, rise)
        })
    })
}

/// Whether nothing is within about 10 cm.
fn is_room_to_stand(surroundings: &Surroundings, at: Vec3) -> bool {
    let near = 2.0 * surroundings.cells.edge_m;
    let around = [Vec3::ZERO, Vec3::X, -Vec3::X, Vec3::Y, -Vec3::Y, Vec3::Z, -Vec3::Z];
    around.iter().all(|offset| !surroundings.cells.is_occupied(at + *offset * near))
}

/// Whether no surface lies between two places, up to a little in front of the second.
fn is_free(surroundings: &Surroundings, from: Vec3, to: Vec3) -> bool {
    let way = to - from;
    let cells = &surroundings.cells;
    let length_m = way.length() - SLACK_M.max(3.0 * cells.edge_m);
    let step_m = 0.6 * cells.edge_m;
    let direction = way.normalize_or_zero();
    (1..(length_m / step_m).max(0.0) as u32).all(|i| !cells.is_occupied(from + direction * (i as f32 * step_m)))
}

/// A place as numbers of 64 bits.
pub(super) fn numbers(place: Vec3) -> [f64; 3] {
    place.as_dvec3().to_array()
}

