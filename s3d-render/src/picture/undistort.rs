//! Photographs as a pinhole would have taken them.

use glam::{DVec2, dvec3};
use s3d_geom::{Camera, PhotoLens, Raster};

/// The most samples along a side of a pixel: a photograph that becomes a sixteenth as wide is still its mean.
const MOST_SAMPLES: f64 = 16.0;

/// A pixel that sees a little more of the photograph than one of its pixels takes one sample all the same.
const LITTLE_MORE: f64 = 0.2;

/// What `camera`, a pinhole, would have taken from the place and in the direction in which `photo` was taken
/// through `lens`: its focal lengths, principal point and size count, its pose does not. A pixel is the mean
/// of what it sees of the photograph, of values as they are stored; 0, 0, 0 if its centre lies outside of the
/// photograph, and else at least 1, 1, 1. Where lens and camera agree, pixels are those of the photograph.
///
/// ```
/// use s3d_geom::{Camera, Lens, PhotoLens, Pose, Raster, glam::{DVec3, dvec2}};
/// use s3d_render::undistort;
///
/// // k₁ > 0 draws the corners outwards: what a pinhole sees there lies beside the photograph.
/// let (f, c) = (dvec2(30.0, 30.0), dvec2(32.0, 24.0));
/// let lens = PhotoLens::Straight(Lens::new([64, 48], f, c, [0.2, 0.0, 0.0, 0.0, 0.0]).unwrap());
/// let camera = Camera::pinhole(Pose::level(DVec3::ZERO, 0.0), f, c, 64, 48)?;
/// let image = undistort(&Raster::filled(64, 48, [9, 8, 0]), &lens, &camera);
/// assert_eq!((image.at(32, 24), image.at(0, 0)), ([9, 8, 1], [0, 0, 0]));
/// # Ok::<(), s3d_geom::CameraError>(())
/// ```
///
/// # Panics
/// If the photograph has not the lens's size, or the camera is a panorama.
pub fn undistort(photo: &Raster<[u8; 3]>, lens: &PhotoLens, camera: &Camera) -> Raster<[u8; 3]> {
    assert_eq!(
        [photo.width(), photo.height()],
        lens.size(),
        "a photograph is as large as its lens's picture"
    );
    assert!(!camera.is_panorama(), "a photograph is undistorted to a pinhole");
    let (width, height) = (camera.width, camera.height);
    let (f, c) = (camera.focal_px(), camera.center_px());
    // Places of the photograph's plane, by row: one column and one row more than there are pixels, so that
    // each pixel knows how large it is.
    let places_of = |y: u32, places: &mut Vec<Option<DVec2>>| {
        places.clear();
        let down = (f64::from(y) + 0.5 - c.y) / f.y;
        let place = |x: u32| lens.project(dvec3((f64::from(x) + 0.5 - c.x) / f.x, down, 1.0));
        places.extend((0..=width).map(place));
    };
    let size = DVec2::new(f64::from(photo.width()), f64::from(photo.height()));
    let (mut here, mut below) = (Vec::new(), Vec::new());
    places_of(0, &mut here);
    let mut image = Raster::filled(width, height, [0; 3]);
    for (y, row) in (0..height).zip(image.pixels_mut().chunks_mut(width as usize)) {
        places_of(y + 1, &mut below);
        for ((pixel, at), down) in row.iter_mut().zip(here.windows(2)).zip(&below) {
            let Some(place) = at[0].filter(|p| p.cmpge(DVec2::ZERO).all() && p.cmple(size).all()) else {
                continue;
            };
            // At the end of a lens a neighbour may have no place: then a pixel is as large as one there.
            let right = at[1].map_or(DVec2::X, |right| right - place);
            let down = down.map_or(DVec2::Y, |down| down - place);
            *pixel = mean(photo, place, right, down);
        }
        std::mem::swap(&mut here, &mut below);
    }
    image
}

