//! Writes the S3DIS tree: text files of annotated points. Source: [`crate::formats`], "What is written".

#![expect(clippy::indexing_slicing, reason = "a writer: it indexes only its own table of digits")]

use crate::error::{Error, Result};
use crate::fs::atomic::{AtomicFile, create_dir, write_whole};
use s3d_geom::Aabb;
use s3d_geom::glam::Vec3;
use std::io::{self, Write};
use std::path::{Path, PathBuf};

/// The bytes of text that are collected before they are written.
const BATCH_BYTES: usize = 1 << 16;

/// Writes the tree of one area, room by room: `office_1/office_1.txt`, `office_1/Annotations/chair_1.txt`…,
/// `Area_1_alignmentAngle.txt`.
///
/// A line is `x y z r g b`: metres with three decimals, colours 0 to 255. A room's file holds its points in
/// the order in which they came, which is the order of its annotation files. Nothing is kept in memory. Each
/// file appears whole or not at all.
#[derive(Debug)]
pub struct S3disAreaWriter {
    dir: PathBuf,
}

impl S3disAreaWriter {
    /// Creates the folder of the area, such as `s3dis/Area_1`.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn create(dir: &Path) -> Result<Self> {
        create_dir(dir)?;
        Ok(Self { dir: dir.to_owned() })
    }

    /// Starts a room, such as "office_1".
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn room(&self, room: &str) -> Result<S3disRoomWriter> {
        let dir = self.dir.join(room);
        create_dir(&dir.join("Annotations"))?;
        let file = AtomicFile::create(dir.join(format!("{room}.txt")))?;
        Ok(S3disRoomWriter { dir, file, points: 0, unfinished: false })
    }

    /// Writes the alignment angle of each room, in the order given: whole degrees, 0 to 359. The file is
    /// named after the area's folder. Returns its size in bytes.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn alignment(&self, rooms: &[(String, u32)]) -> Result<u64> {
        let area = self.dir.file_name().map_or("Area".into(), |n| n.to_string_lossy());
        write_whole(&self.dir.join(format!("{area}_alignmentAngle.txt")), |w| {
            writeln!(w, "## Global alignment angle per disjoint space in {area} ##")?;
            writeln!(w, "## Disjoint Space Name Global Alignment Angle ##")?;
            rooms
                .iter()
                .try_for_each(|(room, degrees)| writeln!(w, "{room} {degrees}"))
        })
    }
}

/// Writes the files of one room; see [`S3disAreaWriter`].
#[derive(Debug)]
pub struct S3disRoomWriter {
    dir: PathBuf,
    file: AtomicFile,
    points: u64,
    /// Whether an instance was started and not finished: its points are in the room's file only.
    unfinished: bool,
}

impl S3disRoomWriter {
    /// Starts an instance with its class and its number in the room, from 1.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn instance(&mut self, class: &str, number: u32) -> Result<S3disInstanceWriter<'_>> {
        let file = AtomicFile::create(self.dir.join("Annotations").join(format!("{class}_{number}.txt")))?;
        self.unfinished = true;
        Ok(S3disInstanceWriter { room: self, file, points: 0, bbox: Aabb::EMPTY })
    }

    /// Appends points that belong to no instance. They are in the room's file only.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] for a coordinate that is not finite.
    ///
    /// # Panics
    /// If there are not as many colours as positions.
    pub fn append_unannotated(&mut self, positions: &[Vec3], colors: &[[u8; 3]]) -> Result<()> {
        self.append(positions, colors, None)
    }

    /// Gives the room's file its name, and returns the number of its points.
    ///
    /// # Errors
    /// [`Error::Io`].
    ///
    /// # Panics
    /// If an instance was not finished.
    pub fn finish(self) -> Result<u64> {
        assert!(!self.unfinished, "an instance of {} was not finished", self.dir.display());
        self.file.commit()?;
        Ok(self.points)
    }

    fn append(
        &mut self,
        positions: &[Vec3],
        colors: &[[u8; 3]],
        instance: Option<&mut AtomicFile>,
    ) -> Result<()> {
        let path = instance.as_deref().unwrap_or(&self.file).path().to_owned();
        let mut files = RoomAndInstance { room: &mut self.file, instance };
        write_s3dis_points(&mut files, positions, colors).map_err(|e| match e.kind() {
            io::ErrorKind::InvalidInput => Error::format(&path, e.to_string()),
            _ => Error::io(&path, "write", e),
        })?;
        self.points += positions.len() as u64;
        Ok(())
    }
}

/// Writes the same text into a room's file and into the file of an instance, if there is one.
struct RoomAndInstance<'a> {
    room: &'a mut AtomicFile,
    instance: Option<&'a mut AtomicFile>,
}

