//! Cube maps from sky boxes, and the pictures from which cube maps are made.

use crate::picture::cube_map::{CubeMap, direction_of, face_of, place_on};
use crate::shade::filter::MipLevels;
use crate::shade::mip_maps::{MipMap, TextureFilter, halved};
use glam::{DVec2, dvec2};
use s3d_geom::{Pose, Raster, Texture, Wrap};

/// How the upper and the lower picture of a sky box are turned. Names the side picture that the lower edge of
/// the upper one and the upper edge of the lower one meet.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, Hash)]
pub enum SkyBoxTurn {
    /// The turn that agrees best along the edges, for each of the two pictures by itself. *Front* wins a tie.
    ///
    /// Viewers of Matterport's sky boxes (Matterport3DSimulator, PanoBasic) turn them to meet *right*. Taken
    /// literally, `s3d_io::formats` turns them to meet *front*. The pictures themselves decide.
    #[default]
    Detect,
    /// They meet picture 4.
    Front,
    /// They meet picture 1.
    Right,
    /// They meet picture 2.
    Back,
    /// They meet picture 3.
    Left,
}

impl SkyBoxTurn {
    /// Returns the number of quarter turns from *front* to the right.
    fn quarters(self) -> Option<u32> {
        match self {
            Self::Detect => None,
            Self::Front => Some(0),
            Self::Right => Some(1),
            Self::Back => Some(2),
            Self::Left => Some(3),
        }
    }
}

impl CubeMap {
    /// Makes a cube map from the six pictures of a sky box, in the order of the faces and all of one size.
    /// The faces have `size` pixels, or the size of the pictures. Pictures whose size is a multiple of 32
    /// pixels are copied unchanged.
    ///
    /// # Panics
    /// If there are not six square pictures of one size of at least 1 pixel.
    pub fn from_sky_box(
        pictures: [&Raster<[u8; 3]>; 6],
        turn: SkyBoxTurn,
        pose: &Pose,
        size: Option<u32>,
    ) -> Self {
        let n = pictures[0].width();
        let square = pictures.iter().all(|p| (p.width(), p.height()) == (n, n));
        assert!(square && n > 0, "a sky box is six square pictures of one size");

        let quarters = [0, 5].map(|face| turn.quarters().unwrap_or_else(|| agreeing_turn(&pictures, face)));
        let turned = [turned(pictures[0], quarters[0]), turned(pictures[5], (4 - quarters[1]) % 4)];
        let [_, right, back, left, front, _] = pictures;
        let pictures = [&turned[0], right, back, left, front, &turned[1]];

        let size = Self::fitting_size(f64::from(size.unwrap_or(n)));
        let source = if size < n {
            SourceMipMap::new
        } else {
            SourceMipMap::without_reductions
        };
        let mip_maps = pictures.map(|p| source(p.clone(), [Wrap::Clamp; 2]));
        let width = f64::from(n);
        let step = width / f64::from(size);

        let color = |d| {
            let face = face_of(d);
            let at = (place_on(face, d) + 1.0) * (0.5 * width);
            mip_maps[face].sample(at, dvec2(step, 0.0), dvec2(0.0, step), &TextureFilter::default())
        };

        Self::build_bands(*pose, size, |mut band| {
            let face = band.face;
            let first_row = band.first_row;
            let border = (band.width - size as usize) / 2;
            for (y, (row, seen)) in (first_row as usize..).zip(band.rows()) {
                seen.fill(255);
                // A picture of this size is copied inside the border.
                let inside = border..border + n as usize;
                let taken = if size == n && inside.contains(&y) { inside } else { 0..0 };
                if !taken.is_empty() {
                    row[taken.clone()].copy_from_slice(pictures[face].row((y - border) as u32));
                }
                for (x, pixel) in row.iter_mut().enumerate().filter(|(x, _)| !taken.contains(x)) {
                    let color = color(direction_of(face, size, x as u32, y as u32));
                    *pixel = color.map(|c| (c + 0.5) as u8);
                }
            }
        })
    }
}

/// Returns the quarter turns of the upper (0) or lower (5) picture with which its edges agree best with the
/// edges of the side pictures.
fn agreeing_turn(pictures: &[&Raster<[u8; 3]>; 6], face: usize) -> u32 {
    let n = pictures[0].width();
    (0..4)
        .min_by_key(|&quarters| turn_cost(quarters, pictures, face, n))
        .unwrap_or(0)
}

