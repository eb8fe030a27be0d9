//! A tree over the triangles of a mesh: what a ray meets, and whether it meets anything.

use crate::look::Pattern;
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris};
use obvhs::ray::{Ray, RayHit};
use obvhs::{BvhBuildParams, triangle::Triangle};
use s3d_geom::TriMesh;
use s3d_geom::glam::{Vec3, Vec3A};
use std::time::Duration;

/// The triangles of a mesh in the order of their tree. Lengths along a ray are multiples of its direction.
pub(crate) struct RayTree {
    bvh: Bvh2,
    triangles: Vec<Triangle>,
}

impl RayTree {
    pub(crate) fn new(mesh: &TriMesh) -> Self {
        let all: Vec<Triangle> = (0..mesh.faces().len() as u32)
            .map(|face| {
                let [v0, v1, v2] = mesh.triangle(face).map(Vec3A::from);
                Triangle { v0, v1, v2 }
            })
            .collect();

        let bvh = build_bvh2_from_tris(&all, BvhBuildParams::medium_build(), &mut Duration::default());
        let triangles = bvh.primitive_indices.iter().map(|&i| all[i as usize]).collect();
        Self { bvh, triangles }
    }

    /// Returns the first face along a ray and how far away it is, if that is at most `end`.
    pub(crate) fn first(&self, origin: Vec3, direction: Vec3, end: f32) -> Option<(u32, f32)> {
        let ray = Ray::new(origin.into(), direction.into(), 0.0, end);
        let mut hit = RayHit::none();
        self.bvh
            .ray_traverse(ray, &mut hit, |ray, k| self.triangles[k].intersect(ray));
        let face = *self.bvh.primitive_indices.get(hit.primitive_id as usize)?;
        (hit.t < end).then_some((face, hit.t))
    }

    /// Whether nothing is along a ray before `end`. `hider` is the triangle that hid the last ray, in the
    /// order of the tree. It is tried first, and replaced by the one that hides this ray.
    pub(crate) fn is_free(&self, origin: Vec3, direction: Vec3, end: f32, hider: &mut u32) -> bool {
        let ray = Ray::new(origin.into(), direction.into(), 0.0, end);
        let last = self.triangles.get(*hider as usize);
        if last.is_some_and(|t| t.intersect(&ray) < end) {
            return false;
        }
        self.bvh.ray_traverse_miss(ray, |ray, k| {
            let t = self.triangles[k].intersect(ray);
            if t < end {
                *hider = k as u32;
            }
            t
        })
    }
}

/// Tells for each face whether it is the pane of a window.
pub(crate) fn glass_faces(mesh: &TriMesh) -> Vec<bool> {
    let glass = Pattern::Sky.name();
    let is_glass = |face| {
        let material = mesh.material_of(face).and_then(|m| mesh.materials().get(m as usize));
        material.is_some_and(|m| m.name.starts_with(glass))
    };
    (0..mesh.faces().len() as u32).map(is_glass).collect()
}
