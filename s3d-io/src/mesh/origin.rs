//! Moves the origin of a mesh.
//!
//! Positions are `f32`. At 5,400 km, the size of the northings of surveys, they step by half a metre. So
//! files are read in `f64`, and an offset is subtracted before positions are rounded.

use crate::bounds::Bounds;
use crate::mesh::file::{LengthUnit, UpAxis};
use s3d_geom::glam::{DVec3, Vec3};

/// The distance from the origin, in metres, beyond which `f32` steps by more than a tenth of a millimetre.
const FAR_M: f64 = 1024.0;

/// Any offset that is found is a multiple of this, in metres.
const ROUND_M: f64 = 100.0;

/// The point that becomes the origin of a mesh when it is read.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum MeshOrigin {
    /// The origin of the file.
    #[default]
    OfFile,
    /// The origin of the file, unless the mesh reaches farther than 1,024 m from it. Then the point nearest
    /// to the centre of its box whose coordinates are multiples of 100 m, if this at least halves the
    /// distance.
    Near,
    /// This point, in metres, in the world's axes (Z-up).
    At(DVec3),
}

impl MeshOrigin {
    /// Returns the origin of a mesh that is joined to others, from which `offset_m` was subtracted.
    pub(crate) fn behind(offset_m: DVec3) -> Self {
        if offset_m == DVec3::ZERO {
            Self::OfFile
        } else {
            Self::At(offset_m)
        }
    }

    /// Returns whether positions of up to `largest_m` metres must be read in `f64`.
    pub(crate) fn needs_exact(self, largest_m: f64) -> bool {
        match self {
            Self::OfFile => false,
            Self::Near => largest_m > FAR_M,
            Self::At(offset_m) => offset_m != DVec3::ZERO,
        }
    }

    /// Returns the offset to subtract from the positions of a mesh with these corners, in the world's axes.
    pub(crate) fn offset_m(self, corners: impl IntoIterator<Item = DVec3>) -> DVec3 {
        match self {
            Self::OfFile => DVec3::ZERO,
            Self::At(offset_m) => offset_m,
            Self::Near => found(Bounds::of(corners)),
        }
    }
}

/// How the coordinates of a file become metres near the origin. The axes are another matter: [`UpAxis`].
#[derive(Clone, Copy, Debug)]
pub(crate) struct FileFrame {
    origin: MeshOrigin,
    unit: LengthUnit,
}

impl FileFrame {
    pub(crate) fn new(origin: MeshOrigin, unit: LengthUnit) -> Self {
        Self { origin, unit }
    }

    /// Returns whether positions of up to `largest`, in the file's unit, must be read in `f64`.
    pub(crate) fn needs_exact(self, largest: f64) -> bool {
        self.origin.needs_exact(largest * self.unit.metres())
    }

    /// Returns the offset to subtract, in metres in the world's axes. The corners of the faces are in the
    /// file's unit.
    pub(crate) fn offset_m(self, corners: impl IntoIterator<Item = DVec3>) -> DVec3 {
        self.origin
            .offset_m(corners.into_iter().map(|corner| corner * self.unit.metres()))
    }

    /// Converts an offset to the file's unit.
    pub(crate) fn in_units(self, offset_m: DVec3) -> DVec3 {
        offset_m / self.unit.metres()
    }

    /// Converts positions from the file's unit to metres.
    pub(crate) fn scale(self, positions: &mut [Vec3]) {
        if self.unit != LengthUnit::Metre {
            for position in positions {
                *position = (position.as_dvec3() * self.unit.metres()).as_vec3();
            }
        }
    }
}

/// Returns the multiple of 100 m that is nearest to the centre, if the box is far and this brings it near.
fn found(bounds: Bounds) -> DVec3 {
    if !bounds.is_some() || bounds.farthest_m() <= FAR_M {
        return DVec3::ZERO;
    }
    // Adding 0 turns −0 into 0.
    let offset = (bounds.center() / ROUND_M).round() * ROUND_M + DVec3::ZERO;
    if 2.0 * bounds.minus(offset).farthest_m() <= bounds.farthest_m() {
        offset
    } else {
        DVec3::ZERO
    }
}

