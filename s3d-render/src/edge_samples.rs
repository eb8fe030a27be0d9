//! Removes stair-steps from the RGB image: a pixel at an edge is sampled in several places.
//!
//! All modalities see one ray through the centre of each pixel, so that they are registered. Within a
//! surface, the texture filter makes colours smooth. Where another surface begins, several places of the
//! pixel tell the share of each surface. The colour of each surface is taken once, at the mean of its places,
//! since the texture filter covers a whole pixel.

use crate::hits::{Hits, NO_FACE};
use crate::ray::caster::RayCaster;
use crate::ray::cone::{Cone, Plane};
use crate::scene::Scene;
use crate::shade::mip_maps::{MipMaps, TextureFilter};
use crate::shade::patch::FaceCache;
use crate::shade::pixel_color::PixelByPixel;
use glam::{DVec2, DVec3, dvec2};
use s3d_geom::{Camera, Raster, Rays, TriMesh};

/// Two neighbouring pixels are at an edge if their surfaces meet at an angle of more than 15°: its cosine.
const FLAT: f32 = 0.966;

/// Two neighbouring pixels are at an edge if one point lies farther than this from the plane of the other, as
/// a share of its distance.
const STEP: f64 = 0.01;

/// Neighbours make no visible stair-step if no channel of their colours differs by more than this.
const CONTRAST: u8 = 8;

/// Replaces the colour of each pixel at an edge by the mean colour of the faces in it. Each face counts by
/// its share of `samples` places, which are spread alike in each pixel. `image` is the image that
/// [`crate::rgb_image_with`] makes from the same arguments.
///
/// A pixel is at an edge if one of its four neighbours shows nothing, or if a neighbour differs by more than
/// 8 of 255 in a channel and sees another material, or a face that lies behind, in front, or is turned away
/// by more than 15°. Pixels that show nothing keep their colour.
///
/// # Panics
/// If `hits` and `image` are not of the camera's size.
pub fn sample_edges(
    scene: &Scene<'_>,
    mip_maps: &MipMaps,
    hits: &Hits,
    camera: &Camera,
    filter: &TextureFilter,
    samples: u32,
    image: &mut Raster<[u8; 3]>,
) {
    let size = (camera.width, camera.height);
    assert_eq!((hits.face.width(), hits.face.height()), size, "the hits are of another camera");
    assert_eq!((image.width(), image.height()), size, "the image is of another camera");

    if samples < 2 {
        return;
    }

    let rays = camera.rays();
    let pairs = vec![FacePair::NONE; PAIRS];
    let edges = Edges { mesh: scene.mesh(), hits, colors: image.pixels(), rays: &rays, pairs }
        .find(camera.is_panorama());

    let mut sampler = Sampler {
        mesh: scene.mesh(),
        hits,
        camera,
        rays: &rays,
        places: places(samples),
        colors: PixelByPixel::new(scene, mip_maps, camera, filter),
        caster: RayCaster::new(scene, camera.pose.location),
        fronts: FaceCache::new(),
        near: Vec::with_capacity(9),
        shown: Vec::with_capacity(9),
    };

    let width = camera.width as usize;
    for (pixel, color) in image
        .pixels_mut()
        .iter_mut()
        .enumerate()
        .filter(|(pixel, _)| edges[*pixel])
    {
        *color = sampler.color((pixel % width) as u32, (pixel / width) as u32, *color);
    }
}

/// Returns places in a pixel, 0 to 1. Each has a row and a column of its own; the columns follow the golden
/// ratio.
fn places(samples: u32) -> Vec<DVec2> {
    let mut columns: Vec<u32> = (0..samples).collect();
    columns.sort_by(|a, b| golden_turn(*a).total_cmp(&golden_turn(*b)));

    (0..samples)
        .zip(columns)
        .map(|(row, column)| dvec2(middle_of(column, samples), middle_of(row, samples)))
        .collect()
}

fn golden_turn(k: u32) -> f64 {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    (f64::from(k) * GOLDEN).fract()
}

fn middle_of(k: u32, samples: u32) -> f64 {
    (f64::from(k) + 0.5) / f64::from(samples)
}

/// The number of pairs of faces that are remembered, a power of two: neighbours meet in many pixels.
const PAIRS: usize = 4096;

/// The relation of two faces whose pixels are neighbours.
#[derive(Clone, Copy)]
struct FacePair {
    faces: [u32; 2],
    meeting: Meeting,
}

