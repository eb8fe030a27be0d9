//! Compares the images of both data sets, one pair after another.

use super::comparison::{ClassPixels, ImageChange, LabelPairs, ModalityChanges, PoseChanges, Side};
use super::names::Names;
use super::pixels::{Meaning, Sums, compare};
use super::poses::Moved;
use super::sides::Sides;
use super::views::{FoundImage, ImageKey, Views};
use crate::context::Context;
use crate::error::{Error, Result};
use crate::parallel::map_in_order;
use crate::verify::images::pixels::Pixels;
use s3d_io::Error as FileError;
use s3d_io::dataset::Domain;
use std::path::Path;

/// The differences between the images.
pub(crate) struct Images {
    pub(crate) modalities: Vec<ModalityChanges>,
    pub(crate) changed: Vec<ImageChange>,
    pub(crate) poses: PoseChanges,
    /// The number of images without poses on both sides. Their pixels were still compared.
    pub(crate) without_poses: u64,
}

/// The result for the files of a modality of one image.
#[derive(Clone, Copy)]
enum FileVerdict {
    Same,
    Compared(Sums),
    OtherPose,
    OtherForm,
    Unread,
    OnlyA,
    OnlyB,
}

/// The result for an image.
struct Outcome {
    found: Vec<(Domain, FileVerdict)>,
    pose: PoseVerdict,
    pairs: LabelPairs,
}

/// The result for the pose of an image.
#[derive(Clone, Copy)]
enum PoseVerdict {
    /// It is not in both, or could not be read.
    None,
    /// The view has other angles. The views report this already.
    Redrawn,
    Same,
    Moved(Moved),
}

/// Whether both images have the same camera.
#[derive(Clone, Copy, PartialEq)]
enum SameCamera {
    Yes,
    No,
    Unread,
}

/// Compares all images, and adds the pixels with other labels to `pairs`.
pub(crate) fn compare_all(
    sides: &Sides,
    views: &Views,
    names: Option<&Names>,
    pairs: &mut LabelPairs,
    ctx: &Context,
) -> Result<Images> {
    let jobs: Vec<(&ImageKey, &[Option<FoundImage>; 2])> = views.images.iter().collect();
    let progress = ctx.progress("comparing", "images", jobs.len() as u64);

    let comparer = ImageComparer { sides, views, names };
    let outcomes = map_in_order(
        ctx,
        &jobs,
        || (),
        |(), (key, pair)| {
            let outcome = comparer.image(key, pair);
            progress.add(1);
            outcome
        },
    )?;
    drop(progress);

    let mut images = Images {
        modalities: Domain::ALL
            .map(|domain| ModalityChanges { modality: domain.folder(), ..ModalityChanges::default() })
            .to_vec(),
        changed: Vec::new(),
        poses: PoseChanges::default(),
        without_poses: 0,
    };

    let mut sums = [Sums::default(); Domain::ALL.len()];
    for ((key, pair), outcome) in jobs.iter().zip(outcomes) {
        let classes = names
            .map(|names| names.classes_of_image(&outcome.pairs))
            .unwrap_or_default();
        for (labels, counts) in outcome.pairs {
            *pairs.entry(labels).or_default() += counts;
        }
        images.add_pose(pair, outcome.pose);
        for (domain, found) in outcome.found {
            let classes = if domain == Domain::Semantic { &classes[..] } else { &[] };
            images.add((key, pair), domain, (found, classes), &mut sums);
        }
    }

    for (modality, sums) in images.modalities.iter_mut().zip(&sums) {
        modality.pixels = sums.changes();
    }
    images
        .modalities
        .retain(|of| of.modality != Domain::Pose.folder() && *of != empty(of.modality));

    images.poses.sort();
    images.sort();
    Ok(images)
}

/// The changes of a modality without images.
fn empty(modality: &'static str) -> ModalityChanges {
    ModalityChanges { modality, pixels: Sums::default().changes(), ..ModalityChanges::default() }
}

impl Images {
    /// Adds the result for the pose of an image.
    fn add_pose(&mut self, pair: &[Option<FoundImage>; 2], pose: PoseVerdict) {
        let [Some(a), Some(b)] = pair else { return };
        match pose {
            PoseVerdict::None => {
                let without = !a.image.has(Domain::Pose) || !b.image.has(Domain::Pose);
                self.without_poses += u64::from(without);
            }
            PoseVerdict::Redrawn => {}
            PoseVerdict::Same => self.poses.same += 1,
            PoseVerdict::Moved(moved) => {
                let path_a = a.image.relative_path(Domain::Pose);
                let path_b = b.image.relative_path(Domain::Pose);
                self.poses.add((path_a, path_b), moved, a.size == b.size);
            }
        }
    }

