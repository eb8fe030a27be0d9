//! Checks the files of one image against each other, and against the mesh.

use crate::export::modality::{Drawn, Image, NO_CLASS, null_pixels, palette};
use crate::verify::images::picture_colors::ViewColors;
use crate::verify::images::pixels::{Difference, Opened, Pixels};
use crate::verify::images::rays::{difference, index_of, points_of_depth};
use crate::verify::images::{ImageCheck, Mismatch, Scratch, UnlabelledPixels};
use crate::verify::photographs::check_share;
use crate::verify::pose::CheckedPose;
use crate::verify::report::Topic;
use glam::DVec3;
use s3d_geom::Raster;
use s3d_io::dataset::{Domain, PhotographRecord, XyzType};
use s3d_render::{Hits, MISSING_INDEX, NO_FACE};
use std::path::Path;
use std::sync::PoisonError;
use std::sync::atomic::Ordering;

const CLASSES: (Topic, &str) = (Topic::Images, "classes");
const INDICES: (Topic, &str) = (Topic::Images, "label indices");
const PRETTY: (Topic, &str) = (Topic::Images, "colours of labels");
const NOTHING: (Topic, &str) = (Topic::Images, "pixels that see nothing");
const COORDINATES: (Topic, &str) = (Topic::Images, "coordinates and depth");

/// The share of pixels in which an image may differ from the mesh if its pose contradicts itself. The camera
/// of such an image is not exact.
const SLACK: f64 = 0.005;

/// The files of one image, one after another.
pub(super) struct ImageFiles<'a> {
    pub(super) check: &'a ImageCheck<'a>,
    pub(super) index: usize,
    pub(super) is_view: bool,
    /// The record of the photograph, if the image is the view of one.
    pub(super) photograph: Option<&'a PhotographRecord>,
    pub(super) pose: Option<&'a CheckedPose>,
    /// Whether the scratch memory holds the image's hits.
    pub(super) cast: bool,
    /// The domains whose files were found equal to the drawn mesh before their pixels were read.
    pub(super) as_mesh: Vec<Domain>,
    /// The pixels that see nothing, as the first domain says that tells them exactly. `None` inside stands
    /// for the pixels without a hit: the file of that domain equals the drawn mesh.
    pub(super) seen: Option<(Domain, Option<Vec<bool>>)>,
    /// Depth and label indices, if their pixels were read.
    pub(super) depth: Option<Raster<u16>>,
    pub(super) semantic: Option<Raster<[u8; 3]>>,
}

