//! Textures and their mip maps: every size that a pixel may need.

use crate::shade::filter::MipLevels;
use glam::{DVec2, Vec2};
use rayon::prelude::*;
use s3d_geom::{Raster, Texture, TriMesh, Wrap, sample_bilinear};

/// How [`crate::rgb_image`] filters textures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TextureFilter {
    /// The most samples along a pixel's footprint if a texture is seen at an angle, at least 1. With 1 such
    /// textures are blurred; with 8 they are sharp up to 83°.
    pub max_taps: u32,
}

impl Default for TextureFilter {
    fn default() -> Self {
        Self { max_taps: 8 }
    }
}

/// The textures of a mesh, each reduced to a half, a quarter… down to one pixel. The reductions take a
/// third of the textures' memory; the full size stays in the mesh.
///
/// ```
/// use s3d_geom::glam::{DVec3, vec2, vec3};
/// use s3d_geom::{Camera, Material, MeshParts, Pose, Raster, Texture, TriMesh, Wrap};
/// use s3d_render::{MipMaps, Scene, cast, rgb_image};
///
/// // A wall 2 m ahead, with a chequered texture of 8 × 8.
/// let chequers = (0..64).map(|k| [if (k + k / 8) % 2 == 0 { 50 } else { 150 }; 3]);
/// let image = Raster::from_vec(8, 8, chequers.collect());
/// let mesh = TriMesh::new(MeshParts {
///     positions: vec![vec3(-9.0, 2.0, -9.0), vec3(9.0, 2.0, -9.0), vec3(0.0, 2.0, 18.0)],
///     faces: vec![[0, 1, 2]],
///     uvs: vec![vec2(0.0, 0.0), vec2(18.0, 0.0), vec2(9.0, 27.0)], // a metre wide each
///     face_uvs: vec![[0, 1, 2]],
///     materials: vec![Material { name: "wall".into(), color: [0; 3], texture: Some(0) }],
///     face_materials: vec![0],
///     textures: vec![Texture { name: "chequers".into(), image, wrap: [Wrap::Repeat; 2] }],
///     ..MeshParts::default()
/// })?;
/// let mip_maps = MipMaps::new(&mesh);
/// assert_eq!(mip_maps.bytes(), 3 * (4 * 4 + 2 * 2 + 1));
///
/// // In a few pixels, the chequers are seen as their mean.
/// let scene = Scene::new(&mesh);
/// let camera = Camera::perspective(Pose::level(DVec3::ZERO, 0.0), 1.2, 5, 5);
/// let rgb = rgb_image(&scene, &mip_maps, &cast(&scene, &camera), &camera);
/// assert_eq!(rgb.at(2, 2), [100; 3]);
/// # Ok::<(), s3d_geom::MeshError>(())
/// ```
#[derive(Clone, Debug)]
pub struct MipMaps {
    /// The reductions of each texture of the mesh, half size first.
    reductions: Vec<Vec<Raster<[u8; 3]>>>,
}

impl MipMaps {
    /// Reduces the textures of `mesh`, on all threads of the current rayon pool.
    pub fn new(mesh: &TriMesh) -> Self {
        let reductions = mesh
            .textures()
            .par_iter()
            .map(|texture| std::iter::successors(halved(&texture.image), halved).collect())
            .collect();
        Self { reductions }
    }

    /// Returns the size of all reductions in bytes.
    pub fn bytes(&self) -> usize {
        self.reductions.iter().flatten().map(|level| 3 * level.len()).sum()
    }

    /// Returns all levels of a texture of the mesh, for the fast filter.
    pub(crate) fn levels<'a>(&'a self, texture: usize, full: &'a Texture) -> MipLevels<'a> {
        MipLevels::new(full, &self.reductions[texture])
    }

    /// Returns the levels of a texture, each half of the one before, for single pixels.
    pub(crate) fn mip_map<'a>(&'a self, texture: u32, full: &'a Texture) -> MipMap<'a> {
        MipMap { full, reductions: &self.reductions[texture as usize] }
    }
}

