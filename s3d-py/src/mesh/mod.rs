//! `_native.Mesh`: a mesh that scenes, arrays and exports share.

pub(crate) mod edit;

use crate::arrays;
use crate::error::{exception, fault, usage};
use crate::work::{detached, watched};
use numpy::ndarray::ArrayView2;
use numpy::{Element, PyArray1, PyArray2, PyArray3, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use numpy::{PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use s3d_dataset::{MeshAxes, read_mesh};
use s3d_geom::glam::Vec2;
use s3d_geom::{DEFAULT_COLOR, Material, MeshParts, NO_INDEX, Raster, Texture, TriMesh, Wrap};
use s3d_io::Error as FileError;
use s3d_io::mesh::{MeshFile, MeshLabels, MeshOrigin};
use std::collections::BTreeMap;
use std::path::PathBuf;
use std::sync::Arc;

/// The name of a mesh of arrays, for messages.
pub(crate) const IN_MEMORY: &str = "mesh in memory";

/// A mesh from a file or from arrays. It never changes.
#[pyclass(frozen)]
pub(crate) struct Mesh {
    pub(crate) file: Arc<MeshFile>,
}

/// Parses a word. The error lists the `choices`.
pub(crate) fn parsed<T: std::str::FromStr>(what: &str, word: &str, choices: &str) -> PyResult<T> {
    word.parse()
        .map_err(|_| usage(format!("{what}={word:?}: must be one of {choices}")))
}

/// What the caller says of the file of a mesh.
pub(crate) fn axes(up: Option<&str>, units: Option<&str>) -> PyResult<MeshAxes> {
    let up = up.map(|word| parsed("up", word, "y, z")).transpose()?;
    let units = units
        .map(|word| parsed("units", word, "m, cm, mm, ft, in"))
        .transpose()?;
    Ok(MeshAxes { up, units })
}

type Rows<'py, T> = Bound<'py, PyArray2<T>>;

#[pymethods]
impl Mesh {
    /// Reads the file of a mesh.
    #[staticmethod]
    fn read(
        py: Python<'_>,
        path: PathBuf,
        up: Option<&str>,
        units: Option<&str>,
        near: bool,
        sink: Py<PyAny>,
    ) -> PyResult<Self> {
        let axes = axes(up, units)?;
        let origin = if near { MeshOrigin::Near } else { MeshOrigin::OfFile };
        let file = watched(py, None, &sink, |ctx| read_mesh(&path, axes, origin, ctx))?;
        Ok(Self { file: Arc::new(file) })
    }

    /// Makes a mesh of arrays.
    #[staticmethod]
    #[allow(clippy::too_many_arguments)]
    fn from_arrays(
        py: Python<'_>,
        vertices: PyReadonlyArray2<'_, f32>,
        faces: PyReadonlyArray2<'_, u32>,
        vertex_colors: Option<PyReadonlyArray2<'_, u8>>,
        face_colors: Option<PyReadonlyArray2<'_, u8>>,
        uv: Option<PyReadonlyArray2<'_, f32>>,
        face_uv: Option<PyReadonlyArray2<'_, u32>>,
        textures: Vec<PyReadonlyArray3<'_, u8>>,
        texture_of_face: Option<PyReadonlyArray1<'_, u32>>,
        vertex_normals: Option<PyReadonlyArray2<'_, f32>>,
        source_faces: Option<PyReadonlyArray1<'_, u32>>,
    ) -> PyResult<Self> {
        let faces = arrays::from_rows::<u32, 3>("faces", &faces)?;
        let count = faces.len();
        let face_tags = match source_faces {
            Some(numbers) => numbers.to_vec().map_err(|e| usage(format!("source_faces: {e}")))?,
            None => (0..count as u32).collect(),
        };
        let normals = vertex_normals
            .map(|n| arrays::points("vertex_normals", &n))
            .transpose()?;
        let uvs = uv.map(|uv| arrays::from_rows::<f32, 2>("uv", &uv)).transpose()?;
        let textures = textures.iter().enumerate().map(texture).collect::<PyResult<Vec<_>>>()?;
        let mut face_materials = match texture_of_face {
            Some(of_face) => of_face.to_vec().map_err(|e| usage(format!("texture_of_face: {e}")))?,
            None if textures.is_empty() => Vec::new(),
            None => vec![0; faces.len()],
        };
        let mut materials: Vec<Material> = (0..textures.len() as u32).map(material).collect();
        if let Some(colors) = face_colors {
            let colors = arrays::from_rows::<u8, 3>("face_colors", &colors)?;
            if colors.len() != faces.len() {
                return Err(usage(format!("{} face_colors for {} faces", colors.len(), faces.len())));
            }
            face_materials.resize(faces.len(), NO_INDEX);
            color_faces(&mut face_materials, &mut materials, &colors);
        }

        let parts = MeshParts {
            positions: arrays::points("vertices", &vertices)?,
            colors: vertex_colors
                .map(|c| arrays::from_rows("vertex_colors", &c))
                .transpose()?
                .unwrap_or_default(),
            uvs: bytemuck::cast_vec::<[f32; 2], Vec2>(uvs.unwrap_or_default()),
            face_uvs: face_uv
                .map(|f| arrays::from_rows("face_uv", &f))
                .transpose()?
                .unwrap_or_default(),
            face_normals: if normals.is_some() { faces.clone() } else { Vec::new() },
            normals: normals.unwrap_or_default(),
            materials,
            face_materials,
            textures,
            faces,
            face_tags,
        };

        let made = detached(py, None, || TriMesh::new(parts).map(TriMesh::without_repeated_faces))?;
        let (mut mesh, repeated) =
            made.map_err(|source| exception(&FileError::Mesh { path: IN_MEMORY.into(), source }.into()))?;
        let source_faces = mesh.take_face_tags();
        let mut file = MeshFile::in_memory(IN_MEMORY, mesh);
        for (left_out, why) in [
            (count - source_faces.len() - repeated, "they have no area"),
            (repeated, "earlier faces have the same corners"),
        ] {
            if left_out > 0 {
                let text =
                    format!("{left_out} of {count} faces left out: {why}; source_faces numbers the others");
                file.warnings.push(text);
            }
        }
        file.source_faces = source_faces;
        file.repeated_faces = repeated;
        Ok(Self { file: Arc::new(file) })
    }

    #[getter]
    fn vertices<'py>(slf: &Bound<'py, Self>) -> PyResult<Rows<'py, f32>> {
        view(slf, |mesh| bytemuck::cast_slice::<_, [f32; 3]>(mesh.positions()))
    }

    #[getter]
    fn faces<'py>(slf: &Bound<'py, Self>) -> PyResult<Rows<'py, u32>> {
        view(slf, TriMesh::faces)
    }

    #[getter]
    fn vertex_colors<'py>(slf: &Bound<'py, Self>) -> PyResult<Option<Rows<'py, u8>>> {
        let is_there = !slf.get().mesh().parts().colors.is_empty();
        is_there.then(|| view(slf, |mesh| &mesh.parts().colors)).transpose()
    }

    #[getter]
    fn uv<'py>(slf: &Bound<'py, Self>) -> PyResult<Option<Rows<'py, f32>>> {
        let is_there = !slf.get().mesh().parts().uvs.is_empty();
        let uvs = || view(slf, |mesh| bytemuck::cast_slice::<_, [f32; 2]>(&mesh.parts().uvs));
        is_there.then(uvs).transpose()
    }

    #[getter]
    fn face_uv<'py>(slf: &Bound<'py, Self>) -> PyResult<Option<Rows<'py, u32>>> {
        let is_there = !slf.get().mesh().parts().face_uvs.is_empty();
        is_there.then(|| view(slf, |mesh| &mesh.parts().face_uvs)).transpose()
    }

    /// The texture of each face, 2³² − 1 for none.
    #[getter]
    fn texture_of_face<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        let materials = self.mesh().materials();
        let texture = |face: u32| {
            let material = self.mesh().material_of(face).and_then(|m| materials.get(m as usize));
            material.and_then(|m| m.texture).unwrap_or(NO_INDEX)
        };
        PyArray1::from_iter(py, (0..self.mesh().faces().len() as u32).map(texture))
    }

    /// The colour of the material of each face; `None` if no face has one.
    #[getter]
    fn material_colors<'py>(&self, py: Python<'py>) -> PyResult<Option<Rows<'py, u8>>> {
        let materials = self.mesh().materials();
        let of = |face: u32| self.mesh().material_of(face).and_then(|m| materials.get(m as usize));
        let faces = 0..self.mesh().faces().len() as u32;
        if materials.is_empty() || !faces.clone().any(|face| of(face).is_some()) {
            return Ok(None);
        }
        let colors = faces.map(|face| of(face).map_or(DEFAULT_COLOR, |m| m.color));
        arrays::rows(py, colors.collect()).map(Some)
    }

    /// The names and pixels of the textures.
    #[getter]
    fn textures<'py>(slf: &Bound<'py, Self>) -> PyResult<Vec<(String, Bound<'py, PyArray3<u8>>)>> {
        let mut shown = Vec::new();
        for (number, texture) in slf.get().mesh().textures().iter().enumerate() {
            let rows = view(slf, |mesh| {
                mesh.textures()
                    .get(number)
                    .map_or(&[], |texture| texture.image.pixels())
            })?;
            let size = [texture.image.height() as usize, texture.image.width() as usize, 3];
            shown.push((texture.name.clone(), rows.reshape(size)?));
        }
        Ok(shown)
    }

    /// The unit normals of the faces, by their winding.
    fn face_normals<'py>(&self, py: Python<'py>) -> PyResult<Rows<'py, f32>> {
        let normals = (0..self.mesh().faces().len() as u32).map(|face| self.mesh().normal(face).to_array());
        arrays::rows(py, normals.collect())
    }

    /// The areas of the faces, in m².
    fn face_areas<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        PyArray1::from_iter(py, (0..self.mesh().faces().len() as u32).map(|face| self.mesh().area(face)))
    }

    fn open_edges(&self, py: Python<'_>) -> usize {
        py.detach(|| self.mesh().open_edges())
    }

    #[getter]
    fn source_faces<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<u32>> {
        PyArray1::from_slice(py, &self.file.source_faces)
    }

    #[getter]
    fn area(&self) -> f64 {
        self.mesh().total_area()
    }

    #[getter]
    fn bounds(&self) -> [[f32; 3]; 2] {
        let bounds = self.mesh().aabb();
        [bounds.min.to_array(), bounds.max.to_array()]
    }

    #[getter]
    fn offset(&self) -> [f64; 3] {
        self.file.offset_m.to_array()
    }

    #[getter]
    fn warnings(&self) -> Vec<String> {
        self.file.warnings.clone()
    }

    #[getter]
    fn repeated_faces(&self) -> usize {
        self.file.repeated_faces
    }

    #[getter]
    fn has_labels(&self) -> bool {
        self.file.labels.as_ref().is_some_and(MeshLabels::are_certain)
    }

    #[getter]
    fn path(&self) -> Option<PathBuf> {
        let path = self.file.sources.first().map(|source| source.path.clone());
        path.filter(|path| path.as_os_str() != IN_MEMORY)
    }
}

