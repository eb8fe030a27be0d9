//! Fetches textures for eight pixels at a time.
//!
//! Gives the colours of [`crate::shade::mip_maps::MipMap::sample`] in integers. Positions between texels are
//! kept in 32768ths of a texel, and so are the weights of all texels of a colour; their products are added
//! without rounding. Before rounding to 8 bits, a colour from one bilinear sample is off by less than 0.03. A
//! colour from sixteen samples may be darker by 0.12, since the weights of samples are rounded down. The
//! samples of a footprint are whole 32768ths apart, so the last of eight is off by less than a 4000th of a
//! texel.

use crate::shade::anchor::Interpolated;
use crate::shade::texel_wrap::TexelWrap;
use crate::simd::shade_lanes::{LANES, ShadeLanes, Texels, eight, put};
use s3d_geom::{Raster, Texture, Wrap};

/// The positions of a row's pixels in their textures, and the sides x and y of their footprints: the change
/// from column to column and from row to row. Units are pixels of the full size. Indexed by column, with room
/// for two more groups.
#[derive(Debug, Default)]
pub(crate) struct Footprints {
    at: [Vec<f32>; 2],
    x: [Vec<f32>; 2],
    y: [Vec<f32>; 2],
}

impl Footprints {
    pub(crate) fn new(len: usize) -> Self {
        Self { at: two_lines(len), x: two_lines(len), y: two_lines(len) }
    }

    /// Stores the eight pixels from column `i` on. The sides are stored only if not all footprints are
    /// `narrow`.
    #[inline(always)]
    pub(crate) fn store<L: ShadeLanes>(
        &mut self,
        l: L,
        i: usize,
        seen: &Interpolated<L::F, 2>,
        narrow: bool,
    ) {
        for n in 0..2 {
            put(l, &mut self.at[n], i, seen.values[n]);
        }
        if !narrow {
            for n in 0..2 {
                put(l, &mut self.x[n], i, seen.x[n]);
                put(l, &mut self.y[n], i, seen.y[n]);
            }
        }
    }
}

fn two_lines(len: usize) -> [Vec<f32>; 2] {
    [vec![0.0; len], vec![0.0; len]]
}

/// How eight footprints are sampled.
struct Taps<F> {
    /// The level to sample: how often the full size is halved.
    level: F,
    /// The weight of each sample in that level, and in the next level, in −32768ths.
    weight: F,
    next_weight: F,
    /// The number of samples.
    count: F,
    /// The step from one sample to the next.
    step_x: F,
    step_y: F,
}

/// One level of a texture.
#[derive(Clone, Copy)]
struct MipLevel<'a> {
    image: &'a Raster<[u8; 3]>,
    texels: Texels<'a>,
    /// The last column and row, in 32768ths of a pixel.
    right: u32,
    bottom: u32,
    /// The size of this level relative to the full size.
    x: f32,
    y: f32,
}

/// The texels around eight positions, read one by one: see [`ShadeLanes::place`] and
/// [`ShadeLanes::quads_from`].
#[derive(Default)]
struct GatheredQuads {
    at: [i32; LANES],
    x: [i16; LANES],
    y: [i16; LANES],
    upper: [u64; LANES],
    lower: [u64; LANES],
}

/// Eight positions in a level that advance in steps. Position 0 is the middle of the first pixel.
struct TapWalk<L: ShadeLanes> {
    first: (L::F, L::F),
    step: (L::F, L::F),
    /// The current positions and the steps, in 32768ths.
    place: (L::I, L::I),
    fixed_step: (L::I, L::I),
}

impl<L: ShadeLanes> TapWalk<L> {
    #[inline(always)]
    fn at(l: L, first: (L::F, L::F), step: (L::F, L::F)) -> Self {
        let place = (l.fixed(first.0), l.fixed(first.1));
        let fixed_step = (l.fixed(step.0), l.fixed(step.1));
        Self { first, step, place, fixed_step }
    }

