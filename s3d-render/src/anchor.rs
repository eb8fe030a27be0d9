//! Attributes over a face, eight pixels at a time.
//!
//! An attribute (a texture coordinate, a channel of the colour) is a ratio a(d) = (α·d) / (ω·d) of linear functions of
//! the ray's direction d (see [`crate::patch`]). Taken in `f64` a pixel, that is most of an image's time; taken in `f32`,
//! the numerator loses the digits that count. So it is anchored at a pixel of the face with the direction e, where the
//! attribute is a₀ = a(e), once in `f64`:
//!
//! ```text
//! a(d) = a₀ + n(d) / w(d),   n(d) = (α − a₀ω)·(d − e) / ω·e,   w(d) = 1 + ω·(d − e) / ω·e
//! ```
//!
//! Both n and what is added to 1 are linear in d − e and small near the anchor, so nothing cancels. Along a row d − e is
//! made of two functions of the column's offset k from the anchor alone: in a perspective view of k itself; in a
//! panorama, with the turn δ from column to column, of sin kδ and 1 − cos kδ.
//!
//! Error: an anchor serves pixels that are at most [`REACH`] columns and rows away and whose w is within 1/[`DEEP`] to
//! [`DEEP`]. n and w each go through fewer than 8 roundings of 2⁻²⁴ relative to the pixels between; with f what one pixel
//! more adds to the attribute, here or at the anchor, the quotient is off by less than
//! 16 · 2⁻²⁴ · 2 [`REACH`] · [`DEEP`] · f < f / 500, and below f / 8000 where w hardly varies, as it mostly does in 64
//! pixels. The sum with a₀ is rounded by 2⁻²⁴ of itself: a 4000th of a pixel in a texture of 4096.

use crate::lanes::{LANES, Lanes, eight};
use crate::patch::Patch;
use glam::DVec3;
use s3d_geom::{Camera, Rays};

/// How far from its anchor a pixel may be, in columns and in rows.
pub(crate) const REACH: i32 = 64;
/// How many times nearer or farther than its anchor a pixel may be.
pub(crate) const DEEP: f32 = 16.0;

/// Up to three attributes of a face.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Attributes {
    /// α of each.
    pub(crate) above: [DVec3; 3],
    /// ω.
    pub(crate) whole: DVec3,
    /// Between what bounds each is: what rounding throws outside is brought back.
    pub(crate) bounds: [(f64, f64); 3],
}

impl Attributes {
    /// From the values at the face's corners: `values[k]` are attribute k's.
    pub(crate) fn new(patch: &Patch, values: [[f64; 3]; 3]) -> Self {
        let above =
            values.map(|at| (0..3).map(|corner| patch.weights_of_corners()[corner] * at[corner]).sum());
        let bounds = values.map(|[a, b, c]| (a.min(b).min(c), a.max(b).max(c)));
        Self { above, whole: patch.whole(), bounds }
    }
}

/// The directions of an image's pixels, for anchors.
pub(crate) struct Grid {
    rays: Rays,
    /// In a panorama δ, else 1.
    turn: f32,
    /// In a panorama the rows' cosines and sines of latitude.
    rows: Vec<[f64; 2]>,
    /// By column offset + [`REACH`]: sin kδ, or k.
    sines: [f32; 2 * REACH as usize + LANES],
    /// 1 − cos kδ, or 0.
    versines: [f32; 2 * REACH as usize + LANES],
}

impl Grid {
    pub(crate) fn new(camera: &Camera) -> Self {
        let rays = camera.rays();
        let offset = |at: usize| at as f64 - f64::from(REACH);
        let (turn, rows) = match &rays {
            Rays::Perspective { .. } => (None, vec![]),
            Rays::Equirectangular { rows, .. } => (
                Some(std::f64::consts::TAU / f64::from(camera.width)),
                rows.iter().map(|row| [row.x, row.y]).collect(),
            ),
        };
        // 1 − cos a = 2 sin² a/2, without cancellation.
        let versine = |a: f64| 2.0 * libm_sin(0.5 * a) * libm_sin(0.5 * a);
        Self {
            rays,
            turn: turn.unwrap_or(1.0) as f32,
            rows,
            sines: std::array::from_fn(|k| turn.map_or(offset(k), |t| libm_sin(offset(k) * t)) as f32),
            versines: std::array::from_fn(|k| turn.map_or(0.0, |t| versine(offset(k) * t)) as f32),
        }
    }

    /// Whether it is a panorama's.
    pub(crate) fn is_turn(&self) -> bool {
        !self.rows.is_empty()
    }

    pub(crate) fn direction(&self, i: usize, j: usize) -> DVec3 {
        self.rays.at(i as u32, j as u32)
    }
}

