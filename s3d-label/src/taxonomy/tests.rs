use super::*;
use std::collections::{BTreeMap, BTreeSet};

fn class(name: &str) -> ClassDefinition {
    ClassDefinition { name: name.to_owned(), ..Default::default() }
}

fn counts_as(name: &str, other: &str) -> ClassDefinition {
    ClassDefinition { counts_as: Some(other.to_owned()), ..class(name) }
}

fn of(classes: Vec<ClassDefinition>) -> TaxonomyDefinition {
    TaxonomyDefinition { name: "mine".to_owned(), classes, ..Default::default() }
}

fn refused(definition: TaxonomyDefinition) -> String {
    Taxonomy::new(definition).unwrap_err().to_string()
}

#[test]
fn all_that_are_built_in_can_be_made_and_made_again() {
    let sizes = [
        ("s3dis", 13, 11),
        ("nyu40", 40, 34),
        ("scannet20", 20, 26),
        ("scannet200", 200, 26),
        ("matterport40", 40, 37),
    ];
    assert_eq!(sizes.map(|(name, ..)| name), Taxonomy::BUILT_IN);
    for (name, classes, rooms) in sizes {
        let taxonomy = Taxonomy::built_in(name).unwrap();
        assert_eq!((taxonomy.classes().len(), taxonomy.room_types().len()), (classes, rooms), "{name}");
        let colors: BTreeSet<[u8; 3]> = taxonomy.classes().iter().map(|c| taxonomy.color(*c)).collect();
        assert_eq!(colors.len(), classes);
        assert!(taxonomy.clutter().is_some());

        // The complete definition makes the same taxonomy.
        assert_eq!(Taxonomy::any(taxonomy.definition().clone()).unwrap(), taxonomy);
        for (i, class) in taxonomy.classes().iter().enumerate() {
            assert_eq!((class.index(), taxonomy.class(class.name())), (i, Ok(*class)));
            assert_eq!(taxonomy.meaning(class.name()), Some(Some(*class)));
            let by_number = (name != "s3dis").then_some(Some(*class));
            assert_eq!(taxonomy.meaning_of_number(taxonomy.id(*class).into()), by_number);
        }

        // All taxonomies have the 11 room types of S3DIS, so that a scene can name a room under any of them.
        assert!(
            RoomType::S3DIS
                .iter()
                .all(|t| taxonomy.room_type(t.name()).unwrap().s3dis() == Some(*t))
        );
    }

    assert_eq!(Taxonomy::built_in("coco"), None);
    let s3dis = Taxonomy::default();
    assert_eq!((s3dis.classes(), s3dis.room_types()), (&Class::S3DIS[..], &RoomType::S3DIS[..]));
    assert!(s3dis.classes().iter().all(|c| s3dis.id(*c) as usize == c.index() + 1));
    assert!(
        s3dis
            .classes()
            .iter()
            .all(|c| s3dis.color(*c) == crate::pretty_color(c.index() as u32 + 1))
    );
}

fn meaning(taxonomy: &str, word: &str) -> Option<(u32, &'static str, [u8; 3], &'static str)> {
    let taxonomy = Taxonomy::built_in(taxonomy).unwrap();
    let meant = taxonomy.meaning(word).expect(word);
    meant.map(|c| (taxonomy.id(c), c.name(), taxonomy.color(c), c.s3dis().name()))
}

