//! `_native.Scene`: what cameras and rays see of a mesh.

mod stack;

use crate::arrays;
use crate::error::{exception, usage};
use crate::mesh::Mesh;
use crate::work::{detached, watched};
use bytemuck::cast_slice;
use half::slice::HalfFloatSliceExt;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::{PyBytes, PyDict};
use s3d_dataset::place::PlaceOptions;
use s3d_dataset::{WalkOptions, check_memory, place_cameras, walk};
use s3d_geom::glam::DVec3;
use s3d_geom::{Camera, NO_INDEX, Nearest, NearestFaces, NormalAxes, Pose, Raster};
use s3d_io::image::{Compression, Content, encode_rgb8};
use s3d_io::mesh::MeshFile;
use s3d_render::{
    Hit, Hits, MipMaps, NO_FACE, Normals, TextureFilter, are_inside, are_rays_blocked, cast, cast_rays,
    correspondences, count_hits, depth_image, normal_image, normal_vectors, rgb_image, sample_edges,
    xyz_image, xyz_image_half,
};
use self_cell::self_cell;
use std::ops::Range;
use std::sync::{Arc, OnceLock};

type Tree<'m> = s3d_render::Scene<'m>;
type Column<'py, T> = Bound<'py, PyArray1<T>>;
type Rows<'py, T = f64> = Bound<'py, PyArray2<T>>;

self_cell!(
    struct MeshAndTree {
        owner: Arc<MeshFile>,
        #[covariant]
        dependent: Tree,
    }
);

self_cell!(
    struct MeshAndNearest {
        owner: Arc<MeshFile>,
        #[covariant]
        dependent: NearestFaces,
    }
);

/// A mesh with the tree over its faces, which any number of threads share.
#[pyclass(frozen)]
pub(crate) struct Scene {
    cell: MeshAndTree,
    mip_maps: MipMaps,
    /// Made when it is asked for the first time.
    nearest: OnceLock<MeshAndNearest>,
}

/// The request for a view: modalities, smooth normals, colour samples of a pixel, and whether pixels are as
/// the files of a data set store them, instead of numbers in metres.
#[derive(FromPyObject)]
struct Request(Vec<String>, bool, u32, bool);

/// A camera: K, or none for a panorama, the pose, and width and height.
#[derive(FromPyObject)]
struct View(Option<[[f64; 3]; 3]>, [[f64; 4]; 4], [u32; 2]);

/// An image of a view.
enum Modality {
    Rgb(Raster<[u8; 3]>),
    Depth(Raster<f32>),
    StoredDepth(Raster<u16>),
    Normal(Raster<[f32; 3]>),
    StoredNormal(Raster<[u8; 3]>),
    Xyz(Raster<[f32; 3]>),
    StoredXyz(Raster<[half::f16; 3]>),
    Face(Raster<i32>),
}

#[pymethods]
impl Scene {
    #[new]
    fn new(py: Python<'_>, mesh: &Bound<'_, Mesh>) -> PyResult<Self> {
        let file = Arc::clone(&mesh.get().file);
        detached(py, None, || {
            let mip_maps = MipMaps::new(&file.mesh);
            let cell = MeshAndTree::new(file, |file| Tree::new(&file.mesh));
            Self { cell, mip_maps, nearest: OnceLock::new() }
        })
    }

