//! Points on the surface, in the tree of S3DIS.

use super::{Labelled, NONE, Object, Place};
use s3d_dataset::error::{InputError, UsageError};
use s3d_dataset::{Context, Progress, Result};
use s3d_geom::{Density, PointCloud, SurfaceSampler};
use s3d_io::cloud::{S3disAreaWriter, S3disInstanceWriter};
use s3d_io::fs::portable_file_name;
use s3d_label::{Label, LabelId, wall_directions_deg};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// The folder of the area in the tree.
const AREA: &str = "Area_1";

/// The most points of a tree, which take about 80 GB of text.
const MOST_POINTS: f64 = 1e9;

/// The number of points that are drawn and in memory at a time.
const CHUNK: u64 = 1 << 20;

/// The faces of the rooms, by instance.
type Rooms = BTreeMap<u32, BTreeMap<u32, Vec<u32>>>;

impl Labelled<'_> {
    /// Writes the tree into a folder, and returns the files of the instances.
    pub(super) fn write_s3dis(&self, folder: &Path, ctx: &Context) -> Result<Vec<Object>> {
        let room_of_face = self.labels.state().room_of_face(self.mesh);
        let names = self.labels.state().room_names();
        let rooms = self.rooms(&room_of_face, &names, ctx)?;
        let directions = self.directions_deg(&room_of_face, &names);

        let faces = rooms.values().flat_map(BTreeMap::values).flatten();
        let area_m2: f64 = faces.map(|face| self.mesh.area(*face)).sum();
        let points = area_m2 * self.options.points_per_m2;
        // A density that is no number fails too.
        if !(self.options.points_per_m2 > 0.0 && points <= MOST_POINTS) {
            let most = MOST_POINTS / area_m2;
            let range = format!("above 0, and at most {most:.0} for {area_m2:.0} m²");
            return Err(UsageError::OutOfRange { option: "density", range }.into());
        }

        let area = S3disAreaWriter::create(&folder.join(AREA))?;
        let progress = ctx.progress("sampling", "points", points as u64);
        let mut objects = Vec::new();
        let mut alignment = Vec::new();
        for (number, instances) in &rooms {
            let room = portable_file_name(names.get(number).map_or("", |name| name));
            let mut writer = area.room(&room)?;
            let mut counts: HashMap<String, u32> = HashMap::new();
            for (&instance, faces) in instances {
                let class = portable_file_name(self.class(instance));
                let count = counts.entry(class.clone()).or_default();
                *count += 1;
                let mut file = writer.instance(&class, *count)?;
                self.draw(faces, (*number, instance), &mut file, &progress, ctx)?;
                file.finish()?;
                let place = Place::File(format!("{AREA}/{room}/Annotations/{class}_{count}.txt"));
                objects.push(Object { place, instance, name: self.name(instance) });
            }
            writer.finish()?;
            alignment.push((room, directions.get(number).copied().unwrap_or(0)));
        }
        area.alignment(&alignment)?;
        Ok(objects)
    }

    /// Returns the labelled faces of the rooms with a type, and warns of what is left out.
    fn rooms(&self, room_of_face: &[u32], names: &BTreeMap<u32, String>, ctx: &Context) -> Result<Rooms> {
        let mut rooms = Rooms::new();
        let [mut unlabelled_m2, mut elsewhere_m2] = [0.0; 2];
        for ((face, instance), room) in (0u32..).zip(self.instance_of_face).zip(room_of_face) {
            if *instance == NONE {
                unlabelled_m2 += self.mesh.area(face);
            } else if names.contains_key(room) {
                let instances = rooms.entry(*room).or_default();
                instances.entry(*instance).or_default().push(face);
            } else {
                elsewhere_m2 += self.mesh.area(face);
            }
        }

        let path = self.labels.path();
        if rooms.is_empty() {
            let why = "no labelled surface is in a room that has a type, and the tree of S3DIS is made of \
                       such rooms: draw the rooms and say their types, or write another format";
            return Err(InputError::Unfit { path: path.to_owned(), why: why.to_owned() }.into());
        }
        let shown = path.display();
        if unlabelled_m2 > 0.0 {
            ctx.warn(format_args!(
                "{shown}: {unlabelled_m2:.2} m² without a label are left out of the points"
            ));
        }
        if elsewhere_m2 > 0.0 {
            ctx.warn(format_args!(
                "{shown}: {elsewhere_m2:.2} m² with a label are in no room that has a type, and are left out \
                 of the points"
            ));
        }
        Ok(rooms)
    }

    /// Draws the points of faces, at least one.
    fn draw(
        &self,
        faces: &[u32],
        (room, instance): (u32, u32),
        file: &mut S3disInstanceWriter<'_>,
        progress: &Progress<'_>,
        ctx: &Context,
    ) -> Result<()> {
        let area_m2: f64 = faces.iter().map(|face| self.mesh.area(*face)).sum();
        let points = (area_m2 * self.options.points_per_m2).round().max(1.0) as u64;
        // Each part has random numbers of its own, whatever else is labelled.
        let seed = self.options.seed ^ (u64::from(room) << 32 | u64::from(instance));
        let sampler = SurfaceSampler::over_faces(self.mesh, faces.to_vec(), Density::Total(points), seed);
        let mut cloud = PointCloud::default();
        let mut at = 0;
        while at < sampler.len() {
            ctx.check()?;
            let end = sampler.len().min(at + CHUNK);
            sampler.sample(at..end, &mut cloud);
            file.append(&cloud.positions, &cloud.colors)?;
            progress.add(end - at);
            at = end;
        }
        Ok(())
    }

    /// Returns the direction of the walls of each room, whole degrees. Rooms and classes that are no words of
    /// the taxonomy have none.
    fn directions_deg(&self, room_of_face: &[u32], names: &BTreeMap<u32, String>) -> BTreeMap<u32, u32> {
        let taxonomy = self.labels.taxonomy();
        let rooms: BTreeMap<u32, _> = names
            .iter()
            .filter_map(|(number, name)| Some((*number, taxonomy.room(name).ok()?)))
            .collect();
        let label = |instance: u32, room: u32| {
            let class = taxonomy.class(self.class(instance)).ok()?;
            Some(Label { class, instance, room: *rooms.get(&room)?, area: 1 })
        };
        let of_face = || self.instance_of_face.iter().zip(room_of_face);
        let different: BTreeMap<(u32, u32), Label> = of_face()
            .filter_map(|(&instance, &room)| Some(((instance, room), label(instance, room)?)))
            .collect();
        let Ok(table) = taxonomy.table(different.values().copied()) else { return BTreeMap::new() };
        let ids: HashMap<(u32, u32), LabelId> = different
            .iter()
            .filter_map(|(key, label)| Some((*key, table.id_of(label)?)))
            .collect();
        let label_of_face = of_face().map(|(&i, &r)| ids.get(&(i, r)).copied().unwrap_or_default());
        let label_of_face: Vec<LabelId> = label_of_face.collect();
        let found = wall_directions_deg(self.mesh, &table, &label_of_face);
        rooms
            .into_iter()
            .filter_map(|(number, room)| Some((number, *found.get(&room)?)))
            .collect()
    }
}
