use super::statement::TEXTURE_FOLDER;
use super::{TextureOut, write_rgb_obj, write_semantic_obj};
use crate::mesh::obj::mtl::WRAP_COMMENT;
use proptest::prelude::*;
use s3d_geom::glam::{Vec2, Vec3, vec2, vec3};
use s3d_geom::{Material, MeshParts, NO_INDEX, Raster, Texture, TriMesh, Wrap};
use s3d_label::pretty_color;
use std::path::{Path, PathBuf};

/// A face as another reader finds it in an OBJ file: positions, coordinates, normals and colours of its
/// corners, in the world's axes again, and the index of its material.
#[derive(Debug, PartialEq)]
struct Face {
    positions: [Vec3; 3],
    uvs: Option<[Vec2; 3]>,
    normals: Option<[Vec3; 3]>,
    colors: Option<[[u8; 3]; 3]>,
    material: Option<usize>,
}

fn byte(x: f32) -> u8 {
    (x * 255.0).round() as u8
}

fn corners(column: &[u32], f: usize) -> Option<[u32; 3]> {
    (!column.is_empty()).then(|| [column[3 * f], column[3 * f + 1], column[3 * f + 2]])
}

fn place(v: &[f32], i: u32) -> Vec3 {
    let i = 3 * i as usize;
    vec3(v[i], -v[i + 2], v[i + 1])
}

fn read(path: &Path) -> (Vec<Face>, Vec<tobj::Material>) {
    let (models, materials) = tobj::load_obj(path, &tobj::LoadOptions::default()).unwrap();
    let mut faces = Vec::new();
    for m in models.iter().map(|m| &m.mesh) {
        assert!(m.face_arities.is_empty(), "triangles only");
        for f in 0..m.indices.len() / 3 {
            let v = corners(&m.indices, f).unwrap();
            faces.push(Face {
                positions: v.map(|i| place(&m.positions, i)),
                uvs: corners(&m.texcoord_indices, f)
                    .map(|c| c.map(|i| vec2(m.texcoords[2 * i as usize], m.texcoords[2 * i as usize + 1]))),
                normals: corners(&m.normal_indices, f).map(|c| c.map(|i| place(&m.normals, i))),
                colors: (!m.vertex_color.is_empty())
                    .then(|| v.map(|i| [0, 1, 2].map(|k| byte(m.vertex_color[3 * i as usize + k])))),
                material: m.material_id,
            });
        }
    }
    (faces, materials.unwrap())
}

fn square() -> MeshParts {
    MeshParts {
        positions: vec![
            vec3(0.1, -0.0, 1e-7),
            vec3(1.0, 0.3, 1.5),
            vec3(1.0 / 3.0, 12345.678, -2.5),
            Vec3::Y,
        ],
        faces: vec![[0, 1, 2], [0, 2, 3], [3, 1, 0]],
        ..MeshParts::default()
    }
}

fn texture(name: &str, value: u8) -> Texture {
    Texture {
        name: name.into(),
        image: Raster::from_vec(2, 1, vec![[value; 3], [1, 2, 3]]),
        wrap: [Wrap::Repeat; 2],
    }
}

fn material(name: &str, texture: Option<u32>) -> Material {
    Material { name: name.into(), color: [10, 200, 255], texture }
}

fn textured() -> MeshParts {
    MeshParts {
        uvs: vec![vec2(0.1, 0.9), vec2(1.25, -3.0), vec2(0.7, f32::NAN), vec2(0.5, 0.5)],
        face_uvs: vec![[0, 1, 3], [NO_INDEX; 3], [3, 0, 0]],
        normals: vec![Vec3::Z, vec3(0.6, -0.8, 0.0)],
        face_normals: vec![[0, 0, 1], [1, 0, 0], [NO_INDEX; 3]],
        materials: vec![material("wall paint", Some(1)), material("wall_paint", Some(0)), material("", None)],
        face_materials: vec![1, 2, 0],
        textures: vec![texture("some/Scan.JPG", 50), texture("scan.png", 60)],
        ..square()
    }
}

/// Returns the bits, so that 0 and −0 differ.
fn bits(t: [Vec3; 3]) -> [[u32; 3]; 3] {
    t.map(|v| v.to_array().map(f32::to_bits))
}