impl ImageFiles<'_> {
    /// Checks the file of one domain.
    pub(super) fn domain(
        &mut self,
        domain: Domain,
        opened: Opened<'_>,
        path: &Path,
        memory: &mut Scratch<'_>,
    ) {
        // A photograph may show things that the mesh lacks, and the other way round.
        if let Some(record) = self.photograph.filter(|_| domain == Domain::Rgb) {
            let pixels = opened.into_pixels();
            self.photograph(record, &pixels, path, memory);
            if let Pixels::Color(colors) = pixels {
                memory.buffers.give_colors(colors);
            }
            return;
        }

        let Some(pixels) = self.unlike_mesh(domain, opened, memory) else {
            // The mesh's own images have these properties, so the files need no check.
            match (domain, &self.seen) {
                (Domain::GlobalXyz, _) => self.check.report.checked(1),
                (Domain::Depth | Domain::DepthEuclidean, None) => {}
                (domain, _) if !domain.shows_what_is_missing() => {}
                (_, None) => self.seen = Some((domain, None)),
                (_, Some(_)) => self.check.report.checked(1),
            }
            match domain {
                Domain::Semantic => {
                    self.check.report.checked(1);
                    self.unlabelled(self.semantic(memory), memory);
                }
                Domain::SemanticPretty => self.check.report.checked(1),
                _ => {}
            }
            return;
        };

        self.nothing(domain, &pixels, path, &memory.hits);

        match (domain, pixels) {
            (Domain::Depth, Pixels::Depth(depth)) => self.depth = Some(depth),
            (Domain::Semantic, Pixels::Color(indices)) => {
                self.indices(&indices, path);
                self.unlabelled(Some(&indices), memory);
                self.semantic = Some(indices);
            }
            (Domain::Rgb, Pixels::Color(colors)) => {
                self.keep_colors(&colors);
                if self.check.reference.is_some_and(|reference| !reference.rgb_from_mesh) {
                    memory.buffers.give_colors(colors);
                }
            }
            (Domain::SemanticRefined, Pixels::Color(indices)) => self.indices(&indices, path),
            (Domain::SemanticPretty, Pixels::Color(colors)) => self.pretty(&colors, path, memory),
            (Domain::SemanticClass, Pixels::Class(places, palette)) => {
                self.classes(&places, &palette, path, memory);
            }
            (Domain::GlobalXyz, pixels) => {
                if let Pixels::Xyz(points) = pixels.in_floats() {
                    self.coordinates(&points, path, memory);
                }
            }
            _ => {}
        }
    }

    /// The depths of the file, read or drawn.
    fn depth<'m>(&'m self, memory: &'m Scratch<'_>) -> Option<&'m Raster<u16>> {
        match self.drawn(Domain::Depth, memory) {
            Some(Drawn::Depth(depth)) => Some(depth),
            _ => self.depth.as_ref(),
        }
    }

    /// The label indices of the file, read or drawn.
    fn semantic<'m>(&'m self, memory: &'m Scratch<'_>) -> Option<&'m Raster<[u8; 3]>> {
        match self.drawn(Domain::Semantic, memory) {
            Some(Drawn::Color(indices)) => Some(indices),
            _ => self.semantic.as_ref(),
        }
    }

    /// The drawn image of a domain, if its file equals it.
    fn drawn<'m>(&self, domain: Domain, memory: &'m Scratch<'_>) -> Option<Drawn<'m>> {
        let image = Image::of(domain).filter(|_| self.as_mesh.contains(&domain))?;
        Some(self.check.reference?.channels.drawn(image, &memory.buffers))
    }

    /// Checks the colours of a photograph against its record.
    fn photograph(&self, record: &PhotographRecord, pixels: &Pixels, path: &Path, memory: &Scratch<'_>) {
        let report = self.check.report;
        let share = |count: usize| count as f64 / f64::from(record.width) / f64::from(record.height);
        let masked = pixels
            .missing(Domain::Rgb)
            .into_iter()
            .filter(|missing| *missing)
            .count();
        check_share("the masked share", (record.masked, share(masked)), record, path, report);
        if self.cast {
            let seen = memory
                .hits
                .face
                .pixels()
                .iter()
                .filter(|face| **face != NO_FACE)
                .count();
            check_share("the seen share", (record.seen, share(seen)), record, path, report);
        }
    }

    /// Checks that modalities agree on the pixels that see nothing. Depth is also missing where it is too
    /// large, and coordinates made from depth are missing with it: [`Self::coordinates`] compares those two.
    /// Class images cannot tell nothing from no class, nor edges and keypoints nothing from none.
    fn nothing(&mut self, domain: Domain, pixels: &Pixels, path: &Path, hits: &Hits) {
        if !domain.shows_what_is_missing() {
            return;
        }
        let may_be_too_far = matches!(domain, Domain::Depth | Domain::DepthEuclidean);
        let Some((other, expected)) = &self.seen else {
            if !may_be_too_far {
                self.seen = Some((domain, Some(pixels.missing(domain))));
            }
            return;
        };

        let missing = pixels.missing(domain);
        let expected = match expected {
            Some(expected) => expected.clone(),
            None => hits.face.pixels().iter().map(|face| *face == NO_FACE).collect(),
        };
        // A missing depth may also be one that is too far.
        let wrong = |(m, e): (&bool, &bool)| if may_be_too_far { *e && !*m } else { m != e };

        let mut pairs = missing.iter().zip(&expected);
        let first = if missing == expected {
            None
        } else {
            pairs.clone().position(wrong)
        };
        let count = if first.is_some() {
            pairs.by_ref().filter(|p| wrong(*p)).count()
        } else {
            0
        };

        self.check.report.check(first.is_none(), NOTHING, path, || {
            let at = first.unwrap_or_default() as u32;
            let width = pixels.size().0;
            let says = if missing[at as usize] {
                "is missing, and is not"
            } else {
                "is not missing, and is"
            };
            format!(
                "{count} pixels disagree with {other} on what is seen; the first, ({}, {}), {says} there",
                at % width,
                at / width
            )
        });
    }

    /// Keeps the colours of a view that come from pictures, for a comparison with its location's panorama.
    fn keep_colors(&self, colors: &Raster<[u8; 3]>) {
        let from_pictures = self.check.reference.is_some_and(|reference| !reference.rgb_from_mesh);
        if from_pictures && self.is_view {
            let view = ViewColors::new(self.index, colors);
            self.check
                .view_colors
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push(view);
        }
    }

    /// Counts the pixels without votes, and the pixels without a label.
    fn unlabelled(&self, indices: Option<&Raster<[u8; 3]>>, memory: &Scratch<'_>) {
        let reference = self.check.reference.filter(|_| self.cast);
        let (Some(reference), Some(indices)) = (reference, indices) else { return };
        let UnlabelledPixels { images, without_votes, without_label } = self.check.unlabelled;
        let is_voted = &reference.mesh.is_voted;
        let faces = memory.hits.face.pixels().iter();
        let faces = faces
            .filter(|face| **face != NO_FACE && !is_voted[**face as usize])
            .count();
        without_votes.fetch_add(faces as u64, Ordering::Relaxed);
        without_label.fetch_add(null_pixels(indices.pixels()), Ordering::Relaxed);
        images.fetch_add(1, Ordering::Relaxed);
    }

    /// Checks that every label index is in the table.
    fn indices(&self, indices: &Raster<[u8; 3]>, path: &Path) {
        let Some(labels) = self.check.labels else { return };
        let wrong = |p: &[u8; 3]| index_of(*p) as usize >= labels.len() && *p != MISSING_INDEX;
        let first = indices.pixels().iter().position(wrong);
        self.check.report.check(first.is_none(), INDICES, path, || {
            let at = first.unwrap_or_default();
            let width = indices.width() as usize;
            let count = indices.pixels().iter().filter(|p| wrong(p)).count();
            let value = indices.pixels()[at];
            format!(
                "{count} pixels have an index that the table of {} labels does not; the first is ({}, {}): \
                 {}",
                labels.len(),
                at % width,
                at / width,
                index_of(value)
            )
        });
    }

    /// Checks that the colours belong to the label indices.
    fn pretty(&self, colors: &Raster<[u8; 3]>, path: &Path, memory: &Scratch<'_>) {
        let (Some(labels), Some(indices)) = (self.check.labels, self.semantic(memory)) else { return };
        let expected = |pixel| labels.pretty.get(index_of(pixel) as usize).copied().unwrap_or([0; 3]);
        let difference = Difference::of(
            colors,
            indices,
            |color, index| color == expected(index),
            |color| format!("{color:?}"),
            |index| format!("{:?}", expected(index)),
        );
        self.check.report.check(difference.is_none(), PRETTY, path, || {
            difference
                .map_or(String::new(), |d| d.sentence("the colours of the labels in the semantic image"))
        });
    }

    /// Checks that the classes belong to the label indices, and their colours to the taxonomy.
    fn classes(&self, places: &Raster<u8>, colors: &[[u8; 3]], path: &Path, memory: &Scratch<'_>) {
        let Some(labels) = self.check.labels else { return };
        self.check
            .report
            .check(colors == palette(&labels.taxonomy), CLASSES, path, || {
                format!("its palette has not the colours of {}", labels.taxonomy.name())
            });
        let Some(indices) = self.semantic(memory) else { return };
        let expected = |pixel| {
            labels
                .classes
                .get(index_of(pixel) as usize)
                .copied()
                .unwrap_or(NO_CLASS)
        };
        let difference = Difference::of(
            places,
            indices,
            |class, index| class == expected(index),
            |class| labels.class_name(class),
            |index| labels.class_name(expected(index)),
        );
        self.check.report.check(difference.is_none(), CLASSES, path, || {
            difference
                .map_or(String::new(), |d| d.sentence("the classes of the labels in the semantic image"))
        });
    }

    /// Checks that coordinates equal those from depth and pose, within the rounding of both.
    fn coordinates(&self, points: &Raster<[f32; 3]>, path: &Path, memory: &Scratch<'_>) {
        let (Some(pose), Some(depth)) = (self.pose, self.depth(memory)) else { return };
        let units = self.check.manifest.conventions().depth_units;
        let camera = &pose.camera;
        let rays = camera.rays();
        let origin = camera.pose.location;
        let from_depth = self.check.manifest.is_xyz_from_depth();

        // Depth is rounded by up to half a unit, and has no value beyond `far`.
        let half_depth = 0.5 / units.per_m();
        let far = 65_534.0 / units.per_m();
        let is_half = self.check.manifest.conventions().xyz == XyzType::Half;
        // A half float has 11 significant bits; a 32-bit one 24.
        let (relative, absolute) = if is_half { (4.9e-4, 3e-8) } else { (6e-8, 0.0) };
        let of_depth = if from_depth { 0.0 } else { half_depth };
        let always = 1e-6 * (1.0 + origin.abs()) + absolute;

        let is_wrong = |point: [f32; 3], depth: u16, ray: DVec3| {
            let p = DVec3::from_array(point.map(f64::from));
            let Some(metres) = units.metres(depth) else {
                // A point may lie beyond the largest depth.
                return point != [0.0; 3] && (from_depth || (p - origin).length() < far * 0.999);
            };
            let off = (p - (origin + ray * metres)).abs();
            let most = of_depth * ray.abs() + relative * p.abs() + always;
            // Negated, so that NaN counts as wrong.
            !off.cmple(most).all()
        };

        let mut first = None;
        let mut count = 0u64;
        for y in 0..points.height() {
            for (x, (point, depth)) in (0..).zip(points.row(y).iter().zip(depth.row(y))) {
                if is_wrong(*point, *depth, rays.at(x, y)) {
                    count += 1;
                    first.get_or_insert((x, y));
                }
            }
        }

        self.check.report.check(count == 0, COORDINATES, path, || {
            let (x, y) = first.unwrap_or_default();
            let seen = units
                .metres(depth.at(x, y))
                .map(|m| (origin + rays.at(x, y) * m).as_vec3().to_array());
            let expected = seen.map_or("nothing".to_owned(), |p| format!("{p:?}"));
            format!(
                "{count} of {} pixels are not where depth and pose put them; the first is ({x}, {y}): {:?} \
                 for {expected}",
                points.len(),
                points.at(x, y)
            )
        });
    }

    /// Compares a file with what the mesh shows. Returns `None` if they are equal and the pixels need no
    /// other check, and the pixels otherwise.
    fn unlike_mesh(
        &mut self,
        domain: Domain,
        opened: Opened<'_>,
        memory: &mut Scratch<'_>,
    ) -> Option<Pixels> {
        let (Some(pose), Some(reference), Some(image), true) =
            (self.pose, self.check.reference, Image::of(domain), self.cast)
        else {
            return Some(opened.into_pixels());
        };

        let of_depth;
        // Cues of colours follow from the colours of the file, if the mesh does not have them.
        let is_of_file = domain.is_of_colors() && memory.buffers.has_colors;
        let expected = if is_of_file || self.check.is_of_mesh(reference, domain, self.photograph) {
            let Scratch { hits, buffers, .. } = memory;
            reference.channels.draw(image, hits, &pose.camera, buffers);
            reference.channels.drawn(image, buffers)
        } else if let (Domain::GlobalXyz, Some(depth)) = (domain, self.depth(memory)) {
            of_depth = points_of_depth(reference, pose, depth);
            of_depth.as_drawn()
        } else {
            return Some(opened.into_pixels());
        };

        self.check.report.checked(1);
        // Equal files need no reading if every other check of their pixels is known to hold.
        let is_known = !matches!(self.seen, Some((_, Some(_))))
            && match domain {
                Domain::Semantic | Domain::SemanticRefined => reference.mesh.all_in_table,
                Domain::SemanticPretty => self.semantic.is_none(),
                Domain::GlobalXyz => self.depth.is_none(),
                Domain::SemanticClass => false,
                _ => true,
            };

        if is_known && opened.are_of(expected) {
            self.as_mesh.push(domain);
            return None;
        }

        let pixels = opened.into_pixels();
        if let Some(difference) = difference(reference, image, &pixels, expected)
            && (pose.is_consistent || difference.count as f64 >= SLACK * difference.of as f64)
        {
            let mismatch = Mismatch { image: self.index, domain, difference, camera: pose.camera };
            self.check
                .mismatches
                .lock()
                .unwrap_or_else(PoisonError::into_inner)
                .push(mismatch);
        }
        Some(pixels)
    }
}
