//! Guesses what is wrong with a file that differs from the mesh. Each of the usual suspects is tried on some
//! of its pixels.
//!
//! A suspect says what a pixel would show if the fault were that one. It is named if it explains nearly all
//! pixels that differ, and nearly all others.

use crate::export::modality::Image;
use crate::verify::images::pixels::Pixels;
use crate::verify::images::shade::Shade;
use crate::verify::images::{Mismatch, Reference};
use glam::{DMat3, DVec3};
use s3d_geom::{Camera, Pose};
use s3d_io::dataset::{DatasetImage, DepthUnits, Domain, Frame};
use s3d_render::{Hit, MISSING_DEPTH, cast_ray};

/// The number of differing pixels that a suspect is tried on, and the number of others.
const PIXELS: usize = 300;
/// The fewest differing pixels that allow a guess.
const FEWEST: usize = 12;
/// The smallest share of pixels that a suspect must explain to be named.
const EXPLAINED: f64 = 0.93;
/// The largest number of other images that a file is compared with.
const MOST_OTHERS: usize = 400;

/// Which ray a pixel shows instead of its own.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) enum Ray {
    Own,
    MirroredX,
    MirroredY,
    Turned,
    Transposed,
    /// Shifted by pixels to the right and down.
    Shifted(f64, f64),
    /// The ray of another camera.
    Of(Camera),
}

impl Ray {
    /// The camera and the place in its image that this ray goes through, for the pixel (x, y) of an image of
    /// `camera`.
    pub(crate) fn place(self, camera: &Camera, x: u32, y: u32) -> (Camera, f64, f64) {
        let w = f64::from(camera.width);
        let h = f64::from(camera.height);
        let x = f64::from(x) + 0.5;
        let y = f64::from(y) + 0.5;
        match self {
            Self::Own => (*camera, x, y),
            Self::MirroredX => (*camera, w - x, y),
            Self::MirroredY => (*camera, x, h - y),
            Self::Turned => (*camera, w - x, h - y),
            Self::Transposed => (*camera, y, x),
            Self::Shifted(dx, dy) => (*camera, x + dx, y + dy),
            Self::Of(other) => (other, x, y),
        }
    }
}

/// A guess at what is wrong.
struct Suspect {
    words: String,
    ray: Ray,
    /// Changes the expected values of a pixel to those that the fault would give.
    change: fn(&Seen<'_>, [f64; 3]) -> [f64; 3],
}

/// A pixel's ray and what it hits.
struct Seen<'a> {
    reference: &'a Reference<'a>,
    camera: Camera,
    direction: DVec3,
    hit: Option<Hit>,
}

fn as_is(_: &Seen<'_>, value: [f64; 3]) -> [f64; 3] {
    value
}

/// Guesses what is wrong with the file of a mismatch. Returns `None` if no suspect explains it. `others` are
/// the cameras of the area's images.
pub(crate) fn diagnose(
    reference: &Reference<'_>,
    images: &[DatasetImage],
    others: &[(usize, Camera)],
    mismatch: &Mismatch,
) -> Option<String> {
    // A cue depends on more than one ray of a pixel.
    if matches!(Image::of(mismatch.domain), Some(Image::Cue(_))) {
        return None;
    }
    let image = &images[mismatch.image];
    let pixels = Pixels::read(mismatch.domain, &image.path(reference.layout, mismatch.domain)).ok()?;
    let shade = Shade::new(reference, mismatch.domain);
    let sample = sample(reference, &shade, mismatch, &pixels);

    if sample.iter().filter(|p| p.differs).count() < FEWEST {
        return None;
    }
    if mismatch.domain == Domain::Semantic
        && let Some(words) = other_table(reference, &sample)
    {
        return Some(words);
    }

    let mut best: Option<(f64, String)> = None;
    for suspect in suspects(image, images, others, mismatch) {
        let share = explained(reference, &shade, mismatch, &sample, &suspect);
        if share >= EXPLAINED && best.as_ref().is_none_or(|(b, _)| share > b + 0.002) {
            best = Some((share, suspect.words));
        }
    }

    best.map(|(_, words)| words)
}

