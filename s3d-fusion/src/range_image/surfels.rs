//! A plane for each pixel, fitted to the pixels around it that lie on the same surface.
//!
//! In gnomonic coordinates (u, v) about any axis, the inverse of the depth along that axis is a linear
//! function on a plane: q = a + b·u + c·v. So a fit of three numbers is exact on planes at any angle, for
//! lenses and for grids of angles alike. The axis is the optical axis of a lens, and the ray of the pixel in
//! a grid of angles.

use super::{Directions, RangeImage};
use rayon::prelude::*;
use s3d_geom::glam::{DVec3, Vec3};
use s3d_simd::{ProvenLevel, dispatch, level};

/// The plane that a pixel sees, in OpenCV's axes of the sensor: a point x is normal·x + offset in front of
/// it.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Surfel {
    pub(crate) normal: Vec3,
    pub(crate) offset: f32,
    /// The range of the pixel, as in the image.
    pub(crate) range: f32,
    /// 0: nothing was measured, or the pixel was dropped. Otherwise 1 for a noise of a millimetre.
    pub(crate) weight: f32,
    /// The noise of the range, metres.
    pub(crate) sigma_m: f32,
    /// The nearest range of the 3 × 3 pixels around; 0 if one of them is missing.
    pub(crate) nearest: f32,
}

impl Surfel {
    const NONE: Self =
        Self { normal: Vec3::ZERO, offset: 0.0, range: 0.0, weight: 0.0, sigma_m: 0.0, nearest: 0.0 };
}

/// Rows that a task works on.
const BAND: usize = 48;
/// The pixels of a window are −2·t … 2·t for a stride t, at most this.
const MOST_STRIDE: i32 = 4;
/// Rows around a band that its windows and the tests of their pixels reach.
const MARGIN: i32 = 2 * MOST_STRIDE + 8;
/// Pixels are dropped whose ray meets the surface at a smaller cosine than this.
const LEAST_COSINE: f32 = 0.05;
/// A pixel between two others is on their way if one of them goes on by this share of the step, and mixed if
/// none does.
const GOES_ON: f32 = 0.05;
/// The noise at which a pixel has the weight 1.
const UNIT_SIGMA_M: f32 = 0.001;

impl RangeImage {
    /// Fits a plane to each pixel. `cell_m` is the size of what can be told apart later: windows are not
    /// larger without need.
    pub(crate) fn surfels(&self, cell_m: f32) -> Vec<Surfel> {
        self.surfels_at(cell_m, level())
    }

    fn surfels_at(&self, cell_m: f32, level: ProvenLevel) -> Vec<Surfel> {
        let width = self.width() as usize;
        let ranges = self.without_gaps();
        let mut surfels = vec![Surfel::NONE; ranges.len()];
        surfels
            .par_chunks_mut(width * BAND)
            .enumerate()
            .for_each(|(band, out)| {
                let mut band = Band::new(self, &ranges, band * BAND, cell_m);
                dispatch!(level, _simd => {
                    band.drop_pixels();
                    match &self.directions {
                        Directions::Lens(_) => band.fit::<Flat>(out),
                        Directions::Angles(_) => band.fit::<Round>(out),
                    }
                });
            });
        surfels
    }

    /// Returns the angle between neighbouring pixels, radians.
    pub(crate) fn pixel_rad(&self) -> f64 {
        match &self.directions {
            Directions::Lens(lens) => 1.0 / lens.focal_px().min_element(),
            Directions::Angles(grid) => grid.steps_rad().into_iter().fold(0.0, f64::max),
        }
    }
}

/// The length of a vector. glam's own calls an instruction of SSE, for which the processor waits after AVX:
/// the fits took three times as long with it.
#[inline(always)]
fn length(v: Vec3) -> f32 {
    v.dot(v).sqrt()
}

#[inline(always)]
fn unit(v: Vec3) -> Vec3 {
    v * length(v).recip()
}

/// Pixels that are worked on at a time: as many as a vector register of AVX2 holds.
const LANES: usize = 8;

/// Numbers of pixels side by side.
type Lanes = [f32; LANES];