impl Mesh {
    pub(crate) fn mesh(&self) -> &TriMesh {
        &self.file.mesh
    }
}

/// Returns rows of a mesh as a read-only array, without a copy.
fn view<'py, T: Element, const N: usize>(
    mesh: &Bound<'py, Mesh>,
    rows: impl for<'m> FnOnce(&'m TriMesh) -> &'m [[T; N]],
) -> PyResult<Bound<'py, PyArray2<T>>> {
    let rows = rows(mesh.get().mesh());
    let shaped = ArrayView2::from_shape((rows.len(), N), rows.as_flattened());
    let shaped = shaped.map_err(|e| fault(e.to_string()))?;
    // SAFETY: the rows belong to the mesh. Its class is frozen, so they are neither written nor moved while
    // the object lives, and the array keeps the object alive.
    #[allow(unsafe_code)]
    let array = unsafe { PyArray2::borrow_from_array(&shaped, mesh.clone().into_any()) };
    // By NumPy's own flag: a borrow would panic while a call on another thread reads the same rows.
    array.getattr("flags")?.setattr("writeable", false)?;
    Ok(array)
}

fn texture((number, array): (usize, &PyReadonlyArray3<'_, u8>)) -> PyResult<Texture> {
    let image = raster(&format!("textures[{number}]"), array)?;
    Ok(Texture { name: format!("texture_{number}.png"), image, wrap: [Wrap::Repeat; 2] })
}

/// Returns an array height × width × 3 as an image. Errors name the array as `what`.
pub(crate) fn raster(what: &str, array: &PyReadonlyArray3<'_, u8>) -> PyResult<Raster<[u8; 3]>> {
    let shape = array.shape();
    let sides = (u32::try_from(shape[0]), u32::try_from(shape[1]));
    match (array.as_slice(), sides) {
        (Ok(pixels), (Ok(height @ 1..), Ok(width @ 1..))) if shape[2] == 3 => {
            Ok(Raster::from_vec(width, height, pixels.as_chunks().0.to_vec()))
        }
        _ => Err(usage(format!("{what}: an array height × width × 3 of uint8 in C order, not {shape:?}"))),
    }
}

/// Gives faces without a material one of their colour.
fn color_faces(face_materials: &mut [u32], materials: &mut Vec<Material>, colors: &[[u8; 3]]) {
    let mut of_color: BTreeMap<[u8; 3], u32> = BTreeMap::new();
    for (of_face, color) in face_materials.iter_mut().zip(colors).filter(|(of, _)| **of == NO_INDEX) {
        *of_face = *of_color.entry(*color).or_insert_with(|| {
            let [r, g, b] = *color;
            materials.push(Material { name: format!("color_{r}_{g}_{b}"), color: *color, texture: None });
            materials.len() as u32 - 1
        });
    }
}

fn material(number: u32) -> Material {
    let name = format!("material_{number}");
    Material { name, color: DEFAULT_COLOR, texture: Some(number) }
}
