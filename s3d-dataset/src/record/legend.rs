//! The legend of `semantic_class` images: a table for programs, and a picture of names and colours.

use crate::error::Result;
use font8x8::legacy::BASIC_LEGACY;
use s3d_geom::Raster;
use s3d_io::dataset::Layout;
use s3d_io::fs::write_bytes;
use s3d_io::image::{Compression, Content, encode_rgb8};
use s3d_label::Taxonomy;
use std::fmt::Write as _;

/// The side of a dot of a letter, pixels.
const DOT: usize = 2;
/// The height of a line, pixels.
const LINE: usize = 22;
/// The side of a colour square, pixels.
const SQUARE: usize = 18;

/// Writes `assets/class_legend.csv` and `assets/class_legend.png`.
pub(crate) fn write(layout: &Layout, taxonomy: &Taxonomy) -> Result<()> {
    write_bytes(&layout.class_legend_csv(), csv(taxonomy).as_bytes())?;
    let png = encode_rgb8(&picture(taxonomy), Content::Labels, Compression::Balanced);
    write_bytes(&layout.class_legend_png(), &png)?;
    Ok(())
}

/// Returns a line for each class: the value of its pixels, its id, name and colour, whether it is a thing or
/// stuff, and the S3DIS class that it counts as.
fn csv(taxonomy: &Taxonomy) -> String {
    let mut text = String::from("index,id,name,red,green,blue,kind,counts_as\n");
    for class in taxonomy.classes() {
        let [r, g, b] = taxonomy.color(*class);
        let id = taxonomy.id(*class);
        let kind = if taxonomy.is_stuff(*class) { "stuff" } else { "thing" };
        let _ = writeln!(text, "{},{id},{class},{r},{g},{b},{kind},{}", class.index(), class.s3dis());
    }
    text
}

/// Draws a line for each class: its colour, its index and its name.
fn picture(taxonomy: &Taxonomy) -> Raster<[u8; 3]> {
    let lines: Vec<String> = taxonomy
        .classes()
        .iter()
        .map(|class| format!("{:3} {}", class.index(), class.name()))
        .collect();
    let longest = lines.iter().map(String::len).max().unwrap_or(0);
    let width = LINE + 8 * DOT * (longest + 1);

    let mut pixels = vec![[255; 3]; width * LINE * lines.len()];

    for ((line, class), rows) in lines
        .iter()
        .zip(taxonomy.classes())
        .zip(pixels.chunks_mut(width * LINE))
    {
        let margin = (LINE - SQUARE) / 2;
        for row in rows.chunks_mut(width).skip(margin).take(SQUARE) {
            row[margin..margin + SQUARE].fill(taxonomy.color(*class));
        }

        for (column, letter) in line.bytes().enumerate() {
            // The glyph has a byte for each row, the lowest bit first.
            let glyph = BASIC_LEGACY.get(usize::from(letter)).copied().unwrap_or_default();
            for (y, bits) in glyph.iter().enumerate() {
                for x in (0..8).filter(|x| bits >> x & 1 == 1) {
                    let left = LINE + 8 * DOT * column + DOT * x;
                    let top = (LINE - 8 * DOT) / 2 + DOT * y;
                    for row in rows.chunks_mut(width).skip(top).take(DOT) {
                        row[left..left + DOT].fill([0; 3]);
                    }
                }
            }
        }
    }

    Raster::from_vec(width as u32, (LINE * lines.len()) as u32, pixels)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Returns the pixels of a line beside its colour.
    fn name_at(picture: &Raster<[u8; 3]>, line: u32) -> Vec<[u8; 3]> {
        (line * LINE as u32..(line + 1) * LINE as u32)
            .flat_map(|y| picture.row(y)[LINE..].to_vec())
            .collect()
    }

    #[test]
    fn a_line_a_class() {
        let taxonomy = Taxonomy::built_in("scannet20").unwrap();
        let text = csv(&taxonomy);
        let lines: Vec<&str> = text.lines().collect();
        assert_eq!((lines.len(), lines[1]), (21, "0,1,wall,174,199,232,stuff,wall"));
        assert_eq!(lines[16], "15,28,showerCurtain,158,218,229,thing,clutter");
        let picture = picture(&taxonomy);
        assert_eq!(picture.height(), 20 * LINE as u32);
        assert_eq!(picture.at(10, 10), [174, 199, 232]);
        // The names differ, and lie within the picture.
        let names: Vec<Vec<[u8; 3]>> = (0..20).map(|line| name_at(&picture, line)).collect();
        for name in &names {
            assert!(name.iter().filter(|p| **p == [0; 3]).count() > 100);
        }
        assert!(names.windows(2).all(|pair| pair[0] != pair[1]));
    }
}