    /// Returns the images of a camera by name: a pinhole camera if there is a K, otherwise a panorama.
    fn render<'py>(
        &self,
        py: Python<'py>,
        k: Option<[[f64; 3]; 3]>,
        world_from_camera: [[f64; 4]; 4],
        size: [u32; 2],
        request: Request,
    ) -> PyResult<Bound<'py, PyDict>> {
        let camera = camera(k, world_from_camera, size)?;
        let modalities = request.modalities()?;
        let pixels = f64::from(camera.width) * f64::from(camera.height);
        let what = format!("images of {} × {} pixels", camera.width, camera.height);
        check_memory(&what, pixels * (HIT_BYTES + modalities.iter().map(|word| bytes_of(word)).sum::<f64>()))
            .map_err(|e| exception(&e))?;

        let images = py.detach(|| {
            let mut made = Vec::new();
            let mut hits = cast(self.tree(), &camera);
            self.draw_all(&mut hits, &camera, &request, |word, image| made.push((word.to_owned(), image)));
            made
        });

        let dict = PyDict::new(py);
        for (word, image) in images {
            dict.set_item(word, array(py, image)?)?;
        }
        Ok(dict)
    }

    /// Returns the images of pinhole cameras of one size by name, each in one array: one K for all or one for
    /// each, and the poses.
    #[allow(clippy::too_many_arguments)]
    fn render_stack<'py>(
        &self,
        py: Python<'py>,
        ks: Vec<[[f64; 3]; 3]>,
        poses: Vec<[[f64; 4]; 4]>,
        size: [u32; 2],
        request: Request,
        threads: Option<usize>,
        sink: Py<PyAny>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let ks = ks.iter().cycle().take(poses.len());
        let cameras = ks
            .zip(&poses)
            .map(|(k, pose)| camera(Some(*k), *pose, size))
            .collect::<PyResult<Vec<_>>>()?;
        stack::render_stack(py, self, &cameras, size, &request, threads, &sink)
    }

    /// Returns the first hit of each ray: t, the multiple of the direction (NaN for no hit), and the face
    /// (−1 for no hit).
    fn cast<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'_, f64>,
        directions: PyReadonlyArray2<'_, f64>,
        threads: Option<usize>,
    ) -> PyResult<(Column<'py, f64>, Column<'py, i32>)> {
        let (origins, directions) = rays(&origins, &directions)?;
        let hits = in_parts(py, threads, directions.len(), |part| {
            cast_rays(self.tree(), of_part(&origins, &part), of_part(&directions, &part))
        })?;
        let numbers = |hit: Option<Hit>| hit.map_or((f64::NAN, -1), |hit| (hit.t, hit.face as i32));
        let (t, face) = hits.into_iter().map(numbers).unzip();
        Ok((PyArray1::from_vec(py, t), PyArray1::from_vec(py, face)))
    }

    /// Returns whether each ray hits a face before this multiple of its direction.
    fn occluded<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'_, f64>,
        directions: PyReadonlyArray2<'_, f64>,
        before: f64,
        threads: Option<usize>,
    ) -> PyResult<Column<'py, bool>> {
        let (origins, directions) = rays(&origins, &directions)?;
        let found = in_parts(py, threads, directions.len(), |part| {
            are_rays_blocked(self.tree(), of_part(&origins, &part), of_part(&directions, &part), before)
        })?;
        Ok(PyArray1::from_vec(py, found))
    }

    /// Returns the number of faces that each ray hits.
    fn intersections<'py>(
        &self,
        py: Python<'py>,
        origins: PyReadonlyArray2<'_, f64>,
        directions: PyReadonlyArray2<'_, f64>,
        threads: Option<usize>,
    ) -> PyResult<Column<'py, u32>> {
        let (origins, directions) = rays(&origins, &directions)?;
        let found = in_parts(py, threads, directions.len(), |part| {
            count_hits(self.tree(), of_part(&origins, &part), of_part(&directions, &part))
        })?;
        Ok(PyArray1::from_vec(py, found))
    }

    /// Returns the nearest place of the mesh to each point, its distance in metres, and its face. They are
    /// NaN, NaN and −1 for a point that is not finite.
    fn closest<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'_, f32>,
        threads: Option<usize>,
    ) -> PyResult<(Rows<'py, f32>, Column<'py, f32>, Column<'py, i32>)> {
        let points = arrays::points("points", &points)?;
        let found = in_parts(py, threads, points.len(), |part| {
            let mut found = Vec::new();
            self.nearest().nearest_many(of_part(&points, &part), &mut found);
            found
        })?;
        let of_finite = |nearest: &Nearest, value: f32| match nearest.face {
            NO_INDEX => f32::NAN,
            _ => value,
        };
        let places: Vec<[f32; 3]> = found
            .iter()
            .map(|nearest| nearest.point.to_array().map(|c| of_finite(nearest, c)))
            .collect();
        let distances = found.iter().map(|nearest| of_finite(nearest, nearest.distance_m));
        Ok((
            arrays::rows(py, places)?,
            PyArray1::from_iter(py, distances),
            PyArray1::from_iter(py, found.iter().map(|nearest| nearest.face as i32)),
        ))
    }

    /// Returns whether the mesh encloses each point.
    fn contains<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'_, f64>,
        threads: Option<usize>,
    ) -> PyResult<Column<'py, bool>> {
        let points = arrays::points_f64("points", &points)?;
        let found =
            in_parts(py, threads, points.len(), |part| are_inside(self.tree(), of_part(&points, &part)))?;
        Ok(PyArray1::from_vec(py, found))
    }

    /// Returns places that two cameras see, each K, pose and size: x and y in both images, the places, and
    /// the faces.
    fn correspondences<'py>(
        &self,
        py: Python<'py>,
        cameras: [View; 2],
        count: usize,
    ) -> PyResult<(Rows<'py>, Rows<'py>, Column<'py, i32>)> {
        let [a, b] = cameras.map(|View(k, pose, size)| camera(k, pose, size));
        let (a, b) = (a?, b?);
        let found = detached(py, None, || correspondences(self.tree(), [&a, &b], count))?;

        let pixels: Vec<[f64; 4]> = found
            .iter()
            .map(|c| [c.pixels[0].x, c.pixels[0].y, c.pixels[1].x, c.pixels[1].y])
            .collect();
        let points: Vec<[f64; 3]> = found.iter().map(|c| c.point.to_array()).collect();
        let faces = found.iter().map(|c| c.face as i32).collect();
        Ok((
            PyArray1::from_vec(py, pixels.into_flattened()).reshape([found.len(), 4])?,
            PyArray1::from_vec(py, points.into_flattened()).reshape([found.len(), 3])?,
            PyArray1::from_vec(py, faces),
        ))
    }

    /// Places scan locations, and returns the uuid and the matrix camera → world of each.
    fn place_cameras(
        &self,
        py: Python<'_>,
        see: Option<f64>,
        apart: Option<f64>,
        seed: u64,
        threads: Option<usize>,
        sink: Py<PyAny>,
    ) -> PyResult<Vec<(String, [[f64; 4]; 4])>> {
        let options = PlaceOptions { see, apart_m: apart, seed };
        let placed = watched(py, threads, &sink, |ctx| place_cameras(self.tree(), &options, ctx))?;
        Ok(placed
            .into_iter()
            .map(|place| (place.uuid, arrays::world_from_opencv(&place.pose)))
            .collect())
    }

    /// Walks through the mesh, and returns the matrix camera → world of each pose.
    #[allow(clippy::too_many_arguments)]
    fn walk(
        &self,
        py: Python<'_>,
        frames: usize,
        speed_m_s: f64,
        rate: f64,
        height_m: f64,
        seed: u64,
        threads: Option<usize>,
        sink: Py<PyAny>,
    ) -> PyResult<Vec<[[f64; 4]; 4]>> {
        let options = WalkOptions { frames, rate, speed_m_s, height_m, seed };
        let poses = watched(py, threads, &sink, |ctx| walk(self.tree(), &options, ctx))?;
        Ok(poses.iter().map(arrays::world_from_opencv).collect())
    }
}

