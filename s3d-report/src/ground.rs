//! Writes the ground of the plan: each storey from above, cut below its ceilings ([`crate::files`], "Plan").

use crate::index::{GroundEntry, LocationEntry, RoomEntry, rounded};
use crate::script::Scripts;
use crate::script::packed::{jpeg_url, png_url};
use crate::storeys::{Levels, Storeys, floor_of};
use rayon::prelude::*;
use s3d_dataset::parallel::map_in_order;
use s3d_dataset::{Context, Result};
use s3d_geom::{Raster, TriMesh};
use s3d_io::Error as FileError;
use s3d_io::image::Content;
use s3d_render::{FromAbove, GroundGrid, MipMaps, image_from_above};
use serde::Serialize;
use std::path::Path;

/// The most pixels along a side.
const MOST_PIXELS: f64 = 2048.0;

/// The least side of a pixel, metres.
const FINEST_M: f64 = 0.005;

/// Larger pixels are means of 2 × 2 samples, metres.
const COARSE_M: f64 = 0.02;

/// Rows of pixels that are drawn at once.
const BAND: u32 = 128;

/// The margin around rooms and locations: a share of the longest side, and metres. The plan has it, too.
const MARGIN: [f64; 2] = [0.05, 0.3];

/// Without rooms, this share of the vertices may lie outside on each side: scans have strays. Of so many
/// vertices.
const STRAYS: f64 = 0.005;
const SAMPLE: usize = 100_000;

/// What lies beside something higher is darker by this share at most, as if it was lit from all sides.
/// Heights up to so many metres count, at these distances, metres.
const SHADE: f32 = 0.45;
const SHADE_M: f32 = 0.8;
const REACHES_M: [f64; 2] = [0.06, 0.22];

/// The ground of a storey.
#[derive(Serialize)]
struct Ground {
    image: String,
    /// White where something is seen; `None` if this is everywhere.
    mask: Option<String>,
}

/// What is known of an area besides its mesh.
pub(crate) struct Known<'a> {
    pub(crate) area: u32,
    pub(crate) rooms: Vec<&'a RoomEntry>,
    pub(crate) locations: Vec<&'a LocationEntry>,
    /// The places of photographs.
    pub(crate) photographs: Vec<[f64; 3]>,
}

/// A rectangle in the world: the least and the greatest x and y.
#[derive(Clone, Copy)]
struct Extent {
    min: [f64; 2],
    max: [f64; 2],
}

impl Extent {
    const NONE: Self = Self { min: [f64::INFINITY; 2], max: [f64::NEG_INFINITY; 2] };

    fn add(&mut self, point: [f64; 2]) {
        for (k, c) in point.into_iter().enumerate() {
            if let (Some(min), Some(max)) = (self.min.get_mut(k), self.max.get_mut(k)) {
                (*min, *max) = (min.min(c), max.max(c));
            }
        }
    }

    fn of(points: impl IntoIterator<Item = [f64; 2]>) -> Self {
        let mut extent = Self::NONE;
        points.into_iter().for_each(|point| extent.add(point));
        extent
    }

    fn sides(&self) -> [f64; 2] {
        let [x0, y0] = self.min;
        let [x1, y1] = self.max;
        [x1 - x0, y1 - y0]
    }

    fn longest(&self) -> f64 {
        self.sides().into_iter().fold(0.0, f64::max)
    }

    fn with_margin(self) -> Self {
        let [share, metres] = MARGIN;
        let margin = share * self.longest() + metres;
        Self { min: self.min.map(|c| c - margin), max: self.max.map(|c| c + margin) }
    }

    fn within(self, other: Self) -> Self {
        let [ax, ay] = self.min;
        let [bx, by] = other.min;
        let [cx, cy] = self.max;
        let [dx, dy] = other.max;
        Self { min: [ax.max(bx), ay.max(by)], max: [cx.min(dx), cy.min(dy)] }
    }
}

/// Writes the files `ground_N.js` of an area, with N from `first` on. Returns their entries and bytes.
pub(crate) fn write(
    ctx: &Context,
    mesh: &TriMesh,
    known: &Known<'_>,
    first: usize,
    scripts: &Scripts,
) -> Result<(Vec<GroundEntry>, u64)> {
    let storeys = Storeys::new(&known.rooms, &known.locations);
    let levels = Levels::of(mesh);
    let mip_maps = MipMaps::new(mesh);
    let mut entries = Vec::new();
    let mut bytes = 0;

    for (storey, floors) in storeys.floors.iter().enumerate() {
        ctx.check()?;
        let slab = storeys.slab(storey, &levels);
        let faces = faces_in(mesh, slab);
        let extent = extent_of(mesh, &faces, known, (&storeys, storey));
        if extent.sides().into_iter().any(|side| side <= 0.0) {
            continue;
        }

        let pixel_m = (extent.longest() / MOST_PIXELS).max(FINEST_M);
        let size = extent
            .sides()
            .map(|side| ((side / pixel_m).ceil() as u32).clamp(1, MOST_PIXELS as u32));
        let [west, _] = extent.min;
        let [_, north] = extent.max;
        let [width, height] = size;
        let [low, high] = slab;
        let grid = GroundGrid { west, north, pixel_m, width, height, low, high };
        let seen = draw(ctx, (mesh, &mip_maps), &faces, &grid)?;
        let Some(ground) = shaded(seen, pixel_m)? else { continue };

        bytes += scripts.write(&format!("ground_{}", first + entries.len()), &ground)?;
        entries.push(GroundEntry {
            area: known.area,
            floors: floors.map(|z| rounded(z, 3)),
            cut: Some(rounded(high, 3)).filter(|high| high.is_finite()),
            west: rounded(west, 4),
            north: rounded(north, 4),
            size,
            pixel_m,
        });
    }
    Ok((entries, bytes))
}

