//! A plane for each pixel, fitted to the pixels around it that lie on the same surface.
//!
//! In gnomonic coordinates (u, v) about any axis, the inverse of the depth along that axis is a linear function on a
//! plane: q = a + b·u + c·v. So a fit of three numbers is exact on planes at any angle, for lenses and for grids of
//! angles alike. The axis is the optical axis of a lens, and the ray of the pixel in a grid of angles.

use super::{Directions, RangeImage};
use rayon::prelude::*;
use s3d_geom::glam::{DVec3, Vec3, dvec2};

/// The plane that a pixel sees, in OpenCV's axes of the sensor: a point x is normal·x + offset in front of it.
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
const BAND: usize = 16;
/// The pixels of a window are −2·t … 2·t for a stride t, at most this.
const MOST_STRIDE: i32 = 4;
/// Rows around a band that its windows and the tests of their pixels reach.
const MARGIN: i32 = 2 * MOST_STRIDE + 2;
/// Pixels are dropped whose ray meets the surface at a smaller cosine than this.
const LEAST_COSINE: f32 = 0.05;
/// The noise at which a pixel has the weight 1.
const UNIT_SIGMA_M: f32 = 0.001;

impl RangeImage {
    /// Fits a plane to each pixel. `cell_m` is the size of what can be told apart later: windows are not larger without
    /// need.
    pub(crate) fn surfels(&self, cell_m: f32) -> Vec<Surfel> {
        let width = self.width() as usize;
        let mut surfels = vec![Surfel::NONE; self.ranges.len()];
        surfels
            .par_chunks_mut(width * BAND)
            .enumerate()
            .for_each(|(band, out)| match &self.directions {
                Directions::Lens(_) => Band::new(self, band * BAND, cell_m).fit::<Flat>(out),
                Directions::Angles(_) => Band::new(self, band * BAND, cell_m).fit::<Round>(out),
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

/// The coordinates of a pixel's neighbours about an axis.
trait Frame {
    /// Makes the frame of a pixel from what the band holds of it.
    fn of(pixel: [f32; 3]) -> Self;
    /// Returns u, v and q of a neighbour from what the band holds of it.
    fn uvq(&self, pixel: [f32; 3]) -> [f32; 3];
    /// Returns a vector in the axes of the sensor.
    fn vector(&self, uvq: Vec3) -> Vec3;
}

/// The frame of a lens. The band holds u, v and q.
struct Flat;

impl Frame for Flat {
    fn of(_: [f32; 3]) -> Self {
        Self
    }

    #[inline(always)]
    fn uvq(&self, pixel: [f32; 3]) -> [f32; 3] {
        pixel
    }

    fn vector(&self, uvq: Vec3) -> Vec3 {
        uvq
    }
}

/// The frame of a pixel in a grid of angles. The band holds the point.
struct Round {
    right: Vec3,
    down: Vec3,
    forward: Vec3,
}

impl Frame for Round {
    fn of(pixel: [f32; 3]) -> Self {
        let forward = Vec3::from_array(pixel).normalize();
        let flat = if forward.x * forward.x + forward.z * forward.z > 1e-6 {
            forward
        } else {
            Vec3::Z
        };
        let right = Vec3::new(flat.z, 0.0, -flat.x).normalize();
        Self { right, down: forward.cross(right), forward }
    }

    #[inline(always)]
    fn uvq(&self, pixel: [f32; 3]) -> [f32; 3] {
        let p = Vec3::from_array(pixel);
        let q = p.dot(self.forward).recip();
        [p.dot(self.right) * q, p.dot(self.down) * q, q]
    }

    fn vector(&self, uvq: Vec3) -> Vec3 {
        self.right * uvq.x + self.down * uvq.y + self.forward * uvq.z
    }
}

/// Some rows of an image, with rows around them.
struct Band<'a> {
    image: &'a RangeImage,
    /// The first row to fit, and the first row that is held.
    first: usize,
    held_from: usize,
    width: i32,
    height: i32,
    around: bool,
    ranges: &'a [f32],
    /// What a [`Frame`] needs of each pixel.
    pixels: Vec<[f32; 3]>,
    /// Whether a pixel is taken.
    taken: Vec<bool>,
    pixel_rad: f32,
    cell_m: f32,
}

impl<'a> Band<'a> {
    fn new(image: &'a RangeImage, first: usize, cell_m: f32) -> Self {
        let (width, rows) = (image.width() as usize, image.height() as usize);
        let held_from = first.saturating_sub(MARGIN as usize);
        let held_to = rows.min(first + BAND + MARGIN as usize);
        let around = matches!(&image.directions, Directions::Angles(grid) if grid.is_around());
        let mut band = Self {
            image,
            first,
            held_from,
            width: width as i32,
            height: (held_to - held_from) as i32,
            around,
            ranges: &image.ranges.pixels()[held_from * width..held_to * width],
            pixels: image.frames(held_from, held_to),
            taken: Vec::new(),
            pixel_rad: image.pixel_rad() as f32,
            cell_m,
        };
        let at = |i: usize| (i as i32 % band.width, i as i32 / band.width);
        band.taken = (0..band.ranges.len()).map(|i| band.is_taken(at(i))).collect();
        band
    }

    /// The index of a pixel in the band; row 0 is `held_from`.
    #[inline(always)]
    fn index(&self, x: i32, y: i32) -> Option<usize> {
        let x = if self.around { x.rem_euclid(self.width) } else { x };
        let is_within = x >= 0 && x < self.width && y >= 0 && y < self.height;
        is_within.then(|| (y * self.width + x) as usize)
    }

    /// The range of a pixel, NaN if there is none.
    #[inline(always)]
    fn range(&self, x: i32, y: i32) -> f32 {
        self.index(x, y).map_or(f32::NAN, |i| self.ranges[i])
    }

    /// Whether a pixel is neither alone nor between a surface and another one behind it.
    fn is_taken(&self, (x, y): (i32, i32)) -> bool {
        let range = self.range(x, y);
        if range.is_nan() {
            return false;
        }
        let noise = 4.0 * self.image.noise.sigma_m(range);
        let spacing = range * self.pixel_rad;

        // A pixel of a surface has two neighbours that are no step away.
        let step = noise + 10.0 * spacing;
        let mut beside = 0;
        for (dx, dy) in [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1)] {
            beside += u32::from((self.range(x + dx, y + dy) - range).abs() <= step);
        }
        if beside < 2 {
            return false;
        }

        // A mixed pixel is far behind one neighbour and far before the opposite one, and these go on less steeply.
        let step = noise + 2.0 * spacing;
        let is_mixed = |(dx, dy): (i32, i32)| {
            let before = range - self.range(x - dx, y - dy);
            let behind = self.range(x + dx, y + dy) - range;
            if !(before.abs() > step && behind.abs() > step && before * behind > 0.0) {
                return false;
            }
            let goes_on = |k: i32, jump: f32| {
                let outer = self.range(x + 2 * k * dx, y + 2 * k * dy) - self.range(x + k * dx, y + k * dy);
                outer.abs() > 0.4 * jump.abs()
            };
            !goes_on(-1, before) && !goes_on(1, behind)
        };
        ![(1, 0), (0, 1), (1, 1), (1, -1)].into_iter().any(is_mixed)
    }

    fn fit<F: Frame>(&self, out: &mut [Surfel]) {
        let width = self.width as usize;
        for (i, surfel) in out.iter_mut().enumerate() {
            let (x, y) = ((i % width) as i32, (self.first - self.held_from + i / width) as i32);
            let at = y as usize * width + x as usize;
            if self.taken[at] {
                *surfel = self.surfel::<F>(x, y, at);
            }
        }
    }

    fn surfel<F: Frame>(&self, x: i32, y: i32, at: usize) -> Surfel {
        let range = self.ranges[at];
        let sigma_m = self.image.noise.sigma_m(range);
        let spacing = range * self.pixel_rad;
        let frame = F::of(self.pixels[at]);
        let [u0, v0, q0] = frame.uvq(self.pixels[at]);

        // The window is as wide as the noise needs, or as half a cell if that is more.
        let for_noise = (0.94 * sigma_m / spacing).ceil().min(1.25 * self.cell_m / spacing);
        let for_cell = 0.4 * self.cell_m / spacing;
        let stride = (for_noise.max(for_cell) as i32).clamp(1, MOST_STRIDE);

        // How q grows to the right and downwards: on the side where it grows less, since a step may be on the other.
        let per_range = q0 / range;
        let tolerance = per_range * 6.0 * sigma_m;
        let grows = |dx: i32, dy: i32, along: usize| {
            let side = |k: i32| {
                let i = self.index(x + k * dx, y + k * dy).filter(|i| self.taken[*i])?;
                let uvq = frame.uvq(self.pixels[i]);
                let off = uvq[along] - [u0, v0][along];
                Some((uvq[2] - q0) / off).filter(|g| g.is_finite())
            };
            match (side(-2 * stride).or_else(|| side(-1)), side(2 * stride).or_else(|| side(1))) {
                (Some(a), Some(b)) => {
                    if a.abs() < b.abs() {
                        a
                    } else {
                        b
                    }
                }
                (a, b) => a.or(b).unwrap_or(0.0),
            }
        };
        let (gu, gv) = (grows(1, 0, 0), grows(0, 1, 1));

        let mut fit = Fit::default();
        let mut inner = Fit::default();
        for dy in -2..=2 {
            for dx in -2..=2_i32 {
                let Some(i) = self.index(x + dx * stride, y + dy * stride).filter(|i| self.taken[*i]) else {
                    continue;
                };
                let [u, v, q] = frame.uvq(self.pixels[i]);
                let (u, v, q) = (u - u0, v - v0, q - q0);
                let steps = (dx.abs().max(dy.abs()) * stride) as f32;
                let allowed = tolerance + per_range * 0.5 * spacing * steps;
                if (q - gu * u - gv * v).abs() > allowed {
                    continue;
                }
                fit.add(u, v, q);
                if dx.abs() <= 1 && dy.abs() <= 1 {
                    inner.add(u, v, q);
                }
            }
        }

        // The slope comes from the window, the place from its middle.
        let (b, c) = fit.slope().unwrap_or_else(|| {
            // A thread, or a point in the air: it faces the sensor.
            let m = Vec3::new(u0, v0, 1.0) * (q0 / (u0 * u0 + v0 * v0 + 1.0));
            (m.x, m.y)
        });
        let place = inner.mean(b, c);
        let q = if place.is_finite() { q0 + place } else { q0 };
        let inverse = frame.vector(Vec3::new(b, c, q - b * u0 - c * v0));
        let offset = inverse.length().recip();
        let normal = -inverse * offset;
        let ray = frame.vector(Vec3::new(u0, v0, 1.0)).normalize();
        let cosine = -normal.dot(ray);
        if cosine.is_nan() || cosine < LEAST_COSINE {
            return Surfel::NONE;
        }

        let mut nearest = range;
        for (dx, dy) in [(1, 0), (-1, 0), (0, 1), (0, -1), (1, 1), (-1, -1), (1, -1), (-1, 1)] {
            let other = self.range(x + dx, y + dy);
            nearest = if other.is_nan() { 0.0 } else { nearest.min(other) };
        }
        let relative = UNIT_SIGMA_M / sigma_m;
        Surfel { normal, offset, range, weight: relative * relative * cosine, sigma_m, nearest }
    }
}

/// Sums of a least-squares fit q = a + b·u + c·v.
#[derive(Default)]
struct Fit {
    n: f32,
    u: f32,
    v: f32,
    q: f32,
    uu: f32,
    uv: f32,
    vv: f32,
    uq: f32,
    vq: f32,
}

impl Fit {
    #[inline(always)]
    fn add(&mut self, u: f32, v: f32, q: f32) {
        self.n += 1.0;
        self.u += u;
        self.v += v;
        self.q += q;
        self.uu += u * u;
        self.uv += u * v;
        self.vv += v * v;
        self.uq += u * q;
        self.vq += v * q;
    }

    /// Returns b and c, or `None` if the places lie in a line.
    fn slope(&self) -> Option<(f32, f32)> {
        let k = self.n.recip();
        let uu = self.uu - self.u * self.u * k;
        let uv = self.uv - self.u * self.v * k;
        let vv = self.vv - self.v * self.v * k;
        let uq = self.uq - self.u * self.q * k;
        let vq = self.vq - self.v * self.q * k;
        let det = uu * vv - uv * uv;
        (det > 0.02 * uu * vv && self.n >= 4.0)
            .then(|| ((uq * vv - vq * uv) / det, (vq * uu - uq * uv) / det))
    }

    /// Returns the a that fits best with the given b and c.
    fn mean(&self, b: f32, c: f32) -> f32 {
        (self.q - b * self.u - c * self.v) / self.n
    }
}

impl RangeImage {
    /// Returns what a [`Frame`] needs of each pixel of some rows; NaN where nothing was measured.
    fn frames(&self, from_row: usize, to_row: usize) -> Vec<[f32; 3]> {
        let width = self.width() as usize;
        let ranges = &self.ranges.pixels()[from_row * width..to_row * width];
        match &self.directions {
            Directions::Lens(lens) => {
                let uvq = |(i, range): (usize, &f32)| {
                    let pixel = dvec2((i % width) as f64 + 0.5, (from_row + i / width) as f64 + 0.5);
                    match lens.direction(pixel).filter(|_| range.is_finite()) {
                        Some(d) => [(d.x / d.z) as f32, (d.y / d.z) as f32, range.recip()],
                        None => [f32::NAN; 3],
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