/// The mean of a photograph over the parallelogram around `place` with these sides.
fn mean(photo: &Raster<[u8; 3]>, place: DVec2, right: DVec2, down: DVec2) -> [u8; 3] {
    let count = |side: DVec2| (side.length() - LITTLE_MORE).ceil().clamp(1.0, MOST_SAMPLES) as u32;
    let (columns, rows) = (count(right), count(down));
    let mut sum = [0.0; 3];
    for j in 0..rows {
        for i in 0..columns {
            let part = |k: u32, of: u32| (f64::from(k) + 0.5) / f64::from(of) - 0.5;
            let sample = bilinear(photo, place + right * part(i, columns) + down * part(j, rows));
            sum = std::array::from_fn(|k| sum[k] + sample[k]);
        }
    }
    let samples = f64::from(rows * columns);
    sum.map(|v| ((v / samples).round() as u8).max(1))
}

/// The photograph at a place between the centres of its pixels; beyond the outermost it goes on as they are.
fn bilinear(photo: &Raster<[u8; 3]>, place: DVec2) -> [f64; 3] {
    let last = DVec2::new(f64::from(photo.width() - 1), f64::from(photo.height() - 1));
    let p = (place - 0.5).clamp(DVec2::ZERO, last);
    let (x, y) = (p.x as u32, p.y as u32);
    let (s, t) = (p.x - f64::from(x), p.y - f64::from(y));
    let (right, down) = ((x + 1).min(photo.width() - 1), (y + 1).min(photo.height() - 1));
    let [a, b, c, d] =
        [(x, y), (right, y), (x, down), (right, down)].map(|(x, y)| photo.at(x, y).map(f64::from));
    std::array::from_fn(|k| {
        let (upper, lower) = (a[k] + (b[k] - a[k]) * s, c[k] + (d[k] - c[k]) * s);
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

    /// Two waves that no pixel cuts off: their phases tell where a pixel comes from.
    fn pattern(place: DVec2) -> [u8; 3] {
        let wave = |v: f64| (128.0 + 100.0 * (v / 9.0).sin()).round() as u8;
        [wave(place.x), wave(place.y), wave(place.x + place.y)]
    }

    fn photo(size: [u32; 2], of: impl Fn(DVec2) -> [u8; 3]) -> Raster<[u8; 3]> {
        let [w, h] = size;
        let at = |i: u32| of(dvec2(f64::from(i % w) + 0.5, f64::from(i / w) + 0.5));
        Raster::from_vec(w, h, (0..w * h).map(at).collect())
    }

    #[test]
    fn a_pinholes_photograph_stays_as_it_is() {
        let (size, f, c) = ([61, 47], dvec2(50.0, 52.0), dvec2(29.0, 24.5));
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

    /// Every pixel against the formulas of OpenCV, written out again: those of projectPoints, and of the
    /// fisheye module.
    #[test]
    fn pixels_come_from_where_the_formulas_put_them() {
        let (size, f, c) = ([160, 120], dvec2(90.0, 92.0), dvec2(78.0, 61.0));
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
        let (size, f, c) = ([160, 120], dvec2(90.0, 90.0), dvec2(80.0, 60.0));
        let lens = PhotoLens::Straight(Lens::new(size, f, c, [0.0; 5]).unwrap());
        // One pixel in four is white: a pixel that took one would be black or white.
        let dots = photo(size, |p| [if p.x as u32 % 2 + p.y as u32 % 2 == 0 { 255 } else { 0 }; 3]);
        let image = undistort(&dots, &lens, &camera(f / 8.0, c / 8.0, 20, 15));
        assert!(image.pixels().iter().all(|p| p[0].abs_diff(64) <= 1), "{:?}", image.at(3, 3));
    }

    #[test]
    fn what_a_fisheye_sees_beside_it_has_no_place_in_a_pinhole() {
        let (size, f, c) = ([100, 100], dvec2(30.0, 30.0), dvec2(50.0, 50.0));
        let lens = PhotoLens::Fisheye(FisheyeLens::new(size, f, c, [0.0; 4]).unwrap());
        let image = undistort(&photo(size, |_| [200; 3]), &lens, &camera(f, c, 100, 100));
        assert!(image.pixels().iter().all(|p| *p == [200; 3]));
    }
}
