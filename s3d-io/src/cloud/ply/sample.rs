//! Reads some of the points of a large cloud.

#![cfg_attr(not(test), deny(clippy::arithmetic_side_effects, clippy::cast_possible_truncation))]

use crate::error::{Error, Place, Result};
use crate::fs::open::open_file;
use s3d_geom::PointCloud;
use s3d_geom::glam::Vec3;
use std::io::{BufRead, BufReader, Read, Seek, SeekFrom};
use std::path::Path;

/// The longest header.
const MAX_HEADER: u64 = 65_536;

/// The layout of the points, from the file's header.
struct Header {
    /// The bytes of the header itself.
    bytes: u64,
    count: u64,
    stride: usize,
    /// Offsets of x, y, z (float) and of red, green, blue (uchar).
    position: [usize; 3],
    color: Option<[usize; 3]>,
}

/// Reads up to `most` points of a binary little-endian PLY cloud such as `area_N/3d/pointcloud.ply`: all of
/// them, or evenly spaced ones in the file's order. Such a file is ordered by face, so they cover the surface
/// evenly. Points are black if the file has no colours. Other properties are left out.
///
/// Memory holds no more points than are returned.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if it is another kind of PLY file, if it is shorter than its header says,
/// or if a coordinate is not finite.
pub fn read_point_sample(path: &Path, most: usize) -> Result<PointCloud> {
    let io = |e| Error::io(path, "read", e);
    let file = open_file(path)?;
    let size = file.metadata().map_err(io)?.len();
    let mut reader = BufReader::with_capacity(1 << 18, file);
    let header = read_header(path, &mut reader)?;

    let needed = header
        .count
        .checked_mul(header.stride as u64)
        .and_then(|b| b.checked_add(header.bytes));
    if needed.is_none_or(|needed| needed > size) {
        return Err(Error::format(
            path,
            format!(
                "the header tells of {} points of {} bytes, but the file ends too early ({size} bytes)",
                header.count, header.stride
            ),
        ));
    }
    reader.seek(SeekFrom::Start(header.bytes)).map_err(io)?;

    let chosen = header.count.min(most as u64);
    let mut cloud = PointCloud::default();
    let mut point = vec![0; header.stride];
    let mut at = 0u64;
    for k in 0..chosen {
        // The middle of part k of `chosen` equal parts.
        let i = middle_of_part(k, chosen, header.count);
        let skipped = i.saturating_sub(at).saturating_mul(header.stride as u64);
        reader.seek_relative(skipped.cast_signed()).map_err(io)?;
        reader.read_exact(&mut point).map_err(io)?;
        at = i.saturating_add(1);
        let position = header.position.map(|o| float_at(&point, o).unwrap_or(f32::NAN));
        if !position.iter().all(|c| c.is_finite()) {
            return Err(Error::format(path, format!("point {i} (counted from 0) is at {position:?}")));
        }
        cloud.positions.push(Vec3::from_array(position));
        let color = header
            .color
            .map(|offsets| offsets.map(|o| point.get(o).copied().unwrap_or(0)));
        cloud.colors.push(color.unwrap_or_default());
    }
    Ok(cloud)
}

fn float_at(point: &[u8], offset: usize) -> Option<f32> {
    let bytes = point.get(offset..)?.first_chunk()?;
    Some(f32::from_le_bytes(*bytes))
}

/// The index of the element in the middle of part `k`, where `count` elements are cut into `parts` parts.
/// There are at least as many elements as parts.
fn middle_of_part(k: u64, parts: u64, count: u64) -> u64 {
    // Products of any two counts fit into u128.
    let [k, parts, count] = [k, parts, count].map(u128::from);
    let middle = k
        .saturating_mul(2)
        .saturating_add(1)
        .saturating_mul(count)
        .checked_div(parts.saturating_mul(2));
    middle.and_then(|i| u64::try_from(i).ok()).unwrap_or(0)
}

/// Reads the header, and leaves `reader` at the first point.
fn read_header(path: &Path, reader: &mut impl BufRead) -> Result<Header> {
    let mut bytes = 0u64;
    let mut number = 0u64;
    let mut is_binary = false;
    let mut in_vertex = false;
    let mut count = None;
    let mut stride = 0usize;
    // Name, type and offset of each property.
    let mut columns: Vec<(String, String, usize)> = Vec::new();

    loop {
        let mut line = Vec::new();
        let read = reader
            .take(MAX_HEADER)
            .read_until(b'\n', &mut line)
            .map_err(|e| Error::io(path, "read", e))?;
        bytes = bytes.saturating_add(read as u64);
        number = number.saturating_add(1);
        let text = String::from_utf8_lossy(&line);
        let words: Vec<&str> = text.split_ascii_whitespace().collect();
        let wrong =
            |message: String| Error::Format { path: path.to_owned(), place: Place::Line(number), message };

        if number == 1 && words != ["ply"] {
            return Err(wrong("not a PLY file: it does not begin with \"ply\"".into()));
        }
        if read == 0 || bytes > MAX_HEADER {
            return Err(wrong("the header of the PLY file has no end".into()));
        }
        match words[..] {
            ["format", "binary_little_endian", _] => is_binary = true,
            ["format", other, ..] => {
                return Err(wrong(format!("the PLY file is {other}; only binary_little_endian is sampled")));
            }
            ["element", "vertex", n] if count.is_none() => {
                in_vertex = true;
                count = Some(
                    n.parse()
                        .map_err(|_| wrong(format!("\"{n}\" is no number of points")))?,
                );
            }
            ["element", ..] if count.is_none() => {
                return Err(wrong("another element stands before the points".into()));
            }
            ["element", ..] => in_vertex = false,
            ["property", "list", ..] if in_vertex => {
                return Err(wrong("a point has a list as property".into()));
            }
            ["property", kind, name] if in_vertex => {
                let size =
                    bytes_of(kind).ok_or_else(|| wrong(format!("\"{kind}\" is no type of a property")))?;
                columns.push((name.to_owned(), kind.to_owned(), stride));
                stride = stride.saturating_add(size);
            }
            ["end_header"] => break,
            _ => {}
        }
    }

    let position = find_columns(&columns, ["x", "y", "z"], ["float", "float32"]);
    let color = find_columns(&columns, ["red", "green", "blue"], ["uchar", "uint8"]);
    match count.zip(position).filter(|_| is_binary) {
        Some((count, position)) => Ok(Header { bytes, count, stride, position, color }),
        None => Err(Error::format(path, "not a PLY file of points with x, y and z as floats")),
    }
}

