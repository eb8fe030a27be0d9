//! The faces that planes leave out: those that noise has turned, those in the creases between surfaces, and
//! specks within one.
//!
//! Where a plane lies on the grid of a reconstruction, noise decides on which side of each corner of the grid
//! it is. One face in five is folded there. It lies in the plane, but its normal does not say so.
//!
//! Scanners round corners. The faces there turn between two planes and belong to neither, over a length of
//! three times the outline of a room. Each of them is given to the surface that it is nearest to. A few faces
//! of noise within a surface belong to it.

use super::planes::{Plane, is_alike};
use super::scan::Facet;
use crate::segments::Lists;
use s3d_geom::TriMesh;
use s3d_geom::glam::DVec3;

/// A face lies in a crease if its corners are no farther than this from both surfaces, metres, …
const REACH_M: f64 = 0.06;

/// … and no more faces lie between it and each of them.
const RINGS: usize = 3;

/// The largest speck, m².
const SPECK_M2: f64 = 0.01;

/// The plane of a part of a surface.
#[derive(Clone, Copy)]
pub(super) struct Sheet {
    normal: DVec3,
    offset_m: f64,
    /// The largest distance of the middles of its faces from it, metres.
    tolerance_m: f64,
}

impl Sheet {
    pub(super) fn of(plane: &Plane) -> Self {
        Self { normal: plane.normal, offset_m: plane.offset_m, tolerance_m: plane.tolerance_m }
    }

    fn distance_m(&self, place: DVec3) -> f64 {
        (self.normal.dot(place) - self.offset_m).abs()
    }
}

/// Returns the turned faces, the faces in creases and the specks, with the surface that each belongs to,
/// ascending by face. `borders` are the pairs of faces that share an edge. `surface_of` has the surface of
/// each face, if it has one, and `sheets` the planes of each surface. Fronts of faces tell nothing unless
/// `has_sides`.
pub(super) fn rims(
    mesh: &TriMesh,
    facets: &[Facet],
    has_sides: bool,
    borders: &[[u32; 2]],
    surface_of: &[Option<u32>],
    sheets: &[Vec<Sheet>],
) -> Vec<(u32, u32)> {
    let both = borders.iter().flat_map(|&[a, b]| [(a, b), (b, a)]);
    let neighbours = Lists::of(surface_of.len(), both);
    let mut rims = Rims { mesh, facets, has_sides, neighbours, surface_of: surface_of.to_vec(), sheets };
    rims.turned();
    rims.creases();
    rims.specks();

    let of_faces = rims.surface_of.iter().zip(surface_of).zip(0..);
    let new = of_faces.filter(|((now, before), _)| now != before);
    new.filter_map(|((now, _), face)| Some((face, (*now)?))).collect()
}

struct Rims<'a> {
    mesh: &'a TriMesh,
    facets: &'a [Facet],
    has_sides: bool,
    neighbours: Lists,
    surface_of: Vec<Option<u32>>,
    sheets: &'a [Vec<Sheet>],
}

