//! Prints the instances of each class and the rooms of each type, by area, from the label table of a data
//! set.
//!
//! `cargo run --example label_statistics -- path/to/semantic_labels.json`
#![allow(clippy::print_stdout)] // It is a program.

use s3d_label::{Class, ClassCounts, LabelTable, RoomCounts, RoomType};
use std::error::Error;

fn print_table<const N: usize>(names: [&str; N], areas: &[(u32, Vec<u64>)], total: Vec<u64>) {
    let heads = areas.iter().map(|(area, _)| format!("area {area}"));
    println!("{:14}{}", "", heads.map(|head| format!("{head:>8}")).collect::<String>() + "   total");
    for (i, name) in names.iter().enumerate() {
        let cells: String = areas.iter().map(|(_, counts)| format!("{:8}", counts[i])).collect();
        println!("{name:14}{cells}{:8}", total[i]);
    }
    let sums: String = areas
        .iter()
        .map(|(_, counts)| format!("{:8}", counts.iter().sum::<u64>()))
        .collect();
    println!("{:14}{sums}{:8}\n", "total", total.iter().sum::<u64>());
}

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args_os()
        .nth(1)
        .ok_or("usage: label_statistics path/to/semantic_labels.json")?;
    let names: Vec<String> = serde_json::from_str(&std::fs::read_to_string(path)?)?;
    let table = LabelTable::from_names(&names)?;
    let classes = ClassCounts::from_table(&table);
    let rooms = RoomCounts::from_table(&table);
    print_table(Class::S3DIS.map(Class::name), &classes.areas, classes.total());
    print_table(RoomType::S3DIS.map(RoomType::name), &rooms.areas, rooms.total());
    Ok(())
}
