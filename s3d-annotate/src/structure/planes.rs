//! Planes in a set of faces.

use super::scan::Facet;
use s3d_geom::glam::{DMat3, DVec3, dvec3};
use std::collections::BTreeMap;

/// Normals are alike within this step along each axis when a plane is looked for.
const NORMAL_STEP: f64 = 0.15;

/// Faces are on a plane that is looked for within this step, metres.
const OFFSET_STEP_M: f64 = 0.06;

/// The least cosine of the angle between a plane and a face on it: 25°.
const ALIKE: f64 = 0.9;

/// A plane begins with a layer of this thickness, metres, …
const LAYER_M: f64 = 0.02;

/// … and the faces no farther from it than this, metres.
const FIRST_REACH_M: f64 = 0.03;

/// The range of the distances within which faces are on a plane, metres. The noise of the scan says where in
/// it.
const TOLERANCE_M: [f64; 2] = [0.006, 0.05];

/// A plane with the faces on it.
pub(super) struct Plane {
    pub(super) normal: DVec3,
    /// The product of the normal with the points of the plane, metres.
    pub(super) offset_m: f64,
    /// The largest distance of its faces from it, metres.
    pub(super) tolerance_m: f64,
    /// The faces, ascending.
    pub(super) faces: Vec<u32>,
    pub(super) area_m2: f64,
}

/// Finds the planes of at least `least_m2` in some faces, ascending. A plane with a face is found once.
///
/// Faces vote for cells of normal and offset by their area, a Hough transform (Duda and Hart, "Use of the
/// Hough transformation to detect lines and curves in pictures", 1972). The cell with most votes gives a
/// plane, which is fitted by least squares to the faces near it. Its faces vote no more, and so on. Faces of
/// either winding are alike unless `has_sides`.
pub(super) fn planes(facets: &[Facet], faces: &[u32], least_m2: f64, has_sides: bool) -> Vec<Plane> {
    let key = |face: u32| {
        let facet = &facets[face as usize];
        let normal = if has_sides { facet.normal } else { upward(facet.normal) };
        let [x, y, z] = (normal / NORMAL_STEP).round().to_array().map(|v| v as i32);
        // All faces of a cell share one normal, so offsets do not depend on the distance of the origin.
        let shared = (dvec3(f64::from(x), f64::from(y), f64::from(z)) * NORMAL_STEP).normalize_or_zero();
        let offset = (facet.middle - anchor(facets, faces)).dot(shared) / OFFSET_STEP_M;
        ([x, y, z], offset.floor() as i64)
    };
    let keys: Vec<([i32; 3], i64)> = faces.iter().map(|face| key(*face)).collect();
    let mut votes: BTreeMap<([i32; 3], i64), f64> = BTreeMap::new();
    for (face, key) in faces.iter().zip(&keys) {
        *votes.entry(*key).or_default() += facets[*face as usize].area_m2;
    }

    let mut is_free = vec![true; faces.len()];
    let mut found = Vec::new();
    loop {
        // Neighbouring offsets share the faces of a plane between them.
        let sum = |&(normal, offset): &([i32; 3], i64)| {
            let next = votes.get(&(normal, offset + 1)).copied().unwrap_or(0.0);
            votes.get(&(normal, offset)).copied().unwrap_or(0.0) + next
        };
        let best = votes
            .keys()
            .map(|key| (*key, sum(key)))
            .reduce(|a, b| if b.1 > a.1 { b } else { a });
        let Some((best, _)) = best.filter(|(_, sum)| *sum >= 0.3 * least_m2) else { break };

        let is_seed = |place: &usize| {
            let (normal, offset) = keys[*place];
            is_free[*place] && normal == best.0 && (offset == best.1 || offset == best.1 + 1)
        };
        let seed: Vec<u32> = (0..faces.len()).filter(is_seed).map(|place| faces[place]).collect();
        let free: Vec<usize> = (0..faces.len()).filter(|place| is_free[*place]).collect();
        let plane = fitted(facets, &seed, free.iter().map(|place| faces[*place]), has_sides);

        // Its faces vote no more; nor do those of the seed, so that the search ends.
        for place in free {
            let is_on = plane.faces.binary_search(&faces[place]).is_ok();
            if is_on || is_seed(&place) {
                let vote = votes.entry(keys[place]).or_default();
                *vote = (*vote - facets[faces[place] as usize].area_m2).max(0.0);
            }
        }
        votes.remove(&best);
        votes.remove(&(best.0, best.1 + 1));
        for (place, face) in faces.iter().enumerate() {
            is_free[place] &= plane.faces.binary_search(face).is_err();
        }
        if plane.area_m2 >= least_m2 {
            found.push(plane);
        }
    }
    found
}

/// A place among the faces from which offsets are counted.
fn anchor(facets: &[Facet], faces: &[u32]) -> DVec3 {
    faces.first().map_or(DVec3::ZERO, |face| facets[*face as usize].middle)
}

/// Turns a normal up; a horizontal one to the east or north.
fn upward(normal: DVec3) -> DVec3 {
    let [x, y, z] = normal.to_array().map(|v| if v.abs() < 1e-6 { 0.0 } else { v });
    if (z, y, x) < (0.0, 0.0, 0.0) { -normal } else { normal }
}

