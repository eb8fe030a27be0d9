//! Images, a tile of pixels at a time.
//!
//! All rays of an image start at one point, so each face is prepared once an image (its [`Cone`]: three planes through
//! the origin and one of the face), and the tree is walked once a tile, front to back, with the pyramid around the
//! tile's rays. A pixel's direction is a sum, d(i, j) = x(i)·c(j) + lift·s(j), in perspective views and panoramas
//! alike: so a plane's value at a pixel costs a multiplication and an addition.
//!
//! These values are `f32` with a bound on their error. A pixel whose answer they cannot tell — too near an edge, or
//! with a second face almost as near as the first — is cast again by the exact [`RayCaster`]. So a tile gives what
//! single rays give, pixel for pixel, whatever the processor.

use crate::cone::{Cone, Plane};
use crate::fan::{Fan, TILE_HEIGHT, TILE_WIDTH, Tile};
use crate::ray::RayCaster;
use crate::wide::{self, Work};
use crate::{Hits, NO_FACE, Scene};
use glam::DVec3;
use s3d_geom::{Camera, Raster};

/// The rounding of `f32`, times the number of roundings that one value goes through, generously.
const ROUNDING: f64 = 16.0 * (0.5 * f32::EPSILON) as f64;
/// A pixel trusts 1/t only if it is known to this relative error.
const TRUSTED: f32 = 1e-5;
/// Two values of 1/t that differ by less are for the exact caster to order: two errors, and more.
const CLOSE: f32 = 2.5e-5;

/// Casts the rays through the given columns and rows of the image.
pub(crate) fn cast(scene: &Scene<'_>, camera: &Camera, columns: &[u32], rows: &[u32]) -> Hits {
    wide::run(Cast { scene, camera, columns, rows })
}

struct Cast<'a> {
    scene: &'a Scene<'a>,
    camera: &'a Camera,
    columns: &'a [u32],
    rows: &'a [u32],
}

impl Work for Cast<'_> {
    type Output = Hits;

    #[inline(always)]
    fn run(self) -> Hits {
        image(self.scene, self.camera, self.columns, self.rows)
    }
}

#[inline(always)]
fn image(scene: &Scene<'_>, camera: &Camera, columns: &[u32], rows: &[u32]) -> Hits {
    let (width, height) = (columns.len(), rows.len());
    let mut face = Raster::filled(width as u32, height as u32, NO_FACE);
    let mut depth = Raster::filled(width as u32, height as u32, f32::INFINITY);
    if width == 0 || height == 0 || !camera.pose.location.is_finite() {
        return Hits { face, depth };
    }
    let fan = Fan::new(camera, columns, rows);
    let mut walk = Walk::new(scene, camera.pose.location);
    let mut caster = RayCaster::new(scene, camera.pose.location);
    let mut pixels = Pixels::new();
    for y in (0..height).step_by(TILE_HEIGHT) {
        for x in (0..width).step_by(TILE_WIDTH) {
            let tile = fan.tile(x, y, scene, camera.pose.location);
            pixels.clear(&tile);
            walk.fill(&tile, &mut pixels);
            for j in 0..tile.height {
                let start = (y + j) * width + x;
                let faces = &mut face.pixels_mut()[start..start + tile.width];
                let depths = &mut depth.pixels_mut()[start..start + tile.width];
                for i in 0..tile.width {
                    let at = j * TILE_WIDTH + i;
                    let (best, rival) = (pixels.best[at], pixels.rival[at]);
                    if rival > 0.0 && rival >= best * (1.0 - CLOSE) {
                        if let Some(hit) = caster.cast(fan.direction(x + i, y + j)) {
                            (faces[i], depths[i]) = (hit.face, hit.t as f32);
                        }
                    } else if best > 0.0 {
                        let seen = &walk.seen[pixels.seen[at] as usize];
                        let d = fan.direction(x + i, y + j);
                        faces[i] = seen.face;
                        depths[i] =
                            seen.plane.distance(d).unwrap_or_else(|| walk.distance(seen.face, d)) as f32;
                    }
                }
            }
        }
    }
    Hits { face, depth }
}

/// What a tile's pixels know so far. 1/t is used in place of t: it is linear in the direction, and 0 for nothing.
struct Pixels {
    /// 1/t of the nearest face that is certainly hit.
    best: [f32; TILE_WIDTH * TILE_HEIGHT],
    /// Which face that is: an index into [`Walk::seen`].
    seen: [u32; TILE_WIDTH * TILE_HEIGHT],
    /// The largest 1/t of the other faces that are hit, or may be.
    rival: [f32; TILE_WIDTH * TILE_HEIGHT],
}