#[derive(Clone, Copy, PartialEq)]
enum Meeting {
    /// There is an edge wherever they meet.
    Edge,
    /// One continues the other.
    Smooth,
    /// They face the same way: the distance between their planes decides.
    Parallel,
}

impl FacePair {
    const NONE: Self = Self { faces: [NO_FACE; 2], meeting: Meeting::Edge };
}

/// Finds the pixels at edges.
struct Edges<'a> {
    mesh: &'a TriMesh,
    hits: &'a Hits,
    /// The colours at the pixels' centres.
    colors: &'a [[u8; 3]],
    rays: &'a Rays,
    pairs: Vec<FacePair>,
}

impl Edges<'_> {
    /// Returns whether each pixel is at an edge. If `wraps`, the last column is beside the first.
    fn find(mut self, wraps: bool) -> Vec<bool> {
        let faces = self.hits.face.pixels();
        let width = self.hits.face.width() as usize;
        let height = self.hits.face.height() as usize;

        let mut edges = vec![false; faces.len()];
        for y in 0..height {
            let row = y * width;
            for i in row..row + width {
                let right = if i + 1 < row + width { i + 1 } else { row };
                let is_beside = right > i || wraps;
                if is_beside && faces[i] != faces[right] && self.is_edge(i, right) {
                    (edges[i], edges[right]) = (true, true);
                }
                // The neighbour below.

                let below = i + width;
                if below < faces.len() && faces[i] != faces[below] && self.is_edge(i, below) {
                    (edges[i], edges[below]) = (true, true);
                }
            }
        }

        edges
            .iter_mut()
            .zip(faces)
            .for_each(|(edge, face)| *edge &= *face != NO_FACE);
        edges
    }

    /// Tells whether an edge passes between two pixels that show different faces.
    fn is_edge(&mut self, i: usize, j: usize) -> bool {
        let faces = self.hits.face.pixels();
        let f = faces[i];
        let g = faces[j];
        if f == NO_FACE || g == NO_FACE {
            return true;
        }
        let color = self.colors[i];
        let other = self.colors[j];
        if color.iter().zip(other).all(|(a, b)| a.abs_diff(b) <= CONTRAST) {
            return false;
        }

        let place = (f ^ g.wrapping_mul(0x9e37_79b1)) as usize % PAIRS;
        if self.pairs[place].faces != [f, g] {
            self.pairs[place] = FacePair { faces: [f, g], meeting: meeting(self.mesh, f, g) };
        }

        match self.pairs[place].meeting {
            Meeting::Edge => true,
            Meeting::Smooth => false,
            Meeting::Parallel => {
                let width = self.hits.face.width();
                let depth = self.hits.depth.pixels();
                let point = |i: usize| {
                    let x = i as u32 % width;
                    let y = i as u32 / width;
                    self.rays.at(x, y) * f64::from(depth[i])
                };
                let p = point(i);
                let q = point(j);
                let off = |face| self.mesh.normal(face).as_dvec3().dot(q - p).abs();
                off(f).min(off(g)) > STEP * p.length().min(q.length())
            }
        }
    }
}

/// Returns how two faces meet, as far as it does not depend on the pixels.
fn meeting(mesh: &TriMesh, f: u32, g: u32) -> Meeting {
    if mesh.material_of(f) != mesh.material_of(g) || mesh.normal(f).dot(mesh.normal(g)).abs() < FLAT {
        return Meeting::Edge;
    }
    let a = mesh.triangle(f);
    let b = mesh.triangle(g);
    if a.iter().any(|corner| b.contains(corner)) {
        Meeting::Smooth
    } else {
        Meeting::Parallel
    }
}

/// A face in front of the camera, prepared for many rays.
#[derive(Clone, Copy)]
struct Front {
    /// A direction hits the face if it is on the inner side of each plane.
    sides: [DVec3; 3],
    plane: Plane,
}

impl Front {
    fn new(mesh: &TriMesh, face: u32, origin: DVec3) -> Option<Self> {
        let Cone { corners: [a, b, c], plane } = Cone::new(mesh, face, origin)?;
        Some(Self { sides: [b.cross(c), c.cross(a), a.cross(b)], plane })
    }

    /// Returns the multiple of `direction` that lies on the face. Rounding decides at the rim of the face: a
    /// ray that misses all faces there is cast exactly.
    fn distance(&self, direction: DVec3) -> Option<f64> {
        let is_inside = self.sides.iter().all(|side| side.dot(direction) >= 0.0);
        if is_inside {
            self.plane.distance(direction)
        } else {
            None
        }
    }
}