    /// Adds the result for one modality of an image.
    fn add(
        &mut self,
        (key, pair): (&ImageKey, &[Option<FoundImage>; 2]),
        domain: Domain,
        (found, classes): (FileVerdict, &[ClassPixels]),
        sums: &mut [Sums],
    ) {
        let place = Domain::ALL.iter().position(|d| *d == domain).unwrap_or_default();
        let modality = &mut self.modalities[place];

        match found {
            FileVerdict::Same => modality.same += 1,
            FileVerdict::OtherPose => modality.other_pose += 1,
            FileVerdict::OtherForm => modality.other_form += 1,
            FileVerdict::Unread => modality.unread += 1,
            FileVerdict::OnlyA => modality.only_a += 1,
            FileVerdict::OnlyB => modality.only_b += 1,
            FileVerdict::Compared(of_image) if of_image.changed + of_image.renumbered == 0 => {
                modality.same_pixels += 1;
            }
            FileVerdict::Compared(of_image) if of_image.changed == 0 => modality.renumbered += 1,
            FileVerdict::Compared(of_image) => {
                modality.changed += 1;
                sums[place].add(&of_image);
                if let [Some(a), Some(b)] = pair {
                    self.changed.push(ImageChange {
                        modality: domain.folder(),
                        area: key.area,
                        a: a.image.relative_path(domain),
                        b: b.image.relative_path(domain),
                        pixels: of_image.changes(),
                        classes: classes.to_vec(),
                    });
                }
            }
        }
    }

    /// Sorts images by modality, then by the share of pixels that differ, the largest first.
    fn sort(&mut self) {
        self.changed.sort_by(|a, b| {
            let [modality_a, modality_b] =
                [a, b].map(|of| Domain::ALL.iter().position(|d| d.folder() == of.modality));
            let [share_a, share_b] =
                [a, b].map(|of| of.pixels.pixels_changed as f64 / of.pixels.pixels as f64);
            modality_a.cmp(&modality_b).then(share_b.total_cmp(&share_a))
        });
    }
}

/// The inputs of all comparisons.
struct ImageComparer<'a> {
    sides: &'a Sides,
    views: &'a Views,
    names: Option<&'a Names>,
}