impl Pixels {
    fn new() -> Self {
        Self {
            best: [0.0; TILE_WIDTH * TILE_HEIGHT],
            seen: [0; TILE_WIDTH * TILE_HEIGHT],
            rival: [0.0; TILE_WIDTH * TILE_HEIGHT],
        }
    }

    /// No pixel sees anything; those beyond the image's edge are done.
    fn clear(&mut self, tile: &Tile) {
        self.rival.fill(0.0);
        self.best.fill(0.0);
        if tile.width < TILE_WIDTH || tile.height < TILE_HEIGHT {
            for (j, row) in self.best.chunks_exact_mut(TILE_WIDTH).enumerate() {
                let inside = if j < tile.height { tile.width } else { 0 };
                row[inside..].fill(f32::INFINITY);
            }
        }
    }

    /// 1/t of the pixel that sees farthest.
    #[inline(always)]
    fn farthest(&self) -> f32 {
        let mut lanes = [f32::INFINITY; TILE_WIDTH];
        for row in self.best.chunks_exact(TILE_WIDTH) {
            for i in 0..TILE_WIDTH {
                lanes[i] = if row[i] < lanes[i] { row[i] } else { lanes[i] };
            }
        }
        lanes.iter().fold(f32::INFINITY, |a, &b| a.min(b))
    }

    /// Shows the tile a face, of whose edges `N` cross it.
    #[inline(always)]
    fn draw<const N: usize>(&mut self, tile: &Tile, edges: &[Linear; 3], edge_error: f32, face: &Shown) {
        for j in 0..TILE_HEIGHT {
            let c = tile.c[j];
            let start = j * TILE_WIDTH;
            let best: &mut [f32; TILE_WIDTH] =
                (&mut self.best[start..start + TILE_WIDTH]).try_into().unwrap();
            let rival: &mut [f32; TILE_WIDTH] =
                (&mut self.rival[start..start + TILE_WIDTH]).try_into().unwrap();
            let seen: &mut [u32; TILE_WIDTH] =
                (&mut self.seen[start..start + TILE_WIDTH]).try_into().unwrap();
            for i in 0..TILE_WIDTH {
                let mut inside = f32::INFINITY;
                for edge in &edges[..N] {
                    let e = edge.columns[i] * c + edge.rows[j];
                    inside = if e < inside { e } else { inside };
                }
                let q = face.inverse_t.columns[i] * c + face.inverse_t.rows[j];
                let certain = (inside > edge_error) & (q >= face.trusted);
                let possible = (inside >= -edge_error) & !certain;
                let sure = if certain { q } else { 0.0 };
                let unsure = if possible { q + face.error } else { 0.0 };
                let old = best[i];
                let loser = if sure < old { sure } else { old };
                let rest = if loser > unsure { loser } else { unsure };
                rival[i] = if rest > rival[i] { rest } else { rival[i] };
                seen[i] = if sure > old { face.seen } else { seen[i] };
                best[i] = if sure > old { sure } else { old };
            }
        }
    }
}

/// A function of the pixel: columns[i] · c(j) + rows[j].
#[derive(Clone, Copy)]
struct Linear {
    columns: [f32; TILE_WIDTH],
    rows: [f32; TILE_HEIGHT],
}

impl Linear {
    const ZERO: Self = Self { columns: [0.0; TILE_WIDTH], rows: [0.0; TILE_HEIGHT] };

    /// v · d at the pixels of `tile`, to `ROUNDING` · (|v · center| + |v| · radius).
    #[inline(always)]
    fn new(v: DVec3, tile: &Tile) -> Self {
        let mut linear = Self::ZERO;
        let (x, y, z) = (v.x as f32, v.y as f32, v.z as f32);
        for i in 0..TILE_WIDTH {
            linear.columns[i] = x * tile.dx[0][i] + y * tile.dx[1][i] + z * tile.dx[2][i];
        }
        let (across, up) = (v.dot(tile.x), v.dot(tile.lift));
        for j in 0..TILE_HEIGHT {
            linear.rows[j] = (across * tile.exact_c[j] + up * tile.exact_s[j]) as f32;
        }
        linear
    }
}

/// A face about to be drawn on a tile.
struct Shown {
    seen: u32,
    inverse_t: Linear,
    /// A bound on the error of `inverse_t`.
    error: f32,
    /// From this value on, `inverse_t` is known to [`TRUSTED`].
    trusted: f32,
}