/// A pixel: the value in the file, the expected value, and whether they differ.
struct Probe {
    at: (u32, u32),
    found: [f64; 3],
    expected: [f64; 3],
    differs: bool,
}

/// Samples pixels all over the image, up to [`PIXELS`] that differ and as many others.
fn sample(reference: &Reference<'_>, shade: &Shade<'_>, mismatch: &Mismatch, pixels: &Pixels) -> Vec<Probe> {
    let (w, h) = pixels.size();
    let mut probes = Vec::new();
    let mut differing = 0;
    let mut all = 0;
    // Steps of the plastic number, the golden ratio's counterpart in two dimensions, reach everywhere without
    // a pattern.
    let spread =
        |i: u32, ratio: f64, size: u32| ((0.5 + f64::from(i) * ratio).fract() * f64::from(size)) as u32;

    for i in 0..40_000 {
        let at =
            (spread(i, 0.754_877_666_246_693, w).min(w - 1), spread(i, 0.569_840_290_998_053, h).min(h - 1));
        let found = pixels.value(at.0, at.1);
        let (_, expected) = predict(reference, shade, mismatch, Ray::Own, at);
        let differs = !near(mismatch.domain, found, expected);
        let room = if differs { &mut differing } else { &mut all };
        if *room < PIXELS {
            *room += 1;
            probes.push(Probe { at, found, expected, differs });
        }
        if differing >= PIXELS && all >= PIXELS || i > 4000 && differing + all >= PIXELS {
            break;
        }
    }

    probes
}

/// Returns what the pixel would see along `ray`, and the values that its file would hold.
fn predict<'a>(
    reference: &'a Reference<'a>,
    shade: &Shade<'_>,
    mismatch: &Mismatch,
    ray: Ray,
    (x, y): (u32, u32),
) -> (Seen<'a>, [f64; 3]) {
    let (camera, px, py) = ray.place(&mismatch.camera, x, y);
    let direction = camera.direction(px, py);
    let hit = cast_ray(reference.channels.scene, camera.pose.location, direction);
    let value = shade.value(&camera, direction, hit);
    (Seen { reference, camera, direction, hit }, value)
}

/// The share of pixels that a suspect explains: the smaller of its shares among differing pixels and among
/// others.
fn explained(
    reference: &Reference<'_>,
    shade: &Shade<'_>,
    mismatch: &Mismatch,
    sample: &[Probe],
    suspect: &Suspect,
) -> f64 {
    let mut counts = [0usize; 2];
    let mut right = [0usize; 2];

    // Differing pixels come first, because most suspects fail there.
    let (differing, others): (Vec<_>, Vec<_>) = sample.iter().partition(|p| p.differs);
    for (n, probe) in differing.into_iter().chain(others).enumerate() {
        let (seen, value) = predict(reference, shade, mismatch, suspect.ray, probe.at);
        let value = (suspect.change)(&seen, value);
        let which = usize::from(probe.differs);
        counts[which] += 1;
        right[which] += usize::from(near(mismatch.domain, probe.found, value));
        if n == 40 && right[0] + right[1] < 20 {
            return 0.0;
        }
    }

    let [first, second] = [0, 1].map(|k| {
        if counts[k] == 0 {
            1.0
        } else {
            right[k] as f64 / counts[k] as f64
        }
    });
    first.min(second)
}

/// Whether two values are equal within rounding and the effect of resampling.
fn near(domain: Domain, found: [f64; 3], expected: [f64; 3]) -> bool {
    found.into_iter().zip(expected).all(|(found, expected)| {
        let within = match domain {
            Domain::Depth => 1.5 + 5e-4 * expected,
            Domain::Normal => 2.0,
            Domain::Rgb => 14.0,
            Domain::GlobalXyz => 2e-4 + 1e-3 * expected.abs(),
            Domain::Semantic | Domain::SemanticPretty | Domain::SemanticClass => 0.0,
            _ => 0.0,
        };
        (found - expected).abs() <= within
    })
}

/// The index that a colour stands for.
fn index_of_color([r, g, b]: [f64; 3]) -> u32 {
    r as u32 * 65_536 + g as u32 * 256 + b as u32
}