/// Returns the image at half the size: each pixel is the mean of the area it covers. Returns `None` if the
/// image is one pixel. An odd size is also cut into equal parts, which take shares of pixels, so that
/// coordinates keep their meaning.
pub(crate) fn halved(image: &Raster<[u8; 3]>) -> Option<Raster<[u8; 3]>> {
    let w = image.width();
    let h = image.height();
    if w <= 1 && h <= 1 {
        return None;
    }

    if w.is_multiple_of(2) && h.is_multiple_of(2) {
        return Some(even_halved(image));
    }

    let columns = shares(w);
    let rows = shares(h);
    let pixels = rows.par_iter().flat_map_iter(|row| {
        columns.iter().map(move |column| {
            let mut sum = [0.0f32; 3];
            for (y, wy) in (row.first..).zip(row.weights) {
                for (x, wx) in (column.first..).zip(column.weights) {
                    if wx * wy > 0.0 {
                        let pixel = image.at(x, y);
                        for k in 0..3 {
                            sum[k] += wx * wy * f32::from(pixel[k]);
                        }
                    }
                }
            }
            sum.map(|channel| (channel + 0.5) as u8)
        })
    });

    Some(Raster::from_vec(columns.len() as u32, rows.len() as u32, pixels.collect()))
}

/// Halves an image of even width and height: each pixel is the mean of four.
fn even_halved(image: &Raster<[u8; 3]>) -> Raster<[u8; 3]> {
    let w = image.width() as usize;
    let h = image.height() as usize;
    let mut half = Raster::filled(w as u32 / 2, h as u32 / 2, [0u8; 3]);
    let rows = half
        .pixels_mut()
        .par_chunks_mut(w / 2)
        .zip(image.pixels().par_chunks(2 * w));
    rows.for_each(|(to, from)| {
        let (upper, lower) = from.split_at(w);
        let upper = upper.as_chunks::<2>().0;
        let lower = lower.as_chunks::<2>().0;
        for ((pixel, [a, b]), [c, d]) in to.iter_mut().zip(upper).zip(lower) {
            for k in 0..3 {
                let sum = u16::from(a[k]) + u16::from(b[k]) + u16::from(c[k]) + u16::from(d[k]);
                pixel[k] = ((sum + 2) >> 2) as u8;
            }
        }
    });
    half
}

/// The pixels along an axis whose mean is one pixel of the reduction: up to three, with weights that add up
/// to 1.
struct Share {
    first: u32,
    weights: [f32; 3],
}

/// Returns the shares of the pixels of a reduced axis.
fn shares(size: u32) -> Vec<Share> {
    let half = (size / 2).max(1);
    (0..half)
        .map(|k| match size {
            1 => Share { first: 0, weights: [1.0, 0.0, 0.0] },
            _ if size.is_multiple_of(2) => Share { first: 2 * k, weights: [0.5, 0.5, 0.0] },
            _ => {
                let weights = [half - k, half, k + 1].map(|w| w as f32 / size as f32);
                Share { first: 2 * k, weights }
            }
        })
        .collect()
}

/// One texture at all its levels.
#[derive(Clone, Copy)]
pub(crate) struct MipMap<'a> {
    full: &'a Texture,
    reductions: &'a [Raster<[u8; 3]>],
}

impl<'a> MipMap<'a> {
    pub(crate) fn new(full: &'a Texture, reductions: &'a [Raster<[u8; 3]>]) -> Self {
        Self { full, reductions }
    }

