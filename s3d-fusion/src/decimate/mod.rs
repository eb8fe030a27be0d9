//! Fewer faces under a bound of the error: edges are collapsed by quadrics, and every collapse is measured.
//!
//! Sources: M. Garland and P. Heckbert, "Surface simplification using quadric error metrics", 1997, and
//! "Simplifying surfaces with color and texture using quadric error metrics", 1998; H. Hoppe, "New quadric
//! metric for simplifying meshes with appearance attributes", 1999; P. Lindstrom and G. Turk, "Fast and
//! memory efficient polygonal simplification", 1998 (borders).
//!
//! The quadrics say which edge goes next and where its vertex goes. They say nothing about distances: sums
//! over many faces grow with the noise of the faces' directions. So the old surface is sampled at vertices
//! and at the middles of edges and faces, and more densely in large faces. Each sample belongs to a face, and
//! a collapse is done only if all samples around it are within the bound of a face that stays.
//!
//! # What the bound means
//!
//! It holds for the surface as it came, with its noise. A flat wall whose noise stays within the bound
//! becomes a few faces. Noise whose peaks exceed the bound stays as bumps: for normal noise of a standard
//! deviation of two thirds of the bound, an eighth of the vertices are peaks. The bound should then be three
//! to four standard deviations.

mod collapse;
mod distance;
mod patch;
mod quadric;
mod whole;

use crate::columns::{ColumnsError, MeshColumns};
use collapse::{Limits, collapse_edges};
use patch::Patch;
use s3d_geom::glam::Vec3;
use thiserror::Error;
use whole::Whole;

/// How a mesh is decimated.
#[derive(Clone, Debug, PartialEq)]
pub struct DecimateOptions {
    /// No sample of the old surface is farther from the new one than this, metres. Samples are the vertices,
    /// the middles of edges and faces, and points every six bounds within larger faces, as far as twelve
    /// samples a face allow. Samples use 90 % of the bound. Between them the distance can exceed it where the
    /// old faces are much longer than the bound: by a quarter at creases of faces of 2 cm under a bound of
    /// 3 mm. The points of a border are as near to the border.
    pub max_error_m: f32,
    /// The number of faces at which to stop; the bound holds nevertheless. `None` goes on as far as the
    /// bound allows.
    pub target_faces: Option<usize>,
    /// The largest difference of colours: the root of the mean square over the samples of a face and the
    /// channels, in steps of 1/255. It keeps the edges of what is flat on a wall.
    pub max_color_error: f32,
    /// How far a surface may move, in metres, to save a difference of colours from black to white. It decides
    /// which edges go first.
    pub color_weight_m: f64,
}

impl Default for DecimateOptions {
    fn default() -> Self {
        Self { max_error_m: 0.003, target_faces: None, max_color_error: 20.0, color_weight_m: 0.01 }
    }
}

/// A mesh with fewer faces, made by [`decimate`].
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Decimated {
    /// The vertices, in world metres.
    pub positions: Vec<Vec3>,
    /// Three indices into `positions` per face.
    pub faces: Vec<[u32; 3]>,
    /// The colours of the vertices, sRGB: none, or one per vertex.
    pub colors: Vec<[u8; 3]>,
    /// For each vertex, an old vertex that became it: the nearer one at each collapse. It carries columns of
    /// vertices over.
    pub vertex_of: Vec<u32>,
    /// For each face, the old face that it was before its corners moved; ascending.
    pub face_of: Vec<u32>,
    /// The largest distance of a sample of the old surface from the new one that was measured, metres.
    pub max_error_m: f64,
    /// The root of the mean squared distance of the samples, metres.
    pub rms_error_m: f64,
}

