//! The images of an area. Each view is cast once, every modality is made from the same hits, and each file is
//! written whole.

mod bundle;
pub(crate) mod objects;
pub(crate) mod photographs;

use crate::context::{Context, Progress};
use crate::error::Result;
use crate::export::images::bundle::UnitBundle;
use crate::export::images::objects::InstanceFinder;
use crate::export::images::photographs::{WrittenPhotograph, write_photograph};
use crate::export::input::pictures::Pictures;
use crate::export::location::room_name;
use crate::export::modality::{Channels, Image, ImageBuffers};
use crate::parallel::for_each_in_order;
use crate::summary::{ImageTally, UnitTally};
use crate::survey::candidate::Candidate;
use s3d_geom::{Camera, Pose};
use s3d_io::camera::ScanLocation;
use s3d_io::dataset::{Domain, FileRecord, Frame, Layout, PoseFile};
use s3d_io::fs::{create_dir, write_bytes};
use s3d_label::Room;
use s3d_render::{Caster, Hits, NO_FACE, SeenObjects};
use std::sync::{Mutex, PoisonError};
use std::time::Instant;

/// What is rendered, and where the files go.
#[derive(Clone, Copy)]
pub(crate) struct ImageJob<'a> {
    pub(crate) layout: &'a Layout,
    pub(crate) area: u32,
    pub(crate) channels: Channels<'a>,
    /// Finds the objects of images, if they are asked for.
    pub(crate) instances: Option<&'a InstanceFinder<'a>>,
    /// The source of colours; `None` takes them from the mesh.
    pub(crate) pictures: Option<&'a Pictures>,
    pub(crate) locations: &'a [ScanLocation],
    /// The room of each location; `None` if rooms are not known.
    pub(crate) rooms: &'a [Option<Room>],
    /// Whether each face got its label by filling. Empty if no face did.
    pub(crate) is_filled: &'a [bool],
    /// Whether each location's images are written.
    pub(crate) chosen: &'a [bool],
    /// The photographs whose views are written.
    pub(crate) photographs: &'a [photographs::Shot<'a>],
    pub(crate) modalities: &'a [Domain],
    /// Whether the files of a location or photograph go into a bundle.
    pub(crate) is_bundled: bool,
    pub(crate) size: u32,
    pub(crate) pano_width: u32,
    /// What was subtracted from the scan's coordinates, metres; `None` if nothing was.
    pub(crate) offset_m: Option<[f64; 3]>,
    /// Called for every location whose images are all written, by the thread that wrote the last of them.
    pub(crate) each: &'a (dyn Fn(WrittenLocation) -> Result<()> + Sync),
    /// Called for every photograph whose view is written.
    pub(crate) each_photograph: &'a (dyn Fn(WrittenPhotograph) -> Result<()> + Sync),
}

/// A location whose images are all written.
pub(crate) struct WrittenLocation {
    /// The location's index.
    pub(crate) location: usize,
    pub(crate) tally: UnitTally,
    /// Sorted.
    pub(crate) files: Vec<FileRecord>,
    /// When its first image was begun.
    pub(crate) started: Instant,
}

/// A location with images still to write.
#[derive(Default)]
struct OpenLocation {
    /// How many images are still to be written.
    left: usize,
    tally: UnitTally,
    files: Vec<FileRecord>,
    started: Option<Instant>,
}

/// The locations with images still to write, by index.
struct OpenLocations<'a> {
    locations: Vec<Mutex<OpenLocation>>,
    /// The bundle of each location; none if each file has its own place.
    bundles: Vec<UnitBundle<'a>>,
}

impl<'a> OpenLocations<'a> {
    fn of(job: &ImageJob<'a>, shots: &[Shot]) -> Self {
        let mut open: Vec<OpenLocation> = job.locations.iter().map(|_| OpenLocation::default()).collect();
        for shot in shots {
            open[shot.location].left += 1;
        }
        let bundles = job.locations.iter().filter(|_| job.is_bundled);
        Self {
            locations: open.into_iter().map(Mutex::new).collect(),
            bundles: bundles
                .map(|scan| UnitBundle::new(job.layout, job.area, &scan.uuid))
                .collect(),
        }
    }

    /// Counts a written shot. Returns its location if that was the last of its images.
    fn close(&self, shot: &Shot, written: WrittenShot, started: Instant) -> Result<Option<WrittenLocation>> {
        let mut location = self.locations[shot.location]
            .lock()
            .unwrap_or_else(PoisonError::into_inner);
        location.add(shot.frame, written, started);
        if location.left > 0 {
            return Ok(None);
        }

        let OpenLocation { tally, mut files, started, .. } = std::mem::take(&mut *location);
        drop(location);
        files.sort();
        if let Some(bundle) = self.bundles.get(shot.location) {
            files = bundle.finish()?;
        }
        let started = started.unwrap_or_else(Instant::now);
        Ok(Some(WrittenLocation { location: shot.location, tally, files, started }))
    }
}

