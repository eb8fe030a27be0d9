//! Turns photographs into pinhole images.

use glam::{DVec2, dvec3};
use s3d_geom::{Camera, PhotoLens, Raster};

/// The most samples along a side of a pixel: a photograph can shrink to a sixteenth of its width and still be
/// averaged.
const MOST_SAMPLES: f64 = 16.0;

/// A pixel that covers at most this much more than one pixel of the photograph still takes one sample.
const LITTLE_MORE: f64 = 0.2;

/// Returns the image that `camera`, a pinhole, would have taken from the place and in the direction of
/// `photo`, which was taken through `lens`. The camera's focal lengths, principal point and size count; its
/// pose does not. A pixel is the mean of the area of the photograph that it covers, in values as they are
/// stored. It is 0, 0, 0 if its centre is outside the photograph, and otherwise at least 1, 1, 1. If lens and
/// camera agree, the pixels of the photograph are copied.
///
/// ```
/// use s3d_geom::{Camera, Lens, PhotoLens, Pose, Raster, glam::{DVec3, dvec2}};
/// use s3d_render::undistort;
///
/// // k₁ > 0 pushes the corners outwards: the pinhole's corners lie outside the photograph.
/// let f = dvec2(30.0, 30.0);
/// let c = dvec2(32.0, 24.0);
/// let lens = PhotoLens::Straight(Lens::new([64, 48], f, c, [0.2, 0.0, 0.0, 0.0, 0.0]).unwrap());
/// let camera = Camera::pinhole(Pose::level(DVec3::ZERO, 0.0), f, c, 64, 48)?;
/// let image = undistort(&Raster::filled(64, 48, [9, 8, 0]), &lens, &camera);
/// assert_eq!((image.at(32, 24), image.at(0, 0)), ([9, 8, 1], [0, 0, 0]));
/// # Ok::<(), s3d_geom::CameraError>(())
/// ```
///
/// # Panics
/// If the photograph does not have the lens's size, or the camera is a panorama.
pub fn undistort(photo: &Raster<[u8; 3]>, lens: &PhotoLens, camera: &Camera) -> Raster<[u8; 3]> {
    assert_eq!(
        [photo.width(), photo.height()],
        lens.size(),
        "a photograph is as large as its lens's picture"
    );
    assert!(!camera.is_panorama(), "a photograph is undistorted to a pinhole");

    let width = camera.width;
    let height = camera.height;
    let f = camera.focal_px();
    let c = camera.center_px();
    // The places in the photograph of a row of pixels. There is one column and one row more than there are
    // pixels, so that the size of every pixel is known.
    let places_of = |y: u32, places: &mut Vec<Option<DVec2>>| {
        places.clear();
        let down = (f64::from(y) + 0.5 - c.y) / f.y;
        places.extend((0..=width).map(|x| lens.project(dvec3((f64::from(x) + 0.5 - c.x) / f.x, down, 1.0))));
    };

    let size = DVec2::new(f64::from(photo.width()), f64::from(photo.height()));
    let mut here = Vec::new();
    let mut below = Vec::new();
    places_of(0, &mut here);
    let mut image = Raster::filled(width, height, [0; 3]);

    for (y, row) in (0..height).zip(image.pixels_mut().chunks_mut(width as usize)) {
        places_of(y + 1, &mut below);
        for ((pixel, at), down) in row.iter_mut().zip(here.windows(2)).zip(&below) {
            let Some(place) = at[0].filter(|p| p.cmpge(DVec2::ZERO).all() && p.cmple(size).all()) else {
                continue;
            };
            // At the end of a lens a neighbour may have no place. The pixel then has the size of a pixel of
            // the photograph.
            let right = at[1].map_or(DVec2::X, |right| right - place);
            let down = down.map_or(DVec2::Y, |down| down - place);
            *pixel = mean(photo, place, right, down);
        }
        std::mem::swap(&mut here, &mut below);
    }
    image
}

