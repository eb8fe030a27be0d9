//! Blends captures into a band of a cube map, eight pixels of a row at a time.
//!
//! The band is cut into tiles of [`TILE`] columns. The angle between the middle of a tile and the axis of a
//! capture tells whether the capture may see the tile. Each pixel of the tile is then projected into each
//! such capture in `f32`: in a picture of 1,280 pixels, the error is less than a 1000th of a pixel. The
//! weighted colours are added in the order of the captures. `Stitch::pixel_by_pixel` does the same in `f64`.

use crate::picture::cube_map::{BAND, Band, axes_of, place_of};
use crate::shade::filter::MipLevels;
use crate::simd::shade_lanes::{LANES, ShadeLanes, eight, packed, put};
use crate::simd::{Kernel, Simd};
use glam::{DMat3, DVec3};
use s3d_geom::{Lens, Raster};

/// The number of columns in a tile.
const TILE: usize = 64;

/// The surfaces in front of a capture, as seen by a camera with the capture's axes.
pub(crate) struct DepthLimits {
    /// How deep a visible point between four neighbouring pixels may be, indexed by the upper left one.
    pub(crate) limits: Raster<f32>,
    /// The focal length of that camera in its pixels.
    pub(crate) focal: f32,
}

/// A capture as a tile needs it.
pub(crate) struct LaneCapture<'a> {
    pub(crate) levels: MipLevels<'a>,
    pub(crate) lens: &'a Lens,
    /// The cube's frame → the camera's OpenCV axes.
    pub(crate) turn: DMat3,
    /// From the camera to the cube's centre, in the camera's axes.
    pub(crate) center: DVec3,
    /// The tangent of the largest angle from the axis at which the camera sees anything.
    pub(crate) reach: f64,
    pub(crate) limits: Option<&'a DepthLimits>,
    /// The factors of its colours.
    pub(crate) gain: [f32; 3],
}

impl LaneCapture<'_> {
    /// Tells whether the lanes suit the capture: places in its picture fit the numbers, and its pixels are
    /// nearly square, so that one sample covers the part of the picture that a pixel of the cube sees.
    pub(crate) fn is_usable(&self) -> bool {
        let focal = self.lens.focal_px();
        self.levels.is_usable() && focal.max_element() < 1.5 * focal.min_element()
    }

    /// Tells whether the capture may see a part of a tile. The middle of the tile is `direction`, of length 1
    /// in the cube's frame; its pixels are up to `angle` from the middle, and its points are at least 1 /
    /// `inverse_depth` away.
    fn may_see(&self, direction: DVec3, angle: f64, inverse_depth: f64) -> bool {
        let off_axis = libm::acos((self.turn * direction).z.clamp(-1.0, 1.0));
        let parallax = libm::asin((self.center.length() * inverse_depth).min(1.0));
        // The margin is much larger than rounding errors.
        off_axis <= libm::atan(self.reach) + angle + parallax + 1e-5
    }
}

/// Blends the captures that see the pixels of a band.
pub(crate) struct BlendKernel<'a> {
    pub(crate) captures: &'a [LaneCapture<'a>],
    /// The size of the cube's faces, without their borders.
    pub(crate) size: u32,
    /// The depth of the scene behind each pixel of the face with its border, infinite where there is none.
    pub(crate) depths: Option<&'a Raster<f32>>,
    pub(crate) band: Band<'a>,
}

/// Some columns of a band.
struct Tile {
    first: usize,
    /// The number of columns, without those that pad the last eight.
    columns: usize,
    rows: usize,
    /// 1 over the depth behind each pixel, by row and column; 0 if there is none.
    inverse_depths: [[f32; TILE]; BAND as usize],
    /// The position of each column on the face's plane.
    places: [f32; TILE],
}

/// The weighted sums over captures for the pixels of a tile's row.
struct Sums {
    colors: [[f32; TILE]; 3],
    weights: [f32; TILE],
    /// The widths of the pixels, as the tangent of an angle.
    angles: [f32; TILE],
}

