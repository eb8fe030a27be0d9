//! Masks hide parts of photographs.

use super::first_of;
use super::studio::*;
use s3d_geom::Raster;
use s3d_io::image::read_rgb8;
use serde_json::json;

/// A mask that hides the columns left of `from`.
fn mask(from: u32) -> Raster<[u8; 3]> {
    let [w, h] = SIZE;
    let pixel = |i: u32| if i % w < from { [0; 3] } else { [255; 3] };
    Raster::from_vec(w, h, (0..w * h).map(pixel).collect())
}

/// The first and the last column of the view that show something in the middle row.
fn shown(view: &Raster<[u8; 3]>) -> (u32, u32) {
    let y = view.height() / 2;
    let columns: Vec<u32> = (0..view.width()).filter(|x| view.at(*x, y) != [0; 3]).collect();
    (columns[0], *columns.last().unwrap())
}

#[test]
fn what_a_mask_hides_is_black_and_counts_as_masked() {
    let project = Project::with_photographs(&format!("{LISTED}masks = \"masks\"\n"));
    (0..3).for_each(|i| write(&project.at(&format!("masks/{i}.png")), &mask(160)));
    let (out, log) = project.export("out", &[]);
    let whole = "1 of 4 photographs have no mask and are shown whole";
    assert!(log.contains(whole) && log.contains("3 photographs have masks"), "{log}");

    let records = photographs(&out);
    // The principal point is at 163 of 320 columns, so the middle of the view is hardly bent.
    let (first, last) = shown(&read_rgb8(&first_of(&out, "images/0.png")).unwrap());
    assert!(first.abs_diff(160) <= 2 && last > 300, "{first} {last}");
    assert!((0.45..0.6).contains(&records[0].masked), "{records:?}");
    let (first, _) = shown(&read_rgb8(&first_of(&out, "images/3.png")).unwrap());
    assert!(first < 20 && records[3].masked < 0.2, "{records:?}");

    // The list may name them itself.
    let listed = Project::with_photographs(LISTED);
    let mut list = transforms(&poses());
    for i in 0..4 {
        list["frames"][i]["mask_path"] = json!(format!("hidden/{i}.png"));
        write(&listed.at(&format!("hidden/{i}.png")), &mask(80));
    }
    listed.write("transforms.json", &list.to_string());
    let (out, log) = listed.export("out", &[]);
    assert!(log.contains("4 photographs have masks") && !log.contains("shown whole"), "{log}");
    let (first, _) = shown(&read_rgb8(&first_of(&out, "images/3.png")).unwrap());
    assert!((75..100).contains(&first), "{first}");

    // A mask of another size is refused before anything is written.
    write(&listed.at("hidden/2.png"), &Raster::filled(8, 8, [255; 3]));
    std::fs::remove_dir_all(&out).unwrap();
    listed.fails(&["hidden/2.png: masks a picture of 8 × 8 pixels, and the photograph has 320 × 240"]);
}
