//! The transfer of colours from points to the vertices of a mesh.

use crate::nearest::{Nearest, NearestFaces};
use crate::{DEFAULT_COLOR, PointCloud, TriMesh};
use glam::{DVec3, Vec3};
use std::f32::consts::FRAC_1_SQRT_2;

/// A point farther than this from the mesh gives no colour: it belongs to something that the mesh lacks.
const FAR_M: f32 = 0.1;

/// The number of points whose nearest faces are in memory at once.
const CHUNK_POINTS: usize = 1 << 20;

/// A face with more points than this loses detail, since it has only three corners.
const MANY_POINTS: u32 = 16;

/// The whole number for a weight of 1. Sums of whole numbers are the same in any order.
const ONE: f64 = 4096.0;

/// Colours the vertices of a mesh from a point cloud, block by block.
///
/// A point within 10 cm of the mesh counts for the corners of its nearest face, weighted by its barycentric
/// coordinates. The colour of a vertex is the weighted mean. Vertices at one place count as one vertex,
/// unless their surfaces are more than 45° apart. A vertex without points takes the mean colour of its
/// neighbours, so colours spread along edges. The result is the same for any order of blocks and any number
/// of threads. Colours are 8-bit R G B; the mean is taken of the stored values.
///
/// ```
/// use s3d_geom::{NearestFaces, PointCloud, TriMesh, VertexColors, glam::{Vec3, vec3}};
///
/// let mesh = TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
/// let nearest_faces = NearestFaces::new(&mesh);
/// let mut colors = VertexColors::new(&nearest_faces);
/// let positions = vec![vec3(0.0, 0.0, 0.01), vec3(1.0, 0.0, 0.0), vec3(0.5, 0.0, 5.0)];
/// colors.add(&PointCloud { positions, colors: vec![[255, 0, 0], [0, 9, 0], [7; 3]], faces: vec![] });
/// let found = colors.finish();
/// // The third point is far, so the third vertex takes the mean of its neighbours.
/// assert_eq!(found.colors, [[255, 0, 0], [0, 9, 0], [128, 5, 0]]);
/// assert_eq!((found.points, found.far_points, found.spread_m2), (3, 1, 0.5));
/// # Ok::<(), s3d_geom::MeshError>(())
/// ```
pub struct VertexColors<'m> {
    nearest_faces: &'m NearestFaces<'m>,
    /// For each vertex, the group of vertices that count as one.
    group_of_vertex: Vec<u32>,
    /// For each group, the number of its place. Groups at one place follow each other.
    place_of_group: Vec<u32>,
    /// For each group, the weighted sums of R, G and B, and the sum of the weights.
    sums: Vec<[u64; 4]>,
    points_of_face: Vec<u32>,
    points: u64,
    far_points: u64,
    /// The nearest faces of a chunk of points; kept for its memory.
    nearest: Vec<Nearest>,
}

/// The colours of vertices, and statistics of their sources.
#[derive(Clone, Debug, PartialEq)]
pub struct ColoredVertices {
    /// R G B, one per vertex, for [`TriMesh::with_vertex_colors`](crate::TriMesh::with_vertex_colors).
    pub colors: Vec<[u8; 3]>,
    /// The number of points.
    pub points: u64,
    /// The number of points farther than 10 cm from the mesh, which gave no colour.
    pub far_points: u64,
    /// The area of the faces with a corner that has no points and took its colour from neighbours, in m².
    pub spread_m2: f64,
    /// The area of the faces with a corner that no colour reaches, in m². Such corners are
    /// [`DEFAULT_COLOR`].
    pub bare_m2: f64,
    /// The area of the faces with more than 16 points, in m². Details finer than these faces are lost.
    pub blurred_m2: f64,
}

impl<'m> VertexColors<'m> {
    /// Starts without points, for the mesh of `nearest_faces`.
    pub fn new(nearest_faces: &'m NearestFaces<'m>) -> Self {
        let (group_of_vertex, place_of_group) = groups(nearest_faces.mesh());
        let sums = vec![[0; 4]; place_of_group.len()];
        Self {
            nearest_faces,
            group_of_vertex,
            place_of_group,
            sums,
            points_of_face: vec![0; nearest_faces.mesh().faces().len()],
            points: 0,
            far_points: 0,
            nearest: Vec::new(),
        }
    }

