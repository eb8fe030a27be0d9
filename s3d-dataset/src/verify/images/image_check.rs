//! Checks an image: which files it has, its pose, and the size and content of each file.

use crate::export::modality::Image;
use crate::verify::images::image_files::ImageFiles;
use crate::verify::images::pixels::{Opened, Pixels};
use crate::verify::images::{ImageCheck, Reference, Scratch};
use crate::verify::pose::{self, CheckedPose};
use crate::verify::report::Topic;
use s3d_io::dataset::{DatasetImage, Domain, Frame, PhotographRecord, XyzType};
use s3d_io::fs::read_file;
use s3d_io::image::{PngReader, xyz_bits};
use std::path::Path;
use std::sync::PoisonError;

const SIZES: (Topic, &str) = (Topic::Images, "sizes");
const TYPES: (Topic, &str) = (Topic::Images, "types of numbers");
const MISSING: (Topic, &str) = (Topic::Images, "missing modalities");

impl ImageCheck<'_> {
    /// Checks all files of an image.
    pub(crate) fn check(&self, index: usize, image: &DatasetImage, memory: &mut Scratch<'_>) {
        let report = self.report;
        let photograph = self.photographs.of(image);
        let size = match (image.frame, photograph) {
            (_, Some(record)) => (record.width, record.height),
            (Frame::View(_), None) => (self.manifest.options.size, self.manifest.options.size),
            (Frame::Panorama, None) => {
                (self.manifest.options.pano_width, self.manifest.options.pano_width / 2)
            }
        };

        self.check_modalities(image);
        let pose = self.pose(index, image, size, photograph.is_some());
        let cast = match (&pose, &mut memory.caster) {
            (Some(pose), Some(caster)) => {
                caster.cast_into(&pose.camera, 1, &mut memory.hits);
                true
            }
            _ => false,
        };

        if let (Some(pose), Some(reference), true) = (&pose, self.reference, cast) {
            let drawn = self.domains.iter().filter(|domain| image.has(**domain));
            let drawn = drawn.filter(|domain| self.is_of_mesh(reference, **domain, photograph));
            let drawn: Vec<Image> = drawn.filter_map(|domain| Image::of(*domain)).collect();
            let channels = &reference.channels;
            channels.draw_together(&drawn, &memory.hits, &pose.camera, &mut memory.buffers);
        }

        if self.domains.contains(&Domain::Objects) && image.has(Domain::Objects) {
            let camera = pose.as_ref().filter(|_| cast).map(|pose| &pose.camera);
            self.check_objects(image, size, camera, memory);
        }

        let mut reader = std::mem::take(&mut memory.reader);
        let mut files = ImageFiles {
            check: self,
            index,
            is_view: image.frame != Frame::Panorama,
            photograph,
            pose: pose.as_ref(),
            cast,
            as_mesh: Vec::new(),
            seen: None,
            depth: None,
            semantic: None,
        };

        for &domain in self.domains.iter().filter(|d| d.pixels().is_some() && image.has(**d)) {
            let path = image.path(self.layout, domain);
            let Some(opened) = self.open(domain, &path, &mut reader) else { continue };
            let fits = report.check(opened.size() == size, SIZES, &path, || {
                let (w, h) = opened.size();
                format!("{w} × {h} pixels, and the manifest tells of {} × {}", size.0, size.1)
            });
            if fits {
                files.domain(domain, opened, &path, memory);
            }
        }

        memory.reader = reader;
    }

    /// Checks that an image has every modality of the manifest and no other.
    fn check_modalities(&self, image: &DatasetImage) {
        let report = self.report;
        for &domain in self.domains {
            let path = image.path(self.layout, domain);
            report.check(image.has(domain), MISSING, &path, || {
                format!("missing: {} is there", image.relative_path(image.domains[0]))
            });
            if image.has(domain) && domain == Domain::Pose {
                self.files.check(&path, report);
            }
        }
        for &domain in image.domains.iter().filter(|d| !self.domains.contains(d)) {
            report.fault(
                MISSING.0,
                "modalities that were not asked for",
                &image.path(self.layout, domain),
                "the manifest does not tell of this modality",
            );
        }
    }

    /// Reads and checks the pose of an image, and keeps its camera.
    fn pose(
        &self,
        index: usize,
        image: &DatasetImage,
        size: (u32, u32),
        is_photograph: bool,
    ) -> Option<CheckedPose> {
        let report = self.report;
        if !image.has(Domain::Pose) {
            return None;
        }
        let pose = pose::read_and_check(self.layout, image, size, is_photograph, report)?;

        let path = image.path(self.layout, Domain::Pose);
        let offset_m = self.manifest.area(image.area).and_then(|area| area.offset_m);
        pose::check_frame(&pose, offset_m, &path, report);
        let draw = self.views.draw_of(image);
        if draw.is_some() || image.frame == Frame::Panorama {
            pose::check_draw(&pose, draw, &path, report);
        }

        self.cameras
            .lock()
            .unwrap_or_else(PoisonError::into_inner)
            .push((index, pose.camera));
        Some(pose)
    }

    /// Whether the mesh shows the contents of a file of this domain.
    pub(super) fn is_of_mesh(
        &self,
        reference: &Reference<'_>,
        domain: Domain,
        of: Option<&PhotographRecord>,
    ) -> bool {
        match domain {
            Domain::Rgb => reference.rgb_from_mesh && of.is_none(),
            Domain::GlobalXyz => !self.manifest.is_xyz_from_depth(),
            domain if domain.is_of_colors() => reference.rgb_from_mesh && of.is_none(),
            _ => true,
        }
    }

    /// Reads a file once, and checks its checksum and its pixels.
    fn open<'r>(&self, domain: Domain, path: &Path, reader: &'r mut PngReader) -> Option<Opened<'r>> {
        let report = self.report;
        let bytes = report.check_size(path).and_then(|()| read_file(path));
        match &bytes {
            Ok(bytes) => self.files.check_bytes(path, bytes, report),
            // This check says more about the reason.
            Err(_) => self.files.check(path, report),
        }
        let bytes = report.ok(Topic::Images, bytes)?;
        let opened = report.ok(Topic::Images, Opened::new(domain, &bytes, path, reader))?;
        if domain == Domain::GlobalXyz {
            let is_half = matches!(opened, Opened::Pixels(Pixels::XyzHalf(_)));
            let bits = if is_half { Some(16) } else { xyz_bits(&bytes) };
            let told = self.manifest.conventions().xyz;
            let expected = if told == XyzType::Half { 16 } else { 32 };
            report.check(bits == Some(expected), TYPES, path, || {
                let bits = bits.map_or("other numbers".to_owned(), |bits| format!("floats of {bits} bits"));
                format!("holds {bits}, and the manifest tells of the type {told}")
            });
        }
        Some(opened)
    }
}