/// One image in all its modalities.
struct Shot {
    location: usize,
    frame: Frame,
    camera: Camera,
}

/// Writes the rest of an area: work for one thread, which the others need not wait for.
type AssetsWriter<'a> = &'a (dyn Fn() -> Result<()> + Sync);

/// One piece of an area's work.
enum WorkItem<'a> {
    Assets(AssetsWriter<'a>),
    Shot(&'a Shot),
    Photograph(&'a photographs::Shot<'a>),
}

/// Renders and writes the panoramas and kept views of the chosen locations, and the views of the photographs.
/// One thread does `assets` at the same time, once; `None` if that is done already.
pub(crate) fn write_images(
    ctx: &Context,
    job: &ImageJob<'_>,
    candidates: &[Candidate],
    assets: Option<AssetsWriter<'_>>,
) -> Result<()> {
    let shots = shots(job, candidates);
    let open = OpenLocations::of(job, &shots);
    create_image_dirs(job)?;

    let progress = ctx.progress("rendering", "images", (shots.len() + job.photographs.len()) as u64);
    let Some(pictures) = job.pictures else {
        return write_shots(ctx, job, &shots, &open, assets, &progress);
    };

    let alone = ImageJob { photographs: &[], ..*job };
    // Locations take turns, so that one cube map at a time is in memory. All threads work with it.
    let mut assets = assets;
    for shots in shots.chunk_by(|a, b| a.location == b.location) {
        let location = shots[0].location;
        let cube = pictures.cube(ctx, location, &job.locations[location], job.channels.scene)?;
        let channels = Channels {
            pictures: cube.as_ref().and_then(|cube| pictures.colors(location, cube)),
            ..job.channels
        };
        write_shots(ctx, &ImageJob { channels, ..alone }, shots, &open, assets.take(), &progress)?;
    }
    write_shots(ctx, job, &[], &open, assets, &progress)
}

/// Makes the folders that the files go into.
fn create_image_dirs(job: &ImageJob<'_>) -> Result<()> {
    if job.is_bundled {
        return Ok(create_dir(&job.layout.bundles_dir(job.area))?);
    }
    for domain in job.modalities {
        for frame in [Frame::Panorama, Frame::View(0)] {
            create_dir(&job.layout.image_dir(job.area, frame, *domain))?;
        }
    }
    Ok(())
}

fn write_shots(
    ctx: &Context,
    job: &ImageJob<'_>,
    shots: &[Shot],
    open: &OpenLocations<'_>,
    assets: Option<AssetsWriter<'_>>,
    progress: &Progress<'_>,
) -> Result<()> {
    let photographs = job.photographs.iter().map(WorkItem::Photograph);
    let items: Vec<WorkItem<'_>> = assets
        .map(WorkItem::Assets)
        .into_iter()
        .chain(shots.iter().map(WorkItem::Shot))
        .chain(photographs)
        .collect();

    for_each_in_order(
        ctx,
        &items,
        || Memory::new(job),
        |memory, item| match item {
            WorkItem::Assets(assets) => assets(),
            WorkItem::Photograph(shot) => {
                let written = write_photograph(job, shot, memory)?;
                progress.add(1);
                (job.each_photograph)(written)
            }
            WorkItem::Shot(shot) => {
                let started = Instant::now();
                let written = write_shot(job, shot, open.bundles.get(shot.location), memory)?;
                progress.add(1);

                match open.close(shot, written, started)? {
                    Some(location) => (job.each)(location),
                    None => Ok(()),
                }
            }
        },
    )
}

/// The images to take: for each location its panorama, which takes longest, then its views.
fn shots(job: &ImageJob<'_>, candidates: &[Candidate]) -> Vec<Shot> {
    let mut shots = Vec::new();
    let mut views = candidates.iter().filter(|c| c.area == job.area).peekable();

    for (location, scan) in job.locations.iter().enumerate() {
        if job.chosen[location] {
            let camera = Camera::equirectangular(scan.pose, job.pano_width);
            shots.push(Shot { location, frame: Frame::Panorama, camera });
        }
        while let Some(c) = views.next_if(|c| c.location == location) {
            if job.chosen[location]
                && let Some(number) = c.frame_num
            {
                shots.push(Shot { location, frame: Frame::View(number), camera: c.camera(scan, job.size) });
            }
        }
    }
    shots
}

/// What a thread keeps from image to image.
pub(crate) struct Memory<'s> {
    pub(crate) caster: Caster<'s, 's>,
    pub(crate) hits: Hits,
    pub(crate) buffers: ImageBuffers,
    /// Finds objects, if they are asked for.
    pub(crate) objects: Option<SeenObjects<'s, 's>>,
}

