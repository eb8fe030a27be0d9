//! How well a photograph and the mesh agree. Their edges are compared, since light and shade differ.
//!
//! The view is reduced to [`SIDE`] pixels along its longer side. An error of a pixel or two in a pose does
//! not count then, and an error of a few degrees does. The photograph has an edge where its grey changes. The
//! mesh has an edge where its colours, its depth or the direction of its surface change. Both edge images are
//! blurred by about a pixel, and strong edges are weakened. The agreement is the correlation of the two edge
//! images over the pixels that show both, and whose neighbours do: where pictures end, neither has edges,
//! which would make any two alike, noise too. The chance agreement is the mean correlation with the two
//! displaced against each other in eight directions.

use crate::export::input::masks::MaskedPicture;
use crate::export::input::photographs::Photograph;
use glam::DVec3;
use s3d_geom::{Camera, Raster};
use s3d_render::{Caster, Hits, MipMaps, NO_FACE, Scene, rgb_image};

/// Pixels of the longer side.
const SIDE: u32 = 384;

/// How far two pictures are displaced to measure the chance agreement, as a share of the longer side.
const DISPLACED: f64 = 0.1;

/// Fewer pixels that show both give no correlation.
const FEWEST: usize = 500;

/// How far a pixel takes part in the edges of others: by one in a difference, and by two in a blur.
const REACH: usize = 3;

/// A change of depth by this share counts as much as a turn of the surface by a right angle.
const STEP: f64 = 0.2;

/// How well a photograph and the mesh agree.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Agreement {
    /// The correlation of their edges.
    pub(crate) correlation: Option<f64>,
    /// The mean correlation where they are displaced.
    pub(crate) chance: Option<f64>,
}

impl Agreement {
    /// Whether the agreement is no better than chance. No pose that fits does so badly.
    pub(crate) fn is_chance(correlation: f64, chance: f64) -> bool {
        correlation < chance + 0.05 || correlation < 0.1
    }

    /// Compares `picture`, that of `photograph`, with the mesh as its camera sees it.
    pub(crate) fn of(
        picture: &MaskedPicture,
        photograph: &Photograph,
        scene: &Scene<'_>,
        textures: &MipMaps,
    ) -> Self {
        let camera = small(photograph);
        let seen = photograph.colors(picture, &camera);
        let mut hits = Hits::default();
        Caster::new(scene).cast_into(&camera, 1, &mut hits);
        let shown = rgb_image(scene, textures, &hits, &camera);

        let valid: Vec<bool> = seen
            .pixels()
            .iter()
            .zip(hits.face.pixels())
            .map(|(p, f)| *p != [0; 3] && *f != NO_FACE)
            .collect();

        let size = [camera.width as usize, camera.height as usize];
        let photo_edges = edges(&grey(&seen), size, &valid);
        let colour = edges(&grey(&shown), size, &valid);
        let shape = shape_edges(scene, &hits, &camera, &valid);
        let valid = inner(&valid, size);

        // A mesh may have hardly any colours, or hardly any shape: the better agreement counts.
        let [a, b] = [colour, shape].map(|edges| Self::between(&photo_edges, &edges, size, &valid));
        match (a.correlation, b.correlation) {
            (Some(x), Some(y)) if y > x => b,
            (None, _) => b,
            _ => a,
        }
    }

    fn between(photo: &[f64], mesh: &[f64], size: [usize; 2], valid: &[bool]) -> Self {
        let away = (DISPLACED * size[0].max(size[1]) as f64).round() as isize;
        let steps = [-1isize, 0, 1];
        let ring = steps
            .iter()
            .flat_map(|x| steps.iter().map(move |y| (x * away, y * away)));

        let displaced: Vec<f64> = ring
            .filter(|by| *by != (0, 0))
            .filter_map(|by| correlation(photo, mesh, size, valid, by))
            .collect();
        let chance = (!displaced.is_empty()).then(|| displaced.iter().sum::<f64>() / displaced.len() as f64);
        Self { correlation: correlation(photo, mesh, size, valid, (0, 0)), chance }
    }
}

