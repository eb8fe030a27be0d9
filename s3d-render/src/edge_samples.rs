//! More samples a pixel where surfaces end or turn: the RGB image without stair-steps.
//!
//! One sample in the centre is what every modality has, so that they are registered. Within a surface the
//! texture's filter makes its colour smooth; where another surface begins, only more samples do.

use crate::hits::{Hits, NO_FACE};
use crate::ray::caster::{Hit, RayCaster};
use crate::ray::cone::Cone;
use crate::scene::Scene;
use crate::shade::mip_maps::{MipMaps, TextureFilter};
use crate::shade::pixel_color::PixelByPixel;
use glam::{DVec2, DVec3, dvec2};
use s3d_geom::{Camera, Projection, Raster, Rays};

/// Neighbours whose surfaces meet at more than this angle, 15°, are at an edge.
const FLAT: f32 = 0.966;

/// Or one of which lies farther than this from the other's plane, as a share of its distance.
const STEP: f64 = 0.01;

/// Replaces the colour of each pixel at an edge by the mean of `samples` places in it, spread alike in each.
/// `image` is that of [`crate::rgb_image_with`] for the same arguments. At an edge is a pixel one of whose
/// four neighbours shows nothing, another material, or another face that lies behind it, before it, or turned
/// away by more than 15°. Pixels that show nothing stay.
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
    // A sample is as large as its part of the pixel.
    let finer = f64::from(samples).sqrt().round().max(1.0);
    let fine = finer_camera(camera, finer as u32);
    let mut sampler = Sampler {
        scene,
        hits,
        camera,
        rays: camera.rays(),
        places: places(samples),
        rows: finer,
        colors: PixelByPixel::new(scene, mip_maps, &fine, filter),
        caster: RayCaster::new(scene, camera.pose.location),
        cones: Vec::with_capacity(9),
    };
    let edges = sampler.edges();
    let width = camera.width as usize;
    for (pixel, color) in image.pixels_mut().iter_mut().enumerate() {
        if edges[pixel] {
            *color = sampler.mean((pixel % width) as u32, (pixel / width) as u32).unwrap_or(*color);
        }
    }
}

/// Places in a pixel, 0 to 1: each in a row and a column of its own, which follow the golden ratio.
fn places(samples: u32) -> Vec<DVec2> {
    const GOLDEN: f64 = 0.618_033_988_749_894_9;
    let turn = |k: u32| (f64::from(k) * GOLDEN).fract();
    let mut columns: Vec<u32> = (0..samples).collect();
    columns.sort_by(|a, b| turn(*a).total_cmp(&turn(*b)));
    let middle = |k: u32| (f64::from(k) + 0.5) / f64::from(samples);
    (0..samples).zip(columns).map(|(row, column)| dvec2(middle(column), middle(row))).collect()
}

/// The same camera with more and smaller pixels.
fn finer_camera(camera: &Camera, times: u32) -> Camera {
    let projection = match camera.projection {
        Projection::Pinhole { focal_px, center_px } => {
            let by = f64::from(times);
            Projection::Pinhole { focal_px: focal_px * by, center_px: center_px * by }
        }
        other => other,
    };
    Camera { projection, width: camera.width * times, height: camera.height * times, ..*camera }
}

struct Sampler<'a, 'm> {
    scene: &'a Scene<'m>,
    hits: &'a Hits,
    camera: &'a Camera,
    rays: Rays,
    places: Vec<DVec2>,
    /// Rows of the finer camera in one of this.
    rows: f64,
    colors: PixelByPixel<'a>,
    caster: RayCaster<'a, 'm>,
    /// The faces around the pixel at hand.
    cones: Vec<(u32, Option<Cone>)>,
}

impl Sampler<'_, '_> {
    /// Which pixels are at an edge.
    fn edges(&self) -> Vec<bool> {
        let (width, height) = (self.camera.width, self.camera.height);
        let faces = self.hits.face.pixels();
        let mut edges = vec![false; faces.len()];
        let at = |x: u32, y: u32| y as usize * width as usize + x as usize;
        let wraps = self.camera.is_panorama();
        for (x, y) in (0..height).flat_map(|y| (0..width).map(move |x| (x, y))) {
            let right = if x + 1 < width { Some((x + 1, y)) } else { wraps.then_some((0, y)) };
            let down = (y + 1 < height).then_some((x, y + 1));
            for other in [right, down].into_iter().flatten() {
                let (a, b) = (at(x, y), at(other.0, other.1));
                if faces[a] != faces[b] && self.is_edge((x, y), other) {
                    (edges[a], edges[b]) = (true, true);
                }
            }
        }
        edges.iter_mut().zip(faces).for_each(|(edge, face)| *edge &= *face != NO_FACE);
        edges
    }

    /// Whether an edge passes between two pixels that show different faces.
    fn is_edge(&self, a: (u32, u32), b: (u32, u32)) -> bool {
        let (f, g) = (self.hits.face.at(a.0, a.1), self.hits.face.at(b.0, b.1));
        let mesh = self.scene.mesh();
        if f == NO_FACE || g == NO_FACE || mesh.material_of(f) != mesh.material_of(g) {
            return true;
        }
        let (n, m) = (mesh.normal(f), mesh.normal(g));
        if n.dot(m).abs() < FLAT {
            return true;
        }
        let point = |p: (u32, u32)| self.rays.at(p.0, p.1) * f64::from(self.hits.depth.at(p.0, p.1));
        let (p, q) = (point(a), point(b));
        let off = |n: DVec3| n.dot(q - p).abs();
        off(n.as_dvec3()).min(off(m.as_dvec3())) > STEP * p.length().min(q.length())
    }

