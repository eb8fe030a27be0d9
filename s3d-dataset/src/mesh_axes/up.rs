//! Guesses which axis of a mesh's file points up, where nobody says it.

use glam::DVec3;
use s3d_geom::TriMesh;
use s3d_io::mesh::UpAxis;

/// The cosine of 18°: a face that is tilted less is level.
const LEVEL: f32 = 0.95;

/// Axes whose level surfaces differ by less than this factor cannot be told apart.
const CLEAR: f64 = 1.2;

/// A guess by floors and ceilings: in rooms deeper than high, and with tables, seats and shelves in them,
/// more of the surface faces up and down than along any other axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct UpGuess {
    /// The share of the surface that is level if +Y points up, and if +Z does.
    level: [f64; 2],
}

impl UpGuess {
    /// Guesses from a mesh that was read as if `read_as` pointed up.
    pub(super) fn of(mesh: &TriMesh, read_as: UpAxis) -> Self {
        let level = [DVec3::Y, DVec3::Z].map(|axis| {
            let up = (read_as.rotation() * axis).as_vec3();
            let faces = (0..mesh.faces().len() as u32).filter(|f| mesh.normal(*f).dot(up).abs() > LEVEL);
            // A sum of nothing would be -0.
            faces.fold(0.0, |sum, f| sum + mesh.area(f)) / mesh.total_area()
        });
        Self { level }
    }

    pub(super) fn up(self) -> UpAxis {
        if self.level[0] >= self.level[1] {
            UpAxis::Y
        } else {
            UpAxis::Z
        }
    }

    /// What was guessed and why.
    pub(super) fn sentence(self) -> String {
        let [y, z] = self.level.map(|share| 100.0 * share);
        format!(
            "+{} is taken for up: {y:.0} % of the surface is level with +Y, {z:.0} % with +Z (up = y or up = \
             z says it)",
            self.up().name().to_uppercase()
        )
    }

    fn is_clear(self) -> bool {
        let [y, z] = self.level;
        y.max(z) >= CLEAR * y.min(z)
    }

    /// A sentence if the axis that is said to point up clearly does not.
    pub(super) fn contradiction(self, said: UpAxis) -> Option<String> {
        let [y, z] = self.level.map(|share| 100.0 * share);
        (self.is_clear() && self.up() != said).then(|| {
            format!(
                "+{} is to point up, but {y:.0} % of the surface is level with +Y, and {z:.0} % with +Z: is \
                 it on its side? (up = {} turns it)",
                said.name().to_uppercase(),
                self.up().name()
            )
        })
    }

    /// A sentence if the other axis is nearly as likely.
    pub(super) fn doubt(self) -> Option<String> {
        (!self.is_clear()).then(|| {
            format!(
                "which axis points up is hardly to be seen: look at the first image, or say it (up = {})",
                { if self.up() == UpAxis::Y { "z" } else { "y" } }
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;
    use s3d_geom::{MeshParts, TriMesh};
    use s3d_synth::Building;

    fn turned(mesh: &TriMesh) -> TriMesh {
        let mut parts = mesh.parts().clone();
        parts.positions.iter_mut().for_each(|p| *p = Vec3::new(p.x, p.z, -p.y));
        parts.normals.iter_mut().for_each(|p| *p = Vec3::new(p.x, p.z, -p.y));
        TriMesh::new(parts).unwrap()
    }

    #[test]
    fn floors_and_ceilings_tell_what_is_up() {
        let mesh = Building::demo().build().unwrap().mesh;
        let z = UpGuess::of(&mesh, UpAxis::Z);
        let y = UpGuess::of(&turned(&mesh), UpAxis::Z);
        assert_eq!(UpGuess::of(&mesh, UpAxis::Y).up(), UpAxis::Y);
        assert!(
            z.contradiction(UpAxis::Z).is_none() && z.contradiction(UpAxis::Y).unwrap().contains("+Y is")
        );
        assert_eq!((z.up(), y.up()), (UpAxis::Z, UpAxis::Y));
        assert!(z.doubt().is_none() && z.sentence().starts_with("+Z is taken for up: "), "{}", z.sentence());
        let positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        let parts = MeshParts { positions, faces: vec![[0, 1, 2]], ..MeshParts::default() };
        let sentence = UpGuess::of(&TriMesh::new(parts).unwrap(), UpAxis::Z).sentence();
        assert!(sentence.contains(": 0 % of the surface is level with +Y"), "{sentence}");
        let even = UpGuess { level: [0.3, 0.31] };
        assert!(even.contradiction(UpAxis::Y).is_none());
        assert!(even.doubt().unwrap().contains("up = y"));
    }
}
