use super::*;
use proptest::prelude::*;
use s3d_geom::glam::vec3;
use std::fs;

/// Reads `obj`, Z-up.
fn read_obj(obj: &str) -> Result<MeshFile> {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.obj");
    fs::write(&path, obj).unwrap();
    read(&path, UpAxis::Z)
}

const SQUARE: &str = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\n";

#[test]
fn vertices_and_faces_keep_the_files_order() {
    let obj = format!("v 9 9 9\n{SQUARE}v 1 0 0\no x\nf 5 4 3\ng y\nf 4 2 3\nf 2 6 5\n");
    let file = read_obj(&obj).unwrap();
    // The first vertex is in no face, and the last has the position of the third. Both stay.
    assert_eq!(file.mesh.positions().len(), 6);
    assert_eq!(file.mesh.positions()[0], vec3(9.0, 9.0, 9.0));
    assert_eq!(file.mesh.faces(), [[4, 3, 2], [3, 1, 2], [1, 5, 4]]);
    assert!(file.warnings.is_empty() && file.mesh.parts().face_uvs.is_empty());
}

#[test]
fn files_of_one_two_and_three_vertices_are_no_special_case() {
    for (n, obj) in [(1, "v 0 0 0\nf 1 1 1\n"), (2, "v 0 0 0\nv 1 0 0\nf 1 2 2\n")] {
        let message = read_obj(obj).unwrap_err().to_string();
        assert!(message.contains("no face with an area (1 faces"), "{n}: {message}");
    }
    assert_eq!(read_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 3 1 2\n").unwrap().mesh.faces(), [[2, 0, 1]]);
}

#[test]
fn axes_turn_positions_and_normals() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("a.obj");
    fs::write(&path, "v 0 0 0\nv 0 0 1\nv 1 0 0\nvn 0 3 0\nf 1//1 2//1 3//1\n").unwrap();
    let mesh = read(&path, UpAxis::Y).unwrap().mesh;
    assert_eq!(mesh.positions()[1], vec3(0.0, -1.0, 0.0));
    assert_eq!(mesh.normal(0), Vec3::Z);
    assert_eq!(mesh.corner_normals(0), Some([Vec3::Z; 3]));
}

#[test]
fn polygons_are_cut_with_their_attributes() {
    // An L, concave at its fourth corner. Then a polygon that crosses itself, then a triangle.
    let obj = "v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nvt 0 0\nvt 2 0\nvt 2 1\nvt 1 1\n\
               vt 1 2\nvt 0 2\n\
        usemtl l\nf 1/1 2/2 3/3 4/4 5/5 6/6\nusemtl bad\nf 1 4 2 3 1 4\nusemtl t\nf 1/1 2/2 3/3\n";
    let file = read_obj(obj).unwrap();
    assert_eq!((file.polygons_triangulated, file.mesh.faces().len()), (1, 5));
    assert_eq!(file.mesh.total_area(), 3.0 + 1.0);

    for face in 0..5 {
        let corners = file.mesh.triangle(face).map(|p| p.truncate());
        assert_eq!(
            file.mesh.parts().face_uvs[face as usize].map(|i| file.mesh.parts().uvs[i as usize]),
            corners
        );
        assert_eq!(file.mesh.normal(face), Vec3::Z);
        assert_eq!(file.mesh.material_of(face), Some(if face < 4 { 0 } else { 2 }));
    }
    assert!(
        file.warnings[0].starts_with("1 polygon left out: the first, on line 16, "),
        "{:?}",
        file.warnings
    );
}