/// Returns the largest absolute coordinate that is a number.
pub(crate) fn largest(positions: &[Vec3]) -> f64 {
    f64::from(
        positions
            .iter()
            .flat_map(|p| p.to_array())
            .fold(0.0f32, |largest, v| largest.max(v.abs())),
    )
}

impl UpAxis {
    /// Turns like [`UpAxis::world_from_file`], in `f64`.
    pub(crate) fn exact_world_from_file(self, v: DVec3) -> DVec3 {
        match self {
            Self::Y => DVec3::new(v.x, -v.z, v.y),
            Self::Z => v,
        }
    }

    /// Turns a vector of the world back into the file's axes, in `f64`.
    pub(crate) fn exact_file_from_world(self, v: DVec3) -> DVec3 {
        match self {
            Self::Y => DVec3::new(v.x, v.z, -v.y),
            Self::Z => v,
        }
    }
}

#[cfg(all(test, feature = "obj", feature = "gltf", feature = "ply"))]
mod tests {
    use super::*;
    use crate::mesh::file::{MeshFile, MeshOptions};
    use crate::mesh::{read_mesh_from, read_meshes_with};
    use s3d_geom::glam::dvec3;
    use std::path::{Path, PathBuf};

    #[test]
    fn only_what_is_far_and_small_is_moved() {
        let offset =
            |min: [f64; 3], max: [f64; 3]| MeshOrigin::Near.offset_m([min.into(), max.into()]).to_array();
        assert_eq!(offset([-3.0, 0.0, 0.0], [1024.0, 9.0, 3.0]), [0.0; 3]);
        assert_eq!(offset([1030.0, -9.0, 4.0], [1060.0, 9.0, 7.0]), [1000.0, 0.0, 0.0]);
        assert_eq!(offset([5e5, 5.4e6, 300.0], [500_012.0, 5_400_009.0, 303.0]), [5e5, 5.4e6, 300.0]);
        assert_eq!(offset([-7160.0, 0.0, 0.0], [-7150.0, 9.0, 3.0]), [-7200.0, 0.0, 0.0]);
        // A district around the origin.
        assert_eq!(offset([-3000.0, -2000.0, 0.0], [3500.0, 2500.0, 90.0]), [0.0; 3]);
        assert_eq!(MeshOrigin::Near.offset_m([]), DVec3::ZERO);
        assert_eq!(MeshOrigin::At(DVec3::X).offset_m([]), DVec3::X);
    }

    const UTM: DVec3 = dvec3(500_000.0, 5_400_000.0, 300.0);

    /// Makes a flight of steps, each a millimetre wide, at some place, Z-up. The first vertex is in no face.
    fn steps(at: DVec3) -> Vec<DVec3> {
        let steps = (0..40)
            .map(|i| at + dvec3(f64::from(i / 2) / 1024.0, f64::from(i % 2), f64::from(i / 4) / 512.0));
        std::iter::once(DVec3::ZERO).chain(steps).collect()
    }

    fn faces() -> impl Iterator<Item = [usize; 3]> {
        (1..39).map(|i| [i, i + 1, i + 2])
    }

    fn obj(at: DVec3, up: UpAxis) -> Vec<u8> {
        let lines = steps(at).into_iter().map(|p| up.exact_file_from_world(p));
        let mut text: String = lines.map(|p| format!("v {} {} {}\n", p.x, p.y, p.z)).collect();
        text.extend(faces().map(|[a, b, c]| format!("f {} {} {}\n", a + 1, b + 1, c + 1)));
        text.into_bytes()
    }

    fn ply(at: DVec3) -> Vec<u8> {
        let mut text =
            String::from("ply\nformat ascii 1.0\nelement face 38\nproperty list uchar int vertex_indices\n");
        text += "element vertex 41\nproperty double x\nproperty double y\nproperty double z\nend_header\n";
        text.extend(faces().map(|[a, b, c]| format!("3 {a} {b} {c}\n")));
        text.extend(steps(at).into_iter().map(|p| format!("{} {} {}\n", p.x, p.y, p.z)));
        text.into_bytes()
    }

