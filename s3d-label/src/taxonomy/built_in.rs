//! The taxonomies of known data sets, from tables beside this file. The tables name their sources.

use crate::taxonomy::definition::{ClassDefinition, Kind, RoomTypeDefinition, TaxonomyDefinition};
use crate::taxonomy::{Taxonomy, TaxonomyError};
use std::sync::LazyLock;

/// The classes of NYU that the benchmark of ScanNet has. Source:
/// BenchmarkScripts/ScanNet200/scannet200_constants.py of github.com/ScanNet/ScanNet.
const SCANNET20: [u32; 20] = [1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 14, 16, 24, 28, 33, 34, 36, 39];

pub(super) fn s3dis() -> Taxonomy {
    static TAXONOMY: LazyLock<Taxonomy> =
        LazyLock::new(|| make(table(Taxonomy::S3DIS, include_str!("s3dis.tsv"))));
    TAXONOMY.clone()
}

pub(super) fn find(name: &str) -> Option<Taxonomy> {
    static OTHERS: LazyLock<[Taxonomy; 4]> = LazyLock::new(|| {
        let nyu40 = table("nyu40", include_str!("nyu40.tsv"));
        let scannet200 = table("scannet200", include_str!("scannet200.tsv"));
        [
            make(scannet20(&nyu40, &scannet200)),
            make(nyu40),
            make(scannet200),
            make(table("matterport40", include_str!("matterport40.tsv"))),
        ]
    });
    if name == Taxonomy::S3DIS {
        return Some(s3dis());
    }
    OTHERS.iter().find(|taxonomy| taxonomy.name() == name).cloned()
}

#[expect(clippy::expect_used, reason = "the definitions are constants, and a test makes all of them")]
fn make(definition: TaxonomyDefinition) -> Taxonomy {
    let made: Result<Taxonomy, TaxonomyError> = Taxonomy::any(definition);
    made.expect("a taxonomy that is built in")
}

/// Reads the definition in a table. The head of the table describes the columns.
fn table(name: &str, text: &str) -> TaxonomyDefinition {
    let mut all = TaxonomyDefinition { name: name.to_owned(), ..Default::default() };
    for line in text.lines().filter(|line| !line.starts_with('#')) {
        let mut fields = line.split('\t').map(str::to_owned);
        let mut field = || fields.next().unwrap_or_default();
        let id = field();
        let name = field();
        let color = field();
        let kind = field();
        let counts_as = Some(field()).filter(|word| !word.is_empty());
        let aliases = field();
        let aliases = aliases.split('|').filter(|word| !word.is_empty()).map(str::to_owned);

        match (name.as_str(), kind.as_str()) {
            ("-", _) => all.aliases.extend(aliases.map(|word| (word, String::new()))),
            ("*", _) => all.clutter = counts_as,
            (_, "room") => {
                all.rooms
                    .push(RoomTypeDefinition { name, aliases: aliases.collect(), counts_as });
            }
            _ => all.classes.push(ClassDefinition {
                name,
                id: id.parse().ok(),
                color: u32::from_str_radix(&color, 16).ok().map(|hex| {
                    let [_, color @ ..] = hex.to_be_bytes();
                    color
                }),
                kind: Some(if kind == "stuff" { Kind::Stuff } else { Kind::Thing }),
                aliases: aliases.collect(),
                counts_as,
            }),
        }
    }
    all
}

/// Returns the classes of NYU that the benchmark of ScanNet has. Words for other classes mean "no class", as
/// in the benchmark.
fn scannet20(nyu40: &TaxonomyDefinition, scannet200: &TaxonomyDefinition) -> TaxonomyDefinition {
    let (classes, others): (Vec<_>, Vec<_>) = nyu40
        .classes
        .iter()
        .cloned()
        .partition(|class| class.id.is_some_and(|id| SCANNET20.contains(&id)));
    let mut aliases = nyu40.aliases.clone();
    for other in others {
        let words = [other.name]
            .into_iter()
            .chain(other.aliases)
            .chain(other.id.map(|id| id.to_string()));
        aliases.extend(words.map(|word| (word, String::new())));
    }
    TaxonomyDefinition {
        name: "scannet20".to_owned(),
        clutter: Some("otherFurniture".to_owned()),
        classes,
        rooms: scannet200.rooms.clone(),
        aliases,
    }
}