/// Checks whether the indices come from another label table, in which each stands for one label but not for
/// its own.
fn other_table(reference: &Reference<'_>, sample: &[Probe]) -> Option<String> {
    let mut meanings: std::collections::BTreeMap<u32, std::collections::BTreeMap<u32, u32>> =
        Default::default();
    for probe in sample {
        *meanings
            .entry(index_of_color(probe.found))
            .or_default()
            .entry(index_of_color(probe.expected))
            .or_default() += 1;
    }

    let mut best = 0;
    let mut all = 0;
    let mut labels = std::collections::BTreeSet::new();
    let mut example = None;
    for (found, expected) in &meanings {
        let (label, count) = expected.iter().max_by_key(|(_, n)| **n)?;
        best += count;
        all += expected.values().sum::<u32>();
        labels.insert(*label);
        if label != found {
            example.get_or_insert((*found, *label));
        }
    }

    let (found, label) = example?;
    // A table maps labels one to one.
    let one_to_one = labels.len() == meanings.len() && meanings.len() > 1;
    (one_to_one && f64::from(best) >= 0.99 * f64::from(all)).then(|| {
        format!(
            "its indices are those of another label table: {found} stands for {} there, and for {} in \
             semantic_labels.json",
            reference.labels.name_of(label),
            reference.labels.name_of(found)
        )
    })
}

/// All suspects for a file.
fn suspects(
    image: &DatasetImage,
    images: &[DatasetImage],
    others: &[(usize, Camera)],
    mismatch: &Mismatch,
) -> Vec<Suspect> {
    let camera = &mismatch.camera;
    let panorama = camera.is_panorama();
    let mut all = Vec::new();
    let mut of = |words: &str, ray: Ray| all.push(Suspect { words: words.to_owned(), ray, change: as_is });

    // Images that were flipped, turned or shifted.
    of("it is mirrored left to right", Ray::MirroredX);
    of("it is mirrored upside down", Ray::MirroredY);
    of("it is turned by 180°", Ray::Turned);
    if camera.width == camera.height {
        of("its rows and columns are swapped", Ray::Transposed);
    }
    if panorama {
        let quarter = f64::from(camera.width) / 4.0;
        for (k, words) in [(1.0, "90° to the left"), (2.0, "180°"), (3.0, "90° to the right")] {
            of(&format!("it is turned about the vertical by {words}"), Ray::Shifted(k * quarter, 0.0));
        }
    }

    for (size, name) in [(0.5, "half a pixel"), (1.0, "one pixel")] {
        for (dx, dy, way) in [
            (1.0, 0.0, "to the left"),
            (-1.0, 0.0, "to the right"),
            (0.0, 1.0, "up"),
            (0.0, -1.0, "down"),
            (1.0, 1.0, "to the left and up"),
            (-1.0, -1.0, "to the right and down"),
            (1.0, -1.0, "to the left and down"),
            (-1.0, 1.0, "to the right and up"),
        ] {
            of(&format!("it is shifted by {name} {way}"), Ray::Shifted(size * dx, size * dy));
        }
    }

    // Poses in other conventions.
    let turned = |r: DMat3| Ray::Of(Camera { pose: Pose { world_from_camera: r, ..camera.pose }, ..*camera });
    let r = camera.pose.world_from_camera;
    let d = DMat3::from_diagonal(DVec3::new(1.0, -1.0, -1.0));
    of("it fits the pose with its rotation transposed", turned(r.transpose()));
    // `camera_rt_matrix` is D·Eᵀ. This is what transposing it means for E.
    of("it fits the pose with the rotation of camera_rt_matrix transposed", turned(d * r.transpose() * d));
    of("it fits the pose in the axes of OpenCV taken for Blender's", turned(r * d));

    changes(mismatch.domain, panorama, &mut all);
    all.extend(of_others(image, images, others, mismatch));
    all
}

