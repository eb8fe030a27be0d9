//! The objects of an image, as they are written.

use crate::survey::surface_boxes::BoxesOfFaces;
use s3d_geom::glam::{DVec2, DVec3};
use s3d_geom::{Aabb, Camera, OrientedBox, TriMesh};
use s3d_io::dataset::{
    BeyondFrame, BoxAngles, BoxCorners, Corner, Hider, ImageObject, ObjectsFile, RunLengths,
};
use s3d_label::Label;
use s3d_render::{Beyond, Hits, NO_OBJECT, ObjectMeshes, ObjectScenes, PixelBox, SeenObject, SeenObjects};
use std::collections::BTreeMap;

/// The label of faces without one.
const NULL_LABEL: u32 = 0;

/// Returns the meshes of the instances of an area, each alone. A label is an object, and the null label none.
pub(crate) fn instance_meshes(mesh: &TriMesh, label_of_face: &[u32]) -> ObjectMeshes {
    ObjectMeshes::new(mesh, &objects_of_labels(label_of_face))
}

/// Returns the object of each face: its label, or none for the null label.
fn objects_of_labels(label_of_face: &[u32]) -> Vec<u32> {
    let object = |label: &u32| if *label == NULL_LABEL { NO_OBJECT } else { *label };
    label_of_face.iter().map(object).collect()
}

/// Finds the instances in the images of an area.
pub(crate) struct InstanceFinder<'a> {
    scenes: ObjectScenes<'a>,
    object_of_face: Vec<u32>,
    boxes: &'a BTreeMap<u32, BoxesOfFaces>,
    /// The label of an index.
    label_of: LabelOf<'a>,
}

/// Returns the label of an index of the label table; `None` for the null label, and beyond the table.
pub(crate) type LabelOf<'a> = &'a (dyn Fn(u32) -> Option<Label> + Sync);

impl<'a> InstanceFinder<'a> {
    /// Returns a finder. `meshes` and `boxes` are those of the labels of the faces.
    pub(crate) fn new(
        meshes: &'a ObjectMeshes,
        label_of_face: &[u32],
        boxes: &'a BTreeMap<u32, BoxesOfFaces>,
        label_of: LabelOf<'a>,
    ) -> Self {
        let object_of_face = objects_of_labels(label_of_face);
        Self { scenes: ObjectScenes::new(meshes), object_of_face, boxes, label_of }
    }

    /// Returns what a thread needs to find objects.
    pub(crate) fn memory(&self) -> SeenObjects<'_, 'a> {
        SeenObjects::new(&self.scenes, &self.object_of_face)
    }

    /// Returns the objects of an image. `hits` are those of every pixel of `camera`.
    pub(crate) fn find(&self, memory: &mut SeenObjects<'_, '_>, hits: &Hits, camera: &Camera) -> ObjectsFile {
        let seen = memory.find(hits, camera);
        let objects = seen.iter().filter_map(|seen| {
            let label = (self.label_of)(seen.object)?;
            let boxes = self.boxes.get(&seen.object)?;
            Some(image_object(seen, &label, boxes, camera))
        });
        ObjectsFile { width: camera.width, height: camera.height, objects: objects.collect() }
    }
}

/// Returns an object as it is written.
fn image_object(seen: &SeenObject, label: &Label, boxes: &BoxesOfFaces, camera: &Camera) -> ImageObject {
    let hider = |(object, pixels): &(u32, u64)| {
        let label_index = if *object == NO_OBJECT { NULL_LABEL } else { *object };
        Hider { label_index, pixels: *pixels }
    };
    ImageObject {
        label: label.to_string(),
        label_index: seen.object,
        class: label.class.name().to_owned(),
        room: label.room.to_string(),
        visible_pixels: seen.visible_px,
        visible_box: written_box(seen.visible_box),
        amodal_pixels: seen.mask.len(),
        amodal_box: written_box(seen.mask_box),
        amodal_mask: RunLengths::encode(seen.mask.size, &seen.mask.stretches),
        occlusion: rounded(seen.occlusion(), 1e6),
        hidden_by: seen.hidden_by.iter().map(hider).collect(),
        nearest_m: seen.nearest_m,
        median_m: seen.median_m,
        beyond: seen.beyond.map(beyond_frame),
        angles: camera.is_panorama().then(|| angles(seen.mask_box, camera)),
        corners: BoxCorners {
            axis_aligned: projected(&straight(&boxes.bbox), camera),
            upright: projected(&boxes.upright, camera),
            oriented: projected(&boxes.oriented, camera),
        },
    }
}

fn written_box(bounds: PixelBox) -> [u32; 4] {
    [bounds.x, bounds.y, bounds.width, bounds.height]
}

fn beyond_frame(beyond: Beyond) -> BeyondFrame {
    let bounds = beyond
        .bounds
        .map(|[low, high]| [low.x, low.y, high.x, high.y].map(|pixels| rounded(pixels, 1e4)));
    BeyondFrame { bounds, truncation: rounded(beyond.truncation, 1e6) }
}

/// Returns the box of a panorama by angles.
fn angles(bounds: PixelBox, camera: &Camera) -> BoxAngles {
    let turn_deg = 360.0 / f64::from(camera.width);
    let left = camera.pose.azimuth_rad().to_degrees() + 180.0 - f64::from(bounds.x) * turn_deg;
    let left = left - 360.0 * ((left - 180.0) / 360.0).ceil();
    let right = left - f64::from(bounds.width) * turn_deg;
    let elevation = |row: u32| 90.0 - f64::from(row) * 180.0 / f64::from(camera.height);
    let rows = bounds.rows();
    BoxAngles {
        azimuth_deg: [left, right].map(|angle| rounded(angle, 1e6)),
        elevation_deg: [rows.end, rows.start].map(|row| rounded(elevation(row), 1e6)),
    }
}

/// Returns a box along the axes of the world as one with axes.
fn straight(bounds: &Aabb) -> OrientedBox {
    let [low, high] = [bounds.min, bounds.max].map(|corner| corner.as_dvec3());
    OrientedBox { center: (low + high) / 2.0, size: high - low, ..OrientedBox::default() }
}

/// Returns where the corners of a box are in an image.
fn projected(bounds: &OrientedBox, camera: &Camera) -> [Corner; 8] {
    bounds.corners().map(|corner: DVec3| {
        let (DVec2 { x, y }, depth) = camera.project(corner)?;
        Some([x, y, depth].map(|value| rounded(value, 1e4)))
    })
}

/// Rounds to a part of one, so that the last bits of a sum do not show.
fn rounded(value: f64, parts: f64) -> f64 {
    (value * parts).round() / parts + 0.0
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::Pose;

    #[test]
    fn boxes_of_panoramas_have_angles() {
        let camera = Camera::equirectangular(Pose::level(DVec3::ZERO, 0.0), 360);
        // The middle of the image looks along +Y: 90°.
        let ahead = angles(PixelBox { x: 170, y: 80, width: 20, height: 10 }, &camera);
        assert_eq!((ahead.azimuth_deg, ahead.elevation_deg), ([100.0, 80.0], [0.0, 10.0]));
        // Across the border, which looks along −Y, and across ±180°.
        let behind = angles(PixelBox { x: 350, y: 0, width: 20, height: 180 }, &camera);
        assert_eq!((behind.azimuth_deg, behind.elevation_deg), ([-80.0, -100.0], [-90.0, 90.0]));
        let left = angles(PixelBox { x: 90, y: 90, width: 10, height: 1 }, &camera);
        assert_eq!(left.azimuth_deg, [180.0, 170.0]);
    }
}
