//! The directions of an image's rays, and of a tile of them.

use crate::Scene;
use glam::{DVec3, dvec3};
use obvhs::aabb::Aabb;
use s3d_geom::{Camera, Rays};

/// Columns of a tile: a register of eight `f32`.
pub(crate) const TILE_WIDTH: usize = 8;
/// Rows of a tile.
pub(crate) const TILE_HEIGHT: usize = 8;

/// The rays of an image (or of some of its columns and rows), whose directions are x(i)·c(j) + lift·s(j).
pub(crate) struct Fan<'a> {
    rays: Rays,
    columns: &'a [u32],
    rows: &'a [u32],
    x: Vec<DVec3>,
    cs: Vec<(f64, f64)>,
    lift: DVec3,
    /// In a perspective view, the axis along which every direction is 1.
    forward: Option<DVec3>,
}

impl<'a> Fan<'a> {
    pub(crate) fn new(camera: &Camera, columns: &'a [u32], rows: &'a [u32]) -> Self {
        let rays = camera.rays();
        let at = |i: u32| f64::from(i) + 0.5;
        let (x, cs, lift, forward) = match &rays {
            Rays::Perspective { x_step, y_step, origin } => (
                columns.iter().map(|&i| *origin + *x_step * at(i)).collect(),
                rows.iter().map(|&j| (1.0, at(j))).collect(),
                *y_step,
                Some(camera.pose.forward()),
            ),
            Rays::Equirectangular { columns: azimuths, rows: latitudes } => (
                columns.iter().map(|&i| azimuths[i as usize].extend(0.0)).collect(),
                rows.iter().map(|&j| latitudes[j as usize].into()).collect(),
                DVec3::Z,
                None,
            ),
        };
        Self { rays, columns, rows, x, cs, lift, forward }
    }

    /// The direction of the ray in column `i`, row `j` of those chosen, as a single ray would have it.
    #[inline(always)]
    pub(crate) fn direction(&self, i: usize, j: usize) -> DVec3 {
        self.rays.at(self.columns[i], self.rows[j])
    }

    /// The tile whose first ray is in column `i`, row `j`, for rays that start at `origin`.
    #[inline(always)]
    pub(crate) fn tile(&self, i: usize, j: usize, scene: &Scene<'_>, origin: DVec3) -> Tile {
        let width = TILE_WIDTH.min(self.x.len() - i);
        let height = TILE_HEIGHT.min(self.cs.len() - j);
        let (first, last) = (self.x[i], self.x[i + width - 1]);
        let (top, bottom) = (self.cs[j], self.cs[j + height - 1]);
        let x = 0.5 * (first + last);
        let mut tile = Tile {
            width,
            height,
            x,
            lift: self.lift,
            center: x * (0.5 * (top.0 + bottom.0)) + self.lift * (0.5 * (top.1 + bottom.1)),
            radius: 0.0,
            reach: 0.0,
            dx: [[0.0; TILE_WIDTH]; 3],
            c: [0.0; TILE_HEIGHT],
            exact_c: [0.0; TILE_HEIGHT],
            exact_s: [0.0; TILE_HEIGHT],
            planes: Planes::default(),
        };
        for k in 0..width {
            let dx = self.x[i + k] - x;
            (tile.dx[0][k], tile.dx[1][k], tile.dx[2][k]) = (dx.x as f32, dx.y as f32, dx.z as f32);
        }
        for k in 0..height {
            let (c, s) = self.cs[j + k];
            (tile.c[k], tile.exact_c[k], tile.exact_s[k]) = (c as f32, c, s);
        }
        let at = |x: DVec3, (c, s): (f64, f64)| x * c + self.lift * s;
        let corners = [at(first, top), at(last, top), at(last, bottom), at(first, bottom)];
        // The ray farthest from the centre is at a corner, unless the tile reaches around half a panorama.
        let column = self.x[i + width / 2];
        let narrow = self.forward.is_some() || (first.dot(column) > 0.1 && last.dot(column) > 0.1);
        tile.radius = if narrow {
            corners.iter().map(|d| d.distance(tile.center)).fold(0.0, f64::max) * (1.0 + 1e-6) + 1e-14
        } else {
            2.0
        };
        tile.reach = tile.center.length() + tile.radius;
        let sides = if !narrow {
            [DVec3::ZERO; 4]
        } else if self.forward.is_some() {
            [0, 1, 2, 3].map(|k| corners[k].cross(corners[(k + 1) % 4]))
        } else {
            panorama_sides(first, last, x.normalize(), top, bottom)
        };
        let axis = self.forward.unwrap_or(tile.center.normalize_or_zero());
        tile.planes = Planes::new(sides, axis, origin, scene.magnitude(origin));
        tile
    }
}

