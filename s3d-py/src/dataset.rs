//! `_native.DataSet`: a data set whose images are read as arrays.

use crate::arrays;
use crate::error::{exception, usage};
use crate::mesh::{Mesh, raster};
use crate::work::watched;
use numpy::{PyArray1, PyArray2, PyArray3, PyReadonlyArray3};
use pyo3::prelude::*;
use pyo3::types::PyBytes;
use s3d_dataset::parallel::map_in_order;
use s3d_dataset::{Error, Result};
use s3d_geom::glam::Vec3;
use s3d_geom::{NormalAxes, Raster, area_mean};
use s3d_io::Error as FileError;
use s3d_io::dataset::{DatasetImage, Domain, Frame, InstanceEntry as InstanceRecord};
use s3d_io::image::{PngReader, decode_gray16, decode_rgb8, decode_xyz};
use s3d_label::{LabelId, LabelTable};
use std::path::PathBuf;
use std::sync::Arc;

/// The colour of a pixel of an image of label indices where nothing is seen. Source: `s3d_io::formats`.
const UNSEEN: [u8; 3] = [0x0d; 3];

/// A complete data set. It never changes, so many threads may read it.
#[pyclass(frozen)]
pub(crate) struct DataSet {
    data: s3d_dataset::DataSet,
    /// The images of all areas, in the order of areas.
    images: Vec<DatasetImage>,
    labels: Option<LabelTable>,
    /// The index of the class of each label in the table; −1 for none.
    class_of_label: Vec<i16>,
}

/// The matrices K and camera → world.
type CameraMatrices = ([[f64; 3]; 3], [[f64; 4]; 4]);

/// Area, scan location, room, number of a view, and the modalities that have a file.
type ImageEntry = (u32, String, String, Option<u32>, Vec<&'static str>);

/// Name, index of the class, number of the instance, room, area.
type LabelEntry = (String, i16, u32, String, u32);

/// Label, its index, class, room, number in the room, points, box.
type InstanceEntry = (String, u32, String, String, u32, u64, [f32; 6]);

/// Positions, colours, labels and faces of points.
type PointColumns<'py> = (
    Bound<'py, PyArray2<f32>>,
    Bound<'py, PyArray2<u8>>,
    Bound<'py, PyArray1<i32>>,
    Bound<'py, PyArray1<i32>>,
);

/// Scan location, number of the candidate, yaw, pitch, angle of view, entropy, number of the view.
type ViewEntry = (String, u32, f64, f64, f64, f64, Option<u32>);

/// By face: label, votes, the label of the second most votes, its votes, all votes, farthest voter.
type VoteColumns<'py> = (
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<u32>>,
    Bound<'py, PyArray1<f32>>,
);

/// The names of files, and by face the file and the number in it.
type SourceColumns<'py> = (Vec<String>, Bound<'py, PyArray1<u32>>, Bound<'py, PyArray1<u32>>);

#[pymethods]
impl DataSet {
    #[staticmethod]
    fn open(py: Python<'_>, folder: PathBuf) -> PyResult<Self> {
        py.detach(|| {
            let data = s3d_dataset::DataSet::open(&folder)?;
            let images = data.areas().iter().flat_map(|area| data.images(*area)).collect();
            let labels = data.labels()?;
            let class_of_label = labels.as_ref().map(classes_of_labels).unwrap_or_default();
            Ok(Self { data, images, labels, class_of_label })
        })
        .map_err(|error: Error| exception(&error))
    }

    #[getter]
    fn root(&self) -> PathBuf {
        self.data.layout().root().to_owned()
    }

    #[getter]
    fn version(&self) -> &str {
        self.data.version()
    }

    #[getter]
    fn seed(&self) -> u64 {
        self.data.seed()
    }

    #[getter]
    fn areas(&self) -> Vec<u32> {
        self.data.areas().to_vec()
    }

    /// The options of the export that made it, as JSON.
    #[getter]
    fn options(&self) -> PyResult<String> {
        serde_json::to_string(self.data.options()).map_err(|e| crate::error::fault(e.to_string()))
    }

