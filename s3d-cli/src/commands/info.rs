//! `s3d info`: what a scene holds, and what looks wrong in it.

use super::{on_threads, print};
use crate::args::InfoArgs;
use crate::failure::Outcome;
use crate::pipeline::annotate::{Annotated, annotate, hidden_instances, label_doubts};
use crate::pipeline::inputs::{Inputs, mesh_doubts};
use crate::pipeline::locate;
use crate::pipeline::location::Outlook;
use crate::pipeline::overlap::overlap_doubts;
use crate::pipeline::pictures::Pictures;
use s3d_geom::{NearestFaces, TriMesh};
use s3d_label::Class;
use s3d_render::Scene;
use std::collections::BTreeMap;
use std::fmt::Write as _;

pub(crate) fn run(args: InfoArgs) -> Outcome<()> {
    let text = on_threads(args.threads, || report(&args))?;
    print(&text)
}

fn report(args: &InfoArgs) -> Outcome<String> {
    let inputs = Inputs::open(std::slice::from_ref(&args.scene), args.place_cameras, args.lenient)?;
    let area = &inputs.areas[0];
    let file = area.read_mesh()?;
    let mut wrong: Vec<String> = area.warnings.iter().chain(&file.warnings).cloned().collect();
    let mesh = &file.mesh;
    let nearest = NearestFaces::new(mesh);
    let annotated = annotate(area, &nearest, &inputs.table, |_| Ok(()))?;
    let scene = Scene::new(mesh);

    let mut text = String::new();
    let _ = writeln!(text, "area {}\n", area.number);
    tell_mesh(&mut text, mesh);
    tell_annotations(&mut text, &annotated, &inputs);
    match Pictures::open(area, |_| true) {
        Ok(None) => {}
        Ok(Some(pictures)) => {
            let _ = writeln!(text, "\ncolours: {}", pictures.summary());
            wrong.extend(pictures.warnings);
        }
        Err(e) => wrong.push(e.to_string()),
    }

    let located = locate(area, &scene, &nearest, &annotated, &inputs.table, args.seed)?;
    let _ = writeln!(text, "\nscan locations: {}", located.len());
    for (location, room) in &located {
        let outlook = Outlook::of(&scene, location);
        let at = location.pose.location;
        let _ = writeln!(
            text,
            "  {}  ({:.2}, {:.2}, {:.2})  {}  sees the mesh in {:.0} %, the nearest of it at {:.2} m",
            location.uuid,
            at.x,
            at.y,
            at.z,
            room,
            100.0 * outlook.coverage,
            outlook.nearest_m
        );
        wrong.extend(outlook.warnings(location));
    }

    wrong.extend(annotated.skipped.sentence());
    wrong.extend(mesh_doubts(mesh));
    wrong.extend(label_doubts(&annotated.report));
    wrong.extend(overlap_doubts(&annotated.rooms));
    wrong.extend(hidden_instances(area, &annotated.face_labels, &inputs.table));
    let _ =
        writeln!(text, "\n{}", if wrong.is_empty() { "nothing looks wrong" } else { "what looks wrong:" });
    for w in wrong {
        let _ = writeln!(text, "  {w}");
    }
    Ok(text)
}

fn tell_mesh(text: &mut String, mesh: &TriMesh) {
    let b = mesh.aabb();
    let _ = writeln!(
        text,
        "mesh: {} faces, {} vertices, {} materials, {} textures, {:.1} m²",
        mesh.faces().len(),
        mesh.positions().len(),
        mesh.materials().len(),
        mesh.textures().len(),
        mesh.total_area()
    );
    let s = b.size();
    let _ = writeln!(
        text,
        "  {:.2} × {:.2} × {:.2} m, from ({:.2}, {:.2}, {:.2}) to ({:.2}, {:.2}, {:.2}), Z-up",
        s.x, s.y, s.z, b.min.x, b.min.y, b.min.z, b.max.x, b.max.y, b.max.z
    );
    for texture in mesh.textures() {
        let _ = writeln!(text, "  {} {} × {}", texture.name, texture.image.width(), texture.image.height());
    }
}

fn tell_annotations(text: &mut String, annotated: &Annotated, inputs: &Inputs) {
    let area = &inputs.areas[0];
    let _ = writeln!(text, "\nannotations: {} points, {} rooms", annotated.points, annotated.rooms.len());
    for (surveyed, room) in annotated.rooms.iter().zip(&area.rooms) {
        let mut classes: BTreeMap<Class, u32> = BTreeMap::new();
        room.instances.iter().for_each(|i| *classes.entry(i.label.class).or_default() += 1);
        let classes: Vec<String> = classes.iter().map(|(c, n)| format!("{n} {c}")).collect();
        let _ = writeln!(
            text,
            "  {}: {} points, {:.1} m² of floor, walls along {}°: {}",
            surveyed.room,
            surveyed.points,
            surveyed.footprint.area_m2,
            surveyed.wall_direction_deg,
            classes.join(", ")
        );
    }
    let total = &annotated.report.total;
    let _ = writeln!(
        text,
        "  {} of {} faces get a label, {} of them contested; {} points are farther than 5 cm from every face",
        total.faces, annotated.report.face_count, total.contested, total.far_points
    );
}