/// A face, prepared for the image.
struct Seen {
    face: u32,
    plane: Plane,
    /// The unit normals of the planes through the origin and an edge, inwards.
    edges: [DVec3; 3],
    /// A bound on the error of these, the largest.
    edge_error: f64,
    /// 1/t = inverse_t · d.
    inverse_t: DVec3,
    /// Its length; infinite if `inverse_t` is not known well enough, too near the plane.
    steepness: f64,
}

impl Seen {
    fn new(scene: &Scene<'_>, face: u32, origin: DVec3) -> Option<Self> {
        let cone = Cone::new(scene.mesh(), face, origin)?;
        let [a, b, c] = cone.corners;
        let mut edge_error = 0.0;
        let edges = [(b, c), (c, a), (a, b)].map(|(p, q)| {
            let n = p.cross(q);
            let length = n.length();
            edge_error = f64::max(edge_error, 1e-15 + 4e-16 * p.length() * q.length() / length);
            if length > 0.0 { n / length } else { DVec3::ZERO }
        });
        let Plane { normal, offset } = cone.plane;
        let known = offset > 1e-7 * normal.length() * a.length();
        let inverse_t = if known { normal / offset } else { DVec3::ZERO };
        let steepness = if known { inverse_t.length() } else { f64::INFINITY };
        Some(Self { face, plane: cone.plane, edges, edge_error, inverse_t, steepness })
    }
}

/// Walks the tree with one tile after another.
struct Walk<'s, 'm> {
    scene: &'s Scene<'m>,
    origin: DVec3,
    /// By place in the tree's list of faces: 0 before it is met, 1 if it is in the origin's plane, else 2 + its index in
    /// `seen`.
    met: Vec<u32>,
    seen: Vec<Seen>,
    stack: Vec<(f32, u32)>,
}

impl<'s, 'm> Walk<'s, 'm> {
    fn new(scene: &'s Scene<'m>, origin: DVec3) -> Self {
        let met = vec![0; scene.bvh().primitive_indices.len()];
        Self { scene, origin, met, seen: Vec::new(), stack: Vec::with_capacity(64) }
    }

    /// The distance of a face that is seen too edge-on for its plane to tell.
    #[cold]
    fn distance(&self, face: u32, d: DVec3) -> f64 {
        Cone::new(self.scene.mesh(), face, self.origin).map_or(f64::INFINITY, |cone| cone.distance(d))
    }

    #[inline(always)]
    fn fill(&mut self, tile: &Tile, pixels: &mut Pixels) {
        let nodes = &self.scene.bvh().nodes;
        let mut farthest = 0.0;
        self.stack.clear();
        self.stack.extend(tile.enter(nodes[0].aabb()).map(|t| (t, 0)));
        while let Some((t_enter, index)) = self.stack.pop() {
            if hidden(t_enter, farthest) {
                continue;
            }
            let node = &nodes[index as usize];
            let first = node.first_index;
            if node.is_leaf() {
                let mut drawn = false;
                for place in first..first + node.prim_count {
                    drawn |= self.show(place, tile, pixels, farthest);
                }
                if drawn {
                    farthest = pixels.farthest();
                }
                continue;
            }
            let left = tile.enter(nodes[first as usize].aabb()).filter(|&t| !hidden(t, farthest));
            let right = tile.enter(nodes[first as usize + 1].aabb()).filter(|&t| !hidden(t, farthest));
            match (left, right) {
                (Some(l), Some(r)) if l <= r => self.stack.extend([(r, first + 1), (l, first)]),
                (Some(l), Some(r)) => self.stack.extend([(l, first), (r, first + 1)]),
                (Some(l), None) => self.stack.push((l, first)),
                (None, Some(r)) => self.stack.push((r, first + 1)),
                (None, None) => {}
            }
        }
    }