/// The photograph's camera with few pixels.
fn small(photograph: &Photograph) -> Camera {
    let Camera { pose, width, height, .. } = photograph.camera;
    let wanted = f64::from(SIDE) * f64::from(width) / f64::from(width.max(height));
    let width = width.min((wanted.round() as u32).max(1));
    photograph.taken.camera(pose, width).unwrap_or(photograph.camera)
}

/// The luma of sRGB pixels, 0 to 1, as ITU-R BT.601 defines it.
fn grey(image: &Raster<[u8; 3]>) -> Vec<f64> {
    image.pixels().iter().map(luma).collect()
}

fn luma([r, g, b]: &[u8; 3]) -> f64 {
    (0.299 * f64::from(*r) + 0.587 * f64::from(*g) + 0.114 * f64::from(*b)) / 255.0
}

/// How much a picture changes at each pixel: the length of its gradient by central differences, 0 beside
/// pixels that are not valid.
fn edges(values: &[f64], size: [usize; 2], valid: &[bool]) -> Vec<f64> {
    let found = at_inner(size, |i| {
        let [left, right, up, down] = around(i, size[0]);
        let known = [i, left, right, up, down].iter().all(|k| valid[*k]);
        if known {
            length(values[right] - values[left], values[down] - values[up])
        } else {
            0.0
        }
    });
    softened(&found, size)
}

/// How much the mesh's shape changes at each pixel: jumps of depth, and turns of its surface.
fn shape_edges(scene: &Scene<'_>, hits: &Hits, camera: &Camera, valid: &[bool]) -> Vec<f64> {
    let size = [camera.width as usize, camera.height as usize];
    let depth = hits.depth.pixels();
    let faces = hits.face.pixels();
    let found = at_inner(size, |i| {
        let [left, right, up, down] = around(i, size[0]);
        if ![i, left, right, up, down].iter().all(|k| valid[*k]) {
            return 0.0;
        }
        let across = |a: usize, b: usize| {
            // On a plane, the depth of a pixel is the harmonic mean of its two neighbours.
            let [before, here, after] = [a, i, b].map(|k| 1.0 / f64::from(depth[k]).max(1e-6));
            let bend = (before + after - 2.0 * here).abs() / here;
            let [left, right] = [a, b].map(|k| scene.mesh().normal(faces[k]).as_dvec3());
            let turn = 1.0 - left.dot(right).clamp(-1.0, 1.0);
            (bend / STEP).min(1.0) + turn.min(1.0)
        };
        across(left, right) + across(up, down)
    });
    softened(&found, size)
}

fn length(x: f64, y: f64) -> f64 {
    (x * x + y * y).sqrt()
}

/// The value of `of` at each pixel that has four neighbours, 0 at the border.
fn at_inner([width, height]: [usize; 2], of: impl Fn(usize) -> f64) -> Vec<f64> {
    let mut found = vec![0.0; width * height];
    for (y, row) in found
        .chunks_mut(width.max(1))
        .enumerate()
        .skip(1)
        .take(height.saturating_sub(2))
    {
        let inner = row.iter_mut().enumerate().skip(1).take(width.saturating_sub(2));
        inner.for_each(|(x, edge)| *edge = of(y * width + x));
    }
    found
}

fn around(i: usize, width: usize) -> [usize; 4] {
    [i - 1, i + 1, i - width, i + width]
}

/// Whether each pixel has an edge that no border takes part in: all pixels within [`REACH`] are valid.
fn inner(valid: &[bool], size: [usize; 2]) -> Vec<bool> {
    let mut kept = valid.to_vec();
    for _ in 0..REACH {
        let before = std::mem::replace(&mut kept, vec![false; valid.len()]);
        for y in 1..size[1].saturating_sub(1) {
            for x in 1..size[0].saturating_sub(1) {
                let mut rows = (y - 1..=y + 1).map(|row| row * size[0] + x);
                kept[y * size[0] + x] = rows.all(|i| before[i - 1..=i + 1].iter().all(|is| *is));
            }
        }
    }
    kept
}