impl Write for RoomAndInstance<'_> {
    fn write(&mut self, text: &[u8]) -> io::Result<usize> {
        self.room.write_all(text)?;
        if let Some(file) = &mut self.instance {
            file.write_all(text)?;
        }
        Ok(text.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// Writes the file of one instance, and its points into the room's file; see [`S3disRoomWriter::instance`].
#[derive(Debug)]
pub struct S3disInstanceWriter<'a> {
    room: &'a mut S3disRoomWriter,
    file: AtomicFile,
    points: u64,
    bbox: Aabb,
}

impl S3disInstanceWriter<'_> {
    /// Appends points.
    ///
    /// # Errors
    /// [`Error::Io`]; [`Error::Format`] for a coordinate that is not finite.
    ///
    /// # Panics
    /// If there are not as many colours as positions.
    pub fn append(&mut self, positions: &[Vec3], colors: &[[u8; 3]]) -> Result<()> {
        self.room.append(positions, colors, Some(&mut self.file))?;
        self.points += positions.len() as u64;
        self.bbox = self.bbox.union(Aabb::from_points(positions.iter().copied()));
        Ok(())
    }

    /// Gives the instance's file its name, and returns what it holds.
    ///
    /// # Errors
    /// [`Error::Io`].
    pub fn finish(self) -> Result<S3disInstance> {
        self.file.commit()?;
        self.room.unfinished = false;
        let bbox = self.bbox.to_array().map(s3dis_coordinate);
        Ok(S3disInstance { points: self.points, bbox })
    }
}

/// The content of the file of one instance.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct S3disInstance {
    /// The number of points.
    pub points: u64,
    /// The tightest box of the points as the file has them: `[xmin, ymin, zmin, xmax, ymax, zmax]`, metres.
    /// Without points, its ends are infinite and exchanged.
    pub bbox: [f64; 6],
}

/// Returns the number that stands in the tree for a coordinate, in metres: the nearest whole millimetre.
///
/// The result is the nearest `f64` to the text, as numpy reads it. This also holds if `metres` was read from
/// the tree, up to distances where `f32` are a millimetre apart (8 km).
pub fn s3dis_coordinate(metres: f32) -> f64 {
    // Text has no negative zero.
    (f64::from(metres) * 1000.0).round() / 1000.0 + 0.0
}

/// Writes points as in the files of the tree, a line `x y z r g b` each: metres with three decimals, colours
/// 0 to 255.
///
/// # Errors
/// The errors of `w`; [`InvalidInput`](io::ErrorKind::InvalidInput) for a coordinate that is not finite.
///
/// # Panics
/// If there are not as many colours as positions.
///
/// ```
/// use s3d_geom::glam::vec3;
///
/// let mut text = Vec::new();
/// s3d_io::cloud::write_s3dis_points(&mut text, &[vec3(-24.048, 3.9971, 0.0)], &[[7, 8, 9]])?;
/// assert_eq!(text, b"-24.048 3.997 0.000 7 8 9\n");
/// # std::io::Result::Ok(())
/// ```
pub fn write_s3dis_points(w: &mut dyn Write, positions: &[Vec3], colors: &[[u8; 3]]) -> io::Result<()> {
    assert_eq!(positions.len(), colors.len(), "{} points need as many colours", positions.len());
    let mut text = Vec::new();
    for (&position, &color) in positions.iter().zip(colors) {
        if !position.is_finite() {
            let message = format!("a point at {position} cannot be written");
            return Err(io::Error::new(io::ErrorKind::InvalidInput, message));
        }
        push_point(&mut text, position, color);
        if text.len() >= BATCH_BYTES {
            w.write_all(&text)?;
            text.clear();
        }
    }
    w.write_all(&text)
}

/// Three digits of each number below a thousand, with leading zeros.
///
/// Points have millions of such numbers: copies from a table take less time than divisions.
static DIGITS: [[u8; 3]; 1000] = {
    let mut digits = [[0; 3]; 1000];
    let mut i = 0;
    while i < digits.len() {
        digits[i] = [b'0' + (i / 100) as u8, b'0' + (i / 10 % 10) as u8, b'0' + (i % 10) as u8];
        i += 1;
    }
    digits
};

/// Room for the longest line: three coordinates of a sign, nine digits and three decimals, and the colours.
const LINE_BYTES: usize = 64;

/// A line of text that is put together on the stack.
struct Line {
    bytes: [u8; LINE_BYTES],
    len: usize,
}

