//! PCD: text, binary and compressed.

use super::*;

/// A header with padding, a field of two numbers, and a packed colour of this type.
fn pcd_header(points: usize, rgb: char, data: &str) -> String {
    let padding = if data == "binary" {
        ["_ ", "1 ", "U ", "3 "]
    } else {
        [""; 4]
    };
    let [name, size, kind, count] = padding;
    format!(
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\nFIELDS x y z {name}rgb uv label object\n\
         SIZE 4 4 4 {size}4 4 2 8\nTYPE F F F {kind}{rgb} F U I\nCOUNT 1 1 1 {count}1 2 1 1\nWIDTH {points}\n\
         HEIGHT 1\nVIEWPOINT 9 9 9 0 1 0 0\nPOINTS {points}\nDATA {data}\n"
    )
}

/// The bytes of each field of a point.
fn pcd_fields(p: &Point, padding: bool) -> Vec<Vec<u8>> {
    let [r, g, b] = p.color;
    let mut fields: Vec<Vec<u8>> = p.position.iter().map(|v| v.to_le_bytes().to_vec()).collect();
    if padding {
        fields.push(vec![0xee; 3]);
    }
    fields.extend([
        vec![b, g, r, 255],
        [0.5f32, -0.5].map(f32::to_le_bytes).concat(),
        p.class.to_le_bytes().to_vec(),
        i64::from(p.instance).to_le_bytes().to_vec(),
    ]);
    fields
}

fn binary_pcd(rgb: char) -> Vec<u8> {
    let points = points();
    let mut bytes = pcd_header(points.len(), rgb, "binary").into_bytes();
    bytes.extend(points.iter().flat_map(|p| pcd_fields(p, true).concat()));
    bytes
}

/// Packs with LZF: repeats of the byte eight places before as references, and other bytes as they are.
fn lzf(bytes: &[u8]) -> Vec<u8> {
    let mut packed = Vec::new();
    let mut at = 0;
    while at < bytes.len() {
        let same = |i: &usize| *i >= 8 && bytes[*i] == bytes[*i - 8];
        let length = (at..bytes.len()).take(200).take_while(same).count();
        if length >= 9 {
            packed.extend([7 << 5, length as u8 - 9, 7]);
            at += length;
        } else {
            packed.extend([0, bytes[at]]);
            at += 1;
        }
    }
    packed
}

fn compressed_pcd() -> Vec<u8> {
    let points = points();
    let fields: Vec<Vec<Vec<u8>>> = points.iter().map(|p| pcd_fields(p, false)).collect();
    let unpacked: Vec<u8> = (0..fields[0].len())
        .flat_map(|i| fields.iter().flat_map(move |point| point[i].clone()))
        .collect();
    let packed = lzf(&unpacked);
    let mut bytes = pcd_header(points.len(), 'U', "binary_compressed").into_bytes();
    bytes.extend((packed.len() as u32).to_le_bytes());
    bytes.extend((unpacked.len() as u32).to_le_bytes());
    bytes.extend(packed);
    bytes
}

fn ascii_pcd(rgb: char) -> String {
    let mut text = pcd_header(60, rgb, "ascii");
    for Point { position: [x, y, z], color: [r, g, b], class, instance } in points() {
        let packed = u32::from_be_bytes([0, r, g, b]);
        let color = if rgb == 'F' {
            format!("{:e}", f32::from_bits(packed))
        } else {
            packed.to_string()
        };
        text += &format!("{x} {y} {z} {color} 0.5 -0.5 {class} {instance}\n");
    }
    text
}

#[test]
fn pcd_files_of_all_kinds_hold_the_same_points() {
    let kinds = [
        binary_pcd('U'),
        binary_pcd('F'),
        compressed_pcd(),
        ascii_pcd('U').into_bytes(),
        ascii_pcd('F').into_bytes(),
    ];
    for bytes in kinds {
        // The contents tell the format, whatever the name says.
        for name in ["a.pcd", "a.txt"] {
            let found = read(name, &bytes);
            assert_eq!(contents(&found, "office_1"), expected(DVec3::ZERO));
            assert!(found.warnings.is_empty(), "{:?}", found.warnings);
        }
        let spooled = AnnotationOptions { points_in_memory: 7, ..options() };
        let found = open(&file("a.pcd", &bytes).path, &spooled).unwrap();
        assert_eq!(contents(&found, "office_1"), expected(DVec3::ZERO));

        for length in (0..bytes.len() - 1).step_by(bytes.len() / 25) {
            let message = refused("a.pcd", &bytes[..length], &options());
            assert!(!message.is_empty());
        }
    }
}

