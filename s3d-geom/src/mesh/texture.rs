//! Textures: images, their repetition, and their colour at a texture coordinate.

use crate::Raster;
use glam::Vec2;

/// The content of a texture beyond its edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum Wrap {
    /// The image repeats.
    #[default]
    Repeat,
    /// The image repeats, and every other copy is mirrored.
    Mirror,
    /// The pixels of the edge continue.
    Clamp,
}

impl Wrap {
    /// Returns the column (or row) of the image, in `0..size`, that is at column `i` of the endless texture.
    #[inline(always)]
    pub fn index(self, i: i64, size: u32) -> u32 {
        let n = i64::from(size);
        // Most columns are within the image, and a division takes as long as the rest of a look-up.
        if (0..n).contains(&i) {
            return i as u32;
        }
        let j = match self {
            Wrap::Repeat => remainder(i, n),
            Wrap::Mirror => {
                let m = remainder(i, 2 * n);
                if m < n { m } else { 2 * n - 1 - m }
            }
            Wrap::Clamp => i.clamp(0, n - 1),
        };
        j as u32
    }

    /// Returns the columns of the image for `i` and `i + 1`.
    #[inline(always)]
    fn pair(self, i: i64, size: u32) -> (u32, u32) {
        let first = self.index(i, size);
        let second = match self {
            Wrap::Repeat if first + 1 < size => first + 1,
            Wrap::Repeat => 0,
            _ => self.index(i + 1, size),
        };
        (first, second)
    }
}

/// Returns `i` modulo `n`, from 0 to n − 1. It divides in 32 bits if the numbers fit, which takes half the
/// time or less.
#[inline(always)]
fn remainder(i: i64, n: i64) -> i64 {
    match (i32::try_from(i), i32::try_from(n)) {
        (Ok(i), Ok(n)) => i64::from(i.rem_euclid(n)),
        _ => i.rem_euclid(n),
    }
}

/// An 8-bit colour image laid over faces by texture coordinates.
///
/// Texture coordinates are as in OBJ: (0, 0) is the **bottom** left corner of the image, (1, 1) the top
/// right. Colours are interpolated in their encoding (sRGB), as common mesh viewers do.
///
/// ```
/// use s3d_geom::{Raster, Texture, Wrap, glam::vec2};
///
/// let image = Raster::from_vec(2, 1, vec![[0, 0, 0], [200, 100, 0]]);
/// let texture = Texture { name: "wood.png".into(), image, wrap: [Wrap::Clamp; 2] };
/// assert_eq!(texture.sample(vec2(0.75, 0.5)), [200.0, 100.0, 0.0]);
/// assert_eq!(texture.sample(vec2(0.5, 0.5)), [100.0, 50.0, 0.0]);
/// ```
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Texture {
    /// A name for messages and files, such as the source file's.
    pub name: String,
    /// The image, top row first, R G B. At least 1 × 1.
    pub image: Raster<[u8; 3]>,
    /// The repetition along u (to the right) and v (upwards).
    pub wrap: [Wrap; 2],
}

impl Texture {
    /// Returns the colour at `uv`, bilinear between the four nearest pixels, 0 to 255 per channel. If a
    /// coordinate is not finite, the first column or row of the image is taken.
    #[inline(always)]
    pub fn sample(&self, uv: Vec2) -> [f32; 3] {
        sample_bilinear(&self.image, self.wrap, uv)
    }
}

/// Returns the colour of `image` at `uv`, bilinear between the four nearest pixels, 0 to 255 per channel, by
/// the conventions of [`Texture`]. An image without pixels is black.
#[inline(always)]
pub fn sample_bilinear(image: &Raster<[u8; 3]>, wrap: [Wrap; 2], uv: Vec2) -> [f32; 3] {
    if image.width() == 0 || image.height() == 0 {
        return [0.0; 3];
    }
    Quad::new(image, wrap, uv).color(image.pixels())
}

/// The four pixels around a place in an image, and the position of the place between them.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Quad {
    /// Indices of the pixels: upper left, upper right, lower left, lower right.
    pub(crate) at: [usize; 4],
    /// The position to the right and downwards, from 0 to 1.
    fraction: [f32; 2],
}

