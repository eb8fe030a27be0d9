//! A plane for each pixel, fitted to the pixels around it that lie on the same surface.
//!
//! In gnomonic coordinates (u, v) about any axis, the inverse of the depth along that axis is a linear
//! function on a plane: q = a + b·u + c·v. So a fit of three numbers is exact on planes at any angle, for
//! lenses and for grids of angles alike. The axis is the optical axis of a lens, and the ray of the pixel in
//! a grid of angles.

use super::frame::{Flat, Frame, MOST_Q, Round, load};
use super::{Directions, RangeImage};
use crate::lanes::{LANES, Lanes};
use rayon::prelude::*;
use s3d_geom::glam::Vec3;
use s3d_simd::{ProvenLevel, dispatch, level};

/// The plane that a pixel sees, in OpenCV's axes of the sensor: a point x is normal·x + offset in front of
/// it.
#[derive(Clone, Copy, Debug)]
#[repr(align(32))] // In one line of the cache.
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
    pub(crate) const NONE: Self =
        Self { normal: Vec3::ZERO, offset: 0.0, range: 0.0, weight: 0.0, sigma_m: 0.0, nearest: 0.0 };

    /// Its numbers, in the order of the fields.
    #[inline(always)]
    pub(crate) fn numbers(&self) -> [f32; 8] {
        let [x, y, z] = self.normal.to_array();
        [x, y, z, self.offset, self.range, self.weight, self.sigma_m, self.nearest]
    }
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

