//! Tables of cameras: scan locations, and views to render.

use crate::camera::located::{rotation, uuid_from_name};
use crate::camera::posed::{Distortion, Optics, PosedCamera};
use crate::error::{Error, Result};
use crate::fs::encoding::text_of;
use crate::fs::open::read_file;
use csv::{ByteRecord, ReaderBuilder, Trim};
use s3d_geom::Pose;
use s3d_geom::glam::{DVec3, dvec2};
use std::collections::HashMap;
use std::path::Path;

/// The farthest that a location may be from the origin, metres.
pub(crate) const FARTHEST_M: f64 = 1e7;

/// The columns of a table without a header, in this order.
const COLUMNS: [&str; 8] = ["uuid", "x", "y", "z", "qx", "qy", "qz", "qw"];

/// The columns that turn a camera. A table has one of these sets; `pitch` may be missing.
const TURNS: [&[&str]; 3] = [&["qx", "qy", "qz", "qw"], &["look_x", "look_y", "look_z"], &["yaw", "pitch"]];

/// The columns of a camera's size and optics. They may be missing, and their cells may be empty.
const CAMERA: [&str; 7] = ["width", "height", "fov", "fx", "fy", "cx", "cy"];

/// The columns that a header needs, for messages.
const FORM: &str = "uuid or name, x,y,z, and qx,qy,qz,qw or look_x,look_y,look_z or yaw,pitch";

/// A place where the scanner stood.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanLocation {
    /// The name: 32 lower-case hexadecimal digits.
    pub uuid: String,
    /// The position in world metres, and the rotation of the camera: E(original) of [`crate::formats`], "What
    /// is written".
    pub pose: Pose,
    /// The line in the table, from 1; 0 if the location comes from a file without lines.
    pub line: u64,
}

/// Reads a table of scan locations: CSV with the columns `uuid,x,y,z,qx,qy,qz,qw`. Positions are in metres in
/// the Z-up world. The quaternion is the scanner's rotation, of any length but zero.
///
/// The first line may name the columns, in any order. Then `name` may stand for `uuid`. A place to look at
/// (`look_x,look_y,look_z`) or a heading in degrees (`yaw`, and perhaps `pitch`) may stand for the
/// quaternion. A uuid may be in upper case and hyphenated. If no location has a uuid, [`uuid_from_name`]
/// makes them from the names ("scan_0"). Lines that start with `#` and empty lines do not count. Source:
/// [`crate::formats`], "Scan locations".
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] with the line, for a wrong number of fields, a name that is no uuid among
/// uuids, a name that occurs twice, a number that is not finite, or a quaternion of zeros; [`Error::Format`]
/// for the file if it has no location.
pub fn read_cameras(path: &Path) -> Result<Vec<ScanLocation>> {
    parse_cameras(&read_file(path)?, path)
}

/// Reads like [`read_cameras`], from the file's bytes. Errors call the file `name`.
///
/// ```
/// use s3d_io::camera::parse_cameras;
/// use std::path::Path;
///
/// let table = b"8eb9955b866b4b5f74abb1071416c628,1,2,1.5,0,0,0,1\n";
/// let locations = parse_cameras(table, Path::new("cameras.csv"))?;
/// assert_eq!(locations[0].pose.location.to_array(), [1.0, 2.0, 1.5]);
/// # Ok::<(), s3d_io::Error>(())
/// ```
///
/// # Errors
/// Like [`read_cameras`].
pub fn parse_cameras(bytes: &[u8], name: &Path) -> Result<Vec<ScanLocation>> {
    let rows = read_rows(name, bytes)?;
    let written: Vec<String> = rows
        .iter()
        .map(|row| {
            row.name
                .chars()
                .filter(|&c| c != '-')
                .map(|c| c.to_ascii_lowercase())
                .collect()
        })
        .collect();

    // Either all names are uuids or none.
    let has_uuids = written.iter().any(|name| is_uuid(name));
    let other = rows.iter().zip(&written).find(|(_, name)| !is_uuid(name));
    if has_uuids && let Some((row, _)) = other {
        let message = format!("{:?} is no uuid of 32 hexadecimal digits, as others here are", row.name);
        return Err(Error::line(name, row.line, message));
    }

    let mut lines: HashMap<String, u64> = HashMap::new();
    let mut locations = Vec::with_capacity(rows.len());
    for (PosedCamera { name: location, pose, line, .. }, written) in rows.into_iter().zip(written) {
        let uuid = if has_uuids { written } else { uuid_from_name(&location) };
        if let Some(first) = lines.insert(uuid.clone(), line) {
            let location = if has_uuids { &uuid } else { &location };
            return Err(Error::line(name, line, format!("location {location} is on line {first} already")));
        }
        locations.push(ScanLocation { uuid, pose, line });
    }
    Ok(locations)
}

