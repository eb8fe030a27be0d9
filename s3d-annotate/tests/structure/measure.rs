//! How well structure found fits what is true.

use super::scans::{ScanGrid, scanned};
use s3d_annotate::labelling::Room;
use s3d_annotate::structure::{Structure, find_structure};
use s3d_geom::Polygon;
use s3d_geom::glam::{DVec2, dvec2};
use s3d_label::Class;
use s3d_synth::{AnnotatedScene, Building};
use std::collections::BTreeMap;

/// What may lie in the plane of a wall, to be cut out.
const IN_WALLS: [Class; 5] = [Class::BOARD, Class::DOOR, Class::WINDOW, Class::BEAM, Class::COLUMN];

/// The three classes of structure, with the word for each.
const STRUCTURE: [(Class, &str); 3] =
    [(Class::FLOOR, "floor"), (Class::CEILING, "ceiling"), (Class::WALL, "wall")];

/// The fit of what was found. Areas count.
#[derive(Debug)]
#[expect(dead_code, reason = "some are only printed")]
pub(super) struct Measured {
    title: String,
    faces: usize,
    /// The share of each class that is proposed as it.
    recall: BTreeMap<&'static str, f64>,
    /// The share of the proposals of each class that is of it, or lies in a wall.
    precision: BTreeMap<&'static str, f64>,
    /// The mean and the least IoU of instances of structure with the surface that fits best.
    instances: [f64; 2],
    /// Surfaces more than instances.
    surplus: i64,
    /// Rooms found and true.
    rooms: [usize; 2],
    /// The least IoU of a true room with the room that fits best.
    room_iou: f64,
    /// Instances and rooms that nothing fits well.
    bad: Vec<String>,
}

impl Measured {
    pub(super) fn of(building: &Building) -> Self {
        Self::of_scene(building, &building.build().unwrap(), 0.0)
    }

    /// The fit of what is found in a scan of the building that was turned about Z before.
    pub(super) fn of_scan(building: &Building, grid: ScanGrid) -> Self {
        Self::of_scene(building, &scanned(&building.build().unwrap(), grid), grid.degrees)
    }

    fn of_scene(building: &Building, scene: &AnnotatedScene, degrees: f32) -> Self {
        let mut found = find_structure(&scene.mesh);
        let back = DVec2::from_angle(-f64::from(degrees).to_radians());
        let parts = found.rooms.iter_mut().flat_map(|room| &mut room.parts);
        for corner in parts.flat_map(|part| &mut part.outline) {
            *corner = back.rotate(DVec2::from(*corner)).to_array();
        }
        let (recall, precision) = shares(scene, &found);
        let fits = instance_fits(scene, &found);
        let room_fits = room_fits(building, &found.rooms);
        let bad = fits.iter().chain(&room_fits).filter(|fit| fit.0 < 0.9);
        let bad = bad.map(|(iou, name)| format!("{iou:.2} {name}")).collect();
        let least = |fits: &[(f64, String)]| fits.iter().map(|fit| fit.0).fold(1.0, f64::min);
        Self {
            title: scene.title.clone(),
            faces: scene.mesh.faces().len(),
            recall,
            precision,
            instances: [fits.iter().map(|fit| fit.0).sum::<f64>() / fits.len() as f64, least(&fits)],
            surplus: found.surfaces.len() as i64 - fits.len() as i64,
            rooms: [found.rooms.len(), building.rooms.len()],
            room_iou: least(&room_fits),
            bad,
        }
    }

    /// Prints the fit, and checks that it is about as good as it was.
    #[expect(clippy::print_stdout, reason = "figures to look at with --nocapture")]
    pub(super) fn check(&self) {
        println!("{self:#?}");
        assert!(self.recall.values().all(|share| *share >= 0.98), "{self:#?}");
        assert!(self.precision.values().all(|share| *share >= 0.985), "{self:#?}");
        assert!(self.instances[0] >= 0.99 && self.instances[1] >= 0.75, "{self:#?}");
        assert_eq!(self.rooms[0], self.rooms[1], "{self:#?}");
        assert!(self.room_iou >= 0.95, "{self:#?}");
        // Wide columns and sofas with high backs.
        assert!(self.surplus <= self.rooms[1] as i64 / 2, "{self:#?}");
    }

    /// Prints the fit of a scan, and checks that it is about as good as it was. Where planes lie on the grid
    /// of the scan, noise turns many of their faces.
    #[expect(clippy::print_stdout, reason = "figures to look at with --nocapture")]
    pub(super) fn check_scan(&self) {
        println!("{self:#?}");
        assert!(self.recall.values().all(|share| *share >= 0.77), "{self:#?}");
        assert!(self.precision.values().all(|share| *share >= 0.85), "{self:#?}");
        assert!(self.instances[0] >= 0.82 && self.instances[1] >= 0.6, "{self:#?}");
        assert_eq!(self.rooms[0], self.rooms[1], "{self:#?}");
        assert!(self.room_iou >= 0.98, "{self:#?}");
        assert!(self.surplus <= 1, "{self:#?}");
    }
}