#[inline(always)]
fn load(plane: &[f32], at: usize) -> Lanes {
    let mut lanes = [0.0; LANES];
    lanes.copy_from_slice(&plane[at..at + LANES]);
    lanes
}

/// The coordinates of the neighbours of some pixels, each about an axis of its own.
trait Frame {
    /// Makes the frames of pixels from what the band holds of them.
    fn of(pixels: &[Lanes; 3]) -> Self;
    /// Returns u, v and q of a neighbour of each pixel from what the band holds of it.
    fn uvq(&self, pixels: [Lanes; 3]) -> [Lanes; 3];
    /// Returns a vector in the axes of the sensor.
    fn vector(&self, lane: usize, uvq: Vec3) -> Vec3;
}

/// The frame of a lens. The band holds u, v and q.
struct Flat;

impl Frame for Flat {
    #[inline(always)]
    fn of(_: &[Lanes; 3]) -> Self {
        Self
    }

    #[inline(always)]
    fn uvq(&self, pixels: [Lanes; 3]) -> [Lanes; 3] {
        pixels
    }

    #[inline(always)]
    fn vector(&self, _: usize, uvq: Vec3) -> Vec3 {
        uvq
    }
}

/// The frames of pixels in a grid of angles: right, down and forward as columns. The band holds points.
struct Round {
    axes: [[Lanes; 3]; 3],
}

impl Frame for Round {
    #[inline(always)]
    fn of(pixels: &[Lanes; 3]) -> Self {
        let mut axes = [[[0.0; LANES]; 3]; 3];
        for lane in 0..LANES {
            let forward = unit(Vec3::new(pixels[0][lane], pixels[1][lane], pixels[2][lane]));
            let is_level = forward.x * forward.x + forward.z * forward.z > 1e-6;
            let flat = if is_level { forward } else { Vec3::Z };
            let right = unit(Vec3::new(flat.z, 0.0, -flat.x));
            for (axis, v) in axes.iter_mut().zip([right, forward.cross(right), forward]) {
                (axis[0][lane], axis[1][lane], axis[2][lane]) = (v.x, v.y, v.z);
            }
        }
        Self { axes }
    }

    #[inline(always)]
    fn uvq(&self, pixels: [Lanes; 3]) -> [Lanes; 3] {
        let mut uvq = [[0.0; LANES]; 3];
        for (k, [x, y, z]) in self.axes.iter().enumerate() {
            for lane in 0..LANES {
                uvq[k][lane] =
                    x[lane] * pixels[0][lane] + y[lane] * pixels[1][lane] + z[lane] * pixels[2][lane];
            }
        }
        let [u, v, q] = &mut uvq;
        for ((u, v), q) in u.iter_mut().zip(v).zip(q) {
            *q = 1.0 / *q;
            *u *= *q;
            *v *= *q;
        }
        uvq
    }

    #[inline(always)]
    fn vector(&self, lane: usize, uvq: Vec3) -> Vec3 {
        let axis = |k: usize| Vec3::from_array([0, 1, 2].map(|i| self.axes[k][i][lane]));
        axis(0) * uvq.x + axis(1) * uvq.y + axis(2) * uvq.z
    }
}

/// Some rows of an image, with rows and columns around them: NaN outside of the image, and where nothing was
/// measured.
struct Band<'a> {
    image: &'a RangeImage,
    width: usize,
    /// The length of a row.
    row: usize,
    ranges: Vec<f32>,
    /// What a [`Frame`] needs of each pixel, NaN if the pixel is not taken.
    planes: [Vec<f32>; 3],
    pixel_rad: f32,
    cell_m: f32,
}

/// The eight neighbours of a pixel.
const AROUND: [[i32; 2]; 8] = [[1, 0], [-1, 0], [0, 1], [0, -1], [1, 1], [-1, -1], [1, -1], [-1, 1]];