/// The bytes of a property's type.
fn bytes_of(kind: &str) -> Option<usize> {
    match kind {
        "char" | "uchar" | "int8" | "uint8" => Some(1),
        "short" | "ushort" | "int16" | "uint16" => Some(2),
        "int" | "uint" | "float" | "int32" | "uint32" | "float32" => Some(4),
        "double" | "float64" => Some(8),
        _ => None,
    }
}

/// The offsets of three columns with these names, each of one of these types.
fn find_columns(
    columns: &[(String, String, usize)],
    names: [&str; 3],
    kinds: [&str; 2],
) -> Option<[usize; 3]> {
    let at = |name: &str| {
        columns
            .iter()
            .find(|c| c.0 == name && kinds.contains(&c.1.as_str()))
            .map(|c| c.2)
    };
    Some([at(names[0])?, at(names[1])?, at(names[2])?])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::cloud::ply::write::PlyPointWriter;
    use crate::fs::atomic::write_bytes;
    use s3d_geom::glam::vec3;

    fn cloud(n: usize) -> PointCloud {
        PointCloud {
            positions: (0..n).map(|i| vec3(i as f32, 0.5, -1.0)).collect(),
            colors: (0..n).map(|i| [i as u8, 2, 3]).collect(),
            faces: Vec::new(),
        }
    }

    #[test]
    fn evenly_spaced_points_come_back() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cloud.ply");
        let all = cloud(20_000);
        let mut writer = PlyPointWriter::create(&path, 20_000).unwrap();
        writer.append(&all, &vec![7; 20_000]).unwrap();
        writer.finish().unwrap();

        for most in [0, 1, 3, 999, 20_000, 50_000] {
            let sample = read_point_sample(&path, most).unwrap();
            assert_eq!((sample.len(), sample.colors.len()), (most.min(20_000), most.min(20_000)));
            for (k, p) in sample.positions.iter().enumerate() {
                let i = p.x as usize;
                assert_eq!((*p, sample.colors[k]), (all.positions[i], all.colors[i]));
                // In part k of as many equal parts.
                assert_eq!(i * sample.len() / 20_000, k);
            }
        }
        assert_eq!(read_point_sample(&path, 20_000).unwrap().positions, all.positions);
    }

    #[test]
    fn other_columns_are_passed_over() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cloud.ply");
        let mut bytes = b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty double t\n\
                          property float32 z\n\
            property float32 y\nproperty float32 x\nelement face 0\nproperty list uchar int vertex_indices\n\
            end_header\n"
            .to_vec();
        bytes.extend(9f64.to_le_bytes());
        [3f32, 2.0, 1.0].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        write_bytes(&path, &bytes).unwrap();
        let sample = read_point_sample(&path, 5).unwrap();
        assert_eq!((sample.positions[0], sample.colors[0]), (vec3(1.0, 2.0, 3.0), [0; 3]));
    }

    fn head(format: &str, rest: &str) -> String {
        format!("ply\nformat {format} 1.0\n{rest}end_header\n")
    }

    #[test]
    fn every_fault_is_told() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("cloud.ply");
        let xyz = "property float x\nproperty float y\nproperty float z\n";
        let little = "binary_little_endian";
        for (text, words) in [
            ("solid x\n".into(), "line 1: not a PLY file"),
            (String::new(), "line 1: not a PLY file"),
            ("ply\nformat binary_little_endian 1.0\n".into(), "has no end"),
            (format!("ply\n{}", "x".repeat(100_000)), "has no end"),
            (head("ascii", ""), "line 2: the PLY file is ascii"),
            (head(little, "element vertex many\n"), "line 3: \"many\" is no number"),
            (head(little, "element face 1\nelement vertex 1\n"), "line 3: another element"),
            (head(little, "element vertex 1\nproperty list uchar int x\n"), "line 4: a point has a list"),
            (head(little, "element vertex 1\nproperty half x\n"), "line 4: \"half\" is no type"),
            (
                head(little, "element vertex 1\nproperty float x\nproperty float y\n"),
                "not a PLY file of points",
            ),
            (head(little, &format!("element vertex 1000000000000\n{xyz}")), "ends too early"),
            (head(little, &format!("element vertex {}\n{xyz}", u64::MAX)), "ends too early"),
            (head(little, &format!("element vertex 1\n{xyz}")) + "12 bytes...", "ends too early"),
        ] {
            write_bytes(&path, text.as_bytes()).unwrap();
            let e = read_point_sample(&path, 10).unwrap_err().to_string();
            assert!(e.contains(words), "{text:?}: {e}");
        }

        let mut bytes = head(little, &format!("element vertex 1\n{xyz}")).into_bytes();
        [1f32, f32::NAN, 2.0].iter().for_each(|v| bytes.extend(v.to_le_bytes()));
        write_bytes(&path, &bytes).unwrap();
        assert!(
            read_point_sample(&path, 10)
                .unwrap_err()
                .to_string()
                .contains("point 0 (counted from 0)")
        );
    }
}
