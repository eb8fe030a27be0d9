//! Computes the values that single rays should write into files. This is slower than drawing images, but
//! works for any ray.

use crate::export::modality::NO_CLASS;
use crate::verify::images::Reference;
use glam::DVec3;
use s3d_geom::Camera;
use s3d_io::dataset::Domain;
use s3d_render::{Hit, TextureFilter, rgb_of_ray};

/// The values of a domain.
pub(crate) struct Shade<'a> {
    reference: &'a Reference<'a>,
    domain: Domain,
}

impl<'a> Shade<'a> {
    pub(crate) fn new(reference: &'a Reference<'a>, domain: Domain) -> Self {
        Self { reference, domain }
    }

    /// The value of a pixel whose ray along `direction` ends at `hit`.
    pub(crate) fn value(&self, camera: &Camera, direction: DVec3, hit: Option<Hit>) -> [f64; 3] {
        let reference = self.reference;
        let conventions = reference.channels.conventions;
        let Some(hit) = hit else { return self.domain.missing().map(f64::from) };

        match self.domain {
            Domain::Depth => {
                [(hit.t * conventions.depth_units.per_m() + 0.5).floor().min(65_535.0), 0.0, 0.0]
            }
            Domain::Normal => {
                let n = reference.channels.scene.mesh().normal(hit.face).as_dvec3();
                let n = if n.dot(direction) > 0.0 { -n } else { n };
                let n: DVec3 = camera.normal_axes_from_world(conventions.normal_axes) * n;
                (n * 127.5 + (128.0 + 1e-6)).to_array().map(f64::floor)
            }
            Domain::Semantic => {
                let [_, r, g, b] = reference.mesh.label_of_face[hit.face as usize].to_be_bytes();
                [r, g, b].map(f64::from)
            }
            Domain::SemanticPretty => reference.channels.pretty_of_face[hit.face as usize].map(f64::from),
            Domain::SemanticClass => {
                let label = reference.mesh.label_of_face[hit.face as usize] as usize;
                let place = reference.labels.classes.get(label).copied().unwrap_or(NO_CLASS);
                [f64::from(place), 0.0, 0.0]
            }
            Domain::GlobalXyz => (camera.pose.location + direction * hit.t).to_array(),
            Domain::Rgb => {
                let filter = TextureFilter::default();
                rgb_of_ray(
                    reference.channels.scene,
                    reference.channels.textures,
                    camera,
                    direction,
                    hit.face,
                    &filter,
                )
                .map(f64::from)
            }
            // Cues depend on more than one ray, and are not guessed at.
            _ => [0.0; 3],
        }
    }
}
