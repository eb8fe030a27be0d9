//! What a scanner sees of a scene from where it stood.

use crate::look::hash;
use crate::rays::{RayTree, glass_faces};
use crate::{AnnotatedScene, BuildingError, Instance, RangeError};
use rayon::prelude::*;
use s3d_geom::glam::{Vec2, Vec3};
use s3d_geom::{MeshParts, NO_INDEX, TriMesh};
use std::collections::BTreeMap;

/// How a scanner sees.
#[derive(Clone, Debug, PartialEq)]
pub struct SightOptions {
    /// The range of the scanner, metres: 0.5 to 200.
    pub range_m: f32,
    /// Up to this distance a surface has all its points if the rays of one location meet it at a right angle,
    /// metres: 0.1 to 200. Beyond, the points get fewer with the square of the distance. Rays that meet a
    /// surface aslant give fewer points with the cosine of the angle.
    pub full_m: f32,
    /// Rays that meet a surface at a smaller angle than this give no points, degrees: 0 to 89.
    pub grazing_deg: f32,
    /// The share of points on the panes of windows that come back: 0 to 1.
    pub glass: f32,
    /// The share of patches of 12 cm that have no points: 0 to 1.
    pub holes: f32,
}

impl Default for SightOptions {
    fn default() -> Self {
        Self { range_m: 12.0, full_m: 3.5, grazing_deg: 6.0, glass: 0.5, holes: 0.02 }
    }
}

impl SightOptions {
    pub(crate) fn check(&self) -> Result<(), RangeError> {
        check_range(self.range_m, [0.5, 200.0], "how far a scanner sees")?;
        check_range(self.full_m, [0.1, 200.0], "how far surfaces have all their points")?;
        check_range(self.grazing_deg, [0.0, 89.0], "the angle at which rays give no points")?;
        check_range(self.glass, [0.0, 1.0], "the share of points on panes")?;
        check_range(self.holes, [0.0, 1.0], "the share of holes")
    }
}

fn check_range(value: f32, range: [f64; 2], what: &str) -> Result<(), RangeError> {
    RangeError::check(value, range, || what.to_owned())
}

/// Edge of the patches that have no points.
const PATCH_M: f32 = 0.12;
/// A ray ends this far before its point, metres, so that the point's own surface does not block it.
const SLACK_M: f32 = 0.004;

/// A scene, seen from its locations.
pub(crate) struct Sight {
    options: SightOptions,
    tree: RayTree,
    locations: Vec<Vec3>,
    /// The least sine of the angle between a ray and a surface.
    least_sine: f32,
    is_glass: Vec<bool>,
}

/// The triangle that hid the last point from each location. It is tried first for the next point.
pub(crate) struct Memory(Vec<u32>);

impl Sight {
    pub(crate) fn new(scene: &AnnotatedScene, options: &SightOptions) -> Self {
        Self {
            options: options.clone(),
            tree: RayTree::new(&scene.mesh),
            locations: scene.locations.iter().map(|l| l.position.as_vec3()).collect(),
            least_sine: Vec2::from_angle(options.grazing_deg.to_radians()).y,
            is_glass: glass_faces(&scene.mesh),
        }
    }

    pub(crate) fn memory(&self) -> Memory {
        Memory(vec![NO_INDEX; self.locations.len()])
    }

    /// The share of points, 0 to 1, that a location measures on a surface at `p` with the normal `n` if
    /// nothing is between.
    fn weight(&self, location: Vec3, p: Vec3, n: Vec3) -> f32 {
        let d = location - p;
        let distance = d.length();
        let sine = n.dot(d) / distance;
        if distance > self.options.range_m || sine.is_nan() || sine <= self.least_sine {
            return 0.0;
        }
        let near = self.options.full_m / distance;
        (sine * near * near).min(1.0)
    }

    /// Whether nothing is between a location and `p`.
    fn is_free(&self, location: usize, p: Vec3, memory: &mut Memory) -> bool {
        let origin = self.locations[location];
        let direction = p - origin;
        let end = 1.0 - SLACK_M / direction.length();
        self.tree.is_free(origin, direction, end, &mut memory.0[location])
    }

