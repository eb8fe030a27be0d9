//! The surface of a mesh or a cloud, whatever its file is.

use crate::context::Context;
use crate::error::{Error, Result};
use crate::mesh_axes::{MeshAxes, read_mesh};
use glam::{DAffine3, DMat3, DVec3, Vec3};
use s3d_fusion::SurfacePoints;
use s3d_geom::{PointCloud, TriMesh};
use s3d_io::cloud::{AnnotationOptions, Annotations, InstanceReader};
use s3d_io::mesh::{LengthUnit, MeshFormat, MeshOrigin, UpAxis};
use s3d_io::raw::{RawOptions, RawScan};
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::slice;

/// The edge of the cubes that clouds are thinned by while they are read, metres.
const CELL_M: f64 = 0.02;
/// If so many cubes are full, they are made wider.
const MOST_CELLS: usize = 4_000_000;
/// The number of annotated points that are read at a time.
const BLOCK: usize = 1 << 16;

/// A surface that was read.
pub(super) struct Read {
    pub(super) points: SurfacePoints,
    /// Subtracted from the coordinates of the file, world axes, metres.
    pub(super) offset_m: DVec3,
    pub(super) shape: Shape,
}

/// What a surface was read from.
pub(super) enum Shape {
    Mesh(TriMesh),
    Cloud(Cloud),
}

/// A laser scan or annotated points, whose points are read as often as they are asked for.
pub(super) struct Cloud {
    path: PathBuf,
    world_from_file: DAffine3,
    is_annotated: bool,
    /// The number of points with finite coordinates.
    pub(super) count: u64,
}

/// A point of a cloud, in the world.
pub(super) struct CloudPoint {
    pub(super) position_m: DVec3,
    /// Where the scanner was, if that is known.
    origin_m: Option<DVec3>,
    pub(super) color: Option<[u8; 3]>,
}

/// What is done with each point.
pub(super) type Take<'a> = dyn FnMut(CloudPoint) -> Result<()> + Send + 'a;

/// Reads a mesh, a laser scan, or annotated points.
pub(super) fn read(path: &Path, axes: MeshAxes, ctx: &Context) -> Result<Read> {
    let thin = |error: s3d_fusion::AlignError| Error::unfit(path, error.to_string());
    let is_annotated = path.is_dir() || has_ending(path, "mat");
    let is_points = !is_annotated && RawScan::form_of(path)?.is_some();
    if !is_annotated && !is_points && MeshFormat::of(path).is_some() {
        let file = read_mesh(path, axes, MeshOrigin::Near, ctx)?;
        let points = SurfacePoints::of_mesh(&file.mesh).map_err(thin)?;
        return Ok(Read { points, offset_m: file.offset_m, shape: Shape::Mesh(file.mesh) });
    }
    if !is_annotated && !is_points && path.exists() {
        let why = "is no mesh (OBJ, glTF, GLB, PLY), no laser scan (E57, PTX, LAS, LAZ, PLY, PCD, text), and \
                   no annotated points (a folder, or pointcloud.mat)";
        return Err(Error::unfit(path, why));
    }

    let turn = axes.up.map_or(DMat3::IDENTITY, UpAxis::rotation);
    let world_from_file = DAffine3::from_mat3(turn * axes.units.map_or(1.0, LengthUnit::metres));
    let mut cloud = Cloud { path: path.to_owned(), world_from_file, is_annotated, count: 0 };
    let (mut thinned, mut count) = (Thinned::default(), 0);
    let warnings = cloud.each_point(ctx, &mut |point: CloudPoint| {
        count += 1;
        thinned.add(point.position_m, point.origin_m.map(|origin| origin - point.position_m));
        Ok(())
    })?;
    ctx.warn_each(&warnings);
    cloud.count = count;
    let (offset_m, positions, sides) = thinned.columns();
    let points = SurfacePoints::of_points(&positions, &sides).map_err(thin)?;
    Ok(Read { points, offset_m, shape: Shape::Cloud(cloud) })
}

pub(super) fn has_ending(path: &Path, ending: &str) -> bool {
    path.extension().is_some_and(|found| found.eq_ignore_ascii_case(ending))
}

impl Cloud {
    /// Hands on each point with finite coordinates, in the order of the files. Returns what is doubtful in
    /// them.
    pub(super) fn each_point(&self, ctx: &Context, take: &mut Take<'_>) -> Result<Vec<String>> {
        let mut finite = |point: CloudPoint| {
            if point.position_m.is_finite() {
                take(point)?;
            }
            Ok(())
        };
        if self.is_annotated {
            self.each_annotated(ctx, &mut finite)
        } else {
            self.each_measured(ctx, &mut finite)
        }
    }

