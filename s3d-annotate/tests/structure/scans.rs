//! Buildings as a scanner would have them: one rough surface, wherever the grid of the scan lies.

use s3d_geom::glam::{IVec3, Quat, Vec3, ivec3};
use s3d_geom::{MeshParts, NearestFaces, TriMesh};
use s3d_synth::AnnotatedScene;
use std::collections::{BTreeSet, HashMap};

/// The grid of a scan.
#[derive(Clone, Copy, Debug)]
pub(super) struct ScanGrid {
    /// The edge of its cells, metres.
    pub(super) cell_m: f32,
    /// The largest error of its distances, metres.
    pub(super) noise_m: f32,
    /// Where its corners lie, in cells from the lowest corner of the scene.
    pub(super) offset: Vec3,
    /// The scene is turned so far about Z before the scan.
    pub(super) degrees: f32,
}

/// Returns what a scan has of a scene: a surface of quadrilaterals around the edges of a grid at which the
/// sign of the distance changes (Gibson, "Constrained elastic surface nets", 1998).
pub(super) fn scanned(scene: &AnnotatedScene, grid: ScanGrid) -> AnnotatedScene {
    let mut parts = scene.mesh.parts().clone();
    let turn = Quat::from_rotation_z(grid.degrees.to_radians());
    parts.positions.iter_mut().for_each(|place| *place = turn * *place);
    parts.face_normals.clear();
    let mesh = TriMesh::new(parts).unwrap();
    let nearest = NearestFaces::new(&mesh);
    let cell_m = grid.cell_m;
    let low = mesh.aabb().min - cell_m * (4.0 - grid.offset);
    let place = |corner: IVec3| low + corner.as_vec3() * cell_m;

    let corners = corners_near(&mesh, low, cell_m);
    let places: Vec<Vec3> = corners.iter().map(|corner| place(IVec3::from(*corner))).collect();
    let mut found = Vec::new();
    nearest.nearest_many(&places, &mut found);
    let mut distance_at: HashMap<[i32; 3], f32> = HashMap::with_capacity(corners.len());
    for ((corner, at), near) in corners.iter().zip(&places).zip(&found) {
        if near.distance_m < 1.5 * cell_m {
            let side = mesh.normal(near.face).dot(*at - near.point);
            let noise_m = grid.noise_m * random(*corner);
            distance_at.insert(*corner, near.distance_m.copysign(side) + noise_m);
        }
    }

    let mut vertex_of_cell: HashMap<[i32; 3], u32> = HashMap::new();
    let mut positions: Vec<Vec3> = Vec::new();
    let mut faces: Vec<[u32; 3]> = Vec::new();
    let axes = [IVec3::X, IVec3::Y, IVec3::Z];
    for corner in &corners {
        let Some(&here) = distance_at.get(corner) else { continue };
        for axis in 0..3 {
            let corner = IVec3::from(*corner);
            let Some(&there) = distance_at.get(&(corner + axes[axis]).to_array()) else { continue };
            let is_near = here.abs() < cell_m && there.abs() < cell_m;
            if (here < 0.0) == (there < 0.0) || !is_near {
                continue;
            }
            let [u, v] = [axes[(axis + 1) % 3], axes[(axis + 2) % 3]];
            let [a, b, c, d] = [IVec3::ZERO, u, u + v, v].map(|offset| {
                let cell = corner - offset;
                *vertex_of_cell.entry(cell.to_array()).or_insert_with(|| {
                    positions.push(crossing(cell, &distance_at, place));
                    positions.len() as u32 - 1
                })
            });
            let pair = if here < 0.0 {
                [[a, b, c], [a, c, d]]
            } else {
                [[a, d, c], [a, c, b]]
            };
            faces.extend(pair);
        }
    }

    let scanned = TriMesh::new(MeshParts { positions, faces, ..MeshParts::default() }).unwrap();
    let faces = 0..scanned.faces().len() as u32;
    let middles: Vec<Vec3> = faces
        .map(|face| scanned.triangle(face).iter().sum::<Vec3>() / 3.0)
        .collect();
    nearest.nearest_many(&middles, &mut found);
    let instance_of = |face: u32| scene.instance_of_face[face as usize];
    let instance_of_face = found.iter().map(|near| instance_of(near.face)).collect();
    AnnotatedScene { mesh: scanned, instance_of_face, ..scene.clone() }
}

/// The corners of the grid that are no farther than two cells from the surface along each axis, ascending.
fn corners_near(mesh: &TriMesh, low: Vec3, cell_m: f32) -> Vec<[i32; 3]> {
    let mut cells: BTreeSet<[i32; 3]> = BTreeSet::new();
    for face in 0..mesh.faces().len() as u32 {
        let [a, b, c] = mesh.triangle(face);
        let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
        let steps = (longest / (0.5 * cell_m)).ceil().max(1.0) as u32;
        let mut of_face = Vec::new();
        for i in 0..=steps {
            for j in 0..=steps - i {
                let point = a + (b - a) * (i as f32 / steps as f32) + (c - a) * (j as f32 / steps as f32);
                of_face.push(((point - low) / cell_m).floor().as_ivec3().to_array());
            }
        }
        of_face.dedup();
        cells.extend(of_face);
    }
    let around = |[x, y, z]: &[i32; 3]| {
        let [x, y, z] = [*x, *y, *z];
        (0..64).map(move |i| [x + i % 4 - 1, y + i / 4 % 4 - 1, z + i / 16 - 1])
    };
    let mut corners: Vec<[i32; 3]> = cells.iter().flat_map(around).collect();
    corners.sort_unstable();
    corners.dedup();
    corners
}

/// The mean of the places on the edges of a cell at which the sign changes.
fn crossing(cell: IVec3, distance_at: &HashMap<[i32; 3], f32>, place: impl Fn(IVec3) -> Vec3) -> Vec3 {
    let corner = |i: i32| cell + ivec3(i & 1, i >> 1 & 1, i >> 2);
    let (mut sum, mut count) = (Vec3::ZERO, 0.0);
    for (i, bit) in (0..8).flat_map(|i| [1, 2, 4].map(|bit| (i, bit))) {
        let ends = [corner(i), corner(i | bit)];
        let [a, b] = ends.map(|end| distance_at.get(&end.to_array()).copied().unwrap_or(f32::NAN));
        if i & bit == 0 && a * b <= 0.0 && (a < 0.0) != (b < 0.0) {
            sum += place(ends[0]).lerp(place(ends[1]), a / (a - b));
            count += 1.0;
        }
    }
    sum / f32::max(count, 1.0)
}

/// A number from −1 to 1 that looks random.
fn random(of: [i32; 3]) -> f32 {
    let [x, y, z] = of.map(|i| i as u32);
    let mut h = x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77) ^ z.wrapping_mul(0xC2B2_AE3D);
    h = (h ^ h >> 15).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ h >> 12).wrapping_mul(0x297A_2D39);
    (h >> 8) as f32 / 8_388_608.0 - 1.0
}