impl<'a> Band<'a> {
    fn new(image: &'a RangeImage, ranges: &[f32], first: usize, cell_m: f32) -> Self {
        let (width, height) = (image.width() as usize, image.height() as usize);
        let margin = MARGIN as usize;
        // A few more, since pixels are taken some at a time.
        let row = width.next_multiple_of(LANES) + 2 * margin;
        let len = row * (BAND + 2 * margin);
        let nothing = || vec![f32::NAN; len];
        let mut band = Self {
            image,
            width,
            row,
            ranges: nothing(),
            planes: [nothing(), nothing(), nothing()],
            pixel_rad: image.pixel_rad() as f32,
            cell_m,
        };

        let (from, to) = (first.saturating_sub(margin), height.min(first + BAND + margin));
        let frames = image.frames(&ranges[from * width..to * width], from);
        let around = matches!(&image.directions, Directions::Angles(grid) if grid.is_around());
        for y in from..to {
            let start = (y + margin - first) * row;
            let source = &ranges[y * width..][..width];
            band.ranges[start + margin..][..width].copy_from_slice(source);
            for (x, uvq) in frames[(y - from) * width..][..width].iter().enumerate() {
                (0..3).for_each(|k| band.planes[k][start + margin + x] = uvq[k]);
            }
            if around {
                let planes = std::iter::once(&mut band.ranges).chain(&mut band.planes);
                for plane in planes {
                    for k in 0..margin {
                        plane[start + k] = plane[start + margin + (width * margin + k - margin) % width];
                        plane[start + margin + width + k] = plane[start + margin + k % width];
                    }
                }
            }
        }
        band
    }

    /// Drops the pixels that are not taken, and the outermost two rows and columns, whose neighbours are not
    /// all here.
    #[inline(always)]
    fn drop_pixels(&mut self) {
        let mut taken = vec![f32::NAN; self.ranges.len()];
        for y in 2..BAND + 2 * MARGIN as usize - 2 {
            for x in (2..self.row - 2).step_by(LANES).map(|x| x.min(self.row - 2 - LANES)) {
                let lanes = self.taken(y * self.row + x);
                taken[y * self.row + x..][..LANES].copy_from_slice(&lanes);
            }
        }
        for plane in &mut self.planes {
            plane
                .iter_mut()
                .zip(&taken)
                .for_each(|(number, taken)| *number *= taken);
        }
    }

    #[inline(always)]
    fn range(&self, at: usize, [dx, dy]: [i32; 2], k: i32) -> Lanes {
        let step = (k * dy) as isize * self.row as isize + (k * dx) as isize;
        load(&self.ranges, at.wrapping_add_signed(step))
    }

    /// Returns 1 for pixels that are neither alone nor between a surface and another one behind it, or else
    /// NaN.
    #[inline(always)]
    fn taken(&self, at: usize) -> Lanes {
        let range = self.range(at, [0, 0], 0);
        let noise = self.image.noise;
        let (mut slack, mut spacing) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            slack[lane] = 4.0 * noise.sigma_m(range[lane]);
            spacing[lane] = range[lane] * self.pixel_rad;
        }

        // A pixel of a surface has a neighbour that is no step away.
        let mut beside = [0.0_f32; LANES];
        for step in AROUND {
            let other = self.range(at, step, 1);
            for lane in 0..LANES {
                let is_near = (other[lane] - range[lane]).abs() <= slack[lane] + 10.0 * spacing[lane];
                beside[lane] += if is_near { 1.0 } else { 0.0 };
            }
        }

        // A mixed pixel is far behind one neighbour and far before the opposite one, and these go on less
        // steeply.
        let mut mixed = [0.0_f32; LANES];
        for step in [[1, 0], [0, 1], [1, 1], [1, -1]] {
            let [a2, a, b, b2] = [-2, -1, 1, 2].map(|k| self.range(at, step, k));
            for lane in 0..LANES {
                let (before, behind) = (range[lane] - a[lane], b[lane] - range[lane]);
                let least = slack[lane] + 2.0 * spacing[lane];
                let is_step = (before.abs() > least) & (behind.abs() > least) & (before * behind > 0.0);
                let goes_on = ((a[lane] - a2[lane]).abs() > GOES_ON * before.abs())
                    | ((b2[lane] - b[lane]).abs() > GOES_ON * behind.abs());
                mixed[lane] += if is_step & !goes_on { 1.0 } else { 0.0 };
            }
        }