impl Rims<'_> {
    fn of(&self, face: u32) -> Option<u32> {
        self.surface_of[face as usize]
    }

    /// The distance of the middle of a face from a surface, metres, if its corners are near it.
    fn distance_m(&self, face: u32, surface: u32) -> Option<f64> {
        let corners = self.mesh.triangle(face).map(|corner| corner.as_dvec3());
        let middle = corners.iter().sum::<DVec3>() / 3.0;
        let near = self.sheets[surface as usize]
            .iter()
            .filter(|sheet| corners.iter().all(|corner| sheet.distance_m(*corner) <= REACH_M));
        near.map(|sheet| sheet.distance_m(middle)).min_by(f64::total_cmp)
    }

    /// Returns the distance of a face from the plane of a surface that it lies in, metres. `None` if it does
    /// not lie in one, or its normal says that it does: then something else keeps it from the surface.
    fn turned_in(&self, face: u32, surface: u32) -> Option<f64> {
        let facet = &self.facets[face as usize];
        let corners = self.mesh.triangle(face).map(|corner| corner.as_dvec3());
        let lies_in = self.sheets[surface as usize].iter().filter(|sheet| {
            // The corners of a face are rougher than its middle.
            let corner_m = (2.0 * sheet.tolerance_m).min(REACH_M);
            !is_alike(facet.normal, sheet.normal, self.has_sides)
                && sheet.distance_m(facet.middle) <= sheet.tolerance_m
                && corners.iter().all(|corner| sheet.distance_m(*corner) <= corner_m)
        });
        lies_in
            .map(|sheet| sheet.distance_m(facet.middle))
            .min_by(f64::total_cmp)
    }

    /// Gives turned faces to the surface beside them whose plane they lie in, ring by ring.
    fn turned(&mut self) {
        let mut ring: Vec<u32> = (0..self.surface_of.len() as u32)
            .filter(|face| self.of(*face).is_some())
            .collect();
        while !ring.is_empty() {
            let mut more: Vec<(u32, f64, u32)> = Vec::new();
            for face in ring {
                let Some(surface) = self.of(face) else { continue };
                let free = self
                    .neighbours
                    .list(face)
                    .iter()
                    .filter(|next| self.of(**next).is_none());
                more.extend(free.filter_map(|next| Some((*next, self.turned_in(*next, surface)?, surface))));
            }
            more.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(a.2.cmp(&b.2)));
            more.dedup_by_key(|(face, ..)| *face);
            ring = more.iter().map(|(face, ..)| *face).collect();
            more.into_iter()
                .for_each(|(face, _, surface)| self.surface_of[face as usize] = Some(surface));
        }
    }

    /// Gives the faces in creases to the surface that they are nearest to.
    fn creases(&mut self) {
        // The surfaces that each free face reaches over few faces, ascending.
        let mut reached: Vec<Vec<u32>> = vec![Vec::new(); self.surface_of.len()];
        let mut front: Vec<u32> = (0..self.surface_of.len() as u32).collect();
        for _ in 0..RINGS {
            let mut more: Vec<(u32, Vec<u32>)> = Vec::new();
            for &face in front.iter().filter(|face| self.of(**face).is_none()) {
                let mut all = reached[face as usize].clone();
                for &next in self.neighbours.list(face) {
                    match self.of(next) {
                        Some(surface) => all.push(surface),
                        None => all.extend_from_slice(&reached[next as usize]),
                    }
                }
                all.sort_unstable();
                all.dedup();
                if all.len() > reached[face as usize].len() {
                    more.push((face, all));
                }
            }
            front = more
                .iter()
                .flat_map(|(face, _)| self.neighbours.list(*face))
                .copied()
                .collect();
            front.sort_unstable();
            front.dedup();
            more.into_iter().for_each(|(face, all)| reached[face as usize] = all);
        }

        for (face, surfaces) in (0u32..).zip(&reached).filter(|(_, surfaces)| surfaces.len() > 1) {
            let near = surfaces
                .iter()
                .filter_map(|surface| Some((self.distance_m(face, *surface)?, *surface)));
            let near: Vec<(f64, u32)> = near.collect();
            let nearest = near.iter().min_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
            if near.len() > 1 {
                self.surface_of[face as usize] = nearest.map(|(_, surface)| *surface);
            }
        }
    }

    /// Gives small groups of free faces to the surface that is all around them.
    fn specks(&mut self) {
        let mut is_seen = vec![false; self.surface_of.len()];
        for first in 0..self.surface_of.len() as u32 {
            if self.of(first).is_some() || std::mem::replace(&mut is_seen[first as usize], true) {
                continue;
            }
            let mut group = vec![first];
            let mut around: Vec<u32> = Vec::new();
            let mut next = 0;
            while let Some(&face) = group.get(next) {
                next += 1;
                for &other in self.neighbours.list(face) {
                    match self.of(other) {
                        Some(surface) => around.push(surface),
                        None if std::mem::replace(&mut is_seen[other as usize], true) => {}
                        None => group.push(other),
                    }
                }
            }

            let area_m2: f64 = group.iter().map(|face| self.mesh.area(*face)).sum();
            let [one, ..] = around[..] else { continue };
            let is_speck = area_m2 <= SPECK_M2
                && around.iter().all(|surface| *surface == one)
                && group.iter().all(|face| self.distance_m(*face, one).is_some());
            if is_speck {
                group
                    .iter()
                    .for_each(|face| self.surface_of[*face as usize] = Some(one));
            }
        }
    }
}