    /// Adds coloured points, in world metres. Points that are not finite count as far.
    ///
    /// # Panics
    /// If the cloud does not have one colour per point.
    pub fn add(&mut self, cloud: &PointCloud) {
        assert_eq!(cloud.positions.len(), cloud.colors.len(), "one colour per point");
        let mesh = self.nearest_faces.mesh();
        self.points += cloud.len() as u64;
        for (points, colors) in cloud
            .positions
            .chunks(CHUNK_POINTS)
            .zip(cloud.colors.chunks(CHUNK_POINTS))
        {
            self.nearest_faces.nearest_many(points, &mut self.nearest);
            for (nearest, color) in self.nearest.iter().zip(colors) {
                if nearest.distance_m > FAR_M {
                    self.far_points += 1;
                    continue;
                }

                let points = &mut self.points_of_face[nearest.face as usize];
                *points = points.saturating_add(1);

                let corners = mesh.triangle(nearest.face).map(|p| p.as_dvec3());
                let vertices = mesh.faces()[nearest.face as usize];
                for (vertex, share) in
                    vertices.into_iter().zip(barycentric(corners, nearest.point.as_dvec3()))
                {
                    let weight = (ONE * share).round() as u64;
                    let sums = &mut self.sums[self.group_of_vertex[vertex as usize] as usize];
                    let counted = [color[0], color[1], color[2], 1].map(u64::from);
                    sums.iter_mut()
                        .zip(counted)
                        .for_each(|(sum, value)| *sum += weight * value);
                }
            }
        }
    }

    /// Returns the groups of the corners of a face.
    fn groups_of(&self, face: &[u32; 3]) -> [u32; 3] {
        face.map(|vertex| self.group_of_vertex[vertex as usize])
    }

    /// Returns the area of the faces with a corner that has no colour, in m².
    fn area_without_color(&self, colors: &[Option<[u8; 3]>]) -> f64 {
        let mesh = self.nearest_faces.mesh();
        (0u32..)
            .zip(mesh.faces())
            .filter(|(_, face)| {
                self.groups_of(face)
                    .iter()
                    .any(|group| colors[*group as usize].is_none())
            })
            .map(|(f, _)| mesh.area(f))
            .sum()
    }

    /// Returns the colours of all vertices, from the points so far.
    pub fn finish(self) -> ColoredVertices {
        let mesh = self.nearest_faces.mesh();
        let mut colors: Vec<Option<[u8; 3]>> = self.sums.iter().map(mean).collect();

        let unseen_m2 = self.area_without_color(&colors);
        if unseen_m2 > 0.0 {
            let faces: Vec<[u32; 3]> = mesh.faces().iter().map(|face| self.groups_of(face)).collect();
            let around = FacesAround::new(&faces, colors.len());
            spread(&mut colors, &around);
            // At an edge between two surfaces, colours cross from one to the other.
            while share(&mut colors, &self.place_of_group) {
                spread(&mut colors, &around);
            }
        }
        let bare_m2 = self.area_without_color(&colors);

        ColoredVertices {
            colors: self
                .group_of_vertex
                .iter()
                .map(|group| colors[*group as usize].unwrap_or(DEFAULT_COLOR))
                .collect(),
            points: self.points,
            far_points: self.far_points,
            spread_m2: unseen_m2 - bare_m2,
            bare_m2,
            blurred_m2: (0u32..)
                .zip(&self.points_of_face)
                .filter(|(_, points)| **points > MANY_POINTS)
                .map(|(face, _)| mesh.area(face))
                .sum(),
        }
    }
}