impl Quad {
    /// Finds the pixels around `uv`, by the conventions of [`Texture`]. The image must have pixels.
    #[inline(always)]
    pub(crate) fn new(image: &Raster<[u8; 3]>, wrap: [Wrap; 2], uv: Vec2) -> Self {
        let w = image.width();
        let h = image.height();

        // f64 keeps the fraction of a pixel even if the image repeats many times.
        let x = f64::from(uv.x) * f64::from(w) - 0.5;
        let y = (1.0 - f64::from(uv.y)) * f64::from(h) - 0.5;
        let x = if x.is_finite() { x } else { 0.0 };
        let y = if y.is_finite() { y } else { 0.0 };
        let left = x.floor();
        let top = y.floor();
        let fraction = [(x - left) as f32, (y - top) as f32];

        // v grows upwards and rows downwards, but repeating and mirroring are symmetric.
        let (x0, x1) = wrap[0].pair(left.clamp(-1e15, 1e15) as i64, w);
        let (y0, y1) = wrap[1].pair(top.clamp(-1e15, 1e15) as i64, h);
        let index = |x: u32, y: u32| y as usize * w as usize + x as usize;
        Self { at: [index(x0, y0), index(x1, y0), index(x0, y1), index(x1, y1)], fraction }
    }

    /// Returns the interpolated colour, 0 to 255 per channel. `pixels` are the pixels of the same image.
    #[inline(always)]
    pub(crate) fn color(&self, pixels: &[[u8; 3]]) -> [f32; 3] {
        let [fx, fy] = self.fraction;
        let [a, b, c, d] = self.at.map(|at| pixels[at]);
        std::array::from_fn(|k| {
            let top = f32::from(a[k]) + (f32::from(b[k]) - f32::from(a[k])) * fx;
            let bottom = f32::from(c[k]) + (f32::from(d[k]) - f32::from(c[k])) * fx;
            top + (bottom - top) * fy
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::vec2;

    fn two_by_two(wrap: Wrap) -> Texture {
        // Top row: 0, 100; bottom row: 200, 40.
        let image = Raster::from_vec(2, 2, vec![[0; 3], [100; 3], [200; 3], [40; 3]]);
        Texture { name: "t".into(), image, wrap: [wrap; 2] }
    }

    #[test]
    fn pixel_centres_are_exact_and_v_points_up() {
        let t = two_by_two(Wrap::Clamp);
        assert_eq!(t.sample(vec2(0.25, 0.75))[0], 0.0);
        assert_eq!(t.sample(vec2(0.75, 0.75))[0], 100.0);
        assert_eq!(t.sample(vec2(0.25, 0.25))[0], 200.0);
        assert_eq!(t.sample(vec2(0.5, 0.75))[0], 50.0);
        assert_eq!(t.sample(vec2(0.5, 0.5))[0], 85.0);
    }

    #[test]
    fn wrap_modes_differ_beyond_the_edge() {
        // Half a pixel left of the left edge, `Repeat` blends with the right column. The others take the edge
        // twice.
        let at = vec2(0.0, 0.75);
        assert_eq!(two_by_two(Wrap::Repeat).sample(at)[0], 50.0);
        assert_eq!(two_by_two(Wrap::Mirror).sample(at)[0], 0.0);
        assert_eq!(two_by_two(Wrap::Clamp).sample(at)[0], 0.0);
        let beyond = vec2(1.25, 0.75);
        assert_eq!(two_by_two(Wrap::Repeat).sample(beyond)[0], 0.0);
        assert_eq!(two_by_two(Wrap::Mirror).sample(beyond)[0], 100.0);
        assert_eq!(two_by_two(Wrap::Clamp).sample(beyond)[0], 100.0);
    }

    #[test]
    fn wild_coordinates_give_a_colour() {
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for uv in [vec2(f32::NAN, 0.5), vec2(f32::INFINITY, -f32::INFINITY), vec2(1e30, -1e30)] {
                assert!(
                    two_by_two(wrap).sample(uv).iter().all(|c| (0.0..=255.0).contains(c)),
                    "{wrap:?} {uv}"
                );
            }
        }
    }

    fn columns(wrap: Wrap) -> [u32; 7] {
        [-7, -1, 0, 2, 3, 5, 6].map(|i| wrap.index(i, 3))
    }

    #[test]
    fn neighbours_are_those_of_the_endless_texture() {
        let far = 1i64 << 40;
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for size in [1, 2, 3, 7, u32::MAX] {
                for i in (-30..30).chain(far - 3..far + 3).chain(-far - 3..-far) {
                    assert_eq!(
                        wrap.pair(i, size),
                        (wrap.index(i, size), wrap.index(i + 1, size)),
                        "{wrap:?} {size} {i}"
                    );
                }
            }
        }
        assert_eq!(columns(Wrap::Repeat), [2, 2, 0, 2, 0, 2, 0]);
        assert_eq!(columns(Wrap::Mirror), [0, 0, 0, 2, 2, 0, 0]);
        assert_eq!(columns(Wrap::Clamp), [0, 0, 0, 2, 2, 2, 2]);
    }
}