        let mut taken = [f32::NAN; LANES];
        for lane in 0..LANES {
            if (beside[lane] >= 1.0) & (mixed[lane] == 0.0) {
                taken[lane] = 1.0;
            }
        }
        taken
    }

    #[inline(always)]
    fn fit<F: Frame>(&self, out: &mut [Surfel]) {
        for (y, out) in out.chunks_exact_mut(self.width).enumerate() {
            for (x, out) in out.chunks_mut(LANES).enumerate() {
                let at = (y + MARGIN as usize) * self.row + MARGIN as usize + LANES * x;
                if load(&self.planes[2], at).iter().any(|q| !q.is_nan()) {
                    self.fit_lanes::<F>(at, out);
                }
            }
        }
    }

    #[inline(always)]
    fn pixels(&self, at: usize) -> [Lanes; 3] {
        [load(&self.planes[0], at), load(&self.planes[1], at), load(&self.planes[2], at)]
    }

    /// Returns how q grows along one axis, `step` pixels apart, from `[along, q]`: on the side where it grows
    /// less, since a step may be on the other.
    #[inline(always)]
    fn grows<F: Frame>(
        &self,
        frame: &F,
        at: usize,
        step: usize,
        stride: i32,
        [here, q0]: [Lanes; 2],
        axis: usize,
    ) -> Lanes {
        let far = 2 * stride as isize;
        let mut sides = [[0.0; LANES]; 4];
        for (side, steps) in sides.iter_mut().zip([-far, far, -1, 1]) {
            let uvq = frame.uvq(self.pixels(at.wrapping_add_signed(steps * step as isize)));
            for lane in 0..LANES {
                side[lane] = (uvq[2][lane] - q0[lane]) / (uvq[axis][lane] - here[lane]);
            }
        }
        let [a, b, a1, b1] = sides;
        let mut grows = [0.0; LANES];
        for lane in 0..LANES {
            let a = if a[lane].is_finite() { a[lane] } else { a1[lane] };
            let b = if b[lane].is_finite() { b[lane] } else { b1[lane] };
            // NaN is neither less nor more.
            let least = if a.abs() <= b.abs() || !b.is_finite() { a } else { b };
            grows[lane] = if least.is_finite() { least } else { 0.0 };
        }
        grows
    }

    /// Returns 1, and u, v and q from the middle, of the pixels that are `steps` strides away; 0 for those on
    /// another surface.
    #[inline(always)]
    fn near<F: Frame>(&self, frame: &F, window: &Window, steps: [i32; 2]) -> [Lanes; 4] {
        let Window { at, stride, from: [u0, v0, q0], grows: [gu, gv], tolerance, more } = window;
        let [dx, dy] = steps.map(|k| (k * stride) as isize);
        let [u, v, q] = frame.uvq(self.pixels(at.wrapping_add_signed(dy * self.row as isize + dx)));
        let steps = steps[0].abs().max(steps[1].abs()) as f32;
        let mut near = [[0.0; LANES]; 4];
        for lane in 0..LANES {
            let (u, v, q) = (u[lane] - u0[lane], v[lane] - v0[lane], q[lane] - q0[lane]);
            let off = (q - gu[lane] * u - gv[lane] * v).abs();
            let is_near = off <= tolerance[lane] + more[lane] * steps;
            near[0][lane] = if is_near { 1.0 } else { 0.0 };
            near[1][lane] = if is_near { u } else { 0.0 };
            near[2][lane] = if is_near { v } else { 0.0 };
            near[3][lane] = if is_near { q } else { 0.0 };
        }
        near
    }

    #[inline(always)]
    fn fit_lanes<F: Frame>(&self, at: usize, out: &mut [Surfel]) {
        let range = load(&self.ranges, at);
        let center = self.pixels(at);
        let frame = F::of(&center);
        let [u0, v0, q0] = frame.uvq(center);
        let (mut sigma, mut spacing) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            sigma[lane] = self.image.noise.sigma_m(range[lane]);
            spacing[lane] = range[lane] * self.pixel_rad;
        }

        // The window is as wide as the noise needs, or as half a cell if that is more: the same for all
        // lanes.
        let mut stride = 1;
        for lane in (0..LANES).filter(|lane| !q0[*lane].is_nan()) {
            let cells = self.cell_m / spacing[lane];
            let for_noise = (sigma[lane] / spacing[lane] + 1.0).min(1.25 * cells);
            stride = stride.max((for_noise.max(0.4 * cells) as i32).clamp(1, MOST_STRIDE));
        }

        // How q grows to the right and downwards.
        let from = [u0, v0, q0];
        let grows = [
            self.grows(&frame, at, 1, stride, [from[0], from[2]], 0),
            self.grows(&frame, at, self.row, stride, [from[1], from[2]], 1),
        ];

        let (mut tolerance, mut more) = ([0.0; LANES], [0.0; LANES]);
        for lane in 0..LANES {
            let per_range = q0[lane] / range[lane];
            tolerance[lane] = per_range * 6.0 * sigma[lane];
            more[lane] = per_range * 0.5 * spacing[lane] * stride as f32;
        }
        // The inner pixels first, for they decide the place, and all of them the slope.
        let window = Window { at, stride, from, grows, tolerance, more };
        let mut inner = Fit::default();
        for dy in -1..=1 {
            for dx in -1..=1 {
                inner.add(&self.near(&frame, &window, [dx, dy]));
            }
        }
        let mut fit = inner;
        for dy in -2..=2_i32 {
            for dx in (-2..=2_i32).filter(|dx| dx.abs().max(dy.abs()) == 2) {
                fit.add(&self.near(&frame, &window, [dx, dy]));
            }
        }

        let mut nearest = range;
        for step in AROUND {
            let other = self.range(at, step, 1);
            for lane in 0..LANES {
                let least = if other[lane] < nearest[lane] {
                    other[lane]
                } else {
                    nearest[lane]
                };
                nearest[lane] = if other[lane].is_nan() { 0.0 } else { least };
            }
        }

        for (lane, surfel) in out.iter_mut().enumerate().filter(|(lane, _)| !q0[*lane].is_nan()) {
            let center = Vec3::new(u0[lane], v0[lane], 1.0);
            // The slope comes from the window, the place from its middle. A thread, or a point in the air,
            // faces the sensor.
            let (b, c) = fit.slope(lane).unwrap_or_else(|| {
                let m = center * (q0[lane] / center.length_squared());
                (m.x, m.y)
            });
            let q = q0[lane] + inner.mean(lane, b, c);
            let inverse = frame.vector(lane, Vec3::new(b, c, q - b * center.x - c * center.y));
            let offset = length(inverse).recip();
            let normal = -inverse * offset;
            let cosine = -normal.dot(unit(frame.vector(lane, center)));
            if cosine.is_nan() || cosine < LEAST_COSINE {
                continue;
            }
            let relative = UNIT_SIGMA_M / sigma[lane];
            *surfel = Surfel {
                normal,
                offset,
                range: range[lane],
                weight: relative * relative * cosine,
                sigma_m: sigma[lane],
                nearest: nearest[lane],
            };
        }
    }
}

