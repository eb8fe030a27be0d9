//! An area that is not read from files.

use crate::context::Context;
use crate::error::{Error, Result};
use crate::export::input::area::AreaInput;
use crate::export::input::cameras::Cameras;
use crate::export::input::mesh::{MeshFrame, MeshSource};
use crate::export::input::numbering::number;
use crate::export::input::photographs::Photographs;
use crate::export::input::scene::Opened;
use crate::fuse::fused_scene;
use crate::options::placing::Placing;
use crate::record::request::InputRecord;
use s3d_geom::{MeshParts, PointCloud, TriMesh, Wrap};
use s3d_io::camera::ScanLocation;
use s3d_io::cloud::Annotations;
use s3d_io::fs::ChecksumOfParts;
use s3d_io::mesh::{LengthUnit, MeshFile, MeshFormat, UpAxis};
use std::path::PathBuf;
use std::sync::Arc;

/// The name of a [`MemoryScene`]'s mesh in messages and the manifest.
const MESH: &str = "mesh in memory";

/// One area whose mesh, annotations and scan locations the caller has at hand.
#[derive(Clone, Debug)]
pub struct MemoryScene {
    /// Its number, from 1.
    pub area: u32,
    /// Its surface, world metres, Z-up. No two faces may have the same corners
    /// ([`TriMesh::without_repeated_faces`]).
    pub mesh: TriMesh,
    /// The annotations of its surface; `None` makes a data set without labels.
    pub annotations: Option<Annotations>,
    /// Where images are rendered, each with a uuid of its own. If there are none, some are placed: see
    /// [`ExportOptions::see`](crate::ExportOptions::see).
    pub locations: Vec<ScanLocation>,
}

/// One area of an export: a scene file (`scene.toml`) or the folder of a published area (`area_3`), by its
/// path, the files of a mesh, or values in memory.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub enum SceneSource {
    /// Read from this path.
    Path(PathBuf),
    /// The files of a mesh, which are joined: an area without labels. Its number is 1.
    Meshes {
        /// Of formats that [`MeshFormat::ALL`] lists.
        paths: Vec<PathBuf>,
        /// Which axis points up; `None`: +Y in glTF, as it defines, and guessed in the others.
        up: Option<UpAxis>,
        /// The unit of the coordinates; `None`: metres in glTF, as it defines, and in the others what the
        /// file says, or else guessed by the height of rooms.
        units: Option<LengthUnit>,
    },
    /// Values in memory.
    Memory(Arc<SharedScene>),
}

impl<P: Into<PathBuf>> From<P> for SceneSource {
    fn from(path: P) -> Self {
        let path = path.into();
        if MeshFormat::of(&path).is_some() {
            Self::Meshes { paths: vec![path], up: None, units: None }
        } else {
            Self::Path(path)
        }
    }
}

impl SceneSource {
    /// Returns what is read instead of a raw scan: the scene of its fused mesh, which is made if it is not
    /// there. Other sources stay as they are.
    pub(crate) fn fused(self, ctx: &Context) -> Result<Self> {
        match &self {
            Self::Path(path) => Ok(fused_scene(path, ctx)?.map_or(self, Self::Path)),
            Self::Meshes { .. } | Self::Memory(_) => Ok(self),
        }
    }

    /// Makes a source of each path, and a single one of all meshes among them.
    pub fn list(
        paths: impl IntoIterator<Item = PathBuf>,
        up: Option<UpAxis>,
        units: Option<LengthUnit>,
    ) -> Vec<Self> {
        let (meshes, others): (Vec<PathBuf>, Vec<PathBuf>) =
            paths.into_iter().partition(|path| MeshFormat::of(path).is_some());
        let mut sources: Vec<Self> = others.into_iter().map(Self::Path).collect();
        if !meshes.is_empty() {
            sources.push(Self::Meshes { paths: meshes, up, units });
        }
        sources
    }
}

