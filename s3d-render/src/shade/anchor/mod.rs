//! Interpolates attributes over a face, eight pixels at a time.
//!
//! An attribute (a texture coordinate, a channel of the colour) is a ratio a(d) = (α·d) / (ω·d) of linear
//! functions of the ray's direction d (see [`crate::shade::patch`]). Evaluating it in `f64` for every pixel
//! would take most of an image's time. In `f32`, the numerator would lose its significant digits. So it is
//! anchored at a pixel of the face with the direction e. There the attribute a₀ = a(e) is evaluated once in
//! `f64`:
//!
//! ```text
//! a(d) = a₀ + n(d) / w(d),   n(d) = (α − a₀ω)·(d − e) / ω·e,   w(d) = 1 + ω·(d − e) / ω·e
//! ```
//!
//! Both n and w − 1 are linear in d − e and small near the anchor, so nothing cancels. Along a row, d −
//! e depends on the column's offset k from the anchor through two functions alone. In a perspective view they
//! are k and 0. In a panorama, with the angle δ from column to column, they are sin kδ and 1 − cos kδ.
//!
//! Error: an anchor serves pixels that are at most [`REACH`] columns and rows away and whose w is within
//! 1/[`DEEP`] to [`DEEP`]. n and w each go through fewer than 8 roundings of 2⁻²⁴ relative to the pixels
//! between. Let f be the change of the attribute by one pixel, here or at the anchor. The quotient is off by
//! less than 16 · 2⁻²⁴ · 2 [`REACH`] · [`DEEP`] · f < f / 500, and by less than f / 8000 if w hardly
//! varies, as is usual in 64 pixels. The sum with a₀ is rounded by 2⁻²⁴ of itself: a 4000th of a pixel
//! in a texture of 4096.

pub(crate) mod attributes;
pub(crate) mod ray_grid;

use crate::shade::patch::Patch;
use crate::shade::texel_wrap::TexelWrap;
use crate::simd::shade_lanes::{LANES, ShadeLanes, eight};
use attributes::{Attributes, max, min};
use glam::DVec3;
use ray_grid::{REACH, RayGrid};

/// The largest factor by which a pixel may be nearer or farther than its anchor.
pub(crate) const DEEP: f32 = 16.0;

/// The linear functions of d − e: n of the three attributes, then w − 1. In a perspective view they are
/// `along` · columns + `down` · rows. In a panorama, let c(k) be the unit vector of the azimuth of column
/// k: `along` belongs to the direction in which c(0) turns, `down` to c(0), and `up` to the vertical.
#[derive(Clone, Copy, Debug, Default)]
struct Slopes {
    along: [f32; 4],
    down: [f32; 4],
    up: [f32; 4],
    /// The attributes at the anchor and their bounds, after wrapping.
    base: [f32; 3],
    min: [f32; 3],
    max: [f32; 3],
}

impl Slopes {
    /// Anchors attributes at the direction `e`, where directions change by `steps`.
    #[inline(always)]
    fn new<const PANORAMA: bool>(
        attributes: &Attributes,
        wraps: [TexelWrap; 3],
        e: DVec3,
        steps: [DVec3; 2],
    ) -> Self {
        let mut slopes = Self::default();
        let scale = attributes.denominator.dot(e).recip();
        slopes.set::<PANORAMA>(3, attributes.denominator * scale, steps);

        for (k, wrap) in wraps.into_iter().enumerate() {
            let (low, high) = attributes.bounds[k];
            let value = min(max(attributes.numerator[k].dot(e) * scale, low), high);
            let m = (attributes.numerator[k] - attributes.denominator * value) * scale;
            let (sign, shift) = wrap.sign_and_shift(value);
            slopes.set::<PANORAMA>(k, m * sign, steps);
            slopes.base[k] = (value * sign + shift) as f32;
            let low = (low * sign + shift) as f32;
            let high = (high * sign + shift) as f32;
            (slopes.min[k], slopes.max[k]) = if sign < 0.0 { (high, low) } else { (low, high) };
        }
        slopes
    }

    #[inline(always)]
    fn set<const PANORAMA: bool>(&mut self, k: usize, m: DVec3, [x, y]: [DVec3; 2]) {
        if PANORAMA {
            // The azimuth falls to the right.
            self.along[k] = (m.x * x.y - m.y * x.x) as f32;
            self.down[k] = (m.x * x.x + m.y * x.y) as f32;
            self.up[k] = m.z as f32;
        } else {
            (self.along[k], self.down[k]) = (m.dot(x) as f32, m.dot(y) as f32);
        }
    }
}