/// Reads the cameras of a table. Names are as they are written, and may occur twice.
pub(crate) fn read_rows(path: &Path, bytes: &[u8]) -> Result<Vec<PosedCamera>> {
    let bytes = text_of(bytes, path)?;
    let mut rows = Vec::new();
    let mut header: Option<Header> = None;
    // Read line by line, because csv counts comments and empty lines before a record to the record.
    for (line, text) in (1..).zip(bytes.split(|&b| b == b'\n')) {
        let text = text.trim_ascii();
        if text.is_empty() || text.starts_with(b"#") {
            continue;
        }

        let record = fields(text).map_err(|e| Error::line(path, line, e.to_string()))?;
        let header = match &header {
            Some(header) => header,
            None if has_names(&record) => {
                header = Some(Header::new(&record).map_err(|message| Error::line(path, line, message))?);
                continue;
            }
            None => header.insert(Header::plain()),
        };

        if record.len() != header.columns.len() {
            let columns = header.columns.join(",");
            let message =
                format!("{} fields; a location has {}: {columns}", record.len(), header.columns.len());
            return Err(Error::line(path, line, message));
        }

        let row = Row { record: &record, header };
        rows.push(row.camera(line).map_err(|message| Error::line(path, line, message))?);
    }
    if rows.is_empty() {
        return Err(Error::format(path, format!("has no scan location; a line is {}", COLUMNS.join(","))));
    }
    Ok(rows)
}

/// Returns whether a table's first line names its columns.
fn has_names(record: &ByteRecord) -> bool {
    record.iter().any(|field| {
        [&b"uuid"[..], b"name", b"x"]
            .iter()
            .any(|n| field.eq_ignore_ascii_case(n))
    })
}

fn is_uuid(text: &str) -> bool {
    text.len() == 32 && text.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'))
}

/// Returns the fields of a line, without white space around them.
fn fields(text: &[u8]) -> csv::Result<ByteRecord> {
    // Making a reader takes a hundred times as long as splitting a line without quotes.
    if !text.contains(&b'"') {
        return Ok(text.split(|b| *b == b',').map(<[u8]>::trim_ascii).collect());
    }
    let mut record = ByteRecord::new();
    let mut reader = ReaderBuilder::new()
        .has_headers(false)
        .trim(Trim::All)
        .from_reader(text);
    reader.read_byte_record(&mut record)?;
    Ok(record)
}

/// The columns that say how a table's cameras are turned.
#[derive(Clone, Copy)]
enum Turn {
    Quaternion([usize; 4]),
    Target([usize; 3]),
    Heading { yaw: usize, pitch: Option<usize> },
}

/// The columns of a table, and their places.
struct Header {
    columns: Vec<String>,
    name: usize,
    place: [usize; 3],
    turn: Turn,
    /// The places of the columns [`CAMERA`].
    camera: [Option<usize>; 7],
}

impl Header {
    /// Returns the header of a table that has none.
    fn plain() -> Self {
        let columns = COLUMNS.map(str::to_owned).to_vec();
        let turn = Turn::Quaternion([4, 5, 6, 7]);
        Self { columns, name: 0, place: [1, 2, 3], turn, camera: [None; 7] }
    }

