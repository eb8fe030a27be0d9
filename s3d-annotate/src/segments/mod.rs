//! Segments of a mesh: patches of faces that belong together, and the tree by which they make larger ones.
//!
//! A person who labels a scan paints patches and not triangles, and ScanNet's annotations are lists of such
//! segments. [`segment_faces`] makes them by Felzenszwalb and Huttenlocher's method from the turn of the
//! surface and its colours. [`MergeTree`] then joins them two by two, up to whole pieces of furniture and
//! rooms. [`segment_file`] writes what ScanNet's and Matterport3D's tools read.

mod borders;
mod face_index;
mod file;
mod grow;
mod lists;
mod looks;
mod touch;
mod tree;

pub use face_index::FaceIndex;
pub use file::{SegmentFileOptions, segment_file};
pub use tree::MergeTree;

pub(crate) use lists::Lists;

use borders::borders;
use looks::Looks;
use rayon::prelude::*;
#[cfg(feature = "clap")]
use s3d_dataset::options::words;
use s3d_geom::TriMesh;
use s3d_geom::glam::Vec3;
use std::collections::BTreeMap;
use tree::{Region, Seam, merge};

/// The difference where pieces touch without an edge: as between surfaces that face each other.
const AT_TOUCH: f64 = 2.0;

/// How a mesh is cut into segments. With the feature `clap` it is a group of arguments of a command line.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct SegmentOptions {
    /// The scale of Felzenszwalb and Huttenlocher, in m²: the larger, the larger the segments. Areas take the
    /// place of their numbers of nodes.
    #[cfg_attr(feature = "clap", arg(long = "scale", value_name = "M2", default_value_t = 0.002,
        value_parser = words::positive))]
    pub scale_m2: f64,
    /// A segment smaller than this joins a neighbour, m².
    #[cfg_attr(feature = "clap", arg(long = "smallest", value_name = "M2", default_value_t = 0.003,
        value_parser = words::not_negative))]
    pub smallest_m2: f64,
    /// How much colours count against shape; 0: not at all.
    #[cfg_attr(feature = "clap", arg(long, value_name = "WEIGHT", default_value_t = 1.0,
        value_parser = words::not_negative))]
    pub color: f64,
}

impl Default for SegmentOptions {
    fn default() -> Self {
        Self { scale_m2: 0.002, smallest_m2: 0.003, color: 1.0 }
    }
}

/// The segments of a mesh.
#[derive(Clone, Debug, PartialEq)]
pub struct Segments {
    /// The segment of each face. Segments are numbered from 0, by their first faces.
    pub segment_of_face: Vec<u32>,
    /// What makes larger patches of them.
    pub tree: MergeTree,
}

/// Returns the pairs of faces that share an edge.
pub(crate) fn borders_of(mesh: &TriMesh) -> Vec<[u32; 2]> {
    borders(mesh).iter().map(|border| border.faces).collect()
}

/// Returns the pairs of faces that share an edge, and the unit normals of the faces, in which noise is
/// smoothed and edges stay.
pub(crate) fn smoothed(mesh: &TriMesh) -> (Vec<[u32; 2]>, Vec<Vec3>) {
    let borders = borders(mesh);
    let normals = looks::smooth_normals(mesh, &looks::areas(mesh), &borders);
    (borders.iter().map(|border| border.faces).collect(), normals)
}

/// Cuts a mesh into segments, and joins these to a tree.
///
/// Faces that share an edge differ by the turn of their normals, the noise of a scan smoothed, and by the
/// distance of their mean colours in Oklab. A turn counts less where the surface bends away from the viewer.
/// Segments are connected by shared edges; the tree also joins segments that touch within about 2 cm. The
/// result is the same for any number of threads, and depends on the order of faces in ties alone. A mesh
/// takes about 100 bytes a face beside itself.
///
/// ```
/// use s3d_annotate::segments::{SegmentOptions, segment_faces};
/// use s3d_geom::{TriMesh, glam::Vec3, primitives::grid};
///
/// // A floor and a wall in a mesh of 5 cm: two segments of 800 faces.
/// let mut parts = grid(Vec3::ZERO, Vec3::X, Vec3::Y, [20, 20]);
/// parts.append(grid(Vec3::ZERO, Vec3::Y, Vec3::Z, [20, 20]));
/// let mesh = TriMesh::new(parts)?;
/// let segments = segment_faces(&mesh, &SegmentOptions::default());
/// assert_eq!(segments.tree.leaf_count(), 2);
/// let wall = segments.segment_of_face.iter().skip(800);
/// assert!(wall.eq(&[1; 800]) && segments.segment_of_face.starts_with(&[0; 800]));
/// # Ok::<(), s3d_geom::MeshError>(())
/// ```
pub fn segment_faces(mesh: &TriMesh, options: &SegmentOptions) -> Segments {
    let borders = borders(mesh);
    let looks = Looks::new(mesh, &borders);
    let differences: Vec<f32> = borders
        .par_iter()
        .map(|border| looks.difference(mesh, border, options.color as f32))
        .collect();
    let (segment_of_face, count) =
        grow::grow(&looks, &borders, &differences, options.scale_m2, options.smallest_m2);

    let mut regions = vec![Region::default(); count];
    for (face, segment) in segment_of_face.iter().enumerate() {
        let area_m2 = looks.area_m2[face];
        let color = looks.color[face].as_dvec3() * area_m2;
        regions[*segment as usize].add(&Region { area_m2, color, perimeter_m: 0.0 });
    }

    // The edges between segments, and where pieces touch that share none.
    let mut seams: BTreeMap<[u32; 2], Seam> = BTreeMap::new();
    let mut add = |[a, b]: [u32; 2], length_m: f64, difference: f64| {
        let seam = seams.entry([a.min(b), a.max(b)]).or_default();
        seam.add(Seam { length_m, difference: difference * length_m });
        regions[a as usize].perimeter_m += length_m;
        regions[b as usize].perimeter_m += length_m;
    };
    for (border, difference) in borders.iter().zip(&differences) {
        let pair = border.faces.map(|face| segment_of_face[face as usize]);
        if pair[0] != pair[1] {
            add(pair, f64::from(border.length_m), f64::from(*difference));
        }
    }
    for touch in touch::touches(mesh, &borders, &segment_of_face) {
        add(touch.segments, touch.length_m, AT_TOUCH);
    }
    let tree = merge(regions, &seams, options.color);
    Segments { segment_of_face, tree }
}