impl Kernel for BlendKernel<'_> {
    type Output = ();

    #[inline(always)]
    fn run<S: Simd>(mut self, simd: S) {
        let l = simd.shade();
        let mut near = Vec::with_capacity(self.captures.len());
        for first in (0..self.band.width).step_by(TILE) {
            let (tile, nearest) = self.tile(first);
            near.clear();
            self.captures_of(&tile, nearest, &mut near);
            if near.is_empty() {
                continue;
            }
            for row in 0..tile.rows {
                self.row(l, &tile, row, &near);
            }
        }
    }
}

impl BlendKernel<'_> {
    /// Returns the tile from column `first` on, and the largest of its inverse depths.
    fn tile(&self, first: usize) -> (Tile, f32) {
        let columns = TILE.min(self.band.width - first);
        let rows = self.band.colors.len() / self.band.width;
        let mut tile = Tile {
            first,
            columns,
            rows,
            inverse_depths: [[0.0; TILE]; BAND as usize],
            places: std::array::from_fn(|k| place_of(self.size, (first + k) as u32) as f32),
        };
        let mut nearest = 0.0f32;
        if let Some(depths) = self.depths {
            for (y, inverse) in (self.band.first_row..).zip(&mut tile.inverse_depths[..rows]) {
                let depths = &depths.row(y)[first..first + columns];
                for (inverse, depth) in inverse.iter_mut().zip(depths) {
                    *inverse = 1.0 / depth;
                    nearest = nearest.max(*inverse);
                }
            }
        }
        (tile, nearest)
    }

    /// Adds the numbers of the captures that may see a part of a tile.
    fn captures_of(&self, tile: &Tile, nearest: f32, near: &mut Vec<usize>) {
        let [right, down, forward] = axes_of(self.band.face);
        let at = |x: usize, y: usize| {
            let [x, y] = [tile.first + x, self.band.first_row as usize + y];
            let [x, y] = [x, y].map(|i| place_of(self.size, i as u32));
            (right * x + down * y + forward).normalize()
        };
        let last_x = tile.columns - 1;
        let last_y = tile.rows - 1;
        let middle = at(last_x / 2, last_y / 2);
        let corners = [at(0, 0), at(last_x, 0), at(0, last_y), at(last_x, last_y)];
        let least = corners.map(|corner| middle.dot(corner)).into_iter().fold(1.0, f64::min);
        let angle = libm::acos(least);
        near.extend(
            (0..self.captures.len()).filter(|k| self.captures[*k].may_see(middle, angle, f64::from(nearest))),
        );
    }

    /// Blends the captures `near` into a row of a tile.
    #[inline(always)]
    fn row<L: ShadeLanes>(&mut self, l: L, tile: &Tile, row: usize, near: &[usize]) {
        let y = place_of(self.size, self.band.first_row + row as u32);
        let mut sums = Sums { colors: [[0.0; TILE]; 3], weights: [0.0; TILE], angles: [0.0; TILE] };

        let (step, rest) = (l.splat((2.0 / f64::from(self.size)) as f32), l.splat((y * y + 1.0) as f32));
        for i in (0..tile.columns).step_by(LANES) {
            let x = eight(l, &tile.places, i);
            put(l, &mut sums.angles, i, l.div(step, l.sqrt(l.add(l.mul(x, x), rest))));
        }

        for &k in near {
            let capture = &self.captures[k];
            if let Some(limits) = capture.limits {
                self.add::<L, true>(l, tile, row, y, capture, Some(limits), &mut sums);
            } else {
                self.add::<L, false>(l, tile, row, y, capture, None, &mut sums);
            }
        }

        let (mut colors, mut seen) = ([[0; 3]; TILE], [0; TILE]);
        let most = l.splat(255.0);
        for i in (0..tile.columns).step_by(LANES) {
            let weight = eight(l, &sums.weights, i);
            let shown = l.greater(weight, l.splat(0.0));
            if shown == 0 {
                continue;
            }
            let inverse = l.div(l.splat(1.0), l.max(weight, l.splat(f32::MIN_POSITIVE)));
            let mut color = [inverse; 3];
            for (color, sums) in color.iter_mut().zip(&sums.colors) {
                *color = l.min(l.mul(eight(l, sums, i), inverse), most);
            }

            let packed = packed(l, color);
            for k in 0..LANES {
                seen[i + k] = if shown >> k & 1 == 1 { 255 } else { 0 };
            }
            if let Some(to) = colors[i..].as_flattened_mut().first_chunk_mut() {
                l.store_pixels(&packed, to);
            }
        }

        let from = row * self.band.width + tile.first;
        let to = from..from + tile.columns;
        self.band.colors[to.clone()].copy_from_slice(&colors[..tile.columns]);
        self.band.seen[to].copy_from_slice(&seen[..tile.columns]);
    }

    /// Adds the colours that a capture shows of a tile's row, which is at `y` on the face's plane.
    #[inline(always)]
    #[expect(clippy::too_many_arguments, reason = "what a row is and where its sums go")]
    fn add<L: ShadeLanes, const DEPTHS: bool>(
        &self,
        l: L,
        tile: &Tile,
        row: usize,
        y: f64,
        capture: &LaneCapture<'_>,
        limits: Option<&DepthLimits>,
        sums: &mut Sums,
    ) {
        let three = |v: DVec3| [l.splat(v.x as f32), l.splat(v.y as f32), l.splat(v.z as f32)];
        let [right, down, forward] = axes_of(self.band.face);
        let (per_column, start) = (three(capture.turn * right), three(capture.turn * (forward + down * y)));
        let center = three(capture.center);
        let lens = LensLanes::new(l, capture.lens, capture.reach);
        let (zero, one) = (l.splat(0.0), l.splat(1.0));
        for i in (0..tile.columns).step_by(LANES) {
            let place = eight(l, &tile.places, i);
            let inverse_depth = eight(l, &tile.inverse_depths[row], i);

            // The point that the pixel sees, divided by its depth, relative to the camera.
            let mut v = [zero; 3];
            for k in 0..3 {
                v[k] = l.add(l.mul(per_column[k], place), start[k]);
                if DEPTHS {
                    v[k] = l.add(v[k], l.mul(center[k], inverse_depth));
                }
            }

            let forward = l.div(one, v[2]);
            let (x, y) = (l.mul(v[0], forward), l.mul(v[1], forward));
            let r2 = l.add(l.mul(x, x), l.mul(y, y));
            let these = l.greater(v[2], zero) & l.greater(lens.most_r2, r2);
            if these == 0 {
                continue;
            }
            let at = lens.project(l, x, y, r2);

            // From −1 at one border of the picture to 1 at the other.
            let across = l.sub(l.mul(at[0], lens.twice_per_size[0]), one);
            let down = l.sub(l.mul(at[1], lens.twice_per_size[1]), one);
            let mut these = these
                & l.greater(l.min(at[0], at[1]), l.splat(0.5))
                & l.greater(lens.last[0], at[0])
                & l.greater(lens.last[1], at[1]);
            if these == 0 {
                continue;
            }

            if let (true, Some(limits)) = (DEPTHS, limits) {
                let limit = limits.at(l, x, y);
                these &= !(l.greater(v[2], l.mul(limit, inverse_depth)) & l.greater(inverse_depth, zero));
                if these == 0 {
                    continue;
                }
            }

            // 1 in the middle of the picture and 0 at its border, along either axis.
            let weight = l.mul(l.sub(one, l.mul(across, across)), l.sub(one, l.mul(down, down)));
            let weight = l.select(these, l.mul(weight, weight), zero);
            let width = l.mul(lens.focal, l.mul(eight(l, &sums.angles, i), l.sqrt(l.add(r2, one))));

            let color = l.channels(capture.levels.round_sums(l, (at[0], at[1]), width, these));
            let weights = l.add(eight(l, &sums.weights, i), weight);
            put(l, &mut sums.weights, i, weights);
            for ((sums, gain), color) in sums.colors.iter_mut().zip(capture.gain).zip(color) {
                let add = l.mul(l.mul(weight, l.splat(gain)), color);
                let colors = l.add(eight(l, sums, i), add);
                put(l, sums, i, colors);
            }
        }
    }
}