    /// Draws the face at `place` of the tree's list; says whether it may have changed the tile.
    #[inline(always)]
    fn show(&mut self, place: u32, tile: &Tile, pixels: &mut Pixels, farthest: f32) -> bool {
        let index = match self.met[place as usize] {
            0 => {
                let face = self.scene.bvh().primitive_indices[place as usize];
                let Some(seen) = Seen::new(self.scene, face, self.origin) else {
                    self.met[place as usize] = 1;
                    return false;
                };
                self.seen.push(seen);
                self.met[place as usize] = self.seen.len() as u32 + 1;
                self.seen.len() as u32 - 1
            }
            1 => return false,
            met => met - 2,
        };
        let seen = &self.seen[index as usize];
        let radius = tile.radius;
        let edge_error = 2.0 * ROUNDING * radius + seen.edge_error * tile.reach;
        let mut crossing = [DVec3::ZERO; 3];
        let mut count = 0;
        for edge in &seen.edges {
            let inside = edge.dot(tile.center);
            if inside < -(radius + edge_error) {
                return false;
            }
            if inside <= radius + edge_error || !edge_error.is_finite() {
                crossing[count] = *edge;
                count += 1;
            }
        }
        let (middle, spread) = (seen.inverse_t.dot(tile.center), seen.steepness * radius);
        let error = ROUNDING * (middle.abs() + spread);
        if ((middle + spread + error) as f32) < farthest * (1.0 - 2.0 * CLOSE) {
            return false;
        }
        let mut edges = [Linear::ZERO; 3];
        for k in 0..count {
            edges[k] = Linear::new(crossing[k], tile);
        }
        let error = error as f32;
        let inverse_t = Linear::new(seen.inverse_t, tile);
        let face = Shown { seen: index, inverse_t, error, trusted: error / TRUSTED };
        let edge_error = (edge_error * 1.001) as f32;
        match count {
            0 => pixels.draw::<0>(tile, &edges, edge_error, &face),
            1 => pixels.draw::<1>(tile, &edges, edge_error, &face),
            2 => pixels.draw::<2>(tile, &edges, edge_error, &face),
            _ => pixels.draw::<3>(tile, &edges, edge_error, &face),
        }
        true
    }
}

/// Whether what begins at distance `t_enter` cannot be the nearest where the tile sees up to 1/t = `farthest`.
#[inline(always)]
fn hidden(t_enter: f32, farthest: f32) -> bool {
    t_enter * farthest * (1.0 - 2.0 * CLOSE) > 1.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cast_ray_by_ray;
    use glam::{Vec3, vec3};
    use proptest::prelude::*;
    use s3d_geom::{Pose, TriMesh};

    proptest! {
        #![proptest_config(ProptestConfig::with_cases(48))]

        /// With and without wide registers, and one ray at a time. Corners on a coarse lattice share edges, overlap and
        /// lie in line with the camera.
        #[test]
        fn any_way_gives_the_same_image(
            corners in prop::collection::vec(prop::array::uniform3(-3i8..=3), 3..40),
            picks in prop::collection::vec(any::<prop::sample::Index>(), 3..90),
            at in prop::array::uniform3(-6i8..=6), yaw in -3.2..3.2f64, pitch in -1.5..1.5f64, panorama in any::<bool>(),
        ) {
            let corners: Vec<Vec3> = corners.iter().map(|p| Vec3::from(p.map(f32::from))).collect();
            let faces = picks.chunks_exact(3).map(|f| [0, 1, 2].map(|k| f[k].index(corners.len()) as u32)).collect();
            let Ok(mesh) = TriMesh::from_faces(corners, faces) else { return Ok(()) };
            let scene = Scene::new(&mesh);
            let level = Pose::level(DVec3::from(at.map(f64::from)) * 0.5, 0.0);
            // Along the axes rays meet the lattice's corners and edges exactly.
            let pose = if picks.len() % 2 == 0 { level } else { level.turned(yaw, pitch) };
            let camera = match panorama {
                true => Camera::equirectangular(pose, 50),
                false => Camera::perspective(pose, 1.7, 37, 23),
            };
            let (columns, rows): (Vec<u32>, Vec<u32>) = ((0..camera.width).collect(), (0..camera.height).collect());
            let image = cast(&scene, &camera, &columns, &rows);
            let narrow = Cast { scene: &scene, camera: &camera, columns: &columns, rows: &rows }.run();
            prop_assert_eq!(&image, &narrow);
            prop_assert_eq!(&image, &cast_ray_by_ray(&scene, &camera, 1));
        }
    }

    #[test]
    fn a_face_through_the_image_centre_splits_it_in_halves() {
        // The edge x = 0 runs through the middle of a view of even width: half of the pixels see the face.
        let corners = vec![vec3(0.0, 1.0, -9.0), vec3(0.0, 1.0, 9.0), vec3(9.0, 1.0, 0.0)];
        let mesh = TriMesh::from_faces(corners, vec![[0, 1, 2]]).unwrap();
        let scene = Scene::new(&mesh);
        let camera = Camera::perspective(Pose::level(DVec3::ZERO, 0.0), 1.0, 64, 64);
        let hits = crate::cast(&scene, &camera);
        for (k, face) in hits.face.pixels().iter().enumerate() {
            assert_eq!(*face == 0, k % 64 >= 32);
        }
    }
}