    /// Reads the names of a table's columns. The error is a sentence.
    fn new(record: &ByteRecord) -> std::result::Result<Self, String> {
        let columns: Vec<String> = record
            .iter()
            .map(|field| String::from_utf8_lossy(field).to_ascii_lowercase())
            .collect();
        let name = find(&columns, "uuid")
            .or_else(|| find(&columns, "name"))
            .ok_or_else(|| format!("the header has no column uuid or name; it needs {FORM}"))?;
        let place = [needed(&columns, "x")?, needed(&columns, "y")?, needed(&columns, "z")?];
        let turn = Turn::of_columns(&columns)?;

        for (i, column) in columns.iter().enumerate() {
            if !is_known(column) || (i != name && ["uuid", "name"].contains(&column.as_str())) {
                let more = CAMERA.join(",");
                return Err(format!(
                    "the header has a column {column:?}; it needs {FORM}, and may have {more}"
                ));
            }
            if find(&columns, column) != Some(i) {
                return Err(format!("the header has two columns {column}"));
            }
        }
        let camera = CAMERA.map(|name| find(&columns, name));
        Ok(Self { columns, name, place, turn, camera })
    }
}

impl Turn {
    /// Finds the columns that turn a camera. The error is a sentence.
    fn of_columns(columns: &[String]) -> std::result::Result<Self, String> {
        let sets: Vec<&&[&str]> = TURNS
            .iter()
            .filter(|names| names.iter().any(|name| find(columns, name).is_some()))
            .collect();
        let needed = |name: &str| needed(columns, name);
        match sets.as_slice() {
            [["qx", ..]] => {
                Ok(Self::Quaternion([needed("qx")?, needed("qy")?, needed("qz")?, needed("qw")?]))
            }
            [["look_x", ..]] => Ok(Self::Target([needed("look_x")?, needed("look_y")?, needed("look_z")?])),
            [_] => Ok(Self::Heading { yaw: needed("yaw")?, pitch: find(columns, "pitch") }),
            [] => Err(format!("the header does not say how cameras are turned; it needs {FORM}")),
            _ => Err(format!("the header says twice how cameras are turned; it needs {FORM}")),
        }
    }
}

fn find(columns: &[String], name: &str) -> Option<usize> {
    columns.iter().position(|column| column == name)
}

fn needed(columns: &[String], name: &str) -> std::result::Result<usize, String> {
    find(columns, name).ok_or_else(|| format!("the header has no column {name}; it needs {FORM}"))
}

/// Returns whether a table may have a column of this name.
fn is_known(column: &str) -> bool {
    COLUMNS
        .iter()
        .chain(["name"].iter())
        .chain(TURNS.iter().copied().flatten())
        .chain(&CAMERA)
        .any(|name| *name == column)
}

/// A line of a table.
struct Row<'a> {
    record: &'a ByteRecord,
    header: &'a Header,
}

