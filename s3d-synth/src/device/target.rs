//! A scene as devices meet it: what a ray hits, its colour and how much light comes back.

use super::disturbance::{CLOTHES, Disturbances};
use crate::AnnotatedScene;
use crate::rays::{RayTree, glass_faces};
use rayon::prelude::*;
use s3d_geom::glam::{DVec3, Vec2, Vec3, dvec2};
use s3d_geom::{Camera, FaceColor, Lens, Pose, Raster, TriMesh};
use std::fmt;

/// A scene that devices scan: its mesh, with a tree for rays.
///
/// ```
/// use s3d_geom::glam::Vec3;
/// use s3d_synth::Building;
/// use s3d_synth::device::ScanTarget;
///
/// let scene = Building { texture_scale: 0.05, ..Building::demo() }.build()?;
/// let target = ScanTarget::new(&scene);
/// // From a scan location straight down to the floor.
/// let from = scene.locations[0].position.as_vec3();
/// let floor = target.range(from, Vec3::NEG_Z).unwrap();
/// assert!((0.5..2.0).contains(&floor));
/// # Ok::<(), s3d_synth::BuildingError>(())
/// ```
pub struct ScanTarget<'s> {
    scene: &'s AnnotatedScene,
    tree: RayTree,
    is_glass: Vec<bool>,
}

impl fmt::Debug for ScanTarget<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ScanTarget").field("scene", &self.scene.title).finish()
    }
}

/// What a ray met.
#[derive(Clone, Copy)]
pub(super) struct Met {
    /// How far away: a multiple of the ray's direction. Behind a mirror, the whole way.
    pub(super) distance: f32,
    /// 0 to 255.
    pub(super) color: [f32; 3],
    /// The cosine of the angle between the ray and the normal, 0 to 1.
    pub(super) cosine: f32,
    pub(super) is_glass: bool,
}

impl Met {
    /// Returns the share of the light that comes back from the surface: its albedo times the cosine
    /// (Lambert). The albedo is the luminance of the colour (BT.709), with a gamma of 2.
    pub(super) fn signal(&self) -> f32 {
        let [r, g, b] = self.color.map(|c| (c / 255.0) * (c / 255.0));
        (0.2126 * r + 0.7152 * g + 0.0722 * b) * self.cosine
    }

    pub(super) fn rgb(&self) -> [u8; 3] {
        // Black is for pixels that see nothing.
        self.color.map(|c| (c + 0.5).clamp(1.0, 255.0) as u8)
    }
}

impl<'s> ScanTarget<'s> {
    /// Builds the tree.
    pub fn new(scene: &'s AnnotatedScene) -> Self {
        Self { scene, tree: RayTree::new(&scene.mesh), is_glass: glass_faces(&scene.mesh) }
    }