    #[getter]
    fn images(&self) -> Vec<ImageEntry> {
        let entry = |image: &DatasetImage| {
            let number = match image.frame {
                Frame::View(number) => Some(number),
                Frame::Panorama => None,
            };
            let modalities = image.domains.iter().map(|domain| domain.folder()).collect();
            (image.area, image.uuid.clone(), image.room.clone(), number, modalities)
        };
        self.images.iter().map(entry).collect()
    }

    /// Names and colours of the classes; `None` without labels.
    #[getter]
    fn classes(&self) -> Option<Vec<(String, [u8; 3])>> {
        let taxonomy = self.data.taxonomy()?;
        let entry = |class: &s3d_label::Class| (class.name().to_owned(), taxonomy.color(*class));
        Some(taxonomy.classes().iter().map(entry).collect())
    }

    /// The table of labels; the entry of an index that is no label has an empty room.
    #[getter]
    fn labels(&self) -> Vec<LabelEntry> {
        let Some(table) = &self.labels else { return Vec::new() };
        let entry = |id: u32| match table.get(LabelId(id)) {
            Some(label) => {
                let name = table.name_of(LabelId(id));
                (name, self.class_of(id), label.instance, label.room.to_string(), label.area)
            }
            None => (table.name_of(LabelId(id)), -1, 0, String::new(), 0),
        };
        (0..table.len() as u32).map(entry).collect()
    }

    #[getter]
    fn class_of_label<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<i16>> {
        PyArray1::from_slice(py, &self.class_of_label)
    }

    /// The rooms of the labels: area and name.
    fn rooms(&self) -> PyResult<Vec<(u32, String)>> {
        let mut rooms = Vec::new();
        for area in self.data.areas() {
            let found = self.data.tree_rooms(*area).map_err(|e| exception(&e))?;
            rooms.extend(found.into_iter().map(|room| (room.area, room.name)));
        }
        Ok(rooms)
    }

    fn instances(&self, area: u32) -> PyResult<Vec<InstanceEntry>> {
        self.check_area(area)?;
        let entries = self.data.instances(area).map_err(|e| exception(&e))?;
        let numbers = self.data.numbers_in_rooms(area).map_err(|e| exception(&e))?;
        let entry = |i: InstanceRecord| {
            let number = numbers.get(&i.label).copied().unwrap_or_default();
            (i.label, i.label_index, i.class, i.room, number, i.points, i.bbox)
        };
        Ok(entries.into_iter().map(entry).collect())
    }

