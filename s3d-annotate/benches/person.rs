//! The strokes that a simulated person needs until 90, 95 and 99 % of the surface has the right instance, and
//! the purity of patches before and after the work. Of faces that lie over a border of things it tells the
//! share, and the strokes to 99 % if such a face is right with any of its things, or else how much is right
//! so in the end. It counts strokes, and not time. Arguments: words of the names of scenes; none: all.

#![allow(clippy::print_stdout, reason = "the table is its result")]

#[path = "../tests/person/oracle/mod.rs"]
mod oracle;
#[path = "../tests/person/scenes.rs"]
mod scenes;
#[path = "../tests/person/sitting.rs"]
mod sitting;

use oracle::label;
use scenes::{Known, copy_room, demo, house, office};
use sitting::Sitting;

/// No sitting has more strokes.
const MOST: usize = 150;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).filter(|word| !word.starts_with('-')).collect();
    let is_asked = |name: &str| words.is_empty() || words.iter().any(|word| name.contains(word.as_str()));
    let scenes: [(&str, &dyn Fn() -> Option<Known>); 6] = [
        ("office", &|| Some(office())),
        ("office, scanned", &|| Some(office().scanned(0.05, 0.004))),
        ("demo", &|| Some(demo())),
        ("demo, scanned", &|| Some(demo().scanned(0.06, 0.004))),
        ("house", &|| Some(house())),
        ("copyroom", &copy_room),
    ];

    println!(
        "| scene | faces | things | rooms | taken | 90 % | 95 % | 99 % | mixed | either | end | purity | after |"
    );
    println!("|---|---|---|---|---|---|---|---|---|---|---|---|---|");
    for (_, scene) in scenes.iter().filter(|(name, _)| is_asked(name)) {
        // The scan of the copy room may not be there.
        if let Some(scene) = scene() {
            let folder = tempfile::tempdir().expect("a folder for the labels");
            let sitting = label(&scene, &folder.path().join("scan.labels"), 0.99, MOST);
            println!("{}", row(&scene, &sitting));
        }
    }
}

fn row(scene: &Known, sitting: &Sitting) -> String {
    let shown = |strokes: Option<usize>| strokes.map_or("–".to_owned(), |strokes| strokes.to_string());
    let strokes = |share: f64| shown(sitting.strokes_to(share));
    let count = |kind: &str| sitting.kinds.get(kind).copied().unwrap_or(0);
    let kinds: Vec<String> = sitting
        .kinds
        .iter()
        .map(|(kind, strokes)| format!("{strokes} {kind}"))
        .collect();
    let rooms = count("accept");
    format!(
        "| {} | {} | {} | {rooms} | {:.3} | {} | {} | {} | {:.4} | {} | {:.3} after {}: {} | {:.3} | {:.3} |",
        scene.name,
        scene.mesh.faces().len(),
        sitting.things,
        sitting.right[rooms],
        strokes(0.9),
        strokes(0.95),
        strokes(0.99),
        sitting.mixed,
        match sitting.strokes_to_either(0.99) {
            Some(strokes) => strokes.to_string(),
            None => format!("– ({:.3})", sitting.either.last().copied().unwrap_or_default()),
        },
        sitting.right.last().copied().unwrap_or_default(),
        sitting.right.len() - 1,
        kinds.join(", "),
        sitting.purity_before,
        sitting.purity_after,
    )
}