impl From<MemoryScene> for SceneSource {
    fn from(scene: MemoryScene) -> Self {
        let MemoryScene { area, mesh, annotations, locations } = scene;
        let mesh = Arc::new(MeshFile::in_memory(MESH, mesh));
        SharedScene::new(area, mesh, annotations, locations).into()
    }
}

impl From<SharedScene> for SceneSource {
    fn from(scene: SharedScene) -> Self {
        Self::Memory(Arc::new(scene))
    }
}

/// A [`MemoryScene`] that several exports may share.
#[derive(Debug)]
pub struct SharedScene {
    pub(crate) area: u32,
    pub(crate) mesh: Arc<MeshFile>,
    pub(crate) annotations: Option<Annotations>,
    pub(crate) locations: Vec<ScanLocation>,
}

impl SharedScene {
    /// Makes a [`MemoryScene`] whose mesh the caller shares.
    pub fn new(
        area: u32,
        mesh: Arc<MeshFile>,
        annotations: Option<Annotations>,
        locations: Vec<ScanLocation>,
    ) -> Self {
        Self { area, mesh, annotations, locations }
    }

    /// Its name in messages.
    pub(crate) fn name(&self) -> PathBuf {
        format!("area {} in memory", self.area).into()
    }

    /// Refuses values that files could not hold.
    pub(crate) fn check(&self) -> Result<()> {
        let name = self.name();
        let refuse = |what: String| Err(Error::unfit(&name, what));
        if self.area == 0 {
            return refuse("areas count from 1".to_owned());
        }

        let (_, repeated) = self.mesh.mesh.clone().without_repeated_faces();
        if repeated > 0 {
            return refuse(format!(
                "{repeated} faces have the corners of earlier ones: leave them out \
                 (TriMesh::without_repeated_faces)"
            ));
        }

        for location in &self.locations {
            if crate::options::canonical_uuid(&location.uuid).ok().as_deref() != Some(&location.uuid) {
                return refuse(format!("uuid {:?} is not 32 lower-case hexadecimal digits", location.uuid));
            }
        }

        Ok(())
    }

    /// The records of its parts, with the checksums of their values. They tell whether a later call is the
    /// same, and continues this one.
    pub(crate) fn records(&self) -> Result<Vec<InputRecord>> {
        let mut sums = vec![("mesh", sum_of_mesh(self.mesh.mesh.parts()))];
        if let Some(annotations) = &self.annotations {
            sums.push(("annotations", sum_of_annotations(annotations)?));
            if !annotations.taxonomy.is_s3dis() {
                let mut sum = ChecksumOfParts::default();
                sum.add(format!("{:?}", annotations.taxonomy.definition()).as_bytes());
                sums.push(("taxonomy", sum));
            }
        }
        sums.push(("locations", self.sum_of_locations()));

        let mut records = Vec::with_capacity(sums.len());
        for (name, sum) in sums {
            let (bytes, xxh3_128) = sum.finish();
            records.push(InputRecord { path: format!("memory:{name}"), bytes, xxh3_128 });
        }
        Ok(records)
    }

    fn sum_of_locations(&self) -> ChecksumOfParts {
        let mut sum = ChecksumOfParts::default();
        for location in &self.locations {
            sum.add(location.uuid.as_bytes());
            let at = location.pose.location.to_array();
            let rt = location.pose.rt_matrix();
            let numbers = at.into_iter().chain(rt.into_iter().flatten());
            numbers.for_each(|number| sum.add(&number.to_le_bytes()));
        }
        sum
    }
}

