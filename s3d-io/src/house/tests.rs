//! A house of two storeys, for the tests of all readers of houses.

use super::*;
use s3d_geom::glam::dvec3;

/// The panoramas of [`HOUSE`].
pub(crate) const UUIDS: [&str; 2] = ["0c5a7d1e93b84f62a1d7e0f4b2683c95", "ffffffffffffffffffffffffffffffff"];

/// A bedroom with a floor and a chair below, a kitchen with drawers above. The level camera of the first
/// panorama looks along +X and then along −Y; the camera that looks up is lower and elsewhere.
pub(crate) const HOUSE: &str = "\
ASCII 1.1
H house - 3 2 1 1 5 4 3 2 1 2 0 0 0 0 0  0 0 0 4 4 6  0 0 0 0 0
L 0 1 -  2 2 0  0 0 0 4 4 3  0 0 0 0 0
L 1 1 -  2 2 3  0 0 3 4 4 6  0 0 0 0 0
R 0 0 0 0 b  2 2 0  0 0 0 4 4 3  3 0 0 0 0
R 1 1 0 0 k  2 2 3  0 0 3 4 4 6  3 0 0 0 0
P 0 0 1 -  1 1 0 2 1 2  0 0 0 0
S 0 0 0 F  2 2 0  0 0 1  0 0 0 4 4 0  0 0 0 0 0
V 0 0 -  0 0 0  0 0 1  0 0 0
P 0c5a7d1e93b84f62a1d7e0f4b2683c95  0 0 0  1.01 1.02 1.46  0 0 0 0 0
P ffffffffffffffffffffffffffffffff  1 1 0  1 2 4.5  0 0 0 0 0
I 0 0  0c5a7d1e93b84f62a1d7e0f4b2683c95 0 0  0 -1 0 1.02 0 0 1 -1.46 -1 0 0 1.01 0 0 0 1  \
9 0 4 0 9 3 0 0 1  8 6  1.01 1.02 1.46  0 0 0 0 0
I 1 0  0c5a7d1e93b84f62a1d7e0f4b2683c95 1 0  0 -1 0 1 0 0 1 -1.5 -1 0 0 1 0 0 0 1  \
9 0 4 0 9 3 0 0 1  8 6  1 1 1.5  0 0 0 0 0
I 2 0  0c5a7d1e93b84f62a1d7e0f4b2683c95 1 1  -1 0 0 1.2 0 0 1 -1.5 0 1 0 -1 0 0 0 1  \
9 0 4 0 9 3 0 0 1  8 6  1.2 1 1.5  0 0 0 0 0
C 0  4 floor  2 floor  0 0 0 0 0
C 1  28 office#chair  3 chair  0 0 0 0 0
C 2  111 kitchen#drawers  13 chest_of_drawers  0 0 0 0 0
O 0 0 0  2 2 0  1 0 0  0 1 0  2 2 0.1  0 0 0 0 0 0 0 0
O 1 0 1  1 1 0.4  1 0 0  0 1 0  0.2 0.2 0.4  0 0 0 0 0 0 0 0
O 2 1 2  2 2 3  1 0 0  0 1 0  2 2 0.1  0 0 0 0 0 0 0 0
O 3 1 -1  2 2 3  1 0 0  0 1 0  2 2 0.1  0 0 0 0 0 0 0 0
E 0 0 7  1  2 2 0  0 0 0 4 4 0  0 0 0 0 0
E 1 1 3  1  1 1 0.4  0 0 0 2 2 1  0 0 0 0 0
E 2 2 1000003  1  2 2 3  0 0 3 4 4 3  0 0 0 0 0
E 3 3 1000007  1  2 2 3  0 0 3 4 4 3  0 0 0 0 0
E 4 -1 1000008  1  2 2 3  0 0 3 4 4 3  0 0 0 0 0
";

/// Returns [`HOUSE`] with the first `from` replaced.
pub(crate) fn with(from: &str, to: &str) -> String {
    assert!(HOUSE.contains(from), "{from}");
    HOUSE.replacen(from, to, 1)
}

fn parse(text: &str) -> Result<House> {
    House::parse(text.as_bytes(), Path::new("a.house"))
}

#[test]
fn a_house_is_read() {
    for text in [HOUSE.to_owned(), HOUSE.replace('\n', "\r\n"), HOUSE.replace("\nL", "\n\nL")] {
        let house = parse(&text).unwrap();
        let rooms: Vec<&str> = house.regions.iter().map(|region| region.room.as_str()).collect();
        assert_eq!(rooms, ["b_1", "k_1"]);
        let words: Vec<_> = house
            .categories
            .iter()
            .map(|c| (c.mapping, c.word.as_deref().unwrap()))
            .collect();
        assert_eq!(words, [(4, "floor"), (28, "chair"), (111, "chest_of_drawers")]);
        assert_eq!(house.objects[2], Object { region: Some(1), category: Some(2) });
        assert_eq!(house.objects[3], Object { region: Some(1), category: None });
        assert_eq!((house.segments.len(), house.segments[&1_000_003]), (5, Some(2)));
        assert_eq!(house.segments[&1_000_008], None);

        let [first, second] = &house.panoramas[..] else { panic!("{house:?}") };
        assert_eq!([&first.name, &second.name], UUIDS);
        assert_eq!((first.place, first.has_pictures, first.line > 9), (dvec3(1.01, 1.02, 1.46), true, true));
        assert_eq!((second.level.len(), second.has_pictures), (0, false));
        let [(0, ahead), (1, right)] = &first.level[..] else { panic!("{first:?}") };
        assert_eq!((ahead.location, ahead.forward()), (dvec3(1.0, 1.0, 1.5), DVec3::X));
        assert!(right.location.abs_diff_eq(dvec3(1.2, 1.0, 1.5), 1e-12) && right.forward() == -DVec3::Y);
    }
}

