//! Plain patches and bodies, as [`MeshParts`] that can be changed and merged.
//!
//! Patches ([`quad`], [`grid`]) have texture coordinates from (0, 0) to (1, 1). Bodies ([`cuboid`],
//! [`cylinder`]) have texture coordinates in metres, so a texture repeats once per metre. A closed body has
//! one vertex per corner, shared by its faces. Nothing has a material.
//!
//! ```
//! use s3d_geom::glam::{Vec3, vec3};
//! use s3d_geom::primitives::{cuboid, cylinder};
//! use s3d_geom::{MeshParts, TriMesh};
//!
//! let table = MeshParts::merge([
//!     cuboid(vec3(-0.5, -0.5, 0.7), vec3(0.5, 0.5, 0.74)),
//!     cylinder(Vec3::ZERO, 0.1, 0.7, 24),
//! ]);
//! assert_eq!(TriMesh::new(table)?.aabb().size(), vec3(1.0, 1.0, 0.74));
//! # Ok::<(), s3d_geom::MeshError>(())
//! ```

use crate::MeshParts;
use glam::{Vec2, Vec3, vec2, vec3};

/// Returns two triangles over four `corners`, which run counter-clockwise seen from the front. The first
/// corner is at the bottom left of the texture.
pub fn quad(corners: [Vec3; 4]) -> MeshParts {
    MeshParts {
        positions: corners.to_vec(),
        faces: vec![[0, 1, 2], [0, 2, 3]],
        uvs: vec![Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y],
        face_uvs: vec![[0, 1, 2], [0, 2, 3]],
        ..MeshParts::default()
    }
}

/// Returns the parallelogram from `origin` along `u` and `v`, in `cells[0]` × `cells[1]` quads of two
/// triangles. Its front is on the side of `u × v`. Vertices and faces are in rows along `u`.
///
/// # Panics
/// If a number of cells is 0.
pub fn grid(origin: Vec3, u: Vec3, v: Vec3, cells: [u32; 2]) -> MeshParts {
    let [nu, nv] = cells;
    assert!(nu > 0 && nv > 0, "a grid of {nu} × {nv} cells");

    let mut parts = MeshParts::default();
    for j in 0..=nv {
        for i in 0..=nu {
            let uv = vec2(i as f32 / nu as f32, j as f32 / nv as f32);
            parts.positions.push(origin + u * uv.x + v * uv.y);
            parts.uvs.push(uv);
        }
    }

    for j in 0..nv {
        for i in 0..nu {
            let a = j * (nu + 1) + i;
            let [b, c, d] = [a + 1, a + nu + 2, a + nu + 1];
            parts.faces.extend([[a, b, c], [a, c, d]]);
        }
    }
    parts.face_uvs = parts.faces.clone();
    parts
}

/// Returns the closed box between two corners, its front outside. It has eight vertices. Its sides are in the
/// order z, x, y, the side at `min` before the one at `max`.
///
/// # Panics
/// If `max` is not above `min` on each axis.
pub fn cuboid(min: Vec3, max: Vec3) -> MeshParts {
    assert!(min.cmplt(max).all(), "a box from {min} to {max}");

    // The corners of the bottom, counter-clockwise seen from above, then the corners of the top.
    let plan = [[min.x, min.y], [max.x, min.y], [max.x, max.y], [min.x, max.y]];
    let bottom = plan.map(|[x, y]| vec3(x, y, min.z));
    let top = plan.map(|[x, y]| vec3(x, y, max.z));
    let mut parts = MeshParts { positions: [bottom, top].concat(), ..MeshParts::default() };

    // The axis across a side, and the corners of the side, counter-clockwise seen from inside.
    let sides = [
        (2, [0, 1, 2, 3]),
        (2, [4, 7, 6, 5]),
        (0, [0, 3, 7, 4]),
        (0, [1, 5, 6, 2]),
        (1, [0, 4, 5, 1]),
        (1, [3, 2, 6, 7]),
    ];
    for (axis, [a, b, c, d]) in sides {
        let first = parts.uvs.len() as u32;
        for corner in [a, b, c, d] {
            let p = parts.positions[corner as usize] - min;
            // The texture is upright on walls.
            parts.uvs.push([vec2(p.y, p.z), vec2(p.x, p.z), vec2(p.x, p.y)][axis]);
        }

        parts.faces.extend([[a, c, b], [a, d, c]]);
        parts
            .face_uvs
            .extend([[first, first + 2, first + 1], [first, first + 3, first + 2]]);
    }

    parts
}