/// Groups the vertices that count as one: vertices at one place whose normals are at most 45° away from the
/// normal of the first. Returns the group of each vertex, and the number of the place of each group.
fn groups(mesh: &TriMesh) -> (Vec<u32>, Vec<u32>) {
    let mut normals = vec![Vec3::ZERO; mesh.positions().len()];
    for (f, face) in (0u32..).zip(mesh.faces()) {
        let [a, b, c] = mesh.triangle(f);
        face.iter()
            .for_each(|vertex| normals[*vertex as usize] += (b - a).cross(c - a));
    }

    let mut order: Vec<u32> = (0..normals.len() as u32).collect();
    order.sort_unstable_by_key(|&vertex| (place_key(vertex, mesh), vertex));

    let mut group_of_vertex = vec![0; normals.len()];
    let mut place_of_group = Vec::new();
    for (place, vertices) in (0u32..).zip(order.chunk_by(|&a, &b| place_key(a, mesh) == place_key(b, mesh))) {
        // The normal of the first vertex of each group at this place.
        let first_group = place_of_group.len();
        let mut firsts: Vec<Vec3> = Vec::new();
        for vertex in vertices {
            let normal = normals[*vertex as usize].normalize_or_zero();
            let found = firsts.iter().position(|first| first.dot(normal) > FRAC_1_SQRT_2);
            let group = found.unwrap_or_else(|| {
                firsts.push(normal);
                place_of_group.push(place);
                firsts.len() - 1
            });
            group_of_vertex[*vertex as usize] = (first_group + group) as u32;
        }
    }
    (group_of_vertex, place_of_group)
}

/// Returns the place of a vertex as bits. Adding 0 turns −0 into 0, so that equal positions have equal
/// bits.
fn place_key(vertex: u32, mesh: &TriMesh) -> [u32; 3] {
    (mesh.positions()[vertex as usize] + Vec3::ZERO)
        .to_array()
        .map(f32::to_bits)
}

/// Returns the mean of weighted colours, rounded. Returns `None` if the weight is 0.
fn mean([r, g, b, weight]: &[u64; 4]) -> Option<[u8; 3]> {
    (*weight > 0).then(|| [r, g, b].map(|sum| ((2 * sum + weight) / (2 * weight)) as u8))
}

/// Returns the unweighted mean of colours.
fn plain_mean(colors: impl Iterator<Item = [u8; 3]>) -> Option<[u8; 3]> {
    mean(&colors.fold([0; 4], add))
}

fn add(sums: [u64; 4], [r, g, b]: [u8; 3]) -> [u64; 4] {
    [sums[0] + u64::from(r), sums[1] + u64::from(g), sums[2] + u64::from(b), sums[3] + 1]
}

/// The faces around each group of vertices.
struct FacesAround<'f> {
    faces: &'f [[u32; 3]],
    /// The faces around group 0, then around group 1, and so on.
    around: Vec<u32>,
    /// For each group, the place of its first face in `around`.
    first: Vec<usize>,
}

impl<'f> FacesAround<'f> {
    fn new(faces: &'f [[u32; 3]], groups: usize) -> Self {
        let mut first = vec![0; groups + 1];
        faces.iter().flatten().for_each(|group| first[*group as usize + 1] += 1);
        (1..first.len()).for_each(|i| first[i] += first[i - 1]);

        let mut next = first.clone();
        let mut around = vec![0; 3 * faces.len()];
        for (face, group) in (0u32..)
            .zip(faces)
            .flat_map(|(face, groups)| groups.map(|group| (face, group)))
        {
            around[next[group as usize]] = face;
            next[group as usize] += 1;
        }
        Self { faces, around, first }
    }

    /// Iterates over the corners of the faces around `group`: its neighbours and itself.
    fn corners(&self, group: u32) -> impl Iterator<Item = u32> {
        let faces = &self.around[self.first[group as usize]..self.first[group as usize + 1]];
        faces.iter().flat_map(|face| self.faces[*face as usize])
    }
}

/// Gives each group without a colour the mean colour of its neighbours. It proceeds ring by ring, starting
/// with the groups next to a colour.
fn spread(colors: &mut [Option<[u8; 3]>], around: &FacesAround<'_>) {
    let mut ring: Vec<u32> = (0..colors.len() as u32)
        .filter(|group| is_without(colors, *group))
        .filter(|group| around.corners(*group).any(|other| !is_without(colors, other)))
        .collect();

    while !ring.is_empty() {
        // All groups of a ring see the colours before the ring. A neighbour counts once for each shared face.
        let color =
            |group: &u32| plain_mean(around.corners(*group).filter_map(|other| colors[other as usize]));
        let found: Vec<Option<[u8; 3]>> = ring.iter().map(color).collect();
        ring.iter()
            .zip(&found)
            .for_each(|(group, color)| colors[*group as usize] = *color);

        let next = ring.iter().flat_map(|group| around.corners(*group));
        let mut next: Vec<u32> = next.filter(|other| is_without(colors, *other)).collect();
        next.sort_unstable();
        next.dedup();
        ring = next;
    }
}