    /// The sampled points of an area.
    fn cloud<'py>(&self, py: Python<'py>, area: u32, sink: Py<PyAny>) -> PyResult<PointColumns<'py>> {
        self.check_area(area)?;
        let (cloud, labels) = watched(py, None, &sink, |ctx| self.data.points(area, ctx))?;
        let labels = labels.into_iter().map(|label| label as i32).collect();
        let faces = cloud.faces.into_iter().map(|face| face as i32).collect();
        Ok((
            arrays::rows::<f32, 3>(py, bytemuck::cast_vec(cloud.positions))?,
            arrays::rows(py, cloud.colors)?,
            PyArray1::from_vec(py, labels),
            PyArray1::from_vec(py, faces),
        ))
    }

    /// Every candidate view of an area, kept or dropped.
    fn candidates(&self, area: u32) -> PyResult<Vec<ViewEntry>> {
        self.check_area(area)?;
        let records = self.data.views(area).map_err(|e| exception(&e))?;
        Ok(records
            .into_iter()
            .map(|v| (v.camera_uuid, v.candidate, v.yaw_rad, v.pitch_rad, v.fov_rad, v.entropy, v.frame_num))
            .collect())
    }

    /// The mesh that the images of an area show.
    fn mesh(&self, py: Python<'_>, area: u32, sink: Py<PyAny>) -> PyResult<Mesh> {
        self.check_area(area)?;
        let file = watched(py, None, &sink, |_| self.data.mesh(area))?;
        let file = file.ok_or_else(|| usage(format!("area {area} has no mesh")))?;
        Ok(Mesh { file: Arc::new(file) })
    }

    /// The votes of points for each face of the mesh; `None` without labels.
    fn votes<'py>(&self, py: Python<'py>, area: u32) -> PyResult<Option<VoteColumns<'py>>> {
        self.check_area(area)?;
        let votes = py.detach(|| self.data.face_votes(area)).map_err(|e| exception(&e))?;
        Ok(votes.map(|v| {
            (
                PyArray1::from_vec(py, v.label),
                PyArray1::from_vec(py, v.votes),
                PyArray1::from_vec(py, v.runner_up),
                PyArray1::from_vec(py, v.runner_up_votes),
                PyArray1::from_vec(py, v.total),
                PyArray1::from_vec(py, v.farthest_m),
            )
        }))
    }

    /// The file of the scan and the number in it of each face of the mesh: files, file, face; `None` if no
    /// file told.
    fn source_faces<'py>(&self, py: Python<'py>, area: u32) -> PyResult<Option<SourceColumns<'py>>> {
        self.check_area(area)?;
        let source = py.detach(|| self.data.source_faces(area)).map_err(|e| exception(&e))?;
        Ok(source.map(|s| (s.files, PyArray1::from_vec(py, s.file), PyArray1::from_vec(py, s.face))))
    }

    /// The bytes of a file of the data set, named from its folder.
    fn read<'py>(&self, py: Python<'py>, name: &str) -> PyResult<Bound<'py, PyBytes>> {
        let path = self.data.layout().root().join(name);
        let bytes = py.detach(|| self.data.read(&path)).map_err(|e| exception(&e))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// The path of a file of an image, whether it exists or not.
    fn path(&self, image: usize, modality: &str) -> PyResult<PathBuf> {
        let domain = domain(modality)?;
        Ok(self.image(image)?.path(self.data.layout(), domain))
    }

    /// The bytes of a file of an image.
    fn file<'py>(&self, py: Python<'py>, image: usize, modality: &str) -> PyResult<Bound<'py, PyBytes>> {
        let image = self.image(image)?;
        let domain = domain(modality)?;
        let bytes = py.detach(|| self.bytes(image, domain)).map_err(|e| exception(&e))?;
        Ok(PyBytes::new(py, &bytes))
    }

    /// Width and height in pixels.
    fn size(&self, py: Python<'_>, image: usize) -> PyResult<(u32, u32)> {
        let image = self.image(image)?;
        let size = py.detach(|| self.data.size_of(image)).map_err(|e| exception(&e))?;
        size.ok_or_else(|| usage(format!("{} has no PNG file that tells its size", image.stem())))
    }

    /// The matrix K, row by row, and the pose camera → world, 4 × 4, in OpenCV's axes.
    fn camera(&self, py: Python<'_>, image: usize) -> PyResult<CameraMatrices> {
        let image = self.image(image)?;
        let pose = py.detach(|| self.data.pose(image)).map_err(|e| exception(&e))?;
        Ok((pose.camera_k_matrix, arrays::world_from_opencv(&pose.pose())))
    }

    fn rgb<'py>(&self, py: Python<'py>, image: usize, pretty: bool) -> PyResult<Bound<'py, PyArray3<u8>>> {
        let image = self.image(image)?;
        let domain = if pretty { Domain::SemanticPretty } else { Domain::Rgb };
        let pixels = py.detach(|| self.rgb8(image, domain)).map_err(|e| exception(&e))?;
        arrays::image_of_rows(py, pixels)
    }

    fn depth<'py>(&self, py: Python<'py>, image: usize) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let image = self.image(image)?;
        let metres = py.detach(|| self.metres(image)).map_err(|e| exception(&e))?;
        arrays::image(py, metres)
    }

    fn normal<'py>(&self, py: Python<'py>, image: usize) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let image = self.image(image)?;
        // The normals of a view are returned with z forward, whatever axes are stored.
        let is_flipped =
            self.data.options().normal_axes == NormalAxes::Paper && image.frame != Frame::Panorama;
        let decoded = |pixel: [u8; 3]| {
            if pixel == [128; 3] {
                return [f32::NAN; 3];
            }
            let n = Vec3::from(pixel.map(|channel| (f32::from(channel) - 127.5) / 127.5)).normalize();
            if is_flipped { [n.x, n.y, -n.z] } else { n.to_array() }
        };
        let normals = py.detach(|| self.rgb8(image, Domain::Normal).map(|pixels| pixels.map(decoded)));
        arrays::image_of_rows(py, normals.map_err(|e| exception(&e))?)
    }

    fn xyz<'py>(&self, py: Python<'py>, image: usize) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let image = self.image(image)?;
        let read = || {
            let path = image.path(self.data.layout(), Domain::GlobalXyz);
            let stored = decode_xyz(&self.bytes(image, Domain::GlobalXyz)?, &path)?;
            Ok(stored.map(|point| if point == [0.0; 3] { [f32::NAN; 3] } else { point }))
        };
        arrays::image_of_rows(py, py.detach(read).map_err(|e: Error| exception(&e))?)
    }

    /// The index of each pixel's label in the table, −1 where nothing is seen.
    fn label<'py>(
        &self,
        py: Python<'py>,
        image: usize,
        refined: bool,
    ) -> PyResult<Bound<'py, PyArray2<i32>>> {
        let image = self.image(image)?;
        let indices = py.detach(|| Ok(self.rgb8(image, labels_of(refined))?.map(label_index)));
        arrays::image(py, indices.map_err(|e: Error| exception(&e))?)
    }

    /// The index of each pixel's class, −1 where there is none.
    #[pyo3(name = "class_")]
    fn class<'py>(
        &self,
        py: Python<'py>,
        image: usize,
        refined: bool,
    ) -> PyResult<Bound<'py, PyArray2<i16>>> {
        let image = self.image(image)?;
        let classes = py.detach(|| self.classes_of_pixels(image, labels_of(refined)));
        arrays::image(py, classes.map_err(|e| exception(&e))?)
    }

    /// Whether each pixel's refined label is another than that of the mesh.
    fn moved<'py>(&self, py: Python<'py>, image: usize) -> PyResult<Bound<'py, PyArray2<bool>>> {
        let image = self.image(image)?;
        let read = || {
            let path = image.path(self.data.layout(), Domain::SemanticMoved);
            let bytes = self.bytes(image, Domain::SemanticMoved)?;
            let moved = PngReader::default().gray8(&bytes, &path)?.into_raster();
            Ok(moved.map(|value| value > 0))
        };
        arrays::image(py, py.detach(read).map_err(|e: Error| exception(&e))?)
    }

    /// World coordinates from depth and pose, NaN where depth is missing.
    fn points<'py>(&self, py: Python<'py>, image: usize) -> PyResult<Bound<'py, PyArray3<f32>>> {
        let image = self.image(image)?;
        let read = || {
            let depth = self.metres(image)?;
            let pose = self.data.pose(image)?;
            let width = depth.width();
            let height = depth.height();
            let camera = self.data.camera(image, &pose, [width, height])?;
            let rays = camera.rays();
            let origin = camera.pose.location;

            let mut points = Raster::filled(width, height, [f32::NAN; 3]);
            for (k, (point, depth)) in points.pixels_mut().iter_mut().zip(depth.pixels()).enumerate() {
                if !depth.is_nan() {
                    let ray = rays.at(k as u32 % width, k as u32 / width);
                    *point = (origin + ray * f64::from(*depth)).as_vec3().to_array();
                }
            }
            Ok(points)
        };
        arrays::image_of_rows(py, py.detach(read).map_err(|e: Error| exception(&e))?)
    }

    /// The share of the pixels of each class, for each of `images`.
    fn class_shares(
        &self,
        py: Python<'_>,
        images: Vec<usize>,
        threads: Option<usize>,
        sink: Py<PyAny>,
    ) -> PyResult<Vec<Vec<f64>>> {
        let images = images
            .into_iter()
            .map(|image| self.image(image))
            .collect::<PyResult<Vec<_>>>()?;
        let count = self.data.taxonomy().map_or(0, |taxonomy| taxonomy.classes().len());

        watched(py, threads, &sink, |ctx| {
            let progress = ctx.progress("counting classes", "images", images.len() as u64);
            map_in_order(
                ctx,
                &images,
                || (),
                |(), image| {
                    let classes = self.classes_of_pixels(image, Domain::Semantic)?;
                    let mut counts = vec![0u64; count];
                    let places = classes.pixels().iter().filter_map(|class| usize::try_from(*class).ok());
                    places.for_each(|place| counts[place] += 1);
                    progress.add(1);
                    Ok(counts
                        .iter()
                        .map(|count| *count as f64 / classes.len() as f64)
                        .collect())
                },
            )
        })
    }
}