    /// Starts in one of the levels. Positions and steps are given in pixels of the full size.
    #[inline(always)]
    fn new(l: L, level: &MipLevel<'_>, first: (L::F, L::F), step: (L::F, L::F)) -> Self {
        let (x, y, half) = (l.splat(level.x), l.splat(level.y), l.splat(0.5));
        let first = (l.sub(l.mul(first.0, x), half), l.sub(l.mul(first.1, y), half));
        Self::at(l, first, (l.mul(step.0, x), l.mul(step.1, y)))
    }

    /// Takes a step.
    #[inline(always)]
    fn go_on(&mut self, l: L) {
        let place = self.place;
        let step = self.fixed_step;
        self.place = (l.add_fixed(place.0, step.0), l.add_fixed(place.1, step.1));
    }
}

/// A texture at all its levels.
pub(crate) struct MipLevels<'a> {
    wrap: [Wrap; 2],
    levels: Vec<MipLevel<'a>>,
}

impl<'a> MipLevels<'a> {
    pub(crate) fn new(full: &'a Texture, reductions: &'a [Raster<[u8; 3]>]) -> Self {
        Self {
            wrap: full.wrap,
            levels: std::iter::once(&full.image)
                .chain(reductions)
                .map(|image| MipLevel {
                    image,
                    texels: Texels::new(image.pixels().as_flattened(), image.width() as i32 * 3),
                    right: last_place(image.width()),
                    bottom: last_place(image.height()),
                    x: ratio(image.width(), full.image.width()),
                    y: ratio(image.height(), full.image.height()),
                })
                .collect(),
        }
    }

    /// Tells whether positions in the texture fit in the numbers used here.
    pub(crate) fn is_usable(&self) -> bool {
        let image = self.levels[0].image;
        !image.is_empty()
            && image.width().max(image.height()) < 1 << 15
            && 3 * image.len() < i32::MAX as usize
    }

    /// Returns how coordinates in pixels of the full size repeat.
    pub(crate) fn wraps(&self) -> [TexelWrap; 3] {
        let image = self.levels[0].image;
        [texel_wrap(self.wrap[0], image.width()), texel_wrap(self.wrap[1], image.height()), TexelWrap::NONE]
    }

    /// Returns the colours of the eight pixels from `i` on, from at most `most` samples each. Only pixels in
    /// `these` count. Pixels in `these` but not in `maybe` have narrow footprints.
    #[inline(always)]
    pub(crate) fn colors<L: ShadeLanes>(
        &self,
        l: L,
        footprints: &Footprints,
        i: usize,
        these_and_maybe: (u32, u32),
        most: u32,
    ) -> [u32; LANES] {
        l.pixels(self.sums(l, footprints, i, these_and_maybe, most))
    }

    /// Returns the same colours as [`MipLevels::colors`], as sums that are not rounded.
    #[inline(always)]
    pub(crate) fn sums<L: ShadeLanes>(
        &self,
        l: L,
        footprints: &Footprints,
        i: usize,
        (these, maybe): (u32, u32),
        most: u32,
    ) -> L::ColorSum {
        let [x, y] = pair(l, &footprints.at, i);
        let taps = if maybe == 0 {
            None
        } else {
            self.taps(l, footprints, i, maybe, most)
        };
        match taps {
            None => self.magnified(l, x, y, these),
            Some(taps) => self.filtered(l, x, y, &taps, these),
        }
    }