/// Attributes anchored at a pixel. The default anchor serves no pixel.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Anchor {
    pub(crate) column: i32,
    pub(crate) row: i32,
    slopes: Slopes,
}

impl Default for Anchor {
    fn default() -> Self {
        Self { column: i32::MIN, row: 0, slopes: Slopes::default() }
    }
}

impl Anchor {
    /// Anchors the attributes at a pixel. A periodic attribute is brought between 0 and its period, and
    /// mirrored if needed. Returns `false` if the face is seen edge-on there, or if numbers are too large.
    pub(crate) fn set<const PANORAMA: bool>(
        &mut self,
        attributes: &Attributes,
        wraps: [TexelWrap; 3],
        grid: &RayGrid,
        i: usize,
        j: usize,
    ) -> bool {
        let e = grid.rays.at(i as u32, j as u32);
        let steps = grid.steps(i);
        self.put(Slopes::new::<PANORAMA>(attributes, wraps, e, steps), i, j)
    }

    #[inline(always)]
    fn put(&mut self, slopes: Slopes, i: usize, j: usize) -> bool {
        let Slopes { along, down, up, base, .. } = &slopes;
        let mut finite = true;
        for k in 0..4 {
            finite &= (along[k].abs() < f32::INFINITY) & (down[k].abs() < f32::INFINITY);
            finite &= up[k].abs() < f32::INFINITY;
        }
        for base in base {
            finite &= base.abs() < 1e6;
        }
        *self = Self { column: if finite { i as i32 } else { i32::MIN }, row: j as i32, slopes };
        finite
    }

    /// Tells whether the anchor serves the [`LANES`] pixels from a column on.
    #[inline(always)]
    pub(crate) fn reaches(&self, i: usize, j: usize) -> bool {
        (-REACH..=REACH - LANES as i32).contains(&(i as i32).wrapping_sub(self.column))
            && (j as i32 - self.row).abs() < REACH
    }

    /// Returns row `j` of pixels.
    #[inline(always)]
    pub(crate) fn line<'a, const PANORAMA: bool>(&'a self, grid: &'a RayGrid, j: usize) -> AnchoredRow<'a> {
        let (level, rise, cos, sin) = if PANORAMA {
            let ([cos, sin], [cos_e, sin_e]) = (grid.rows[j], grid.rows[self.row as usize]);
            ((cos - cos_e) as f32, (sin - sin_e) as f32, cos as f32, sin as f32)
        } else {
            ((j as i32 - self.row) as f32, 0.0, 1.0, 0.0)
        };
        let mut start = [0.0; 4];
        for (k, start) in start.iter_mut().enumerate() {
            *start = level * self.slopes.down[k];
            if PANORAMA {
                *start += rise * self.slopes.up[k];
            }
        }
        AnchoredRow { anchor: self, grid, start, cos, sin }
    }
}

/// Faces to be anchored together. Their values are stored by lane.
pub(crate) struct AnchorBatch {
    /// Coordinates by corner and axis.
    corners: [[[f64; LANES]; 3]; 3],
    /// Values by attribute and corner.
    values: [[[f64; LANES]; 3]; 3],
    /// Divisor, period and half by attribute.
    wraps: [[[f64; LANES]; 3]; 3],
    /// The direction of the anchor's ray, and the steps there.
    rays: [[[f64; LANES]; 3]; 3],
    at: [(usize, usize); LANES],
}

impl AnchorBatch {
    pub(crate) fn new() -> Self {
        let zeros = [[[0.0; LANES]; 3]; 3];
        Self { corners: zeros, values: zeros, wraps: zeros, rays: zeros, at: [(0, 0); LANES] }
    }

    /// Sets lane `k`: the corners, the values there as in [`Attributes::new`], and the pixel of the anchor.
    #[inline(always)]
    pub(crate) fn put(
        &mut self,
        k: usize,
        corners: [glam::Vec3; 3],
        values: [[f64; 3]; 3],
        wraps: [TexelWrap; 3],
        grid: &RayGrid,
        (i, j): (usize, usize),
    ) {
        let [x, y] = grid.steps(i);
        let rays = [grid.rays.at(i as u32, j as u32), x, y];
        for n in 0..3 {
            let TexelWrap { divisor, period, half } = wraps[n];
            let wrap = [divisor, period, half];
            let corner = corners[n].to_array();
            let ray = rays[n].to_array();
            for m in 0..3 {
                self.corners[n][m][k] = f64::from(corner[m]);
                self.values[n][m][k] = values[n][m];
                self.wraps[n][m][k] = wrap[m];
                self.rays[n][m][k] = ray[m];
            }
        }
        self.at[k] = (i, j);
    }

