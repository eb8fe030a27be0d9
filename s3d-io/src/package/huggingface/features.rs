//! The columns as features of `datasets`, and what they mean.

use super::HuggingfaceSet;
use super::table::modalities;
use crate::dataset::domain::{Domain, PixelKind};
use crate::package::parquet::columns::{Column, columns};
use serde_json::{Map, Value, json};

/// What a column holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Kind {
    Int,
    Float,
    Text,
    /// A list of floats.
    Floats,
    /// An image that is decoded as its file says.
    Image,
    /// An image whose 16-bit numbers are decoded as floats of 32 bits.
    Depth,
}

/// A column of the files.
pub(super) struct Feature {
    pub(super) name: String,
    pub(super) kind: Kind,
    pub(super) meaning: String,
}

/// Returns what the column of a modality holds, or `None` if `datasets` cannot decode its files.
pub(super) fn kind_of(domain: Domain) -> Option<Kind> {
    match (domain, domain.pixels()) {
        (Domain::Objects, _) => Some(Kind::Text),
        (_, Some(PixelKind::Gray16)) => Some(Kind::Depth),
        (_, Some(PixelKind::Rgb8 | PixelKind::Gray8 | PixelKind::Palette8)) => Some(Kind::Image),
        _ => None,
    }
}

/// Returns the columns of the files of a data set, in their order.
pub(super) fn features(set: &HuggingfaceSet<'_>) -> Vec<Feature> {
    let named = columns(set.classes, &[], set.with_photographs, modalities(&set.domains, &[]));
    named
        .into_iter()
        .map(|column| {
            let domain = set
                .domains
                .iter()
                .copied()
                .find(|domain| domain.folder() == column.name);
            let kind = match column.values {
                Column::Int(_) => Kind::Int,
                Column::Float(_) => Kind::Float,
                Column::Text(_) => Kind::Text,
                Column::List(_) => Kind::Floats,
                Column::Image(_) => domain.and_then(kind_of).unwrap_or(Kind::Image),
            };
            let meaning = match domain {
                Some(domain) => meaning_of_modality(domain, set.depth_units_per_m),
                None => meaning_of_number(&column.name),
            };
            Feature { name: column.name, kind, meaning }
        })
        .collect()
}

/// Returns the value of the metadata key `huggingface` of a Parquet file, from which `datasets` takes the
/// features.
pub(super) fn metadata(set: &HuggingfaceSet<'_>) -> String {
    let value = |dtype: &str| json!({"dtype": dtype, "_type": "Value"});
    let features: Map<String, Value> = features(set)
        .into_iter()
        .map(|Feature { name, kind, .. }| {
            let feature = match kind {
                Kind::Int => value("int32"),
                Kind::Float => value("float64"),
                Kind::Text => value("string"),
                Kind::Floats => json!({"feature": value("float64"), "_type": "Sequence"}),
                Kind::Image => json!({"_type": "Image"}),
                Kind::Depth => json!({"mode": "F", "_type": "Image"}),
            };
            (name, feature)
        })
        .collect();
    json!({"info": {"features": features}}).to_string()
}

fn meaning_of_modality(domain: Domain, units_per_m: f64) -> String {
    match domain {
        Domain::Rgb => "Colour. Black where nothing was seen.".to_owned(),
        Domain::Depth => format!(
            "Depth in units of 1/{units_per_m} m, decoded as 32-bit floats: along the optical axis in views, \
             along the ray in panoramas. 65535 where nothing was seen or farther."
        ),
        Domain::Normal => "Normals: 128 + 127 n in each channel. (128, 128, 128) where nothing was seen. \
            The axes are in conventions.json."
            .to_owned(),
        Domain::SemanticRefined => "As semantic, with borders moved to the edges of the picture.".to_owned(),
        Domain::SemanticMoved => {
            "255 where semantic_refined has another label than semantic, 0 elsewhere.".to_owned()
        }
        Domain::Semantic => "The index of an instance in semantic_labels.json: 65536 R + 256 G + B. \
            (13, 13, 13) where nothing was seen."
            .to_owned(),
        Domain::SemanticPretty => "A colour for each instance, to look at.".to_owned(),
        Domain::SemanticClass => "The place of the class in the taxonomy; 255 where nothing was seen and \
            without a label."
            .to_owned(),
        Domain::Objects => {
            "JSON: the instances of the image with amodal masks, occlusion and boxes.".to_owned()
        }
        Domain::GlobalXyz | Domain::Pose => format!("The file of {domain}."),
        Domain::DepthEuclidean => format!(
            "The distance from the camera in units of 1/{units_per_m} m, decoded as 32-bit floats. 65535 \
             where nothing was seen or farther."
        ),
        Domain::BoundaryDistance => {
            "The distance to the nearest border between instances in 64ths of a pixel. \
            65535 where nothing was seen."
                .to_owned()
        }
        Domain::SegmentUnsup2d | Domain::SegmentUnsup25d => {
            "The number of a segment, from 1. 0 where nothing was seen.".to_owned()
        }
        Domain::Reshading
        | Domain::PrincipalCurvature
        | Domain::EdgeOcclusion
        | Domain::EdgeTexture
        | Domain::Keypoints2d
        | Domain::Keypoints3d
        | Domain::MaskValid
        | Domain::EdgeInstance => {
            format!("{domain} is in conventions.json: what its values mean, and which one sees nothing.")
        }
    }
}

fn meaning_of_number(name: &str) -> String {
    let meaning = match name {
        "area" => "The number of the area.",
        "camera_uuid" => "The scan location.",
        "room" => "The room: its type and number.",
        "room_type" => "The type of the room.",
        "room_number" => "The number of the room among those of its type.",
        "kind" => "view or panorama.",
        "frame_num" => "The number of a view at its scan location. Null for a panorama.",
        "width" | "height" => "Pixels.",
        "fov_rad" => "The horizontal angle of view, radians.",
        "yaw_rad" | "pitch_rad" => "The heading and elevation of a view from the scanner's camera, radians.",
        "x" | "y" | "z" => "The position of the camera in the world (Z up), metres.",
        "k" => "The camera matrix, 3 × 3, row by row, pixels. The centre of the first pixel is (0.5, 0.5).",
        "rt" => "World to camera (x right, y down, z forward), 3 × 4, row by row, metres.",
        "selection_entropy" => "The entropy by which a view was selected, nats.",
        "entropy" => "The entropy of the classes of the pixels, nats.",
        "coverage" => "The share of pixels that show a surface.",
        "share_unlabelled" => "The share of pixels that show a surface without a label.",
        "instances" => "The number of instances that are seen.",
        "depth_min_m" | "depth_mean_m" | "depth_max_m" => "Depth over the pixels that have one, metres.",
        "photograph" => "The name of the photograph that a view shows. Null for other images.",
        _ => "The share of pixels that show the class.",
    };
    meaning.to_owned()
}