    /// Returns how the footprints in `maybe` are sampled; `None` if none of them is wide.
    #[inline(always)]
    fn taps<L: ShadeLanes>(
        &self,
        l: L,
        footprints: &Footprints,
        i: usize,
        maybe: u32,
        most: u32,
    ) -> Option<Taps<L::F>> {
        let ([xx, xy], [yx, yy]) = (pair(l, &footprints.x, i), pair(l, &footprints.y, i));
        let a = l.add(l.mul(xx, xx), l.mul(yx, yx));
        let c = l.add(l.mul(xy, xy), l.mul(yy, yy));
        let sum = l.add(a, c);
        let maybe = l.greater(sum, l.splat(1.0)) & l.greater(l.splat(f32::INFINITY), sum) & maybe;
        if maybe == 0 {
            return None;
        }

        // The same formulas as in `taps` and `axes` of mip_maps.rs.
        let (zero, half_of, one) = (l.splat(0.0), l.splat(0.5), l.splat(1.0));
        let b = l.add(l.mul(xx, xy), l.mul(yx, yy));
        let (mean, half) = (l.mul(half_of, sum), l.mul(half_of, l.sub(a, c)));
        let root = l.sqrt(l.add(l.mul(half, half), l.mul(b, b)));
        let long = l.sqrt(l.add(mean, root));
        let axis_x = l.select_by_sign(half, b, l.add(root, half));
        let axis_y = l.select_by_sign(half, l.sub(root, half), b);

        // The factor that gives the axis its length. A round footprint has no axis, and one sample.
        let length_2 = l.add(l.mul(axis_x, axis_x), l.mul(axis_y, axis_y));
        let stretch = l.sqrt(l.div(l.add(mean, root), l.max(length_2, l.splat(1e-30))));
        let cross = l.sub(l.mul(xx, yy), l.mul(xy, yx));
        let minor = l.div(l.max(cross, l.sub(zero, cross)), long);

        let most = most.max(1) as f32;
        let width = l.max(l.max(minor, l.mul(long, l.splat(1.0 / most))), one);
        let count = l.min(l.max(l.add(l.div(long, width), half_of), one), l.splat(most));
        let count = l.truncate(count);

        let wide = maybe & (l.greater(width, one) | l.greater(count, one));
        if wide == 0 {
            return None;
        }

        let part = l.div(one, count);
        let step = l.mul(stretch, part);
        let (level, fraction) = self.level_of(l, width);
        let share = l.mul(l.splat(-32768.0), part);
        let next_weight = l.mul(share, fraction);

        Some(Taps {
            level: l.select(wide, level, zero),
            weight: l.select(wide, l.sub(share, next_weight), l.splat(-32768.0)),
            next_weight: l.select(wide, next_weight, zero),
            count: l.select(wide, count, one),
            step_x: l.select(wide, l.mul(axis_x, step), zero),
            step_y: l.select(wide, l.mul(axis_y, step), zero),
        })
    }

    /// Returns the colours over round footprints at the positions in `these`: one trilinear sample each, not
    /// rounded.
    #[inline(always)]
    pub(crate) fn round_sums<L: ShadeLanes>(
        &self,
        l: L,
        (x, y): (L::F, L::F),
        width: L::F,
        these: u32,
    ) -> L::ColorSum {
        let (zero, one, all) = (l.splat(0.0), l.splat(1.0), l.splat(-32768.0));
        if l.greater(width, one) & these == 0 {
            return self.magnified(l, x, y, these);
        }
        let (level, fraction) = self.level_of(l, l.max(width, one));
        let next_weight = l.mul(all, fraction);
        let weight = l.sub(all, next_weight);
        self.filtered(
            l,
            x,
            y,
            &Taps { level, weight, next_weight, count: one, step_x: zero, step_y: zero },
            these,
        )
    }

    /// Returns the level in which samples of a width of at least 1 are taken, and the share of the next
    /// level.
    #[inline(always)]
    fn level_of<L: ShadeLanes>(&self, l: L, width: L::F) -> (L::F, L::F) {
        let (level, fraction) = l.log2(width);
        // Beyond the last level, the last one is used.
        let last = l.splat((self.levels.len() - 1) as f32);
        (l.min(level, last), l.select_by_sign(l.sub(level, last), fraction, l.splat(0.0)))
    }