fn check_faces(mesh: &TriMesh, faces: &[Face]) {
    let p = mesh.parts();
    assert_eq!(faces.len(), mesh.faces().len());
    for (f, face) in faces.iter().enumerate() {
        assert_eq!(bits(face.positions), bits(mesh.triangle(f as u32)), "face {f}");
        // tobj takes the first entry of the file for a face that names none, so only entries of the mesh are
        // compared.
        if let Some(normals) = mesh.corner_normals(f as u32) {
            assert_eq!(face.normals.map(bits), Some(bits(normals)), "face {f}");
        }
        if let Some(corners) = p.face_uvs.get(f).filter(|c| **c != [NO_INDEX; 3]) {
            assert_eq!(face.uvs, Some(corners.map(|i| p.uvs[i as usize])), "face {f}");
        }
        let colors = (!p.colors.is_empty()).then(|| p.faces[f].map(|v| p.colors[v as usize]));
        assert_eq!(face.colors, colors, "face {f}");
    }
}

#[test]
fn a_textured_mesh_comes_back_with_its_textures() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = TriMesh::new(textured()).unwrap();
    let bytes = write_rgb_obj(dir.path(), &mesh, &[]).unwrap();
    let (faces, materials) = read(&dir.path().join("rgb.obj"));
    check_faces(&mesh, &faces);

    let text = std::fs::read_to_string(dir.path().join("rgb.obj")).unwrap();
    let lines: Vec<&str> = text.lines().filter(|l| l.starts_with("f ")).collect();
    assert_eq!(lines, ["f 1/1/1 2/2/1 3/4/2", "f 1//2 3//1 4//1", "f 4/4 2/1 1/1"]);

    let names: Vec<&str> = faces
        .iter()
        .map(|f| materials[f.material.unwrap()].name.as_str())
        .collect();
    assert_eq!(names, ["wall_paint_2", "material", "wall_paint"]);
    let all: Vec<&str> = materials.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(all, ["wall_paint", "wall_paint_2", "material"]);
    let kd = materials[2].diffuse.unwrap().map(|x| (x * 255.0).round() as u8);
    assert_eq!(kd, [10, 200, 255]);

    // Both textures have the name "scan" for a file system that ignores case.
    assert_eq!(materials[1].diffuse_texture.as_deref(), Some("rgb_textures/Scan.png"));
    assert_eq!(materials[0].diffuse_texture.as_deref(), Some("rgb_textures/scan_2.png"));
    for (i, file) in ["Scan.png", "scan_2.png"].iter().enumerate() {
        let image = crate::image::png::read_rgb8(&dir.path().join(TEXTURE_FOLDER).join(file)).unwrap();
        assert_eq!(image, mesh.textures()[i].image);
    }

    let files = ["rgb.obj", "rgb.mtl", "rgb_textures/Scan.png", "rgb_textures/scan_2.png"].map(PathBuf::from);
    let size: u64 = files
        .iter()
        .map(|f| std::fs::metadata(dir.path().join(f)).unwrap().len())
        .sum();
    assert_eq!(bytes, size);
}

#[test]
fn given_image_files_are_handed_on_as_they_are() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = TriMesh::new(textured()).unwrap();
    let given = [
        TextureOut { name: "../room rgb 1.jpg", bytes: b"not even an image" },
        TextureOut { name: "RgRGBb.jpg", bytes: b"second" },
    ];
    write_rgb_obj(dir.path(), &mesh, &given).unwrap();
    let mut names: Vec<_> = std::fs::read_dir(dir.path().join(TEXTURE_FOLDER))
        .unwrap()
        .map(|e| e.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["Rgcolorb.jpg", "_room_color_1.jpg"]);

    let first = std::fs::read(dir.path().join(TEXTURE_FOLDER).join("_room_color_1.jpg")).unwrap();
    assert_eq!(first, b"not even an image");
}

#[test]
fn vertex_colours_and_faces_without_material() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = TriMesh::new(MeshParts {
        colors: vec![[0, 1, 2], [255, 254, 253], [77, 128, 129], [9; 3]],
        ..square()
    })
    .unwrap();
    write_rgb_obj(dir.path(), &mesh, &[]).unwrap();
    let (faces, materials) = read(&dir.path().join("rgb.obj"));
    check_faces(&mesh, &faces);
    assert_eq!(materials[faces[0].material.unwrap()].name, "default");
    assert!(!dir.path().join(TEXTURE_FOLDER).exists());
}

