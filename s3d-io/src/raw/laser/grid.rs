//! A scan as rows and columns of points.

use crate::error::{Error, Result};
use crate::raw::laser::LaserScans;
use s3d_geom::Raster;
use s3d_geom::glam::{DVec3, Vec3};

/// The most cells that a grid has for each point of its file. Grids of a scanner's sphere are half empty.
const MOST_CELLS_A_POINT: u64 = 64;
/// A grid of so many cells is believed, however few points it has.
const PLAUSIBLE_CELLS: u64 = 1 << 22;

/// A scan on the scanner's grid: column after column goes around the scanner, and a row is one inclination.
#[derive(Clone, Debug, PartialEq)]
pub struct ScanGrid {
    /// Where the scanner stood, in the world (metres, +Z up).
    pub origin_m: DVec3,
    /// The points less the origin: metres, NaN where nothing was measured. The width is the number of
    /// columns.
    pub offsets_m: Raster<Vec3>,
    /// The colours of the points; black where nothing was measured. `None`: the scan has none.
    pub colors: Option<Raster<[u8; 3]>>,
    /// The intensities of the points; NaN where nothing was measured. `None`: the scan has none.
    pub intensities: Option<Raster<f32>>,
}

impl LaserScans {
    /// Reads a scan, by its number from 0, onto its grid. If several points have one cell, the nearest one
    /// counts. Returns `None` if the scan has no grid, or its file does not tell where the scanner stood.
    ///
    /// # Errors
    /// Like [`read`](Self::read); [`Error::Format`] if a point lies beside the grid, or the grid is much
    /// larger than the number of points warrants.
    pub fn read_grid(&self, scan: usize) -> Result<Option<ScanGrid>> {
        let (info, _) = self.scan(scan)?;
        let Some(([rows, columns], origin_m)) = info.grid.zip(info.origin_m) else { return Ok(None) };
        let cells = u64::from(rows) * u64::from(columns);
        let points = info.points.unwrap_or(0);
        if cells > PLAUSIBLE_CELLS.max(points.saturating_mul(MOST_CELLS_A_POINT)) {
            let message = format!("{}: claims {rows} × {columns} cells for {points} points", info.name);
            return Err(Error::format(&info.path, message));
        }

        let mut offsets_m = Raster::filled(columns, rows, Vec3::NAN);
        let mut colors = info.has_colors.then(|| Raster::filled(columns, rows, [0; 3]));
        let mut intensities = info.has_intensity.then(|| Raster::filled(columns, rows, f32::NAN));
        let mut beside = 0u64;
        self.read(scan, |block| {
            for (i, (position, [row, column])) in block.positions_m.iter().zip(&block.cells).enumerate() {
                if *row >= rows || *column >= columns {
                    beside += 1;
                    continue;
                }
                let cell = *row as usize * columns as usize + *column as usize;
                let offset = (*position - origin_m).as_vec3();
                let Some(stored) = offsets_m.pixels_mut().get_mut(cell) else { continue };
                // NaN is not nearer.
                if stored.length_squared() <= offset.length_squared() {
                    continue;
                }
                *stored = offset;
                set(colors.as_mut(), cell, block.colors.get(i));
                set(intensities.as_mut(), cell, block.intensities.get(i));
            }
            Ok::<(), Error>(())
        })?;
        if beside > 0 {
            let name = &info.name;
            let message = format!("{name}: {beside} points lie beside its grid of {rows} × {columns}");
            return Err(Error::format(&info.path, message));
        }
        Ok(Some(ScanGrid { origin_m, offsets_m, colors, intensities }))
    }
}

fn set<T: Copy>(image: Option<&mut Raster<T>>, cell: usize, value: Option<&T>) {
    let pixel = image.and_then(|image| image.pixels_mut().get_mut(cell));
    if let Some((pixel, value)) = pixel.zip(value) {
        *pixel = *value;
    }
}