/// The pixels around some pixels that are fitted with them.
struct Window {
    /// Where the first of the pixels is in the band.
    at: usize,
    stride: i32,
    /// u, v and q in the middle.
    from: [Lanes; 3],
    /// How q grows with u and with v.
    grows: [Lanes; 2],
    /// How far q may be from that in the middle, and with each step more.
    tolerance: Lanes,
    more: Lanes,
}

/// Sums of least-squares fits q = a + b·u + c·v.
#[derive(Clone, Copy, Default)]
struct Fit {
    /// n, u, v, q, uu, uv, vv, uq and vq.
    sums: [Lanes; 9],
}

impl Fit {
    /// Adds 1, u, v and q, or zeros.
    #[inline(always)]
    fn add(&mut self, [one, u, v, q]: &[Lanes; 4]) {
        for lane in 0..LANES {
            self.sums[0][lane] += one[lane];
            self.sums[1][lane] += u[lane];
            self.sums[2][lane] += v[lane];
            self.sums[3][lane] += q[lane];
            self.sums[4][lane] += u[lane] * u[lane];
            self.sums[5][lane] += u[lane] * v[lane];
            self.sums[6][lane] += v[lane] * v[lane];
            self.sums[7][lane] += u[lane] * q[lane];
            self.sums[8][lane] += v[lane] * q[lane];
        }
    }

