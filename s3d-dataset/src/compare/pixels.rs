//! Compares the pixels of two images of a modality.

use super::comparison::{LabelCounts, LabelPairs, PixelChanges, Side};
use super::names::{Change, MISSING, Names};
use crate::export::modality::NO_CLASS;
use crate::verify::images::pixels::Pixels;
use s3d_geom::Raster;
use s3d_io::dataset::{DepthUnits, Domain};
use s3d_label::Taxonomy;
use s3d_render::{BORDER_UNITS, MISSING_DEPTH, MISSING_DISTANCE, MISSING_INDEX, MISSING_NORMAL};

/// The colour of pixels that see nothing in pretty images.
const MISSING_COLOR: [u8; 3] = [0; 3];

/// What the numbers of both images mean.
pub(crate) struct Meaning<'a> {
    pub(crate) depth_units: DepthUnits,
    pub(crate) names: Option<&'a Names>,
    pub(crate) taxonomies: [&'a Taxonomy; 2],
}

/// Sums over the pixels of one or more images.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub(crate) struct Sums {
    pub(crate) pixels: u64,
    pub(crate) changed: u64,
    /// For labels and classes, the pixels whose numbers, names or colours differ and mean the same.
    pub(crate) renumbered: u64,
    /// For colours, the sum of squared differences and the number of channel values.
    squares: u64,
    samples: u64,
    /// For modalities with a distance, sums over the pixels that see something in both.
    total: f64,
    seen: u64,
    largest: f64,
}

impl Sums {
    /// Adds the sums of another image.
    pub(crate) fn add(&mut self, other: &Self) {
        self.pixels += other.pixels;
        self.changed += other.changed;
        self.renumbered += other.renumbered;
        self.squares += other.squares;
        self.samples += other.samples;
        self.total += other.total;
        self.seen += other.seen;
        self.largest = self.largest.max(other.largest);
    }

    pub(crate) fn changes(&self) -> PixelChanges {
        let psnr_db = (self.squares > 0).then(|| {
            let mean_square = self.squares as f64 / self.samples as f64;
            10.0 * libm::log10(255.0 * 255.0 / mean_square)
        });
        PixelChanges {
            pixels: self.pixels,
            pixels_changed: self.changed,
            psnr_db,
            mean: (self.seen > 0).then(|| self.total / self.seen as f64),
            largest: (self.seen > 0).then_some(self.largest),
        }
    }

    /// Adds pixels whose labels differ like this. `is_equal` says whether their values are equal.
    fn add_run(&mut self, change: Change, is_equal: bool, pixels: u64) {
        if change.is_true() {
            self.changed += pixels;
        } else if change == Change::Renumbered || !is_equal {
            self.renumbered += pixels;
        }
    }

    /// Compares pixel by pixel: whether the pixels are the same, and how far apart they are if both see
    /// something.
    fn of<T: Copy>(
        a: &Raster<T>,
        b: &Raster<T>,
        is_same: impl Fn(T, T) -> bool,
        distance: impl Fn(T, T) -> Option<f64>,
    ) -> Self {
        let mut sums = Self { pixels: a.len() as u64, ..Self::default() };
        for (&a, &b) in a.pixels().iter().zip(b.pixels()) {
            let is_same = is_same(a, b);
            sums.changed += u64::from(!is_same);
            if let Some(distance) = distance(a, b).filter(|distance| distance.is_finite()) {
                sums.seen += 1;
                if !is_same {
                    sums.total += distance;
                    sums.largest = sums.largest.max(distance);
                }
            }
        }
        sums
    }
}

/// Returns whether the values of a modality are numbers of segments, which have no distance.
fn is_number(domain: Domain) -> bool {
    matches!(domain, Domain::SegmentUnsup2d | Domain::SegmentUnsup25d)
}

