//! What the simulated person does with a knife: boxes, colours, the brush.

use super::{BOX_M, BRUSHES_M, CELL_M, HOP_M, Idea, Person, REACH_M, STROKE_M, TOLERANCES, cell};
use s3d_annotate::labelling::FaceRuns;
use s3d_annotate::workbench::{Gesture, Knife, Patch, Selection};
use s3d_geom::glam::Vec3;
use std::collections::{BTreeMap, BTreeSet};

impl Person<'_> {
    /// A box around what is left of a thing that has no instance yet, on the plane of its largest face.
    pub(super) fn boxes(&self, thing: u32) -> Option<Idea> {
        if self.instance_of[thing as usize] != 0 {
            return None;
        }
        let left = self.left_of(thing);
        let mesh = self.bench.mesh();
        // The direction that most of it faces.
        let mut toward: BTreeMap<[i32; 3], f64> = BTreeMap::new();
        for face in &left {
            let direction = (mesh.normal(*face) * 2.0).round().as_ivec3().to_array();
            *toward.entry(direction).or_default() += self.areas[*face as usize];
        }
        let direction = toward.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?.0;
        let side: Vec<u32> = left
            .iter()
            .copied()
            .filter(|face| (mesh.normal(*face) * 2.0).round().as_ivec3().to_array() == direction)
            .collect();
        let normal = side
            .iter()
            .map(|face| mesh.normal(*face) * self.areas[*face as usize] as f32);
        let normal = normal.sum::<Vec3>().try_normalize()?;
        let across = if normal.z.abs() > 0.8 { Vec3::X } else { Vec3::Z };
        let u = (across - normal * normal.dot(across)).normalize();
        let v = normal.cross(u);
        let project = |point: Vec3| [u.dot(point), v.dot(point), normal.dot(point)];
        let (mut low, mut high, mut height, mut area) = ([f32::MAX; 2], [f32::MIN; 2], 0.0, 0.0);
        for face in &side {
            for corner in mesh.triangle(*face) {
                let at = project(corner);
                for i in 0..2 {
                    low[i] = low[i].min(at[i]);
                    high[i] = high[i].max(at[i]);
                }
            }
            let weight = self.areas[*face as usize] as f32;
            height += weight * project(self.middles[*face as usize])[2];
            area += weight;
        }
        height /= area;

        // The patch is that of the instance that has most of it, up to the root of the tree.
        let of_face = self.of_face();
        let mut of_instance: BTreeMap<u32, f64> = BTreeMap::new();
        for face in &side {
            *of_instance.entry(of_face[*face as usize]).or_default() += self.areas[*face as usize];
        }
        let instance = of_instance.into_iter().max_by(|a, b| a.1.total_cmp(&b.1))?.0;
        let face = *side.iter().find(|face| of_face[**face as usize] == instance)?;
        let segment = self.bench.segments().segment_of_face[face as usize];
        let corner = |a: f32, b: f32| u * a + v * b + normal * height;
        let [[a, b], [c, d]] = [low, high];
        let corners = [corner(a, b), corner(c, b), corner(c, d), corner(a, d)];
        let is_inside = |face: u32| {
            let at = project(self.middles[face as usize]);
            (0..2).all(|i| at[i] > low[i] && at[i] < high[i]) && (at[2] - height).abs() <= BOX_M
        };
        let segments = self.bench.segments();
        let of_instance = (0..of_face.len() as u32).filter(|face| of_face[*face as usize] == instance);
        let inside: Vec<u32> = of_instance.filter(|face| is_inside(*face)).collect();
        let mut best: Option<Idea> = None;
        for cut in &self.cuts {
            let at = Patch { face, node: cut[segment as usize] };
            let is_in_node =
                |face: &u32| segments.tree.has(at.node, segments.segment_of_face[*face as usize]);
            let gain_m2 = self.gain(thing, inside.iter().copied().filter(is_in_node));
            if gain_m2 > best.as_ref().map_or(0.0, |idea| idea.gain_m2) {
                let class = Some(self.scene.classes[thing as usize].clone());
                let gesture = Gesture::Cut { at, by: Knife::Box { corners }, class };
                best = Some(Idea { kind: "box", gesture, gain_m2, strokes: 1, makes: vec![thing] });
            }
        }
        best
    }

    /// A cut by the colour of what is left of a thing that has no instance yet.
    pub(super) fn colors(&self, thing: u32) -> Option<Idea> {
        if self.instance_of[thing as usize] != 0 {
            return None;
        }
        let left = self.left_of(thing);
        let largest = |a: &&u32, b: &&u32| self.areas[**a as usize].total_cmp(&self.areas[**b as usize]);
        let mut best: Option<Idea> = None;
        for &face in [left.get(left.len() / 2), left.iter().max_by(largest)]
            .into_iter()
            .flatten()
        {
            let segment = self.bench.segments().segment_of_face[face as usize];
            let highest = self.cuts.last().map(|cut| cut[segment as usize])?;
            for tolerance in TOLERANCES {
                let (at, by) = (Patch { face, node: highest }, Knife::Color { tolerance });
                let Ok(faces) = self.bench.cut(at, &by) else { continue };
                let gain_m2 = self.gain(thing, faces.iter());
                if gain_m2 > best.as_ref().map_or(0.0, |idea| idea.gain_m2) {
                    let class = Some(self.scene.classes[thing as usize].clone());
                    let gesture = Gesture::Cut { at, by, class };
                    best = Some(Idea { kind: "color", gesture, gain_m2, strokes: 1, makes: vec![thing] });
                }
            }
        }
        best
    }

    /// A swath of the brush over what is left of a thing.
    pub(super) fn swaths(&self, thing: u32) -> Option<Idea> {
        let left = self.left_of(thing);
        let largest = |a: &&u32, b: &&u32| self.areas[**a as usize].total_cmp(&self.areas[**b as usize]);
        let seeds = [left.get(left.len() / 2), left.iter().max_by(largest), left.first()];
        let of_face = self.of_face();
        let target = self.instance_of[thing as usize];
        let mut best: Option<Idea> = None;
        for &seed in seeds.into_iter().flatten() {
            for radius_m in BRUSHES_M {
                let path = self.path(&left, seed, radius_m);
                // As on the page: another one's faces are added, and a new object is made of one's.
                let is_taken = |face: &u32| {
                    let own = of_face[*face as usize];
                    if target == 0 {
                        own == of_face[seed as usize]
                    } else {
                        own != target
                    }
                };
                let mut under: BTreeSet<u32> = self.near([path[0]; 2], radius_m).filter(is_taken).collect();
                // It is lifted where that is best.
                let (mut kept, mut gain_m2) = (under.len(), self.gain(thing, under.iter().copied()));
                let mut faces: Vec<u32> = under.iter().copied().collect();
                let mut gain_so_far_m2 = gain_m2;
                for ends in path.windows(2) {
                    let near = self.near([ends[0], ends[1]], radius_m).filter(is_taken);
                    let more: Vec<u32> = near.filter(|face| under.insert(*face)).collect();
                    gain_so_far_m2 += self.gain(thing, more.iter().copied());
                    faces.extend(more);
                    if gain_so_far_m2 > gain_m2 {
                        (kept, gain_m2) = (faces.len(), gain_so_far_m2);
                    }
                }
                if gain_m2 > best.as_ref().map_or(0.0, |idea| idea.gain_m2) {
                    let faces: FaceRuns = faces[..kept].iter().copied().collect();
                    let what = Selection { faces, ..Selection::default() };
                    best = Some(self.paint("brush", thing, what, gain_m2));
                }
            }
        }
        best
    }

    /// A way over what is left of a thing: always on to the nearest that is not under the brush yet.
    fn path(&self, left: &[u32], seed: u32, radius_m: f32) -> Vec<Vec3> {
        let start = self.middles[seed as usize];
        let places = left.iter().map(|face| self.middles[*face as usize]);
        let mut open: Vec<Vec3> = places.filter(|place| place.distance(start) <= REACH_M).collect();
        let mut path = vec![start];
        let (mut at, mut length_m) = (start, 0.0);
        open.retain(|place| place.distance(start) > radius_m);
        loop {
            let next = open.iter().min_by(|a, b| a.distance(at).total_cmp(&b.distance(at)));
            let Some(&next) = next.filter(|next| next.distance(at) <= HOP_M.max(2.0 * radius_m)) else {
                break;
            };
            length_m += at.distance(next);
            if length_m > STROKE_M {
                break;
            }
            open.retain(|place| distance(*place, [at, next]) > radius_m);
            path.push(next);
            at = next;
        }
        path
    }

    /// The faces whose middles are near a straight piece.
    fn near(&self, ends: [Vec3; 2], radius_m: f32) -> impl Iterator<Item = u32> + '_ {
        let low = cell(ends[0].min(ends[1]) - radius_m);
        let high = cell(ends[0].max(ends[1]) + radius_m);
        debug_assert!(radius_m <= CELL_M);
        let cells = (low[0]..=high[0]).flat_map(move |x| {
            (low[1]..=high[1]).flat_map(move |y| (low[2]..=high[2]).map(move |z| [x, y, z]))
        });
        let faces = cells.filter_map(|cell| self.cells.get(&cell)).flatten().copied();
        faces.filter(move |face| distance(self.middles[*face as usize], ends) <= radius_m)
    }
}

/// The distance of a place from a straight piece, metres.
fn distance(place: Vec3, ends: [Vec3; 2]) -> f32 {
    let along = ends[1] - ends[0];
    let t = along.dot(place - ends[0]) / along.length_squared().max(1e-12);
    place.distance(ends[0] + along * t.clamp(0.0, 1.0))
}