impl AreaInput {
    /// Opens an area that is in memory.
    pub(super) fn in_memory(scene: &SharedScene, asked: Option<Placing>, opened: Opened) -> Result<Self> {
        scene.check()?;
        let name = scene.name();

        let frame = MeshFrame::of(&scene.mesh);
        let mut rooms = Vec::new();
        let mut warnings = Vec::new();
        if opened.annotations
            && let Some(annotations) = &scene.annotations
        {
            frame.refuse_far_points(&name, annotations)?;
            let mut annotations = annotations.clone();
            warnings = std::mem::take(&mut annotations.warnings);
            rooms = number(scene.area, annotations).map_err(|e| Error::unfit(&name, e.to_string()))?;
        }

        let cameras = match asked {
            Some(placing) => Cameras::Placed(placing),
            None => Cameras::listed_or_placed(scene.locations.clone(), vec![None; scene.locations.len()]),
        };
        frame.refuse_far_locations(&name, cameras.listed())?;

        Ok(Self {
            number: scene.area,
            source: MeshSource::Memory(Arc::clone(&scene.mesh)),
            frame,
            mesh_file: Some(Arc::clone(&scene.mesh)),
            pictures: Vec::new(),
            is_labelled: scene.annotations.is_some(),
            taxonomy: scene
                .annotations
                .as_ref()
                .map(|a| a.taxonomy.clone())
                .unwrap_or_default(),
            rooms,
            cameras,
            cameras_path: name.clone(),
            photographs: Photographs::default(),
            path: name,
            notes: Vec::new(),
            warnings,
            lenient: false,
            files: Vec::new(),
            sources: Vec::new(),
            annotations: Vec::new(),
            found: None,
            records: scene.records()?,
        })
    }
}

fn sum_of_annotations(annotations: &Annotations) -> Result<ChecksumOfParts> {
    let mut sum = ChecksumOfParts::default();
    let mut cloud = PointCloud::default();
    for room in &annotations.rooms {
        for instance in &room.instances {
            let name = format!("{} {}_{}\n", room.room, instance.class, instance.number);
            sum.add(name.as_bytes());
            cloud.clear();
            instance.read(&mut cloud)?;
            add(&mut sum, &cloud.positions, |p| p.to_array().map(f32::to_le_bytes));
            add(&mut sum, &cloud.colors, |c| [*c]);
            add(&mut sum, &cloud.faces, |f| [f.to_le_bytes()]);
        }
    }
    Ok(sum)
}

/// Adds the length of a column, and its elements.
fn add<T, const N: usize, const M: usize>(
    sum: &mut ChecksumOfParts,
    column: &[T],
    bytes: impl Fn(&T) -> [[u8; M]; N],
) {
    sum.add(&(column.len() as u64).to_le_bytes());
    let mut block = Vec::with_capacity(N * M * column.len().min(1 << 12));
    for part in column.chunks(1 << 12) {
        block.clear();
        part.iter()
            .for_each(|element| block.extend_from_slice(bytes(element).as_flattened()));
        sum.add(&block);
    }
}

/// The bytes of a face's three indices.
fn triple(indices: &[u32; 3]) -> [[u8; 4]; 3] {
    indices.map(u32::to_le_bytes)
}

fn sum_of_mesh(parts: &MeshParts) -> ChecksumOfParts {
    let mut sum = ChecksumOfParts::default();

    add(&mut sum, &parts.positions, |p| p.to_array().map(f32::to_le_bytes));
    add(&mut sum, &parts.faces, triple);
    add(&mut sum, &parts.colors, |c| [*c]);
    add(&mut sum, &parts.uvs, |p| p.to_array().map(f32::to_le_bytes));
    add(&mut sum, &parts.face_uvs, triple);
    add(&mut sum, &parts.normals, |p| p.to_array().map(f32::to_le_bytes));
    add(&mut sum, &parts.face_normals, triple);
    add(&mut sum, &parts.face_materials, |m| [m.to_le_bytes()]);

    for material in &parts.materials {
        sum.add(material.name.as_bytes());
        sum.add(&[0]);
        sum.add(&material.color);
        sum.add(&material.texture.map_or(u64::MAX, u64::from).to_le_bytes());
    }

    for texture in &parts.textures {
        sum.add(texture.name.as_bytes());
        sum.add(&[0]);
        sum.add(&texture.image.width().to_le_bytes());
        add(&mut sum, texture.image.pixels(), |p| [*p]);
        sum.add(&texture.wrap.map(|wrap| match wrap {
            Wrap::Repeat => 0,
            Wrap::Mirror => 1,
            Wrap::Clamp => 2,
        }));
    }
    sum
}