    /// Returns b and c, or `None` if the places lie in a line.
    #[inline(always)]
    fn slope(&self, lane: usize) -> Option<(f32, f32)> {
        let [n, u, v, q, uu, uv, vv, uq, vq] = std::array::from_fn(|k| self.sums[k][lane]);
        let k = n.recip();
        let (uu, uv, vv) = (uu - u * u * k, uv - u * v * k, vv - v * v * k);
        let (uq, vq) = (uq - u * q * k, vq - v * q * k);
        let det = uu * vv - uv * uv;
        let is_plane = det > 0.02 * uu * vv && n >= 4.0;
        is_plane.then(|| ((uq * vv - vq * uv) / det, (vq * uu - uq * uv) / det))
    }

    /// Returns the a that fits best with the given b and c.
    #[inline(always)]
    fn mean(&self, lane: usize, b: f32, c: f32) -> f32 {
        let [n, u, v, q] = std::array::from_fn(|k| self.sums[k][lane]);
        (q - b * u - c * v) / n
    }
}

impl RangeImage {
    /// Returns what a [`Frame`] needs of each pixel of some rows, which have these ranges; NaN where nothing
    /// was measured.
    fn frames(&self, ranges: &[f32], from_row: usize) -> Vec<[f32; 3]> {
        let width = self.width() as usize;
        match &self.directions {
            Directions::Lens(_) => {
                let uvq = |(i, range): (usize, &f32)| {
                    let ray = self.ray_of(from_row * width + i);
                    if range.is_nan() {
                        [f32::NAN; 3]
                    } else {
                        [ray.x, ray.y, range.recip()]
                    }
                };
                ranges.iter().enumerate().map(uvq).collect()
            }
            Directions::Angles(grid) => {
                let (columns, rows) = (grid.column_rays(), grid.row_rays());
                let steps = grid.steps_rad();
                let point = |(i, range): (usize, &f32)| {
                    if range.is_nan() {
                        return [f32::NAN; 3];
                    }
                    let [sin_x, cos_x] = columns[i % width];
                    let [sin_y, cos_y] = rows[from_row + i / width];
                    let middle = DVec3::new(cos_y * sin_x, sin_y, cos_y * cos_x);
                    let ray = match self.offsets.get(from_row * width + i) {
                        Some(off) => {
                            let [x, y] = [0, 1].map(|k| f64::from(off[k]) / 254.0 * steps[k]);
                            let right = DVec3::new(cos_y * cos_x, 0.0, -cos_y * sin_x);
                            let down = DVec3::new(-sin_y * sin_x, cos_y, -sin_y * cos_x);
                            (middle + right * x + down * y).normalize()
                        }
                        None => middle,
                    };
                    (ray * f64::from(*range)).as_vec3().to_array()
                };
                ranges.iter().enumerate().map(point).collect()
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::range_image::gaps::tests::image;

    #[test]
    fn all_vector_instructions_give_the_same_planes() {
        let image = image(|x, y| (x * y) % 11 == 3);
        let bits = |level| -> Vec<[u32; 8]> {
            let surfels = image.surfels_at(0.02, level);
            let numbers = |s: &Surfel| {
                let [x, y, z] = s.normal.to_array();
                [x, y, z, s.offset, s.range, s.weight, s.sigma_m, s.nearest].map(f32::to_bits)
            };
            surfels.iter().map(numbers).collect()
        };
        let mut levels = ProvenLevel::all().into_iter().map(bits);
        let plain = levels.next().unwrap();
        assert!(plain.iter().filter(|s| s[5] != 0).count() > 3000);
        levels.for_each(|other| assert!(other == plain));
    }
}
