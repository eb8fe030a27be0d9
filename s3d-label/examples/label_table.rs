//! Prints the label table of an S3DIS area as JSON, from the names of its annotation files.
//!
//! `cargo run --example label_table -- path/to/Area_1`
#![allow(clippy::print_stdout, clippy::print_stderr)] // It is a program.

use s3d_label::{Class, LabelTable, Room, number_area};
use std::error::Error;
use std::path::Path;

/// Returns the instances of a room: `Annotations/chair_3.txt` is the third chair. Files of unknown classes
/// are reported and left out.
fn instances(folder: &Path) -> std::io::Result<Vec<(Class, u32)>> {
    let mut found = Vec::new();
    for file in std::fs::read_dir(folder)? {
        let path = file?.path();
        let stem = path.file_stem().and_then(|stem| stem.to_str()).unwrap_or_default();
        let words = stem
            .rsplit_once('_')
            .map(|(class, number)| (class.parse::<Class>(), number.parse()));
        match words {
            Some((Ok(class), Ok(number))) => found.push((class, number)),
            Some((Err(unknown), _)) => eprintln!("{}: {unknown}", path.display()),
            _ => eprintln!("{}: not class_number.txt", path.display()),
        }
    }
    Ok(found)
}

fn main() -> Result<(), Box<dyn Error>> {
    let folder = std::env::args_os().nth(1).ok_or("usage: label_table path/to/Area_1")?;
    let folder = Path::new(&folder);
    let area = folder
        .file_name()
        .and_then(|name| name.to_str())
        .and_then(|name| name.strip_prefix("Area_"));
    // In labels, the halves of area 5 are one area.
    let area = area
        .map(|number| number.trim_end_matches(['a', 'b']))
        .and_then(|number| number.parse().ok());
    let area = area.ok_or("the folder must be called Area_ and a number")?;

    let mut found = Vec::new();
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let room = path
            .file_name()
            .and_then(|name| name.to_str())
            .and_then(|name| name.parse::<Room>().ok());
        if let Some(room) = room {
            let of_room = instances(&path.join("Annotations"))?;
            found.extend(of_room.into_iter().map(|(class, number)| (room, class, number)));
        }
    }

    let table = LabelTable::from_labels(number_area(area, found)?.into_iter().map(|i| i.label))?;
    println!("{}", serde_json::to_string(&table.names())?);
    Ok(())
}