#[test]
fn rooms_of_one_kind_are_numbered_and_those_without_are_others() {
    let text = with("R 1 1 0 0 k", "R 1 1 0 0 -")
        .replace(" 2 1 2 0 0 0 0 0  0 0 0 4 4 6", " 5 1 2 0 0 0 0 0  0 0 0 4 4 6");
    let more = "R 2 -1 0 0 B  2 2 3  0 0 3 4 4 6  3 0 0 0 0\nR 3 1 0 0 b  2 2 3  0 0 3 4 4 6  3 0 0 0 0\n\
                R 4 1 0 0 z  2 2 3  0 0 3 4 4 6  3\nP 0 0 1";
    let house = parse(&text.replacen("P 0 0 1", more, 1)).unwrap();
    let rooms: Vec<&str> = house.regions.iter().map(|region| region.room.as_str()).collect();
    assert_eq!(rooms, ["b_1", "z_1", "B_1", "b_2", "z_2"]);
}

#[test]
fn faults_have_their_line() {
    for (from, to, words) in [
        ("ASCII 1.1", "ply", "a.house, line 1: `ply`: a house of Matterport3D begins with ASCII 1.1"),
        ("ASCII 1.1", "ASCII 1.0", "a.house: is a house of version `1.0`"),
        ("H house", "L house", "line 2: stands before the line H"),
        ("L 0 1", "H 0 1", "line 3: "),
        ("H house - 3", "H house - -3", "line 2: -3 is no number of records"),
        ("H house - 3", "H house - 99999999999999999999", "line 2: field 3, the image, is `9999"),
        ("H house - 3", "H house - 4", "line 2: tells of 4 records of the kind image, and there are 3"),
        (" 5 4 3 2 1 2 ", " 5 4 3 2 0 2 ", "line 10: is panorama 0, and 1 is expected"),
        ("R 1 1", "R 2 1", "line 6: is region 2, and 1 is expected: a line is missing or moved"),
        ("R 1 1", "R 1 2", "line 6: names level 2: 2 stand before it, from 0"),
        ("R 1 1 0 0 k", "R 1 1 0 0 kitchen", "line 6: `kitchen`: the label of a region is one letter"),
        ("R 1 1 0 0 k  2 2 3  0 0 3 4 4 6", "R 1 1 0 0 k", "line 6: has 11 fields"),
        ("ffffffffffffffffffffffffffffffff", "0C5A7D1E93B84F62A1D7E0F4B2683C95", "line 11: there are two"),
        ("1 2 4.5", "1 two 4.5", "line 11: field 6 is `two`, which is no number"),
        ("1 2 4.5", "1 inf 4.5", "line 11: field 6 is `inf`"),
        ("b2683c95 1 1", "b2683c95 1 0", "line 14: there are two pictures of camera 1 at stop 0"),
        ("I 2 0", "I 2 2", "line 14: names panorama 2: 2 stand before it"),
        ("0 1 0 -1 0 0 0 1", "0 1 0 -1 0 0 1 1", "line 14: the last row of the extrinsics"),
        ("-1 0 0 1.2", "-2 0 0 1.2", "line 14: the extrinsics: "),
        ("C 1  28", "C 1  chair", "line 16: field 2, the category of category_mapping.tsv, is `chair`"),
        ("O 1 0 1", "O 1 0 3", "line 19: names category 3: 3 stand before it, from 0"),
        ("O 1 0 1", "O 1 -2 1", "line 19: names region -2"),
        ("E 1 1 3", "E 1 4 3", "line 23: names object 4: 4 stand before it, from 0"),
        ("E 1 1 3", "E 1 1 7", "line 23: the segment 7 belongs to another object on an earlier line"),
        ("E 1 1 3", "E 1 1 9223372036854775808", "line 23: field 3, the segment, is `9223"),
        ("E 1 1 3", "X 1 1 3", "line 23: `X`: no record has this letter"),
    ] {
        let message = parse(&with(from, to)).unwrap_err().to_string();
        assert!(message.contains(words), "{from} → {to}: {message}");
    }
    assert!(parse("ASCII 1.1\n").unwrap_err().to_string().contains("has no line H"));
    assert!(parse("").is_err());
    assert!(House::parse(b"ASCII 1.1\nH \xff\n", Path::new("a.house")).is_err());
}
