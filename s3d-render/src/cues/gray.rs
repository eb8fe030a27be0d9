//! Gray levels of a colour image, with a margin.

use s3d_geom::Raster;
use s3d_simd::{dispatch, level};

/// The gray levels of an image with a margin on all sides: those of the other side of a panorama, and
/// repeated pixels elsewhere.
#[derive(Clone, Debug)]
pub(super) struct PaddedGray {
    /// The width of a line with its margins.
    pub(super) line: usize,
    /// Lines with margins, with lines above and below the image.
    pub(super) levels: Vec<u8>,
}

impl PaddedGray {
    /// Adds a margin to gray levels.
    pub(super) fn new(gray: &Raster<u8>, margin: usize, wraps: bool) -> Self {
        let width = gray.width() as usize;
        let height = gray.height() as usize;
        let line = width + 2 * margin;
        let mut levels = Vec::with_capacity(line * (height + 2 * margin));
        for row in 0..height + 2 * margin {
            let row = row.saturating_sub(margin).min(height.saturating_sub(1));
            let source = gray.row(row as u32);
            let outside = |at: usize| source[at % width];
            for at in 0..margin {
                // The margin of a narrow image wraps more than once.
                let left = outside((at + margin * width.max(1) - margin) % width);
                levels.push(if wraps { left } else { source[0] });
            }
            levels.extend_from_slice(source);
            for at in 0..margin {
                levels.push(if wraps { outside(at) } else { source[width - 1] });
            }
        }
        Self { line, levels }
    }
}

/// Returns the gray levels of colours: (19,595 R + 38,470 G + 7,471 B + 32,768) / 65,536, rounded down. They
/// are the luma of ITU-R BT.601 with the integers of Pillow's `convert("L")`.
pub fn gray_image(colors: &Raster<[u8; 3]>) -> Raster<u8> {
    dispatch!(level(), _simd => {
        let gray = |[r, g, b]: &[u8; 3]| {
            ((19_595 * u32::from(*r) + 38_470 * u32::from(*g) + 7_471 * u32::from(*b) + 32_768) >> 16) as u8
        };
        Raster::from_vec(colors.width(), colors.height(), colors.pixels().iter().map(gray).collect())
    })
}
