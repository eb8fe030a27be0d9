//! The content of a data set, and its way into the files of a report, on all threads.

use crate::areas;
use crate::faults::Faults;
use crate::ground::{self, Known};
use crate::index::{
    DataSetEntry, FORM, GroundEntry, Index, LocationEntry, MeshEntry, RoomEntry, Surface, ViewEntry, degrees,
    folder_name, rounded,
};
use crate::mesh;
use crate::options::ReportOptions;
use crate::pixels::{Images, Made, Picture, Shares, Widths, nothing_left};
use crate::raster::reduce::nearest;
use crate::script::Scripts;
use crate::selection::{PoolPlace, places};
use s3d_dataset::parallel::map_in_order;
use s3d_dataset::{Context, DataSet, Progress, Result};
use s3d_geom::{Camera, Raster, TriMesh};
use s3d_io::Error as FileError;
use s3d_io::dataset::{DatasetImage, Domain, Frame, PhotographRecord, PoseFile, ViewRecord};
use s3d_io::image::PngReader;
use s3d_label::LabelTable;
use s3d_render::{Caster, Scene};
use serde::Serialize;
use std::collections::BTreeMap;
use std::path::Path;

/// The number of pictures of views in a file. The page loads a file to show a large view.
const VIEWS_PER_FILE: usize = 12;

/// The number of small images for the grid in a file.
const THUMBS_PER_FILE: usize = 48;

/// Pictures show faces of smaller meshes only, since a pixel has 24 bits.
const FACES_OF_PICTURES: usize = 0xff_ffff;

/// The content of a data set, before its images are read.
pub(crate) struct Content<'a> {
    data: &'a DataSet,
    table: Option<LabelTable>,
    photographs: BTreeMap<(u32, String), PhotographRecord>,
    /// The area and the uuid of each scan location, in order, with its room if it has an image.
    locations: Vec<(u32, String, Option<String>)>,
    /// Panoramas with the indices of their locations.
    panoramas: Vec<(usize, DatasetImage)>,
    views: Vec<DatasetImage>,
    /// The numbers of the pictures of views. Each area begins with a new file.
    pictures: Vec<usize>,
    /// All entries of `views.json`, with their areas.
    candidates: Vec<(u32, ViewRecord)>,
}

/// The place where a report shows an image.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(crate) enum Shown {
    /// The panorama of the location with this index.
    Panorama(usize),
    /// The picture with this number.
    Picture(usize),
}

/// The pose of the camera of an image, for the index.
struct Located {
    position: [f64; 3],
    azimuth_rad: f64,
    /// Yaw, pitch and horizontal angle of view.
    angles_deg: [f64; 3],
    forward: [f64; 3],
    up: [f64; 3],
    /// The position and the azimuth of its scan location.
    original: ([f64; 3], f64),
}

/// An image that was read and written.
pub(crate) struct ReadImage {
    located: Option<Located>,
    pub(crate) seen: Option<Shares>,
    /// The first direction of view in a panorama.
    look_deg: Option<f64>,
}

/// The texts for the files of an image.
struct Texts {
    picture: ViewPicture,
    thumb: Option<String>,
    sharp: Option<String>,
}

/// All images and meshes that were written.
#[derive(Default)]
pub(crate) struct Written {
    pub(crate) bytes: u64,
    /// In the order of `Content::panoramas`.
    pub(crate) panoramas: Vec<ReadImage>,
    /// In the order of `Content::views`.
    pub(crate) views: Vec<ReadImage>,
    /// The small images of panoramas, by location.
    small: Vec<Option<String>>,
    meshes: Vec<MeshEntry>,
    grounds: Vec<GroundEntry>,
    /// Classes and their surface in an area.
    surfaces: Vec<(usize, Surface)>,
    /// The rooms of all areas.
    rooms: Vec<RoomEntry>,
}

/// A pinhole camera, by which the page computes rays.
#[derive(Serialize)]
struct Pinhole {
    /// Focal lengths and principal point, in pixels of the image of the data set.
    k: [f64; 4],
    /// World → camera, with the axes of OpenCV.
    rt: [[f64; 4]; 3],
}