/// Planes that hold a panorama's tile between two meridians and two parallels, inwards. A parallel is no plane's cut:
/// the plane that touches it from outside stands in.
fn panorama_sides(
    first: DVec3,
    last: DVec3,
    middle: DVec3,
    (top_cos, top_sin): (f64, f64),
    (bottom_cos, bottom_sin): (f64, f64),
) -> [DVec3; 4] {
    let cos_half_width = first.dot(middle).min(1.0);
    // On the upper half parallels bend upwards, away from the middle meridian; on the lower half downwards.
    let top = if top_sin > 0.0 { cos_half_width } else { 1.0 };
    let bottom = if bottom_sin < 0.0 { cos_half_width } else { 1.0 };
    [
        dvec3(first.y, -first.x, 0.0),
        dvec3(-last.y, last.x, 0.0),
        middle * top_sin - DVec3::Z * (top * top_cos),
        DVec3::Z * (bottom * bottom_cos) - middle * bottom_sin,
    ]
}

/// A tile of at most [`TILE_WIDTH`] × [`TILE_HEIGHT`] rays.
pub(crate) struct Tile {
    /// Columns that lie in the image.
    pub(crate) width: usize,
    /// Rows that lie in the image.
    pub(crate) height: usize,
    /// x(i) of the middle.
    pub(crate) x: DVec3,
    pub(crate) lift: DVec3,
    /// The direction in the middle.
    pub(crate) center: DVec3,
    /// No direction is farther from `center`.
    pub(crate) radius: f64,
    /// No direction is longer.
    pub(crate) reach: f64,
    /// x(i) − x, by component.
    pub(crate) dx: [[f32; TILE_WIDTH]; 3],
    pub(crate) c: [f32; TILE_HEIGHT],
    pub(crate) exact_c: [f64; TILE_HEIGHT],
    pub(crate) exact_s: [f64; TILE_HEIGHT],
    planes: Planes,
}

impl Tile {
    /// A bound from below on the t at which the tile's rays meet the box; `None` if none does.
    #[inline(always)]
    pub(crate) fn enter(&self, aabb: &Aabb) -> Option<f32> {
        let p = &self.planes;
        let (min, max) = (aabb.min.to_array(), aabb.max.to_array());
        let mut reach = p.beyond;
        for k in 0..3 {
            for (lane, reach) in reach.iter_mut().enumerate() {
                *reach += p.positive[k][lane] * max[k] + p.negative[k][lane] * min[k];
            }
        }
        let meets = (reach[0] >= 0.0) & (reach[1] >= 0.0) & (reach[2] >= 0.0) & (reach[3] >= 0.0);
        meets.then_some(-reach[4])
    }
}

/// Four planes around a tile and one across it, as lanes. A box's farthest point along a plane's normal takes each
/// coordinate from `max` where the normal is positive, from `min` where it is negative.
#[derive(Default)]
struct Planes {
    positive: [[f32; 8]; 3],
    negative: [[f32; 8]; 3],
    /// How far outside the planes the world's zero is, less the error of all this.
    beyond: [f32; 8],
}

impl Planes {
    fn new(sides: [DVec3; 4], axis: DVec3, origin: DVec3, magnitude: f64) -> Self {
        let mut planes = Self::default();
        let slack = 64.0 * f64::from(f32::EPSILON) * magnitude + 1e-30;
        let normals = sides.into_iter().map(DVec3::normalize_or_zero).chain([-axis]);
        for (lane, normal) in normals.enumerate() {
            for k in 0..3 {
                planes.positive[k][lane] = normal[k].max(0.0) as f32;
                planes.negative[k][lane] = normal[k].min(0.0) as f32;
            }
            planes.beyond[lane] = (slack - normal.dot(origin)) as f32;
        }
        planes
    }
}