impl Row<'_> {
    fn text(&self, column: usize) -> std::borrow::Cow<'_, str> {
        String::from_utf8_lossy(self.record.get(column).unwrap_or_default())
    }

    fn number(&self, column: usize) -> std::result::Result<f64, String> {
        let text = self.text(column);
        text.parse().ok().filter(|v: &f64| v.is_finite()).ok_or_else(|| {
            let name = self.header.columns.get(column).map_or("", String::as_str);
            format!("{name} is {text:?}, which is no finite number")
        })
    }

    fn vector(&self, columns: [usize; 3]) -> std::result::Result<DVec3, String> {
        let [x, y, z] = columns.map(|column| self.number(column));
        Ok(DVec3::new(x?, y?, z?))
    }

    /// Returns the camera of the line. The error is a sentence.
    fn camera(&self, line: u64) -> std::result::Result<PosedCamera, String> {
        let name = self.text(self.header.name).into_owned();
        if name.is_empty() {
            return Err("the location has no name".to_owned());
        }
        let at = self.vector(self.header.place)?;
        if at.abs().max_element() > FARTHEST_M {
            let DVec3 { x, y, z } = at;
            return Err(format!(
                "({x}, {y}, {z}) is more than {FARTHEST_M} m from the origin: are these metres?"
            ));
        }

        let pose = self.pose(at)?;
        let (size, optics) = self.intrinsics()?;
        Ok(PosedCamera { size, optics, line, ..PosedCamera::new(name, pose) })
    }

    /// Returns the pose of the camera, which is at `at`.
    fn pose(&self, at: DVec3) -> std::result::Result<Pose, String> {
        match self.header.turn {
            Turn::Quaternion(columns) => {
                let [x, y, z, w] = columns.map(|column| self.number(column));
                Ok(Pose::from_scanner(at, rotation([x?, y?, z?, w?])?))
            }
            Turn::Target(columns) => {
                let target = self.vector(columns)?;
                // In an image straight up or down the top is north, as for a heading of 0.
                let flat = (target - at).truncate().length() < 1e-9 * (target - at).length();
                let up = if flat {
                    DVec3::Y * (at.z - target.z).signum()
                } else {
                    DVec3::Z
                };
                Pose::look_at(at, target, up).map_err(|e| e.to_string())
            }
            Turn::Heading { yaw, pitch } => {
                let pitch_deg = pitch.map_or(Ok(0.0), |column| self.number(column))?;
                Ok(Pose::level(at, self.number(yaw)?.to_radians()).turned(0.0, pitch_deg.to_radians()))
            }
        }
    }

    /// Returns the number in a cell; `None` if the cell is empty or there is no such column.
    fn optional(&self, column: Option<usize>) -> std::result::Result<Option<f64>, String> {
        match column {
            Some(column) if !self.text(column).is_empty() => self.number(column).map(Some),
            _ => Ok(None),
        }
    }

    /// Returns size and optics, where the line tells them.
    fn intrinsics(&self) -> std::result::Result<(Option<[u32; 2]>, Option<Optics>), String> {
        let [width, height, fov, fx, fy, cx, cy] = self.header.camera.map(|column| self.optional(column));
        let size = match (width?, height?) {
            (None, None) => None,
            (Some(width), Some(height)) => {
                let size = side(width).zip(side(height));
                let (width, height) = size.ok_or_else(|| format!("an image of {width} × {height} pixels"))?;
                Some([width, height])
            }
            _ => return Err("width and height go together".to_owned()),
        };

        let optics = match (fov?, fx?, fy?, cx?, cy?) {
            (None, None, None, None, None) => None,
            (Some(deg), None, None, None, None) if deg > 0.0 && deg < 180.0 => {
                Some(Optics::AngleOfView { fov_rad: deg.to_radians() })
            }
            (Some(deg), None, None, None, None) => {
                return Err(format!("fov is {deg}, not between 0 and 180 degrees"));
            }
            (None, Some(fx), fy, cx, cy) if cx.is_some() == cy.is_some() => {
                let focal_px = dvec2(fx, fy.unwrap_or(fx));
                if focal_px.min_element() <= 0.0 {
                    return Err(format!("fx, fy are {}, {}: both must be above 0", focal_px.x, focal_px.y));
                }
                let center_px = cx.zip(cy).map(|(cx, cy)| dvec2(cx, cy));
                Some(Optics::Pinhole { focal_px, center_px, distortion: Distortion::None })
            }
            _ => return Err("a camera has fov, or fx and perhaps fy, cx and cy".to_owned()),
        };

        Ok((size, optics))
    }
}

