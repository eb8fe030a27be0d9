//! Files that users give in place of a list of cameras.

use crate::camera::programs::metashape::PROJECT;
use crate::camera::programs::sens;
use crate::error::{Error, Result};
use std::path::Path;

/// The first bytes of files of other kinds: what they are, and the way on.
const KINDS: [(&[u8], &str); 12] = [
    (
        b"ASTM-E57",
        "is a cloud of points (E57), not a list of cameras: write where the scanner stood in a table, a line \
         uuid,x,y,z,qx,qy,qz,qw for each place, or place them with place = 2.0",
    ),
    (b"LASF", "is a cloud of points (LAS), not a list of cameras"),
    (b"# .PCD", "is a cloud of points (PCD), not a list of cameras"),
    (b"ply", "is a mesh or a cloud of points (PLY), not a list of cameras"),
    (b"glTF", "is a mesh (glTF), not a list of cameras"),
    (b"\x89PNG", "is a picture (PNG), not a list of cameras: the key `images` names the folder of pictures"),
    (
        b"\xff\xd8\xff",
        "is a picture (JPEG), not a list of cameras: the key `images` names the folder of pictures",
    ),
    (b"\x89HDF", "is an HDF5 file, not a list of cameras"),
    (b"\x93NUMPY", "is an array of numpy, not a list of cameras: write it as a table of text"),
    (b"SQLite format 3", "is a database, not a list of cameras: of COLMAP, give the model (sparse/0)"),
    (b"\x1f\x8b", "is compressed (gzip): unpack it"),
    (b"PK\x03\x04", "is a ZIP archive: unpack it, and give what is in it"),
];

/// The header of RealityCapture's table of internal and external camera parameters.
const REALITY_CAPTURE: &[u8] = b"#name,x,y,alt,heading,pitch,roll";

/// Refuses a file that is no list of cameras but of a kind that is known by its first bytes.
///
/// # Errors
/// [`Error::Unsupported`] with what the file is, and the way on.
pub(crate) fn refuse_other_kind(path: &Path, bytes: &[u8]) -> Result<()> {
    let has_ending = |ending: &str| path.extension().is_some_and(|e| e.eq_ignore_ascii_case(ending));
    if has_ending("psx") || has_ending("psz") {
        return Err(Error::unsupported(path, PROJECT));
    }
    if sens::is_recording(bytes) {
        let message = "is a recording of ScanNet, not scan locations: give it under [frames]";
        return Err(Error::unsupported(path, message));
    }

    let start: Vec<u8> = bytes
        .iter()
        .take(REALITY_CAPTURE.len())
        .map(u8::to_ascii_lowercase)
        .collect();
    if start == REALITY_CAPTURE {
        let message = "is a table of RealityCapture's camera parameters, which does not say where the middle \
                       of a picture is and what its lens does: export the registration for COLMAP (text)";
        return Err(Error::unsupported(path, message));
    }

    let is_word = |kind: &[u8]| kind != b"ply" || bytes.get(3).is_some_and(u8::is_ascii_whitespace);
    let of_kind = |kind: &[u8]| bytes.starts_with(kind) && is_word(kind);
    match KINDS.iter().find(|(kind, _)| of_kind(kind)) {
        Some((_, message)) => Err(Error::unsupported(path, *message)),
        None => Ok(()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn other_kinds_are_called_what_they_are() {
        let of = |name: &str, bytes: &[u8]| refuse_other_kind(Path::new(name), bytes);
        for (name, bytes, words) in [
            ("a.e57", &b"ASTM-E57\0\0"[..], "a.e57: is a cloud of points (E57)"),
            ("a.txt", b"ply\nformat", "is a mesh or a cloud of points"),
            ("a.csv", b"\x89PNG\r\n", "is a picture (PNG), not a list of cameras: the key `images`"),
            ("a.zip", b"PK\x03\x04", "is a ZIP archive: unpack it"),
            ("a.PSX", b"<document/>", "is a project of Metashape, not its cameras: export them as XML"),
            ("a.psz", b"PK\x03\x04", "is a project of Metashape"),
            ("a.sens", b"\x04\0\0\0\x0f\0\0\0\0\0\0\0", "is a recording of ScanNet, not scan locations"),
            ("a.csv", b"#name,x,y,alt,heading,pitch,roll,f,px,py\n", "RealityCapture"),
            ("a.csv", b"#Name,X,Y,Alt,Heading,Pitch,Roll\n", "for COLMAP"),
        ] {
            let message = of(name, bytes).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
        for text in [&b"plysky,1,2,3"[..], b"#name,x,y,z", b"", b"1 2 3"] {
            assert!(of("a.csv", text).is_ok());
        }
    }
}
