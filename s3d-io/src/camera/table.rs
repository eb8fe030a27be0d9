//! The table of scan locations.

use crate::camera::located::uuid_from_name;
use crate::error::{Error, Result};
use crate::fs::encoding::text_of;
use crate::fs::open::read_file;
use csv::{ByteRecord, ReaderBuilder, Trim};
use s3d_geom::Pose;
use s3d_geom::glam::{DQuat, DVec3, DVec4};
use std::collections::HashMap;
use std::path::Path;

/// A location farther than this from the origin is no place in a building.
pub(crate) const FARTHEST_M: f64 = 1e7;

/// The columns of the table, in the order that they have without a header.
const COLUMNS: [&str; 8] = ["uuid", "x", "y", "z", "qx", "qy", "qz", "qw"];

/// A place from which the scanner looked around.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanLocation {
    /// Its name: 32 lower-case hexadecimal digits.
    pub uuid: String,
    /// Where it is, world metres, and how its camera is turned: E(original) of formats.md, "What is written".
    pub pose: Pose,
    /// Its line in the table, from 1; 0 if it comes from a file without lines.
    pub line: u64,
}

/// Reads a table of scan locations: CSV with the columns `uuid,x,y,z,qx,qy,qz,qw`, metres in the Z-up world
/// and the scanner's rotation, of any length but zero, as a quaternion.
///
/// A first line of those eight names gives their order; without one it is that order. A uuid may be in upper
/// case and hyphenated; where no location has one, their names ("scan_0") are turned into uuids by
/// [`uuid_from_name`]. Lines that start with `#` and empty lines do not count. Source: formats.md,
/// "Scan locations".
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`], with the line, for a wrong number of fields, a name that is no uuid
/// beside others that are, one that is there twice, a number that is not finite, a quaternion of zeros; for the file, if
/// it has no location.
pub fn read_cameras(path: &Path) -> Result<Vec<ScanLocation>> {
    parse_cameras(&read_file(path)?, path)
}

/// As [`read_cameras`], from the file's bytes; errors call it `name`.
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
/// As [`read_cameras`].
pub fn parse_cameras(bytes: &[u8], name: &Path) -> Result<Vec<ScanLocation>> {
    let path = name;
    let bytes = text_of(bytes, path)?;
    let mut locations = Vec::new();
    let mut lines: HashMap<String, u64> = HashMap::new();
    let mut order: [usize; 8] = std::array::from_fn(|i| i);
    let mut is_first = true;
    let (mut names, mut first_name) = (0, None);
    // Line by line: csv counts the comments and empty lines before a record to the record.
    for (line, text) in (1..).zip(bytes.split(|&b| b == b'\n')) {
        let text = text.trim_ascii();
        if text.is_empty() || text.starts_with(b"#") {
            continue;
        }
        let record = fields(text).map_err(|e| Error::line(path, line, e.to_string()))?;
        if record.len() != COLUMNS.len() {
            let message =
                format!("{} fields; a location has {}: {}", record.len(), COLUMNS.len(), COLUMNS.join(","));
            return Err(Error::line(path, line, message));
        }
        if std::mem::take(&mut is_first) && record.iter().any(|f| f.eq_ignore_ascii_case(b"uuid")) {
            order = header(&record).map_err(|message| Error::line(path, line, message))?;
            continue;
        }
        let location = location(&record, order, line).map_err(|message| Error::line(path, line, message))?;
        if !is_uuid(&location.uuid) {
            names += 1;
            first_name.get_or_insert_with(|| (line, location.uuid.clone()));
        }
        if let Some(first) = lines.insert(location.uuid.clone(), line) {
            return Err(Error::line(
                path,
                line,
                format!("location {} is on line {first} already", location.uuid),
            ));
        }
        locations.push(location);
    }
    if locations.is_empty() {
        return Err(Error::format(path, format!("has no scan location; a line is {}", COLUMNS.join(","))));
    }
    if let Some((line, name)) = first_name {
        if names < locations.len() {
            let message = format!("{name:?} is no uuid of 32 hexadecimal digits, as others here are");
            return Err(Error::line(path, line, message));
        }
        locations.iter_mut().for_each(|l| l.uuid = uuid_from_name(&l.uuid));
    }
    Ok(locations)
}

fn is_uuid(text: &str) -> bool {
    text.len() == 32 && text.bytes().all(|b| matches!(b, b'0'..=b'9' | b'a'..=b'f'))
}

/// The fields of a line, without white space around them.
fn fields(text: &[u8]) -> csv::Result<ByteRecord> {
    // Making a reader takes a hundred times as long as cutting a line without quotes.
    if !text.contains(&b'"') {
        return Ok(text.split(|b| *b == b',').map(<[u8]>::trim_ascii).collect());
    }
    let mut record = ByteRecord::new();
    let mut reader = ReaderBuilder::new().has_headers(false).trim(Trim::All).from_reader(text);
    reader.read_byte_record(&mut record)?;
    Ok(record)
}

/// Where each of [`COLUMNS`] is.
fn header(record: &ByteRecord) -> std::result::Result<[usize; 8], String> {
    let mut order = [0; 8];
    for (place, name) in order.iter_mut().zip(COLUMNS) {
        *place = record
            .iter()
            .position(|field| field.eq_ignore_ascii_case(name.as_bytes()))
            .ok_or_else(|| format!("the header has no column {name}; it needs {}", COLUMNS.join(",")))?;
    }
    Ok(order)
}

fn location(record: &ByteRecord, order: [usize; 8], line: u64) -> std::result::Result<ScanLocation, String> {
    let fields = order.map(|at| String::from_utf8_lossy(record.get(at).unwrap_or_default()).into_owned());
    let [written, fields @ ..] = fields;
    if written.is_empty() {
        return Err("the location has no name".to_owned());
    }
    let uuid: String = written.chars().filter(|&c| c != '-').map(|c| c.to_ascii_lowercase()).collect();
    // Or another name, until it is known what the other lines have.
    let uuid = if is_uuid(&uuid) { uuid } else { written };
    let mut numbers = [0.0; 7];
    for ((number, text), column) in numbers.iter_mut().zip(&fields).zip(&COLUMNS[1..]) {
        *number = text
            .parse()
            .ok()
            .filter(|v: &f64| v.is_finite())
            .ok_or_else(|| format!("{column} is {text:?}, which is no finite number"))?;
    }
    let [x, y, z, qx, qy, qz, qw] = numbers;
    if [x, y, z].iter().any(|c| c.abs() > FARTHEST_M) {
        return Err(format!(
            "({x}, {y}, {z}) is more than {FARTHEST_M} m from the origin: are these metres?"
        ));
    }
    let rotation = DVec4::new(qx, qy, qz, qw).try_normalize().ok_or("the quaternion has no length")?;
    let pose = Pose::from_scanner(DVec3::new(x, y, z), DQuat::from_vec4(rotation));
    Ok(ScanLocation { uuid, pose, line })
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::glam::dvec3;

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
        let plain = read(&format!("# a scan\n{A},1,2,3,0,0,0,1\r\n\n {B}, -1e0 ,0,0,0,0,2,0\n")).unwrap();
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
        let twice = read("scan_0,1,2,3,0,0,0,1\nscan_0,4,5,6,0,0,0,1\n").unwrap_err().to_string();
        assert!(twice.contains("location scan_0 is on line 1 already"), "{twice}");
        let nameless = read("scan_0,1,2,3,0,0,0,1\n,4,5,6,0,0,0,1\n").unwrap_err().to_string();
        assert!(nameless.contains("line 2: the location has no name"), "{nameless}");
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
        assert!(read("uuid,x,y,z,qx,qy,qz,w\n").unwrap_err().to_string().contains("no column qw"));
        for empty in ["", "# nothing\n", "uuid,x,y,z,qx,qy,qz,qw\n"] {
            assert!(read(empty).unwrap_err().to_string().contains("no scan location"));
        }
    }
}