    #[inline(always)]
    fn magnified<L: ShadeLanes>(&self, l: L, x: L::F, y: L::F, these: u32) -> L::ColorSum {
        let level = &self.levels[0];
        let half = l.splat(0.5);
        let zero = l.splat(0.0);
        let walk = TapWalk::at(l, (l.sub(x, half), l.sub(y, half)), (zero, zero));
        self.add(l, l.zero_sum(), level, &walk, zero, l.full_weights(), these)
    }

    #[inline(always)]
    fn filtered<L: ShadeLanes>(&self, l: L, x: L::F, y: L::F, taps: &Taps<L::F>, these: u32) -> L::ColorSum {
        let Taps { level, weight, next_weight, count, step_x, step_y } = *taps;
        let (zero, half, one) = (l.splat(0.0), l.splat(0.5), l.splat(1.0));
        let middle = l.mul(half, l.sub(count, one));
        let first = (l.sub(x, l.mul(middle, step_x)), l.sub(y, l.mul(middle, step_y)));
        let step = (step_x, step_y);

        let mut sum = l.zero_sum();
        let mut levels = [0.0; LANES];
        l.store(level, &mut levels);
        let at = levels[these.trailing_zeros() as usize % LANES];
        let same = l.splat(at);
        if (l.greater(level, same) | l.greater(same, level)) & these == 0
            && l.greater(l.splat(-1.0), next_weight) & these != 0
            && let Some([this, next]) = self.levels.get(at as usize..).and_then(<[_]>::first_chunk)
        {
            // Usually all pixels need the same two levels. Both are sampled in one loop, since the length of
            // a loop is unpredictable.
            let (mut a, mut b) = (TapWalk::new(l, this, first, step), TapWalk::new(l, next, first, step));
            let (weights, next_weights) = (l.weights(weight), l.weights(next_weight));
            let (mut active, mut tap) = (these, zero);
            while active != 0 {
                sum = self.add(l, sum, this, &a, tap, l.masked(active, weights), active);
                sum = self.add(l, sum, next, &b, tap, l.masked(active, next_weights), active);
                a.go_on(l);
                b.go_on(l);
                tap = l.add(tap, one);
                active &= l.greater(count, tap);
            }
            return sum;
        }

        // Otherwise level after level, each for the pixels that need it.
        let mut left = these;
        let mut at = zero;
        for level_here in &self.levels {
            let here = left & !l.greater(level, at);
            // A weight below one part counts as none.
            let weights = l.select_by_sign(l.sub(level, at), next_weight, weight);
            let mut active = here & l.greater(l.splat(-1.0), weights);
            let (weights, mut walk, mut tap) =
                (l.weights(weights), TapWalk::new(l, level_here, first, step), zero);
            while active != 0 {
                sum = self.add(l, sum, level_here, &walk, tap, l.masked(active, weights), active);
                walk.go_on(l);
                tap = l.add(tap, one);
                active &= l.greater(count, tap);
            }
            left &= !l.greater(at, level);
            if left == 0 {
                break;
            }
            at = l.add(at, one);
        }
        sum
    }

    /// Adds the weighted bilinear colours at the positions in `these` to `sum`, after `tap` steps of the
    /// walk.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "all of them in registers")]
    fn add<L: ShadeLanes>(
        &self,
        l: L,
        sum: L::ColorSum,
        level: &MipLevel<'a>,
        walk: &TapWalk<L>,
        tap: L::F,
        weights: L::Weights,
        these: u32,
    ) -> L::ColorSum {
        let (x, y) = walk.place;
        let inside = l.within(x, level.right) & l.within(y, level.bottom);
        let (at, parts) = l.place(x, y, level.texels.stride(), these);
        if inside & these == these
            && let Some(quads) = l.quads(&level.texels, at)
        {
            return l.add_weighted(sum, quads, l.corners(parts, weights));
        }

        // Near an edge of the image, or beyond it.
        let (mut xs, mut ys) = ([0.0; LANES], [0.0; LANES]);
        l.store(l.add(walk.first.0, l.mul(tap, walk.step.0)), &mut xs);
        l.store(l.add(walk.first.1, l.mul(tap, walk.step.1)), &mut ys);

        let mut places = GatheredQuads::default();
        l.store_fixed(at, &mut places.at);
        l.store_parts(parts, &mut places.x, &mut places.y);
        self.read_singly(level, &xs, &ys, inside, these, &mut places);
        let corners = l.corners(l.parts(&places.x, &places.y), weights);
        l.add_weighted(sum, l.quads_from(&places.upper, &places.lower), corners)
    }