/// Fits a plane to the faces of a seed, and then to all faces near it. It begins with the densest layer of
/// the seed, so that a panel just before a wall does not draw the plane towards it.
fn fitted(facets: &[Facet], seed: &[u32], all: impl Iterator<Item = u32>, has_sides: bool) -> Plane {
    let all: Vec<u32> = all.collect();
    let mut normal = seed.iter().fold(DVec3::ZERO, |sum, face| {
        let facet = &facets[*face as usize];
        let normal = if has_sides { facet.normal } else { upward(facet.normal) };
        sum + normal * facet.area_m2
    });
    normal = normal.normalize_or(DVec3::Z);
    let mut offset_m = densest(facets, seed, normal);
    let mut reach_m = FIRST_REACH_M;
    let mut on = Vec::new();
    for _ in 0..6 {
        let is_on = |face: &u32| {
            let facet = &facets[*face as usize];
            is_alike(facet.normal, normal, has_sides)
                && (facet.middle.dot(normal) - offset_m).abs() <= reach_m
        };
        on = all.iter().copied().filter(is_on).collect();
        if on.is_empty() {
            break;
        }
        normal = fit(facets, &on, normal);
        (offset_m, reach_m) = spread(facets, &on, normal);
    }
    Plane {
        normal,
        offset_m,
        tolerance_m: reach_m,
        area_m2: on.iter().map(|face| facets[*face as usize].area_m2).sum(),
        faces: on,
    }
}

/// Returns whether a face with this normal may be on a plane. Of either winding unless `has_sides`.
pub(super) fn is_alike(face: DVec3, plane: DVec3, has_sides: bool) -> bool {
    let cosine = face.dot(plane);
    let cosine = if has_sides { cosine } else { cosine.abs() };
    cosine >= ALIKE
}

/// The offset of each face along a normal, and its area, ascending.
fn offsets(facets: &[Facet], faces: &[u32], normal: DVec3) -> Vec<(f64, f64)> {
    let facets = faces.iter().map(|face| &facets[*face as usize]);
    let mut offsets: Vec<(f64, f64)> =
        facets.map(|facet| (facet.middle.dot(normal), facet.area_m2)).collect();
    offsets.sort_by(|a, b| a.0.total_cmp(&b.0));
    offsets
}

/// Returns the middle of the thin layer with most area.
fn densest(facets: &[Facet], faces: &[u32], normal: DVec3) -> f64 {
    let offsets = offsets(facets, faces, normal);
    let (mut start, mut area_m2) = (0, 0.0);
    let mut best = (0.0, 0.0);
    for &(offset_m, more_m2) in &offsets {
        area_m2 += more_m2;
        while offset_m - offsets[start].0 > LAYER_M {
            area_m2 -= offsets[start].1;
            start += 1;
        }
        if area_m2 > best.1 {
            best = (offset_m.midpoint(offsets[start].0), area_m2);
        }
    }
    best.0
}

/// The value that half of the weight lies below, of pairs of ascending values and weights.
fn median(values: &[(f64, f64)]) -> f64 {
    let half = 0.5 * values.iter().map(|(_, weight)| weight).sum::<f64>();
    let mut sum = 0.0;
    let middle = values.iter().find(|(_, weight)| {
        sum += weight;
        sum >= half
    });
    middle.map_or(0.0, |(value, _)| *value)
}

/// Returns the median offset of some faces, and three and a half standard deviations from it, as the median
/// of the distances tells them.
fn spread(facets: &[Facet], faces: &[u32], normal: DVec3) -> (f64, f64) {
    let mut offsets = offsets(facets, faces, normal);
    let middle = median(&offsets);
    offsets
        .iter_mut()
        .for_each(|(offset_m, _)| *offset_m = (*offset_m - middle).abs());
    offsets.sort_by(|a, b| a.0.total_cmp(&b.0));
    let [least, most] = TOLERANCE_M;
    (middle, (3.5 * 1.48 * median(&offsets)).clamp(least, most))
}

/// Returns the normal of the plane that fits some faces best by least squares, tilted from `normal`. A weak
/// pull towards `normal` holds the plane of a narrow strip.
fn fit(facets: &[Facet], faces: &[u32], normal: DVec3) -> DVec3 {
    let (mut middle, mut weight) = (DVec3::ZERO, 0.0);
    for facet in faces.iter().map(|face| &facets[*face as usize]) {
        middle += facet.middle * facet.area_m2;
        weight += facet.area_m2;
    }
    middle /= f64::max(weight, f64::MIN_POSITIVE);

    let u = normal.any_orthonormal_vector();
    let v = normal.cross(u);
    let [mut uu, mut uv, mut vv, mut uw, mut vw] = [0.0; 5];
    for facet in faces.iter().map(|face| &facets[*face as usize]) {
        let from = facet.middle - middle;
        let [a, b, c] = [from.dot(u), from.dot(v), from.dot(normal)];
        uu += facet.area_m2 * a * a;
        uv += facet.area_m2 * a * b;
        vv += facet.area_m2 * b * b;
        uw += facet.area_m2 * a * c;
        vw += facet.area_m2 * b * c;
    }
    let pull = 0.01 * weight;
    let system = DMat3::from_cols(dvec3(uu + pull, uv, 0.0), dvec3(uv, vv + pull, 0.0), DVec3::Z);
    let slope = system.inverse() * dvec3(uw, vw, 0.0);
    let tilted = (normal - u * slope.x - v * slope.y).normalize_or(normal);
    if slope.is_finite() { tilted } else { normal }
}
