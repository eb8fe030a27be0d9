//! What questions are asked about: a room, its things, and the views that show it.

use super::distance::Surface;
use crate::error::Result;
use crate::pack::multiview::{View, views_of};
use crate::pack::source::Source;
use crate::record::tables::RoomRecord;
use s3d_geom::TriMesh;
use s3d_geom::glam::DVec2;
use s3d_io::Error as FileError;
use s3d_io::dataset::{Domain, InstanceEntry, UprightBox, read_instances};
use s3d_io::fs::read_json;
use s3d_label::LabelTable;
use std::collections::BTreeMap;

/// A room.
pub(super) struct Scene<'a> {
    /// Its name in all files: area and room.
    pub(super) id: String,
    /// The area of its floor, m².
    pub(super) size_m2: f64,
    /// Its things, by label index: what has a shape of its own, so neither walls and the like nor clutter.
    pub(super) things: Vec<Thing>,
    /// Its views, by location and number.
    pub(super) views: Vec<View<'a>>,
}

/// A thing with a surface.
pub(super) struct Thing {
    pub(super) index: u32,
    pub(super) label: String,
    pub(super) class: String,
    /// Along the axes of the world: xmin, ymin, zmin, xmax, ymax, zmax.
    pub(super) bbox: [f32; 6],
    pub(super) upright: UprightBox,
    pub(super) surface: Surface,
}

impl Thing {
    /// The middle of its box, from above.
    pub(super) fn middle(&self) -> DVec2 {
        DVec2::new(self.upright.center[0], self.upright.center[1])
    }

    /// The directions of the horizontal axes of its box.
    pub(super) fn axes(&self) -> [DVec2; 2] {
        let along = DVec2::from_angle(self.upright.yaw_deg.to_radians());
        [along, along.perp()]
    }

    /// The corners of its box, from above.
    pub(super) fn corners(&self) -> [DVec2; 4] {
        let [along, across] = self.axes();
        let half = [0.5 * self.upright.size[0] * along, 0.5 * self.upright.size[1] * across];
        [[1.0, 1.0], [-1.0, 1.0], [-1.0, -1.0], [1.0, -1.0]]
            .map(|[a, b]| self.middle() + a * half[0] + b * half[1])
    }
}

/// Returns the rooms of an area that have things.
pub(super) fn scenes_of<'a>(source: &'a Source, area: u32, table: &LabelTable) -> Result<Vec<Scene<'a>>> {
    let (layout, files) = (&source.data.layout, &source.data.files);
    let instances = read_instances(files.checked(&layout.instances_json(area))?)?;
    let rooms: Vec<RoomRecord> = read_json(files.checked(&layout.rooms_json(area))?)?;
    let votes = source.data.face_votes(area)?;
    let mesh = source.data.mesh(area)?.map(|file| file.mesh);
    let Some((mesh, label_of_face)) = mesh.zip(votes.map(|votes| votes.label)) else {
        let message = "there is no labelled mesh: finish the export";
        return Err(FileError::format(&layout.rgb_obj(area), message).into());
    };
    let mut faces: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (face, label) in (0..).zip(&label_of_face) {
        faces.entry(*label).or_default().push(face);
    }

    let mut views: BTreeMap<String, Vec<View<'a>>> = BTreeMap::new();
    for view in views_of(source, area)? {
        views.entry(view.image.room.clone()).or_default().push(view);
    }
    let mut scenes = Vec::new();
    for room in rooms {
        let things: Vec<Thing> = instances
            .iter()
            .filter(|instance| instance.room == room.room && is_thing(table, instance))
            .filter_map(|instance| thing(instance, &mesh, faces.get(&instance.label_index)?))
            .collect();
        if !things.is_empty() {
            let id = format!("area_{area}_{}", room.room);
            let views = views.remove(&room.room).unwrap_or_default();
            scenes.push(Scene { id, size_m2: room.floor_m2, things, views });
        }
    }
    Ok(scenes)
}

fn is_thing(table: &LabelTable, instance: &InstanceEntry) -> bool {
    let taxonomy = table.taxonomy();
    let class = taxonomy.class(&instance.class).ok();
    class.is_some_and(|class| !taxonomy.is_stuff(class) && taxonomy.clutter() != Some(class))
}

fn thing(instance: &InstanceEntry, mesh: &TriMesh, faces: &[u32]) -> Option<Thing> {
    let surface = instance.surface?;
    Some(Thing {
        index: instance.label_index,
        label: instance.label.clone(),
        class: instance.class.clone(),
        bbox: surface.bbox,
        upright: surface.upright,
        surface: Surface::new(mesh, faces),
    })
}

/// What a view shows of a label: the number of its pixels and their box, xmin, ymin, xmax, ymax.
pub(super) struct Shown {
    pub(super) pixels: u64,
    pub(super) bounds: [u32; 4],
}

/// Returns what a view shows of each label.
pub(super) fn shown(source: &Source, view: &View<'_>) -> Result<BTreeMap<u32, Shown>> {
    let image = source.rgb8(view.image, Domain::Semantic)?;
    let width = image.width();
    let mut found: BTreeMap<u32, Shown> = BTreeMap::new();
    for (i, [r, g, b]) in (0..).zip(image.pixels()) {
        let index = u32::from_be_bytes([0, *r, *g, *b]);
        let (x, y) = (i % width, i / width);
        let shown = found.entry(index).or_insert(Shown { pixels: 0, bounds: [x, y, x, y] });
        shown.pixels += 1;
        let [x0, y0, x1, y1] = shown.bounds;
        shown.bounds = [x0.min(x), y0.min(y), x1.max(x), y1.max(y)];
    }
    Ok(found)
}
