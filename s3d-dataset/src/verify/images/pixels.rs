//! Reads the pixels of image files, and describes their differences.

use crate::export::modality::Drawn;
use half::f16;
use half::slice::HalfFloatSliceExt;
use s3d_geom::Raster;
use s3d_io::Result;
use s3d_io::dataset::{Domain, PixelKind};
use s3d_io::fs::read_file;
use s3d_io::image::{PngLines, PngReader, decode_palette8, decode_xyz, decode_xyz_half};
use std::path::Path;

/// The pixels of a file.
pub(crate) enum Pixels {
    /// 8-bit RGB.
    Color(Raster<[u8; 3]>),
    /// 16-bit gray.
    Depth(Raster<u16>),
    /// 8-bit gray.
    Gray(Raster<u8>),
    /// Places in a palette, and the palette.
    Class(Raster<u8>, Vec<[u8; 3]>),
    Xyz(Raster<[f32; 3]>),
    /// Coordinates from a file with half floats.
    XyzHalf(Raster<[f16; 3]>),
}

/// An inflated file. PNG filters are not yet removed from its pixels.
pub(crate) enum Opened<'r> {
    Color(PngLines<'r, 3>),
    Depth(PngLines<'r, 2>),
    Gray(PngLines<'r, 1>),
    Pixels(Pixels),
}

impl<'r> Opened<'r> {
    /// Opens the file of a domain from its bytes.
    ///
    /// # Panics
    /// For poses, which have no pixels.
    pub(crate) fn new(domain: Domain, bytes: &[u8], path: &Path, reader: &'r mut PngReader) -> Result<Self> {
        Ok(match domain.pixels() {
            Some(PixelKind::Rgb8) => Self::Color(reader.rgb8(bytes, path)?),
            Some(PixelKind::Gray8) => Self::Gray(reader.gray8(bytes, path)?),
            Some(PixelKind::Gray16) => Self::Depth(reader.gray16(bytes, path)?),
            Some(PixelKind::Palette8) => {
                let (places, palette) = decode_palette8(bytes, path)?;
                Self::Pixels(Pixels::Class(places, palette))
            }
            Some(PixelKind::Xyz) => Self::Pixels(match decode_xyz_half(bytes) {
                Some(points) => Pixels::XyzHalf(points),
                None => Pixels::Xyz(decode_xyz(bytes, path)?),
            }),
            None => unreachable!("{domain} has no pixels"),
        })
    }

    /// Width and height.
    pub(crate) fn size(&self) -> (u32, u32) {
        match self {
            Self::Color(lines) => (lines.width(), lines.height()),
            Self::Depth(lines) => (lines.width(), lines.height()),
            Self::Gray(lines) => (lines.width(), lines.height()),
            Self::Pixels(pixels) => pixels.size(),
        }
    }

    /// Whether the pixels equal the drawn ones, bit by bit. This is the fastest comparison; it may be false
    /// for equal pixels in other forms.
    pub(crate) fn are_of(&self, drawn: Drawn<'_>) -> bool {
        match (self, drawn) {
            (Self::Color(lines), Drawn::Color(image)) => lines.are_of(image),
            (Self::Depth(lines), Drawn::Depth(image)) => lines.are_of(image),
            (Self::Gray(lines), Drawn::Gray(image)) => lines.are_of(image),
            (Self::Pixels(Pixels::XyzHalf(points)), Drawn::XyzHalf(image)) => {
                let [a, b] = [points, image].map(|points| points.pixels().as_flattened().reinterpret_cast());
                (points.width(), points.height()) == (image.width(), image.height()) && a == b
            }
            _ => false,
        }
    }

    pub(crate) fn into_pixels(self) -> Pixels {
        match self {
            Self::Color(lines) => Pixels::Color(lines.into_raster()),
            Self::Depth(lines) => Pixels::Depth(lines.into_raster()),
            Self::Gray(lines) => Pixels::Gray(lines.into_raster()),
            Self::Pixels(pixels) => pixels,
        }
    }
}

impl Pixels {
    /// Reads a file. Coordinates become 32-bit floats, whatever the file holds.
    ///
    /// # Panics
    /// See [`Opened::new`].
    pub(crate) fn read(domain: Domain, path: &Path) -> Result<Self> {
        let bytes = read_file(path)?;
        let mut reader = PngReader::default();
        Ok(Opened::new(domain, &bytes, path, &mut reader)?
            .into_pixels()
            .in_floats())
    }

    /// The pixels in the form of a drawn image.
    pub(crate) fn as_drawn(&self) -> Drawn<'_> {
        match self {
            Self::Color(image) => Drawn::Color(image),
            Self::Depth(image) => Drawn::Depth(image),
            Self::Gray(image) => Drawn::Gray(image),
            Self::Class(image, _) => Drawn::Class(image),
            Self::Xyz(image) => Drawn::Xyz(image),
            Self::XyzHalf(image) => Drawn::XyzHalf(image),
        }
    }

    /// Converts half floats to 32-bit floats.
    pub(crate) fn in_floats(self) -> Self {
        match self {
            Self::XyzHalf(points) => Self::Xyz(points.map(|p| p.map(f16::to_f32))),
            other => other,
        }
    }

    /// Width and height.
    pub(crate) fn size(&self) -> (u32, u32) {
        match self {
            Self::Color(r) => (r.width(), r.height()),
            Self::Depth(r) => (r.width(), r.height()),
            Self::Gray(r) => (r.width(), r.height()),
            Self::Class(r, _) => (r.width(), r.height()),
            Self::Xyz(r) => (r.width(), r.height()),
            Self::XyzHalf(r) => (r.width(), r.height()),
        }
    }

    /// The values of a pixel as the file has them. A depth or a class is the first of the three.
    pub(crate) fn value(&self, x: u32, y: u32) -> [f64; 3] {
        match self {
            Self::Color(r) => r.at(x, y).map(f64::from),
            Self::Depth(r) => [f64::from(r.at(x, y)), 0.0, 0.0],
            Self::Gray(r) | Self::Class(r, _) => [f64::from(r.at(x, y)), 0.0, 0.0],
            Self::Xyz(r) => r.at(x, y).map(f64::from),
            Self::XyzHalf(r) => r.at(x, y).map(f64::from),
        }
    }

    /// Whether each pixel says that nothing is seen there.
    pub(crate) fn missing(&self, domain: Domain) -> Vec<bool> {
        let missing = domain.missing();
        match self {
            Self::Color(r) => equal_to(r.pixels(), missing.map(|value| value as u8)),
            Self::Depth(r) => r.pixels().iter().map(|p| *p == missing[0]).collect(),
            Self::Gray(r) | Self::Class(r, _) => {
                r.pixels().iter().map(|p| u16::from(*p) == missing[0]).collect()
            }
            Self::Xyz(r) => r.pixels().iter().map(|p| *p == [0.0; 3]).collect(),
            Self::XyzHalf(r) => r.pixels().iter().map(|p| *p == [f16::ZERO; 3]).collect(),
        }
    }
}

/// Whether each pixel is `color`. Few pixels are, so a part without these three bytes in a row is done at
/// once.
fn equal_to(pixels: &[[u8; 3]], color @ [r, g, b]: [u8; 3]) -> Vec<bool> {
    const PART: usize = 1024;
    let mut equal = vec![false; pixels.len()];
    for (part, equal) in pixels.chunks(PART).zip(equal.chunks_mut(PART)) {
        let bytes = part.as_flattened();
        let next = bytes[1..].iter().zip(&bytes[2..]);
        let somewhere = bytes
            .iter()
            .zip(next)
            .fold(0, |any, (x, (y, z))| any | u8::from(*x == r) & u8::from(*y == g) & u8::from(*z == b));
        if somewhere != 0 {
            equal
                .iter_mut()
                .zip(part)
                .for_each(|(equal, pixel)| *equal = *pixel == color);
        }
    }
    equal
}

/// The difference between a file's pixels and the expected ones.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Difference {
    pub(crate) count: u64,
    /// The number of pixels that were compared.
    pub(crate) of: u64,
    /// The column and row of the first difference.
    pub(crate) first: (u32, u32),
    /// The value in the file.
    pub(crate) found: String,
    /// The value that it should have.
    pub(crate) expected: String,
}

