//! The cameras of a graph, and what they see in which order.

use super::nodes::{CameraNode, CameraOrder, Occlusion, Seen};
use crate::context::Context;
use crate::error::Result;
use crate::pack::source::Source;
use crate::parallel::map_in_order;
use s3d_io::Error as FileError;
use s3d_io::dataset::{DatasetImage, Domain, Frame, ImageObject, ObjectsFile};
use s3d_label::{LabelId, LabelTable};
use std::collections::BTreeMap;

/// What the cameras of an area see.
pub(super) struct Looked {
    pub(super) cameras: Vec<CameraNode>,
    /// `None` if the images have no objects.
    pub(super) orders: Option<Vec<CameraOrder>>,
    pub(super) occlusions: Option<Vec<Occlusion>>,
}

/// Makes the cameras of an area, in the order of its images.
pub(super) fn look(ctx: &Context, source: &Source, table: &LabelTable, area: u32) -> Result<Looked> {
    let images = source.of_area(area);
    let progress = ctx.progress("packing", "images", images.len() as u64);
    let made = map_in_order(
        ctx,
        &images,
        || (),
        |(), image| {
            let objects = if source.has(Domain::Objects) {
                Some(source.data.objects(image)?)
            } else {
                None
            };
            let camera = camera(source, table, image, objects.as_ref())?;
            progress.add(1);
            Ok((camera, objects))
        },
    )?;

    let name = |index: u32| table.name_of(LabelId(index));
    let (mut cameras, mut orders, mut occlusions) = (Vec::new(), Vec::new(), Vec::new());
    for ((camera, objects), image) in made.into_iter().zip(&images) {
        if let Some(ObjectsFile { objects, .. }) = objects {
            orders.push(order(&camera.id, &objects, image.frame != Frame::Panorama));
            for hidden in &objects {
                occlusions.extend(hidden.hidden_by.iter().map(|hider| Occlusion {
                    camera: camera.id.clone(),
                    hidden: hidden.label.clone(),
                    by: name(hider.label_index),
                    pixels: hider.pixels,
                }));
            }
        }
        cameras.push(camera);
    }
    let has_objects = source.has(Domain::Objects);
    Ok(Looked {
        cameras,
        orders: has_objects.then_some(orders),
        occlusions: has_objects.then_some(occlusions),
    })
}

fn camera(
    source: &Source,
    table: &LabelTable,
    image: &DatasetImage,
    objects: Option<&ObjectsFile>,
) -> Result<CameraNode> {
    let pose = source.data.pose(image)?;
    let is_panorama = image.frame == Frame::Panorama;
    let kind = match () {
        () if is_panorama => "panorama",
        () if source.photograph(image).is_some() => "photograph",
        () => "view",
    };

    let sees = match objects {
        Some(file) => Some(
            file.objects
                .iter()
                .map(|object| Seen { object: object.label.clone(), pixels: object.visible_pixels })
                .collect(),
        ),
        None if image.has(Domain::Semantic) => Some(counted(source, table, image)?),
        None => None,
    };

    let rt = pose.camera_rt_matrix;
    Ok(CameraNode {
        id: image.stem(),
        kind,
        room: pose
            .room
            .rsplit_once('_')
            .map_or(pose.room.clone(), |(room, _)| room.to_owned()),
        location: pose.camera_location,
        rotation: rt.map(|[x, y, z, _]| [x, y, z]),
        k: (!is_panorama).then_some(pose.camera_k_matrix),
        fov_deg: pose.field_of_view_rads.to_degrees(),
        modalities: image.domains.iter().map(ToString::to_string).collect(),
        sees,
    })
}

/// Counts the pixels of each label in the semantic image, by label index.
fn counted(source: &Source, table: &LabelTable, image: &DatasetImage) -> Result<Vec<Seen>> {
    let path = image.path(&source.data.layout, Domain::Semantic);
    let mut pixels: BTreeMap<u32, u64> = BTreeMap::new();
    for [r, g, b] in source.rgb8(image, Domain::Semantic)?.pixels() {
        *pixels.entry(u32::from_be_bytes([0, *r, *g, *b])).or_default() += 1;
    }

    let nothing = s3d_render::MISSING_INDEX.map(u32::from);
    let nothing = nothing[0] << 16 | nothing[1] << 8 | nothing[2];
    let mut seen = Vec::new();
    for (index, pixels) in pixels.into_iter().filter(|(index, _)| *index != 0 && *index != nothing) {
        if index as usize >= table.len() {
            let labels = source.data.layout.labels_json();
            let message = format!("label {index} is not in {}", labels.display());
            return Err(FileError::format(&path, message).into());
        }
        seen.push(Seen { object: table.name_of(LabelId(index)), pixels });
    }
    Ok(seen)
}

fn order(camera: &str, objects: &[ImageObject], has_ends: bool) -> CameraOrder {
    let mut visible: Vec<&ImageObject> = objects.iter().collect();
    let names = |visible: &[&ImageObject]| visible.iter().map(|object| object.label.clone()).collect();

    visible.sort_by(|a, b| {
        let by_distance = a.median_m.total_cmp(&b.median_m);
        by_distance.then(a.label_index.cmp(&b.label_index))
    });
    let near_to_far = names(&visible);

    // Twice the middle, which is a whole number.
    let middle = |object: &ImageObject| 2 * object.visible_box[0] + object.visible_box[2];
    visible.sort_by_key(|object| (middle(object), object.label_index));
    let left_to_right = has_ends.then(|| names(&visible));
    CameraOrder { camera: camera.to_owned(), near_to_far, left_to_right }
}