#[test]
fn clamping_is_said_only_where_it_shows() {
    let mut parts = textured();
    for t in &mut parts.textures {
        t.wrap = [Wrap::Clamp; 2];
    }
    let dir = tempfile::tempdir().unwrap();
    write_rgb_obj(dir.path(), &TriMesh::new(parts).unwrap(), &[]).unwrap();
    let mtl = std::fs::read_to_string(dir.path().join("rgb.mtl")).unwrap();
    // Face 0 (material 1, texture 0) reaches beyond the edge, face 2 does not.
    assert!(
        mtl.contains("map_Kd -clamp on rgb_textures/Scan.png\n")
            && mtl.contains("# s3d wrap clamp clamp\nmap_Kd rgb_textures/scan_2.png\n")
    );
}

#[test]
fn our_reader_is_told_how_textures_go_on() {
    for wrap in [[Wrap::Clamp; 2], [Wrap::Mirror, Wrap::Clamp], [Wrap::Repeat; 2]] {
        let mut parts = textured();
        parts.textures.iter_mut().for_each(|t| t.wrap = wrap);
        let dir = tempfile::tempdir().unwrap();
        write_rgb_obj(dir.path(), &TriMesh::new(parts).unwrap(), &[]).unwrap();
        let mesh = crate::mesh::read::read_mesh(&dir.path().join("rgb.obj"), crate::mesh::file::UpAxis::Y)
            .unwrap()
            .mesh;
        assert!(!mesh.textures().is_empty() && mesh.textures().iter().all(|t| t.wrap == wrap), "{wrap:?}");
        let mtl = std::fs::read_to_string(dir.path().join("rgb.mtl")).unwrap();
        assert_eq!(mtl.contains(WRAP_COMMENT), wrap != [Wrap::Repeat; 2]);
    }
}

#[test]
fn labels_are_materials_in_the_order_of_faces() {
    let dir = tempfile::tempdir().unwrap();
    let mesh = TriMesh::new(square()).unwrap();
    let names =
        ["<UNK>_0_<UNK>_0_0", "chair_3_office_5_1", "beam_1_office_5_1", "wall_2_WC_1_1"].map(String::from);
    write_semantic_obj(dir.path(), &mesh, &[3, 0, 1], &names).unwrap();
    let (faces, materials) = read(&dir.path().join("semantic.obj"));
    check_faces(&mesh, &faces);
    let of_face: Vec<&str> = faces
        .iter()
        .map(|f| materials[f.material.unwrap()].name.as_str())
        .collect();
    assert_eq!(of_face, [&names[3], &names[0], &names[1]]);

    assert_eq!(materials.len(), 3);
    for material in &materials {
        let label = names.iter().position(|n| *n == material.name).unwrap() as u32;
        let color = material.diffuse.unwrap().map(|x| (x * 255.0).round() as u8);
        assert_eq!(color, pretty_color(label));
    }
    let text = std::fs::read_to_string(dir.path().join("semantic.obj")).unwrap();
    assert!(text.contains("\nv 0.1 0.0000001 0\n"), "{text}");
}

#[test]
#[should_panic(expected = "label 4 of 1")]
fn a_label_without_a_name_is_a_callers_mistake() {
    let mesh = TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]]).unwrap();
    let _ = write_semantic_obj(Path::new("."), &mesh, &[4], &["a".into()]);
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(64))]
    #[test]
    fn positions_come_back_bit_by_bit(points in proptest::collection::vec(any::<[f32; 3]>(), 3..60)) {
        let positions: Vec<Vec3> = points.into_iter().map(Vec3::from).filter(|p| p.is_finite()).collect();
        let faces: Vec<[u32; 3]> =
            (0..positions.len() as u32 / 3).map(|i| [3 * i, 3 * i + 1, 3 * i + 2]).collect();
        if let Ok(mesh) = TriMesh::from_faces(positions, faces) {
            let dir = tempfile::tempdir().unwrap();
            let labels = vec![0; mesh.faces().len()];
            write_semantic_obj(dir.path(), &mesh, &labels, &["wall_1_WC_1_1".into()]).unwrap();
            check_faces(&mesh, &read(&dir.path().join("semantic.obj")).0);
        }
    }
}
