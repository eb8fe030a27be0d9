//! Images are gathered in one grid, or in the grids of tiles if one does not fit into the memory.

use super::images::{Images, Rays, Seen};
use super::kept::Record;
use super::kept_tiles::KeptTiles;
use super::{FuseOptions, tiles};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::memory;
use s3d_fusion::{FusedMesh, Fusion, FusionError, PreparedImage, SensorNoise, Surface};
use std::path::{Path, PathBuf};

/// Where finished tiles are kept, and what they are made of.
pub(super) struct Keeping<'a> {
    pub(super) folder: &'a Path,
    pub(super) inputs: &'a [PathBuf],
}

/// Gathers all images. Finished tiles are kept until the output is in its place, so the same call after a
/// kill goes on with them.
pub(super) fn gather(
    images: &Images,
    options: &FuseOptions,
    keeping: &Keeping<'_>,
    ctx: &Context,
) -> Result<FusedMesh> {
    let of = |e: FusionError| Error::unfit(images.path(), e.to_string());
    let too_small = || Error::unfit(images.path(), "one block takes more than the memory allowed");
    let fusion_options = images.fusion_options(options.cell_m);
    let least_piece_m2 = fusion_options.least_piece_cells * options.cell_m * options.cell_m;
    let most_bytes = (options.memory_gib * f64::from(1 << 30)) as u64;
    let made_of = || Record::of(keeping.inputs, options);

    let kept = match KeptTiles::open(keeping.folder, made_of)? {
        Some(kept) => {
            ctx.info("an earlier call was fused in tiles, and its finished tiles are kept");
            kept
        }
        None => {
            let whole = Fusion::new(fusion_options.clone()).map_err(of)?;
            if let Some(whole) = fill(whole, images, most_bytes, ctx)? {
                let surface = whole.surface();
                drop(whole);
                memory::give_back();
                return surface.into_mesh(least_piece_m2).map_err(of);
            }
            let memory_gib = options.memory_gib;
            ctx.info(format_args!("the grid takes more than {memory_gib} GiB: it is fused in tiles"));
            let around = tiles::around(images.bounds(ctx)?, options.cell_m);
            KeptTiles::begin(keeping.folder, made_of()?, around)?
        }
    };

    let mut open: Vec<_> = tiles::halves(kept.around).ok_or_else(too_small)?.into();
    let mut done = Vec::new();
    while let Some(tile) = open.pop() {
        if kept.is_cut(tile) {
            open.extend(tiles::halves(tile).ok_or_else(too_small)?);
            continue;
        }
        if kept.read(tile, ctx)?.is_none() {
            let grid = Fusion::within(fusion_options.clone(), tile).map_err(of)?;
            let Some(grid) = fill(grid, images, most_bytes, ctx)? else {
                kept.cut(tile)?;
                open.extend(tiles::halves(tile).ok_or_else(too_small)?);
                continue;
            };
            kept.keep(tile, &grid.surface())?;
        }
        done.push(tile);
    }

    memory::give_back();
    let surfaces = done.into_iter().map(|tile| {
        let surface = kept.read(tile, ctx)?;
        surface.ok_or_else(|| Error::unfit(keeping.folder, "a finished tile was changed or removed"))
    });
    let surface = Surface::join(surfaces.collect::<Result<_>>()?).map_err(of)?;
    surface.into_mesh(least_piece_m2).map_err(of)
}

/// Adds all images to a grid. Returns `None` if it becomes too large.
fn fill(mut grid: Fusion, images: &Images, most_bytes: u64, ctx: &Context) -> Result<Option<Fusion>> {
    let task = ctx.progress("fusing", images.unit(), images.len() as u64);
    let unfit = |of: &Path, e: FusionError| Error::unfit(of, e.to_string());
    let preparer = grid.preparer();
    let add = |grid: &mut Fusion, waiting: Option<(PreparedImage, PathBuf)>| {
        let Some((image, of)) = waiting else { return Ok(()) };
        task.add(1);
        grid.add_prepared(&image).map_err(|e| unfit(&of, e))
    };

    // An image is prepared while the one before is added.
    let mut waiting = None;
    let mut fits = true;
    images.each(ctx, |seen, of| {
        let last = waiting.take();
        match seen {
            Seen::Image(image) => {
                let (added, next) = rayon::join(|| add(&mut grid, last), || preparer.prepare(*image));
                added?;
                waiting = Some((next, of.to_owned()));
            }
            Seen::Rays(Rays { origins, points, colors }) => {
                add(&mut grid, last)?;
                let added = grid.add_rays(&origins, &points, &colors, SensorNoise::LASER);
                added.map_err(|e| unfit(of, e))?;
                task.add(1);
            }
        }
        fits = grid.fits(most_bytes);
        Ok(fits)
    })?;
    if fits {
        add(&mut grid, waiting)?;
        fits = grid.fits(most_bytes);
    }
    Ok(fits.then_some(grid))
}