/// Compares two images of a modality, and adds differing labels to `pairs`. Returns `None` if the sizes
/// differ. An error says which side's image is wrong, and why.
pub(crate) fn compare(
    (a, b): (&Pixels, &Pixels),
    domain: Domain,
    meaning: &Meaning<'_>,
    pairs: &mut LabelPairs,
) -> Result<Option<Sums>, (Side, String)> {
    if a.size() != b.size() {
        return Ok(None);
    }

    Ok(Some(match (a, b) {
        (Pixels::Color(a), Pixels::Color(b)) => match domain {
            Domain::Semantic => labels(a, b, meaning, pairs)?,
            // The matrix of labels counts pixels once.
            Domain::SemanticRefined => labels(a, b, meaning, &mut LabelPairs::new())?,
            Domain::SemanticPretty => label_colors(a, b, meaning),
            Domain::Normal => Sums::of(a, b, |a, b| a == b, normal_angle),
            Domain::Rgb | Domain::PrincipalCurvature => colors(a, b),
            // The other modalities have no colours.
            _ => return Ok(None),
        },
        (Pixels::Depth(a), Pixels::Depth(b)) if is_number(domain) => {
            Sums::of(a, b, |a, b| a == b, |_, _| None)
        }
        (Pixels::Depth(a), Pixels::Depth(b)) if domain == Domain::BoundaryDistance => {
            let distance = |a: u16, b: u16| Some(f64::from(a.abs_diff(b)) / BORDER_UNITS);
            let is_seen = |value: u16| value != MISSING_DISTANCE;
            Sums::of(a, b, |a, b| a == b, |a, b| distance(a, b).filter(|_| is_seen(a) && is_seen(b)))
        }
        (Pixels::Gray(a), Pixels::Gray(b)) => {
            Sums::of(a, b, |a, b| a == b, |a, b| Some(f64::from(a.abs_diff(b))))
        }
        (Pixels::Depth(a), Pixels::Depth(b)) => {
            let units_per_m = meaning.depth_units.per_m();
            Sums::of(
                a,
                b,
                |a, b| a == b,
                |a, b| {
                    let both_seen = a != MISSING_DEPTH && b != MISSING_DEPTH;
                    both_seen.then(|| f64::from(a.abs_diff(b)) / units_per_m)
                },
            )
        }
        (Pixels::Class(a, _), Pixels::Class(b, _)) => classes(a, b, meaning)?,
        (Pixels::Xyz(a), Pixels::Xyz(b)) => {
            Sums::of(a, b, |a, b| a.map(f32::to_bits) == b.map(f32::to_bits), distance)
        }
        // All images of a modality have the same kind of pixels, and half floats were converted.
        (
            Pixels::Color(_)
            | Pixels::Depth(_)
            | Pixels::Gray(_)
            | Pixels::Class(..)
            | Pixels::Xyz(_)
            | Pixels::XyzHalf(_),
            _,
        ) => {
            return Ok(None);
        }
    }))
}

fn colors(a: &Raster<[u8; 3]>, b: &Raster<[u8; 3]>) -> Sums {
    let mut sums = Sums::of(a, b, |a, b| a == b, |_, _| None);
    let a = a.pixels().as_flattened();
    let b = b.pixels().as_flattened();
    sums.squares = a.iter().zip(b).map(|(a, b)| u64::from(a.abs_diff(*b)).pow(2)).sum();
    sums.samples = a.len() as u64;
    sums
}

/// The angle between two normals, degrees. `None` if one is missing.
fn normal_angle(a: [u8; 3], b: [u8; 3]) -> Option<f64> {
    if a == MISSING_NORMAL || b == MISSING_NORMAL {
        return None;
    }
    if a == b {
        return Some(0.0);
    }
    let a = direction(a);
    let b = direction(b);
    Some(libm::atan2(a.cross(b).length(), a.dot(b)).to_degrees())
}

/// The direction of a normal's colour, not of unit length.
fn direction(color: [u8; 3]) -> glam::DVec3 {
    glam::DVec3::from_array(color.map(|c| f64::from(c) - 127.5))
}

/// The distance between two points, metres. `None` if one is missing.
fn distance(a: [f32; 3], b: [f32; 3]) -> Option<f64> {
    let [p, q] = [a, b].map(|point| glam::DVec3::from_array(point.map(f64::from)));
    (a != [0.0; 3] && b != [0.0; 3]).then(|| p.distance(q))
}

/// Compares label images by the instances that their numbers mean.
fn labels(
    a: &Raster<[u8; 3]>,
    b: &Raster<[u8; 3]>,
    meaning: &Meaning<'_>,
    pairs: &mut LabelPairs,
) -> Result<Sums, (Side, String)> {
    let Some(names) = meaning.names else { return Err((Side::A, "the labels could not be read".to_owned())) };

    let number = |side, pixel: [u8; 3]| {
        if pixel == MISSING_INDEX {
            return Ok(MISSING);
        }
        let index = u32::from_be_bytes([0, pixel[0], pixel[1], pixel[2]]);
        names.at(side, index).ok_or_else(|| {
            let count = names.count(side);
            (side, format!("a pixel has label {index}, and the data set has {count} labels"))
        })
    };

    let mut sums = Sums { pixels: a.len() as u64, ..Sums::default() };
    for (a, b, pixels) in runs(a, b) {
        let labels = (number(Side::A, a)?, number(Side::B, b)?);
        let change = names.change(labels.0, labels.1);
        if change != Change::None {
            *pairs.entry(labels).or_default() += LabelCounts { pixels, ..LabelCounts::default() };
        }
        sums.add_run(change, a == b, pixels);
    }

    Ok(sums)
}