fn is_without(colors: &[Option<[u8; 3]>], group: u32) -> bool {
    colors[group as usize].is_none()
}

/// Gives each group without a colour the mean of the groups at the same place. Returns true if a group got a
/// colour.
fn share(colors: &mut [Option<[u8; 3]>], place_of_group: &[u32]) -> bool {
    let mut begin = 0;
    let mut is_shared = false;
    for at_place in place_of_group.chunk_by(|a, b| a == b) {
        let here = &mut colors[begin..begin + at_place.len()];
        begin += at_place.len();
        let color = plain_mean(here.iter().flatten().copied());
        for group in here.iter_mut().filter(|group| group.is_none()) {
            *group = color;
            is_shared |= color.is_some();
        }
    }
    is_shared
}

/// Returns the barycentric coordinates of a point of a triangle: at least 0, with a sum of 1.
fn barycentric([a, b, c]: [DVec3; 3], point: DVec3) -> [f64; 3] {
    let normal = (b - a).cross(c - a);
    let share = |p: DVec3, q: DVec3| (p - point).cross(q - point).dot(normal).max(0.0);
    let shares = [share(b, c), share(c, a), share(a, b)];
    let sum: f64 = shares.iter().sum();
    if sum > 0.0 {
        shares.map(|s| s / sum)
    } else {
        [1.0 / 3.0; 3]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::primitives;
    use glam::vec3;
    use proptest::prelude::*;

    /// Returns a floor of 1 m² in 10 × 10 cells.
    fn floor() -> TriMesh {
        TriMesh::new(primitives::grid(Vec3::ZERO, Vec3::X, Vec3::Y, [10, 10])).unwrap()
    }

    /// Returns a colour that is linear in x and y.
    fn ramp(p: Vec3) -> [u8; 3] {
        [(200.0 * p.x) as u8 + 20, (100.0 * p.y) as u8 + 50, (80.0 * (p.x + p.y)) as u8]
    }

    fn cloud(positions: Vec<Vec3>, color: impl Fn(Vec3) -> [u8; 3]) -> PointCloud {
        PointCloud { colors: positions.iter().map(|p| color(*p)).collect(), positions, faces: Vec::new() }
    }

    fn colored(mesh: &TriMesh, clouds: &[PointCloud]) -> ColoredVertices {
        let nearest_faces = NearestFaces::new(mesh);
        let mut colors = VertexColors::new(&nearest_faces);
        clouds.iter().for_each(|cloud| colors.add(cloud));
        colors.finish()
    }

    #[test]
    fn a_ramp_of_colours_comes_back_at_the_vertices() {
        let mesh = floor();
        let points = (0..100_000u32).map(|i| {
            // Multiples of two irrational steps fill the square evenly.
            let u = (f64::from(i) * 0.754_877_666).fract();
            let v = (f64::from(i) * 0.569_840_29).fract();
            vec3(u as f32, v as f32, 0.01)
        });
        let found = colored(&mesh, &[cloud(points.collect(), ramp)]);
        assert_eq!((found.points, found.far_points, found.spread_m2, found.bare_m2), (100_000, 0, 0.0, 0.0));
        assert!((found.blurred_m2 - 1.0).abs() < 1e-6, "{}", found.blurred_m2);
        for (p, color) in mesh.positions().iter().zip(&found.colors) {
            let is_inside = [p.x, p.y].iter().all(|v| (0.05..0.95).contains(v));
            // At the border, the neighbourhood is one-sided, and its mean belongs to a place further in.
            let most = if is_inside { 1 } else { 8 };
            let off = color.iter().zip(ramp(*p)).map(|(a, b)| a.abs_diff(b)).max().unwrap();
            assert!(off <= most, "{p}: {color:?} for {:?}", ramp(*p));
        }
    }

    #[test]
    fn colours_spread_to_where_no_point_is_and_not_to_what_is_apart() {
        // A second floor beside the first, without points.
        let mut parts = primitives::grid(Vec3::ZERO, Vec3::X, Vec3::Y, [10, 10]);
        parts.append(primitives::grid(vec3(2.0, 0.0, 0.0), Vec3::X, Vec3::Y, [2, 2]));
        let mesh = TriMesh::new(parts).unwrap();
        let red = cloud((0..500).map(|i| vec3(0.0005 * i as f32, 0.52, 0.0)).collect(), |_| [200, 0, 0]);
        let far = cloud(vec![vec3(2.5, 0.5, 0.5), vec3(f32::NAN, 0.0, 0.0)], |_| [0, 255, 0]);
        let found = colored(&mesh, &[red, far]);
        assert_eq!(found.colors[..121], [[200, 0, 0]; 121]);
        assert_eq!(found.colors[121..], [DEFAULT_COLOR; 9]);
        assert_eq!((found.points, found.far_points), (502, 2));
        assert!((found.bare_m2 - 1.0).abs() < 1e-6, "{found:?}");
        assert!((0.9..1.0).contains(&found.spread_m2), "{found:?}");
    }

    #[test]
    fn vertices_at_one_place_have_one_colour() {
        // Two triangles that share an edge in space but no vertex.
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::X, vec3(1.0, 1.0, 0.0), vec3(-0.0, 1.0, -0.0)];
        let mesh = TriMesh::from_faces(corners.to_vec(), vec![[0, 1, 2], [3, 4, 5]]).unwrap();
        let found = colored(&mesh, &[cloud(vec![vec3(0.6, 0.3, 0.0)], |_| [90, 80, 70])]);
        assert_eq!((found.colors, found.blurred_m2), (vec![[90, 80, 70]; 6], 0.0));
    }

    fn color_of_wall(p: Vec3) -> [u8; 3] {
        if p.z > 0.0 { [10, 20, 30] } else { [200, 100, 0] }
    }

    #[test]
    fn colours_of_two_walls_do_not_mix_in_their_corner() {
        let corners = [Vec3::ZERO, Vec3::X, Vec3::Y, Vec3::ZERO, Vec3::Y, Vec3::Z];
        let mesh = TriMesh::from_faces(corners.to_vec(), vec![[0, 1, 2], [3, 4, 5]]).unwrap();
        let both = cloud(vec![vec3(0.3, 0.3, 0.0), vec3(0.0, 0.3, 0.3)], color_of_wall);
        let [floor, wall] = [[200, 100, 0], [10, 20, 30]];
        assert_eq!(colored(&mesh, &[both]).colors, [floor, floor, floor, wall, wall, wall]);
        // A wall without points takes the colours of the corner.
        let one = colored(&mesh, &[cloud(vec![vec3(0.3, 0.3, 0.0)], color_of_wall)]);
        assert_eq!((one.colors, one.spread_m2, one.bare_m2), (vec![floor; 6], 0.5, 0.0));
    }

    fn cloud_of(points: &[(f32, f32, f32, [u8; 3])]) -> PointCloud {
        PointCloud {
            positions: points.iter().map(|(x, y, z, _)| vec3(*x, *y, *z)).collect(),
            colors: points.iter().map(|(.., color)| *color).collect(),
            faces: Vec::new(),
        }
    }

    proptest! {
        #[test]
        fn blocks_and_their_order_change_nothing(
            points in prop::collection::vec(
                ((-0.1..1.1f32), (-0.1..1.1f32), (-0.15..0.15f32), any::<[u8; 3]>()),
                1..200,
            ),
            at in 0usize..200,
        ) {
            let mesh = floor();
            let (a, b) = points.split_at(at.min(points.len()));
            let parts = [cloud_of(b), cloud_of(a)];
            prop_assert_eq!(colored(&mesh, &[cloud_of(&points)]), colored(&mesh, &parts));
        }
    }
}