    /// Returns the colour at `uv`, 0 to 255 a channel, over the footprint of a pixel: the parallelogram whose
    /// sides are `x` and `y`, in texture coordinates. A magnified texture is sampled once in the full size,
    /// bilinearly. A minified one is sampled along the long axis of the footprint, in the level at which the
    /// short axis is one pixel, and the mean is returned.
    #[inline(always)]
    pub(crate) fn sample(&self, uv: DVec2, x: DVec2, y: DVec2, filter: &TextureFilter) -> [f32; 3] {
        let size = DVec2::new(f64::from(self.full.image.width()), f64::from(self.full.image.height()));
        let x = (x * size).as_vec2();
        let y = (y * size).as_vec2();

        let mut sum = ColorSum::default();
        let (major, short, taps) = taps(x, y, filter.max_taps);
        let (level, fraction) = level_of(short);

        if taps == 1 {
            self.add_trilinear(&mut sum, level, fraction, uv, 1.0);
        } else {
            let step = major.as_dvec2() / size / f64::from(taps);
            let first = uv - step * (0.5 * f64::from(taps - 1));
            for tap in 0..taps {
                self.add_trilinear(
                    &mut sum,
                    level,
                    fraction,
                    first + step * f64::from(tap),
                    1.0 / taps as f32,
                );
            }
        }

        sum.color()
    }

    #[inline(always)]
    fn add_trilinear(&self, sum: &mut ColorSum, level: usize, fraction: f32, uv: DVec2, weight: f32) {
        if fraction == 0.0 || level >= self.reductions.len() {
            return sum.add_bilinear(self.level(level), self.full.wrap, uv, weight);
        }
        sum.add_bilinear(self.level(level), self.full.wrap, uv, weight * (1.0 - fraction));
        sum.add_bilinear(self.level(level + 1), self.full.wrap, uv, weight * fraction);
    }

    /// Returns the texture reduced `level` times; beyond the last level, the last one (one pixel).
    #[inline(always)]
    fn level(&self, level: usize) -> &Raster<[u8; 3]> {
        match self.reductions.len().min(level) {
            0 => &self.full.image,
            n => &self.reductions[n - 1],
        }
    }
}

/// Decides how to sample the footprint with the sides `x` and `y`, in pixels. Returns the long axis, the
/// width of each sample (at least 1), and the number of samples.
#[inline(always)]
fn taps(x: Vec2, y: Vec2, most: u32) -> (Vec2, f32, u32) {
    // The long axis is no longer than the root of this sum.
    let sum = x.length_squared() + y.length_squared();
    if sum <= 1.0 || !sum.is_finite() {
        return (Vec2::ZERO, 1.0, 1);
    }
    let (major, minor) = axes(x, y);
    let long = major.length();
    let most = most.max(1) as f32;
    let short = minor.max(long / most).max(1.0);
    // Bilinear samples overlap their neighbours, so half a sample less leaves no gap.
    let count = (long / short + 0.5).clamp(1.0, most) as u32;
    (major, short, count)
}

/// Returns ⌊log2 width⌋ and the rest of the logarithm, to 0.01, for a width of at least 1.
#[inline(always)]
fn level_of(width: f32) -> (usize, f32) {
    let bits = width.to_bits();
    let mantissa = f32::from_bits((bits & 0x007F_FFFF) | 0x3F80_0000);
    let fraction = (2.0 - mantissa * (1.0 / 3.0)) * mantissa - 5.0 / 3.0;
    ((bits >> 23) as usize - 127, fraction.max(0.0))
}

/// Returns the long axis of the ellipse with the conjugate diameters `x` and `y`, and the length of its short
/// axis.
#[inline(always)]
fn axes(x: Vec2, y: Vec2) -> (Vec2, f32) {
    let a = x.x * x.x + y.x * y.x;
    let b = x.x * x.y + y.x * y.y;
    let c = x.y * x.y + y.y * y.y;
    let mean = 0.5 * (a + c);
    let half = 0.5 * (a - c);
    let root = (half * half + b * b).sqrt();
    let long = (mean + root).sqrt();
    // The axis of the larger eigenvalue can be written in two ways; this one does not cancel.
    let axis = if half >= 0.0 {
        Vec2::new(root + half, b)
    } else {
        Vec2::new(b, root - half)
    };
    let axis = axis.try_normalize().unwrap_or(Vec2::X);
    (axis * long, x.perp_dot(y).abs() / long)
}