#[test]
fn what_is_left_out_is_told() {
    let file =
        read_obj(&format!("{SQUARE}f 1 2 3\nf 1 2\nf 1 1 2\nf\nl 1 2 3\nvn 0 0 0\nf 1//1 3//1 4//1\n"))
            .unwrap();
    assert_eq!(file.mesh.faces(), [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(file.mesh.corner_normals(1), None);
    let told = file.warnings.join("\n");
    for words in [
        "2 faces with fewer than three corners left out, the first on line 9",
        "1 face of zero area",
        "1 face left out: not finite",
    ] {
        assert!(told.contains(words), "{told}");
    }
}

#[test]
fn words_of_the_format_are_passed_over_and_others_refused() {
    let others =
        "o a\ng b c\ns off\nmg 1 0.5\nlod 1\nbevel on\nvp 0.1 0.2\ncstype bezier\ndeg 3\nend\n#F 1\n";
    let file = read_obj(&format!("{SQUARE}{others}f 1 2 3\nfo 1 3 4\np 1\nend#x\n")).unwrap();
    assert!(file.warnings.is_empty() && file.mesh.faces().len() == 2, "{:?}", file.warnings);
    let file = read_obj(&format!("{SQUARE}f 1 2 3\ncall other.obj\nsurf 0 1 0 1 1 2 3 4\n")).unwrap();
    let told = file.warnings.join("\n");
    let words = "2 statements of curves, surfaces or other files left out, the first `call` on line";
    assert!(told.contains(words), "{told}");

    for (line, words) in [
        ("F 1 2 3", "`F` is no word of the format, which has `f` in lower case: `F 1 2 3`"),
        ("face 1 2 3", "`face` is no word of the format: `face 1 2 3`"),
    ] {
        let message = read_obj(&format!("{SQUARE}f 1 2 3\n{line}\n")).unwrap_err().to_string();
        assert!(message.contains(words) && message.contains(", line "), "{message}");
    }
}

fn colors_and_warnings(obj: &str) -> (Vec<[u8; 3]>, usize) {
    let file = read_obj(obj).unwrap();
    (file.mesh.parts().colors.clone(), file.warnings.len())
}

#[test]
fn vertex_colours_of_both_scales_and_of_some_vertices() {
    let all = "v 0 0 0 1 0.5 0\nv 1 0 0 0 0 0\nv 0 1 0 0 0 1\nf 1 2 3\n";
    assert_eq!(colors_and_warnings(all), (vec![[255, 128, 0], [0; 3], [0, 0, 255]], 0));
    let bytes = "v 0 0 0 255 128 0\nv 1 0 0 0 0 1\nv 0 1 0 0 0 300\nf 1 2 3\n";
    assert_eq!(colors_and_warnings(bytes), (vec![[255, 128, 0], [0, 0, 1], [0, 0, 255]], 0));
    let some = "v 0 0 0\nv 1 0 0 0 0 1\nv 0 1 0\nf 1 2 3\n";
    assert_eq!(colors_and_warnings(some), (vec![DEFAULT_COLOR, [0, 0, 255], DEFAULT_COLOR], 1));
    // A program wrote NaN where it saw nothing.
    let unseen = "v 0 0 0 nan nan nan\nv 1 0 0 0 0 1\nv 0 1 0 -nan 0 0\nf 1 2 3\n";
    assert_eq!(colors_and_warnings(unseen), (vec![DEFAULT_COLOR, [0, 0, 255], DEFAULT_COLOR], 1));
}

#[test]
fn indices_into_columns_that_the_file_lacks_are_passed_over() {
    let corners = "v 0 0 0\nv 1 0 0\nv 0 1 0\n";
    for (rest, words) in [
        ("f 1//1 2//1 3//1\n", "faces name normals"),
        ("f 1/1 2/2 3/3\n", "faces name texture coordinates"),
        ("vn 0 0 1\nf 1/1/1 2/2/1 3/3/1\n", "faces name texture coordinates"),
    ] {
        let file = read_obj(&format!("{corners}{rest}")).unwrap();
        assert_eq!(file.mesh.faces(), [[0, 1, 2]]);
        assert!(file.warnings.len() == 1 && file.warnings[0].starts_with(words), "{:?}", file.warnings);
        assert_eq!(file.mesh.corner_normals(0).is_some(), rest.starts_with("vn"));
    }
    // An index beyond a column that is there is a fault.
    assert!(read_obj(&format!("{corners}vn 0 0 1\nf 1//1 2//2 3//1\n")).is_err());
}

#[test]
fn bad_numbers_are_named_with_their_line() {
    for (obj, words) in [
        ("v 0 0 0\nv 1 x 0\nv 0 1 0\nf 1 2 3\n", "a.obj, line 2: `x` is no number: `v 1 x 0`"),
        ("v 0 0 0\nv 1 inf 0\nv 0 1 0\nf 1 2 3\n", "a.obj, line 2: a face uses a vertex that is not finite"),
        ("v 0 0 0\nv 1 0 0\nv 0 1e40 0\nv 0 1 1\nf 1 2 3 4\n", "a.obj, line 3: a face uses a vertex"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nv 1 2", "a.obj, line 5: a vertex has three"),
    ] {
        let message = read_obj(obj).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    }
    // A vertex that no face uses may have any number that is well-formed.
    assert!(read_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nv nan nan nan\nf 1 2 3\n").is_ok());
    assert!(
        read_obj("v 0 0 0\nv 1 0 0\nv 0 1 0\nvt nan 0\nf 1/1 2/1 3/1\n")
            .unwrap()
            .mesh
            .parts()
            .face_uvs[0]
            == [NO_INDEX; 3]
    );
}

#[test]
fn files_without_faces_say_what_they_hold() {
    for (obj, words) in [
        ("", "a.obj: has no face, only 0 vertices; a mesh"),
        ("v 0 0 0\np 1\n", "only 1 vertex and 1 point and line element"),
        ("v 0 0 0\nf 1 1\n", "the first that has fewer is on line 2"),
        ("v 0 0 0\nv 1 0 0\nv 2 0 0\nv 3 0 0\nf 1 2 3 4\n", "no face that can be used, as on line 5: "),
    ] {
        let message = read_obj(obj).unwrap_err().to_string();
        assert!(message.contains(words), "{message}");
    }
}

#[test]
fn columns_keep_what_is_used_in_the_order_of_its_use() {
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvt 1 0\nvt 2 0\nvt 3 0\nvt 4 0\nf 1/4 2/2 3/4\nf 1 2/3 3/3\n\
               f 1/2 2/4 3/2\n";
    let mesh = read_obj(obj).unwrap().mesh;
    assert_eq!(mesh.parts().uvs.iter().map(|uv| uv.x).collect::<Vec<_>>(), [1.0, 4.0, 2.0, 3.0]);
    assert_eq!(mesh.parts().face_uvs, [[1, 2, 1], [NO_INDEX; 3], [2, 1, 2]]);
}

#[test]
fn a_line_of_many_megabytes_is_read() {
    let n = 16_000;
    let mut obj = String::from("# ");
    obj.extend(std::iter::repeat_n('x', 5_000_000));
    obj.push('\n');
    for i in 0..n {
        // A saw of n corners along a line, closed by its first and last corners.
        obj += &format!("v {i} {} 0\n", if i % (n - 1) == 0 { 0 } else { 1 + i % 2 });
    }
    obj.push('f');
    (1..=n).rev().for_each(|i| obj += &format!(" {i}"));
    let file = read_obj(&obj).unwrap();
    assert_eq!((file.polygons_triangulated, file.mesh.faces().len()), (1, n - 2));
}

proptest! {
    #[test]
    fn any_words_load_or_are_refused(words in proptest::collection::vec(proptest::sample::select(vec![
        "v", "vt", "vn", "f", "l", "usemtl", "mtllib", "#", "\\", "\n", "\n", "\nf", "\nv", "\nv 1 2 \
            3\n", "\nf 1 2 3\n",
        "\nvt 0 0\n", "0", "1", "2", "3", "-1", "-2", "1/1", "-1/-1/-1",
        "2//1", "1/", "//", "1.5", "nan", "inf", "1e99",
        "-9223372036854775808", "9223372036854775807", "4294967296", "x", "\u{e4}", "0.5", "\r",
    ]), 0..60)) {
        // Any fault that tobj refuses has a line.
        if let Err(e) = read_obj(&words.join(" ")) {
            prop_assert!(!e.to_string().contains("cannot be read"), "{e}");
        }
    }

    #[test]
    fn triangles_come_back(positions in proptest::collection::vec(any::<[i16; 3]>(), 3..20), picks in
        proptest::collection::vec(any::<[proptest::sample::Index; 3]>(), 1..30)) {
        let faces: Vec<[usize; 3]> = picks.iter().map(|f| f.map(|i| i.index(positions.len()))).collect();
        let mut obj = String::new();
        positions.iter().for_each(|p| obj += &format!("v {} {} {}\n", p[0], p[1], p[2]));
        faces.iter().for_each(|f| obj += &format!("f {} {} {}\n", f[0] + 1, f[1] + 1, f[2] + 1));
        let expected = s3d_geom::TriMesh::from_faces(
            positions.iter().map(|p| Vec3::from_array(p.map(f32::from))).collect(),
            faces.iter().map(|f| f.map(|i| i as u32)).collect(),
        );
        match (read_obj(&obj), expected) {
            (Ok(file), Ok(mesh)) => {
                prop_assert_eq!(file.mesh.positions(), mesh.positions());
                prop_assert_eq!(file.mesh.faces(), mesh.faces());
            }
            (Err(Error::Mesh { source, .. }), Err(e)) => prop_assert_eq!(source, e),
            (found, expected) => {
                prop_assert!(false, "{:?} {:?}", found.map(|_| ()), expected.map(|_| ()));
            }
        }
    }
}
