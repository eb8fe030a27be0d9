//! A mesh as a binary PLY file, with labels of its faces.

use super::vertices::vertex_colors;
use super::{Labelled, NONE};
use s3d_dataset::error::UsageError;
use s3d_dataset::store::NewFile;
use s3d_dataset::{Context, Result};
use s3d_geom::glam::DVec3;
use s3d_io::mesh::{FaceColumn, MeshOut, write_ply_mesh};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// The names of more instances than these are not in the header, whose size readers limit.
const MOST_NAMES: usize = 10_000;

/// The three numbers of a face.
const COLUMNS: [&str; 3] = ["class", "instance", "room"];

impl Labelled<'_> {
    /// Writes the mesh with the labels of its faces.
    ///
    /// # Errors
    /// `WrongEnding`, and the errors of [`NewFile`].
    pub(super) fn write_ply(&self, to: &Path, ctx: &Context) -> Result<()> {
        if !to.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("ply")) {
            let why = "a labelled mesh is written as PLY: give it a name that ends with .ply";
            return Err(UsageError::WrongEnding { path: to.to_owned(), why }.into());
        }
        let file = NewFile::begin(ctx, to, self.options.overwrite)?;

        let numbers = self.numbers_of_classes();
        let room_of_face = self.labels.state().room_of_face(self.mesh);
        let rows = self
            .instance_of_face
            .iter()
            .zip(&room_of_face)
            .map(|(&instance, &room)| {
                let class = numbers.get(self.class(instance)).filter(|_| instance != NONE);
                [class.map_or(-1, |class| *class as i32), number(instance), number(room)]
            });
        let rows: Vec<[i32; 3]> = rows.collect();

        let mut names: Vec<String> = Vec::new();
        let mut classes: Vec<(u32, &str)> = numbers.iter().map(|(class, number)| (*number, *class)).collect();
        classes.sort_unstable();
        names.extend(classes.iter().map(|(number, class)| format!("class {number} {class}")));
        let rooms = self.labels.state().room_names();
        names.extend(rooms.iter().map(|(number, room)| format!("room {number} {room}")));
        let instances = self.names.iter().take(MOST_NAMES);
        names.extend(instances.map(|(number, name)| format!("instance {number} {name}")));
        ctx.check()?;

        self.write_mesh(file.path(), Some(&rows), &names)?;
        file.finish()
    }

    /// Writes the mesh, with numbers of its faces if there are any.
    pub(super) fn write_mesh(
        &self,
        path: &Path,
        rows: Option<&[[i32; 3]]>,
        comments: &[String],
    ) -> Result<()> {
        let mut lines = vec!["made by s3d label".to_owned()];
        let offset_m = self.options.offset_m;
        if offset_m != DVec3::ZERO {
            let [x, y, z] = offset_m.to_array();
            lines.push(format!("offset_m {x:?} {y:?} {z:?}: add it for the scan's own coordinates"));
        }
        lines.extend_from_slice(comments);

        let values = rows.map(|rows| [0, 1, 2].map(|k| rows.iter().map(|row| row[k]).collect::<Vec<i32>>()));
        let columns = values.iter().flatten().zip(COLUMNS);
        let columns: Vec<FaceColumn<'_>> =
            columns.map(|(values, name)| FaceColumn { name, values }).collect();
        let mesh = MeshOut {
            positions: self.mesh.positions(),
            faces: self.mesh.faces(),
            colors: &vertex_colors(self.mesh).unwrap_or_default(),
            columns: &columns,
            comments: &lines,
        };
        write_ply_mesh(path, &mesh)?;
        Ok(())
    }

    /// Returns the numbers of the classes: those of the taxonomy, 0 to 12 for S3DIS; words that are not in it
    /// follow after the largest.
    fn numbers_of_classes(&self) -> HashMap<&str, u32> {
        let taxonomy = self.labels.taxonomy();
        let known = taxonomy.classes().iter().map(|class| {
            let number = if taxonomy.is_s3dis() {
                class.index() as u32
            } else {
                taxonomy.id(*class)
            };
            (class.name(), number)
        });
        let mut numbers: HashMap<&str, u32> = known.collect();
        let mut next = numbers.values().max().map_or(0, |largest| largest + 1);
        let used: BTreeMap<&str, ()> = self.names.keys().map(|number| (self.class(*number), ())).collect();
        for class in used.into_keys() {
            numbers.entry(class).or_insert_with(|| {
                next += 1;
                next - 1
            });
        }
        numbers
    }
}

/// The number of an instance or a room, or −1 for none.
fn number(number: u32) -> i32 {
    if number == NONE { -1 } else { number as i32 }
}
