//! Images that are read and written, on all threads.

use super::{Content, THUMBS_PER_FILE, VIEWS_PER_FILE, Written};
use crate::areas;
use crate::faults::Faults;
use crate::ground::{self, Known};
use crate::index::{degrees, rounded};
use crate::mesh;
use crate::options::ReportOptions;
use crate::pixels::{Images, Made, Picture, Shares, Widths, nothing_left};
use crate::raster::reduce::nearest;
use crate::relations::{ObjectEntry, objects};
use crate::script::Scripts;
use s3d_dataset::parallel::map_in_order;
use s3d_dataset::{Context, Progress, Result};
use s3d_geom::{Camera, Raster, TriMesh};
use s3d_io::Error as FileError;
use s3d_io::dataset::{DatasetImage, Domain, Frame, PoseFile};
use s3d_io::image::PngReader;
use s3d_render::{Caster, Scene};
use serde::Serialize;

/// Pictures show faces of smaller meshes only, since a pixel has 24 bits.
const FACES_OF_PICTURES: usize = 0xff_ffff;

/// The pose of the camera of an image, for the index.
pub(super) struct Located {
    pub(super) position: [f64; 3],
    pub(super) azimuth_rad: f64,
    /// Yaw, pitch and horizontal angle of view.
    pub(super) angles_deg: [f64; 3],
    pub(super) forward: [f64; 3],
    pub(super) up: [f64; 3],
    /// The position and the azimuth of its scan location.
    pub(super) original: ([f64; 3], f64),
}

/// An image that was read and written.
pub(crate) struct ReadImage {
    pub(super) located: Option<Located>,
    pub(crate) seen: Option<Shares>,
    /// The first direction of view in a panorama.
    pub(super) look_deg: Option<f64>,
    /// The number of objects of a view.
    pub(super) objects: Option<usize>,
    /// The camera of an image that is shown.
    pub(super) camera: Option<Camera>,
}

/// The texts for the files of an image.
struct Texts {
    picture: ViewPicture,
    thumb: Option<String>,
    sharp: Option<String>,
    objects: Option<Vec<ObjectEntry>>,
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

/// Whether pictures show the faces of a mesh.
fn is_in_pictures(mesh: &TriMesh) -> bool {
    mesh.faces().len() < FACES_OF_PICTURES
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

impl Content<'_> {
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
            let pairs = self.pairs(area, faults)?;
            let scene = mesh
                .filter(|mesh| pairs.is_some() || is_in_pictures(mesh))
                .map(Scene::new);
            let scene = scene.as_ref();
            self.write_pictures(ctx, options, (area, scene), (scripts, &progress), (faults, &mut written))?;
            if let Some(pairs) = pairs {
                self.write_pairs(ctx, (area, scene), &pairs, scripts, &mut written)?;
            }
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
        (area, scene): (u32, Option<&Scene<'_>>),
        (scripts, progress): (&Scripts, &Progress<'_>),
        (faults, written): (&mut Faults, &mut Written),
    ) -> Result<()> {
        let panoramas = self.panoramas.iter().filter(|(_, image)| image.area == area);
        let mut jobs: Vec<Job<'_>> = panoramas.map(|(i, image)| Job::Panorama(*i, image)).collect();

        let of_area = self.views_of(area);
        let first = self
            .pictures
            .get(of_area.start)
            .map_or(0, |picture| picture / THUMBS_PER_FILE);
        let of_area = self.views.get(of_area).unwrap_or_default();
        let chunks = of_area.chunks(THUMBS_PER_FILE).enumerate();
        jobs.extend(chunks.map(|(i, images)| Job::Views(first + i, images)));

        let of_panorama = options.of_panoramas();
        let of_view = options.of_views();
        let scene = scene.filter(|scene| is_in_pictures(scene.mesh()));
        let results = map_in_order(
            ctx,
            &jobs,
            || Tools { reader: PngReader::default(), caster: scene.map(Caster::new) },
            |tools, job| {
                let mut faults = Faults::default();
                let mut made = Vec::new();
                let mut small = None;
                let mut bytes = 0;

                match job {
                    Job::Panorama(i, image) => {
                        let (one, texts) = self.make(image, of_panorama, tools, &mut faults)?;
                        if let Some(Texts { picture, thumb, sharp, .. }) = texts {
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
                            let mut objects = Vec::with_capacity(some.len());
                            for image in some {
                                ctx.check()?;
                                let (one, texts) = self.make(image, of_view, tools, &mut faults)?;
                                made.push(one);
                                let (picture, thumb, of_image) = texts.map_or((None, None, None), |texts| {
                                    (Some(texts.picture), texts.thumb, texts.objects)
                                });
                                pictures.push(picture);
                                thumbs.push(thumb);
                                objects.push(of_image);
                                progress.add(1);
                            }
                            let file = chunk * (THUMBS_PER_FILE / VIEWS_PER_FILE) + k;
                            bytes += scripts.write(&format!("views_{file}"), &pictures)?;
                            if objects.iter().any(Option::is_some) {
                                bytes += scripts.write(&format!("objects_{file}"), &objects)?;
                            }
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

    /// Reads an image. Returns its entry, and the texts for its files. The faces of its pixels are cast
    /// again.
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
            let nothing = ReadImage { located, seen: None, look_deg: None, objects: None, camera: None };
            return Ok((nothing, None));
        };
        let objects = self.objects(image, &images, faults)?;
        let Made { picture, thumb, sharp } = images
            .picture(|size| Some(faces(caster.as_mut()?, camera.as_ref()?, size)))
            .map_err(|e| FileError::format(&image.path(self.data.layout(), Domain::Rgb), e.to_string()))?;
        let pinhole = camera
            .as_ref()
            .filter(|_| image.frame != Frame::Panorama)
            .map(|camera| {
                let [[fx, _, cx], [_, fy, cy], _] = camera.k_matrix();
                Pinhole { k: [fx, fy, cx, cy], rt: camera.pose.rt_matrix() }
            });
        let units_per_m = self.data.options().depth_units.per_m();
        let look_deg = match image.frame {
            Frame::Panorama => images.first_look(self.table.as_ref(), units_per_m),
            Frame::View(_) => None,
        };
        let (seen, count) = (Some(images.seen), objects.as_ref().map(Vec::len));
        let read = ReadImage { located, seen, look_deg, objects: count, camera };
        let picture = ViewPicture { picture, camera: pinhole };
        Ok((read, Some(Texts { picture, thumb, sharp, objects })))
    }

    /// Returns the objects of a view. `None` if it has none, or if their file is wrong, which becomes a
    /// fault.
    fn objects(
        &self,
        image: &DatasetImage,
        images: &Images,
        faults: &mut Faults,
    ) -> Result<Option<Vec<ObjectEntry>>> {
        let Some(table) = &self.table else { return Ok(None) };
        if image.frame == Frame::Panorama || !image.has(Domain::Objects) {
            return Ok(None);
        }
        let read = self.data.objects(image).and_then(|file| {
            let path = image.path(self.data.layout(), Domain::Objects);
            objects(&file, images.size, table.len(), images.whole_label.as_ref())
                .map_err(|message| FileError::format(&path, message).into())
        });
        faults.keep(self.data.layout().root(), read)
    }
}