#[test]
fn facts_of_the_data_sets() {
    assert_eq!(meaning("nyu40", "refridgerator"), Some((24, "refrigerator", [255, 127, 14], "clutter")));
    assert_eq!(meaning("nyu40", "office chair"), Some((5, "chair", [188, 189, 34], "chair")));
    assert_eq!(
        meaning("scannet20", "otherfurniture"),
        Some((39, "otherFurniture", [82, 84, 163], "clutter"))
    );
    // The benchmark of ScanNet leaves out this class of NYU.
    assert_eq!(meaning("scannet20", "ceiling"), None);
    assert_eq!(Taxonomy::built_in("scannet20").unwrap().meaning_of_number(22), Some(None));
    assert_eq!(meaning("scannet200", "toilet paper dispenser").unwrap().0, 163);
    assert_eq!(meaning("scannet200", "mattress").unwrap().0, 1191);
    assert_eq!(
        meaning("matterport40", "chest_of_drawers"),
        Some((13, "chestOfDrawers", [0x94, 0x67, 0xbd], "clutter"))
    );
    assert_eq!(meaning("matterport40", "shelving").unwrap().3, "bookcase");
    let matterport = Taxonomy::built_in("matterport40").unwrap();
    assert_eq!((matterport.meaning_of_number(0), matterport.meaning_of_number(42)), (Some(None), None));
    assert_eq!(matterport.room_of_word("b_2").unwrap().to_string(), "bedroom_2");
    assert_eq!(matterport.room_of_word("laundryroom_1").unwrap().to_string(), "laundryRoom_1");
    assert!(matterport.room("b_2").is_err() && matterport.room_of_word("b_0").is_err());
}

#[test]
fn what_is_left_out_is_filled_in() {
    let mut definition =
        of(vec![class("bed"), class("wall"), counts_as("deskLamp", "lamp"), counts_as("lamp", "board")]);
    definition.classes[0].color = Some(crate::pretty_color(2));
    definition.aliases = [("rug", ""), ("cot", "bed"), ("9", "bed")]
        .map(|(a, b)| (a.to_owned(), b.to_owned()))
        .into();

    let taxonomy = Taxonomy::new(definition).unwrap();
    let seen: Vec<_> = taxonomy
        .classes()
        .iter()
        .map(|c| (c.name(), taxonomy.id(*c), taxonomy.is_stuff(*c), c.s3dis().name()))
        .collect();
    let expected = [
        ("bed", 1, false, "clutter"),
        ("wall", 2, true, "wall"),
        ("deskLamp", 3, false, "board"),
        ("lamp", 4, false, "board"),
    ];
    assert_eq!(seen, expected);

    let colors = [2, 1, 3, 4].map(crate::pretty_color);
    assert!(taxonomy.classes().iter().map(|c| taxonomy.color(*c)).eq(colors));
    let bed = taxonomy.class("bed").unwrap();
    assert_eq!(
        ["rug", "cot", "sofa"].map(|word| taxonomy.meaning(word)),
        [Some(None), Some(Some(bed)), None]
    );
    assert_eq!([9, 1, 7].map(|n| taxonomy.meaning_of_number(n)), [Some(Some(bed)), Some(Some(bed)), None]);
    assert_eq!((taxonomy.clutter(), taxonomy.room_types()), (None, &RoomType::S3DIS[..]));
    // An alias is not a name: labels have one spelling.
    assert!(taxonomy.class("cot").is_err());
}

#[test]
fn a_class_counts_as_one_of_s3dis_even_under_its_own_name() {
    let taxonomy = Taxonomy::new(of(vec![counts_as("table", "table"), counts_as("desk", "table")])).unwrap();
    assert!(taxonomy.classes().iter().all(|c| c.s3dis() == Class::TABLE));
    // The class of the taxonomy takes precedence over the class of S3DIS.
    let taxonomy = Taxonomy::new(of(vec![counts_as("table", "board"), counts_as("desk", "table")])).unwrap();
    assert!(taxonomy.classes().iter().all(|c| c.s3dis() == Class::BOARD));
}

#[test]
fn labels_sort_as_their_names_do() {
    let taxonomy =
        Taxonomy::new(of(["shower", "showerCurtain", "showerRod", "shower2"].map(class).into())).unwrap();
    let names = [
        "shower_1_office_1_1",
        "showerCurtain_1_office_1_1",
        "showerRod_1_office_1_1",
        "shower2_1_office_1_1",
    ];
    let table = taxonomy
        .table(names.iter().map(|n| taxonomy.label(n).unwrap()))
        .unwrap();
    let mut sorted = names;
    sorted.sort_unstable();
    assert_eq!(table.names()[1..], sorted);
    assert_eq!(taxonomy.table_from_names(&table.names()), Ok(table));
}