/// Adds the changes that tools make to values.
fn changes(domain: Domain, panorama: bool, all: &mut Vec<Suspect>) {
    let mut of = |words: &str, change: fn(&Seen<'_>, [f64; 3]) -> [f64; 3]| {
        all.push(Suspect { words: words.to_owned(), ray: Ray::Own, change });
    };

    if matches!(domain, Domain::Rgb | Domain::Normal | Domain::Semantic | Domain::SemanticPretty) {
        of("its red and blue are swapped", |_, [r, g, b]| [b, g, r]);
    }

    match domain {
        Domain::Depth => {
            of("it is in the other unit of depth", |seen, [d, ..]| {
                let units = match seen.reference.channels.conventions.depth_units {
                    DepthUnits::Per512 => DepthUnits::Millimetres,
                    DepthUnits::Millimetres => DepthUnits::Per512,
                };
                let other = seen
                    .hit
                    .map_or(65_535.0, |h| (h.t * units.per_m() + 0.5).floor().min(65_535.0));
                [if d == f64::from(MISSING_DEPTH) { d } else { other }, 0.0, 0.0]
            });
            of("its bytes are swapped", |_, [d, ..]| [f64::from((d as u16).swap_bytes()), 0.0, 0.0]);
            if !panorama {
                of("it is the distance instead of the depth along the optical axis", |seen, [d, ..]| {
                    let length = seen.direction.length();
                    [
                        if d == f64::from(MISSING_DEPTH) {
                            d
                        } else {
                            (d * length).min(65_535.0)
                        },
                        0.0,
                        0.0,
                    ]
                });
            }
            of("what is missing in it is 0", |_, [d, ..]| {
                [if d == f64::from(MISSING_DEPTH) { 0.0 } else { d }, 0.0, 0.0]
            });
        }
        Domain::Normal => {
            of("its normals are in the other axes (paper and opencv)", |_, [r, g, b]| [r, g, 255.0 - b]);
            of("its normals point the other way", |_, v| v.map(|c| 255.0 - c));
            of("its green points the other way (up instead of down)", |_, [r, g, b]| [r, 255.0 - g, b]);
            of("its normals are those of the world's axes", |seen, v| world_normal(seen).unwrap_or(v));
        }
        Domain::GlobalXyz => {
            of("it is Y-up instead of Z-up", |_, [x, y, z]| [x, z, -y]);
            of("its coordinates are relative to the camera's place", |seen, p| {
                if seen.hit.is_none() {
                    p
                } else {
                    (DVec3::from_array(p) - seen.camera.pose.location).to_array()
                }
            });
            of("its coordinates are in the camera's axes", |seen, p| {
                let relative = DVec3::from_array(p) - seen.camera.pose.location;
                let inside: DVec3 = seen.camera.pose.opencv_from_world() * relative;
                if seen.hit.is_none() { p } else { inside.to_array() }
            });
            of("its coordinates are in millimetres", |_, p| p.map(|c| 1000.0 * c));
            of("its X and Z are swapped", |_, [x, y, z]| [z, y, x]);
        }
        _ => {}
    }
}

/// The colour of the normal in the world's axes.
fn world_normal(seen: &Seen<'_>) -> Option<[f64; 3]> {
    let n = seen.reference.channels.scene.mesh().normal(seen.hit?.face).as_dvec3();
    let n = if n.dot(seen.direction) > 0.0 { -n } else { n };
    Some((n * 127.5 + 128.0).to_array().map(f64::floor))
}

/// The other images of the area as suspects, the same location first.
fn of_others(
    image: &DatasetImage,
    images: &[DatasetImage],
    others: &[(usize, Camera)],
    mismatch: &Mismatch,
) -> Vec<Suspect> {
    let mut found: Vec<(bool, usize, Camera)> = others
        .iter()
        .filter(|(i, camera)| *i != mismatch.image && camera.is_panorama() == mismatch.camera.is_panorama())
        .map(|(i, camera)| (images[*i].uuid != image.uuid, *i, *camera))
        .collect();
    found.sort_by_key(|(elsewhere, i, _)| (*elsewhere, *i));
    found.truncate(MOST_OTHERS);

    found
        .into_iter()
        .map(|(elsewhere, i, camera)| Suspect {
            words: match (images[i].frame, elsewhere) {
                (Frame::View(n), false) => {
                    format!("it is what frame {n} of this location shows ({}): swapped?", images[i].stem())
                }
                _ => format!("it is what {} shows: swapped?", images[i].stem()),
            },
            ray: Ray::Of(camera),
            change: as_is,
        })
        .collect()
}