/// Some rows of an image, with rows and columns around them: NaN outside of the image, and where nothing was
/// measured.
struct Band<'a> {
    image: &'a RangeImage,
    width: usize,
    /// The length of a row.
    row: usize,
    ranges: Vec<f32>,
    /// What a [`Frame`] needs of each pixel.
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
        let none = match &image.directions {
            Directions::Lens(_) => Flat::NONE,
            Directions::Angles(_) => Round::NONE,
        };
        let mut band = Self {
            image,
            width,
            row,
            ranges: vec![f32::NAN; len],
            planes: none.map(|number| vec![number; len]),
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

    /// Drops the pixels that are not taken.
    #[inline(always)]
    fn drop_pixels<F: Frame>(&mut self) {
        // Windows do not reach the outermost rows and columns, whose neighbours are not here.
        for y in 2..BAND + 2 * MARGIN as usize - 2 {
            for x in (2..self.row - 2).step_by(LANES).map(|x| x.min(self.row - 2 - LANES)) {
                let taken = self.taken(y * self.row + x);
                for (plane, none) in self.planes.iter_mut().zip(F::NONE) {
                    let plane = &mut plane[y * self.row + x..][..LANES];
                    for lane in 0..LANES {
                        plane[lane] = if taken[lane] > 0.0 { plane[lane] } else { none };
                    }
                }
            }
        }
    }

    #[inline(always)]
    fn range(&self, at: usize, [dx, dy]: [i32; 2], k: i32) -> Lanes {
        let step = (k * dy) as isize * self.row as isize + (k * dx) as isize;
        load(&self.ranges, at.wrapping_add_signed(step))
    }

    /// Returns 1 for pixels that are neither alone nor between a surface and another one behind it, else 0.
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

        let mut taken = [0.0; LANES];
        for lane in 0..LANES {
            taken[lane] = f32::from((beside[lane] >= 1.0) & (mixed[lane] == 0.0));
        }
        taken
    }

    #[inline(always)]
    fn fit<F: Frame>(&mut self, out: &mut [Surfel]) {
        self.drop_pixels::<F>();
        for (y, out) in out.chunks_exact_mut(self.width).enumerate() {
            for (x, out) in out.chunks_mut(LANES).enumerate() {
                let at = (y + MARGIN as usize) * self.row + MARGIN as usize + LANES * x;
                if load(&self.ranges, at).iter().any(|range| !range.is_nan()) {
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
            let a = if a[lane].abs() < MOST_Q { a[lane] } else { a1[lane] };
            let b = if b[lane].abs() < MOST_Q { b[lane] } else { b1[lane] };
            let least = if a.abs() <= b.abs() { a } else { b };
            grows[lane] = if least.abs() < MOST_Q { least } else { 0.0 };
        }
        grows
    }

    /// Adds the pixels that are `steps` strides away to fits, about u, v and q of the middle. Pixels on
    /// another surface are left out.
    #[inline(always)]
    fn gather<F: Frame>(&self, frame: &F, window: &Window, steps: [i32; 2], fit: &mut Fit) {
        let Window { at, stride, from: [u0, v0, q0], grows: [gu, gv], tolerance, more } = window;
        let [dx, dy] = steps.map(|k| (k * stride) as isize);
        let [u, v, q] = frame.uvq(self.pixels(at.wrapping_add_signed(dy * self.row as isize + dx)));
        let steps = steps[0].abs().max(steps[1].abs()) as f32;
        for lane in 0..LANES {
            let (u, v, q) = (u[lane] - u0[lane], v[lane] - v0[lane], q[lane] - q0[lane]);
            let off = (q - gu[lane] * u - gv[lane] * v).abs();
            let is_near = f32::from(off <= tolerance[lane] + more[lane] * steps);
            fit.add(lane, is_near, [is_near * u, is_near * v, is_near * q]);
        }
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
        for lane in 0..LANES {
            let cells = self.cell_m / spacing[lane];
            let for_noise = (sigma[lane] / spacing[lane] + 1.0).min(1.25 * cells);
            let wanted = for_noise.max(0.4 * cells) as i32;
            stride = stride.max(if q0[lane] < MOST_Q { wanted.min(MOST_STRIDE) } else { 1 });
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
                self.gather(&frame, &window, [dx, dy], &mut inner);
            }
        }
        let mut fit = inner;
        for dy in -2..=2_i32 {
            for dx in (-2..=2_i32).filter(|dx| dx.abs().max(dy.abs()) == 2) {
                self.gather(&frame, &window, [dx, dy], &mut fit);
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

        // The slope comes from the window, the place from its middle. A thread, or a point in the air, faces
        // the sensor.
        let [mut b, mut c] = [u0, v0];
        for lane in 0..LANES {
            let facing = q0[lane] / (u0[lane] * u0[lane] + v0[lane] * v0[lane] + 1.0);
            (b[lane], c[lane]) = (u0[lane] * facing, v0[lane] * facing);
        }
        fit.slopes(&mut b, &mut c);
        let mut q = inner.means(&b, &c);
        for lane in 0..LANES {
            q[lane] = (q0[lane] + q[lane]) - b[lane] * u0[lane] - c[lane] * v0[lane];
        }

        let inverse = frame.vectors([b, c, q]);
        let ray = frame.vectors([u0, v0, [1.0; LANES]]);
        let mut normal = inverse;
        let (mut offset, mut cosine, mut weight) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let dot = |a: &[Lanes; 3], b: &[Lanes; 3], lane: usize| {
            a[0][lane] * b[0][lane] + a[1][lane] * b[1][lane] + a[2][lane] * b[2][lane]
        };
        for lane in 0..LANES {
            offset[lane] = 1.0 / dot(&inverse, &inverse, lane).sqrt();
            (0..3).for_each(|k| normal[k][lane] = -inverse[k][lane] * offset[lane]);
            cosine[lane] = -dot(&normal, &ray, lane) / dot(&ray, &ray, lane).sqrt();
            let relative = UNIT_SIGMA_M / sigma[lane];
            weight[lane] = relative * relative * cosine[lane];
        }

        // NaN is no cosine.
        let is_seen = |lane: &usize| q0[*lane] < MOST_Q && cosine[*lane] >= LEAST_COSINE;
        for lane in (0..out.len()).filter(is_seen) {
            out[lane] = Surfel {
                normal: Vec3::new(normal[0][lane], normal[1][lane], normal[2][lane]),
                offset: offset[lane],
                range: range[lane],
                weight: weight[lane],
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
    /// Adds 1, u, v and q of a pixel, or zeros.
    #[inline(always)]
    fn add(&mut self, lane: usize, one: f32, [u, v, q]: [f32; 3]) {
        let products = [one, u, v, q, u * u, u * v, v * v, u * q, v * q];
        for (sum, product) in self.sums.iter_mut().zip(products) {
            sum[lane] += product;
        }
    }

    /// Changes b and c to those of the fits, except where the places lie in a line.
    #[inline(always)]
    fn slopes(&self, b: &mut Lanes, c: &mut Lanes) {
        for lane in 0..LANES {
            let [n, u, v, q, uu, uv, vv, uq, vq] = std::array::from_fn(|k| self.sums[k][lane]);
            let k = 1.0 / n;
            let (uu, uv, vv) = (uu - u * u * k, uv - u * v * k, vv - v * v * k);
            let (uq, vq) = (uq - u * q * k, vq - v * q * k);
            let det = uu * vv - uv * uv;
            let is_plane = (det > 0.02 * uu * vv) & (n >= 4.0);
            let slope = [(uq * vv - vq * uv) / det, (vq * uu - uq * uv) / det];
            b[lane] = if is_plane { slope[0] } else { b[lane] };
            c[lane] = if is_plane { slope[1] } else { c[lane] };
        }
    }

    /// Returns the a that fit best with the given b and c.
    #[inline(always)]
    fn means(&self, b: &Lanes, c: &Lanes) -> Lanes {
        let mut means = [0.0; LANES];
        for lane in 0..LANES {
            let [n, u, v, q] = std::array::from_fn(|k| self.sums[k][lane]);
            means[lane] = (q - b[lane] * u - c[lane] * v) / n;
        }
        means
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
            surfels.iter().map(|s| s.numbers().map(f32::to_bits)).collect()
        };
        let mut levels = ProvenLevel::all().into_iter().map(bits);
        let plain = levels.next().unwrap();
        assert!(plain.iter().filter(|s| s[5] != 0).count() > 3000);
        levels.for_each(|other| assert!(other == plain));
    }
}
