//! The mesh of an area: where it is read from, and where it lies.

use crate::context::Context;
use crate::error::{Error, Result};
use glam::{DAffine3, DVec3};
use s3d_geom::Aabb;
use s3d_io::camera::ScanLocation;
use s3d_io::cloud::{Annotations, FrameGap};
use s3d_io::mesh::{MeshFile, MeshOptions, UpAxis};
use s3d_io::scene::PublishedArea;
use std::path::{Path, PathBuf};
use std::sync::Arc;

/// Where an area's mesh comes from.
pub(crate) enum MeshSource {
    Files {
        paths: Vec<PathBuf>,
        up: UpAxis,
        options: MeshOptions,
        /// Colours that its vertices get instead of the colours of the files; empty if there are none.
        colors: Vec<[u8; 3]>,
    },
    Published(Box<PublishedArea>),
    Memory(Arc<MeshFile>),
    /// Joined from the first part and the others.
    Parts(Box<PartMesh>, Vec<PartMesh>),
}

/// The mesh of a part.
pub(crate) struct PartMesh {
    pub(super) source: MeshSource,
    /// From where the part's mesh lies to where the area's mesh lies.
    pub(super) scene_from_part: DAffine3,
    /// The faces that stay, of those that the moved mesh has. `None`: all of them.
    pub(super) faces: Option<Vec<u32>>,
}

impl PartMesh {
    fn read(&self) -> Result<MeshFile> {
        let file = Arc::unwrap_or_clone(self.source.read()?);
        let (moved, _) = file.transformed(&self.scene_from_part)?;
        match &self.faces {
            Some(faces) => Ok(moved.with_faces(faces)?),
            None => Ok(moved),
        }
    }
}

impl MeshSource {
    pub(crate) fn read(&self) -> Result<Arc<MeshFile>> {
        let file = match self {
            Self::Memory(file) => return Ok(Arc::clone(file)),
            Self::Files { paths, up, options, colors } => {
                let mut file = s3d_io::mesh::read_meshes_with(paths, *up, options)?;
                if !colors.is_empty() {
                    file.mesh = file.mesh.with_vertex_colors(colors.clone());
                }
                file
            }
            Self::Published(area) => area.read_mesh()?.file,
            Self::Parts(first, others) => {
                let others = others.iter().map(PartMesh::read).collect::<Result<Vec<_>>>()?;
                let (joined, _) = first.read()?.joined(others.into_iter().map(Ok))?;
                joined
            }
        };
        Ok(Arc::new(file))
    }

    /// The list of labels of a published area, or of the first part if all parts are published.
    pub(super) fn published_labels(&self) -> Option<&PathBuf> {
        match self {
            Self::Published(area) => area.labels.as_ref(),
            Self::Parts(first, others) => {
                let are_published = others.iter().all(|part| part.source.published_labels().is_some());
                first.source.published_labels().filter(|_| are_published)
            }
            Self::Files { .. } | Self::Memory(_) => None,
        }
    }

    pub(crate) fn describe(&self) -> String {
        match self {
            Self::Published(area) => area.mesh.display().to_string(),
            Self::Parts(first, others) => format!("{} and {} more", first.source.describe(), others.len()),
            Self::Memory(file) => file
                .sources
                .first()
                .map_or_else(String::new, |s| s.path.display().to_string()),
            Self::Files { paths, .. } => {
                let more = paths.len() - 1;
                let first = paths[0].display();
                if more == 0 {
                    first.to_string()
                } else {
                    format!("{first} and {more} more")
                }
            }
        }
    }
}

/// Where a mesh lies.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MeshFrame {
    /// Its box.
    pub(crate) bounds: Aabb,
    /// What was subtracted from the scan's coordinates, metres, in the world's axes.
    pub(crate) offset_m: DVec3,
    /// What a program had subtracted before, as a file beside the mesh tells. Zero if `offset_m` is not.
    pub(super) told_m: DVec3,
}

impl MeshFrame {
    /// The frame of a mesh that was read.
    pub(crate) fn of(file: &MeshFile) -> Self {
        Self { bounds: file.mesh.aabb(), offset_m: file.offset_m, told_m: DVec3::ZERO }
    }

    /// Takes an offset that a file beside the mesh tells.
    pub(crate) fn told(&mut self, offset_m: DVec3) {
        if self.offset_m == DVec3::ZERO {
            self.told_m = offset_m;
        }
    }

    /// The offset as tables have it; `None` if it is zero.
    pub(crate) fn offset(&self) -> Option<[f64; 3]> {
        let offset_m = self.offset_m + self.told_m;
        (offset_m != DVec3::ZERO).then(|| offset_m.to_array())
    }

    /// Opens points or cameras, from whose coordinates an offset is subtracted. If a program had moved the
    /// mesh, they may lie beside it or where the scan was: what does not fit the mesh is opened again with
    /// the offset that is told, and the first error is returned if that does not fit either.
    pub(crate) fn open_beside<T>(&self, open: impl Fn(DVec3) -> Result<T>) -> Result<T> {
        let opened = open(self.offset_m);
        if opened.is_ok() || self.told_m == DVec3::ZERO {
            return opened;
        }
        open(self.told_m).or(opened)
    }

    /// Logs the offset, if there is one.
    pub(crate) fn tell(&self, ctx: &Context) {
        if self.offset_m != DVec3::ZERO {
            let offset = self.offset_m.to_array();
            ctx.info(format_args!(
                "offset_m = {offset:?} is subtracted from the coordinates of mesh, points and scan \
                 locations: the world of the data set is the scan's frame less it ([mesh] offset_m in the \
                 scene file says another)"
            ));
        }
    }

    /// Refuses annotated points that all lie far from the mesh. Messages call them `name`.
    pub(crate) fn refuse_far_points(&self, name: &Path, annotations: &Annotations) -> Result<()> {
        let Some(gap) = annotations.frame_gap(DVec3::ZERO, self.bounds) else { return Ok(()) };
        let [x, y, z] = gap.offset_m.to_array();
        Err(Error::unfit(
            name,
            format!(
                "the annotated points lie {gap}, in metres, Z-up; subtract {x:?}, {y:?}, {z:?} from them"
            ),
        ))
    }

    /// Refuses scan locations that all lie far from the mesh.
    pub(crate) fn refuse_far_locations(&self, list: &Path, locations: &[ScanLocation]) -> Result<()> {
        let at = locations.iter().map(|l| l.pose.location);
        let (min, max) = at.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(a, b), p| (a.min(p), b.max(p)));
        let Some(gap) = FrameGap::between([min, max], DVec3::ZERO, self.bounds) else { return Ok(()) };
        let [x, y, z] = (-gap.offset_m + DVec3::ZERO).to_array();
        Err(Error::unfit(
            list,
            format!(
                "the scan locations lie {gap}, in metres, Z-up. Locations and mesh need one frame: if they \
             are of one scan, write transform = [[1, 0, 0, {x:?}], [0, 1, 0, {y:?}], [0, 0, 1, {z:?}], [0, \
             0, 0, 1]] under [cameras] in the scene file"
            ),
        ))
    }
}