/// A weighted sum of colours. Two neighbours in a row are added at once, in their memory layout: R G B R G B
/// and two bytes without weight.
#[derive(Clone, Copy, Default)]
struct ColorSum([f32; 8]);

impl ColorSum {
    #[inline(always)]
    fn add_bilinear(&mut self, image: &Raster<[u8; 3]>, wrap: [Wrap; 2], uv: DVec2, weight: f32) {
        let w = image.width();
        let h = image.height();
        let uv = DVec2::new(wrapped(uv.x, wrap[0]), wrapped(uv.y, wrap[1]));
        let x = uv.x * f64::from(w) - 0.5;
        let y = (1.0 - uv.y) * f64::from(h) - 0.5;
        let xi = x as u32;
        let yi = y as u32;
        let at = 3 * (yi as usize * w as usize + xi as usize);
        let bytes = image.pixels().as_flattened();
        let below = at + 3 * w as usize;
        let inside = x >= 0.0 && y >= 0.0 && xi + 1 < w && yi + 1 < h;

        let (true, Some(upper), Some(lower)) = (inside, bytes.get(at..at + 8), bytes.get(below..below + 8))
        else {
            return self.add_at_the_edge(image, wrap, uv, weight);
        };

        let fx = (x - f64::from(xi)) as f32;
        let fy = (y - f64::from(yi)) as f32;
        let left = (1.0 - fx) * weight;
        let right = fx * weight;
        let columns = [left, left, left, right, right, right, 0.0, 0.0];
        for k in 0..8 {
            let a = f32::from(upper[k]);
            let b = f32::from(lower[k]);
            self.0[k] += columns[k] * (a + (b - a) * fy);
        }
    }

    #[cold]
    fn add_at_the_edge(&mut self, image: &Raster<[u8; 3]>, wrap: [Wrap; 2], uv: DVec2, weight: f32) {
        let color = sample_bilinear(image, wrap, uv.as_vec2());
        for (sum, channel) in self.0.iter_mut().zip(color) {
            *sum += weight * channel;
        }
    }

    #[inline(always)]
    fn color(&self) -> [f32; 3] {
        let [a, b, c, d, e, f, ..] = self.0;
        [a + d, b + e, c + f]
    }
}