impl<'s> Memory<'s> {
    fn new(job: &ImageJob<'s>) -> Self {
        Self {
            caster: Caster::new(job.channels.scene),
            hits: Hits::default(),
            buffers: ImageBuffers::default(),
            objects: job.instances.map(InstanceFinder::memory),
        }
    }
}

/// What was written for a shot.
#[derive(Default)]
struct WrittenShot {
    files: Vec<FileRecord>,
    tally: ImageTally,
}

impl OpenLocation {
    fn add(&mut self, frame: Frame, shot: WrittenShot, started: Instant) {
        self.left -= 1;
        self.started = Some(self.started.map_or(started, |first| first.min(started)));
        self.tally.files += shot.files.len() as u64;
        self.tally.bytes += shot.files.iter().map(|f| f.bytes).sum::<u64>();
        let kind = if frame == Frame::Panorama {
            &mut self.tally.panoramas
        } else {
            &mut self.tally.views
        };
        *kind += ImageTally { images: 1, ..shot.tally };
        self.files.extend(shot.files);
    }
}

/// Writes the files of one image.
pub(crate) struct ImageWriter<'a> {
    pub(crate) job: &'a ImageJob<'a>,
    pub(crate) uuid: &'a str,
    pub(crate) room: &'a str,
    pub(crate) frame: Frame,
    /// Where the files go; `None` if each has its own place.
    pub(crate) bundle: Option<&'a UnitBundle<'a>>,
}

impl ImageWriter<'_> {
    pub(crate) fn write(&self, domain: Domain, bytes: &[u8]) -> Result<FileRecord> {
        let layout = self.job.layout;
        let path = layout.image_path(self.job.area, self.uuid, self.room, self.frame, domain);
        let record = FileRecord::of_bytes(layout.root(), &path, bytes)?;
        match self.bundle {
            Some(bundle) => bundle.append(record.clone(), bytes)?,
            None => write_bytes(&path, bytes).map(drop)?,
        }
        Ok(record)
    }

    /// Writes the objects of an image from its hits, if they are asked for.
    pub(crate) fn write_objects(
        &self,
        memory: &mut Option<SeenObjects<'_, '_>>,
        hits: &Hits,
        camera: &Camera,
    ) -> Result<Option<FileRecord>> {
        let (Some(instances), Some(memory)) = (self.job.instances, memory) else { return Ok(None) };
        let objects = instances.find(memory, hits, camera).to_json();
        Ok(Some(self.write(Domain::Objects, &objects)?))
    }

    pub(crate) fn write_pose(&self, camera: &Camera, scan: &Pose) -> Result<FileRecord> {
        let room = format!("{}_{}", self.room, self.job.area);
        let mut pose = PoseFile::new(camera, scan, self.uuid, &room, self.frame);
        pose.world_offset_m = self.job.offset_m;
        self.write(Domain::Pose, &pose.to_json())
    }
}

fn write_shot(
    job: &ImageJob<'_>,
    shot: &Shot,
    bundle: Option<&UnitBundle<'_>>,
    memory: &mut Memory<'_>,
) -> Result<WrittenShot> {
    let Memory { caster, hits, buffers, objects } = memory;
    let scan = &job.locations[shot.location];
    let room = room_name(job.rooms[shot.location]);
    let writer = ImageWriter { job, uuid: &scan.uuid, room: &room, frame: shot.frame, bundle };
    let mut written = WrittenShot::default();
    let images: Vec<Image> = job.modalities.iter().filter_map(|&domain| Image::of(domain)).collect();

    // Poses alone need no rays.
    if !images.is_empty() || job.instances.is_some() {
        caster.cast_into(&shot.camera, 1, hits);
        written.files = job
            .channels
            .encode(&images, hits, &shot.camera, buffers, |image, file| {
                writer.write(image.domain(), &file)
            })?;
        written.files.extend(writer.write_objects(objects, hits, &shot.camera)?);
    }

    if job.modalities.contains(&Domain::Pose) {
        written.files.push(writer.write_pose(&shot.camera, &scan.pose)?);
    }

    if !images.is_empty() {
        written.tally = count(job, &images, hits, buffers);
    }
    Ok(written)
}

/// Counts the pixels of an image that was cast and encoded. The tally counts no image itself.
pub(crate) fn count(job: &ImageJob<'_>, images: &[Image], hits: &Hits, buffers: &ImageBuffers) -> ImageTally {
    let faces = hits.face.pixels();
    let counts_filled = images.contains(&Image::Semantic) && !job.is_filled.is_empty();
    ImageTally {
        images: 0,
        pixels: hits.face.len() as u64,
        pixels_missing: faces.iter().filter(|face| **face == NO_FACE).count() as u64,
        pixels_unlabelled: buffers.unlabelled,
        pixels_filled: if counts_filled {
            let filled = faces
                .iter()
                .filter(|face| **face != NO_FACE && job.is_filled[**face as usize]);
            filled.count() as u64
        } else {
            0
        },
    }
}