/// Returns the faces that face upwards between two heights.
fn faces_in(mesh: &TriMesh, [low, high]: [f64; 2]) -> Vec<u32> {
    let is_seen = |face: &u32| {
        let [a, b, c] = mesh.triangle(*face);
        let is_up = (b - a).truncate().perp_dot((c - a).truncate()) > 0.0;
        let lowest = f64::from(a.z.min(b.z).min(c.z));
        let highest = f64::from(a.z.max(b.z).max(c.z));
        is_up && lowest <= high && highest >= low
    };
    (0..mesh.faces().len() as u32).filter(is_seen).collect()
}

/// Returns what the plan of a storey shows: its rooms, locations and photographs, with a margin, as far as
/// there are faces. Without rooms it is all of the mesh, but for strays.
fn extent_of(
    mesh: &TriMesh,
    faces: &[u32],
    known: &Known<'_>,
    (storeys, storey): (&Storeys, usize),
) -> Extent {
    let corners = |face: &u32| mesh.triangle(*face).map(|corner| [corner.x, corner.y].map(f64::from));
    let of_faces = Extent::of(faces.iter().flat_map(corners));
    let on_it = |room: &&&RoomEntry| floor_of(room).map_or(0, |z| storeys.of_height(z)) == storey;
    let rooms = known.rooms.iter().filter(on_it);
    let outlines = rooms.flat_map(|room| room.outline.iter().flatten().copied());
    let locations = known
        .locations
        .iter()
        .filter_map(|location| Some((location.position?, location.room.as_str())));
    let photographs = known.photographs.iter().map(|place| (*place, ""));
    let stands = locations
        .chain(photographs)
        .filter(|([.., z], room)| storeys.of(*z, room) == storey)
        .map(|([x, y, _], _)| [x, y]);

    let mut extent = Extent::of(outlines);
    if extent.longest() <= 0.0 {
        extent = without_strays(faces, corners);
    }
    stands.for_each(|point| extent.add(point));
    extent.with_margin().within(of_faces)
}

/// Returns the rectangle of the corners of faces, without the outermost ones.
fn without_strays(faces: &[u32], corners: impl Fn(&u32) -> [[f64; 2]; 3]) -> Extent {
    let step = (3 * faces.len()).div_ceil(SAMPLE).max(1);
    let points: Vec<[f64; 2]> = faces.iter().step_by(step).flat_map(corners).collect();
    let few = (STRAYS * points.len() as f64) as usize;
    let ends = |of: fn(&[f64; 2]) -> f64| {
        let mut values: Vec<f64> = points.iter().map(of).collect();
        values.sort_by(f64::total_cmp);
        let last = values.len().saturating_sub(1 + few);
        Some((*values.get(few)?, *values.get(last)?))
    };
    match (ends(|[x, _]| *x), ends(|[_, y]| *y)) {
        (Some((x0, x1)), Some((y0, y1))) => Extent { min: [x0, y0], max: [x1, y1] },
        _ => Extent::NONE,
    }
}

/// Draws faces on a grid, in bands of rows on all threads. Large pixels are means of samples.
fn draw(
    ctx: &Context,
    (mesh, mip_maps): (&TriMesh, &MipMaps),
    faces: &[u32],
    grid: &GroundGrid,
) -> Result<FromAbove> {
    let samples = if grid.pixel_m > COARSE_M { 2 } else { 1 };
    let bands = grid.height.div_ceil(BAND);
    let band_m = f64::from(BAND) * grid.pixel_m;

    // The faces of each band.
    let mut of_bands: Vec<(u32, Vec<u32>)> = (0..bands).map(|band| (band, Vec::new())).collect();
    for face in faces {
        let ys = mesh
            .triangle(*face)
            .map(|corner| (grid.north - f64::from(corner.y)) / band_m);
        let [first, last] =
            [ys.into_iter().fold(f64::INFINITY, f64::min), ys.into_iter().fold(0.0, f64::max)];
        let last = (last as u32).min(bands.saturating_sub(1)) as usize;
        for (_, list) in of_bands.get_mut(first.max(0.0) as usize..=last).into_iter().flatten() {
            list.push(*face);
        }
    }

    let drawn = map_in_order(
        ctx,
        &of_bands,
        || (),
        |(), (band, faces)| {
            let rows = BAND.min(grid.height - band * BAND);
            let fine = GroundGrid {
                north: grid.north - f64::from(*band) * band_m,
                pixel_m: grid.pixel_m / f64::from(samples),
                width: grid.width * samples,
                height: rows * samples,
                ..*grid
            };
            Ok(mean_of(image_from_above(mesh, mip_maps, faces.iter().copied(), &fine), samples))
        },
    )?;
    let mut rgb = Vec::with_capacity(grid.width as usize * grid.height as usize);
    let mut z = Vec::with_capacity(rgb.capacity());
    for band in drawn {
        rgb.extend(band.rgb.into_vec());
        z.extend(band.z.into_vec());
    }
    Ok(FromAbove {
        rgb: Raster::from_vec(grid.width, grid.height, rgb),
        z: Raster::from_vec(grid.width, grid.height, z),
    })
}