#[derive(Serialize)]
struct ViewPicture {
    #[serde(flatten)]
    picture: Picture,
    camera: Option<Pinhole>,
}

/// Images whose files one thread makes.
enum Job<'a> {
    Panorama(usize, &'a DatasetImage),
    Views(usize, &'a [DatasetImage]),
}

/// The tools of a thread.
struct Tools<'s, 'm> {
    reader: PngReader,
    caster: Option<Caster<'s, 'm>>,
}

/// Returns the face of each pixel of a reduced image. Its pixels are the nearest pixels of the camera.
fn faces(caster: &mut Caster<'_, '_>, camera: &Camera, [w, h]: [u32; 2]) -> Raster<u32> {
    let stride = camera.width / w.max(1);
    if [w * stride, h * stride] == [camera.width, camera.height] {
        // Casts only the pixels that are shown.
        return caster.cast_strided(camera, stride).face;
    }
    nearest(&caster.cast(camera).face, [w, h])
}

impl Located {
    /// Makes the entry of a pose. `size` is the size of its image, if this is known.
    fn new(pose: &PoseFile, size: Option<[u32; 2]>) -> Self {
        let original = pose.original();
        let this = pose.pose();
        let (yaw, pitch) = original.yaw_pitch_to(&this);
        // The full horizontal angle. For a photograph with its centre off the middle, it follows the focal
        // length.
        let half_width = size.map_or(pose.camera_k_matrix[0][2], |[w, _]| f64::from(w) / 2.0);
        let fov = 2.0 * (half_width / pose.camera_k_matrix[0][0]).atan();
        // The rows of the matrix are the axes of the camera: right, down, forward.
        let [_, down, forward] = this.rt_matrix().map(|[x, y, z, _]| [x, y, z].map(|c| rounded(c, 6)));

        Self {
            position: this.location.to_array(),
            azimuth_rad: this.azimuth_rad(),
            angles_deg: [yaw, pitch, fov].map(degrees),
            forward,
            up: down.map(|c| 0.0 - c),
            original: (original.location.to_array(), original.azimuth_rad()),
        }
    }
}

impl<'a> Content<'a> {
    pub(crate) fn read(data: &'a DataSet, faults: &mut Faults) -> Result<Self> {
        let root = data.layout().root();
        let mut content = Content {
            data,
            table: data.labels()?,
            photographs: BTreeMap::new(),
            locations: Vec::new(),
            panoramas: Vec::new(),
            views: Vec::new(),
            pictures: Vec::new(),
            candidates: Vec::new(),
        };

        let mut rooms: BTreeMap<(u32, String), Option<String>> = BTreeMap::new();
        let mut images = Vec::new();
        for &area in data.areas() {
            let photographs = faults.keep(root, data.photographs(area))?.unwrap_or_default();
            let of_area = photographs.into_iter().map(|p| ((area, p.camera_uuid.clone()), p));
            content.photographs.extend(of_area);

            for view in faults.keep(root, data.views(area))?.unwrap_or_default() {
                rooms.entry((area, view.camera_uuid.clone())).or_default();
                content.candidates.push((area, view));
            }
            for image in data.images(area) {
                let key = (area, image.uuid.clone());
                // A photograph that is a panorama is shown as a location.
                if image.frame == Frame::Panorama || !content.photographs.contains_key(&key) {
                    rooms.insert(key, Some(image.room.clone()));
                }
                images.push(image);
            }
        }
        content.locations = rooms
            .into_iter()
            .map(|((area, uuid), room)| (area, uuid, room))
            .collect();

        for image in images {
            match image.frame {
                Frame::View(_) => {
                    let next = match (content.views.last(), content.pictures.last()) {
                        (Some(view), Some(last)) if view.area == image.area => last + 1,
                        (_, Some(last)) => (last + 1).next_multiple_of(THUMBS_PER_FILE),
                        (_, None) => 0,
                    };
                    content.pictures.push(next);
                    content.views.push(image);
                }
                Frame::Panorama => {
                    if let Some(i) = content.location_of(image.area, &image.uuid) {
                        content.panoramas.push((i, image));
                    }
                }
            }
        }
        Ok(content)
    }

    fn location_of(&self, area: u32, uuid: &str) -> Option<usize> {
        self.locations
            .binary_search_by(|(a, u, _)| (*a, u.as_str()).cmp(&(area, uuid)))
            .ok()
    }

    /// Returns the places where images are shown, by area, scan location, room and frame.
    pub(crate) fn shown(&self) -> BTreeMap<(u32, String, String, Frame), Shown> {
        let panoramas = self.panoramas.iter().map(|(i, image)| (image, Shown::Panorama(*i)));
        let views = self
            .views
            .iter()
            .zip(&self.pictures)
            .map(|(image, i)| (image, Shown::Picture(*i)));
        panoramas
            .chain(views)
            .map(|(image, shown)| (key_of(image), shown))
            .collect()
    }

    /// Writes the meshes and pictures, area by area.
    pub(crate) fn write_files(
        &self,
        ctx: &Context,
        options: &ReportOptions,
        scripts: &Scripts,
        faults: &mut Faults,
    ) -> Result<Written> {
        let progress = ctx.progress("reporting", "images", (self.panoramas.len() + self.views.len()) as u64);
        let mut written = Written {
            small: vec![None; self.locations.len()],
            rooms: areas::rooms(self.data, faults)?,
            ..Written::default()
        };

        for &area in self.data.areas() {
            let read = faults.keep(self.data.layout().root(), self.data.mesh(area))?.flatten();
            let mesh = read.as_ref().map(|file| &file.mesh);
            if let Some(mesh) = mesh {
                let of = (self.data, self.table.as_ref());
                let (entry, surfaces, bytes) =
                    mesh::write(ctx, of, (area, mesh), options.mesh_faces, scripts, faults)?;
                written.meshes.push(entry);
                written.surfaces.extend(surfaces);
                written.bytes += bytes;
            }
            self.write_pictures(ctx, options, (area, mesh), (scripts, &progress), (faults, &mut written))?;
            if let Some(mesh) = mesh {
                self.write_ground(ctx, (area, mesh), scripts, &mut written)?;
            }
        }
        for (file, small) in written.small.chunks(THUMBS_PER_FILE).enumerate() {
            written.bytes += scripts.write(&format!("panos_{file}"), &small)?;
        }
        Ok(written)
    }

    /// Writes the ground of the plan of an area whose pictures are written: they tell the places of its
    /// locations.
    fn write_ground(
        &self,
        ctx: &Context,
        (area, mesh): (u32, &TriMesh),
        scripts: &Scripts,
        written: &mut Written,
    ) -> Result<()> {
        let locations = self.locations(written);
        let of_views = self.views.iter().zip(&written.views);
        let photographs = of_views.filter(|(image, _)| {
            image.area == area && self.photographs.contains_key(&(area, image.uuid.clone()))
        });
        let known = Known {
            area,
            rooms: written.rooms.iter().filter(|room| room.area == area).collect(),
            locations: locations.iter().filter(|location| location.area == area).collect(),
            photographs: photographs
                .filter_map(|(_, made)| Some(made.located.as_ref()?.position))
                .collect(),
        };
        let (entries, bytes) = ground::write(ctx, mesh, &known, written.grounds.len(), scripts)?;
        written.grounds.extend(entries);
        written.bytes += bytes;
        Ok(())
    }

    /// Writes the pictures of an area.
    fn write_pictures(
        &self,
        ctx: &Context,
        options: &ReportOptions,
        (area, mesh): (u32, Option<&TriMesh>),
        (scripts, progress): (&Scripts, &Progress<'_>),
        (faults, written): (&mut Faults, &mut Written),
    ) -> Result<()> {
        let panoramas = self.panoramas.iter().filter(|(_, image)| image.area == area);
        let mut jobs: Vec<Job<'_>> = panoramas.map(|(i, image)| Job::Panorama(*i, image)).collect();

        let first = self.views.partition_point(|view| view.area < area);
        let of_area = self.views.get(first..).unwrap_or_default();
        let of_area = of_area
            .get(..of_area.partition_point(|view| view.area == area))
            .unwrap_or_default();
        let first = self.pictures.get(first).map_or(0, |picture| picture / THUMBS_PER_FILE);
        let chunks = of_area.chunks(THUMBS_PER_FILE).enumerate();
        jobs.extend(chunks.map(|(i, images)| Job::Views(first + i, images)));

        let of_panorama = options.of_panoramas();
        let of_view = options.of_views();
        let scene = mesh
            .filter(|mesh| mesh.faces().len() < FACES_OF_PICTURES)
            .map(Scene::new);
        let results = map_in_order(
            ctx,
            &jobs,
            || Tools { reader: PngReader::default(), caster: scene.as_ref().map(Caster::new) },
            |tools, job| {
                let mut faults = Faults::default();
                let mut made = Vec::new();
                let mut small = None;
                let mut bytes = 0;

                match job {
                    Job::Panorama(i, image) => {
                        let (one, texts) = self.make(image, of_panorama, tools, &mut faults)?;
                        if let Some(Texts { picture, thumb, sharp }) = texts {
                            bytes += scripts.write(&format!("pano_{i}"), &picture.picture)?;
                            if let Some(sharp) = sharp {
                                bytes += scripts.write(&format!("sharp_{i}"), &sharp)?;
                            }
                            small = thumb.map(|thumb| (*i, thumb));
                        }
                        made.push(one);
                        progress.add(1);
                    }
                    Job::Views(chunk, images) => {
                        let mut thumbs = Vec::with_capacity(images.len());
                        for (k, some) in images.chunks(VIEWS_PER_FILE).enumerate() {
                            let mut pictures = Vec::with_capacity(some.len());
                            for image in some {
                                ctx.check()?;
                                let (one, texts) = self.make(image, of_view, tools, &mut faults)?;
                                made.push(one);
                                let (picture, thumb) =
                                    texts.map(|texts| (texts.picture, texts.thumb)).unzip();
                                pictures.push(picture);
                                thumbs.push(thumb.flatten());
                                progress.add(1);
                            }
                            let file = chunk * (THUMBS_PER_FILE / VIEWS_PER_FILE) + k;
                            bytes += scripts.write(&format!("views_{file}"), &pictures)?;
                        }
                        bytes += scripts.write(&format!("thumbs_{chunk}"), &thumbs)?;
                    }
                }
                Ok((made, small, bytes, faults.into_vec()))
            },
        )?;

        for (job, (made, small, bytes, found)) in jobs.iter().zip(results) {
            written.bytes += bytes;
            faults.extend(found);
            if let Some((i, thumb)) = small
                && let Some(place) = written.small.get_mut(i)
            {
                *place = Some(thumb);
            }
            match job {
                Job::Panorama(..) => written.panoramas.extend(made),
                Job::Views(..) => written.views.extend(made),
            }
        }
        Ok(())
    }

    /// Reads an image. Returns its entry, and the texts for its files. The faces of its pixels are cast again.
    fn make(
        &self,
        image: &DatasetImage,
        widths: Widths,
        Tools { reader, caster }: &mut Tools<'_, '_>,
        faults: &mut Faults,
    ) -> Result<(ReadImage, Option<Texts>)> {
        let root = self.data.layout().root();
        let images = Images::read(self.data, image, self.table.as_ref(), widths, (reader, faults))?;
        if images.is_none() {
            nothing_left(self.data, image, faults);
        }

        let mut pose = None;
        if image.has(Domain::Pose) {
            pose = faults.keep(root, self.data.pose(image))?;
        }
        let size = images.as_ref().map(|images| images.size);
        let mut camera = None;
        if let (Some(pose), Some(size)) = (&pose, size) {
            camera = faults.keep(root, self.data.camera(image, pose, size))?;
        }
        let located = pose.as_ref().map(|pose| Located::new(pose, size));

        let Some(images) = images else {
            return Ok((ReadImage { located, seen: None, look_deg: None }, None));
        };
        let Made { picture, thumb, sharp } = images
            .picture(|size| Some(faces(caster.as_mut()?, camera.as_ref()?, size)))
            .map_err(|e| FileError::format(&image.path(self.data.layout(), Domain::Rgb), e.to_string()))?;
        let pinhole = camera.filter(|_| image.frame != Frame::Panorama).map(|camera| {
            let [[fx, _, cx], [_, fy, cy], _] = camera.k_matrix();
            Pinhole { k: [fx, fy, cx, cy], rt: camera.pose.rt_matrix() }
        });
        let units_per_m = self.data.options().depth_units.per_m();
        let look_deg = match image.frame {
            Frame::Panorama => images.first_look(self.table.as_ref(), units_per_m),
            Frame::View(_) => None,
        };
        let read = ReadImage { located, seen: Some(images.seen), look_deg };
        Ok((read, Some(Texts { picture: ViewPicture { picture, camera: pinhole }, thumb, sharp })))
    }

    /// Returns the index of the report.
    pub(crate) fn index(&self, out: &Path, made: &Written, mut faults: Faults) -> Result<Index> {
        let data = self.data;
        let classes = areas::classes(data);

        // The sums over all images and meshes.
        let mut pixels_by_class = vec![0; classes.len()];
        let mut pixels_unlabelled = 0;
        let mut surface_by_class = vec![Surface::default(); classes.len()];
        for (class, Surface { faces, m2 }) in &made.surfaces {
            if let Some(sum) = surface_by_class.get_mut(*class) {
                *sum = Surface { faces: sum.faces + faces, m2: sum.m2 + m2 };
            }
        }
        for seen in made
            .panoramas
            .iter()
            .chain(&made.views)
            .filter_map(|made| made.seen.as_ref())
        {
            pixels_unlabelled += seen.pixels_unlabelled;
            for (class, pixels) in &seen.pixels_by_class {
                if let Some(sum) = pixels_by_class.get_mut(*class) {
                    *sum += pixels;
                }
            }
        }

        let (files, bytes) = data.size();
        let manifest = data.layout().manifest();
        let options = serde_json::to_value(data.options());
        let data_set = DataSetEntry {
            name: folder_name(out),
            missing_yet: data.missing_yet().map(<[String]>::to_vec),
            version: data.version().to_owned(),
            seed: data.seed(),
            files,
            bytes,
            taxonomy: data.taxonomy().map(|t| t.name().to_owned()),
            depth_units_per_m: data.options().depth_units.per_m(),
            options: options.map_err(|e| FileError::format(&manifest, e.to_string()))?,
        };

        let locations = self.locations(made);
        let views = self.view_entries(made);
        let labels = self.table.as_ref().map(areas::labels).unwrap_or_default();
        let votes = areas::votes(data, &mut faults)?;
        let statistics = areas::statistics(data, &mut faults)?;
        Ok(Index {
            form: FORM,
            data_set,
            areas: areas::areas(data)?,
            classes,
            labels,
            rooms: made.rooms.clone(),
            locations,
            views,
            meshes: made.meshes.clone(),
            grounds: made.grounds.clone(),
            scores: 0,
            against: None,
            views_per_file: VIEWS_PER_FILE,
            thumbs_per_file: THUMBS_PER_FILE,
            statistics,
            votes,
            pixels_by_class,
            surface_by_class,
            pixels_unlabelled,
            faults: faults.into_vec(),
            verified: None,
        })
    }

    fn locations(&self, made: &Written) -> Vec<LocationEntry> {
        let entry = |(area, uuid, room): &(u32, String, Option<String>)| LocationEntry {
            area: *area,
            uuid: uuid.clone(),
            room: room.clone().unwrap_or_default(),
            ..LocationEntry::default()
        };
        let mut entries: Vec<LocationEntry> = self.locations.iter().map(entry).collect();

        // The views of a location tell its place, too, if it has no panorama.
        for (image, made) in self.views.iter().zip(&made.views) {
            let entry = self
                .location_of(image.area, &image.uuid)
                .and_then(|i| entries.get_mut(i));
            if let (Some(entry), Some(located)) = (entry, &made.located) {
                entry.position = Some(located.original.0);
                entry.azimuth_rad = Some(located.original.1);
            }
        }

        for ((i, _), made) in self.panoramas.iter().zip(&made.panoramas) {
            let Some(entry) = entries.get_mut(*i) else { continue };
            if let Some(located) = &made.located {
                entry.position = Some(located.position);
                entry.azimuth_rad = Some(located.azimuth_rad);
            }
            entry.pano = made.seen.is_some();
            entry.look_deg = made.look_deg;
            entry.seen.clone_from(&made.seen);
        }
        entries
    }

    /// Returns kept views and photographs in the order of their files, then the dropped candidates.
    fn view_entries(&self, made: &Written) -> Vec<ViewEntry> {
        let options = self.data.options();
        let listed: Vec<(u32, &ViewRecord)> =
            self.candidates.iter().map(|(area, view)| (*area, view)).collect();
        let places = places(&listed, options.pool, options.keep_all);
        let mut kept = BTreeMap::new();
        let mut dropped = Vec::new();
        for ((area, view), place) in listed.into_iter().zip(places) {
            match view.frame_num {
                Some(frame) => drop(kept.insert((area, view.camera_uuid.as_str(), frame), (view, place))),
                None => dropped.push((area, view, place)),
            }
        }

        let mut entries = Vec::with_capacity(self.views.len() + dropped.len());
        for ((image, made), picture) in self.views.iter().zip(&made.views).zip(&self.pictures) {
            let photograph = self.photographs.get(&(image.area, image.uuid.clone()));
            let Frame::View(frame) = image.frame else { continue };
            let angles = made.located.as_ref().map(|located| located.angles_deg);
            let is_photograph = photograph.is_some();
            let of_photograph = made.located.as_ref().filter(|_| is_photograph);
            let entry = ViewEntry {
                area: image.area,
                location: self.location_of(image.area, &image.uuid),
                room: image.room.clone(),
                photograph: photograph.map(|p| p.name.clone()),
                frame: Some(frame),
                picture: Some(*picture).filter(|_| made.seen.is_some()),
                yaw_deg: angles.filter(|_| !is_photograph).map(|[yaw, ..]| yaw),
                pitch_deg: angles.filter(|_| !is_photograph).map(|[_, pitch, _]| pitch),
                fov_deg: angles.map(|[.., fov]| fov),
                position: of_photograph.map(|located| located.position),
                forward: of_photograph.map(|located| located.forward),
                up: of_photograph.map(|located| located.up),
                seen: made.seen.clone(),
                ..ViewEntry::default()
            };

            let record = kept
                .get(&(image.area, image.uuid.as_str(), frame))
                .filter(|_| !is_photograph);
            entries.push(match record {
                Some((view, place)) => of_record(entry, view, *place),
                None => entry,
            });
        }

        for (area, view, place) in dropped {
            let location = self.location_of(area, &view.camera_uuid);
            let room = location
                .and_then(|i| self.locations.get(i))
                .and_then(|(.., room)| room.clone());
            let entry = ViewEntry { area, location, room: room.unwrap_or_default(), ..ViewEntry::default() };
            entries.push(of_record(entry, view, place));
        }
        entries
    }
}

fn key_of(image: &DatasetImage) -> (u32, String, String, Frame) {
    (image.area, image.uuid.clone(), image.room.clone(), image.frame)
}

/// Adds the record of a candidate to the entry of its view.
fn of_record(entry: ViewEntry, view: &ViewRecord, place: PoolPlace) -> ViewEntry {
    ViewEntry {
        candidate: Some(view.candidate),
        yaw_deg: Some(degrees(view.yaw_rad)),
        pitch_deg: Some(degrees(view.pitch_rad)),
        fov_deg: Some(degrees(view.fov_rad)),
        entropy: Some(rounded(view.entropy, 4)),
        place: Some(place),
        ..entry
    }
}