impl DataSet {
    fn image(&self, number: usize) -> PyResult<&DatasetImage> {
        let image = self.images.get(number);
        image.ok_or_else(|| usage(format!("image {number}: there are {}", self.images.len())))
    }

    fn check_area(&self, area: u32) -> PyResult<()> {
        let areas = self.data.areas();
        if areas.contains(&area) {
            Ok(())
        } else {
            Err(usage(format!("area {area}: the data set has {areas:?}")))
        }
    }

    fn class_of(&self, label: u32) -> i16 {
        self.class_of_label.get(label as usize).copied().unwrap_or(-1)
    }

    fn bytes(&self, image: &DatasetImage, domain: Domain) -> Result<Vec<u8>> {
        self.data.read(&image.path(self.data.layout(), domain))
    }

    fn rgb8(&self, image: &DatasetImage, domain: Domain) -> Result<Raster<[u8; 3]>> {
        let path = image.path(self.data.layout(), domain);
        Ok(decode_rgb8(&self.bytes(image, domain)?, &path)?)
    }

    /// The depth in metres, NaN where it is missing.
    fn metres(&self, image: &DatasetImage) -> Result<Raster<f32>> {
        let path = image.path(self.data.layout(), Domain::Depth);
        let units = self.data.options().depth_units;
        let stored = decode_gray16(&self.bytes(image, Domain::Depth)?, &path)?;
        Ok(stored.map(|value| units.metres(value).map_or(f32::NAN, |metres| metres as f32)))
    }