    /// The mean colour of a pixel's places that see something.
    fn mean(&mut self, x: u32, y: u32) -> Option<[u8; 3]> {
        let are_large = self.gather(x, y);
        let (mut sum, mut seen) = ([0u32; 3], 0);
        for k in 0..self.places.len() {
            let place = self.places[k];
            let at = dvec2(f64::from(x), f64::from(y)) + place;
            let direction = self.camera.direction(at.x, at.y);
            let near = if are_large { self.nearest(direction) } else { None };
            let Some(hit) = near.or_else(|| self.caster.cast(direction)) else { continue };
            let row = (at.y * self.rows) as usize;
            let color = self.colors.along(hit.face, direction, row);
            sum = std::array::from_fn(|c| sum[c] + u32::from(color[c]));
            seen += 1;
        }
        let mean = |sum: u32| ((sum + seen / 2) / seen) as u8;
        (seen > 0).then(|| match sum.map(mean) {
            [0, 0, 0] => [1; 3],
            color => color,
        })
    }

    /// Takes the faces of a pixel and of those around it. Whether each is seen in two of them or more: then
    /// none is so small that a ray between them may meet another.
    fn gather(&mut self, x: u32, y: u32) -> bool {
        let (width, height) = (self.camera.width, self.camera.height);
        self.cones.clear();
        let mut counts = [0; 9];
        for v in y.saturating_sub(1)..=(y + 1).min(height - 1) {
            for u in x.saturating_sub(1)..=(x + 1).min(width - 1) {
                let face = self.hits.face.at(u, v);
                let index = self.cones.iter().position(|(known, _)| *known == face).unwrap_or_else(|| {
                    self.cones.push((face, None));
                    self.cones.len() - 1
                });
                counts[index] += 1;
            }
        }
        let is_large = |(cone, count): (&(u32, Option<Cone>), &u32)| *count > 1 && cone.0 != NO_FACE;
        let are_large = self.cones.iter().zip(&counts).all(is_large);
        if are_large {
            let (mesh, origin) = (self.scene.mesh(), self.camera.pose.location);
            self.cones.iter_mut().for_each(|(face, cone)| *cone = Cone::new(mesh, *face, origin));
        }
        are_large
    }

    /// The nearest of the gathered faces.
    fn nearest(&self, direction: DVec3) -> Option<Hit> {
        let hit = |(face, cone): &(u32, Option<Cone>)| {
            let cone = cone.as_ref().filter(|cone| cone.contains(direction))?;
            Some(Hit { face: *face, t: cone.distance(direction) })
        };
        self.cones.iter().filter_map(hit).min_by(|a, b| a.t.total_cmp(&b.t).then(a.face.cmp(&b.face)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{cast, rgb_image};
    use glam::vec3;
    use s3d_geom::{Material, MeshParts, Pose, TriMesh};

    /// A white wall at y = 4 and, a metre before it, a black board whose lower edge rises by one in ten;
    /// beside the wall is nothing.
    fn board() -> TriMesh {
        let quad = |y: f32, [a, b, c, d]: [(f32, f32); 4]| [a, b, c, d].map(|(x, z)| vec3(x, y, z));
        let wall = quad(4.0, [(-3.0, -3.0), (3.0, -3.0), (3.0, 3.0), (-3.0, 3.0)]);
        let front = quad(3.0, [(-1.0, -0.1), (1.0, 0.1), (1.0, 1.0), (-1.0, 1.0)]);
        let material = |color| Material { name: format!("{color:?}"), color, texture: None };
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
        let (scene, textures) = (Scene::new(&mesh), MipMaps::new(&mesh));
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

    /// The board's lower edge is z = x / 10, at x = −1 to 1: how much of each pixel the board covers is
    /// known.
    #[test]
    fn edges_have_the_mean_of_what_their_pixels_show() {
        let camera = Camera::perspective(pose(), 0.5, 64, 64);
        let f = camera.focal_px().x;
        let (plain, image, hits) = images(&camera, 16);
        let (mut worst, mut before, mut between) = (0.0f64, 0.0f64, 0);
        for (x, y) in (8..56).flat_map(|x| (20..44).map(move |y| (x, y))) {
            // The share of the pixel above the line, by 32 × 32 places.
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
        // What shows nothing stays, and what shows something is not black.
        let seen = |face: &u32| *face != NO_FACE;
        assert!(image.pixels().iter().zip(hits.face.pixels()).all(|(c, f)| (*c != [0; 3]) == seen(f)));
    }

    #[test]
    fn every_camera_has_samples_and_flat_parts_stay() {
        for camera in [
            Camera::perspective(pose(), 2.4, 96, 96),
            Camera::pinhole(pose(), dvec2(40.0, 44.0), dvec2(20.0, 30.0), 96, 64).unwrap(),
            Camera::equirectangular(pose(), 128),
        ] {
            let (plain, image, hits) = images(&camera, 4);
            let differs = plain.pixels().iter().zip(image.pixels()).filter(|(a, b)| a != b).count();
            assert!(differs > 10, "{differs}");
            for (x, y) in (1..camera.width - 1).flat_map(|x| (1..camera.height - 1).map(move |y| (x, y))) {
                let face = hits.face.at(x, y);
                let around = [(x - 1, y), (x + 1, y), (x, y - 1), (x, y + 1)];
                if around.iter().all(|(u, v)| hits.face.at(*u, *v) / 2 == face / 2 && face != NO_FACE) {
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
