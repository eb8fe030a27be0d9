//! Scores and selects views. Each line of the standard input is `area,location,view` and 13 counts of pixels,
//! one for each class. The program prints the line with the entropy of the counts, and 1 if the view stays or
//! 0 if it goes.
//!
//! `cargo run --example select_views -- dataset|area|location [SEED] < counts.csv`
#![allow(clippy::print_stdout)] // It is a program.

use s3d_sample::{Pool, PoolItem, Selection, entropy, select_pooled};
use std::error::Error;
use std::io::Read;

fn item(line: &str) -> Result<PoolItem<'_>, Box<dyn Error>> {
    let words: Vec<&str> = line.split(',').map(str::trim).collect();
    let [area, location, view, counts @ ..] = words.as_slice() else {
        return Err("expected area,location,view and 13 counts".into());
    };
    let counts = counts
        .iter()
        .map(|count| count.parse())
        .collect::<Result<Vec<u64>, _>>()?;
    let histogram: [u64; 13] = counts
        .try_into()
        .map_err(|counts: Vec<u64>| format!("{} counts instead of 13", counts.len()))?;
    Ok(PoolItem { area: area.parse()?, location, view: view.parse()?, score: entropy(&histogram) })
}

fn main() -> Result<(), Box<dyn Error>> {
    let mut args = std::env::args().skip(1);
    let pool: Pool = args
        .next()
        .ok_or("usage: select_views dataset|area|location [SEED] < counts.csv")?
        .parse()?;
    let seed = args.next().map_or(Ok(0), |word| word.parse())?;

    let mut text = String::new();
    std::io::stdin().read_to_string(&mut text)?;
    let mut items = Vec::new();
    for (i, line) in text.lines().enumerate() {
        items.push(item(line).map_err(|error| format!("line {}: {error}", i + 1))?);
    }
    let stays = select_pooled(&items, pool, &Selection::default(), seed);
    for (line, (item, stays)) in text.lines().zip(items.iter().zip(stays)) {
        println!("{line},{:.6},{}", item.score, u8::from(stays));
    }
    Ok(())
}