impl ImageComparer<'_> {
    /// Compares all files of an image. The cameras are compared once, when the first pair of files needs
    /// them.
    fn image(&self, key: &ImageKey, pair: &[Option<FoundImage>; 2]) -> Result<Outcome> {
        let mut outcome = Outcome { found: Vec::new(), pose: PoseVerdict::None, pairs: LabelPairs::new() };

        let mut camera = None;
        for domain in Domain::ALL {
            let [in_a, in_b] = [0, 1].map(|side| has(&pair[side], domain));
            let found = match (in_a, in_b, pair) {
                (true, true, [Some(a), Some(b)]) => {
                    let camera = match camera {
                        Some(camera) => camera,
                        None => {
                            let (pose, found) = self.camera(key, a, b)?;
                            outcome.pose = pose;
                            *camera.insert(found)
                        }
                    };
                    // Objects follow from the camera, the mesh and the labels, which are compared.
                    if domain.pixels().is_none() {
                        continue;
                    }
                    self.domain(domain, camera, a, b, &mut outcome.pairs)?
                }
                (true, ..) => FileVerdict::OnlyA,
                (_, true, _) => FileVerdict::OnlyB,
                _ => continue,
            };

            outcome.found.push((domain, found));
        }
        Ok(outcome)
    }

    /// Compares both cameras: how they differ, and whether they are the same.
    fn camera(&self, key: &ImageKey, a: &FoundImage, b: &FoundImage) -> Result<(PoseVerdict, SameCamera)> {
        if self.views.redrawn.contains(key) {
            return Ok((PoseVerdict::Redrawn, SameCamera::No));
        }
        if !a.image.has(Domain::Pose) || !b.image.has(Domain::Pose) {
            // Without poses, views are drawn at the same angles and panoramas stand at their location.
            return Ok((PoseVerdict::None, SameCamera::Yes));
        }

        let path_a = a.image.path(self.sides.a.layout(), Domain::Pose);
        let path_b = b.image.path(self.sides.b.layout(), Domain::Pose);
        if self.sides.are_same(&path_a, &path_b) {
            return Ok((PoseVerdict::Same, SameCamera::Yes));
        }

        let pose_a = self.sides.keep(Side::A, self.sides.a.pose(&a.image))?;
        let pose_b = self.sides.keep(Side::B, self.sides.b.pose(&b.image))?;
        let (Some(pose_a), Some(pose_b)) = (pose_a, pose_b) else {
            return Ok((PoseVerdict::None, SameCamera::Unread));
        };

        let moved = Moved::between(&pose_a, &pose_b);
        let camera = if moved.is_same_camera() {
            SameCamera::Yes
        } else {
            SameCamera::No
        };
        Ok((PoseVerdict::Moved(moved), camera))
    }

    /// Compares the files of one modality.
    fn domain(
        &self,
        domain: Domain,
        camera: SameCamera,
        a: &FoundImage,
        b: &FoundImage,
        pairs: &mut LabelPairs,
    ) -> Result<FileVerdict> {
        let path_a = a.image.path(self.sides.a.layout(), domain);
        let path_b = b.image.path(self.sides.b.layout(), domain);

        // Equal bytes are the same unless their numbers mean something else.
        let has_other_labels = domain.is_semantic() && !self.means_same(domain);
        let has_same_bytes = self.sides.are_same(&path_a, &path_b);
        if has_same_bytes && !has_other_labels {
            return Ok(FileVerdict::Same);
        }
        if a.size != b.size || !self.has_same_form(domain) {
            return Ok(FileVerdict::OtherForm);
        }
        match camera {
            SameCamera::Yes => {}
            SameCamera::No => return Ok(FileVerdict::OtherPose),
            SameCamera::Unread => return Ok(FileVerdict::Unread),
        }

        let pixels_a = self.pixels(Side::A, domain, &path_a)?;
        let pixels_b = self.pixels(Side::B, domain, &path_b)?;
        let (Some(pixels_a), Some(pixels_b)) = (pixels_a, pixels_b) else {
            return Ok(FileVerdict::Unread);
        };
        if matches!(domain, Domain::Semantic | Domain::SemanticRefined) && self.names.is_none() {
            // The table that could not be read is reported elsewhere.
            return Ok(FileVerdict::Unread);
        }

        let meaning = Meaning {
            depth_units: self.sides.a.options().depth_units,
            names: self.names,
            taxonomies: [&self.sides.a, &self.sides.b].map(|data| &data.taxonomy),
        };
        match compare((&pixels_a, &pixels_b), domain, &meaning, pairs) {
            Ok(Some(sums)) if has_same_bytes && sums.changed + sums.renumbered == 0 => Ok(FileVerdict::Same),
            Ok(Some(sums)) => Ok(FileVerdict::Compared(sums)),
            Ok(None) => Ok(FileVerdict::OtherForm),
            Err((side, message)) => {
                let path = if side == Side::A { &path_a } else { &path_b };
                self.sides
                    .keep::<()>(side, Err(FileError::format(path, message).into()))?;
                Ok(FileVerdict::Unread)
            }
        }
    }

    /// Reads an image. Returns `None` if it cannot be read, which is kept as a fault of its side.
    fn pixels(&self, side: Side, domain: Domain, path: &Path) -> Result<Option<Pixels>> {
        let files = &self.sides.of(side).files;
        let read = files.checked(path).and_then(|path| Pixels::read(domain, path));
        self.sides.keep(side, read.map_err(Error::from))
    }

    /// Whether label or class numbers of this modality mean the same in both.
    fn means_same(&self, domain: Domain) -> bool {
        match domain {
            Domain::SemanticClass => {
                let [a, b] = [&self.sides.a, &self.sides.b].map(|data| data.taxonomy.classes());
                a.iter()
                    .map(|class| class.name())
                    .eq(b.iter().map(|class| class.name()))
            }
            Domain::Semantic | Domain::SemanticPretty => self.names.is_none_or(Names::have_same_indices),
            _ => true,
        }
    }

    /// Whether the values of a modality have the same units and axes in both.
    fn has_same_form(&self, domain: Domain) -> bool {
        let [a, b] = [&self.sides.a, &self.sides.b].map(|data| data.options());
        match domain {
            Domain::Depth | Domain::DepthEuclidean => a.depth_units == b.depth_units,
            Domain::Normal => a.normal_axes == b.normal_axes,
            _ => true,
        }
    }
}

/// Whether an image is there and has a file of this domain.
fn has(of: &Option<FoundImage>, domain: Domain) -> bool {
    of.as_ref().is_some_and(|of| of.image.has(domain))
}
