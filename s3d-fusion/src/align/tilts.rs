//! Turns that make planes level, for surfaces whose upright axis is not known.

use super::surface::SurfacePoints;
use s3d_geom::glam::{DQuat, DVec3};

/// So many normals are compared at most.
const MOST_NORMALS: usize = 2_000;
/// The most directions.
const MOST_AXES: usize = 4;
/// A direction has at least this share of the normals of the first.
const LEAST_SHARE: f64 = 0.1;
/// Normals of one direction, and other directions, cosines: 5° and 20°.
const SAME: f64 = 0.996;
const OTHER: f64 = 0.94;

/// The directions, up to their sign, that most of a surface looks into.
fn axes(surface: &SurfacePoints) -> Vec<DVec3> {
    let all = &surface.points.normals;
    let every = all.len().div_ceil(MOST_NORMALS).max(1);
    let mut normals: Vec<DVec3> = all.iter().step_by(every).map(|n| n.as_dvec3()).collect();
    let mut axes = Vec::new();
    let mut first = 0;
    while axes.len() < MOST_AXES && !normals.is_empty() {
        let count = |axis: DVec3| normals.iter().filter(|n| n.dot(axis).abs() >= SAME).count();
        let counted = normals.iter().map(|n| (count(*n), *n));
        // The first of several that are equal.
        let Some((most, mut axis)) = counted.reduce(|best, next| if next.0 > best.0 { next } else { best })
        else {
            break;
        };
        first = first.max(most);
        if (most as f64) < LEAST_SHARE * first as f64 {
            break;
        }
        for _ in 0..3 {
            let near = normals.iter().filter(|n| n.dot(axis).abs() >= SAME);
            axis = near
                .map(|n| *n * n.dot(axis).signum())
                .sum::<DVec3>()
                .normalize_or(axis);
        }
        normals.retain(|n| n.dot(axis).abs() < OTHER);
        axes.push(axis);
    }
    axes
}

/// The turns after which a plane of the surface is level, on either side.
pub(super) fn tilts(surface: &SurfacePoints) -> Vec<DQuat> {
    let up = |axis: DVec3| DQuat::from_rotation_arc(axis, DVec3::Z);
    axes(surface)
        .into_iter()
        .flat_map(|axis| [up(axis), up(-axis)])
        .collect()
}