/// Returns the side of a picture in pixels, if the number is one.
fn side(number: f64) -> Option<u32> {
    (number.fract() == 0.0 && (1.0..=1e9).contains(&number)).then_some(number as u32)
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::{DQuat, dvec3};

    const A: &str = "8eb9955b866b4b5f74abb1071416c628";
    const B: &str = "508160BA-5d80-a2e3-6560-9578a09bab8b";

    fn read(text: &str) -> Result<Vec<ScanLocation>> {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cameras.csv");
        std::fs::write(&path, text).unwrap();
        read_cameras(&path)
    }

    #[test]
    fn locations_with_and_without_header() {
        let plain = read(&format!("# a scan\n{A},1,2,3,0,0,0,1\r\n\n {B}, -1e0 ,0,0,0,0,1,0\n")).unwrap();
        assert_eq!((plain[0].uuid.as_str(), plain[0].line), (A, 2));
        assert_eq!(plain[0].pose, Pose::from_scanner(dvec3(1.0, 2.0, 3.0), DQuat::IDENTITY));
        assert_eq!((plain[1].uuid.as_str(), plain[1].line), ("508160ba5d80a2e365609578a09bab8b", 4));
        assert!(plain[1].pose.forward().abs_diff_eq(-DVec3::Y, 1e-12));

        let header = read(&format!("\u{feff}X,y,z,uuid,qw,qx,qy,qz\n1,2,3,{A},1,0,0,0\n")).unwrap();
        assert_eq!(header[0].pose, plain[0].pose);
    }

    #[test]
    fn names_that_are_no_uuids_become_some() {
        let named = read("scan_0,1,2,3,0,0,0,1\nroom 2/left,4,5,6,0,0,0,1\n").unwrap();
        assert_eq!(named[0].uuid, uuid_from_name("scan_0"));
        assert!(named.iter().all(|l| is_uuid(&l.uuid)) && named[0].uuid != named[1].uuid);
        let twice = read("scan_0,1,2,3,0,0,0,1\nscan_0,4,5,6,0,0,0,1\n")
            .unwrap_err()
            .to_string();
        assert!(twice.contains("location scan_0 is on line 1 already"), "{twice}");
        let nameless = read("scan_0,1,2,3,0,0,0,1\n,4,5,6,0,0,0,1\n").unwrap_err().to_string();
        assert!(nameless.contains("line 2: the location has no name"), "{nameless}");
    }

    #[test]
    fn cameras_look_at_places_and_along_headings() {
        let look =
            read("look_x,name,x,y,z,look_y,look_z\n4,a,1,2,3,2,3\n1,b,1,2,3,2,0\n1,c,1,2,3,2,9\n").unwrap();
        assert!(look[0].pose.forward().abs_diff_eq(DVec3::X, 1e-12) && look[0].pose.up() == DVec3::Z);
        // Like cameras at heading 0 that are tilted down and up.
        for (location, pitch_deg) in [(&look[1], -90f64), (&look[2], 90.0)] {
            let tilted = Pose::level(DVec3::ZERO, 0.0).turned(0.0, pitch_deg.to_radians());
            assert!(
                location
                    .pose
                    .world_from_camera
                    .abs_diff_eq(tilted.world_from_camera, 1e-12)
            );
        }

        let yaw = read("name,x,y,z,yaw,pitch\na,1,2,3,90,-30\n").unwrap();
        let expected = Pose::level(dvec3(1.0, 2.0, 3.0), 90f64.to_radians()).turned(0.0, -30f64.to_radians());
        assert_eq!((yaw[0].pose, &yaw[0].uuid), (expected, &uuid_from_name("a")));
        assert_eq!(
            read("yaw,name,x,y,z\n0,a,1,2,3\n").unwrap()[0].pose,
            Pose::level(dvec3(1.0, 2.0, 3.0), 0.0)
        );

        for (text, words) in [
            ("name,x,y,z\n", "does not say how cameras are turned"),
            ("name,x,y,z,yaw,qx,qy,qz,qw\n", "says twice"),
            ("name,x,y,z,pitch\n", "no column yaw"),
            ("name,x,y,z,yaw,roll\n", "has a column \"roll\""),
            ("name,x,y,z,yaw,x\n", "two columns x"),
            ("name,uuid,x,y,z,yaw\n", "has a column \"name\""),
            ("x,y,z,yaw\n", "no column uuid or name"),
            ("name,x,y,z,yaw\na,1,2,3\n", "line 2: 4 fields; a location has 5: name,x,y,z,yaw"),
            ("name,x,y,z,look_x,look_y,look_z\na,1,2,3,1,2,3\n", "line 2: the target is where the camera is"),
        ] {
            let message = read(text).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
    }

    fn pinhole(fx: f64, fy: f64, center_px: Option<s3d_geom::glam::DVec2>) -> Option<Optics> {
        Some(Optics::Pinhole { focal_px: dvec2(fx, fy), center_px, distortion: Distortion::None })
    }

    fn rows_of(text: &str) -> Result<Vec<PosedCamera>> {
        read_rows(Path::new("c.csv"), text.as_bytes())
    }

    #[test]
    fn rows_may_have_intrinsics() {
        let head = "name,x,y,z,yaw,width,height,fov,fx,fy,cx,cy\n";
        let text = format!(
            "{head}a,0,0,1,0,640,480,90,,,,\nb,0,0,1,0,,,,500,510,320,240\nc,0,0,1,0,64,48,,500,,,\n"
        );
        let cameras = rows_of(&text).unwrap();
        assert_eq!(cameras[0].size, Some([640, 480]));
        assert_eq!(cameras[0].optics, Some(Optics::AngleOfView { fov_rad: 90f64.to_radians() }));
        assert_eq!(
            (cameras[1].size, cameras[1].optics),
            (None, pinhole(500.0, 510.0, Some(dvec2(320.0, 240.0))))
        );
        assert_eq!(cameras[2].optics, pinhole(500.0, 500.0, None));
        // Names may occur twice: a caller that makes files of them must check.
        assert_eq!(rows_of("name,x,y,z,yaw\na,0,0,1,0\na,0,0,1,0\n").unwrap().len(), 2);
        for (row, words) in [
            ("a,0,0,1,0,640,,,,,,", "line 2: width and height go together"),
            ("a,0,0,1,0,640.5,480,,,,,", "an image of 640.5 × 480"),
            ("a,0,0,1,0,,,180,,,,", "fov is 180"),
            ("a,0,0,1,0,,,90,500,,,", "a camera has fov, or fx"),
            ("a,0,0,1,0,,,,500,,320,", "a camera has fov, or fx"),
            ("a,0,0,1,0,,,,500,-1,,", "fx, fy are 500, -1"),
            ("a,0,0,1,0,,,wide,,,,", "fov is \"wide\""),
        ] {
            let message = rows_of(&format!("{head}{row}\n")).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
    }

    #[test]
    fn every_fault_has_its_line() {
        let good = format!("{A},0,0,0,0,0,0,1\n");
        for (text, words) in [
            (format!("{A},0,0,0,0,0,1\n"), "line 2: 7 fields"),
            (format!("{A},0,0,0,0,0,0,1\n"), "is on line 1 already"),
            (format!("{B},0,nan,0,0,0,0,1\n"), "line 2: y is \"nan\""),
            (format!("{B},0,0,0,0,0,0,1e999\n"), "qw is \"1e999\""),
            (format!("{B},0,x,0,0,0,0,1\n"), "y is \"x\""),
            (format!("{B},0,0,0,0,0,0,0\n"), "line 2: the quaternion"),
            (format!("{},0,0,0,0,0,0,1\n", &B[1..]), "is no uuid"),
            (format!("{}g,0,0,0,0,0,0,1\n", &B[..35]), "is no uuid"),
        ] {
            let message = read(&(good.clone() + &text)).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
        assert!(
            read("uuid,x,y,z,qx,qy,qz,w\n")
                .unwrap_err()
                .to_string()
                .contains("no column qw")
        );
        for empty in ["", "# nothing\n", "uuid,x,y,z,qx,qy,qz,qw\n"] {
            assert!(read(empty).unwrap_err().to_string().contains("no scan location"));
        }
    }
}