/// Returns how much the edges of a cap that is turned differ from the sides.
fn turn_cost(quarters: u32, pictures: &[&Raster<[u8; 3]>; 6], face: usize, n: u32) -> u64 {
    let quarters = if face == 0 { quarters } else { (4 - quarters) % 4 };
    let cap = |x, y| turned_at(pictures[face], quarters, x, y);
    (0..n)
        .map(|i| {
            let last = n - 1;
            // The edge that meets the front picture from left to right, then the edges that meet the
            // right, back and left pictures, each in its picture's order.
            let (edge, row) = if face == 0 {
                ([cap(i, last), cap(last, last - i), cap(last - i, 0), cap(0, i)], 0)
            } else {
                ([cap(i, 0), cap(last, i), cap(last - i, last), cap(0, last - i)], last)
            };
            let sides = [4, 1, 2, 3].map(|side| pictures[side].at(i, row));
            edge.into_iter()
                .zip(sides)
                .map(|(a, b)| color_distance(a, b))
                .sum::<u64>()
        })
        .sum()
}

/// Returns the sum of the differences of two colours.
fn color_distance(a: [u8; 3], b: [u8; 3]) -> u64 {
    (0..3).map(|k| u64::from(a[k].abs_diff(b[k]))).sum::<u64>()
}

/// Returns the picture turned `quarters` times, so that its lower edge becomes its right one each time.
fn turned(picture: &Raster<[u8; 3]>, quarters: u32) -> Raster<[u8; 3]> {
    let n = picture.width();
    let rows = (0..n).flat_map(|y| (0..n).map(move |x| turned_at(picture, quarters, x, y)));
    Raster::from_vec(n, n, rows.collect())
}

/// Returns the pixel of [`turned`] at (x, y).
fn turned_at(picture: &Raster<[u8; 3]>, quarters: u32, mut x: u32, mut y: u32) -> [u8; 3] {
    for _ in 0..quarters {
        // The pixel at (x, y) was at (n − 1 − y, x): (right, middle) was (middle, bottom).
        (x, y) = (picture.width() - 1 - y, x);
    }
    picture.at(x, y)
}

/// A source picture at every size, sampled in pixels of its full size.
pub(crate) struct SourceMipMap {
    full: Texture,
    reductions: Vec<Raster<[u8; 3]>>,
}

impl SourceMipMap {
    pub(crate) fn new(image: Raster<[u8; 3]>, wrap: [Wrap; 2]) -> Self {
        let reductions = std::iter::successors(halved(&image), halved).collect();
        Self { reductions, ..Self::without_reductions(image, wrap) }
    }

    /// Returns a picture for footprints of at most a pixel.
    fn without_reductions(image: Raster<[u8; 3]>, wrap: [Wrap; 2]) -> Self {
        Self { full: Texture { name: String::new(), image, wrap }, reductions: Vec::new() }
    }

