//! Squared distances to planes and to linear colours, summed over faces.
//!
//! Sources: M. Garland and P. Heckbert, "Surface simplification using quadric error metrics", 1997; H. Hoppe,
//! "New quadric metric for simplifying meshes with appearance attributes", 1999.

use s3d_geom::glam::{DMat3, DVec3};
use std::ops::AddAssign;

/// The sum over faces of `area · (distance² + Σ (colour of the face at p − colour)²)`, as a function of
/// a place `p` and a colour. Colours are in metres: see [`super::DecimateOptions::color_weight_m`].
///
/// The best colour of a place follows from the place, so only the place is unknown.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Quadric {
    /// Upper triangle of the quadratic part: xx, xy, xz, yy, yz, zz.
    a: [f64; 6],
    b: DVec3,
    c: f64,
    /// The sums over faces of area times the gradient of each channel of the colour.
    gradient: [DVec3; 3],
    /// The sums over faces of area times the colour at the origin.
    constant: [f64; 3],
    /// The sum of areas, m².
    pub(super) area: f64,
}

impl Quadric {
    /// The quadric of a triangle whose corners have colours, in metres. Without an area it is zero.
    pub(super) fn of_face(p: [DVec3; 3], colors: [DVec3; 3]) -> Self {
        let (e1, e2) = (p[1] - p[0], p[2] - p[0]);
        let cross = e1.cross(e2);
        let twice_area = cross.length();
        if twice_area == 0.0 {
            return Self::default();
        }

        let n = cross / twice_area;
        let area = 0.5 * twice_area;
        let mut sum = Self { area, ..Self::default() };
        sum.add_square(n, -n.dot(p[0]), area);

        // Slivers would have huge gradients.
        let longest_squared = e1
            .length_squared()
            .max(e2.length_squared())
            .max((e1 - e2).length_squared());
        let is_sliver = twice_area < 1e-2 * longest_squared;
        for channel in 0..3 {
            let [s0, s1, s2] = colors.map(|color| color[channel]);
            let gradient = match is_sliver {
                true => DVec3::ZERO,
                false => ((s1 - s0) * e2.cross(n) + (s2 - s0) * n.cross(e1)) / twice_area,
            };
            let constant = (s0 + s1 + s2) / 3.0 - gradient.dot((p[0] + p[1] + p[2]) / 3.0);
            sum.add_square(gradient, constant, area);
            sum.gradient[channel] = area * gradient;
            sum.constant[channel] = area * constant;
        }
        sum
    }

    /// The quadric of the plane through a border edge that stands upright on its face: it keeps the border in
    /// its place.
    pub(super) fn of_border(from: DVec3, to: DVec3, opposite: DVec3) -> Self {
        let along = to - from;
        let across = along.cross((opposite - from).cross(along)).normalize_or_zero();
        let mut sum = Self::default();
        sum.add_square(across, -across.dot(from), BORDER_WEIGHT * along.length_squared());
        sum
    }

    /// Adds `weight · (n · p + d)²`.
    fn add_square(&mut self, n: DVec3, d: f64, weight: f64) {
        let m = weight * n;
        let products = [m.x * n.x, m.x * n.y, m.x * n.z, m.y * n.y, m.y * n.z, m.z * n.z];
        for (sum, product) in self.a.iter_mut().zip(products) {
            *sum += product;
        }
        self.b += m * d;
        self.c += weight * d * d;
    }

    /// The place near `middle` with the least error, and its error in m⁴. The error grows a little with
    /// the distance from `middle`, so that there is one best place on a plane, too.
    pub(super) fn best_place(&self, middle: DVec3) -> (DVec3, f64) {
        let (a, b, _) = self.without_colors();
        let hold = HOLD * self.area + f64::MIN_POSITIVE;
        let place = (a + DMat3::from_diagonal(DVec3::splat(hold))).inverse() * (hold * middle - b);
        let place = if place.is_finite() { place } else { middle };
        (place, self.error(place) + hold * place.distance_squared(middle))
    }

    /// The error of a place that has its best colour, in m⁴.
    pub(super) fn error(&self, p: DVec3) -> f64 {
        let (a, b, c) = self.without_colors();
        (p.dot(a * p) + 2.0 * b.dot(p) + c).max(0.0)
    }

    /// The best colour of a place, in metres.
    pub(super) fn color(&self, p: DVec3) -> DVec3 {
        let channel = |i: usize| (self.gradient[i].dot(p) + self.constant[i]) / self.area;
        DVec3::new(channel(0), channel(1), channel(2))
    }

    /// The quadratic function of the place that is left when each place has its best colour.
    fn without_colors(&self) -> (DMat3, DVec3, f64) {
        let (mut a, mut b, mut c) = (self.a, self.b, self.c);
        if self.area > 0.0 {
            for (g, d) in self.gradient.iter().zip(self.constant) {
                let h = *g / self.area;
                let products = [h.x * g.x, h.x * g.y, h.x * g.z, h.y * g.y, h.y * g.z, h.z * g.z];
                for (sum, product) in a.iter_mut().zip(products) {
                    *sum -= product;
                }
                b -= h * d;
                c -= d * d / self.area;
            }
        }
        let [xx, xy, xz, yy, yz, zz] = a;
        (DMat3::from_cols(DVec3::new(xx, xy, xz), DVec3::new(xy, yy, yz), DVec3::new(xz, yz, zz)), b, c)
    }
}

/// How much more the plane of a border edge counts than a face of the edge's length squared.
const BORDER_WEIGHT: f64 = 4.0;

/// How strongly places are held at the middle of their edge, relative to a plane across. Less than 2 degrees
/// between planes do not move a vertex far away.
const HOLD: f64 = 1e-3;

impl AddAssign<&Self> for Quadric {
    fn add_assign(&mut self, other: &Self) {
        for (sum, more) in self.a.iter_mut().zip(other.a) {
            *sum += more;
        }
        self.b += other.b;
        self.c += other.c;
        for i in 0..3 {
            self.gradient[i] += other.gradient[i];
            self.constant[i] += other.constant[i];
        }
        self.area += other.area;
    }
}