/// Compares the colours of labels by the instances that they mean. Colours that no label has are compared as
/// they are.
fn label_colors(a: &Raster<[u8; 3]>, b: &Raster<[u8; 3]>, meaning: &Meaning<'_>) -> Sums {
    let number = |side, color| match color {
        MISSING_COLOR => Some(MISSING),
        color => meaning.names.and_then(|names| names.of_color(side, color)),
    };

    let mut sums = Sums { pixels: a.len() as u64, ..Sums::default() };
    for (a, b, pixels) in runs(a, b) {
        let change = match (meaning.names, number(Side::A, a), number(Side::B, b)) {
            (Some(names), Some(a), Some(b)) => names.change(a, b),
            _ if a == b => Change::None,
            _ => Change::Instance,
        };
        sums.add_run(change, a == b, pixels);
    }
    sums
}

/// The runs of equal pairs of pixels: the pixel in A, the pixel in B, and their number.
fn runs(a: &Raster<[u8; 3]>, b: &Raster<[u8; 3]>) -> Vec<([u8; 3], [u8; 3], u64)> {
    let mut runs: Vec<([u8; 3], [u8; 3], u64)> = Vec::new();
    for (&a, &b) in a.pixels().iter().zip(b.pixels()) {
        match runs.last_mut() {
            Some(run) if (run.0, run.1) == (a, b) => run.2 += 1,
            _ => runs.push((a, b, 1)),
        }
    }
    runs
}

/// Compares class images by the names of classes.
fn classes(a: &Raster<u8>, b: &Raster<u8>, meaning: &Meaning<'_>) -> Result<Sums, (Side, String)> {
    let names_a = class_names(Side::A, meaning.taxonomies[0], a)?;
    let names_b = class_names(Side::B, meaning.taxonomies[1], b)?;
    let is_same = |a: u8, b: u8| names_a.get(usize::from(a)) == names_b.get(usize::from(b));
    let mut sums = Sums::of(a, b, is_same, |_, _| None);
    let both = a.pixels().iter().zip(b.pixels());
    sums.renumbered = both.filter(|&(&a, &b)| a != b && is_same(a, b)).count() as u64;
    Ok(sums)
}