/// As glam's, which is the same on every platform.
fn libm_sin(a: f64) -> f64 {
    glam::DVec2::from_angle(a).y
}

/// Linear functions of d − e, n of the three attributes and w: in a perspective view `along` · columns + `down` · rows.
/// In a panorama, with c(k) the unit vector of the column's azimuth, `along` what c(0) turns towards, `down` along c(0),
/// and `up` upwards.
#[derive(Clone, Copy, Debug, Default)]
struct Slopes {
    along: [f32; 4],
    down: [f32; 4],
    up: [f32; 4],
}

/// Attributes anchored at a pixel; by default nowhere.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Anchor {
    pub(crate) column: i32,
    pub(crate) row: i32,
    slopes: Slopes,
    base: [f32; 3],
    least: [f32; 3],
    most: [f32; 3],
}

impl Default for Anchor {
    fn default() -> Self {
        Self {
            column: i32::MIN,
            row: 0,
            slopes: Slopes::default(),
            base: [0.0; 3],
            least: [0.0; 3],
            most: [0.0; 3],
        }
    }
}

impl Anchor {
    /// Anchors the attributes at a pixel, the values folded: an attribute with a period is brought between 0 and it,
    /// mirrored for [`Fold::Mirror`]. `false` if the face is seen edge-on there, or numbers are too large.
    pub(crate) fn set(
        &mut self,
        attributes: &Attributes,
        folds: [Fold; 3],
        grid: &Grid,
        i: usize,
        j: usize,
    ) -> bool {
        let e = grid.direction(i, j);
        let scale = attributes.whole.dot(e).recip();
        let slope = |slopes: &mut Slopes, k: usize, m: DVec3| {
            let [along, down, up] = match &grid.rays {
                Rays::Perspective { x_step, y_step, .. } => [m.dot(*x_step), m.dot(*y_step), 0.0],
                Rays::Equirectangular { columns, .. } => {
                    let c = columns[i];
                    // Azimuth falls to the right.
                    [m.x * c.y - m.y * c.x, m.x * c.x + m.y * c.y, m.z]
                }
            };
            (slopes.along[k], slopes.down[k], slopes.up[k]) = (along as f32, down as f32, up as f32);
        };
        (self.column, self.row) = (i as i32, j as i32);
        slope(&mut self.slopes, 3, attributes.whole * scale);
        for (k, fold) in folds.into_iter().enumerate() {
            let (least, most) = attributes.bounds[k];
            let value = (attributes.above[k].dot(e) * scale).max(least).min(most);
            let m = (attributes.above[k] - attributes.whole * value) * scale;
            let (sign, shift) = fold.of(value);
            slope(&mut self.slopes, k, m * sign);
            let fold = |v: f64| (v * sign + shift) as f32;
            (self.base[k], self.least[k], self.most[k]) = (fold(value), fold(least), fold(most));
            if sign < 0.0 {
                (self.least[k], self.most[k]) = (self.most[k], self.least[k]);
            }
        }
        let Slopes { along, down, up } = self.slopes;
        let finite = [along, down, up].as_flattened().iter().all(|s| s.is_finite())
            && self.base.iter().all(|b| b.abs() < 1e6);
        if !finite {
            self.column = i32::MIN;
        }
        finite
    }

    /// Whether the anchor serves a pixel.
    #[inline(always)]
    pub(crate) fn reaches(&self, i: usize, j: usize) -> bool {
        (-REACH..REACH).contains(&(i as i32).wrapping_sub(self.column)) && (j as i32 - self.row).abs() < REACH
    }

    /// The row `j` of pixels.
    #[inline(always)]
    pub(crate) fn line<'a, const TURN: bool>(&'a self, grid: &'a Grid, j: usize) -> Line<'a> {
        let (level, rise, cos, sin) = if TURN {
            let ([cos, sin], [cos_e, sin_e]) = (grid.rows[j], grid.rows[self.row as usize]);
            ((cos - cos_e) as f32, (sin - sin_e) as f32, cos as f32, sin as f32)
        } else {
            ((j as i32 - self.row) as f32, 0.0, 1.0, 0.0)
        };
        let mut start = [0.0; 4];
        for (k, start) in start.iter_mut().enumerate() {
            *start = level * self.slopes.down[k];
            if TURN {
                *start += rise * self.slopes.up[k];
            }
        }
        Line { anchor: self, grid, start, cos, sin }
    }
}

/// How an attribute repeats.
#[derive(Clone, Copy, Debug)]
pub(crate) enum Fold {
    Not,
    Repeat(f64),
    Mirror(f64),
}

