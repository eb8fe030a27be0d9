//! Which axis of a mesh's file points up, and its unit: what the caller says, or what the surface tells.

mod unit;
mod up;

use crate::context::Context;
use crate::error::Result;
use glam::DVec3;
use s3d_io::mesh::{LengthUnit, MeshFile, MeshFormat, MeshOptions, MeshOrigin, UpAxis, read_mesh_with};
use std::path::Path;
use unit::UnitGuess;
use up::UpGuess;

/// What the caller knows of a mesh's file.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct MeshAxes {
    /// The axis that points up. `None`: +Y in glTF, as it defines, and guessed in other formats: floors and
    /// ceilings are the most of a room that is level.
    pub up: Option<UpAxis>,
    /// The unit of the coordinates. `None`: metres in glTF, as it defines, and in other formats what the
    /// file says, or else guessed by the height of rooms.
    pub units: Option<LengthUnit>,
}

/// Reads a mesh. What is guessed is told, and so is an axis that contradicts what is seen. Warnings of the
/// file are told, too.
///
/// # Errors
/// [`Error::File`](crate::Error::File).
pub fn read_mesh(path: &Path, axes: MeshAxes, origin: MeshOrigin, ctx: &Context) -> Result<MeshFile> {
    let Found { file, notes, warnings, .. } = find(path, axes, origin)?;
    notes
        .iter()
        .for_each(|note| ctx.info(format_args!("{}: {note}", path.display())));
    ctx.warn_each(warnings.iter().map(|warning| format!("{}: {warning}", path.display())));
    ctx.warn_each(&file.warnings);
    Ok(file)
}

/// A mesh with what was said or found of its file.
pub(crate) struct Found {
    pub(crate) file: MeshFile,
    pub(crate) up: UpAxis,
    /// `None`: what the file says, or metres.
    pub(crate) units: Option<LengthUnit>,
    /// What was guessed, and why.
    pub(crate) notes: Vec<String>,
    /// What is in doubt.
    pub(crate) warnings: Vec<String>,
}

/// Whether a format defines axes and unit.
pub(crate) fn has_own_frame(path: &Path) -> bool {
    MeshFormat::of(path).is_some_and(|format| format.defines_frame)
}

/// Reads a mesh, and guesses what is not known of its file.
pub(crate) fn find(path: &Path, axes: MeshAxes, origin: MeshOrigin) -> Result<Found> {
    let read = |up, units| {
        let options = MeshOptions { origin, units, ..MeshOptions::default() };
        read_mesh_with(path, up, &options)
    };
    let is_defined = has_own_frame(path);
    let tried = axes.up.unwrap_or(UpAxis::Y);
    let mut file = read(tried, axes.units)?;
    let (mut notes, mut warnings) = (Vec::new(), Vec::new());

    let guess = UpGuess::of(&file.mesh, tried);
    let up = if axes.up.is_none() && !is_defined {
        notes.push(guess.sentence());
        warnings.extend(guess.doubt());
        guess.up()
    } else {
        warnings.extend(guess.contradiction(tried));
        tried
    };

    let mut units = axes.units;
    if units.is_none() && file.unit_said.is_none() && !is_defined {
        let world_up = tried.rotation() * (up.rotation().transpose() * DVec3::Z);
        let guess = UnitGuess::of(&file.mesh, world_up);
        notes.extend(guess.sentence());
        warnings.extend(guess.doubt());
        units = Some(guess.unit()).filter(|unit| *unit != LengthUnit::Metre);
    }
    if (up, units) != (tried, axes.units) {
        file = read(up, units)?;
    }
    Ok(Found { file, up, units, notes, warnings })
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_io::mesh::{MeshOut, write_ply_mesh};
    use s3d_synth::Building;

    #[test]
    fn what_is_not_said_is_found_and_what_contradicts_is_told() {
        let mesh = Building::demo().build().unwrap().mesh;
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("room.ply");
        // In millimetres, +Y up.
        let positions: Vec<_> = mesh
            .positions()
            .iter()
            .map(|p| 1000.0 * glam::Vec3::new(p.x, p.z, -p.y))
            .collect();
        let out = MeshOut {
            positions: &positions,
            faces: mesh.faces(),
            colors: &vec![[9; 3]; positions.len()],
            columns: &[],
            comments: &[],
        };
        write_ply_mesh(&path, &out).unwrap();

        let found = |axes| find(&path, axes, MeshOrigin::OfFile).unwrap();
        let guessed = found(MeshAxes::default());
        assert_eq!((guessed.up, guessed.units), (UpAxis::Y, Some(LengthUnit::Millimetre)));
        assert_eq!((guessed.notes.len(), guessed.warnings.len()), (2, 0));
        let lengths = |mesh: &s3d_geom::TriMesh| mesh.aabb().max - mesh.aabb().min;
        assert!((lengths(&guessed.file.mesh) - lengths(&mesh)).abs().max_element() < 1e-3);

        let said = found(MeshAxes { up: Some(UpAxis::Y), units: Some(LengthUnit::Millimetre) });
        assert_eq!((said.notes.len(), said.warnings.len()), (0, 0));
        assert_eq!(said.file.mesh.positions(), guessed.file.mesh.positions());

        let wrong = found(MeshAxes { up: Some(UpAxis::Z), units: Some(LengthUnit::Millimetre) });
        assert_eq!(wrong.up, UpAxis::Z);
        assert!(wrong.warnings[0].contains("level with +Y"), "{:?}", wrong.warnings);
    }
}
