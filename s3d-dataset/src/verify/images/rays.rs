//! What the mesh shows: the pixels that a file should have.

use crate::export::modality::NO_CLASS;
use crate::verify::images::pixels::{Difference, Pixels};
use crate::verify::images::{Reference, Scratch};
use crate::verify::pose::CheckedPose;
use crate::xyz;
use half::f16;
use half::slice::HalfFloatSliceExt;
use s3d_geom::{Camera, Raster};
use s3d_io::dataset::{DepthUnits, Domain, XyzType};
use s3d_render::{
    MISSING_INDEX, TextureFilter, byte_per_face_image, color_per_face_image_into, depth_image_into,
    depth_image_mm_into, index_image_into, normal_image_into, rgb_image_into, sample_edges,
    xyz_image_half_into, xyz_image_into,
};

/// How a file differs from what the mesh shows: exactly, for the meshes of an export are those that it was
/// rendered from, to the bit.
pub(super) fn difference(
    reference: &Reference<'_>,
    domain: Domain,
    pixels: &Pixels,
    pose: &CheckedPose,
    depth_file: &Option<Raster<u16>>,
    memory: &mut Scratch<'_>,
) -> Option<Difference> {
    let Scratch { hits, images, xyz, .. } = memory;
    let (camera, conventions) = (&pose.camera, reference.conventions());
    let colors = |found: &Raster<[u8; 3]>, expected: &Raster<[u8; 3]>| {
        Difference::of_colors(found, expected, |c| format!("{c:?}"))
    };
    match pixels {
        Pixels::Color(found) => match domain {
            Domain::Rgb => {
                let filter = TextureFilter::default();
                let (scene, textures) = (reference.scene, reference.textures);
                rgb_image_into(scene, textures, hits, camera, &filter, &mut images.rgb);
                let samples = reference.manifest.options.rgb_samples;
                sample_edges(scene, textures, hits, camera, &filter, samples, &mut images.rgb);
                colors(found, &images.rgb)
            }
            Domain::Normal => {
                let (normals, axes) = (reference.manifest.options.normals, conventions.normal_axes);
                let out = &mut images.faces.normal;
                normal_image_into(reference.scene, hits, camera, normals, axes, out);
                colors(found, out)
            }
            Domain::Semantic => {
                index_image_into(hits, &reference.mesh.label_of_face, &mut images.faces.index);
                let index = |c: [u8; 3]| u32::from_be_bytes([0, c[0], c[1], c[2]]);
                let text = |c: [u8; 3]| match c {
                    MISSING_INDEX => "nothing".to_owned(),
                    c => format!("{} ({})", index(c), reference.labels.name_of(index(c))),
                };
                Difference::of_colors(found, &images.faces.index, text)
            }
            Domain::SemanticPretty => {
                color_per_face_image_into(hits, reference.pretty_of_face, &mut images.faces.color);
                colors(found, &images.faces.color)
            }
            Domain::Depth | Domain::SemanticClass | Domain::GlobalXyz | Domain::Pose => {
                unreachable!("{domain} has no colours")
            }
        },
        Pixels::Class(found, _) => {
            let classes = &reference.labels.classes;
            let class_of = |label: &u32| classes.get(*label as usize).copied().unwrap_or(NO_CLASS);
            let class_of_face: Vec<u8> = reference.mesh.label_of_face.iter().map(class_of).collect();
            let expected = byte_per_face_image(hits, &class_of_face, NO_CLASS);
            let text = |place: u8| reference.labels.class_name(place);
            Difference::of(found, &expected, |a, b| a == b, text, text)
        }
        Pixels::Depth(found) => {
            match conventions.depth_units {
                DepthUnits::Per512 => depth_image_into(hits, &mut images.depth),
                DepthUnits::Millimetres => depth_image_mm_into(hits, &mut images.depth),
            }
            Difference::of(found, &images.depth, |a, b| a == b, |d| d.to_string(), |d| d.to_string())
        }
        Pixels::Xyz(found) => {
            let text = |p: [f32; 3]| format!("{p:?}");
            let same = |a: [f32; 3], b: [f32; 3]| a == b;
            let rounded = |p: [f16; 3]| p.map(f16::to_f32);
            let is_half = conventions.xyz != XyzType::Float;
            if reference.manifest.is_xyz_from_depth() {
                // Totals by `s3d xyz`: from the pose as its angles give it.
                let camera = Camera { pose: pose.file.pose(), ..*camera };
                let points = xyz::points(&camera, depth_file.as_ref()?, conventions.depth_units);
                if is_half {
                    let points = points.map(|p| p.map(f16::from_f32));
                    return Difference::of(
                        found,
                        &points,
                        |a, b| a == rounded(b),
                        text,
                        |p| text(rounded(p)),
                    );
                }
                return Difference::of(found, &points, same, text, text);
            }
            if is_half {
                xyz_image_half_into(hits, camera, &mut images.xyz);
                if are_rounded(found, &images.xyz) {
                    return None;
                }
                let same = |a: [f32; 3], b: [f16; 3]| a == rounded(b);
                return Difference::of(found, &images.xyz, same, text, |p| text(rounded(p)));
            }
            xyz_image_into(hits, camera, xyz);
            Difference::of(found, xyz, same, text, text)
        }
    }
}

/// Whether all points of an image are those of another one of half floats: many at a time.
fn are_rounded(points: &Raster<[f32; 3]>, halves: &Raster<[f16; 3]>) -> bool {
    let mut row = vec![0f32; 3 * halves.width() as usize];
    points.rows().zip(halves.rows()).all(|(points, halves)| {
        halves.as_flattened().convert_to_f32_slice(&mut row);
        points.as_flattened().iter().zip(&row).fold(true, |all, (a, b)| all & (a == b))
    })
}
