//! Files of segments, as ScanNet's and Matterport3D's tools read them.

use super::{SegmentOptions, Segments, segment_faces};
use s3d_dataset::error::UsageError;
#[cfg(feature = "clap")]
use s3d_dataset::options::words;
use s3d_dataset::store::NewFile;
use s3d_dataset::{Context, Result};
use s3d_geom::TriMesh;
use s3d_io::fs::write_json;
use s3d_io::mesh::{LengthUnit, MeshFile, MeshOptions, MeshOrigin, UpAxis, read_mesh_with};
use serde::Serialize;
use std::path::Path;

/// The segment of what has none: a face that was left out of the mesh.
const NO_SEGMENT: i64 = -1;

/// How the segments of a mesh file are made and written. With the feature `clap` it is a group of
/// arguments of a command line.
#[derive(Clone, Debug, Default)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct SegmentFileOptions {
    /// How the mesh is cut.
    #[cfg_attr(feature = "clap", command(flatten))]
    pub segments: SegmentOptions,
    /// The unit of the file [default: what the file says, or else metres]
    #[cfg_attr(feature = "clap", arg(long, value_name = "m|cm|mm|ft|in",
        value_parser = words::parsed::<LengthUnit>))]
    pub units: Option<LengthUnit>,
    /// Replace the file if it exists.
    #[cfg_attr(feature = "clap", arg(long))]
    pub overwrite: bool,
}

/// What a file of segments is about.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Element {
    Vertex,
    Face,
}

impl Element {
    fn of(path: &Path) -> Option<Self> {
        let name = path.file_name()?.to_str()?;
        let kinds = [(".fsegs.json", Self::Face), (".segs.json", Self::Vertex)];
        kinds
            .into_iter()
            .find(|(ending, _)| name.ends_with(ending))
            .map(|(_, kind)| kind)
    }
}

/// The content of a file.
#[derive(Serialize)]
struct Document {
    params: Params,
    #[serde(rename = "sceneId")]
    scene_id: String,
    #[serde(rename = "segIndices")]
    seg_indices: Vec<i64>,
}

#[derive(Serialize)]
struct Params {
    generator: &'static str,
    scale_m2: f64,
    smallest_m2: f64,
    color: f64,
}

/// Cuts the mesh of a file into segments and writes them as `output`. Returns the segments.
///
/// The name tells the form. `NAME.segs.json` has a segment for each vertex of the file, as in ScanNet: of the
/// segments of the faces around it, the one with the largest area; vertices without a face have one more
/// segment together. `NAME.fsegs.json` has a segment for each face of the file, as in Matterport3D, and −1
/// for a face that is left out of the mesh, such as one without an area; the triangles of a polygon count as
/// one face, which has the segment of the first. Both have the key `segIndices`, and in `params` the options.
///
/// # Errors
/// [`Error::Usage`](s3d_dataset::Error::Usage) if `output` has neither ending, or exists and is not to be
/// replaced. [`Error::File`](s3d_dataset::Error::File) if the mesh cannot be read or the file not be written.
/// [`Error::Cancelled`](s3d_dataset::Error::Cancelled).
pub fn segment_file(
    mesh: &Path,
    output: &Path,
    options: &SegmentFileOptions,
    ctx: &Context,
) -> Result<Segments> {
    let Some(element) = Element::of(output) else {
        let why = "segments of vertices are written as NAME.segs.json, segments of faces as NAME.fsegs.json";
        return Err(UsageError::WrongEnding { path: output.to_owned(), why }.into());
    };
    NewFile::check_free(output, options.overwrite)?;

    let near = MeshOptions { origin: MeshOrigin::Near, units: options.units, ..MeshOptions::default() };
    // Segments do not depend on the direction of gravity.
    let file = read_mesh_with(mesh, UpAxis::Z, &near)?;
    file.warnings.iter().for_each(|warning| ctx.warn(warning));
    ctx.check()?;

    let segments = segment_faces(&file.mesh, &options.segments);
    ctx.check()?;

    let seg_indices = match element {
        Element::Vertex => of_vertices(&file.mesh, &segments),
        Element::Face => of_faces_of_file(&file, &segments),
    };
    let SegmentOptions { scale_m2, smallest_m2, color } = options.segments;
    let document = Document {
        params: Params {
            generator: concat!("s3d ", env!("CARGO_PKG_VERSION")),
            scale_m2,
            smallest_m2,
            color,
        },
        scene_id: mesh.file_stem().unwrap_or_default().to_string_lossy().into_owned(),
        seg_indices,
    };
    let new = NewFile::begin(ctx, output, options.overwrite)?;
    write_json(new.path(), &document)?;
    new.finish()?;
    Ok(segments)
}

fn of_vertices(mesh: &TriMesh, segments: &Segments) -> Vec<i64> {
    let vertices = mesh.positions().len();
    let mut around: Vec<(u32, u32, f64)> = Vec::with_capacity(3 * mesh.faces().len());
    for ((face, corners), segment) in (0u32..).zip(mesh.faces()).zip(&segments.segment_of_face) {
        let area_m2 = mesh.area(face);
        around.extend(corners.map(|vertex| (vertex, *segment, area_m2)));
    }
    // A stable sort: areas are summed in the order of faces.
    around.sort_by_key(|(vertex, segment, _)| (*vertex, *segment));

    let mut segment_of_vertex = vec![i64::from(segments.tree.leaf_count()); vertices];
    let mut largest_m2 = vec![0.0; vertices];
    for faces in around.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let (vertex, segment, _) = faces[0];
        let area_m2: f64 = faces.iter().map(|(.., area_m2)| area_m2).sum();
        if area_m2 > largest_m2[vertex as usize] {
            largest_m2[vertex as usize] = area_m2;
            segment_of_vertex[vertex as usize] = i64::from(segment);
        }
    }
    segment_of_vertex
}

fn of_faces_of_file(file: &MeshFile, segments: &Segments) -> Vec<i64> {
    let last = file.source_faces.iter().max().map_or(0, |face| *face as usize + 1);
    let left_out = file.mesh.report().zero_area_faces + file.repeated_faces;
    // Of a polygon, some triangles may be left out and others not.
    let count = if file.polygons_triangulated == 0 {
        file.mesh.faces().len() + left_out
    } else {
        0
    };

    let mut segment_of_face = vec![NO_SEGMENT; last.max(count)];
    for (face, segment) in file.source_faces.iter().zip(&segments.segment_of_face).rev() {
        segment_of_face[*face as usize] = i64::from(*segment);
    }
    segment_of_face
}
