//! The colours of a mesh from annotated points: `colors = "points"` in a scene file.

use crate::error::{Error, Result};
use s3d_geom::{ColoredVertices, NearestFaces, TriMesh, VertexColors};
use s3d_io::cloud::{Annotations, InstanceReader};
use std::path::Path;

/// The points of a block. Three blocks are in memory.
const BLOCK_POINTS: usize = 1 << 19;

/// Larger shares of a mesh's surface without points of its own cause a warning.
const MUCH_BARE: f64 = 0.01;
const MUCH_SPREAD: f64 = 0.1;

/// A larger share of surface whose points show more than its vertices can hold causes a warning.
const MUCH_BLURRED: f64 = 0.2;

/// What the points gave.
pub(super) struct PointColors {
    pub(super) vertices: ColoredVertices,
    area_m2: f64,
}

impl PointColors {
    /// Colours the mesh from all points of `annotations`, as the scene file `scene` asks for.
    pub(super) fn of(scene: &Path, mesh: &TriMesh, annotations: &Annotations) -> Result<Self> {
        if !mesh.textures().is_empty() {
            return Err(fault(
                scene,
                "the mesh has textures, which would cover these colours: leave the key out",
            ));
        }

        let nearest_faces = NearestFaces::new(mesh);
        let mut colors = VertexColors::new(&nearest_faces);
        let mut reader = InstanceReader::new(BLOCK_POINTS);
        let mut is_black = true;
        let mut instances = annotations.rooms.iter().flat_map(|room| &room.instances).peekable();
        while let Some(instance) = instances.next() {
            reader.read(instance, instances.peek().copied(), |block, _| {
                is_black &= block.colors.iter().all(|color| *color == [0; 3]);
                colors.add(block);
                Ok::<(), Error>(())
            })?;
        }

        if is_black {
            return Err(fault(scene, "the annotated points have no colours"));
        }

        let vertices = colors.finish();
        if vertices.far_points == vertices.points {
            return Err(fault(
                scene,
                "no annotated point is within 10 cm of the mesh: do they share a frame?",
            ));
        }
        Ok(Self { vertices, area_m2: mesh.total_area() })
    }

    /// What was done, for the log.
    pub(super) fn sentence(&self) -> String {
        let ColoredVertices { colors, points, far_points, .. } = &self.vertices;
        format!(
            "the mesh takes its colours from {} points for {} vertices",
            points - far_points,
            colors.len()
        )
    }

    /// What looks wrong, a sentence each.
    pub(super) fn doubts(&self) -> Vec<String> {
        let ColoredVertices { spread_m2, bare_m2, blurred_m2, .. } = &self.vertices;
        let percent = |part: f64| format!("{:.0} %", 100.0 * part / self.area_m2);
        let mut doubts = Vec::new();
        if *bare_m2 > MUCH_BARE * self.area_m2 {
            let share = percent(*bare_m2);
            doubts.push(format!("no annotated point is near {share} of the mesh: it stays flat grey there"));
        }
        if *spread_m2 > MUCH_SPREAD * self.area_m2 {
            let share = percent(*spread_m2);
            doubts
                .push(format!("{share} of the mesh have no point at a corner, and the colours around them"));
        }
        if *blurred_m2 > MUCH_BLURRED * self.area_m2 {
            doubts.push(format!(
                "{} of the mesh are faces with more than 16 points: what is finer than these faces is lost. \
                 A mesh of smaller faces, or one with a texture, would show it",
                percent(*blurred_m2)
            ));
        }
        doubts
    }
}

/// An error about the key `colors` of a scene file.
fn fault(scene: &Path, message: &str) -> Error {
    Error::unfit(scene, format!("mesh.colors = \"points\": {message}"))
}