/// The reason why a mesh is not decimated.
#[derive(Clone, Debug, Error, PartialEq)]
#[non_exhaustive]
pub enum DecimateError {
    /// The columns are not a mesh.
    #[error(transparent)]
    Columns(#[from] ColumnsError),
    /// An option is negative or not a number.
    #[error("{what} is {value}: give a number that is not negative")]
    Option {
        /// What the option is.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// The caller of [`decimate_while`] ended it.
    #[error("ended before all was simplified")]
    Stopped,
}

/// Pieces of about this many old faces are decimated on their own, then what lies between them. Those of the
/// first round fit into the second-level cache.
const FACES_A_PIECE: [f64; 3] = [10_000.0, 40_000.0, 40_000.0];

/// Where the pieces of each round begin, in pieces.
const SHIFTS: [f64; 3] = [0.0, 1.0 / 3.0, 2.0 / 3.0];

/// Pieces stop at this multiple of the target, so that the last round chooses among all edges.
const SLACK: f64 = 3.0;

/// The share of the bound that samples may use. The rest is for what lies between samples.
const SHARE: f32 = 0.9;

/// Collapses edges while the old surface stays within the bound of the new one.
///
/// Borders and creases are kept within the bound, no face turns over, and the surface stays a manifold where
/// it was one. Around edges with more than two faces, and vertices where two surfaces touch, nothing changes.
/// Faces that name a vertex twice are dropped, and so are vertices that no face uses.
///
/// The same mesh gives the same bytes for any number of threads: cubes of a size that depends on the mesh
/// alone are decimated in parallel, in three rounds whose cubes begin elsewhere. With a target, it is one
/// round, and then the whole.
///
/// ```
/// use s3d_fusion::{DecimateOptions, MeshColumns, decimate};
/// use s3d_geom::{glam::Vec3, primitives::grid};
///
/// // A floor of 20,000 faces becomes a few.
/// let floor = grid(Vec3::ZERO, Vec3::X * 5.0, Vec3::Y * 5.0, [100, 100]);
/// let columns = MeshColumns { positions: &floor.positions, faces: &floor.faces, colors: &[] };
/// let small = decimate(&columns, &DecimateOptions::default())?;
/// assert!(small.faces.len() < 40 && small.max_error_m <= 0.003);
/// # Ok::<(), s3d_fusion::DecimateError>(())
/// ```
///
/// # Errors
/// [`DecimateError`] for columns that are not a mesh, and options that are negative or not a number.
pub fn decimate(mesh: &MeshColumns<'_>, options: &DecimateOptions) -> Result<Decimated, DecimateError> {
    decimate_while(mesh, options, &mut |_| true)
}

/// Does what [`decimate`] does, and tells `go_on` now and then the share of its work that is done, 0 to 1. It
/// ends when `go_on` returns false.
///
/// # Errors
/// As [`decimate`], and [`DecimateError::Stopped`].
pub fn decimate_while(
    mesh: &MeshColumns<'_>,
    options: &DecimateOptions,
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Result<Decimated, DecimateError> {
    mesh.check()?;
    let numbers = [
        ("the largest error", f64::from(options.max_error_m)),
        ("the largest difference of colours", f64::from(options.max_color_error)),
        ("the weight of colours", options.color_weight_m),
    ];
    if let Some((what, value)) = numbers.into_iter().find(|(_, v)| !v.is_finite() || *v < 0.0) {
        return Err(DecimateError::Option { what, value });
    }

    let whole = decimate_in_pieces(mesh, options, FACES_A_PIECE, go_on).ok_or(DecimateError::Stopped)?;
    Ok(compact(&whole, !mesh.colors.is_empty()))
}

/// Decimates pieces of about so many faces, in rounds. With a target it is the last of them, and then the
/// whole. `None` if `go_on` says no.
fn decimate_in_pieces(
    mesh: &MeshColumns<'_>,
    options: &DecimateOptions,
    faces_a_piece: [f64; 3],
    go_on: &mut dyn FnMut(f64) -> bool,
) -> Option<Whole> {
    let mut whole = Whole::new(mesh, options.max_error_m, options.color_weight_m / 255.0);
    let faces = whole.alive();
    let target = options.target_faces.unwrap_or(0);
    let limits =
        |faces| Limits { distance_m: SHARE * options.max_error_m, color: options.max_color_error, faces };

    let [.., most] = faces_a_piece;
    if faces as f64 > 2.0 * most {
        let area_of_face = whole.area() / faces as f64;
        // What lies between the pieces of one round is within those of another, but for single corners.
        let rounds = faces_a_piece
            .into_iter()
            .zip(SHIFTS)
            .skip(if target == 0 { 0 } else { 2 });
        let count = rounds.len() as f64;
        for (round, (faces_a_piece, shift)) in (0..).zip(rounds) {
            let cell_m = (area_of_face * faces_a_piece).sqrt().max(1e-3);
            let work = |piece: &mut Patch| {
                let share = target as f64 * piece.alive as f64 / faces as f64;
                collapse_edges(piece, &limits((SLACK * share).ceil() as usize));
            };
            let mut go_on = |done| go_on((f64::from(round) + done) / count);
            whole.by_cubes(cell_m, shift, work, &mut go_on)?;
        }
        if target == 0 {
            return Some(whole);
        }
    }
    if whole.alive() > target {
        whole.at_once(|all| collapse_edges(all, &limits(target)));
    }
    Some(whole)
}

/// The faces that are alive, and the vertices that they use.
fn compact(whole: &Whole, with_colors: bool) -> Decimated {
    let [max_error_m, rms_error_m] = whole.errors_m();
    let mut small = Decimated { max_error_m, rms_error_m, ..Decimated::default() };
    small.face_of = (0..whole.faces.len() as u32)
        .filter(|&f| whole.is_alive[f as usize])
        .collect();

    let mut number = vec![u32::MAX; whole.positions.len()];
    small
        .face_of
        .iter()
        .for_each(|&f| whole.faces[f as usize].iter().for_each(|&v| number[v as usize] = 0));
    for (v, number) in number.iter_mut().enumerate().filter(|(_, number)| **number == 0) {
        *number = small.positions.len() as u32;
        small.positions.push(whole.positions[v]);
        small.vertex_of.push(whole.nearest_vertex[v]);
        if with_colors {
            small.colors.push(whole.colors[v].to_array().map(|c| c.round() as u8));
        }
    }
    let faces = small.face_of.iter();
    small.faces = faces
        .map(|&f| whole.faces[f as usize].map(|v| number[v as usize]))
        .collect();
    small
}

#[cfg(test)]
mod tests;