impl DepthLimits {
    /// Returns the limits around eight places of the plane at a depth of 1.
    #[inline(always)]
    fn at<L: ShadeLanes>(&self, l: L, x: L::F, y: L::F) -> L::F {
        let columns = self.limits.width();
        let rows = self.limits.height();
        let (focal, zero) = (l.splat(self.focal), l.splat(0.0));
        let index = |place: L::F, count: u32| {
            // The picture has one column more than `limits`: the axis goes through the middle of `limits`.
            let at = l.add(l.mul(place, focal), l.splat(0.5 * count as f32));
            l.truncate(l.min(l.max(at, zero), l.splat((count - 1) as f32)))
        };
        let at = l.add(l.mul(index(y, rows), l.splat(columns as f32)), index(x, columns));
        let (mut places, mut limits) = ([0; LANES], [0.0; LANES]);
        l.store_int(at, &mut places);
        let all = self.limits.pixels();
        for k in 0..LANES {
            limits[k] = all[places[k] as usize];
        }
        l.load(&limits)
    }
}

/// A lens in every lane.
struct LensLanes<F> {
    focal_x: F,
    focal_y: F,
    /// The smaller focal length.
    focal: F,
    center: [F; 2],
    /// k₁ k₂ k₃.
    radial: [F; 3],
    /// p₁ p₂, doubled.
    tangential: [F; 2],
    /// p₁ p₂.
    decentering: [F; 2],
    most_r2: F,
    /// 2 over the picture's size.
    twice_per_size: [F; 2],
    /// The centres of the picture's last column and row.
    last: [F; 2],
}

