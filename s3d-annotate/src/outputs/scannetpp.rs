//! A scan as ScanNet++ has it: objects as lists of vertices, with boxes.

use super::vertices::of_vertices;
use super::{Labelled, NONE, Object, Place};
use s3d_dataset::{Context, Result};
use s3d_geom::Aabb;
use s3d_io::fs::{create_dir, write_json};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// What `segments.json` holds.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct SegmentsDocument<'a> {
    scene_id: &'a str,
    seg_indices: Vec<u32>,
}

/// What `segments_anno.json` holds.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Annotation<'a> {
    scene_id: &'a str,
    seg_groups: Vec<Group<'a>>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Group<'a> {
    id: usize,
    object_id: usize,
    label: &'a str,
    segments: Vec<u32>,
    obb: Obb,
}

/// The box of an object: here the one along the axes.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Obb {
    centroid: [f32; 3],
    axes_lengths: [f32; 3],
    normalized_axes: [f32; 9],
    min: [f32; 3],
    max: [f32; 3],
}

impl From<Aabb> for Obb {
    fn from(bounds: Aabb) -> Self {
        Self {
            centroid: bounds.center().to_array(),
            axes_lengths: bounds.size().to_array(),
            normalized_axes: [1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0],
            min: bounds.min.to_array(),
            max: bounds.max.to_array(),
        }
    }
}

impl Labelled<'_> {
    /// Writes the scan into a folder, and returns its objects.
    pub(super) fn write_scannetpp(&self, folder: &Path, ctx: &Context) -> Result<Vec<Object>> {
        let mut vertices_of: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for (vertex, instance) in (0..).zip(of_vertices(self.mesh, self.instance_of_face)) {
            vertices_of.entry(instance.unwrap_or(NONE)).or_default().push(vertex);
        }
        vertices_of.remove(&NONE);
        self.warn_of_lost(vertices_of.keys(), ctx);
        ctx.check()?;

        let mut boxes: BTreeMap<u32, Aabb> = BTreeMap::new();
        for (face, instance) in (0u32..).zip(self.instance_of_face) {
            let bounds = boxes.entry(*instance).or_insert(Aabb::EMPTY);
            *bounds = bounds.union(Aabb::from_points(self.mesh.triangle(face)));
        }

        let mut objects = Vec::new();
        let mut seg_groups = Vec::new();
        for (id, (instance, segments)) in (1..).zip(vertices_of) {
            objects.push(Object { place: Place::Number(id), instance, name: self.name(instance) });
            let obb = boxes.get(&instance).copied().unwrap_or(Aabb::EMPTY).into();
            seg_groups.push(Group { id, object_id: id, label: self.class(instance), segments, obb });
        }

        let scans = folder.join("scans");
        create_dir(&scans)?;
        let scene_id = &self.scene;
        let seg_indices = (0..self.mesh.positions().len() as u32).collect();
        self.write_mesh(&scans.join("mesh_aligned_0.05.ply"), None, &[])?;
        write_json(&scans.join("segments.json"), &SegmentsDocument { scene_id, seg_indices })?;
        write_json(&scans.join("segments_anno.json"), &Annotation { scene_id, seg_groups })?;
        Ok(objects)
    }
}
