//! Guesses the unit of a mesh's file, where nobody says it.

use crate::useful::Headroom;
use glam::DVec3;
use s3d_geom::TriMesh;
use s3d_io::mesh::LengthUnit;
use s3d_render::Scene;

/// The usual heights of rooms, metres.
const HEIGHTS_M: std::ops::Range<f64> = 1.8..6.0;

/// A guess by the height of rooms: how far ceilings are above floors.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct UnitGuess {
    /// The height of rooms in the file's unit; `None` without ceilings.
    height: Option<f64>,
}

impl UnitGuess {
    /// Guesses from a mesh in the unit of its file; `up` is what points up.
    pub(super) fn of(mesh: &TriMesh, up: DVec3) -> Self {
        Self { height: Headroom::of(&Scene::new(mesh), up).of_rooms() }
    }

    /// The unit that gives rooms a usual height, if that is clear; otherwise the metre. Feet are never clear:
    /// a height of 8 may be 8 feet, or a hall of 8 metres.
    pub(super) fn unit(self) -> LengthUnit {
        let Some(height) = self.height else { return LengthUnit::default() };
        // If a height fits both centimetres and inches, the lower room is the likelier.
        [LengthUnit::Millimetre, LengthUnit::Centimetre, LengthUnit::Inch]
            .into_iter()
            .find(|unit| HEIGHTS_M.contains(&(height * unit.metres())))
            .unwrap_or_default()
    }

    /// What was guessed and why, if it is not the metre.
    pub(super) fn sentence(self) -> Option<String> {
        let unit = self.unit();
        let height = self.height?;
        (unit != LengthUnit::Metre).then(|| {
            format!(
                "its unit is taken for the {unit}: ceilings are {height:.0} above floors, which makes rooms \
                 {:.2} m high (units says it)",
                height * unit.metres()
            )
        })
    }

    /// A sentence if the unit could as well be the foot.
    pub(super) fn doubt(self) -> Option<String> {
        let height = self.height.filter(|_| self.unit() == LengthUnit::Metre)?;
        let feet = HEIGHTS_M.contains(&(height * LengthUnit::Foot.metres())) && !HEIGHTS_M.contains(&height);
        feet.then(|| {
            format!("ceilings are {height:.1} m above floors: if the file is in feet, say units = ft")
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use s3d_synth::Building;

    fn scaled(factor: f32) -> TriMesh {
        let mut parts = Building::demo().build().unwrap().mesh.into_parts();
        parts.positions.iter_mut().for_each(|p| *p *= factor);
        TriMesh::new(parts).unwrap()
    }

    #[test]
    fn the_height_of_rooms_tells_the_unit() {
        for (factor, unit) in [
            (1.0, LengthUnit::Metre),
            (100.0, LengthUnit::Centimetre),
            (1000.0, LengthUnit::Millimetre),
            (1.0 / 0.0254, LengthUnit::Inch),
        ] {
            let guess = UnitGuess::of(&scaled(factor), DVec3::Z);
            assert_eq!(guess.unit(), unit, "{guess:?}");
            assert_eq!(guess.sentence().is_some(), unit != LengthUnit::Metre);
            assert!(guess.doubt().is_none());
        }
        let feet = UnitGuess::of(&scaled(1.0 / 0.3048), DVec3::Z);
        assert_eq!((feet.unit(), feet.sentence()), (LengthUnit::Metre, None));
        assert!(feet.doubt().unwrap().contains("units = ft"));
        // A building on its side has neither floors nor ceilings, only tops and undersides of things.
        let side = UnitGuess::of(&scaled(1.0), DVec3::Y);
        assert_eq!(side.unit(), LengthUnit::Metre);
        let open = TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
        assert_eq!(UnitGuess::of(&open, DVec3::Z), UnitGuess { height: None });
    }
}
