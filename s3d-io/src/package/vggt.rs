//! The annotation file of VGGT's training code: gzip JSON, as its ScanNet loader reads it.
//!
//! Source: `facebookresearch/vggt` at 851d257, `training/data/datasets/scannet.py`.

use crate::error::Result;
use crate::fs::atomic::write_bytes;
use s3d_deflate::{Deflater, Search};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// An image of a sequence. The fields have the names of the file's keys.
#[derive(Clone, Debug, Serialize)]
pub struct VggtImage {
    /// The path of its colours below the data's folder.
    pub filepath: String,
    /// The path of its depth below the data's folder: 16 bits, millimetres, 0 where missing.
    pub depthpath: String,
    /// World → camera (x right, y down, z forward), metres.
    pub extri: [[f64; 4]; 3],
    /// The camera matrix in pixels. The centre of the first pixel is (0.5, 0.5).
    pub intri: [[f64; 3]; 3],
}

/// Writes an annotation file: the images of each sequence by its name. Returns its size in bytes.
///
/// # Errors
/// [`Error::Io`](crate::Error::Io).
#[expect(clippy::expect_used, reason = "a writer: its numbers and texts are JSON")]
pub fn write_vggt_annotations(path: &Path, sequences: &BTreeMap<String, Vec<VggtImage>>) -> Result<u64> {
    let text = serde_json::to_vec(sequences).expect("numbers and texts are JSON");
    write_bytes(path, &gzip(&text))
}

/// Returns a gzip file of one member without a name and a time. Source: RFC 1952.
#[expect(clippy::expect_used, reason = "a writer: the settings are in range")]
fn gzip(bytes: &[u8]) -> Vec<u8> {
    let mut zlib = Vec::new();
    Deflater::new(Search::thorough(1, 1))
        .expect("they are in range")
        .zlib(bytes, None, &mut zlib);

    // A zlib stream is two bytes, the deflate stream, and four bytes.
    let mut file = vec![0x1f, 0x8b, 8, 0, 0, 0, 0, 0, 0, 255];
    file.extend_from_slice(zlib.get(2..zlib.len() - 4).unwrap_or_default());
    file.extend(crc32fast::hash(bytes).to_le_bytes());
    file.extend((bytes.len() as u32).to_le_bytes());
    file
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::io::Read;

    #[test]
    fn another_reader_unpacks_it() {
        for text in ["", "{}", &"[1, 2, 3]".repeat(10_000)] {
            let file = gzip(text.as_bytes());
            let mut back = String::new();
            flate2::read::GzDecoder::new(&file[..])
                .read_to_string(&mut back)
                .unwrap();
            assert_eq!(back, text);
        }
    }
}