    fn each_measured(&self, ctx: &Context, take: &mut Take<'_>) -> Result<Vec<String>> {
        let options = RawOptions { world_from_file: self.world_from_file, ..RawOptions::default() };
        let RawScan::Scans(scans) = RawScan::open(&self.path, &options)? else {
            let why = "depth pictures are fused to a mesh first: `s3d fuse`";
            return Err(Error::unfit(&self.path, why));
        };
        let mut warnings = scans.warnings.clone();
        for (number, scan) in scans.scans().iter().enumerate() {
            let read = scans.read(number, |block| {
                ctx.check()?;
                for (i, position_m) in block.positions_m.iter().copied().enumerate() {
                    let origin_m = block.origins_m.get(i).copied().or(scan.origin_m);
                    take(CloudPoint { position_m, origin_m, color: block.colors.get(i).copied() })?;
                }
                Ok::<(), Error>(())
            })?;
            warnings.extend(read.warnings);
        }
        Ok(warnings)
    }

    fn each_annotated(&self, ctx: &Context, take: &mut Take<'_>) -> Result<Vec<String>> {
        let area = Annotations::open(slice::from_ref(&self.path), &AnnotationOptions::default())?;
        let mut reader = InstanceReader::new(BLOCK);
        for instance in area.rooms.iter().flat_map(|room| &room.instances) {
            reader.read(instance, None, |block: &PointCloud, _| {
                ctx.check()?;
                for (i, p) in block.positions.iter().enumerate() {
                    let position_m = self.world_from_file.transform_point3(p.as_dvec3());
                    take(CloudPoint { position_m, origin_m: None, color: block.colors.get(i).copied() })?;
                }
                Ok::<(), Error>(())
            })?;
        }
        Ok(area.warnings)
    }
}

/// Points of a cloud of any size, thinned by cubes.
#[derive(Default)]
struct Thinned {
    /// A whole number of metres near the first point.
    offset_m: Option<DVec3>,
    /// The edge of the cubes is this power of two times [`CELL_M`].
    doublings: i32,
    cells: HashMap<[i32; 3], Cell>,
    has_unseen: bool,
}

/// The sums of the points of a cube.
#[derive(Clone, Copy, Default)]
struct Cell {
    position: DVec3,
    /// Directions towards the scanner.
    side: Vec3,
    count: f64,
}

impl Thinned {
    /// Adds a point in the world, with the way to the scanner if that is known.
    fn add(&mut self, p: DVec3, side: Option<DVec3>) {
        let offset = *self.offset_m.get_or_insert((p / 100.0).round() * 100.0);
        self.has_unseen |= side.is_none();
        let p = p - offset;
        let point = Cell {
            position: p,
            side: side.map_or(Vec3::ZERO, |side| side.normalize_or_zero().as_vec3()),
            count: 1.0,
        };
        self.cells.entry(self.cube(p)).or_default().join(&point);
        if self.cells.len() > MOST_CELLS {
            self.widen();
        }
    }

    fn cube(&self, p: DVec3) -> [i32; 3] {
        (p / (CELL_M * f64::from(1u32 << self.doublings.min(31))))
            .floor()
            .as_ivec3()
            .to_array()
    }

    /// Joins cubes by eight.
    fn widen(&mut self) {
        self.doublings += 1;
        let mut old: Vec<([i32; 3], Cell)> = self.cells.drain().collect();
        // The order of sums must not depend on the table.
        old.sort_unstable_by_key(|(cube, _)| *cube);
        for (cube, cell) in old {
            self.cells.entry(cube.map(|i| i.div_euclid(2))).or_default().join(&cell);
        }
    }

    /// The offset that was subtracted, the positions, and the ways to the scanner if all are known.
    fn columns(self) -> (DVec3, Vec<Vec3>, Vec<Vec3>) {
        let mut cells: Vec<([i32; 3], Cell)> = self.cells.into_iter().collect();
        cells.sort_unstable_by_key(|(cube, _)| *cube);
        let positions = cells
            .iter()
            .map(|(_, cell)| (cell.position / cell.count).as_vec3())
            .collect();
        let sides = if self.has_unseen {
            Vec::new()
        } else {
            cells.iter().map(|(_, cell)| cell.side.normalize_or(Vec3::Z)).collect()
        };
        (self.offset_m.unwrap_or_default(), positions, sides)
    }
}

impl Cell {
    fn join(&mut self, other: &Self) {
        self.position += other.position;
        self.side += other.side;
        self.count += other.count;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn clouds_are_thinned_far_from_the_origin() {
        let mut thinned = Thinned::default();
        let at = DVec3::new(500_000.25, 5_400_000.5, 300.0);
        for i in 0..1000 {
            thinned.add(at + DVec3::new(0.001 * f64::from(i), 0.0, 0.0), None);
        }
        thinned.widen();
        let (offset, positions, sides) = thinned.columns();
        assert_eq!(offset, DVec3::new(500_000.0, 5_400_000.0, 300.0));
        assert!((24..=27).contains(&positions.len()) && sides.is_empty(), "{}", positions.len());
        assert!(positions.iter().all(|p| (p.y - 0.5).abs() < 1e-6 && p.z == 0.0));
    }
}
