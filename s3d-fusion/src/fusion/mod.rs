//! Ranges are gathered in a grid of signed distances.

mod images;
mod normals;
mod pyramid;
mod rays;
#[cfg(test)]
mod reference;
mod touched;
mod view;
mod walk;

use crate::extract::{FusedMesh, Surface};
use crate::grid::{FARTHEST, Grid, Place, SIDE};
use crate::{FusionError, RangeImage, SensorNoise};
use images::{Adding, Prepared};
use rays::AddingRays;
use s3d_geom::glam::{DVec3, Vec3};

/// How ranges are fused.
#[derive(Clone, Debug, PartialEq)]
pub struct FusionOptions {
    /// The size of a cell of the grid, metres: 0.001 to 1.
    pub cell_m: f64,
    /// How far before a surface its distance is gathered, in cells: 2.5 to 16.
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

impl Tile {
    /// Whether the grid of a tile needs a block: it is in the tile, or its voxels are corners of cells of the
    /// tile.
    fn holds(&self, block: Place) -> bool {
        (0..3).all(|k| (self.from[k]..=self.to[k]).contains(&block[k]))
    }
}

/// Lengths of a grid, metres.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Scale {
    cell: f64,
    /// The truncation before surfaces.
    front: f64,
}

impl Scale {
    /// The side of a block.
    fn block(&self) -> f64 {
        self.cell * f64::from(SIDE)
    }

    /// The block of a point; `None` if it is too far away.
    fn block_of(&self, point: DVec3) -> Option<Place> {
        let place = point / self.block();
        let is_near = place.abs().max_element() < f64::from(FARTHEST - 8);
        is_near.then(|| walk::floor(place))
    }

    /// Voxels are at a surface up to this distance, as a share of the truncation. Where a surface crosses an
    /// edge of a cell, one end is at most half a cell away; a little more, for rounding.
    #[inline(always)]
    fn near(&self) -> f32 {
        (0.6 * self.cell / self.front) as f32
    }

    /// How far behind a surface its distance is gathered. The corners of a cell that the surface crosses are
    /// at most √3 cells behind it, and noise must not make a side.
    #[inline(always)]
    fn behind(&self, sigma_m: f32) -> f32 {
        (2.0 * self.cell as f32 + 2.0 * sigma_m).min(self.front as f32)
    }

    /// How far before a hit, along the ray, distances are gathered at most. A ray that meets a plane aslant
    /// is near it for long.
    #[inline(always)]
    fn most_before(&self) -> f32 {
        4.0 * self.front as f32
    }

    /// How far behind a hit, along the ray, distances are gathered at most. A ray that meets a body aslant
    /// soon leaves it again.
    #[inline(always)]
    fn most_behind(&self, sigma_m: f32) -> f32 {
        3.0 * self.behind(sigma_m)
    }

    /// How far before and behind a hit, along its ray, distances are gathered if the ray meets the surface at
    /// this cosine.
    #[inline(always)]
    fn along_ray(&self, cosine: f32, sigma_m: f32) -> [f32; 2] {
        let front = self.front as f32 / cosine;
        let behind = self.behind(sigma_m) / cosine;
        [front.min(self.most_before()), behind.min(self.most_behind(sigma_m))]
    }

    /// The weight of a ray by its noise and the angle at which it meets the surface: 1 for a millimetre at a
    /// right angle.
    fn weight_of(sigma_m: f32, cosine: f32) -> f32 {
        cosine * (0.001 / sigma_m) * (0.001 / sigma_m)
    }

    /// The weight of a distance to the plane of a hit; 0 if it counts nothing. `before` is how far before the
    /// hit the voxel is along its ray.
    ///
    /// Near the plane it is 1. It falls with the distance from it, so the nearest surface decides in corners.
    /// Behind the surface it falls steeply, from half a cell on and what noise adds: what lies there was not
    /// seen, and a ray that sees the other side of something thin knows it better.
    #[inline(always)]
    fn weight(&self, distance: f32, before: f32, sigma_m: f32) -> f32 {
        let cell = self.cell as f32;
        let behind = self.behind(sigma_m);
        let counts = f32::from((distance > -behind) & (before >= -3.0 * behind));
        let near = distance * (self.front as f32).recip();
        let noise = 2.0 * sigma_m * (sigma_m * cell.recip()).min(1.0);
        let side = (distance + behind) / (behind - 0.5 * cell - noise).max(0.5 * cell);
        let side = side.min(1.0);
        let side = side * side;
        let side = side * side;
        counts * (side * side / (1.0 + near * near))
    }
}

/// Does the half of the work on an image that does not depend on other images.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Preparer {
    scale: Scale,
    tile: Option<Tile>,
}

/// An image that is ready to be added to a grid.
#[derive(Debug)]
pub struct PreparedImage {
    image: RangeImage,
    prepared: Prepared,
    by: Preparer,
}

impl Preparer {
    /// Fits a plane to each pixel, and finds the blocks near them.
    pub fn prepare(&self, image: RangeImage) -> PreparedImage {
        PreparedImage { prepared: self.adding(&image, 0).prepare(), image, by: *self }
    }