const MODALITIES: [&str; 5] = ["rgb", "depth", "normal", "xyz", "face"];

/// So many rays or points are looked at on the calling thread.
const FEW_RAYS: usize = 1024;

/// So many are looked at between two looks for signals: up to a second or two of work.
const PART: usize = 1 << 21;

/// Returns rays from their arrays: one origin, or one for each direction.
fn rays(
    origins: &PyReadonlyArray2<'_, f64>,
    directions: &PyReadonlyArray2<'_, f64>,
) -> PyResult<(Vec<DVec3>, Vec<DVec3>)> {
    let origins = arrays::points_f64("origins", origins)?;
    let directions = arrays::points_f64("directions", directions)?;
    if origins.len() != 1 && origins.len() != directions.len() {
        return Err(usage(format!(
            "{} origins for {} directions: one for all, or one for each",
            origins.len(),
            directions.len()
        )));
    }
    if origins.is_empty() {
        return Err(usage("origins: there are none"));
    }
    Ok((origins, directions))
}

/// Calls `call` with parts of so many rays or points, without Python's lock, and joins what it finds. A few
/// are looked at on this thread, since they take less time than the start of another. Between two parts,
/// Python may raise an exception, such as that of Ctrl-C.
fn in_parts<T: Send>(
    py: Python<'_>,
    threads: Option<usize>,
    count: usize,
    call: impl Fn(Range<usize>) -> Vec<T> + Sync,
) -> PyResult<Vec<T>> {
    if count <= FEW_RAYS {
        return Ok(py.detach(|| call(0..count)));
    }
    let mut all = Vec::new();
    for start in (0..count).step_by(PART) {
        py.check_signals()?;
        let mut part = detached(py, threads, || call(start..count.min(start + PART)))?;
        if all.is_empty() {
            all = part;
            all.reserve_exact(count - all.len());
        } else {
            all.append(&mut part);
        }
    }
    Ok(all)
}

