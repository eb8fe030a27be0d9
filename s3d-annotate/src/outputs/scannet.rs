//! A scan as ScanNet has it: segments of vertices, and objects as lists of segments.

use super::vertices::of_vertices;
use super::{Labelled, NONE, Object, Place};
use crate::segments::Segments;
use s3d_dataset::{Context, Result};
use s3d_io::fs::write_json;
use serde::Serialize;
use std::collections::{BTreeMap, BTreeSet, HashMap};
use std::path::Path;

/// What `*.segs.json` holds.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct SegmentsDocument<'a> {
    params: Params,
    scene_id: &'a str,
    seg_indices: Vec<u32>,
}

#[derive(Serialize)]
struct Params {
    generator: &'static str,
}

/// What `*.aggregation.json` holds.
#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Aggregation<'a> {
    scene_id: &'a str,
    segments_file: String,
    seg_groups: Vec<Group<'a>>,
}

#[derive(Serialize)]
#[serde(rename_all = "camelCase")]
struct Group<'a> {
    id: usize,
    object_id: usize,
    segments: Vec<u32>,
    label: &'a str,
}

/// The segments of a mesh, cut along its instances.
struct Refined {
    segment_of_face: Vec<u32>,
    /// The instance of each segment.
    instances: Vec<u32>,
}

impl Refined {
    /// Numbers the pairs of a segment and an instance by their first faces.
    fn new(segment_of_face: &[u32], instance_of_face: &[u32]) -> Self {
        let mut known: HashMap<(u32, u32), u32> = HashMap::new();
        let mut instances = Vec::new();
        let pairs = segment_of_face.iter().zip(instance_of_face);
        let segment_of_face = pairs.map(|(&segment, &instance)| {
            *known.entry((segment, instance)).or_insert_with(|| {
                instances.push(instance);
                instances.len() as u32 - 1
            })
        });
        let segment_of_face = segment_of_face.collect();
        Self { segment_of_face, instances }
    }
}

impl Labelled<'_> {
    /// Writes the scan into a folder, and returns its objects.
    pub(super) fn write_scannet(
        &self,
        folder: &Path,
        segments: &Segments,
        ctx: &Context,
    ) -> Result<Vec<Object>> {
        let refined = Refined::new(&segments.segment_of_face, self.instance_of_face);
        // Vertices without a face have one more segment.
        let rest = refined.instances.len() as u32;
        let of_vertices = of_vertices(self.mesh, &refined.segment_of_face);
        let seg_indices: Vec<u32> = of_vertices.iter().map(|segment| segment.unwrap_or(rest)).collect();
        ctx.check()?;

        // Only segments of a vertex can be read back.
        let used: BTreeSet<u32> = seg_indices.iter().copied().collect();
        let mut segments_of: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
        for segment in used {
            let instance = refined.instances.get(segment as usize).copied().unwrap_or(NONE);
            segments_of.entry(instance).or_default().push(segment);
        }
        segments_of.remove(&NONE);
        self.warn_of_lost(segments_of.keys(), ctx);

        let mut objects = Vec::new();
        let mut seg_groups = Vec::new();
        for (id, (instance, segments)) in segments_of.into_iter().enumerate() {
            objects.push(Object { place: Place::Number(id), instance, name: self.name(instance) });
            seg_groups.push(Group { id, object_id: id, segments, label: self.class(instance) });
        }

        let scene_id = &self.scene;
        self.write_mesh(&folder.join(format!("{scene_id}_vh_clean_2.ply")), None, &[])?;
        let segments_file = format!("{scene_id}_vh_clean_2.0.010000.segs.json");
        let params = Params { generator: concat!("s3d ", env!("CARGO_PKG_VERSION")) };
        write_json(&folder.join(&segments_file), &SegmentsDocument { params, scene_id, seg_indices })?;
        let document = Aggregation { scene_id, segments_file, seg_groups };
        write_json(&folder.join(format!("{scene_id}.aggregation.json")), &document)?;
        Ok(objects)
    }

    /// Warns of the instances that have no vertex.
    pub(super) fn warn_of_lost<'k>(&self, kept: impl Iterator<Item = &'k u32>, ctx: &Context) {
        let kept: BTreeSet<u32> = kept.copied().collect();
        let mut lost = self.names.iter().filter(|(number, _)| !kept.contains(number));
        if let Some((_, first)) = lost.next() {
            ctx.warn(format_args!(
                "{}: {} instances have no vertex of their own and are left out, the first {first}: formats \
                 with labels of faces have them (ply, s3dis)",
                self.labels.path().display(),
                1 + lost.count()
            ));
        }
    }
}
