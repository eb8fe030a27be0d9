//! What scan locations see of a mesh, by solid angle.

use crate::context::Context;
use crate::error::Result;
use rayon::prelude::*;
use s3d_geom::Camera;
use s3d_io::camera::ScanLocation;
use s3d_label::LabelId;
use s3d_render::{NO_FACE, Scene, cast};

/// The width of the small panorama that probes what a location sees, pixels.
const PROBE_WIDTH: u32 = 256;

/// The share of directions with a surface below which a location gets a warning.
pub(crate) const LOW_COVERAGE: f64 = 0.5;

/// The share of back sides above which a location gets a warning.
const MANY_BACK_SIDES: f64 = 0.5;

/// The distance to a surface below which a location gets a warning, metres.
const VERY_NEAR_M: f32 = 0.1;

/// What a location sees of the mesh, by solid angle.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Outlook {
    /// The share of all directions in which there is a surface.
    pub(crate) coverage: f64,
    /// The share of these directions in which the back side is seen.
    pub(crate) back_sides: f64,
    /// The distance to the nearest visible surface, metres. Infinite if there is none.
    pub(crate) nearest_m: f32,
}

impl Outlook {
    /// Looks around from `location`.
    pub(crate) fn of(scene: &Scene<'_>, location: &ScanLocation) -> Self {
        let camera = Camera::equirectangular(location.pose, PROBE_WIDTH);
        let hits = cast(scene, &camera);
        let rays = camera.rays();

        let mut all = 0.0;
        let mut seen = 0.0;
        let mut back = 0.0;
        let mut nearest_m = f32::INFINITY;
        for y in 0..camera.height {
            for x in 0..camera.width {
                let direction = rays.at(x, y);
                // A row's pixels cover the sphere in proportion to the cosine of its latitude.
                let weight = (direction.x * direction.x + direction.y * direction.y).sqrt();
                all += weight;

                let face = hits.face.at(x, y);
                if face == NO_FACE {
                    continue;
                }
                seen += weight;
                nearest_m = nearest_m.min(hits.depth.at(x, y));
                if scene.mesh().normal(face).as_dvec3().dot(direction) > 0.0 {
                    back += weight;
                }
            }
        }

        Self { coverage: seen / all, back_sides: if seen > 0.0 { back / seen } else { 0.0 }, nearest_m }
    }

    /// Returns a sentence for each thing that looks wrong.
    pub(crate) fn warnings(&self, location: &ScanLocation) -> Vec<String> {
        let mut warnings = Vec::new();
        let name = &location.uuid;

        if self.coverage == 0.0 {
            warnings.push(format!(
                "location {name} sees nothing of the mesh (coverage 0 %): is it in the mesh's frame?"
            ));
        } else if self.coverage < LOW_COVERAGE {
            warnings.push(format!(
                "location {name} sees the mesh in only part of its panorama (coverage {}): it may stand \
                 outside, or near a hole",
                percent(self.coverage)
            ));
        }

        if self.back_sides > MANY_BACK_SIDES {
            warnings.push(format!(
                "location {name} sees back sides in {} of what it sees (coverage {}): it may stand inside \
                 something solid, or the faces are wound the other way",
                percent(self.back_sides),
                percent(self.coverage)
            ));
        }

        if self.nearest_m < VERY_NEAR_M {
            warnings.push(format!(
                "location {name} is {:.0} mm from a surface (coverage {}): it may stand inside a wall or a \
                 thing",
                1000.0 * self.nearest_m,
                percent(self.coverage)
            ));
        }

        warnings
    }
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

/// Returns what each scan location sees.
pub(crate) fn look_around(
    ctx: &Context,
    scene: &Scene<'_>,
    locations: &[ScanLocation],
) -> Result<Vec<Outlook>> {
    let outlooks = locations.par_iter().map(|location| {
        ctx.check()?;
        Ok(Outlook::of(scene, location))
    });
    outlooks.collect()
}

/// Returns the unlabelled share of what scan locations see, by solid angle. Returns `None` if they see
/// nothing.
pub(crate) fn unlabelled_share(
    scene: &Scene<'_>,
    locations: &[ScanLocation],
    label_of_face: &[LabelId],
) -> Option<f64> {
    let each: Vec<(f64, f64)> = locations
        .par_iter()
        .map(|location| seen_and_unlabelled(scene, location, label_of_face))
        .collect();
    let (seen, unlabelled) = each.iter().fold((0.0, 0.0), |(a, b), (c, d)| (a + c, b + d));
    (seen > 0.0).then(|| unlabelled / seen)
}

/// Returns what a scan location sees, and the unlabelled part of it, both in the same unit of solid angle.
fn seen_and_unlabelled(scene: &Scene<'_>, location: &ScanLocation, label_of_face: &[LabelId]) -> (f64, f64) {
    let camera = Camera::equirectangular(location.pose, PROBE_WIDTH);
    let faces = cast(scene, &camera).face;

    let mut seen = 0.0;
    let mut unlabelled = 0.0;
    for y in 0..camera.height {
        let latitude = (0.5 - (f64::from(y) + 0.5) / f64::from(camera.height)) * std::f64::consts::PI;
        for x in 0..camera.width {
            let face = faces.at(x, y);
            if face != NO_FACE {
                seen += latitude.cos();
                unlabelled += if label_of_face[face as usize].is_null() {
                    latitude.cos()
                } else {
                    0.0
                };
            }
        }
    }
    (seen, unlabelled)
}