    /// Two thirds of `at` are in the matrix of the parent, the rest in the translation of the node.
    fn gltf(at: DVec3) -> Vec<u8> {
        use base64::Engine;
        let mut data: Vec<u8> = steps(DVec3::ZERO)
            .iter()
            .flat_map(|p| p.as_vec3().to_array())
            .flat_map(f32::to_le_bytes)
            .collect();

        let vertices = data.len();
        data.extend(faces().flatten().flat_map(|i| (i as u16).to_le_bytes()));
        // No float holds the digits of these places.
        let a = (at * 0.625).floor() + 0.070_312_5;
        let b = at - a;

        format!(
            r#"{{"asset": {{"version": "2.0"}}, "nodes": [
            {{"children": [1], "matrix": [1,0,0,0, 0,1,0,0, 0,0,1,0, {:?},{:?},{:?},1]}},
            {{"mesh": 0, "translation": [{:?}, {:?}, {:?}]}}], "scenes": [{{"nodes": [0]}}],
            "meshes": [{{"primitives": [{{"attributes": {{"POSITION": 0}}, "indices": 1}}]}}],
            "accessors": [{{"bufferView": 0, "componentType": 5126, "type": "VEC3", "count": 41}},
            {{"bufferView": 1, "componentType": 5123, "type": "SCALAR", "count": 114}}],
            "bufferViews": [{{"buffer": 0, "byteLength": {vertices}}},
            {{"buffer": 0, "byteOffset": {vertices}, "byteLength": {}}}],
            "buffers": [{{"byteLength": {}, "uri": "data:;base64,{}"}}]}}"#,
            a.x,
            a.y,
            a.z,
            b.x,
            b.y,
            b.z,
            data.len() - vertices,
            data.len(),
            base64::engine::general_purpose::STANDARD.encode(&data)
        )
        .into_bytes()
    }

    fn read(name: &str, bytes: &[u8], up: UpAxis, origin: MeshOrigin) -> crate::Result<MeshFile> {
        read_mesh_from(bytes, Path::new(name), up, &MeshOptions { origin, ..MeshOptions::default() })
    }

    #[test]
    fn a_mesh_in_utm_is_the_same_as_at_home_in_every_format() {
        for (name, up, home, far) in [
            ("a.obj", UpAxis::Z, obj(DVec3::ZERO, UpAxis::Z), obj(UTM, UpAxis::Z)),
            ("a.obj", UpAxis::Y, obj(DVec3::ZERO, UpAxis::Y), obj(UTM, UpAxis::Y)),
            ("a.ply", UpAxis::Z, ply(DVec3::ZERO), ply(UTM)),
            ("a.gltf", UpAxis::Z, gltf(DVec3::ZERO), gltf(UTM)),
        ] {
            let expected = read(name, &home, up, MeshOrigin::OfFile).unwrap();
            assert_eq!((expected.offset_m, expected.mesh.faces().len()), (DVec3::ZERO, 38), "{name}");
            for origin in [MeshOrigin::Near, MeshOrigin::At(UTM)] {
                let found = read(name, &far, up, origin).unwrap();
                assert_eq!(found.offset_m, UTM, "{name}");
                assert_eq!(found.mesh.faces(), expected.mesh.faces(), "{name}");
                // All vertices but the first, which lies at the origin of the file.
                assert_eq!(found.mesh.positions()[1..], expected.mesh.positions()[1..], "{name} {up:?}");
            }
            let near = read(name, &home, up, MeshOrigin::Near).unwrap();
            assert_eq!((near.offset_m, near.mesh.positions()), (DVec3::ZERO, expected.mesh.positions()));
            // At the coordinates of the file, the faces collapse.
            let lost = read(name, &far, up, MeshOrigin::OfFile).map_or(0, |file| file.mesh.faces().len());
            assert!(lost < 38, "{name}: {lost}");
        }
    }

    #[test]
    fn meshes_that_are_joined_have_the_offset_of_the_first() {
        let dir = tempfile::tempdir().unwrap();
        let paths: Vec<PathBuf> =
            [("a.obj", obj(UTM, UpAxis::Z)), ("b.ply", ply(UTM + dvec3(0.0, 0.0, 160.0)))]
                .map(|(name, bytes)| {
                    std::fs::write(dir.path().join(name), bytes).unwrap();
                    dir.path().join(name)
                })
                .to_vec();
        let options = MeshOptions { origin: MeshOrigin::Near, ..MeshOptions::default() };
        let file = read_meshes_with(&paths, UpAxis::Z, &options).unwrap();
        assert_eq!(file.offset_m, UTM);
        let steps = steps(DVec3::ZERO);
        for (a, b) in [(0, DVec3::ZERO), (41, dvec3(0.0, 0.0, 160.0))] {
            assert_eq!(file.mesh.positions()[a + 40].as_dvec3(), steps[40] + b);
        }
    }

    #[test]
    fn vertices_with_weights_colours_and_comments_keep_their_digits() {
        let text = "v 1000000.5 10800001 600 2 # half of it\nv 500001.25 5400000.5 300.125 1 0 0\n\
                    v 500000 \\\n5400001 300.5 # x\nf 1 2 3\n";
        let file = read("a.obj", text.as_bytes(), UpAxis::Z, MeshOrigin::Near).unwrap();
        let positions: Vec<[f32; 3]> = file.mesh.positions().iter().map(|p| p.to_array()).collect();
        assert_eq!(positions, [[0.25, 0.5, 0.0], [1.25, 0.5, 0.125], [0.0, 1.0, 0.5]]);
    }

    fn read_named(name: &str, bytes: &[u8], units: Option<LengthUnit>, origin: MeshOrigin) -> MeshFile {
        let options = MeshOptions { origin, units, ..MeshOptions::default() };
        read_mesh_from(bytes, Path::new(name), UpAxis::Z, &options).unwrap()
    }

    #[test]
    fn units_are_taken_to_metres_near_the_origin_and_far() {
        let inches = LengthUnit::Inch;
        for (name, file) in
            [("a.obj", (|at| obj(at, UpAxis::Z)) as fn(DVec3) -> Vec<u8>), ("a.ply", ply), ("a.gltf", gltf)]
        {
            let near = read_named(name, &file(DVec3::ZERO), None, MeshOrigin::Near);
            let scaled = read_named(name, &file(DVec3::ZERO), Some(inches), MeshOrigin::Near);
            for (a, b) in near.mesh.positions().iter().zip(scaled.mesh.positions()) {
                assert_eq!((a.as_dvec3() * 0.0254).as_vec3(), *b, "{name}");
            }
            assert_eq!((scaled.offset_m, scaled.mesh.faces().len()), (DVec3::ZERO, 38), "{name}");
            // The mesh is 12.7 km away, in steps of a millionth of an inch, and as exact as near the origin.
            let far = read_named(name, &file(UTM), Some(inches), MeshOrigin::Near);
            assert_eq!(far.offset_m, dvec3(12_700.0, 137_200.0, 0.0), "{name}");
            let at = UTM * 0.0254 - far.offset_m;
            for (a, b) in near.mesh.positions().iter().zip(far.mesh.positions()).skip(1) {
                let expected = a.as_dvec3() * 0.0254 + at;
                assert!(b.as_dvec3().distance(expected) < 1e-5, "{name}: {b} for {expected}");
            }
        }
    }

    fn depth_of(file: &MeshFile) -> f32 {
        file.mesh.aabb().size().y
    }

    fn read_obj(bytes: &[u8], units: Option<LengthUnit>) -> MeshFile {
        let options = MeshOptions { units, ..MeshOptions::default() };
        read_mesh_from(bytes, Path::new("a.obj"), UpAxis::Z, &options).unwrap()
    }

    fn obj_with(head: &str) -> Vec<u8> {
        [head.as_bytes(), &obj(DVec3::ZERO, UpAxis::Z)].concat()
    }

    #[test]
    fn a_comment_in_the_head_of_an_obj_tells_the_unit() {
        let said = read_obj(&obj_with("# made by hand\n\n# File units = inches\n"), None);
        assert_eq!((said.unit_said, depth_of(&said)), (Some(LengthUnit::Inch), 0.0254));
        assert!(said.warnings.iter().any(|w| w.contains("its unit is in:")), "{:?}", said.warnings);
        let other = read_obj(&obj_with("# File units = inches\n"), Some(LengthUnit::Metre));
        assert_eq!((depth_of(&other), other.warnings.len()), (1.0, 0));
        for head in ["# File units = meters\n", "# File units: parsecs\n", "v 0 0 0\n# file units = mm\n", ""]
        {
            let file = read_obj(&obj_with(head), None);
            assert_eq!(depth_of(&file), 1.0, "{head}");
            assert!(!file.warnings.iter().any(|w| w.contains("unit")), "{:?}", file.warnings);
        }
    }
}
