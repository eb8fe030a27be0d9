//! The classes of a panorama, prepared like HoHoNet does.

use crate::images::class::confusion::Confusion;
use crate::images::class::lanczos::Lanczos;
use crate::images::resample::pillow_nearest;
use s3d_geom::Raster;

/// The width and the height at which panoramas are evaluated.
pub const PANORAMA: [u32; 2] = [1024, 512];

/// The classes of a panorama at the size of the evaluation. Source: HoHoNet, `README_prepare_data_s2d3d.md`,
/// step 3, and `lib/dataset/dataset_s2d3d_sem.py`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PanoramaClasses {
    /// The class of each pixel, row by row; `None` where it is not evaluated.
    pub classes: Vec<Option<u8>>,
}

impl PanoramaClasses {
    /// Resizes the `semantic` and `rgb` images of a panorama to 1024 × 512: indices by [`pillow_nearest`],
    /// colours by [`Lanczos`]. `class` returns the class of an index.
    ///
    /// A pixel is not evaluated if its index has no class, if its index is beyond 65,535 (such as 13, 13, 13,
    /// which is missing), or if its colour is black after resizing.
    ///
    /// # Panics
    /// If the images have different sizes, or have no pixel.
    pub fn new(rgb: &Raster<[u8; 3]>, semantic: &Raster<[u8; 3]>, class: impl Fn(u16) -> Option<u8>) -> Self {
        let size = [semantic.width(), semantic.height()];
        assert_eq!([rgb.width(), rgb.height()], size, "images of one size");
        let columns = pillow_nearest(size[0], PANORAMA[0]);
        let rows = pillow_nearest(size[1], PANORAMA[1]);

        let mut classes: Vec<Option<u8>> = rows
            .iter()
            .flat_map(|&row| {
                let row = semantic.row(row);
                columns.iter().map(move |&column| row[column as usize])
            })
            .map(|[r, g, b]| {
                if r == 0 {
                    class(u16::from_be_bytes([g, b]))
                } else {
                    None
                }
            })
            .collect();

        // Few pixels have no green: only these need the other channels.
        let lanczos = Lanczos::new(size, PANORAMA);
        let green = lanczos.channel(rgb, 1);
        let width = PANORAMA[0] as usize;
        for (at, class) in classes
            .iter_mut()
            .enumerate()
            .filter(|(at, class)| class.is_some() && green[*at] == 0)
        {
            if [0, 2]
                .into_iter()
                .all(|channel| lanczos.pixel(rgb, channel, at % width, at / width) == 0)
            {
                *class = None;
            }
        }
        Self { classes }
    }

    /// Counts a prediction, which has a class for each pixel, row by row.
    ///
    /// # Errors
    /// Returns the index of the first evaluated pixel whose prediction is none of the `count` classes.
    ///
    /// # Panics
    /// If a true class is none of the `count` classes, or `prediction` has another length.
    pub fn compare(&self, prediction: &[u8], count: usize) -> Result<Confusion, usize> {
        assert_eq!(prediction.len(), self.classes.len(), "a prediction a pixel");
        let mut confusion = Confusion::new(count);
        for (at, (truth, prediction)) in self.classes.iter().zip(prediction).enumerate() {
            let Some(truth) = truth else { continue };
            if usize::from(*prediction) >= count {
                return Err(at);
            }
            confusion.count(usize::from(*truth), usize::from(*prediction));
        }
        Ok(confusion)
    }
}
