//! A mesh as a binary PLY file, with labels of its faces.

use super::vertices::vertex_colors;
use super::{Labelled, NONE};
use s3d_dataset::error::UsageError;
use s3d_dataset::store::NewFile;
use s3d_dataset::{Context, Result};
use s3d_geom::glam::DVec3;
use s3d_io::fs::write_whole;
use std::collections::{BTreeMap, HashMap};
use std::io::{self, Write};
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
        write_whole(path, |w| self.write_mesh_to(w, rows, comments))?;
        Ok(())
    }

    fn write_mesh_to(
        &self,
        w: &mut dyn Write,
        rows: Option<&[[i32; 3]]>,
        comments: &[String],
    ) -> io::Result<()> {
        let mesh = self.mesh;
        let colors = vertex_colors(mesh);
        writeln!(w, "ply\nformat binary_little_endian 1.0\ncomment made by s3d label")?;
        let offset_m = self.options.offset_m;
        if offset_m != DVec3::ZERO {
            let [x, y, z] = offset_m.to_array();
            writeln!(w, "comment offset_m {x:?} {y:?} {z:?}: add it for the scan's own coordinates")?;
        }
        for comment in comments {
            // A comment is a line of ASCII.
            let line: String = comment
                .chars()
                .map(|c| if matches!(c, ' '..='~') { c } else { '?' })
                .collect();
            writeln!(w, "comment {line}")?;
        }
        writeln!(w, "element vertex {}", mesh.positions().len())?;
        ["x", "y", "z"]
            .iter()
            .try_for_each(|name| writeln!(w, "property float {name}"))?;
        if colors.is_some() {
            let names = ["red", "green", "blue"];
            names.iter().try_for_each(|name| writeln!(w, "property uchar {name}"))?;
        }
        writeln!(w, "element face {}\nproperty list uchar int vertex_indices", mesh.faces().len())?;
        if rows.is_some() {
            COLUMNS.iter().try_for_each(|name| writeln!(w, "property int {name}"))?;
        }
        writeln!(w, "end_header")?;

        let mut colors = colors.iter().flatten();
        for position in mesh.positions() {
            for coordinate in position.to_array() {
                w.write_all(&coordinate.to_le_bytes())?;
            }
            if let Some(color) = colors.next() {
                w.write_all(color)?;
            }
        }
        let mut rows = rows.into_iter().flatten();
        for face in mesh.faces() {
            w.write_all(&[3])?;
            face.iter().try_for_each(|corner| w.write_all(&corner.to_le_bytes()))?;
            if let Some(row) = rows.next() {
                row.iter().try_for_each(|number| w.write_all(&number.to_le_bytes()))?;
            }
        }
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