type Shares = BTreeMap<&'static str, f64>;

fn shares(scene: &AnnotatedScene, found: &Structure) -> (Shares, Shares) {
    let class_of = |face: u32| scene.instances[scene.instance_of_face[face as usize] as usize].class;
    let [mut whole, mut right, mut proposed, mut fit] = [const { Shares::new() }; 4];
    for face in 0..scene.mesh.faces().len() as u32 {
        if let Some((_, word)) = STRUCTURE.iter().find(|(class, _)| *class == class_of(face)) {
            *whole.entry(*word).or_default() += scene.mesh.area(face);
        }
    }
    for surface in &found.surfaces {
        for face in surface.faces.iter() {
            let class = class_of(face);
            let is_class = STRUCTURE.contains(&(class, surface.class));
            let is_fit = is_class || (surface.class == "wall" && IN_WALLS.contains(&class));
            *right.entry(surface.class).or_default() += if is_class { scene.mesh.area(face) } else { 0.0 };
            *proposed.entry(surface.class).or_default() += scene.mesh.area(face);
            *fit.entry(surface.class).or_default() += if is_fit { scene.mesh.area(face) } else { 0.0 };
        }
    }
    let ratio = |part: &Shares, all: &Shares| {
        all.iter()
            .map(|(word, area)| (*word, part.get(word).copied().unwrap_or(0.0) / area))
            .collect()
    };
    (ratio(&right, &whole), ratio(&fit, &proposed))
}

/// The best IoU of each instance of structure with a surface, without what lies in walls.
fn instance_fits(scene: &AnnotatedScene, found: &Structure) -> Vec<(f64, String)> {
    let mut size = vec![0.0; scene.instances.len()];
    for (face, instance) in (0u32..).zip(&scene.instance_of_face) {
        size[*instance as usize] += scene.mesh.area(face);
    }
    let mut best = vec![0f64; size.len()];
    for surface in &found.surfaces {
        let mut shared: BTreeMap<u32, f64> = BTreeMap::new();
        let mut whole = 0.0;
        for face in surface.faces.iter() {
            let instance = scene.instance_of_face[face as usize];
            let class = scene.instances[instance as usize].class;
            if !IN_WALLS.contains(&class) {
                *shared.entry(instance).or_default() += scene.mesh.area(face);
                whole += scene.mesh.area(face);
            }
        }
        for (instance, both) in shared {
            if STRUCTURE.contains(&(scene.instances[instance as usize].class, surface.class)) {
                let iou = both / (whole + size[instance as usize] - both);
                best[instance as usize] = best[instance as usize].max(iou);
            }
        }
    }
    let of = |place: usize| {
        let instance = &scene.instances[place];
        let is_structure = STRUCTURE.iter().any(|(class, _)| *class == instance.class);
        let name =
            format!("{:?}_{} in {} {:.2} m²", instance.class, instance.number, instance.room, size[place]);
        is_structure.then_some((best[place], name))
    };
    (0..size.len()).filter_map(of).collect()
}

/// The best IoU of each true room, as seen from above.
fn room_fits(building: &Building, rooms: &[Room]) -> Vec<(f64, String)> {
    let origin = building.origin.as_dvec3();
    let fit = |room: &s3d_synth::building::RoomPlan| {
        let [low, high] = [room.low, room.high].map(|corner| corner.as_dvec2() + origin.truncate());
        let body_m = origin.z + f64::from(room.floor_m) + 1.0;
        let truth =
            Polygon { outer: vec![low, dvec2(high.x, low.y), high, dvec2(low.x, high.y)], holes: vec![] };
        let best = rooms.iter().map(|found| {
            let parts: Vec<Polygon> = found
                .parts
                .iter()
                .filter(|part| part.heights[0] < body_m && part.heights[1] > body_m)
                .map(|part| Polygon {
                    outer: part.outline.iter().copied().map(DVec2::from).collect(),
                    holes: vec![],
                })
                .collect();
            let [mut both, mut either] = [0.0; 2];
            let corners = parts.iter().flat_map(|part| part.outer.iter().copied());
            let (mut min, mut max) = (low, high);
            corners.for_each(|corner| (min, max) = (min.min(corner), max.max(corner)));
            let step = 0.05;
            let mut y = min.y + 0.5 * step;
            while y < max.y {
                let mut x = min.x + 0.5 * step;
                while x < max.x {
                    let place = dvec2(x, y);
                    let is_found = parts.iter().any(|part| part.contains(place));
                    let is_true = truth.contains(place);
                    both += f64::from(is_found && is_true);
                    either += f64::from(is_found || is_true);
                    x += step;
                }
                y += step;
            }
            both / either
        });
        (best.fold(0.0, f64::max), room.room.to_string())
    };
    building.rooms.iter().map(fit).collect()
}