    fn adding<'a>(&self, image: &'a RangeImage, number: u32) -> Adding<'a> {
        Adding { image, scale: self.scale, tile: self.tile, number }
    }
}

/// Ranges become a mesh: truncated signed distances on a sparse grid of voxels.
#[derive(Debug)]
pub struct Fusion {
    options: FusionOptions,
    scale: Scale,
    tile: Option<Tile>,
    grid: Grid,
    /// The number of images and calls with rays so far.
    added: u32,
}

impl Fusion {
    /// Makes an empty grid.
    ///
    /// # Errors
    /// [`FusionError::Option`].
    pub fn new(options: FusionOptions) -> Result<Self, FusionError> {
        let check = |what, value: f64, least: f64, most: f64| {
            let is_within = (least..=most).contains(&value);
            is_within
                .then_some(())
                .ok_or(FusionError::Option { what, value, least, most })
        };
        check("the size of a cell in metres", options.cell_m, 0.001, 1.0)?;
        check("the truncation in cells", options.truncation_cells, 2.5, 16.0)?;
        check("the smallest piece in cells", options.least_piece_cells, 0.0, 1e6)?;

        let scale = Scale { cell: options.cell_m, front: options.cell_m * options.truncation_cells };
        Ok(Self { options, scale, tile: None, grid: Grid::default(), added: 0 })
    }

    /// Makes an empty grid that is limited to a box of blocks. [`Surface::join`] makes one surface of many
    /// tiles.
    ///
    /// # Errors
    /// [`FusionError::Option`], [`FusionError::Tile`].
    pub fn within(options: FusionOptions, tile: Tile) -> Result<Self, FusionError> {
        let Tile { from, to } = tile;
        let is_box = (0..3).all(|k| from[k] < to[k] && from[k].abs() < FARTHEST && to[k].abs() < FARTHEST);
        if !is_box {
            return Err(FusionError::Tile { from, to });
        }
        Ok(Self { tile: Some(tile), ..Self::new(options)? })
    }

    /// Adds what a sensor saw from one place.
    ///
    /// # Errors
    /// [`FusionError::TooFar`].
    pub fn add(&mut self, image: &RangeImage) -> Result<(), FusionError> {
        let adding = self.preparer().adding(image, self.added);
        self.added += 1;
        adding.add_to(&mut self.grid, &adding.prepare())
    }

    /// Returns what prepares images for this grid, while others are added to it.
    pub fn preparer(&self) -> Preparer {
        Preparer { scale: self.scale, tile: self.tile }
    }

    /// Adds an image that [`Fusion::preparer`] prepared: the grid is the same as after [`Fusion::add`].
    ///
    /// # Errors
    /// [`FusionError::TooFar`].
    pub fn add_prepared(&mut self, image: &PreparedImage) -> Result<(), FusionError> {
        if image.by != self.preparer() {
            return self.add(&image.image);
        }
        let adding = self.preparer().adding(&image.image, self.added);
        self.added += 1;
        adding.add_to(&mut self.grid, &image.prepared)
    }

    /// Adds rays with an origin each, as mobile scanners measure them, in world metres. `colors` is empty or
    /// has one entry a point.
    ///
    /// # Errors
    /// [`FusionError::Count`], [`FusionError::Noise`], [`FusionError::TooFar`].
    pub fn add_rays(
        &mut self,
        origins: &[Vec3],
        points: &[Vec3],
        colors: &[[u8; 3]],
        noise: SensorNoise,
    ) -> Result<(), FusionError> {
        let columns = [("origins", origins.len()), ("colours", colors.len())];
        for (what, found) in columns.into_iter().filter(|(what, n)| *what == "origins" || *n > 0) {
            if found != points.len() {
                return Err(FusionError::Count { what, found, points: points.len() });
            }
        }
        let noise = noise.check()?;
        let (scale, tile, number) = (self.scale, self.tile, self.added);
        self.added += 1;
        AddingRays { origins, points, colors, noise, scale, tile, number }.add_to(&mut self.grid)
    }

    /// Returns the number of bytes that blocks and their directory take.
    pub fn bytes(&self) -> u64 {
        self.grid.bytes()
    }

    /// Whether the grid takes no more bytes than these.
    pub fn fits(&self, bytes: u64) -> bool {
        self.grid.most_bytes() <= bytes || self.grid.bytes() <= bytes
    }

    /// Returns the number of blocks.
    pub fn blocks(&self) -> usize {
        self.grid.blocks.len()
    }

    /// Returns the surface of the grid, to be joined with those of other tiles.
    pub fn surface(&self) -> Surface {
        let tile = self.tile.map(|t| [t.from, t.to]);
        Surface::of_grid(&self.grid, self.scale.cell, self.scale.front, tile)
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

/// Returns a number from 0 to 1 that looks random.
#[inline]
pub(crate) fn chance(voxel: u32, number: u32) -> f32 {
    let mixed = (voxel ^ number.wrapping_mul(0x9e37_79b9)).wrapping_mul(0x85eb_ca6b);
    let mixed = (mixed ^ mixed >> 15).wrapping_mul(0xc2b2_ae35);
    (mixed >> 9) as f32 / (1 << 23) as f32
}