/// Returns the mean of a photograph over the parallelogram around `place` with these sides.
fn mean(photo: &Raster<[u8; 3]>, place: DVec2, right: DVec2, down: DVec2) -> [u8; 3] {
    let columns = samples_along(right);
    let rows = samples_along(down);
    let mut sum = [0.0; 3];
    for j in 0..rows {
        for i in 0..columns {
            let at = place + right * sample_offset(i, columns) + down * sample_offset(j, rows);
            let sample = bilinear(photo, at);
            sum = std::array::from_fn(|k| sum[k] + sample[k]);
        }
    }
    let samples = f64::from(rows * columns);
    sum.map(|v| ((v / samples).round() as u8).max(1))
}

/// Returns the number of samples along a side of a parallelogram.
fn samples_along(side: DVec2) -> u32 {
    (side.length() - LITTLE_MORE).ceil().clamp(1.0, MOST_SAMPLES) as u32
}

/// Returns the position of sample `k` of `count` along a side, −½ to ½.
fn sample_offset(k: u32, count: u32) -> f64 {
    (f64::from(k) + 0.5) / f64::from(count) - 0.5
}

/// Returns the photograph's colour at a place, bilinearly. Beyond the outermost centres of pixels, the colour
/// stays the same.
fn bilinear(photo: &Raster<[u8; 3]>, place: DVec2) -> [f64; 3] {
    let last = DVec2::new(f64::from(photo.width() - 1), f64::from(photo.height() - 1));
    let p = (place - 0.5).clamp(DVec2::ZERO, last);
    let x = p.x as u32;
    let y = p.y as u32;
    let s = p.x - f64::from(x);
    let t = p.y - f64::from(y);
    let right = (x + 1).min(photo.width() - 1);
    let down = (y + 1).min(photo.height() - 1);
    let [a, b, c, d] =
        [(x, y), (right, y), (x, down), (right, down)].map(|(x, y)| photo.at(x, y).map(f64::from));
    std::array::from_fn(|k| {
        let upper = a[k] + (b[k] - a[k]) * s;
        let lower = c[k] + (d[k] - c[k]) * s;
        upper + (lower - upper) * t
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DVec3, dvec2};
    use s3d_geom::{FisheyeLens, Lens, Pose};

    fn camera(f: DVec2, c: DVec2, width: u32, height: u32) -> Camera {
        Camera::pinhole(Pose::level(DVec3::ZERO, 0.7), f, c, width, height).unwrap()
    }

    fn wave(v: f64) -> u8 {
        (128.0 + 100.0 * (v / 9.0).sin()).round() as u8
    }

    /// Two waves that are too long to be blurred: their phases tell where a pixel comes from.
    fn pattern(place: DVec2) -> [u8; 3] {
        [wave(place.x), wave(place.y), wave(place.x + place.y)]
    }

    fn photo(size: [u32; 2], of: impl Fn(DVec2) -> [u8; 3]) -> Raster<[u8; 3]> {
        let [w, h] = size;
        let pixels = (0..w * h).map(|i| of(dvec2(f64::from(i % w) + 0.5, f64::from(i / w) + 0.5)));
        Raster::from_vec(w, h, pixels.collect())
    }

    #[test]
    fn a_pinholes_photograph_stays_as_it_is() {
        let size = [61, 47];
        let f = dvec2(50.0, 52.0);
        let c = dvec2(29.0, 24.5);
        let lens = PhotoLens::Straight(Lens::new(size, f, c, [0.0; 5]).unwrap());
        let noise = photo(size, |p| [(p.x * 37.0) as u8, (p.y * 91.0) as u8, (p.x * p.y) as u8]);
        let image = undistort(&noise, &lens, &camera(f, c, 61, 47));
        assert!(
            image
                .pixels()
                .iter()
                .zip(noise.pixels())
                .all(|(a, b)| *a == b.map(|v| v.max(1)))
        );
    }

    /// Compares every pixel with OpenCV's formulas, written out again: `projectPoints`, and the fisheye
    /// module.
    #[test]
    fn pixels_come_from_where_the_formulas_put_them() {
        let size = [160, 120];
        let f = dvec2(90.0, 92.0);
        let c = dvec2(78.0, 61.0);
        let k = [-0.21, 0.06, 0.0015, -0.0011, 0.004];
        let straight = PhotoLens::Straight(Lens::new(size, f, c, k).unwrap());
        let radial = |x: f64, y: f64| {
            let [k1, k2, p1, p2, k3] = k;
            let r2 = x * x + y * y;
            let q = 1.0 + k1 * r2 + k2 * r2.powi(2) + k3 * r2.powi(3);
            let bent = [
                x * q + 2.0 * p1 * x * y + p2 * (r2 + 2.0 * x * x),
                y * q + p1 * (r2 + 2.0 * y * y) + 2.0 * p2 * x * y,
            ];
            f * DVec2::from(bent) + c
        };

        let k = [0.03, -0.012, 0.004, -0.0006];
        let fisheye = PhotoLens::Fisheye(FisheyeLens::new(size, f, c, k).unwrap());
        let angular = |x: f64, y: f64| {
            let r = x.hypot(y);
            let t = r.atan();
            let bent = t * (1.0 + k[0] * t.powi(2) + k[1] * t.powi(4) + k[2] * t.powi(6) + k[3] * t.powi(8));
            f * dvec2(x, y) * (bent / r) + c
        };

        let out = camera(dvec2(80.0, 80.0), dvec2(80.0, 60.0), 160, 120);
        type Formula<'f> = &'f dyn Fn(f64, f64) -> DVec2;
        let cases: [(PhotoLens, Formula<'_>); 2] = [(straight, &radial), (fisheye, &angular)];

        for (lens, formula) in cases {
            let image = undistort(&photo(size, pattern), &lens, &out);
            let mut masked = 0;
            for (x, y) in (0..160).flat_map(|x| (0..120).map(move |y| (x, y))) {
                let place = formula((f64::from(x) + 0.5 - 80.0) / 80.0, (f64::from(y) + 0.5 - 60.0) / 80.0);
                let inside = place.cmpge(DVec2::ZERO).all() && place.cmple(dvec2(160.0, 120.0)).all();
                let found = image.at(x, y);
                assert_eq!(found != [0; 3], inside, "({x}, {y}) comes from {place}");
                masked += u32::from(!inside);
                // At the rim there is nothing to interpolate with.
                if inside && place.cmpgt(DVec2::ONE).all() && place.cmplt(dvec2(159.0, 119.0)).all() {
                    let off = (0..3).map(|k| found[k].abs_diff(pattern(place)[k])).max();
                    assert!(off <= Some(3), "({x}, {y}): {found:?}, and at {place} is {:?}", pattern(place));
                }
            }
            assert!((1..9000).contains(&masked), "{masked}");
        }
    }

    #[test]
    fn a_photograph_that_shrinks_is_averaged() {
        let size = [160, 120];
        let f = dvec2(90.0, 90.0);
        let c = dvec2(80.0, 60.0);
        let lens = PhotoLens::Straight(Lens::new(size, f, c, [0.0; 5]).unwrap());
        // One pixel in four is white, so a pixel with one sample would be black or white.
        let dots = photo(size, |p| [if p.x as u32 % 2 + p.y as u32 % 2 == 0 { 255 } else { 0 }; 3]);
        let image = undistort(&dots, &lens, &camera(f / 8.0, c / 8.0, 20, 15));
        assert!(image.pixels().iter().all(|p| p[0].abs_diff(64) <= 1), "{:?}", image.at(3, 3));
    }

    #[test]
    fn what_a_fisheye_sees_beside_it_has_no_place_in_a_pinhole() {
        let size = [100, 100];
        let f = dvec2(30.0, 30.0);
        let c = dvec2(50.0, 50.0);
        let lens = PhotoLens::Fisheye(FisheyeLens::new(size, f, c, [0.0; 4]).unwrap());
        let image = undistort(&photo(size, |_| [200; 3]), &lens, &camera(f, c, 100, 100));
        assert!(image.pixels().iter().all(|p| *p == [200; 3]));
    }
}