/// The rays or points of a part. One origin is that of all rays.
fn of_part<'a, T>(all: &'a [T], part: &Range<usize>) -> &'a [T] {
    if all.len() == 1 {
        all
    } else {
        all.get(part.clone()).unwrap_or_default()
    }
}

/// The bytes of a pixel's hit: its face and its depth.
const HIT_BYTES: f64 = 8.0;

/// The bytes of a pixel of an image, at most.
fn bytes_of(modality: &str) -> f64 {
    match modality {
        "rgb" => 3.0,
        "depth" | "face" => 4.0,
        _ => 12.0,
    }
}

impl Request {
    /// Returns the modalities, if all of them are known.
    fn modalities(&self) -> PyResult<&[String]> {
        let Self(modalities, _, rgb_samples, ..) = self;
        if let Some(word) = modalities.iter().find(|word| !MODALITIES.contains(&word.as_str())) {
            return Err(usage(format!("modalities: {word:?} is none of {}", MODALITIES.join(", "))));
        }
        if !(1..=64).contains(rgb_samples) {
            return Err(usage(format!("rgb_samples={rgb_samples}: must be from 1 to 64")));
        }
        Ok(modalities)
    }
}

impl Scene {
    fn tree(&self) -> &Tree<'_> {
        self.cell.borrow_dependent()
    }

    fn nearest(&self) -> &NearestFaces<'_> {
        let file = || Arc::clone(self.cell.borrow_owner());
        let nearest = self
            .nearest
            .get_or_init(|| MeshAndNearest::new(file(), |file| NearestFaces::new(&file.mesh)));
        nearest.borrow_dependent()
    }

    /// Makes the images that are asked for, and hands each on. Takes from the hits what becomes an image.
    fn draw_all(
        &self,
        hits: &mut Hits,
        camera: &Camera,
        request: &Request,
        mut then: impl FnMut(&str, Modality),
    ) {
        let Request(modalities, .., stored) = request;
        // Depth and faces take the hits themselves, so they are made last.
        let mut words: Vec<&str> = modalities.iter().map(String::as_str).collect();
        words.sort_by_key(|word| (*word == "depth" && !*stored) || *word == "face");
        words
            .iter()
            .for_each(|word| then(word, self.draw(word, hits, camera, request)));
    }

    fn draw(&self, word: &str, hits: &mut Hits, camera: &Camera, request: &Request) -> Modality {
        let scene = self.tree();
        let Request(_, smooth, rgb_samples, stored) = request;
        let normals = if *smooth { Normals::Smooth } else { Normals::Flat };

        match (word, *stored) {
            ("rgb", _) => {
                let mut rgb = rgb_image(scene, &self.mip_maps, hits, camera);
                let filter = TextureFilter::default();
                sample_edges(scene, &self.mip_maps, hits, camera, &filter, *rgb_samples, &mut rgb);
                Modality::Rgb(rgb)
            }
            ("depth", true) => Modality::StoredDepth(depth_image(hits)),
            ("depth", false) => {
                let nothing = Raster::from_vec(0, 0, Vec::new());
                let mut depth = std::mem::replace(&mut hits.depth, nothing);
                for depth in depth.pixels_mut().iter_mut().filter(|depth| depth.is_infinite()) {
                    *depth = f32::NAN;
                }
                Modality::Depth(depth)
            }
            ("normal", true) => Modality::StoredNormal(normal_image(scene, hits, camera, normals)),
            ("normal", false) => {
                Modality::Normal(normal_vectors(scene, hits, camera, normals, NormalAxes::OpenCv))
            }
            ("xyz", true) => Modality::StoredXyz(xyz_image_half(hits, camera)),
            ("xyz", false) => {
                let mut xyz = xyz_image(hits, camera);
                for (xyz, face) in xyz.pixels_mut().iter_mut().zip(hits.face.pixels()) {
                    if *face == NO_FACE {
                        *xyz = [f32::NAN; 3];
                    }
                }
                Modality::Xyz(xyz)
            }
            // `render` has refused unknown words.
            _ => Modality::Face(hits.face.map(|face| face as i32)),
        }
    }
}