    /// Returns the anchors that [`Anchor::set`] makes of each lane, and a bound on how fast the first two
    /// attributes change. The bound is on the sum of the squares of their changes by a column and by a row,
    /// anywhere on the face; rounding cannot exceed it. It is infinite in a panorama.
    #[inline(always)]
    pub(crate) fn anchors<const PANORAMA: bool>(&self, origin: DVec3) -> ([Anchor; LANES], [f32; LANES]) {
        let mut fastest = [f32::INFINITY; LANES];
        let mut along = [[0.0f32; LANES]; 4];
        let (mut down, mut up) = (along, along);
        let mut base = [[0.0f32; LANES]; 3];
        let (mut min, mut max) = (base, base);

        // The arithmetic of one face, written so that the compiler vectorises it over faces.
        for k in 0..LANES {
            let point = |v: &[[f64; LANES]; 3]| DVec3::new(v[0][k], v[1][k], v[2][k]);
            let row = |v: &[[f64; LANES]; 3]| [v[0][k], v[1][k], v[2][k]];
            let world = [point(&self.corners[0]), point(&self.corners[1]), point(&self.corners[2])];
            let values = [row(&self.values[0]), row(&self.values[1]), row(&self.values[2])];
            let wrap = |n: usize| {
                let [divisor, period, half] = row(&self.wraps[n]);
                TexelWrap { divisor, period, half }
            };
            let [e, x, y] = [point(&self.rays[0]), point(&self.rays[1]), point(&self.rays[2])];
            let attributes = Attributes::new(&Patch::of(world, origin), values);
            let slopes = Slopes::new::<PANORAMA>(&attributes, [wrap(0), wrap(1), wrap(2)], e, [x, y]);

            for n in 0..4 {
                (along[n][k], down[n][k], up[n][k]) = (slopes.along[n], slopes.down[n], slopes.up[n]);
            }
            for n in 0..3 {
                (base[n][k], min[n][k], max[n][k]) = (slopes.base[n], slopes.min[n], slopes.max[n]);
            }
            if !PANORAMA {
                fastest[k] = attributes.fastest(world, origin, e, [x, y]) as f32;
            }
        }

        let mut anchors = [Anchor::default(); LANES];
        for (k, anchor) in anchors.iter_mut().enumerate() {
            let four = |v: &[[f32; LANES]; 4]| [v[0][k], v[1][k], v[2][k], v[3][k]];
            let three = |v: &[[f32; LANES]; 3]| [v[0][k], v[1][k], v[2][k]];
            let slopes = Slopes {
                along: four(&along),
                down: four(&down),
                up: four(&up),
                base: three(&base),
                min: three(&min),
                max: three(&max),
            };
            let (i, j) = self.at[k];
            anchor.put(slopes, i, j);
        }
        (anchors, fastest)
    }
}

/// A row of pixels near an anchor.
pub(crate) struct AnchoredRow<'a> {
    anchor: &'a Anchor,
    grid: &'a RayGrid,
    /// n and w − 1 in the anchor's column.
    start: [f32; 4],
    /// cos φ and sin φ of the row in a panorama.
    cos: f32,
    sin: f32,
}

/// The attributes of eight pixels.
#[derive(Clone, Copy)]
pub(crate) struct Interpolated<F, const N: usize> {
    pub(crate) values: [F; N],
    /// The change of each attribute by one column.
    pub(crate) x: [F; N],
    /// The change of each attribute by one row.
    pub(crate) y: [F; N],
    /// Bit k is set if pixel k is so much nearer or farther than the anchor that its values are not accurate
    /// enough.
    pub(crate) doubtful: u32,
}