    /// Reads the texels at the positions in `these`. Positions that are also in `inside` are not at the
    /// image's edge.
    #[cold]
    #[inline(never)]
    fn read_singly(
        &self,
        level: &MipLevel<'a>,
        xs: &[f32; LANES],
        ys: &[f32; LANES],
        inside: u32,
        these: u32,
        places: &mut GatheredQuads,
    ) {
        for k in 0..LANES {
            if these >> k & 1 == 0 {
                continue;
            }
            let begin = places.at[k] as usize;
            let below = begin.wrapping_add(level.texels.stride() as usize);
            match (word(level.texels.bytes(), begin), word(level.texels.bytes(), below)) {
                (Some(a), Some(b)) if inside >> k & 1 == 1 => (places.upper[k], places.lower[k]) = (a, b),
                _ => {
                    let quad = self.at_the_edge(level, xs[k], ys[k]);
                    ((places.upper[k], places.lower[k]), (places.x[k], places.y[k])) = quad;
                }
            }
        }
    }

    /// Returns the 2 × 2 texels around a position at the edge, where some are not side by side, and the
    /// fractions of the position.
    fn at_the_edge(&self, level: &MipLevel<'a>, x: f32, y: f32) -> ((u64, u64), (i16, i16)) {
        let image = level.image;
        let ((column, x), (row, y)) = (split(x), split(y));
        let columns = [column, column + 1].map(|i| self.wrap[0].index(i, image.width()));
        // v grows upwards and rows downwards, but mirroring and repeating look the same from both sides.
        let rows = [row, row + 1].map(|j| self.wrap[1].index(j, image.height()));
        let pair = |j: u32| {
            let ([a, b, c], [d, e, f]) = (image.at(columns[0], j), image.at(columns[1], j));
            u64::from_le_bytes([a, b, c, d, e, f, 0, 0])
        };
        ((pair(rows[0]), pair(rows[1])), (x, y))
    }
}

fn ratio(a: u32, b: u32) -> f32 {
    (f64::from(a) / f64::from(b)) as f32
}

/// Returns the place of the last texel, in the units of fixed places. Larger levels are not used: see
/// `is_usable`.
fn last_place(size: u32) -> u32 {
    (size.clamp(1, 1 << 15) - 1) << 15
}

fn texel_wrap(wrap: Wrap, size: u32) -> TexelWrap {
    match wrap {
        Wrap::Repeat => TexelWrap::repeat(f64::from(size)),
        Wrap::Mirror => TexelWrap::mirror(f64::from(size)),
        Wrap::Clamp => TexelWrap::NONE,
    }
}

fn split(v: f32) -> (i64, i16) {
    let v = if v.is_finite() { f64::from(v) } else { 0.0 };
    (v.floor() as i64, ((v - v.floor()) * 32768.0) as i16)
}

/// Returns the eight bytes at `at`, if there are so many.
#[inline(always)]
fn word(bytes: &[u8], at: usize) -> Option<u64> {
    bytes.get(at..)?.first_chunk().map(|b| u64::from_le_bytes(*b))
}

/// Loads eight values from each of two lists. It is no closure: see [`crate::simd`].
#[inline(always)]
fn pair<L: ShadeLanes>(l: L, of: &[Vec<f32>; 2], i: usize) -> [L::F; 2] {
    [eight(l, &of[0], i), eight(l, &of[1], i)]
}
