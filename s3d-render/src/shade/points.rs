//! Computes the points that the pixels see. Source: `s3d_io::formats`, "What is written".

use crate::hits::Hits;
use crate::shade::channels::{assert_size, fit};
use crate::simd::shade_lanes::{EightRays, LANES, ShadeLanes};
use crate::simd::{Kernel, Simd, dispatch};
use glam::DVec3;
use half::f16;
use s3d_geom::{Camera, Raster, Rays};

/// Returns the points that the pixels see, in world metres; (0, 0, 0) where nothing is seen. The format
/// cannot tell a point exactly at the world's origin from a missing one.
///
/// # Panics
/// If the hits are not of the camera's size.
pub fn xyz_image(hits: &Hits, camera: &Camera) -> Raster<[f32; 3]> {
    let mut out = Raster::filled(hits.depth.width(), hits.depth.height(), [0.0; 3]);
    points(hits, camera, &mut out);
    out
}

/// Writes the image of [`xyz_image`] into an existing image.
///
/// # Panics
/// As for [`xyz_image`].
pub fn xyz_image_into(hits: &Hits, camera: &Camera, out: &mut Raster<[f32; 3]>) {
    fit(out, &hits.depth, [0.0; 3]);
    points(hits, camera, out);
}

/// Returns the points of [`xyz_image`], rounded to half floats for the data set. Their steps are 1.6 cm at 20
/// m from the world's origin, and 6.3 cm at 100 m. A point within 3e-8 m of the origin looks like a missing
/// one.
///
/// # Panics
/// If the hits are not of the camera's size.
pub fn xyz_image_half(hits: &Hits, camera: &Camera) -> Raster<[f16; 3]> {
    let mut out = Raster::filled(hits.depth.width(), hits.depth.height(), [f16::ZERO; 3]);
    points(hits, camera, &mut out);
    out
}

/// Writes the image of [`xyz_image_half`] into an existing image.
///
/// # Panics
/// As for [`xyz_image_half`].
pub fn xyz_image_half_into(hits: &Hits, camera: &Camera, out: &mut Raster<[f16; 3]>) {
    fit(out, &hits.depth, [f16::ZERO; 3]);
    points(hits, camera, out);
}

/// A number type for coordinates.
pub(crate) trait Coordinate: Copy {
    const ZERO: Self;
    /// Calls [`ShadeLanes::points`] for this type.
    fn points<const PANORAMA: bool>(lanes: impl ShadeLanes, rays: &EightRays<'_>, to: &mut [Self; 3 * LANES]);
}

impl Coordinate for f32 {
    const ZERO: Self = 0.0;
    #[inline(always)]
    fn points<const PANORAMA: bool>(
        lanes: impl ShadeLanes,
        rays: &EightRays<'_>,
        to: &mut [Self; 3 * LANES],
    ) {
        lanes.points::<PANORAMA>(rays, to);
    }
}

impl Coordinate for f16 {
    const ZERO: Self = f16::ZERO;
    #[inline(always)]
    fn points<const PANORAMA: bool>(
        lanes: impl ShadeLanes,
        rays: &EightRays<'_>,
        to: &mut [Self; 3 * LANES],
    ) {
        lanes.half_points::<PANORAMA>(rays, to);
    }
}

fn points<T: Coordinate>(hits: &Hits, camera: &Camera, out: &mut Raster<[T; 3]>) {
    assert_size(hits, camera);
    if camera.is_panorama() {
        dispatch(PointKernel::<T, true> { hits, camera, out });
    } else {
        dispatch(PointKernel::<T, false> { hits, camera, out });
    }
}

struct PointKernel<'a, T, const PANORAMA: bool> {
    hits: &'a Hits,
    camera: &'a Camera,
    out: &'a mut Raster<[T; 3]>,
}

impl<T: Coordinate, const PANORAMA: bool> Kernel for PointKernel<'_, T, PANORAMA> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(self, simd: S) {
        let lanes = simd.shade();
        let directions = RayTable::new(self.camera);
        directions.points::<PANORAMA, T>(lanes, 0, self.hits.depth.pixels(), self.out.pixels_mut());
    }
}

/// The directions of an image's pixels. A direction is made of a vector of its column and one of its row:
/// their sum in a perspective view, their product by axis in a panorama (`PANORAMA`). It equals [`Rays::at`]
/// to the last bit.
pub(crate) struct RayTable {
    /// In groups of eight; the last one is padded.
    columns: Vec<[f64; 3 * LANES]>,
    rows: Vec<DVec3>,
    width: usize,
    place: DVec3,
}

impl RayTable {
    pub(crate) fn new(camera: &Camera) -> Self {
        let (mut columns, rows): (Vec<DVec3>, Vec<DVec3>) = match camera.rays() {
            Rays::Perspective { x_step, y_step, origin } => (
                (0..camera.width)
                    .map(|i| origin + x_step * (f64::from(i) + 0.5))
                    .collect(),
                (0..camera.height).map(|j| y_step * (f64::from(j) + 0.5)).collect(),
            ),
            Rays::Equirectangular { columns, rows } => (
                columns.into_iter().map(|c| DVec3::new(c.x, c.y, 1.0)).collect(),
                rows.into_iter().map(|r| DVec3::new(r.x, r.x, r.y)).collect(),
            ),
        };
        let width = columns.len();
        columns.resize(width.next_multiple_of(LANES), DVec3::ZERO);
        let columns: Vec<f64> = columns.iter().flat_map(|c| c.to_array()).collect();
        let columns = columns.as_chunks().0.to_vec();
        Self { columns, rows, width, place: camera.pose.location }
    }

    /// Computes the points that the rows from `first_row` on see.
    #[inline(always)]
    pub(crate) fn points<const PANORAMA: bool, T: Coordinate>(
        &self,
        lanes: impl ShadeLanes,
        first_row: usize,
        depths: &[f32],
        out: &mut [[T; 3]],
    ) {
        let repeated = |v: DVec3| std::array::from_fn(|k| v.to_array()[k % 3]);
        let place = repeated(self.place);
        let width = self.width.max(1);
        let rows = &self.rows[first_row..];
        for ((depths, out), row) in depths.chunks_exact(width).zip(out.chunks_exact_mut(width)).zip(rows) {
            let row = repeated(*row);
            let (eights, rest) = depths.as_chunks::<LANES>();
            let (out, last) = out.as_flattened_mut().as_chunks_mut::<{ 3 * LANES }>();
            for ((depths, out), column) in eights.iter().zip(out).zip(&self.columns) {
                T::points::<PANORAMA>(lanes, &EightRays { column, row: &row, depths, place: &place }, out);
            }
            if let (false, Some(column)) = (rest.is_empty(), self.columns.last()) {
                let (mut depths, mut points) = ([f32::INFINITY; LANES], [T::ZERO; 3 * LANES]);
                depths[..rest.len()].copy_from_slice(rest);
                let rays = EightRays { column, row: &row, depths: &depths, place: &place };
                T::points::<PANORAMA>(lanes, &rays, &mut points);
                last.copy_from_slice(&points[..last.len()]);
            }
        }
    }
}
