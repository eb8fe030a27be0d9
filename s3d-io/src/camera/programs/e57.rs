//! The places of the scans of an E57 file. Source: ASTM E2807, "pose": from the frame of a scan to the frame
//! of the file.

use crate::camera::located::{rotation, uuid_from_name, uuid_in};
use crate::camera::posed::PosedCamera;
use crate::error::{Error, Result};
use crate::fs::open::open_file;
use crate::guarded::guarded;
use e57::{E57Reader, PointCloud, Quaternion};
use s3d_geom::Pose;
use s3d_geom::glam::{DQuat, dvec3};
use std::fs::File;
use std::io::BufReader;
use std::path::Path;

/// The first bytes of a file.
pub(crate) const MAGIC: &[u8] = b"ASTM-E57";

/// An open file.
pub(crate) struct E57File {
    pub(crate) reader: E57Reader<BufReader<File>>,
    /// The size of the file in bytes.
    pub(crate) size: u64,
}

/// Opens a file, and reads its lists of scans and images.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if the file is damaged.
pub(crate) fn open(path: &Path) -> Result<E57File> {
    let file = open_file(path)?;
    let size = file.metadata().map_err(|e| Error::io(path, "read", e))?.len();
    let file = BufReader::with_capacity(1 << 18, file);
    // The reader belongs to another crate, and panics on some damaged files.
    let reader = guarded(|| E57Reader::new(file))
        .ok_or_else(|| Error::format(path, "is damaged"))?
        .map_err(|e| Error::format(path, e.to_string()))?;
    Ok(E57File { reader, size })
}

/// Returns the name of a scan: its guid without hyphens, which is a uuid, or else its own name.
pub(crate) fn scan_name(number: usize, scan: &PointCloud) -> String {
    let guid = scan.guid.as_deref().unwrap_or_default();
    let guid: String = guid.chars().filter(char::is_ascii_hexdigit).collect();
    if guid.len() == 32 {
        return guid.to_lowercase();
    }
    scan.name.clone().unwrap_or_else(|| format!("scan_{number}"))
}

/// Returns the uuid of the scan location of a scan.
pub(crate) fn scan_uuid(number: usize, scan: &PointCloud) -> String {
    let name = scan_name(number, scan);
    uuid_in(&name).unwrap_or_else(|| uuid_from_name(&name))
}

/// Returns the rotation of a pose. Returns `None` if the four numbers are none.
pub(crate) fn rotation_of(q: &Quaternion) -> Option<DQuat> {
    rotation([q.x, q.y, q.z, q.w]).ok()
}

/// Reads where the scanner stood. A scan has the name of its guid without hyphens, which is a uuid, or else
/// its own name. A scan without a pose is left out.
///
/// # Errors
/// [`Error::Io`]; [`Error::Format`] if the file is damaged, no scan has a pose, or a pose has no rotation.
pub(crate) fn read(path: &Path) -> Result<Vec<PosedCamera>> {
    let E57File { reader, .. } = open(path)?;
    let scans = guarded(|| reader.pointclouds()).ok_or_else(|| Error::format(path, "is damaged"))?;

    let mut places = Vec::new();
    for (number, scan) in scans.iter().enumerate() {
        let Some(transform) = &scan.transform else { continue };
        let q = &transform.rotation;
        let t = &transform.translation;
        let Some(rotation) = rotation_of(q) else {
            let message = format!("scan {number}, counted from 0, has a pose without a rotation: {q:?}");
            return Err(Error::format(path, message));
        };
        let pose = Pose::from_scanner(dvec3(t.x, t.y, t.z), rotation);
        places.push(PosedCamera::new(scan_name(number, scan), pose));
    }

    if places.is_empty() {
        return Err(Error::format(
            path,
            "has no scan with a pose, so it does not say where the scanner stood: place locations with place \
             = 2.0",
        ));
    }
    Ok(places)
}

#[cfg(test)]
mod tests {
    use crate::camera::read_scan_locations;
    use e57::{E57Writer, Quaternion, Record, Transform, Translation};
    use s3d_geom::glam::{DAffine3, DVec3};
    use std::path::Path;

    /// Writes scans without points: each has a guid, a name and perhaps a place, turned by 90° about Z.
    fn write(path: &Path, scans: &[(&str, &str, Option<[f64; 3]>)]) {
        let mut writer = E57Writer::from_file(path, "{0}").unwrap();
        for (guid, name, place) in scans {
            let prototype = vec![Record::CARTESIAN_X_F64, Record::CARTESIAN_Y_F64, Record::CARTESIAN_Z_F64];
            let mut scan = writer.add_pointcloud(guid, prototype).unwrap();
            scan.set_name(Some((*name).to_owned()));
            let half = libm::sqrt(0.5);
            scan.set_transform(place.map(|[x, y, z]| Transform {
                rotation: Quaternion { w: half, x: 0.0, y: 0.0, z: half },
                translation: Translation { x, y, z },
            }));
            scan.finalize().unwrap();
        }
        writer.finalize().unwrap();
    }

    #[test]
    fn scans_tell_where_the_scanner_stood() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("scans.e57");
        let guid = "{5C2959C3-0bdf-4c8e-9d11-aabbccddeeff}";
        write(
            &path,
            &[(guid, "a", Some([1.0, 2.0, 1.5])), ("b", "hall 2", Some([4.0, 2.0, 1.5])), ("c", "c", None)],
        );
        let found = read_scan_locations(&path, &DAffine3::IDENTITY).unwrap();
        assert_eq!(found.len(), 2);
        assert_eq!(found[0].uuid, "5c2959c30bdf4c8e9d11aabbccddeeff");
        assert_eq!(found[1].uuid, crate::camera::uuid_from_name("hall 2"));
        assert_eq!(found[1].pose.location, DVec3::new(4.0, 2.0, 1.5));
        // A scanner that is not turned looks along +Y, and this one is turned to the left.
        assert!(found[0].pose.forward().abs_diff_eq(DVec3::NEG_X, 1e-9), "{:?}", found[0].pose.forward());

        write(&path, &[("a", "a", None)]);
        let message = read_scan_locations(&path, &DAffine3::IDENTITY).unwrap_err().to_string();
        assert!(message.contains("scans.e57: has no scan with a pose"), "{message}");
        std::fs::write(&path, b"ASTM-E57 and no more").unwrap();
        assert!(read_scan_locations(&path, &DAffine3::IDENTITY).is_err());
    }
}