/// Returns a closed upright cylinder, its front outside. `base` is the centre of the bottom, and `sides` the
/// number of quads around.
///
/// # Panics
/// If a length is not positive or there are fewer than three sides.
pub fn cylinder(base: Vec3, radius_m: f32, height_m: f32, sides: u32) -> MeshParts {
    assert!(
        radius_m > 0.0 && height_m > 0.0 && sides >= 3,
        "a cylinder of {radius_m} m × {height_m} m, {sides} sides"
    );

    let step_rad = std::f32::consts::TAU / sides as f32;
    let mut parts = MeshParts {
        positions: vec![base, base + Vec3::Z * height_m],
        uvs: vec![Vec2::splat(radius_m)],
        ..MeshParts::default()
    };

    // Each column has two vertices, at the bottom and at the top. It has three texture coordinates: for the
    // lids, and for the lower and the upper corner of the wall.
    for i in 0..=sides {
        let spoke = Vec2::from_angle(i as f32 * step_rad) * radius_m;
        if i < sides {
            let foot = base + spoke.extend(0.0);
            parts.positions.extend([foot, foot + Vec3::Z * height_m]);
        }

        let along = i as f32 * step_rad * radius_m;
        parts
            .uvs
            .extend([spoke + radius_m, vec2(along, 0.0), vec2(along, height_m)]);
    }

    for i in 0..sides {
        let [a, b] = [i, (i + 1) % sides].map(|k| 2 + 2 * k);
        let [ta, tb] = [i, i + 1].map(|k| 1 + 3 * k);
        parts
            .faces
            .extend([[0, b, a], [1, a + 1, b + 1], [a, b, b + 1], [a, b + 1, a + 1]]);
        parts
            .face_uvs
            .extend([[0, tb, ta], [0, ta, tb], [ta + 1, tb + 1, tb + 2], [ta + 1, tb + 2, ta + 2]]);
    }

    parts
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Aabb, TriMesh};
    use std::collections::BTreeMap;

    /// Returns the volume that the faces enclose, positive if their fronts are outside.
    fn volume(parts: &MeshParts) -> f64 {
        let p = |v: u32| parts.positions[v as usize].as_dvec3();
        parts
            .faces
            .iter()
            .map(|&[a, b, c]| p(a).dot(p(b).cross(p(c))) / 6.0)
            .sum()
    }

    /// Returns the number of edges that faces do not run along equally often in both directions.
    fn open_edges(parts: &MeshParts) -> usize {
        let mut balance = BTreeMap::new();
        for &[a, b, c] in &parts.faces {
            for (from, to) in [(a, b), (b, c), (c, a)] {
                *balance.entry((from.min(to), from.max(to))).or_insert(0) += if from < to { 1 } else { -1 };
            }
        }
        balance.values().filter(|&&n| n != 0).count()
    }

    #[test]
    fn bodies_are_closed_and_turned_outwards() {
        let b = cuboid(vec3(1.0, 2.0, 3.0), vec3(2.0, 4.0, 6.0));
        assert_eq!((b.positions.len(), b.faces.len(), open_edges(&b)), (8, 12, 0));
        assert!((volume(&b) - 6.0).abs() < 1e-9);
        let c = cylinder(vec3(1.0, 1.0, 0.5), 0.5, 2.0, 64);
        assert_eq!(open_edges(&c), 0);
        assert!((volume(&c) - 0.5 * std::f64::consts::PI).abs() < 0.01);
        TriMesh::new(c).unwrap();
    }

    #[test]
    fn texture_coordinates_of_bodies_are_metres() {
        let c = TriMesh::new(cylinder(Vec3::ZERO, 0.4, 1.0, 24)).unwrap();
        for parts in [cuboid(Vec3::ZERO, vec3(1.0, 2.0, 3.0)), c.into_parts()] {
            for (f, t) in parts.faces.iter().zip(&parts.face_uvs) {
                for (i, j) in [(0, 1), (1, 2), (2, 0)] {
                    let space = parts.positions[f[i] as usize].distance(parts.positions[f[j] as usize]);
                    let image = parts.uvs[t[i] as usize].distance(parts.uvs[t[j] as usize]);
                    // A chord is a little shorter than its arc.
                    assert!((space - image).abs() < 0.003, "{space} {image}");
                }
            }
        }
    }

    #[test]
    fn a_grid_faces_along_u_cross_v_and_its_texture_fits() {
        let g = grid(vec3(0.0, 0.0, 1.0), Vec3::X * 3.0, Vec3::Y * 2.0, [3, 4]);
        assert_eq!(*g.uvs.last().unwrap(), Vec2::ONE);
        let m = TriMesh::new(g).unwrap();
        assert_eq!(m.faces().len(), 24);
        assert!((0..24).all(|f| m.normal(f) == Vec3::Z));
        assert!((m.total_area() - 6.0).abs() < 1e-6);
        let q = quad([Vec3::ZERO, Vec3::X, Vec3::X + Vec3::Z, Vec3::Z]);
        assert_eq!(TriMesh::new(q).unwrap().normal(1), -Vec3::Y);
    }

    #[test]
    fn boxes_follow_their_corners() {
        let low = vec3(10.1, 5.3, 0.7);
        let high = vec3(11.7, 5.9, 1.3);
        assert_eq!(Aabb::from_points(cuboid(low, high).positions), Aabb { min: low, max: high });
    }

    #[test]
    #[should_panic(expected = "a box from")]
    fn a_box_without_extent_is_a_callers_mistake() {
        let _ = cuboid(Vec3::ZERO, Vec3::X);
    }
}