impl Fold {
    /// The sign and the shift that bring `value` between 0 and the period.
    fn of(self, value: f64) -> (f64, f64) {
        match self {
            Fold::Not => (1.0, 0.0),
            Fold::Repeat(period) => (1.0, -(value / period).floor() * period),
            Fold::Mirror(period) => {
                let turn = (value / (2.0 * period)).floor() * 2.0 * period;
                if value - turn > period { (-1.0, turn + 2.0 * period) } else { (1.0, -turn) }
            }
        }
    }
}

/// A row of pixels near an anchor.
pub(crate) struct Line<'a> {
    anchor: &'a Anchor,
    grid: &'a Grid,
    /// n and w − 1 in the anchor's column.
    start: [f32; 4],
    /// In a panorama the row's.
    cos: f32,
    sin: f32,
}

/// Attributes of eight pixels.
#[derive(Clone, Copy)]
pub(crate) struct Seen<F, const N: usize> {
    pub(crate) values: [F; N],
    /// What a column more adds to each.
    pub(crate) x: [F; N],
    /// What a row more adds to each.
    pub(crate) y: [F; N],
    /// Bit k: whether pixel k is so much nearer or farther than the anchor that its values are not exact enough.
    pub(crate) doubtful: u32,
}

impl Line<'_> {
    /// The first `N` attributes of the eight pixels from column `i` on.
    #[inline(always)]
    pub(crate) fn at<const TURN: bool, const N: usize, L: Lanes>(&self, lanes: L, i: usize) -> Seen<L::F, N> {
        let l = lanes;
        let Self { anchor, grid, start, cos, sin } = *self;
        let k = (i as i32 - anchor.column + REACH) as usize;
        let s = eight(l, &grid.sines, k);
        let v = if TURN { eight(l, &grid.versines, k) } else { s };
        let cosine = l.sub(l.splat(1.0), v);
        // Loops and no closures: those would not be compiled for the lanes' instructions.
        let zero = l.splat(0.0);
        let (mut values, mut by_column, mut by_row) = ([zero; 4], [zero; 4], [zero; 4]);
        for n in 0..4 {
            if n >= N && n < 3 {
                continue;
            }
            let Slopes { along, down, up } = &anchor.slopes;
            if TURN {
                let change = l.sub(l.mul(l.splat(along[n] * cos), s), l.mul(l.splat(down[n] * cos), v));
                values[n] = l.add(l.splat(start[n]), change);
                let (level, rise) = (cos * grid.turn, sin * grid.turn);
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
        let mut seen = Seen { values: [zero; N], x: [zero; N], y: [zero; N], doubtful: !near & 0xFF };
        for n in 0..N {
            let offset = l.mul(values[n], scale);
            let value = l.add(l.splat(anchor.base[n]), offset);
            seen.values[n] = l.min(l.max(value, l.splat(anchor.least[n])), l.splat(anchor.most[n]));
            seen.x[n] = l.mul(l.sub(by_column[n], l.mul(offset, by_column[3])), scale);
            seen.y[n] = l.mul(l.sub(by_row[n], l.mul(offset, by_row[3])), scale);
        }
        seen
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::lanes::Plain;
    use proptest::prelude::*;
    use s3d_geom::{Pose, TriMesh};

    /// What eight pixels get, and what is exact in `f64`: values, change by column and by row.
    fn check<const TURN: bool>(
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
        // No bounds: the plane is tested beyond the triangle, too.
        attributes.bounds = [(-1e9, 1e9); 3];
        let (grid, mut anchor) = (Grid::new(camera), Anchor::default());
        if !anchor.set(&attributes, [Fold::Not; 3], &grid, at[0], at[1]) || !anchor.reaches(to[0], to[1]) {
            return;
        }
        let exact = |x: f64, y: f64, n: usize| {
            let d = camera.direction(x + 0.5, y + 0.5);
            attributes.above[n].dot(d) / attributes.whole.dot(d)
        };
        let seen: Seen<_, 3> = anchor.line::<TURN>(&grid, to[1]).at::<TURN, 3, _>(Plain, to[0]);
        for k in 0..LANES {
            let (x, y) = ((to[0] + k) as f64, to[1] as f64);
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
                // All attributes go through the same w: the widest footprint bounds it.
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
        fn folds_bring_a_value_into_the_first_period(value in -1e6..1e6f64, period in 1.0..5000.0f64) {
            let (sign, shift) = Fold::Repeat(period).of(value);
            prop_assert!(sign == 1.0 && (-1e-6..=period).contains(&(value + shift)));
            prop_assert!((shift / period - (shift / period).round()).abs() < 1e-9);
            let (sign, shift) = Fold::Mirror(period).of(value);
            prop_assert!((-1e-6..=period).contains(&(sign * value + shift)), "{}", sign * value + shift);
            // The same place of a texture that is mirrored at every period.
            prop_assert!((shift / (2.0 * period) - (shift / (2.0 * period)).round()).abs() < 1e-9);
        }
    }
}