impl Modality {
    /// Returns the bytes of all pixels.
    fn bytes(&self) -> &[u8] {
        match self {
            Self::Rgb(image) | Self::StoredNormal(image) => image.pixels().as_flattened(),
            Self::Depth(image) => cast_slice(image.pixels()),
            Self::StoredDepth(image) => cast_slice(image.pixels()),
            Self::Normal(image) | Self::Xyz(image) => cast_slice(image.pixels()),
            Self::StoredXyz(image) => cast_slice(image.pixels().as_flattened().reinterpret_cast()),
            Self::Face(image) => cast_slice(image.pixels()),
        }
    }
}

fn array<'py>(py: Python<'py>, modality: Modality) -> PyResult<Bound<'py, PyAny>> {
    Ok(match modality {
        Modality::Rgb(image) | Modality::StoredNormal(image) => arrays::image_of_rows(py, image)?.into_any(),
        Modality::Depth(image) => arrays::image(py, image)?.into_any(),
        Modality::StoredDepth(image) => arrays::image(py, image)?.into_any(),
        Modality::Normal(image) | Modality::Xyz(image) => arrays::image_of_rows(py, image)?.into_any(),
        Modality::StoredXyz(image) => arrays::image_of_rows(py, image)?.into_any(),
        Modality::Face(image) => arrays::image(py, image)?.into_any(),
    })
}

/// A pinhole camera, or a panorama if there is no K.
pub(crate) fn camera(k: Option<[[f64; 3]; 3]>, pose: [[f64; 4]; 4], size: [u32; 2]) -> PyResult<Camera> {
    /// The largest width or height of an image.
    const MOST: u32 = 32_768;
    let [width, height] = size;
    if !(1..=MOST).contains(&width) || !(1..=MOST).contains(&height) {
        return Err(usage(format!("size=({width}, {height}): width and height must be from 1 to {MOST}")));
    }
    let pose = Pose::from_opencv(pose).map_err(|e| usage(format!("T_world_cam: {e}")))?;
    let Some(k) = k else {
        if width != 2 * height {
            return Err(usage(format!("width={width}: a panorama is half as high as wide, so even")));
        }
        return Ok(Camera::equirectangular(pose, width));
    };
    let camera =
        Camera::from_k_rt(k, pose.rt_matrix(), width, height).map_err(|e| usage(format!("K: {e}")))?;
    // The pose is kept as given: the way through the matrix and back would round it.
    Ok(Camera { pose, ..camera })
}

/// Encodes an image of colours, height × width × 3, as a PNG file.
#[pyfunction]
pub(crate) fn encode_png<'py>(
    py: Python<'py>,
    image: numpy::PyReadonlyArray3<'_, u8>,
) -> PyResult<Bound<'py, PyBytes>> {
    let texture = crate::mesh::raster("image", &image)?;
    let png = py.detach(|| encode_rgb8(&texture, Content::Photo, Compression::Fast));
    Ok(PyBytes::new(py, &png))
}

/// The matrix camera → world of a camera at `eye` that looks at `target`.
#[pyfunction]
pub(crate) fn look_at(eye: [f64; 3], target: [f64; 3], up: [f64; 3]) -> PyResult<[[f64; 4]; 4]> {
    let pose = Pose::look_at(eye.into(), target.into(), up.into());
    Ok(arrays::world_from_opencv(&pose.map_err(|e| usage(e.to_string()))?))
}