/// The names of a taxonomy's classes, if it has every class of an image.
fn class_names<'t>(
    side: Side,
    taxonomy: &'t Taxonomy,
    image: &Raster<u8>,
) -> Result<Vec<&'t str>, (Side, String)> {
    let names: Vec<&str> = taxonomy.classes().iter().map(|class| class.name()).collect();
    let mut places = image.pixels().iter();
    match places.find(|place| **place != NO_CLASS && usize::from(**place) >= names.len()) {
        None => Ok(names),
        Some(place) => {
            Err((side, format!("a pixel has class {place}, and the taxonomy has {}", names.len())))
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_label::LabelTable;

    fn sums(a: Pixels, b: Pixels, domain: Domain) -> PixelChanges {
        let taxonomy = Taxonomy::s3dis();
        let meaning =
            Meaning { depth_units: DepthUnits::Per512, names: None, taxonomies: [&taxonomy, &taxonomy] };
        compare((&a, &b), domain, &meaning, &mut LabelPairs::new())
            .unwrap()
            .unwrap()
            .changes()
    }

    fn color(pixels: &[[u8; 3]]) -> Pixels {
        Pixels::Color(Raster::from_vec(pixels.len() as u32, 1, pixels.to_vec()))
    }

    fn depth(values: &[u16]) -> Pixels {
        Pixels::Depth(Raster::from_vec(values.len() as u32, 1, values.to_vec()))
    }

    fn xyz(points: &[[f32; 3]]) -> Pixels {
        Pixels::Xyz(Raster::from_vec(points.len() as u32, 1, points.to_vec()))
    }

    fn image(classes: &[u8]) -> Pixels {
        Pixels::Class(Raster::from_vec(classes.len() as u32, 1, classes.to_vec()), Vec::new())
    }

    fn place(taxonomy: &Taxonomy, class: &str) -> u8 {
        taxonomy.class(class).unwrap().index() as u8
    }

    #[test]
    fn colours_have_a_ratio_of_signal_to_noise() {
        let same = sums(color(&[[1, 2, 3]; 2]), color(&[[1, 2, 3]; 2]), Domain::Rgb);
        assert_eq!((same.pixels, same.pixels_changed, same.psnr_db), (2, 0, None));
        let other = sums(color(&[[1, 2, 3]; 2]), color(&[[1, 2, 3], [1, 8, 3]]), Domain::Rgb);
        // 36 over 6 channel values is a mean of 6.
        let expected = 10.0 * (255.0f64 * 255.0 / 6.0).log10();
        assert_eq!((other.pixels_changed, other.mean), (1, None));
        assert!((other.psnr_db.unwrap() - expected).abs() < 1e-9, "{other:?}");
    }

    #[test]
    fn normals_differ_by_angles_and_depth_by_metres() {
        let (x, z, none) = ([255, 127, 127], [127, 127, 255], MISSING_NORMAL);
        let found = sums(color(&[x, x, x, none]), color(&[x, z, none, none]), Domain::Normal);
        assert_eq!((found.pixels, found.pixels_changed), (4, 2));
        let (mean, largest) = (found.mean.unwrap(), found.largest.unwrap());
        assert!((largest - 90.0).abs() < 0.7 && (mean - largest / 2.0).abs() < 1e-12, "{found:?}");

        let found = sums(depth(&[512, 512, 9, 65_535]), depth(&[512, 256, 65_535, 65_535]), Domain::Depth);
        assert_eq!((found.pixels_changed, found.mean, found.largest), (2, Some(0.25), Some(0.5)));

        let (a, b) = ([[1.0, 1.0, 1.0], [0.0; 3]], [[1.0, 4.0, 5.0], [2.0; 3]]);
        let found = sums(xyz(&a), xyz(&b), Domain::GlobalXyz);
        assert_eq!((found.pixels_changed, found.mean, found.largest), (2, Some(5.0), Some(5.0)));
    }

    #[test]
    fn classes_are_compared_by_name_and_must_be_known() {
        let (s3dis, nyu40) = (Taxonomy::s3dis(), Taxonomy::built_in("nyu40").unwrap());
        let a = image(&[place(&s3dis, "chair"), NO_CLASS, place(&s3dis, "beam")]);
        let b = [place(&nyu40, "chair"), NO_CLASS, place(&nyu40, "wall")];
        assert_ne!(place(&s3dis, "chair"), place(&nyu40, "chair"));
        let meaning = Meaning { depth_units: DepthUnits::Per512, names: None, taxonomies: [&s3dis, &nyu40] };
        let of = |b: &Pixels| compare((&a, b), Domain::SemanticClass, &meaning, &mut LabelPairs::new());

        assert_eq!(of(&image(&b)).unwrap().unwrap().changed, 1);
        let e = of(&image(&[b[0], 77, b[2]])).unwrap_err();
        assert_eq!(e, (Side::B, "a pixel has class 77, and the taxonomy has 40".to_owned()));
    }

    #[test]
    fn sizes_must_be_equal_and_labels_known() {
        let table = LabelTable::from_labels(["chair_1_office_1_1".parse().unwrap()]).unwrap();
        let taxonomy = Taxonomy::s3dis();
        let names = Names::of_tables(Some(&table), Some(&table));
        let meaning = Meaning {
            depth_units: DepthUnits::Per512,
            names: Some(&names),
            taxonomies: [&taxonomy, &taxonomy],
        };
        let mut pairs = LabelPairs::new();

        let mut of = |a: &Pixels, b: &Pixels| compare((a, b), Domain::Semantic, &meaning, &mut pairs);
        let chair = [0, 0, 1];
        assert_eq!(of(&color(&[chair]), &color(&[chair; 2])), Ok(None));
        let e = of(&color(&[chair]), &color(&[[0, 1, 0]])).unwrap_err();
        assert_eq!(e, (Side::B, "a pixel has label 256, and the data set has 2 labels".to_owned()));

        let a = color(&[chair, chair, [0; 3], MISSING_INDEX]);
        let b = color(&[chair, MISSING_INDEX, chair, MISSING_INDEX]);
        assert_eq!(of(&a, &b).unwrap().unwrap().changed, 2);
        let found: Vec<_> = pairs.iter().map(|(labels, counts)| (*labels, counts.pixels)).collect();
        assert_eq!(found, [((0, 1), 1), ((1, MISSING), 1)]);
    }
}