impl Difference {
    /// Compares images of one size. Returns `None` if they are equal.
    pub(crate) fn of<T: Copy + PartialEq, U: Copy>(
        found: &Raster<T>,
        expected: &Raster<U>,
        same: impl Fn(T, U) -> bool,
        text: impl Fn(T) -> String,
        expected_text: impl Fn(U) -> String,
    ) -> Option<Self> {
        let mut difference: Option<Self> = None;
        for (y, (row, other)) in (0..).zip(found.rows().zip(expected.rows())) {
            let equal = row.iter().zip(other).fold(true, |all, (a, b)| all & same(*a, *b));
            if equal {
                continue;
            }
            for (x, (a, b)) in (0..).zip(row.iter().zip(other)) {
                if same(*a, *b) {
                    continue;
                }
                let d = difference.get_or_insert_with(|| Self {
                    count: 0,
                    of: found.len() as u64,
                    first: (x, y),
                    found: text(*a),
                    expected: expected_text(*b),
                });
                d.count += 1;
            }
        }
        difference
    }

    /// Describes the difference in a sentence. `what` names the source of the expected values.
    pub(crate) fn sentence(&self, what: &str) -> String {
        let Self { count, of, first: (x, y), found, expected } = self;
        let percent = 100.0 * *count as f64 / *of as f64;
        let percent = if percent < 0.1 {
            "less than 0.1".to_owned()
        } else {
            format!("{percent:.1}")
        };
        format!(
            "{count} of {of} pixels ({percent} %) are not {what}; the first is ({x}, {y}): {found}, should \
             be {expected}"
        )
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_render::MISSING_INDEX;

    #[test]
    fn pixels_of_a_color_are_found_at_any_place() {
        let missing = MISSING_INDEX;
        for width in [1, 2, 1023, 1024, 2500] {
            // Bytes of the colour that straddle two pixels do not count.
            let mut pixels = vec![[missing[0], missing[1], 0], [missing[2]; 3]];
            pixels.resize(width, [1, 2, 3]);
            for at in [None, Some(0), Some(width / 2), Some(width - 1)] {
                let mut pixels = pixels.clone();
                at.into_iter().for_each(|at| pixels[at] = missing);
                let plain: Vec<bool> = pixels.iter().map(|pixel| *pixel == missing).collect();
                let image = Pixels::Color(Raster::from_vec(width as u32, 1, pixels));
                assert_eq!(image.missing(Domain::Semantic), plain);
            }
        }
    }

    #[test]
    fn differences_are_counted() {
        let a = Raster::from_vec(2, 4, vec![0u16, 1, 2, 3, 4, 5, 6, 7]);
        let b = Raster::from_vec(2, 4, vec![0u16, 1, 2, 9, 4, 5, 6, 9]);
        let compare =
            |b: &Raster<u16>| Difference::of(&a, b, |a, b| a == b, |v| v.to_string(), |v: u16| v.to_string());
        assert_eq!(compare(&a), None);
        assert_eq!(
            compare(&b).unwrap().sentence("what the mesh shows"),
            "2 of 8 pixels (25.0 %) are not what the mesh shows; the first is (1, 1): 3, should be 9"
        );
    }
}