impl<F: Copy> LensLanes<F> {
    #[inline(always)]
    fn new<L: ShadeLanes<F = F>>(l: L, lens: &Lens, reach: f64) -> Self {
        let splat = |value: f64| l.splat(value as f32);
        let [k1, k2, p1, p2, k3] = lens.distortion();
        let size = [f64::from(lens.width()), f64::from(lens.height())];
        Self {
            focal_x: splat(lens.focal_px().x),
            focal_y: splat(lens.focal_px().y),
            focal: splat(lens.focal_px().min_element()),
            center: [splat(lens.center_px().x), splat(lens.center_px().y)],
            radial: [splat(k1), splat(k2), splat(k3)],
            tangential: [splat(2.0 * p1), splat(2.0 * p2)],
            decentering: [splat(p1), splat(p2)],
            most_r2: splat(reach * reach),
            twice_per_size: [splat(2.0 / size[0]), splat(2.0 / size[1])],
            last: [splat(size[0] - 0.5), splat(size[1] - 0.5)],
        }
    }

    /// Projects (x, y, 1) like [`Lens::project`]; r² = x² + y².
    #[inline(always)]
    fn project<L: ShadeLanes<F = F>>(&self, l: L, x: F, y: F, r2: F) -> [F; 2] {
        let [k1, k2, k3] = self.radial;
        let q = l.add(k1, l.mul(r2, l.add(k2, l.mul(r2, k3))));
        let q = l.add(l.splat(1.0), l.mul(r2, q));
        // 2xy, r² + 2x² and r² + 2y².
        let (two_xx, two_yy) = (l.mul(l.add(x, x), x), l.mul(l.add(y, y), y));
        let xy = l.mul(x, y);
        let ([p1, p2], [twice_p1, twice_p2]) = (self.decentering, self.tangential);
        let bent_x = l.add(l.mul(twice_p1, xy), l.mul(p2, l.add(r2, two_xx)));
        let bent_y = l.add(l.mul(p1, l.add(r2, two_yy)), l.mul(twice_p2, xy));
        [
            l.add(l.mul(self.focal_x, l.add(l.mul(x, q), bent_x)), self.center[0]),
            l.add(l.mul(self.focal_y, l.add(l.mul(y, q), bent_y)), self.center[1]),
        ]
    }
}