    /// Returns the levels for the fast filter.
    pub(crate) fn levels(&self) -> MipLevels<'_> {
        MipLevels::new(&self.full, &self.reductions)
    }

    /// Returns the colour around a place in pixels (y down), over the footprint with the sides `x` and `y` in
    /// pixels.
    #[inline]
    pub(crate) fn sample(&self, at: DVec2, x: DVec2, y: DVec2, filter: &TextureFilter) -> [f32; 3] {
        let size = dvec2(f64::from(self.full.image.width()), f64::from(self.full.image.height()));
        let uv = at / size;
        let x = x / size;
        let y = y / size;
        let mip_map = MipMap::new(&self.full, &self.reductions);
        mip_map.sample(dvec2(uv.x, 1.0 - uv.y), dvec2(x.x, -x.y), dvec2(y.x, -y.y), filter)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::picture::cube_map::tests::{color_of, pose};
    use glam::{DVec3, dvec3};
    use s3d_geom::Camera;
    use std::f64::consts::FRAC_PI_2;

    fn taken(camera: &Camera) -> Raster<[u8; 3]> {
        let rays = camera.rays();
        let pixels = (0..camera.width * camera.height)
            .map(|k| color_of(rays.at(k % camera.width, k / camera.width)).map(|c| (c + 0.5) as u8));
        Raster::from_vec(camera.width, camera.height, pixels.collect())
    }

    /// Returns a sky box whose upper and lower pictures are turned to the right by `quarters`.
    fn sky_box(quarters: u32, size: u32) -> Vec<Raster<[u8; 3]>> {
        let heading = -f64::from(quarters) * FRAC_PI_2;
        let turns = [
            (heading, FRAC_PI_2),
            (-FRAC_PI_2, 0.0),
            (2.0 * FRAC_PI_2, 0.0),
            (FRAC_PI_2, 0.0),
            (0.0, 0.0),
            (heading, -FRAC_PI_2),
        ];
        turns
            .map(|(yaw, pitch)| taken(&Camera::perspective(pose().turned(yaw, pitch), FRAC_PI_2, size, size)))
            .into()
    }

    /// Returns the largest difference from the expected colour, in all directions.
    fn error(cube: &CubeMap) -> f32 {
        let tiny = DVec3::splat(1e-9);
        let directions = (0..4000).map(|k| {
            let z = 1.0 - (2.0 * f64::from(k) + 1.0) / 4000.0;
            let (sin, cos) = libm::sincos(2.399_963 * f64::from(k));
            dvec3(cos, sin, 0.0) * (1.0 - z * z).sqrt() + DVec3::Z * z
        });
        let differences = directions.flat_map(|d| {
            let color = cube.sample(d, tiny, tiny, &TextureFilter::default()).0;
            (0..3).map(move |k| (color[k] - color_of(d)[k]).abs())
        });
        differences.fold(0.0, f32::max)
    }

    #[test]
    fn sky_boxes_are_right_whichever_way_their_caps_are_turned() {
        let named = [SkyBoxTurn::Front, SkyBoxTurn::Right, SkyBoxTurn::Back, SkyBoxTurn::Left];
        for (quarters, turn) in named.into_iter().enumerate() {
            // 90 pixels are no multiple of 32.
            for size in [64, 90] {
                let pictures = sky_box(quarters as u32, size);
                let pictures: [&Raster<[u8; 3]>; 6] = std::array::from_fn(|k| &pictures[k]);
                for turn in [turn, SkyBoxTurn::Detect] {
                    let cube = CubeMap::from_sky_box(pictures, turn, &pose(), None);
                    assert!(error(&cube) < 4.0, "{turn:?} {size}: {}", error(&cube));
                }
                let wrong = CubeMap::from_sky_box(pictures, named[(quarters + 1) % 4], &pose(), None);
                assert!(error(&wrong) > 60.0);
            }
        }
    }

    #[test]
    fn pictures_of_a_fitting_size_are_taken_as_they_are() {
        let pictures = sky_box(0, 64);
        let cube =
            CubeMap::from_sky_box(std::array::from_fn(|k| &pictures[k]), SkyBoxTurn::Front, &pose(), None);
        for (face, picture) in pictures.iter().enumerate() {
            assert_eq!(&cube.face(face), picture, "face {face}");
        }
    }

    #[test]
    fn a_mirrored_or_exchanged_face_is_far_off() {
        let pictures = sky_box(0, 64);
        let all: [&Raster<[u8; 3]>; 6] = std::array::from_fn(|k| &pictures[k]);
        for face in 0..6 {
            let rows = pictures[face].rows().flat_map(|row| row.iter().rev().copied());
            let mirrored = Raster::from_vec(64, 64, rows.collect());
            let mut wrong = all;
            wrong[face] = &mirrored;
            assert!(error(&CubeMap::from_sky_box(wrong, SkyBoxTurn::Front, &pose(), None)) > 60.0, "{face}");
            let mut wrong = all;
            wrong.swap(face, (face + 1) % 6);
            assert!(error(&CubeMap::from_sky_box(wrong, SkyBoxTurn::Front, &pose(), None)) > 60.0, "{face}");
        }
    }

    #[test]
    fn an_equirectangular_photograph_is_right_to_its_poles() {
        for yaw in [0.0, 0.7] {
            let photo = taken(&Camera::equirectangular(pose().turned(yaw, 0.0), 512));
            let cube = CubeMap::from_equirectangular(&photo, yaw, &pose(), None);
            assert_eq!(cube.size(), 224, "512 · 1.25 / π, in steps of 32");
            // A turn about an axis 0.03 rad off the vertical turns the heading by a slightly different angle.
            let bound = if yaw == 0.0 { 2.0 } else { 4.0 };
            assert!(error(&cube) < bound, "{yaw}: {}", error(&cube));
        }
        let photo = taken(&Camera::equirectangular(pose(), 512));
        assert!(error(&CubeMap::from_equirectangular(&photo, 0.7, &pose(), Some(64))) > 50.0);
    }
}
