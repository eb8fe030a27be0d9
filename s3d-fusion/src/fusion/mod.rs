//! Ranges are gathered in a grid of signed distances.

use crate::extract::{FusedMesh, Surface};
use crate::{FusionError, RangeImage, SensorNoise};
use s3d_geom::glam::Vec3;

/// How ranges are fused.
#[derive(Clone, Debug, PartialEq)]
pub struct FusionOptions {
    /// The size of a cell of the grid, metres: 0.001 to 1.
    pub cell_m: f64,
    /// How far before a surface its distance is gathered, in cells: 2 to 16.
    pub truncation_cells: f64,
    /// Pieces of the mesh that have less surface than this many faces of cells are left out: 0 to 1,000,000.
    pub least_piece_cells: f64,
}

impl Default for FusionOptions {
    fn default() -> Self {
        Self { cell_m: 0.01, truncation_cells: 4.0, least_piece_cells: 100.0 }
    }
}

/// A box of blocks of 8 × 8 × 8 voxels: block (i, j, k) starts at world metres 8·cell·(i, j, k).
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Tile {
    /// The first block on each axis.
    pub from: [i32; 3],
    /// The block behind the last one on each axis.
    pub to: [i32; 3],
}

/// Ranges become a mesh: truncated signed distances on a sparse grid of voxels.
#[derive(Debug)]
pub struct Fusion {
    options: FusionOptions,
}

impl Fusion {
    /// Makes an empty grid.
    ///
    /// # Errors
    /// [`FusionError::Option`].
    pub fn new(options: FusionOptions) -> Result<Self, FusionError> {
        Ok(Self { options })
    }

    /// Makes an empty grid that is limited to a box of blocks. [`Surface::join`] makes one surface of many tiles.
    ///
    /// # Errors
    /// [`FusionError::Option`], [`FusionError::Tile`].
    pub fn within(_options: FusionOptions, _tile: Tile) -> Result<Self, FusionError> {
        todo!()
    }

    /// Adds what a sensor saw from one place.
    ///
    /// # Errors
    /// [`FusionError::TooFar`].
    pub fn add(&mut self, _image: &RangeImage) -> Result<(), FusionError> {
        todo!()
    }

    /// Adds rays with an origin each, as mobile scanners measure them, in world metres. `colors` is empty or has one
    /// entry a point.
    ///
    /// # Errors
    /// [`FusionError::Count`], [`FusionError::Noise`], [`FusionError::TooFar`].
    pub fn add_rays(
        &mut self,
        _origins: &[Vec3],
        _points: &[Vec3],
        _colors: &[[u8; 3]],
        _noise: SensorNoise,
    ) -> Result<(), FusionError> {
        todo!()
    }

    /// Returns the number of bytes that blocks and their directory take.
    pub fn bytes(&self) -> u64 {
        todo!()
    }

    /// Returns the number of blocks.
    pub fn blocks(&self) -> usize {
        todo!()
    }

    /// Returns the surface of the grid, to be joined with those of other tiles.
    pub fn surface(&self) -> Surface {
        todo!()
    }

    /// Returns the mesh.
    ///
    /// # Errors
    /// [`FusionError::NoSurface`].
    pub fn mesh(&self) -> Result<FusedMesh, FusionError> {
        let cell_m2 = self.options.cell_m * self.options.cell_m;
        self.surface().into_mesh(self.options.least_piece_cells * cell_m2)
    }
}