    /// Returns the scene.
    pub fn scene(&self) -> &'s AnnotatedScene {
        self.scene
    }

    /// Returns how far away the surface is along a ray, as a multiple of `direction`, without noise. `None`
    /// if the ray leaves the scene.
    pub fn range(&self, origin: Vec3, direction: Vec3) -> Option<f32> {
        self.tree.first(origin, direction, f32::INFINITY).map(|(_, t)| t)
    }

    /// Whether a face is the pane of a window, from which little comes back.
    pub fn is_glass(&self, face: u32) -> bool {
        self.is_glass.get(face as usize).copied().unwrap_or(false)
    }

    pub(crate) fn tree(&self) -> &RayTree {
        &self.tree
    }

    /// Returns what the ray meets first. `time` is the share of the scan that is done.
    pub(super) fn meet(&self, origin: Vec3, direction: Vec3, with: &Disturbances, time: f32) -> Option<Met> {
        let surface = self.tree.first(origin, direction, f32::INFINITY);
        let end = surface.map_or(f32::INFINITY, |(_, t)| t);
        let walker = with.walker(origin, direction, end, time);
        let end = walker.map_or(end, |(t, _)| t);

        // One reflection: the light that two mirrors show is too weak.
        if let Some((t, normal)) = with.mirror(origin, direction, end) {
            let turned = direction - 2.0 * direction.dot(normal) * normal;
            let behind = Disturbances { mirrors: Vec::new(), walker: with.walker.clone() };
            // The surface that the mirror hangs on is not met again.
            let from = origin + direction * t + turned * 1e-4;
            let met = self.meet(from, turned, &behind, time)?;
            return Some(Met { distance: t + met.distance, ..met });
        }

        let cosine = |normal: Vec3| (direction.dot(normal) / direction.length()).abs().min(1.0);
        if let Some((distance, normal)) = walker {
            return Some(Met { distance, color: CLOTHES, cosine: cosine(normal), is_glass: false });
        }
        let (face, distance) = surface?;
        let mesh = &self.scene.mesh;
        Some(Met {
            distance,
            color: color_at(mesh, face, origin + direction * distance),
            cosine: cosine(mesh.normal(face)),
            is_glass: self.is_glass(face),
        })
    }

    /// Returns what a camera sees: the colours of the textures. Pixels that see nothing are black.
    pub(super) fn picture(&self, pose: &Pose, lens: &Lens, with: &Disturbances) -> Raster<[u8; 3]> {
        let turn = pose.opencv_from_world().transpose();
        self.colors([lens.width(), lens.height()], pose.location, with, |x, y| {
            let ray = lens.direction(dvec2(f64::from(x) + 0.5, f64::from(y) + 0.5))?;
            Some(turn * ray)
        })
    }

    /// Returns the equirectangular panorama of a pose, `width` × `width / 2` pixels: the colours of the
    /// textures. Its middle looks along the heading of the pose, and +Z of the world is up.
    ///
    /// # Panics
    /// If `width` is odd or 0.
    pub fn panorama(&self, pose: &Pose, width: u32) -> Raster<[u8; 3]> {
        let rays = Camera::equirectangular(*pose, width).rays();
        let size = [width, width / 2];
        self.colors(size, pose.location, &Disturbances::default(), |x, y| Some(rays.at(x, y)))
    }

    fn colors(
        &self,
        [width, height]: [u32; 2],
        location: DVec3,
        with: &Disturbances,
        ray: impl Fn(u32, u32) -> Option<DVec3> + Sync,
    ) -> Raster<[u8; 3]> {
        let origin = location.as_vec3();
        let mut image = Raster::filled(width, height, [0; 3]);
        let rows = image.pixels_mut().par_chunks_mut(width as usize).enumerate();
        rows.for_each(|(y, row)| {
            for (x, pixel) in (0..).zip(row) {
                let met = ray(x, y as u32).and_then(|ray| self.meet(origin, ray.as_vec3(), with, 0.0));
                *pixel = met.map_or([0; 3], |met| met.rgb());
            }
        });
        image
    }
}

/// Returns the colour of a face at a place, 0 to 255.
fn color_at(mesh: &TriMesh, face: u32, place: Vec3) -> [f32; 3] {
    let weights = || {
        let [a, b, c] = mesh.triangle(face).map(|p| p.as_dvec3());
        let n = (b - a).cross(c - a);
        let p = place.as_dvec3();
        let u = (c - b).cross(p - b).dot(n) / n.length_squared();
        let v = (a - c).cross(p - c).dot(n) / n.length_squared();
        [u as f32, v as f32, (1.0 - u - v) as f32]
    };

    match mesh.color_of(face) {
        FaceColor::Flat(color) => color.map(f32::from),
        FaceColor::Texture(_, texture, uvs) => {
            let uv: Vec2 = uvs.into_iter().zip(weights()).map(|(uv, w)| uv * w).sum();
            texture.sample(uv)
        }
        FaceColor::Corners(corners) => {
            let weighted = corners.into_iter().zip(weights());
            let sum: Vec3 = weighted.map(|(c, w)| Vec3::from(c.map(f32::from)) * w).sum();
            sum.to_array()
        }
    }
}