impl Line {
    fn put<const N: usize>(&mut self, text: [u8; N]) {
        if let Some(to) = self.bytes.get_mut(self.len..self.len + N) {
            to.copy_from_slice(&text);
            self.len += N;
        }
    }

    /// Appends a number below a thousand without leading zeros.
    fn put_short(&mut self, number: usize) {
        let digits = DIGITS[number % 1000];
        match number {
            100.. => self.put(digits),
            10.. => self.put([digits[1], digits[2]]),
            _ => self.put([digits[2]]),
        }
    }

    fn put_integer(&mut self, number: u64) {
        let below = (number % 1000) as usize;
        if number < 1000 {
            return self.put_short(below);
        }
        self.put_integer(number / 1000);
        self.put(DIGITS[below]);
    }

    /// Appends metres rounded to millimetres (halves away from zero), with three decimals and never "-0.000".
    /// They are fewer than 10⁹, so a double holds every digit.
    fn put_metres(&mut self, metres: f32) {
        let millimetres = (f64::from(metres) * 1000.0).round() as i64;
        if millimetres < 0 {
            self.put([b'-']);
        }
        let magnitude = millimetres.unsigned_abs();
        self.put_integer(magnitude / 1000);
        let [a, b, c] = DIGITS[(magnitude % 1000) as usize];
        self.put([b'.', a, b, c]);
    }
}

