//! The elements that a detector of `s3d-detect` finds on a mesh.

use super::{Key, Target};
use crate::segments::{SegmentOptions, segment_faces};
use s3d_dataset::{Context, Result};
use s3d_detect::surfel::surfels_of;
use s3d_detect::{Area, Error as DetectError, FoundBox, Model, ParsedArea, SpaceSource, detect_area};
use s3d_geom::glam::Vec3;
use s3d_geom::{Aabb, Density, PointCloud, SurfaceSampler, TriMesh};
use s3d_io::Error as FileError;
use s3d_io::fs::open_file;
use std::io::Read;
use std::path::Path;

/// The points that the detector sees: a handful in each of its cells of 5 cm.
const POINTS: Density = Density::PerM2(4000.0);

/// What is this far outside of a box still belongs to it, metres: a cell of the detector.
const MARGIN_M: f32 = 0.05;

/// The least share of a segment that lies in a box if the segment belongs to it.
const MOST: f64 = 0.6;

/// The first bytes that are asked for the word that begins a model.
const HEAD: u64 = 64;

/// Whether a file is a detector that `s3d_detect::Model::save` has written.
///
/// # Errors
/// [`FileError`] if it cannot be read.
pub(super) fn is_model(path: &Path) -> Result<bool> {
    if path.is_dir() {
        return Ok(false);
    }
    let mut head = Vec::new();
    let read = open_file(path)?.take(HEAD).read_to_end(&mut head);
    read.map_err(|e| FileError::io(path, "read", e))?;
    Ok(head.starts_with(b"{") && String::from_utf8_lossy(&head).contains("\"s3d detector\""))
}

/// Returns what each face belongs to: the elements with a gain in context, numbered from the best. Rooms of
/// the mesh are not known, so spaces are found in its points, whatever the model was trained on.
///
/// # Errors
/// [`FileError`] if the model cannot be used; [`Error::Cancelled`](s3d_dataset::Error::Cancelled).
pub(super) fn keys(path: &Path, target: &Target<'_>, ctx: &Context) -> Result<Vec<Option<Key>>> {
    let failed = |error: DetectError| match error {
        DetectError::Dataset(error) => error,
        error => FileError::format(path, error.to_string()).into(),
    };
    let model = Model::load(path).map_err(failed)?;
    let mut points = PointCloud::default();
    let sampler = SurfaceSampler::new(target.mesh, POINTS, 0);
    sampler.sample(0..sampler.len(), &mut points);
    ctx.check()?;
    let surfels = surfels_of(&points, 0);
    drop(points);
    let area = Area { number: 1, surfels, rooms: vec![String::new()], elements: Vec::new() };
    let mut found = detect_area(&model, &ParsedArea::new(area, SpaceSource::Parsed), ctx).map_err(failed)?;

    found.retain(|element| element.score > 0.0);
    found.sort_by(|a, b| b.score.total_cmp(&a.score));
    ctx.info(format_args!("{}: finds {} elements on the mesh", path.display(), found.len()));
    let known = |element: FoundBox| Some((target.taxonomy.class(&element.class).ok()?, element));
    let known: Vec<_> = found.into_iter().filter_map(known).collect();

    let mut keys: Vec<Option<Key>> = vec![None; target.mesh.faces().len()];
    let pieces = Pieces::of(target.mesh);
    for (number, (class, element)) in (1..).zip(known) {
        for face in pieces.inside(&element) {
            if let Some(key) = keys.get_mut(face as usize) {
                key.get_or_insert((class, Some(number)));
            }
        }
    }
    Ok(keys)
}

/// The segments of a mesh, with the centres of their faces.
struct Pieces {
    segments: Vec<Piece>,
}

struct Piece {
    bounds: Aabb,
    area_m2: f64,
    /// The faces with their centres and areas.
    faces: Vec<(u32, Vec3, f64)>,
}

impl Pieces {
    fn of(mesh: &TriMesh) -> Self {
        let mut segments: Vec<Piece> = Vec::new();
        let segment_of_face = segment_faces(mesh, &SegmentOptions::default()).segment_of_face;
        for (face, segment) in (0u32..).zip(segment_of_face) {
            let [a, b, c] = mesh.triangle(face);
            let (center, area_m2) = ((a + b + c) / 3.0, mesh.area(face));
            let place = segment as usize;
            let none = || Piece { bounds: Aabb::EMPTY, area_m2: 0.0, faces: Vec::new() };
            segments.resize_with(segments.len().max(place + 1), none);
            let Some(piece) = segments.get_mut(place) else { continue };
            piece.bounds = piece.bounds.union(Aabb { min: center, max: center });
            piece.area_m2 += area_m2;
            piece.faces.push((face, center, area_m2));
        }
        Self { segments }
    }

    /// Returns the faces in a box, of segments of which most lies in it.
    fn inside(&self, element: &FoundBox) -> Vec<u32> {
        let [min, max] = [Vec3::from(element.min) - MARGIN_M, Vec3::from(element.max) + MARGIN_M];
        let is_in = |point: Vec3| point.cmpge(min).all() && point.cmple(max).all();
        let mut all = Vec::new();
        for piece in &self.segments {
            if piece.bounds.max.cmplt(min).any() || piece.bounds.min.cmpgt(max).any() {
                continue;
            }
            let within = || piece.faces.iter().filter(|(_, center, _)| is_in(*center));
            let area_m2: f64 = within().map(|(_, _, area)| area).sum();
            if area_m2 >= MOST * piece.area_m2 {
                all.extend(within().map(|(face, _, _)| *face));
            }
        }
        all
    }
}
