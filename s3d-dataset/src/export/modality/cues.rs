//! Draws the images that follow from hits, labels or colours: the cues of `s3d_render`, and refined labels.

use crate::export::modality::{Channels, Drawn, Image, ImageBuffers};
use crate::survey::refined_labels::{RefinedImages, refined_images};
use s3d_geom::{Camera, Raster};
use s3d_io::dataset::Domain;
use s3d_io::image::{Content, encode_gray8, encode_gray16, encode_levels8, encode_numbers16, encode_rgb8};
use s3d_render::{
    Hits, border_distance_image_into, border_image_into, color_segment_image_into, corner_image_into,
    curvature_image_into, euclidean_depth_image_into, gray_image, keypoint_image_into, mask_image_into,
    occlusion_edge_image_into, reshading_image_into, surface_segment_image_into, texture_edge_image_into,
};
use std::collections::{BTreeMap, BTreeSet};

/// The memory for the cues of an image.
#[derive(Default)]
pub(crate) struct CueBuffers {
    bytes: BTreeMap<Domain, Raster<u8>>,
    numbers: BTreeMap<Domain, Raster<u16>>,
    curvature: Option<Raster<[u8; 3]>>,
    /// Both images of labels that follow the picture.
    refined: Option<RefinedImages>,
    /// The gray levels of the current image's colours, if they were needed.
    gray: Option<Raster<u8>>,
    /// The cues that belong to the current image.
    made: BTreeSet<Domain>,
}

impl CueBuffers {
    /// Begins another image.
    pub(crate) fn begin(&mut self) {
        self.made.clear();
        self.gray = None;
        self.refined = None;
    }

    /// Gives memory back, but not what took longest to make and is still to be written.
    pub(crate) fn shrink(&mut self) {
        let refined = std::mem::take(self).refined;
        if refined.is_some() {
            self.made.extend([Domain::SemanticRefined, Domain::SemanticMoved]);
        }
        self.refined = refined;
    }

    fn bytes(&mut self, domain: Domain) -> &mut Raster<u8> {
        self.bytes.entry(domain).or_insert_with(|| Raster::filled(0, 0, 0))
    }

    fn numbers(&mut self, domain: Domain) -> &mut Raster<u16> {
        self.numbers.entry(domain).or_insert_with(|| Raster::filled(0, 0, 0))
    }

    /// Returns a cue that was drawn.
    pub(crate) fn drawn(&self, domain: Domain) -> Drawn<'_> {
        match (domain, &self.refined) {
            (Domain::SemanticRefined, Some(refined)) => return Drawn::Color(&refined.index),
            (Domain::SemanticMoved, Some(refined)) => return Drawn::Gray(&refined.moved),
            _ => {}
        }
        match (self.bytes.get(&domain), self.numbers.get(&domain), &self.curvature) {
            (Some(bytes), ..) => Drawn::Gray(bytes),
            (_, Some(numbers), _) => Drawn::Depth(numbers),
            (.., Some(curvature)) if domain == Domain::PrincipalCurvature => Drawn::Color(curvature),
            _ => unreachable!("{domain} was drawn"),
        }
    }
}