impl AnchoredRow<'_> {
    /// Returns the first `N` attributes of the eight pixels from column `i` on.
    #[inline(always)]
    pub(crate) fn at<const PANORAMA: bool, const N: usize, L: ShadeLanes>(
        &self,
        lanes: L,
        i: usize,
    ) -> Interpolated<L::F, N> {
        let l = lanes;
        let Self { anchor, grid, start, cos, sin } = *self;
        let k = (i as i32 - anchor.column + REACH) as usize;
        let s = eight(l, &grid.sines, k);
        let v = if PANORAMA { eight(l, &grid.versines, k) } else { s };
        let cosine = l.sub(l.splat(1.0), v);

        // Loops instead of closures, which would not be compiled for the instructions of the lanes.
        let zero = l.splat(0.0);
        let (mut values, mut by_column, mut by_row) = ([zero; 4], [zero; 4], [zero; 4]);
        for n in 0..4 {
            if n >= N && n < 3 {
                continue;
            }
            let Slopes { along, down, up, .. } = &anchor.slopes;
            if PANORAMA {
                let change = l.sub(l.mul(l.splat(along[n] * cos), s), l.mul(l.splat(down[n] * cos), v));
                values[n] = l.add(l.splat(start[n]), change);
                let level = cos * grid.column_step;
                let rise = sin * grid.column_step;
                let (a, b) = (l.mul(l.splat(along[n] * level), cosine), l.mul(l.splat(down[n] * level), s));
                by_column[n] = l.sub(a, b);
                let (a, b) = (l.mul(l.splat(down[n] * rise), cosine), l.mul(l.splat(along[n] * rise), s));
                by_row[n] = l.sub(l.add(a, b), l.splat(up[n] * level));
            } else {
                values[n] = l.add(l.splat(start[n]), l.mul(l.splat(along[n]), s));
                (by_column[n], by_row[n]) = (l.splat(along[n]), l.splat(down[n]));
            }
        }

        let w = l.add(l.splat(1.0), values[3]);
        let near = l.greater(w, l.splat(1.0 / DEEP)) & l.greater(l.splat(DEEP), w);
        let scale = l.div(l.splat(1.0), w);
        let mut seen = Interpolated { values: [zero; N], x: [zero; N], y: [zero; N], doubtful: !near & 0xFF };

        for n in 0..N {
            let offset = l.mul(values[n], scale);
            let value = l.add(l.splat(anchor.slopes.base[n]), offset);
            seen.values[n] =
                l.min(l.max(value, l.splat(anchor.slopes.min[n])), l.splat(anchor.slopes.max[n]));
            seen.x[n] = l.mul(l.sub(by_column[n], l.mul(offset, by_column[3])), scale);
            seen.y[n] = l.mul(l.sub(by_row[n], l.mul(offset, by_row[3])), scale);
        }
        seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::shade_lanes::Plain;
    use proptest::prelude::*;
    use s3d_geom::{Camera, Pose, TriMesh};

    /// Compares the values of eight pixels, and their changes by column and by row, with exact results in
    /// `f64`.
    fn check<const PANORAMA: bool>(
        camera: &Camera,
        corners: [[f32; 3]; 3],
        values: [[f64; 3]; 3],
        at: [usize; 2],
        to: [usize; 2],
    ) {
        let mesh = TriMesh::from_faces(corners.map(glam::Vec3::from).to_vec(), vec![[0, 1, 2]]);
        let Ok(mesh) = mesh else { return };
        let patch = Patch::new(&mesh, 0, camera.pose.location);
        let mut attributes = Attributes::new(&patch, values);
        // The bounds are lifted, so that the plane is tested beyond the triangle, too.
        attributes.bounds = [(-1e9, 1e9); 3];

        let grid = RayGrid::new(camera);
        let mut anchor = Anchor::default();
        if !anchor.set::<PANORAMA>(&attributes, [TexelWrap::NONE; 3], &grid, at[0], at[1])
            || !anchor.reaches(to[0], to[1])
        {
            return;
        }

        let exact = |x: f64, y: f64, n: usize| {
            let d = camera.direction(x + 0.5, y + 0.5);
            attributes.numerator[n].dot(d) / attributes.denominator.dot(d)
        };
        let seen: Interpolated<_, 3> =
            anchor.line::<PANORAMA>(&grid, to[1]).at::<PANORAMA, 3, _>(Plain, to[0]);

        for k in 0..LANES {
            let x = (to[0] + k) as f64;
            let y = to[1] as f64;
            if seen.doubtful >> k & 1 == 1 || to[0] + k >= camera.width as usize {
                continue;
            }

            for n in 0..3 {
                let change = |x: f64, y: f64| {
                    let h = 1e-3;
                    let by_x = (exact(x + h, y, n) - exact(x - h, y, n)) / (2.0 * h);
                    let by_y = (exact(x, y + h, n) - exact(x, y - h, n)) / (2.0 * h);
                    (by_x, by_y)
                };
                let ((xx, xy), (ax, ay)) = (change(x, y), change(at[0] as f64, at[1] as f64));
                let footprint = [xx, xy, ax, ay].into_iter().fold(0.0, |m: f64, v| m.max(v.abs()));
                // All attributes share the same w, so the widest footprint bounds it.
                let value = exact(x, y, n);
                let bound = footprint / 500.0
                    + f64::from(f32::EPSILON) * (value.abs() + exact(at[0] as f64, at[1] as f64, n).abs());
                let off = (f64::from(seen.values[n][k]) - value).abs();
                assert!(
                    off <= bound,
                    "attribute {n} of ({x}, {y}) is {value}, off by {off:e}, bound {bound:e}"
                );

                for (got, want) in [(seen.x[n][k], xx), (seen.y[n][k], xy)] {
                    assert!((f64::from(got) - want).abs() <= 0.01 * footprint + 1e-9, "{got} for {want}");
                }
            }
        }
    }

    proptest! {
        #[test]
        fn faces_together_are_anchored_as_they_are_alone(
            corners in prop::array::uniform8(prop::array::uniform3(prop::array::uniform3(-5.0..5.0f32))),
            values in prop::array::uniform3(prop::array::uniform3(-9.0..9.0f64)),
            period in 0.5..4.0f64, panorama in prop::bool::ANY,
        ) {
            let pose = Pose::level(DVec3::new(0.3, -0.2, 0.1), 0.4);
            let perspective = Camera::perspective(pose, 1.2, 64, 32);
            let camera = if panorama { Camera::equirectangular(pose, 64) } else { perspective };

            let grid = RayGrid::new(&camera);
            let mut batch = AnchorBatch::new();
            let wraps = [TexelWrap::NONE, TexelWrap::repeat(period), TexelWrap::mirror(period)];
            for (k, corners) in corners.iter().enumerate() {
                batch.put(k, corners.map(glam::Vec3::from), values, wraps, &grid, (7 * k, 3 * k));
            }
            let at = pose.location;
            let (together, _) = if panorama { batch.anchors::<true>(at) } else { batch.anchors::<false>(at) };

            for (k, corners) in corners.iter().enumerate() {
                let world = corners.map(|p| glam::Vec3::from(p).as_dvec3());
                let attributes = Attributes::new(&Patch::of(world, pose.location), values);
                let mut alone = Anchor::default();
                if panorama {
                    alone.set::<true>(&attributes, wraps, &grid, 7 * k, 3 * k);
                } else {
                    alone.set::<false>(&attributes, wraps, &grid, 7 * k, 3 * k);
                }
                prop_assert_eq!(format!("{alone:?}"), format!("{:?}", together[k]));
            }
        }

        #[test]
        fn attributes_are_exact_to_a_part_of_the_footprint(
            corners in prop::array::uniform3(prop::array::uniform3(-4.0..4.0f32)),
            values in prop::array::uniform3(prop::array::uniform3(0.0..4096.0f64)),
            i in 0usize..400, j in 0usize..200, di in -64i32..64, dj in -63i32..64, yaw in 0.0..6.0f64,
        ) {
            let to = [(i as i32 + di).clamp(0, 399) as usize, (j as i32 + dj).clamp(0, 199) as usize];
            let pose = Pose::level(glam::dvec3(0.3, -0.2, 0.1), yaw);
            check::<false>(&Camera::perspective(pose, 1.2, 400, 200), corners, values, [i, j], to);
            check::<true>(&Camera::equirectangular(pose, 400), corners, values, [i, j], to);
        }

        #[test]
        fn wraps_bring_a_value_into_the_first_period(value in -1e6..1e6f64, period in 1.0..5000.0f64) {
            let (sign, shift) = TexelWrap::repeat(period).sign_and_shift(value);
            prop_assert!(sign == 1.0 && (-1e-6..=period).contains(&(value + shift)));
            prop_assert!((shift / period - (shift / period).round()).abs() < 1e-9);
            let (sign, shift) = TexelWrap::mirror(period).sign_and_shift(value);
            prop_assert!((-1e-6..=period).contains(&(sign * value + shift)), "{}", sign * value + shift);
            // The result is the same place of a texture that is mirrored at every period.
            prop_assert!((shift / (2.0 * period) - (shift / (2.0 * period)).round()).abs() < 1e-9);
        }
    }
}