struct Sampler<'a, 'm> {
    mesh: &'a TriMesh,
    hits: &'a Hits,
    camera: &'a Camera,
    rays: &'a Rays,
    places: Vec<DVec2>,
    colors: PixelByPixel<'a>,
    caster: RayCaster<'a, 'm>,
    fronts: FaceCache<Option<Front>>,
    /// The faces of the current pixel and of the pixels around it.
    near: Vec<(u32, Option<Front>)>,
    /// The faces that the current pixel shows: the number of their places, and the sum of these places.
    shown: Vec<(u32, u32, DVec2)>,
}

impl Sampler<'_, '_> {
    /// Returns the mean colour of a pixel whose centre has the colour `center`.
    fn color(&mut self, x: u32, y: u32, center: [u8; 3]) -> [u8; 3] {
        self.gather(x, y);
        self.shown.clear();
        // Which face each place shows.

        for k in 0..self.places.len() {
            let place = self.places[k];
            let direction = self.direction(x, y, place);
            let near = self.nearest(direction);
            let Some(face) = near.or_else(|| self.caster.cast(direction).map(|hit| hit.face)) else {
                continue;
            };
            match self.shown.iter_mut().find(|shown| shown.0 == face) {
                Some(shown) => (shown.1, shown.2) = (shown.1 + 1, shown.2 + place),
                None => self.shown.push((face, 1, place)),
            }
        }

        // The colour of each face, in the middle of its places.
        let mut sum = [0u32; 3];
        let mut seen = 0;
        for i in 0..self.shown.len() {
            let (face, count, places) = self.shown[i];
            let color = if face == self.hits.face.at(x, y) {
                center
            } else {
                let direction = self.direction(x, y, places / f64::from(count));
                self.colors.along(face, direction, y as usize)
            };
            sum = std::array::from_fn(|c| sum[c] + count * u32::from(color[c]));
            seen += count;
        }

        if seen == 0 {
            return center;
        }
        match sum.map(|sum| ((sum + seen / 2) / seen) as u8) {
            [0, 0, 0] => [1; 3],
            color => color,
        }
    }

    /// Returns the direction of the ray through a place of a pixel.
    fn direction(&self, x: u32, y: u32, place: DVec2) -> DVec3 {
        let at = dvec2(f64::from(x), f64::from(y)) + place;
        match self.rays {
            Rays::Perspective { x_step, y_step, origin } => *origin + *x_step * at.x + *y_step * at.y,
            Rays::Equirectangular { .. } => self.camera.direction(at.x, at.y),
        }
    }

    /// Collects the faces of a pixel and of the pixels around it. Few rays between their centres hit another
    /// face first.
    fn gather(&mut self, x: u32, y: u32) {
        let width = self.camera.width;
        let height = self.camera.height;
        self.near.clear();
        for v in y.saturating_sub(1)..=(y + 1).min(height - 1) {
            let row = self.hits.face.row(v);
            for &face in &row[x.saturating_sub(1) as usize..=(x + 1).min(width - 1) as usize] {
                if face != NO_FACE && self.near.iter().all(|near| near.0 != face) {
                    let location = self.camera.pose.location;
                    let front = *self.fronts.get(face, || Front::new(self.mesh, face, location));
                    self.near.push((face, front));
                }
            }
        }
    }