/// Appends the line of a point, `x y z r g b`: the text of `{:.3}` and `{}`, written many times as fast.
fn push_point(text: &mut Vec<u8>, position: Vec3, color: [u8; 3]) {
    let mut line = Line { bytes: [0; LINE_BYTES], len: 0 };
    for coordinate in position.to_array() {
        if coordinate.abs() < 1e9 {
            line.put_metres(coordinate);
        } else {
            // Farther than any scan.
            text.extend_from_slice(&line.bytes[..line.len]);
            text.extend_from_slice(format!("{coordinate:.3}").as_bytes());
            line.len = 0;
        }
        line.put([b' ']);
    }
    let [r, g, b] = color.map(usize::from);
    line.put_short(r);
    line.put([b' ']);
    line.put_short(g);
    line.put([b' ']);
    line.put_short(b);
    line.put([b'\n']);
    text.extend_from_slice(&line.bytes[..line.len]);
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use s3d_geom::glam::vec3;

    fn fixed3(metres: f32) -> String {
        let mut text = Vec::new();
        push_point(&mut text, vec3(metres, 0.0, 0.0), [0; 3]);
        let line = String::from_utf8(text).unwrap();
        line.strip_suffix(" 0.000 0.000 0 0 0\n").unwrap().to_owned()
    }

    #[test]
    fn numbers_as_the_published_tree_writes_them() {
        for (metres, text) in [
            (0.0, "0.000"),
            (-0.0001, "0.000"),
            (-0.0006, "-0.001"),
            (-24.048, "-24.048"),
            (0.9996, "1.000"),
            (1234.5, "1234.500"),
            (1e20, "100000002004087734272.000"),
        ] {
            assert_eq!(fixed3(metres), text);
        }
    }

    #[test]
    fn a_line_has_each_colour_and_the_farthest_numbers() {
        for channel in 0..=255 {
            let mut text = Vec::new();
            push_point(&mut text, vec3(-999_999_936.0, 1e9, -3e38), [channel, 255 - channel, channel]);
            let far = format!("{:.3}", -3e38_f32);
            let expected =
                format!("-999999936.000 1000000000.000 {far} {channel} {} {channel}\n", 255 - channel);
            assert_eq!(String::from_utf8(text).unwrap(), expected);
        }
    }

    proptest! {
        #[test]
        fn fast_digits_are_those_of_the_formatter(
            metres in prop_oneof![-1e3..1e3f32, -1e6..1e6f32, -1e-2..1e-2f32],
        ) {
            // `{:.3}` rounds the exact value, and an exact half to even. Ours rounds halves away from zero.
            let plain = format!("{metres:.3}");
            let half = f64::from(metres) * 1000.0;
            if (half - half.trunc()).abs() != 0.5 {
                prop_assert_eq!(fixed3(metres), if plain == "-0.000" { "0.000" } else { &plain });
            }

            let mut line = Line { bytes: [0; LINE_BYTES], len: 0 };
            line.put_integer(u64::from(metres.to_bits()));
            let digits = metres.to_bits().to_string();
            prop_assert_eq!(&line.bytes[..line.len], digits.as_bytes());
        }
    }

    #[test]
    fn coordinates_are_the_numbers_of_the_text() {
        for millimetres in (-9_000_000i32..9_000_000).step_by(997) {
            let exact = f64::from(millimetres) / 1000.0;
            let text = fixed3(exact as f32);
            let single: f32 = text.parse().unwrap();
            // Farther out, `f32` are a millimetre apart or more.
            if f64::from(single.abs().next_up() - single.abs()) < 0.001 {
                let double: f64 = text.parse().unwrap();
                assert_eq!([exact as f32, single].map(s3dis_coordinate), [double; 2], "{text}");
            }
        }
        assert!(s3dis_coordinate(-0.0001).is_sign_positive());
    }

    fn read_text(path: PathBuf) -> String {
        std::fs::read_to_string(path).unwrap()
    }

    #[test]
    fn a_room_is_written_and_read_back() {
        let dir = tempfile::tempdir().unwrap();
        let area = S3disAreaWriter::create(&dir.path().join("Area_1")).unwrap();
        let mut room = area.room("office_1").unwrap();
        let many: Vec<Vec3> = (0..10_000).map(|i| vec3(i as f32 * 0.001, -0.5, 2.25)).collect();

        let mut chair = room.instance("chair", 1).unwrap();
        chair.append(&many[..6000], &vec![[1, 20, 255]; 6000]).unwrap();
        chair.append(&many[6000..], &vec![[0, 0, 0]; 4000]).unwrap();
        let chair = chair.finish().unwrap();
        assert_eq!(chair.points, 10_000);
        assert_eq!(chair.bbox, [0.0, -0.5, 2.25, 9.999, -0.5, 2.25]);

        let mut wall = room.instance("wall", 3).unwrap();
        wall.append(&[vec3(-24.048, 3.9971, 0.0)], &[[7, 8, 9]]).unwrap();
        // The box has the numbers of the text, not of the points.
        assert_eq!(wall.finish().unwrap().bbox, [-24.048, 3.997, 0.0, -24.048, 3.997, 0.0]);
        room.append_unannotated(&[vec3(1.0, 2.0, 3.0)], &[[4, 5, 6]]).unwrap();

        let room_file = dir.path().join("Area_1/office_1/office_1.txt");
        assert!(!room_file.exists());
        assert_eq!(room.finish().unwrap(), 10_002);
        area.alignment(&[("office_1".into(), 90), ("hallway_2".into(), 0)])
            .unwrap();

        let chair = read_text(dir.path().join("Area_1/office_1/Annotations/chair_1.txt"));
        for (i, line) in chair.lines().enumerate() {
            let numbers: Vec<f32> = line.split(' ').map(|n| n.parse().unwrap()).collect();
            assert!(Vec3::from_slice(&numbers[..3]).abs_diff_eq(many[i], 0.000_501), "{line}");
            assert_eq!(numbers[3..], if i < 6000 { [1.0, 20.0, 255.0] } else { [0.0; 3] });
        }
        let wall = read_text(dir.path().join("Area_1/office_1/Annotations/wall_3.txt"));
        assert_eq!(wall, "-24.048 3.997 0.000 7 8 9\n");
        assert_eq!(read_text(room_file), format!("{chair}{wall}1.000 2.000 3.000 4 5 6\n"));
        assert_eq!(
            read_text(dir.path().join("Area_1/Area_1_alignmentAngle.txt")),
            "## Global alignment angle per disjoint space in Area_1 ##\n\
             ## Disjoint Space Name Global Alignment Angle ##\noffice_1 90\nhallway_2 0\n"
        );
    }

    #[test]
    fn a_point_that_is_not_finite_is_named_and_leaves_no_file() {
        let dir = tempfile::tempdir().unwrap();
        let area = S3disAreaWriter::create(dir.path()).unwrap();
        let mut room = area.room("WC_1").unwrap();
        let mut door = room.instance("door", 1).unwrap();
        let e = door
            .append(&[Vec3::ONE, vec3(0.0, f32::NAN, 0.0)], &[[0; 3]; 2])
            .unwrap_err();
        assert!(e.path().ends_with("WC_1/Annotations/door_1.txt") && e.to_string().contains("NaN"), "{e}");
        drop(door);
        drop(room);
        assert_eq!(std::fs::read_dir(dir.path().join("WC_1")).unwrap().count(), 1);
        assert_eq!(std::fs::read_dir(dir.path().join("WC_1/Annotations")).unwrap().count(), 0);
    }

    #[test]
    #[should_panic(expected = "was not finished")]
    fn an_unfinished_instance_is_a_callers_mistake() {
        let dir = tempfile::tempdir().unwrap();
        let mut room = S3disAreaWriter::create(dir.path()).unwrap().room("WC_1").unwrap();
        drop(room.instance("door", 1).unwrap());
        let _ = room.finish();
    }
}