/// Returns an image whose pixels are the means of `samples` × `samples` pixels, as far as these see
/// something, with the greatest height.
fn mean_of(seen: FromAbove, samples: u32) -> FromAbove {
    if samples == 1 {
        return seen;
    }
    let [width, height] = [seen.z.width() / samples, seen.z.height() / samples];
    let mut mean = FromAbove {
        rgb: Raster::filled(width, height, [0; 3]),
        z: Raster::filled(width, height, f32::NEG_INFINITY),
    };
    let places = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    for ((x, y), (rgb, z)) in places.zip(mean.rgb.pixels_mut().iter_mut().zip(mean.z.pixels_mut())) {
        let mut sum = [0u32; 3];
        let mut count = 0;
        for k in 0..samples * samples {
            let [i, j] = [x * samples + k % samples, y * samples + k / samples];
            let height = seen.z.at(i, j);
            if height > f32::NEG_INFINITY {
                *z = z.max(height);
                count += 1;
                sum.iter_mut()
                    .zip(seen.rgb.at(i, j))
                    .for_each(|(sum, c)| *sum += u32::from(c));
            }
        }
        if count > 0 {
            *rgb = sum.map(|sum| ((sum + count / 2) / count) as u8);
        }
    }
    mean
}

/// Returns the ground of a storey, darkened beside what is higher. `None` if nothing is seen.
fn shaded(FromAbove { mut rgb, z }: FromAbove, pixel_m: f64) -> Result<Option<Ground>> {
    let width = z.width() as usize;
    let is_seen = |height: &f32| *height > f32::NEG_INFINITY;
    let count = z.pixels().iter().filter(|height| is_seen(height)).count();
    if count == 0 {
        return Ok(None);
    }

    let offsets = around(pixel_m);
    rgb.pixels_mut().par_chunks_mut(width).enumerate().for_each(|(y, row)| {
        for (x, pixel) in row.iter_mut().enumerate() {
            let Some(here) = z.pixels().get(y * width + x).copied().filter(is_seen) else { continue };
            let higher: f32 = offsets
                .iter()
                .filter_map(|[dx, dy]| {
                    let i = x.checked_add_signed(*dx).filter(|i| *i < width)?;
                    let j = y.checked_add_signed(*dy)?;
                    z.pixels()
                        .get(j * width + i)
                        .map(|there| (there - here).clamp(0.0, SHADE_M))
                })
                .sum();
            let light = 1.0 - SHADE * higher / (SHADE_M * offsets.len() as f32);
            *pixel = pixel.map(|channel| (f32::from(channel) * light + 0.5) as u8);
        }
    });

    let mask = (count < z.len()).then(|| {
        let white = z.map(|height| if is_seen(&height) { [255; 3] } else { [0; 3] });
        png_url(&white, Content::Labels)
    });
    // Where nothing is seen there is the mean colour, which does not stand out at the border.
    let mut sums = [0u64; 3];
    let seen = |(_, height): &(&[u8; 3], &f32)| is_seen(height);
    for (pixel, _) in rgb.pixels().iter().zip(z.pixels()).filter(seen) {
        sums.iter_mut().zip(pixel).for_each(|(sum, c)| *sum += u64::from(*c));
    }
    let mean = sums.map(|sum| (sum / count as u64) as u8);
    for (pixel, height) in rgb.pixels_mut().iter_mut().zip(z.pixels()) {
        if !is_seen(height) {
            *pixel = mean;
        }
    }
    let image = jpeg_url(&rgb).map_err(|e| FileError::format(Path::new("the plan"), e.to_string()))?;
    Ok(Some(Ground { image, mask }))
}

/// Returns the steps to the pixels whose heights darken a pixel: eight in each reach.
fn around(pixel_m: f64) -> Vec<[isize; 2]> {
    REACHES_M
        .into_iter()
        .flat_map(|reach| {
            let pixels = (reach / pixel_m).max(1.0);
            (0..8).map(move |k| {
                let (sin, cos) = (f64::from(k) * std::f64::consts::FRAC_PI_4).sin_cos();
                [cos, sin].map(|part| (part * pixels).round() as isize)
            })
        })
        .collect()
}