#[test]
fn points_of_a_pcd_without_coordinates_are_left_out_and_counted() {
    let hole = |x: f32| {
        let p = Point { position: [x, f32::NAN, 1.0], color: [0; 3], class: 2, instance: 0 };
        pcd_fields(&p, true).concat()
    };
    let mut bytes = pcd_header(62, 'U', "binary").into_bytes();
    bytes.extend(hole(f32::NAN));
    bytes.extend(points().iter().flat_map(|p| pcd_fields(p, true).concat()));
    bytes.extend(hole(1.0));
    let found = read("a.pcd", &bytes);
    assert_eq!(contents(&found, "office_1"), expected(DVec3::ZERO));
    let note = "2 of 62 points have no coordinates (NaN), left out";
    assert!(found.warnings.len() == 1 && found.warnings[0].contains(note), "{:?}", found.warnings);

    let text = ascii_pcd('U').replace("POINTS 60", "POINTS 61") + "nan nan nan 0 0 0 2 0\nmore\n";
    let found = read("a.pcd", text);
    assert_eq!(contents(&found, "office_1"), expected(DVec3::ZERO));
    assert!(found.warnings[0].contains("lines after its 61 POINTS"), "{:?}", found.warnings);
    assert!(found.warnings[1].contains("1 of 61 points"), "{:?}", found.warnings);
}

#[test]
fn claims_of_a_pcd_are_held_against_its_file() {
    let many = |bytes: Vec<u8>, points: &str| {
        let at = bytes.windows(9).position(|w| w == b"POINTS 60").unwrap();
        [&bytes[..at + 7], points.as_bytes(), &bytes[at + 9..]].concat()
    };
    for (bytes, points, words) in [
        (binary_pcd('U'), "61", "claims 61 points of 37 bytes in 2220 bytes: it is cut short"),
        (binary_pcd('U'), "18446744073709551615", "claims 18446744073709551615 points"),
        (compressed_pcd(), "61", "claims 61 points of 34 bytes in 2040 bytes: it is cut short"),
        (compressed_pcd(), "999999999999", "claims 999999999999 points"),
        (ascii_pcd('U').into_bytes(), "61", "has 61 POINTS, and 60 are there"),
    ] {
        let message = refused("a.pcd", many(bytes, points), &options());
        assert!(message.contains(words), "{message}");
    }

    // Sizes that lie about the compressed bytes.
    let good = compressed_pcd();
    let at = good.windows(11).position(|w| w == b"compressed\n").unwrap() + 11;
    for (offset, words) in [(0, "bytes of points in"), (4, "claims 60 points")] {
        let mut bad = good.clone();
        let lie = if offset == 0 { u32::MAX } else { 5 };
        bad[at + offset..at + offset + 4].copy_from_slice(&lie.to_le_bytes());
        let message = refused("a.pcd", &bad, &options());
        assert!(message.contains(words), "{message}");
    }
    let mut bad = good;
    bad[at + 8] = 0x20;
    assert!(refused("a.pcd", &bad, &options()).contains("refers to bytes before the first"));
}

#[test]
fn a_bad_line_of_a_pcd_is_named_or_skipped() {
    let text = ascii_pcd('U').replacen("\n0.25 -0.5 ", "\n0.25 minus ", 1);
    let message = refused("a.pcd", &text, &options());
    assert!(message.starts_with(", line 13: the coordinate `minus` is no number"), "{message}");
    let skip = AnnotationOptions { on_fault: OnFault::Skip, ..options() };
    let found = open(&file("a.pcd", &text).path, &skip).unwrap();
    assert_eq!(all_points(&found), 59);
    assert!(found.warnings[0].contains("1 records left out"), "{:?}", found.warnings);
}