#[test]
fn labels_of_another_taxonomy_make_no_table() {
    // Both taxonomies have a wall, but at different places.
    for label in ["beam_1_office_1_1", "wall_1_office_1_1"] {
        let table = Taxonomy::built_in("scannet20").unwrap().table([label.parse().unwrap()]);
        assert!(
            table
                .unwrap_err()
                .to_string()
                .starts_with(&format!("{label} is no label of scannet20"))
        );
    }
}

fn room_type(name: &str) -> RoomTypeDefinition {
    RoomTypeDefinition { name: name.into(), aliases: vec!["z".into()], counts_as: None }
}

fn pairs(list: &[(&str, &str)]) -> BTreeMap<String, String> {
    list.iter().map(|(a, b)| (a.to_string(), b.to_string())).collect()
}

fn refused_with(change: fn(&mut TaxonomyDefinition)) -> String {
    let mut definition = of(vec![class("bed"), class("lamp")]);
    change(&mut definition);
    refused(definition)
}

#[test]
fn every_fault_has_a_clear_word() {
    for (message, part) in [
        (refused_with(|t| t.name = "s3dis".into()), "give it another name"),
        (refused_with(|t| t.name = "my list".into()), "class 0: \"my list\" is no name"),
        (refused_with(|t| t.classes.clear()), "[[classes]]"),
        (
            refused_with(|t| t.classes = (0..256).map(|i| class(&format!("c{i}"))).collect()),
            "has 256 of the kind \"class\"",
        ),
        (
            refused_with(|t| t.classes[1].name = "shower_curtain".into()),
            "class 2: \"shower_curtain\" is no name",
        ),
        (refused_with(|t| t.classes[1].name = "shower curtain".into()), "Write \"showerCurtain\""),
        (refused_with(|t| t.classes[1].name = "2x".into()), "behind a letter"),
        (refused_with(|t| t.classes[1].name = "x".repeat(41)), "40 characters at most"),
        (refused_with(|t| t.classes[1].name = "bed".into()), "class 2: \"bed\" has the name of class 1"),
        (refused_with(|t| t.classes[1].name = "Bed".into()), "more than upper and lower case"),
        (
            refused_with(|t| t.classes[1].aliases = vec!["bed".into()]),
            "\"bed\" is a word for bed and for lamp",
        ),
        (refused_with(|t| t.aliases = [("bed".into(), String::new())].into()), "for bed and for none"),
        (
            refused_with(|t| t.aliases = [("2".into(), "bed".into())].into()),
            "\"2\" is a word for lamp (its id) and for bed",
        ),
        (
            refused_with(|t| t.clutter = Some("stuff".into())),
            "clutter means \"stuff\", which is no class: there are bed lamp",
        ),
        (refused_with(|t| t.classes[0].id = Some(2)), "class \"lamp\" has the id 2 of class \"bed\""),
        (refused_with(|t| t.classes[0].id = Some(65_536)), "ids go from 0 to 65,535"),
        (
            refused_with(|t| t.classes.iter_mut().for_each(|c| c.color = Some([1, 2, 3]))),
            "has the colour [1, 2, 3] of class \"bed\"",
        ),
        (
            refused_with(|t| t.classes[0].counts_as = Some("sofaa".into())),
            "counts_as of \"bed\" means \"sofaa\", which is no class",
        ),
        (refused_with(|t| t.classes[0].counts_as = Some("bed".into())), "bed counts as bed; let one"),
        (
            refused_with(|t| {
                t.rooms = vec![RoomTypeDefinition { name: "unknown".into(), ..Default::default() }]
            }),
            "type of room 1: \"unknown\"",
        ),
        (
            refused_with(|t| {
                t.rooms = vec![room_type("den"), room_type("nook")];
            }),
            "which type of room is meant",
        ),
    ] {
        assert!(message.contains(part), "{message} — {part}");
    }

    let mut definition = of(vec![class("bed")]);
    definition.aliases = pairs(&[("cot", "bedd")]);
    assert!(
        refused(definition).contains("the alias \"cot\" means \"bedd\", which is no class: there are bed")
    );
    let circle = of(vec![counts_as("a", "b"), counts_as("b", "c"), counts_as("c", "d"), counts_as("d", "b")]);
    assert!(refused(circle).contains("these count as nothing: b counts as c counts as d counts as b;"));
}
