//! From hits to the points that are seen. Source: formats.md, "Images".

use crate::Hits;
use crate::channels::{assert_size, fit};
use crate::lanes::{self, LANES, LaneWork, Lanes};
use glam::DVec3;
use half::f16;
use s3d_geom::{Camera, Raster, Rays};

/// The points that are seen, in world metres; (0, 0, 0) where nothing is. A point seen exactly at the world's origin
/// cannot be told from a missing one: that is the format's, not ours.
///
/// # Panics
/// If the hits are not of the camera's size.
pub fn xyz_image(hits: &Hits, camera: &Camera) -> Raster<[f32; 3]> {
    let mut out = Raster::filled(hits.depth.width(), hits.depth.height(), [0.0; 3]);
    points(hits, camera, &mut out);
    out
}

/// As [`xyz_image`], into an image that is used again.
///
/// # Panics
/// As [`xyz_image`].
pub fn xyz_image_into(hits: &Hits, camera: &Camera, out: &mut Raster<[f32; 3]>) {
    fit(out, &hits.depth, [0.0; 3]);
    points(hits, camera, out);
}

/// As [`xyz_image`], rounded to half floats as the data set has them: steps of 1.6 cm at 20 m from the world's origin, 6.3 cm at
/// 100 m. A point within 3e-8 m of the origin looks like a missing one.
///
/// # Panics
/// If the hits are not of the camera's size.
pub fn xyz_image_half(hits: &Hits, camera: &Camera) -> Raster<[f16; 3]> {
    let mut out = Raster::filled(hits.depth.width(), hits.depth.height(), [f16::ZERO; 3]);
    points(hits, camera, &mut out);
    out
}

/// As [`xyz_image_half`], into an image that is used again.
///
/// # Panics
/// As [`xyz_image_half`].
pub fn xyz_image_half_into(hits: &Hits, camera: &Camera, out: &mut Raster<[f16; 3]>) {
    fit(out, &hits.depth, [f16::ZERO; 3]);
    points(hits, camera, out);
}

/// A number type that coordinates are written in.
trait Coordinate: Copy {
    const ZERO: Self;
    /// [`Lanes::points`] in this type.
    fn points<const TURN: bool>(
        lanes: impl Lanes,
        column: &[f64; 3 * LANES],
        row: &[f64; 12],
        depths: &[f32; LANES],
        place: &[f64; 12],
        to: &mut [Self; 3 * LANES],
    );
}

impl Coordinate for f32 {
    const ZERO: Self = 0.0;
    #[inline(always)]
    fn points<const TURN: bool>(
        lanes: impl Lanes,
        column: &[f64; 3 * LANES],
        row: &[f64; 12],
        depths: &[f32; LANES],
        place: &[f64; 12],
        to: &mut [Self; 3 * LANES],
    ) {
        lanes.points::<TURN>(column, row, depths, place, to);
    }
}

impl Coordinate for f16 {
    const ZERO: Self = f16::ZERO;
    #[inline(always)]
    fn points<const TURN: bool>(
        lanes: impl Lanes,
        column: &[f64; 3 * LANES],
        row: &[f64; 12],
        depths: &[f32; LANES],
        place: &[f64; 12],
        to: &mut [Self; 3 * LANES],
    ) {
        lanes.half_points::<TURN>(column, row, depths, place, to);
    }
}

fn points<T: Coordinate>(hits: &Hits, camera: &Camera, out: &mut Raster<[T; 3]>) {
    assert_size(hits, camera);
    let place = camera.pose.location;
    match camera.rays() {
        Rays::Perspective { x_step, y_step, origin } => lanes::run(Points::<T, false> {
            columns: (0..camera.width).map(|i| origin + x_step * (f64::from(i) + 0.5)).collect(),
            rows: (0..camera.height).map(|j| y_step * (f64::from(j) + 0.5)).collect(),
            place,
            hits,
            out,
        }),
        Rays::Equirectangular { columns, rows } => lanes::run(Points::<T, true> {
            columns: columns.into_iter().map(|c| DVec3::new(c.x, c.y, 1.0)).collect(),
            rows: rows.into_iter().map(|r| DVec3::new(r.x, r.x, r.y)).collect(),
            place,
            hits,
            out,
        }),
    }
}

/// A pixel's direction is made of a vector a column and one a row: their sum in a perspective view, their product axis
/// by axis in a panorama (`TURN`). That is what [`Rays::at`] gives, to the last bit.
struct Points<'a, T, const TURN: bool> {
    columns: Vec<DVec3>,
    rows: Vec<DVec3>,
    place: DVec3,
    hits: &'a Hits,
    out: &'a mut Raster<[T; 3]>,
}

impl<T: Coordinate, const TURN: bool> LaneWork for Points<'_, T, TURN> {
    type Output = ();

    #[inline(always)]
    fn run(mut self, lanes: impl Lanes) {
        let width = self.columns.len();
        self.columns.resize(width.next_multiple_of(LANES), DVec3::ZERO);
        let columns: Vec<f64> = self.columns.iter().flat_map(|c| c.to_array()).collect();
        let (columns, _) = columns.as_chunks::<{ 3 * LANES }>();
        let repeated = |v: DVec3| std::array::from_fn(|k| v.to_array()[k % 3]);
        let place = repeated(self.place);
        let out = self.out.pixels_mut().chunks_exact_mut(width.max(1));
        for ((depths, out), row) in self.hits.depth.rows().zip(out).zip(&self.rows) {
            let row = repeated(*row);
            let (eights, rest) = depths.as_chunks::<LANES>();
            let (out, last) = out.as_flattened_mut().as_chunks_mut::<{ 3 * LANES }>();
            for ((depths, out), column) in eights.iter().zip(out).zip(columns) {
                T::points::<TURN>(lanes, column, &row, depths, &place, out);
            }
            if let (false, Some(column)) = (rest.is_empty(), columns.last()) {
                let (mut depths, mut points) = ([f32::INFINITY; LANES], [T::ZERO; 3 * LANES]);
                depths[..rest.len()].copy_from_slice(rest);
                T::points::<TURN>(lanes, column, &row, &depths, &place, &mut points);
                last.copy_from_slice(&points[..last.len()]);
            }
        }
    }
}