    /// Returns the location that sees the point `p` of a face best, or `None` if the point does not come
    /// back. The number `chance`, from 0 to 1, decides.
    pub(crate) fn measures(
        &self,
        (p, face): (Vec3, u32),
        n: Vec3,
        chance: f32,
        memory: &mut Memory,
    ) -> Option<Vec3> {
        let share = if self.is_glass[face as usize] {
            self.options.glass
        } else {
            1.0
        };

        let patch = (p / PATCH_M).floor().as_ivec3();
        let in_hole = hash(patch.x as u32, (patch.y as u32).wrapping_add(patch.z as u32 * 7919), 101);
        if chance >= share || in_hole < self.options.holes {
            return None;
        }

        let mut near: Vec<(f32, usize)> = (0..self.locations.len())
            .map(|k| (self.weight(self.locations[k], p, n), k))
            .filter(|(weight, _)| *weight > 0.0)
            .collect();
        near.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));

        let mut left: f32 = near.iter().map(|(weight, _)| weight).sum();
        let mut sum = 0.0;
        let mut best = None;

        for (weight, k) in near {
            // All remaining weights are not enough.
            if (sum + left) * share <= chance {
                return None;
            }
            left -= weight;
            if self.is_free(k, p, memory) {
                sum += weight;
                best = best.or(Some(self.locations[k]));
                if sum * share > chance {
                    return best;
                }
            }
        }

        None
    }

    /// Returns a place of a face that some location sees.
    pub(crate) fn seen_place(&self, mesh: &TriMesh, face: u32, memory: &mut Memory) -> Option<Vec3> {
        let ([a, b, c], n) = (mesh.triangle(face), mesh.normal(face));
        let toward =
            |near: f32, k: usize| std::array::from_fn(|i| if i == k { 1.0 - 2.0 * near } else { near });

        let places = [[1.0 / 3.0; 3]].into_iter();
        let places = places.chain(
            [0.1, 0.48, 0.02]
                .into_iter()
                .flat_map(|near| [0, 1, 2].map(|k| toward(near, k))),
        );

        places.map(|[u, v, w]: [f32; 3]| a * u + b * v + c * w).find(|&p| {
            (0..self.locations.len())
                .any(|k| self.weight(self.locations[k], p, n) > 0.0 && self.is_free(k, p, memory))
        })
    }
}

impl AnnotatedScene {
    /// The scene as a scanner could have captured it. Faces that no location sees are left out (ten places of
    /// each are tried), and so are instances that have no face left. Instances are numbered anew.
    ///
    /// ```
    /// use s3d_synth::{Building, SightOptions};
    ///
    /// let scene = Building { texture_scale: 0.05, ..Building::demo() }.build()?;
    /// let seen = scene.seen(&SightOptions::default())?;
    /// // Backs of bookcases, undersides of drawers.
    /// let share = seen.mesh.faces().len() as f64 / scene.mesh.faces().len() as f64;
    /// assert!((0.5..0.95).contains(&share));
    /// # Ok::<(), s3d_synth::BuildingError>(())
    /// ```
    ///
    /// # Errors
    /// [`BuildingError::Range`] for an option out of its range, [`BuildingError::Mesh`] if nothing is seen.
    pub fn seen(&self, options: &SightOptions) -> Result<Self, BuildingError> {
        options.check()?;
        let sight = Sight::new(self, options);
        let faces: Vec<u32> = (0..self.mesh.faces().len() as u32).collect();
        // The same triangle often hides neighbours.
        let kept: Vec<Vec<u32>> = faces
            .par_chunks(256)
            .map(|chunk| {
                let mut memory = sight.memory();
                chunk
                    .iter()
                    .copied()
                    .filter(|&face| sight.seen_place(&self.mesh, face, &mut memory).is_some())
                    .collect()
            })
            .collect();
        self.with_faces(&kept.concat())
    }

    fn with_faces(&self, kept: &[u32]) -> Result<Self, BuildingError> {
        let mut instances: Vec<Instance> = Vec::new();
        let mut new_of = vec![NO_INDEX; self.instances.len()];
        let mut counts = BTreeMap::new();
        let instance_of_face = kept.iter().map(|&face| {
            let old = self.instance_of_face[face as usize] as usize;
            if new_of[old] == NO_INDEX {
                new_of[old] = instances.len() as u32;
                let instance = self.instances[old];
                let number = counts.entry((instance.room, instance.class)).or_insert(0);
                *number += 1;
                instances.push(Instance { number: *number, ..instance });
            }
            new_of[old]
        });

        let instance_of_face = instance_of_face.collect();
        let old = self.mesh.parts();

        let mut parts = MeshParts {
            materials: old.materials.clone(),
            textures: old.textures.clone(),
            face_materials: kept
                .iter()
                .filter_map(|&f| old.face_materials.get(f as usize).copied())
                .collect(),
            ..MeshParts::default()
        };

        let corners = |list: &[[u32; 3]]| {
            kept.iter()
                .filter_map(|&f| list.get(f as usize).copied())
                .collect::<Vec<_>>()
        };
        (parts.faces, parts.positions) = compacted(corners(&old.faces), &old.positions);
        (parts.face_uvs, parts.uvs) = compacted(corners(&old.face_uvs), &old.uvs);

        Ok(Self {
            mesh: TriMesh::new(parts)?,
            instance_of_face,
            instances,
            locations: self.locations.clone(),
            title: self.title.clone(),
        })
    }
}

/// Returns the corners with new indices, and the values that they index in the order of their first use.
/// Corners without a value stay without one.
fn compacted<T: Copy>(mut corners: Vec<[u32; 3]>, values: &[T]) -> (Vec<[u32; 3]>, Vec<T>) {
    let mut new_of = vec![NO_INDEX; values.len()];
    let mut kept = Vec::new();
    for corner in corners.iter_mut().flatten() {
        if let Some(slot) = new_of.get_mut(*corner as usize) {
            if *slot == NO_INDEX {
                *slot = kept.len() as u32;
                kept.push(values[*corner as usize]);
            }
            *corner = *slot;
        }
    }
    (corners, kept)
}