/// The square roots of the values, so that a few strong edges do not decide, blurred twice over 3 × 3
/// pixels.
fn softened(values: &[f64], size: [usize; 2]) -> Vec<f64> {
    let [width, height] = size;
    let mut blurred: Vec<f64> = values.iter().map(|v| v.sqrt()).collect();
    for _ in 0..2 {
        let before = blurred.clone();
        for y in 1..height.saturating_sub(1) {
            for x in 1..width.saturating_sub(1) {
                let [above, here, below] = [y - 1, y, y + 1]
                    .map(|y| before[y * width + x - 1..=y * width + x + 1].iter().sum::<f64>());
                blurred[y * width + x] = (above + here + below) / 9.0;
            }
        }
    }
    blurred
}

/// Pearson's correlation of two pictures, the second displaced by some pixels, over the pixels that are valid
/// in both places. `None` if these are few, or a picture is flat.
fn correlation(
    a: &[f64],
    b: &[f64],
    [width, height]: [usize; 2],
    valid: &[bool],
    (right, down): (isize, isize),
) -> Option<f64> {
    let mut count = 0usize;
    let mut sums = [0.0; 2];
    let mut squares = DVec3::ZERO;

    for y in 0..height {
        let Some(v) = y.checked_add_signed(down).filter(|v| *v < height) else { continue };
        for x in 0..width {
            let Some(u) = x.checked_add_signed(right).filter(|u| *u < width) else { continue };
            let i = y * width + x;
            let j = v * width + u;
            if !valid[i] || !valid[j] {
                continue;
            }
            count += 1;
            sums = [sums[0] + a[i], sums[1] + b[j]];
            squares += DVec3::new(a[i] * a[i], b[j] * b[j], a[i] * b[j]);
        }
    }

    let n = count as f64;
    let covariance = squares.z - sums[0] * sums[1] / n;
    let variances = [squares.x - sums[0] * sums[0] / n, squares.y - sums[1] * sums[1] / n];
    let is_flat = variances
        .iter()
        .zip([squares.x, squares.y])
        .any(|(v, s)| *v <= 1e-9 * s);

    if count < FEWEST || is_flat {
        None
    } else {
        Some(covariance / (variances[0] * variances[1]).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Noise of this seed, 0 to 1.
    fn noise(mut state: u32) -> Vec<f64> {
        let next = |_| {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            f64::from(state >> 8) / f64::from(1 << 24)
        };
        (0..2400).map(next).collect()
    }

    /// Where pictures end, neither has edges, and half of this one does not show the mesh.
    #[test]
    fn noise_agrees_with_nothing() {
        let size = [60, 40];
        let valid: Vec<bool> = (0..2400).map(|i| i % 60 < 45).collect();
        let [a, b] = [3, 8].map(|seed| edges(&noise(seed), size, &valid));
        let found = Agreement::between(&a, &b, size, &inner(&valid, size));
        let correlation = found.correlation.unwrap();
        assert!(Agreement::is_chance(correlation, found.chance.unwrap()), "{found:?}");
        assert!(correlation.abs() < 0.1, "{found:?}");
        let with_borders = Agreement::between(&a, &b, size, &valid).correlation.unwrap();
        assert!(with_borders > 0.3, "{with_borders}");
    }

    #[test]
    fn a_picture_agrees_with_itself_and_not_with_itself_displaced() {
        let size = [60, 40];
        let noise = noise(1);
        let valid = vec![true; 2400];

        let itself = correlation(&noise, &noise, size, &valid, (0, 0)).unwrap();
        assert!((itself - 1.0).abs() < 1e-9, "{itself}");
        assert!(correlation(&noise, &noise, size, &valid, (7, 3)).unwrap().abs() < 0.1);

        let shifted: Vec<f64> = (0..2400)
            .map(|i| if i % 60 >= 7 { noise[i - 7] } else { 0.0 })
            .collect();
        assert!((correlation(&noise, &shifted, size, &valid, (7, 0)).unwrap() - 1.0).abs() < 1e-9);
        assert_eq!(correlation(&noise, &vec![0.5; 2400], size, &valid, (0, 0)), None);

        let few: Vec<bool> = (0..2400).map(|i| i < FEWEST - 1).collect();
        assert_eq!(correlation(&noise, &noise, size, &few, (0, 0)), None);
    }
}
