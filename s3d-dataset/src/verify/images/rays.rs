//! Draws the pixels that a file should have, and compares them with the file.

use crate::export::modality::{Drawn, Image};
use crate::verify::images::Reference;
use crate::verify::images::pixels::{Difference, Pixels};
use crate::verify::pose::CheckedPose;
use crate::xyz;
use half::f16;
use s3d_geom::{Camera, Raster};
use s3d_io::dataset::{Domain, XyzType};
use s3d_render::MISSING_INDEX;

/// Points from depth and pose, as `s3d xyz` makes them: from the pose that the angles give.
pub(super) fn points_of_depth(reference: &Reference<'_>, pose: &CheckedPose, depth: &Raster<u16>) -> Pixels {
    let camera = Camera { pose: pose.file.pose(), ..pose.camera };
    let conventions = reference.channels.conventions;
    let points = xyz::points(&camera, depth, conventions.depth_units);
    match conventions.xyz {
        XyzType::Float => Pixels::Xyz(points),
        _ => Pixels::XyzHalf(points.map(|p| p.map(f16::from_f32))),
    }
}

/// The difference between a file and what the mesh shows. The comparison is exact: the exported meshes equal
/// those that the file was rendered from, to the bit.
pub(super) fn difference(
    reference: &Reference<'_>,
    image: Image,
    pixels: &Pixels,
    expected: Drawn<'_>,
) -> Option<Difference> {
    let labels = reference.labels;
    match (pixels, expected) {
        (Pixels::Color(found), Drawn::Color(expected)) => {
            let is_index = matches!(image.domain(), Domain::Semantic | Domain::SemanticRefined);
            let text = |c: [u8; 3]| match c {
                MISSING_INDEX if is_index => "nothing".to_owned(),
                c if is_index => format!("{} ({})", index_of(c), labels.name_of(index_of(c))),
                c => format!("{c:?}"),
            };
            Difference::of(found, expected, |a, b| a == b, text, text)
        }
        (Pixels::Class(found, _), Drawn::Class(expected)) => {
            Difference::of(found, expected, |a, b| a == b, |c| labels.class_name(c), |c| labels.class_name(c))
        }
        (Pixels::Depth(found), Drawn::Depth(expected)) => {
            Difference::of(found, expected, |a, b| a == b, |d| d.to_string(), |d| d.to_string())
        }
        (Pixels::Gray(found), Drawn::Gray(expected)) => Difference::of(
            found,
            expected,
            |a, b| a == b,
            |level| level.to_string(),
            |level| level.to_string(),
        ),
        (Pixels::Xyz(found), Drawn::Xyz(expected)) => {
            Difference::of(found, expected, |a, b| a == b, point, point)
        }
        (Pixels::Xyz(found), Drawn::XyzHalf(expected)) => {
            Difference::of(found, expected, |a, b| a == to_f32(b), point, |p| point(to_f32(p)))
        }
        (Pixels::XyzHalf(found), Drawn::Xyz(expected)) => {
            Difference::of(found, expected, |a, b| to_f32(a) == b, |p| point(to_f32(p)), point)
        }
        (Pixels::XyzHalf(found), Drawn::XyzHalf(expected)) => {
            Difference::of(found, expected, |a, b| a == b, |p| point(to_f32(p)), |p| point(to_f32(p)))
        }
        (
            Pixels::Color(_)
            | Pixels::Depth(_)
            | Pixels::Gray(_)
            | Pixels::Class(..)
            | Pixels::Xyz(_)
            | Pixels::XyzHalf(_),
            _,
        ) => {
            unreachable!("{} is read as what is drawn of it", image.domain())
        }
    }
}

/// The label index of a pixel of a semantic image.
pub(super) fn index_of([r, g, b]: [u8; 3]) -> u32 {
    u32::from_be_bytes([0, r, g, b])
}

/// A point in words.
fn point(p: [f32; 3]) -> String {
    format!("{p:?}")
}

fn to_f32(p: [f16; 3]) -> [f32; 3] {
    p.map(f16::to_f32)
}