impl Channels<'_> {
    /// Draws a cue, unless it belongs to the current image already.
    pub(crate) fn draw_cue(&self, domain: Domain, hits: &Hits, camera: &Camera, buffers: &mut ImageBuffers) {
        if !buffers.cues.made.insert(domain) {
            return;
        }
        if domain.is_of_colors() {
            return self.draw_cue_of_colors(domain, hits, camera, buffers);
        }

        let wraps = camera.is_panorama();
        let cues = &mut buffers.cues;
        match domain {
            Domain::DepthEuclidean => {
                let units_per_m = self.conventions.depth_units.per_m();
                euclidean_depth_image_into(hits, camera, units_per_m, cues.numbers(domain));
            }
            Domain::Reshading => reshading_image_into(self.scene, hits, camera, cues.bytes(domain)),
            Domain::PrincipalCurvature => {
                let out = cues.curvature.get_or_insert_with(|| Raster::filled(0, 0, [0; 3]));
                curvature_image_into(self.scene, hits, camera, self.curvature_of_face, out);
            }
            Domain::EdgeOcclusion => {
                occlusion_edge_image_into(self.scene, hits, camera, cues.bytes(domain));
            }
            Domain::Keypoints3d => corner_image_into(self.scene, hits, camera, cues.bytes(domain)),
            Domain::SegmentUnsup25d => {
                surface_segment_image_into(self.scene, hits, camera, cues.numbers(domain));
            }
            Domain::MaskValid => mask_image_into(hits, cues.bytes(domain)),
            Domain::EdgeInstance => {
                border_image_into(hits, self.label_of_face, wraps, cues.bytes(domain));
            }
            Domain::BoundaryDistance => {
                self.draw_cue(Domain::EdgeInstance, hits, camera, buffers);
                let cues = &mut buffers.cues;
                let borders = std::mem::replace(cues.bytes(Domain::EdgeInstance), Raster::filled(0, 0, 0));
                border_distance_image_into(&borders, wraps, cues.numbers(domain));
                hide_missing(hits, cues.numbers(domain), domain.missing()[0]);
                *cues.bytes(Domain::EdgeInstance) = borders;
            }
            other => unreachable!("{other} is drawn with other images"),
        }
    }

    /// Draws a cue of the image's colours, which are drawn before if they are not there.
    fn draw_cue_of_colors(&self, domain: Domain, hits: &Hits, camera: &Camera, buffers: &mut ImageBuffers) {
        if !buffers.has_colors {
            self.draw(Image::Rgb, hits, camera, buffers);
        }
        let wraps = camera.is_panorama();
        let colors = &buffers.images.rgb;
        let cues = &mut buffers.cues;
        if matches!(domain, Domain::SemanticRefined | Domain::SemanticMoved) {
            cues.made.extend([Domain::SemanticRefined, Domain::SemanticMoved]);
            let refined = refined_images(self.scene, hits, camera, colors, self.label_of_face);
            cues.refined = Some(refined);
            return;
        }
        if domain == Domain::SegmentUnsup2d {
            return color_segment_image_into(colors, hits, wraps, cues.numbers(domain));
        }

        let gray = cues.gray.take().unwrap_or_else(|| gray_image(colors));
        let draw = if domain == Domain::EdgeTexture {
            texture_edge_image_into
        } else {
            keypoint_image_into
        };
        draw(&gray, wraps, cues.bytes(domain));
        cues.gray = Some(gray);
    }

    /// Encodes a cue that was drawn.
    pub(crate) fn cue_file(&self, domain: Domain, drawn: Drawn<'_>) -> Option<Vec<u8>> {
        let compression = self.compression;
        Some(match (drawn, domain) {
            (
                Drawn::Gray(mask),
                Domain::MaskValid | Domain::EdgeOcclusion | Domain::EdgeInstance | Domain::SemanticMoved,
            ) => encode_gray8(mask),
            (Drawn::Color(labels), Domain::SemanticRefined) => {
                encode_rgb8(labels, Content::Labels, compression)
            }
            (Drawn::Gray(levels), _) => encode_levels8(levels, compression),
            (Drawn::Depth(numbers), Domain::SegmentUnsup2d | Domain::SegmentUnsup25d) => {
                encode_numbers16(numbers, compression)
            }
            (Drawn::Depth(depth), _) => encode_gray16(depth, compression),
            (Drawn::Color(colors), _) => encode_rgb8(colors, Content::Normals, compression),
            (Drawn::Class(_) | Drawn::Xyz(_) | Drawn::XyzHalf(_), _) => return None,
        })
    }
}

/// Writes `missing` where nothing is seen.
fn hide_missing(hits: &Hits, out: &mut Raster<u16>, missing: u16) {
    for (face, out) in hits.face.pixels().iter().zip(out.pixels_mut()) {
        *out = if *face == s3d_render::NO_FACE { missing } else { *out };
    }
}
