//! Measures refined labels against true ones.
//!
//! ```sh
//! cargo run --release -p s3d-dataset --example refined_labels -- 540 10          # pixels, millimetres
//! cargo run --release -p s3d-dataset --example refined_labels -- 540 10 FOLDER   # also for other programs
//! ```
//!
//! Buildings of s3d-synth give the truth. Simulated depth cameras scan each. `s3d_fusion` makes a mesh of
//! what they measured, in cells of 2 cm, and decimates it under the bound in millimetres. Scanned points
//! vote for the labels of its faces: that is what an export has. Two kinds of images are made at each place:
//! photographs of the building itself, with a pose that is off by a milliradian, and views of the scanned
//! mesh whose texture is displaced by half a centimetre. `semantic` is what the mesh projects, and
//! `semantic_refined` what [`refine`] makes of it. No parameter depends on the building. They were chosen on
//! the first three buildings; the others were not looked at.
//!
//! With FOLDER, colours, labels and truth of each image are written there:
//! `bench/refined_labels_peers.py` runs other programs on them.

#![expect(clippy::print_stdout, reason = "it prints what it measured")]

mod scores;
mod world;

use s3d_dataset::s3d_geom::Pose;
use s3d_dataset::s3d_geom::glam::vec3;
use s3d_label::refine::{NO_LABEL, refine};
use s3d_synth::{Building, BuildingOptions};
use scores::{Scores, mean_iou};
use std::path::Path;
use std::time::Instant;
use world::{Error, ScanPlan, Shot, World, scanned};

fn main() -> Result<(), Error> {
    let mut arguments = std::env::args().skip(1);
    let size: u32 = arguments.next().map_or(Ok(540), |word| word.parse())?;
    let bound_mm: f32 = arguments.next().map_or(Ok(10.0), |word| word.parse())?;
    let folder = arguments.next();
    let texture_scale = 0.6;
    let drawn = |rooms, storeys, seed| {
        let options = BuildingOptions::drawn(rooms, seed);
        Building::generate(&BuildingOptions { storeys, texture_scale, ..options })
    };
    let buildings = [
        ("demo", Building { texture_scale, ..Building::demo() }),
        ("two storeys", Building { texture_scale, ..Building::two_storeys() }),
        ("drawn 42", drawn(4, 1, 42)?),
        ("drawn 7, unseen", drawn(4, 1, 7)?),
        ("two storeys drawn 11, unseen", drawn(6, 2, 11)?),
    ];

    println!("near: wrong pixels within 8 of a true border; F: boundary F-scores at 1, 2, 4 pixels;");
    println!("trimap: mean IoU of classes within 8 pixels; worst: the smallest gain of a class's IoU;");
    println!("thin: wrong pixels of things up to 9 pixels wide; plain: near borders without an edge.");
    for (name, building) in buildings {
        let scene = building.build()?;
        let plan =
            ScanPlan { cell_m: 0.02, max_error_m: bound_mm / 1000.0, pixels: 0.3, points_per_m2: 2000.0 };
        let scan = scanned(&scene, &plan)?;
        let world = World::new(&scene, &scan);
        let class_of = |label: u32| world.class_of(label);

        let [mut photographs, mut views] = [(); 2].map(|()| Compared::default());
        for (number, pose) in poses(&scene.locations).into_iter().enumerate() {
            let photograph = world.photograph(pose, 1.1, size, 0.001);
            let view = world.textured(pose, 1.1, size, vec3(0.004, -0.003, 0.002));
            for (kind, shot, compared) in
                [("photograph", photograph, &mut photographs), ("view", view, &mut views)]
            {
                let refined = compared.add(&shot, &class_of);
                if let Some(folder) = &folder {
                    write(&shot, &refined, &Path::new(folder).join(format!("{name} {kind} {number}")))?;
                }
            }
        }
        println!("\n{name}: {} faces, {} of the scan", scene.mesh.faces().len(), scan.mesh.faces().len());
        photographs.print("photographs");
        views.print("views of the mesh");
    }
    Ok(())
}

/// Two views of each location.
fn poses(locations: &[s3d_synth::building::ScanLocation]) -> Vec<Pose> {
    let turns = (0..)
        .zip(locations)
        .flat_map(|(k, location)| [0, 1].map(|turn| (k, location, turn)));
    let pose = |(k, location, turn): (u32, &s3d_synth::building::ScanLocation, u32)| {
        let yaw_rad = location.yaw_rad + 0.7 + f64::from(k) + 3.0 * f64::from(turn);
        Pose::level(location.position, yaw_rad).turned(0.0, -0.2)
    };
    turns.map(pose).collect()
}

/// Scores of images before and after.
#[derive(Default)]
struct Compared {
    before: Scores,
    after: Scores,
    images: u32,
    seconds: f64,
}

impl Compared {
    fn add(&mut self, shot: &Shot, class_of: &dyn Fn(u32) -> Option<u32>) -> Vec<u32> {
        let start = Instant::now();
        let refined = refine(&shot.input());
        self.seconds += start.elapsed().as_secs_f64();
        self.images += 1;
        let width = shot.width as usize;
        self.before
            .add(width, &shot.labels, &shot.truth, &shot.colors, class_of);
        self.after
            .add(width, &refined.labels, &shot.truth, &shot.colors, class_of);
        refined.labels
    }

    fn print(&self, name: &str) {
        let Self { before, after, .. } = self;
        let gone = 100.0 - 100.0 * after.near.wrong as f64 / before.near.wrong as f64;
        println!("  {name}: {gone:.0} % of the wrong pixels near borders gone");
        for (word, scores) in [("semantic", before), ("refined", after)] {
            println!(
                "    {word:8} near {:5.2} %  F {:.3?}  trimap {:.4}  mIoU {:.4}  thin {:5.2} %  \
                 plain {:5.2} %",
                scores.near.percent(),
                scores.f_scores(),
                mean_iou(&scores.trimap),
                mean_iou(&scores.classes),
                scores.thin.percent(),
                scores.plain.percent()
            );
        }
        let worst = after.worst_gain(before);
        let ms = 1e3 * self.seconds / f64::from(self.images);
        println!("    worst {worst:+.2} %, {ms:.0} ms an image");
    }
}

/// Writes an image for other programs: the width as 32 bits, then for all pixels the labels, the truth and
/// the refined labels, 32 bits each, and the colours, 3 bytes. [`NO_LABEL`] is what is not known.
fn write(shot: &Shot, refined: &[u32], path: &Path) -> Result<(), Error> {
    assert_eq!(NO_LABEL, u32::MAX);
    let mut bytes = shot.width.to_le_bytes().to_vec();
    for labels in [&shot.labels[..], &shot.truth, refined] {
        bytes.extend(labels.iter().flat_map(|label| label.to_le_bytes()));
    }
    bytes.extend(shot.colors.as_flattened());
    Ok(std::fs::write(path.with_extension("labels"), bytes)?)
}
