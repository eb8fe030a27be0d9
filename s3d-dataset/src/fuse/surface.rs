//! The surface of a raw scan: gathered in a grid, simplified, and closed where that was asked for.

use super::gather::{Keeping, gather};
use super::images::Images;
use super::{FuseOptions, Fused, level};
use crate::context::Context;
use crate::error::{Error, Result};
use glam::{DMat3, DVec3, Vec3};
use rayon::prelude::*;
use s3d_fusion::{CloseOptions, DecimateOptions, FusedMesh, MeshColumns, close_holes, decimate_while};
use std::path::Path;

/// A mesh of less surface than this is no room, square metres.
const LEAST_ROOM_M2: f64 = 4.0;

/// Colours of a mesh are those of its vertices: posters and books need enough of them. In steps of 1/255.
const MOST_COLOR_ERROR: f32 = 10.0;

/// A mesh that was made of a raw scan.
pub(super) struct Made {
    pub(super) positions: Vec<Vec3>,
    pub(super) faces: Vec<[u32; 3]>,
    pub(super) colors: Vec<[u8; 3]>,
    /// 1 for each face that closes a hole; empty if nothing was to be closed.
    pub(super) closed: Vec<i32>,
    /// From the world of the scan to that of the mesh, if the scan was not upright.
    pub(super) turn: Option<DMat3>,
    about: Fused,
}

impl Made {
    /// Says what was made.
    pub(super) fn told(self, ctx: &Context, output: &Path) -> Fused {
        let Fused { images, fused_faces, faces, max_error_m, .. } = self.about;
        ctx.info(format_args!(
            "{}: {faces} faces of {fused_faces}, which lie within {:.1} mm of them, from {images} {}",
            output.display(),
            max_error_m * 1e3,
            if images == 1 { "image" } else { "images" },
        ));
        self.about
    }
}

/// Makes the mesh of images.
pub(super) fn surface(
    images: &Images,
    options: &FuseOptions,
    keeping: &Keeping<'_>,
    ctx: &Context,
) -> Result<Made> {
    let unfit = |e: &dyn std::fmt::Display| Error::unfit(images.path(), e.to_string());
    let fused = gather(images, options, keeping, ctx)?;
    let fused_faces = fused.faces.len();
    let about = Fused { images: images.len(), fused_faces, faces: fused_faces, max_error_m: 0.0, closed: 0 };
    let FusedMesh { positions, faces, colors, .. } = fused;
    let mut made = Made { positions, faces, colors, closed: Vec::new(), turn: None, about };

    if options.max_error_m > 0.0 {
        let task = ctx.progress("simplifying", "faces", fused_faces as u64);
        let columns = MeshColumns { positions: &made.positions, faces: &made.faces, colors: &made.colors };
        let limits = DecimateOptions {
            max_error_m: options.max_error_m as f32,
            target_faces: options.faces.map(|faces| faces as usize),
            max_color_error: MOST_COLOR_ERROR,
            ..DecimateOptions::default()
        };
        let mut told = 0;
        let small = decimate_while(&columns, &limits, &mut |share| {
            let done = (share * fused_faces as f64) as u64;
            task.add(done - told);
            told = done;
            ctx.check().is_ok()
        });
        ctx.check()?;
        let small = small.map_err(|e| unfit(&e))?;
        task.add(fused_faces as u64 - told);
        (made.positions, made.faces, made.colors) = (small.positions, small.faces, small.colors);
        made.about.max_error_m = small.max_error_m;
        if small.max_error_m > options.max_error_m {
            ctx.warn(format_args!(
                "{}: the simplified surface lies up to {:.1} mm from the fused one, and {:.1} mm are allowed",
                images.path().display(),
                small.max_error_m * 1e3,
                options.max_error_m * 1e3
            ));
        }
    }

    if let Some(close_m) = options.close_m {
        ctx.check()?;
        let columns = MeshColumns { positions: &made.positions, faces: &made.faces, colors: &made.colors };
        let limits = CloseOptions { max_m: close_m as f32, ..CloseOptions::default() };
        let closed = close_holes(&columns, &limits).map_err(|e| unfit(&e))?;
        ctx.info(format_args!(
            "{} holes of {:.2} m² were closed along their plane",
            closed.closed, closed.area_m2
        ));
        made.closed = closed
            .is_closing
            .iter()
            .map(|is_closing| i32::from(*is_closing))
            .collect();
        made.faces = closed.faces;
        made.about.closed = closed.closed;
    }
    made.about.faces = made.faces.len();

    made.turn = level::turn(images, &made);
    if let Some(turn) = made.turn {
        let up = (turn.transpose() * DVec3::Z)
            .to_array()
            .map(|v| (v * 1e3).round() / 1e3);
        ctx.info(format_args!("up is {up:?} in the world of the scan: the mesh is turned to Z-up"));
        made.positions
            .iter_mut()
            .for_each(|p| *p = (turn * p.as_dvec3()).as_vec3());
    }

    let area_m2 = area(&made);
    if area_m2 < LEAST_ROOM_M2 {
        ctx.warn(format_args!(
            "{}: the mesh has {area_m2:.2} m²: a scan of an object, or coordinates that are no metres?",
            images.path().display()
        ));
    }
    Ok(made)
}

/// The area of a mesh, square metres.
fn area(made: &Made) -> f64 {
    let corner = |vertex: u32| made.positions[vertex as usize].as_dvec3();
    let twice = |face: &[u32; 3]| {
        let [a, b, c] = face.map(corner);
        (b - a).cross(c - a).length()
    };
    let parts: Vec<f64> = made
        .faces
        .par_chunks(1 << 16)
        .map(|some| some.iter().map(twice).sum())
        .collect();
    parts.iter().sum::<f64>() / 2.0
}