    fn classes_of_pixels(&self, image: &DatasetImage, of: Domain) -> Result<Raster<i16>> {
        let path = image.path(self.data.layout(), of);
        let indices = self.rgb8(image, of)?.map(label_index);
        let beyond = indices
            .pixels()
            .iter()
            .find(|index| **index >= self.class_of_label.len() as i32);
        if let Some(index) = beyond {
            let count = self.class_of_label.len();
            let message = format!("holds the label index {index}, and the table has {count} labels");
            return Err(FileError::format(&path, message).into());
        }
        Ok(indices.map(|index| u32::try_from(index).map_or(-1, |index| self.class_of(index))))
    }
}

/// The index of the class of each label; −1 for none.
fn classes_of_labels(table: &LabelTable) -> Vec<i16> {
    (0..table.len() as u32)
        .map(|id| table.class_of(LabelId(id)).map_or(-1, |class| class.index() as i16))
        .collect()
}

pub(crate) fn domain(modality: &str) -> PyResult<Domain> {
    modality
        .parse()
        .map_err(|e: s3d_io::dataset::UnknownDomain| usage(e.to_string()))
}

/// The modality that labels are read from.
fn labels_of(refined: bool) -> Domain {
    if refined {
        Domain::SemanticRefined
    } else {
        Domain::Semantic
    }
}

/// The label index that a colour stands for, −1 where nothing is seen.
fn label_index(pixel: [u8; 3]) -> i32 {
    if pixel == UNSEEN {
        return -1;
    }
    let [r, g, b] = pixel.map(i32::from);
    r << 16 | g << 8 | b
}

/// Returns the window (x, y, width, height) of an image in another size: see [`area_mean`].
#[pyfunction]
pub(crate) fn averaged<'py>(
    py: Python<'py>,
    image: PyReadonlyArray3<'_, u8>,
    window: [u32; 4],
    size: [u32; 2],
) -> PyResult<Bound<'py, PyArray3<u8>>> {
    let image = raster("image", &image)?;
    let mean = py.detach(|| area_mean(&image, window, size));
    let outside = || usage(format!("window {window:?} in size {size:?}: not within the image"));
    arrays::image_of_rows(py, mean.ok_or_else(outside)?)
}
