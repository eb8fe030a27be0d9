//! The directions of an image's pixels, as anchors need them.

use crate::simd::shade_lanes::LANES;
use glam::DVec3;
use s3d_geom::{Camera, Rays};

/// The largest distance of a pixel from its anchor, in columns and in rows.
pub(crate) const REACH: i32 = 64;

/// The directions of an image's pixels, as anchors need them.
pub(crate) struct RayGrid {
    pub(super) rays: Rays,
    /// δ in a panorama, else 1.
    pub(super) column_step: f32,
    /// The cosines and sines of the rows' latitudes; empty in a perspective view.
    pub(super) rows: Vec<[f64; 2]>,
    /// sin kδ in a panorama, else k; by column offset k + [`REACH`].
    pub(super) sines: [f32; 2 * REACH as usize + LANES],
    /// 1 − cos kδ in a panorama, else 0.
    pub(super) versines: [f32; 2 * REACH as usize + LANES],
}

impl RayGrid {
    pub(crate) fn new(camera: &Camera) -> Self {
        let rays = camera.rays();
        let (column_step, rows) = match &rays {
            Rays::Perspective { .. } => (None, vec![]),
            Rays::Equirectangular { rows, .. } => (
                Some(std::f64::consts::TAU / f64::from(camera.width)),
                rows.iter().map(|row| [row.x, row.y]).collect(),
            ),
        };
        Self {
            rays,
            column_step: column_step.unwrap_or(1.0) as f32,
            rows,
            sines: std::array::from_fn(|k| {
                column_step.map_or(offset(k), |step| libm_sin(offset(k) * step)) as f32
            }),
            versines: std::array::from_fn(|k| {
                column_step.map_or(0.0, |step| versine(offset(k) * step)) as f32
            }),
        }
    }

    /// Tells whether the image is a panorama.
    pub(crate) fn is_panorama(&self) -> bool {
        !self.rows.is_empty()
    }

    /// Returns the change of the directions at column `i`: from column to column and from row to row in a
    /// perspective view. In a panorama the first is the column's unit vector, the second is unused.
    #[inline(always)]
    pub(super) fn steps(&self, i: usize) -> [DVec3; 2] {
        match &self.rays {
            Rays::Perspective { x_step, y_step, .. } => [*x_step, *y_step],
            Rays::Equirectangular { columns, .. } => [columns[i].extend(0.0), DVec3::ZERO],
        }
    }
}

fn offset(at: usize) -> f64 {
    at as f64 - f64::from(REACH)
}

/// Returns 1 − cos a = 2 sin² a/2, without cancellation.
fn versine(a: f64) -> f64 {
    2.0 * libm_sin(0.5 * a) * libm_sin(0.5 * a)
}

/// Returns the sine from glam, which is the same on every platform.
fn libm_sin(a: f64) -> f64 {
    glam::DVec2::from_angle(a).y
}