/// Returns the coordinate in 0 to 1 at which the texture shows the same.
#[inline(always)]
fn wrapped(u: f64, wrap: Wrap) -> f64 {
    match wrap {
        _ if (0.0..=1.0).contains(&u) => u,
        Wrap::Repeat => u - u.floor(),
        Wrap::Mirror => {
            let t = (0.5 * u - (0.5 * u).floor()) * 2.0;
            if t > 1.0 { 2.0 - t } else { t }
        }
        Wrap::Clamp => u.clamp(0.0, 1.0),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec2;
    use proptest::prelude::*;

    fn image(w: u32, h: u32, f: impl Fn(u32, u32) -> u8) -> Raster<[u8; 3]> {
        Raster::from_vec(w, h, (0..w * h).map(|k| [f(k % w, k / w); 3]).collect())
    }

    #[test]
    fn halves_are_means_of_equal_areas() {
        let half = halved(&image(4, 2, |x, y| (10 * x + y) as u8)).unwrap();
        assert_eq!((half.width(), half.height()), (2, 1));
        assert_eq!(half.pixels(), [[6; 3], [26; 3]], "5.5 and 25.5, rounded half up");
        // 3 pixels become 1, and 5 become 2: the middle one is shared.
        let half = halved(&image(5, 3, |x, _| [0, 0, 100, 200, 200][x as usize])).unwrap();
        assert_eq!(half.pixels(), [[20; 3], [180; 3]]);
        assert_eq!(halved(&image(1, 2, |_, y| 100 * y as u8)).unwrap().pixels(), [[50; 3]]);
        assert!(halved(&image(1, 1, |_, _| 7)).is_none());
    }

    proptest! {
        #[test]
        fn mip_maps_keep_the_mean_and_take_a_third_more(
            w in 1u32..70, h in 1u32..70, seed in any::<u32>(),
        ) {
            let full = image(w, h, |x, y| {
                (x * 7919 + y * 104_729).wrapping_mul(seed | 1).rotate_left(9) as u8
            });
            let levels: Vec<_> = std::iter::successors(halved(&full), halved).collect();
            let bytes: usize = levels.iter().map(Raster::len).sum();
            // Along a strip of one pixel, the levels add up to as much again.
            prop_assert!(3 * bytes <= full.len() + 2 * (w + h) as usize);
            let mean = full.pixels().iter().map(|p| f64::from(p[0])).sum::<f64>() / full.len() as f64;
            let last = levels.last().unwrap_or(&full);
            prop_assert_eq!(last.len(), 1);
            prop_assert!((f64::from(last.pixels()[0][0]) - mean).abs() <= 0.5 * levels.len() as f64 + 0.5);
        }

        #[test]
        fn one_sample_is_bilinear(
            u in -3.0..3.0f32, v in -3.0..3.0f32, w in 1u32..9, h in 1u32..9,
            wrap in prop::sample::select(vec![Wrap::Repeat, Wrap::Mirror, Wrap::Clamp]),
        ) {
            let image = image(w, h, |x: u32, y: u32| (x * 31 + y * 77) as u8);
            let full = Texture { name: "t".into(), image, wrap: [wrap; 2] };
            let mip_map = MipMap { full: &full, reductions: &[] };
            let uv = vec2(u, v);
            let tiny = DVec2::splat(1e-9);
            let got = mip_map.sample(uv.as_dvec2(), tiny, tiny, &TextureFilter::default());
            let expected = full.sample(uv);
            for k in 0..3 {
                prop_assert!((got[k] - expected[k]).abs() < 0.01, "{uv}: {got:?} {expected:?}");
            }
        }

        #[test]
        fn axes_are_those_of_the_ellipse(
            x in prop::array::uniform2(-9.0..9.0f32), y in prop::array::uniform2(-9.0..9.0f32),
        ) {
            let x = Vec2::from(x);
            let y = Vec2::from(y);
            let (major, minor) = axes(x, y);
            // The farthest point x cos a + y sin a of the ellipse, by trial.
            let points = (0..2000).map(|k| Vec2::from_angle(k as f32 * 0.00314)).map(|a| x * a.x + y * a.y);
            let far = points.max_by(|p, q| p.length().total_cmp(&q.length())).unwrap();
            prop_assert!((far.length() - major.length()).abs() < 1e-2);
            prop_assert!((major.length() * minor - x.perp_dot(y).abs()).abs() < 1e-2);
            if minor < 0.8 * major.length() {
                prop_assert!(far.normalize().perp_dot(major.normalize()).abs() < 0.05);
            }
        }
    }

    #[test]
    fn footprints_choose_their_samples() {
        let x = vec2(0.5, 0.0);
        let y = vec2(0.0, 0.6);
        assert_eq!(taps(x, y, 8).2, 1);
        assert_eq!(taps(x * 8.0, y, 8).2, 4);
        assert_eq!(taps(x * 4000.0, y, 8).2, 8);
        assert_eq!(taps(x * 4000.0, y, 8).1, 250.0);
        assert_eq!(taps(x * 4000.0, y, 0).2, 1);
        assert_eq!(taps(vec2(f32::NAN, 1.0), y, 8).2, 1);
        for (width, level) in [(1.0, 0.0), (2.0, 1.0), (3.0, 1.585), (1000.0, 9.966)] {
            let (whole, rest) = level_of(width);
            assert!((whole as f32 + rest - level).abs() < 0.012);
        }
    }
}