    /// Returns the nearest of the collected faces. The lowest index wins a tie.
    fn nearest(&self, direction: DVec3) -> Option<u32> {
        let hit =
            |(face, front): &(u32, Option<Front>)| front.as_ref()?.distance(direction).map(|t| (*face, t));
        let hits = self.near.iter().filter_map(hit);
        hits.min_by(|a, b| a.1.total_cmp(&b.1).then(a.0.cmp(&b.0)))
            .map(|(face, _)| face)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{cast, rgb_image};
    use glam::vec3;
    use s3d_geom::{Material, MeshParts, Pose, TriMesh};

    fn material(color: [u8; 3]) -> Material {
        Material { name: format!("{color:?}"), color, texture: None }
    }

    fn upright(y: f32, [a, b, c, d]: [(f32, f32); 4]) -> [glam::Vec3; 4] {
        [a, b, c, d].map(|(x, z)| vec3(x, y, z))
    }

    /// A white wall at y = 4. A metre in front of it is a black board whose lower edge rises by one in ten.
    /// There is nothing beside the wall.
    fn board() -> TriMesh {
        let wall = upright(4.0, [(-3.0, -3.0), (3.0, -3.0), (3.0, 3.0), (-3.0, 3.0)]);
        let front = upright(3.0, [(-1.0, -0.1), (1.0, 0.1), (1.0, 1.0), (-1.0, 1.0)]);
        let parts = MeshParts {
            positions: wall.into_iter().chain(front).collect(),
            faces: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6], [4, 6, 7]],
            face_materials: vec![0, 0, 1, 1],
            materials: vec![material([240; 3]), material([40; 3])],
            ..MeshParts::default()
        };
        TriMesh::new(parts).unwrap()
    }

    fn images(camera: &Camera, samples: u32) -> (Raster<[u8; 3]>, Raster<[u8; 3]>, Hits) {
        let mesh = board();
        let scene = Scene::new(&mesh);
        let textures = MipMaps::new(&mesh);
        let hits = cast(&scene, camera);
        let plain = rgb_image(&scene, &textures, &hits, camera);
        let mut image = plain.clone();
        let filter = TextureFilter::default();
        sample_edges(&scene, &textures, &hits, camera, &filter, samples, &mut image);
        (plain, image, hits)
    }

    fn pose() -> Pose {
        Pose::level(DVec3::ZERO, 0.0)
    }

    #[test]
    fn one_sample_is_the_image_itself() {
        let camera = Camera::perspective(pose(), 1.2, 64, 48);
        let (plain, image, _) = images(&camera, 1);
        assert_eq!(plain.pixels(), image.pixels());
    }

    /// The board's lower edge is z = x / 10 for x from −1 to 1, so the share of each pixel that the board
    /// covers is known.
    #[test]
    fn edges_have_the_mean_of_what_their_pixels_show() {
        let camera = Camera::perspective(pose(), 0.5, 64, 64);
        let f = camera.focal_px().x;
        let (plain, image, hits) = images(&camera, 16);
        let mut worst = 0.0f64;
        let mut before = 0.0f64;
        let mut between = 0;
        for (x, y) in (8..56).flat_map(|x| (20..44).map(move |y| (x, y))) {
            // The share of the pixel above the line, from 32 × 32 places.
            let covered = (0..1024).filter(|k| {
                let at = dvec2(
                    f64::from(x) + (f64::from(k % 32) + 0.5) / 32.0,
                    f64::from(y) + (f64::from(k / 32) + 0.5) / 32.0,
                );
                let p = (at - 32.0) / f * 3.0;
                -p.y > p.x / 10.0
            });

            let share = covered.count() as f64 / 1024.0;
            let expected = 240.0 - 200.0 * share;
            worst = worst.max((f64::from(image.at(x, y)[0]) - expected).abs());
            before = before.max((f64::from(plain.at(x, y)[0]) - expected).abs());
            between += u32::from(![40, 240].contains(&image.at(x, y)[0]));
        }

        assert!(before > 80.0 && worst < 20.0 && between > 30, "{before} {worst} {between}");

        // Pixels that show nothing keep their colour, and no pixel that shows a face is black.
        let seen = |face: &u32| *face != NO_FACE;
        assert!(
            image
                .pixels()
                .iter()
                .zip(hits.face.pixels())
                .all(|(c, f)| (*c != [0; 3]) == seen(f))
        );
    }

    #[test]
    fn every_camera_has_samples_and_flat_parts_stay() {
        for camera in [
            Camera::perspective(pose(), 2.4, 96, 96),
            Camera::pinhole(pose(), dvec2(40.0, 44.0), dvec2(20.0, 30.0), 96, 64).unwrap(),
            Camera::equirectangular(pose(), 128),
        ] {
            let (plain, image, hits) = images(&camera, 4);
            let differs = plain
                .pixels()
                .iter()
                .zip(image.pixels())
                .filter(|(a, b)| a != b)
                .count();
            assert!(differs > 10, "{differs}");

            for (x, y) in (1..camera.width - 1).flat_map(|x| (1..camera.height - 1).map(move |y| (x, y))) {
                let face = hits.face.at(x, y);
                let around = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)];
                if around
                    .iter()
                    .all(|(u, v)| hits.face.at(*u, *v) / 2 == face / 2 && face != NO_FACE)
                {
                    assert_eq!(plain.at(x, y), image.at(x, y));
                }
            }
        }
    }

    #[test]
    fn places_are_spread() {
        for n in [1, 2, 3, 4, 16, 64] {
            let all = places(n);
            let mean = all.iter().sum::<DVec2>() / f64::from(n);
            assert!(all.len() == n as usize && mean.abs_diff_eq(dvec2(0.5, 0.5), 1e-12), "{mean}");
            assert!(all.iter().all(|p| p.min_element() > 0.0 && p.max_element() < 1.0));
        }
    }
}
