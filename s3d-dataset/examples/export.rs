//! A whole export with its progress: `cargo run --release -p s3d-dataset --example export SCENE.toml OUT`.

#![allow(clippy::print_stdout, clippy::print_stderr)]

use s3d_dataset::{Context, Event, Export};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let mut args = std::env::args().skip(1);
    let (Some(scene), Some(out)) = (args.next(), args.next()) else {
        return Err("give a scene file and a folder".into());
    };
    let context = Context::default().observed_by(|event: &Event<'_>| match event {
        Event::Message { text, .. } => eprintln!("{text}"),
        Event::TaskAdvanced { task, done } => eprint!("{} {done}/{} {}\r", task.what, task.total, task.unit),
        _ => {}
    });
    match Export::new([scene]).run(&out, &context)? {
        Some(made) => println!("{out}: {} files, {} views", made.tally.files, made.tally.views.images),
        None => println!("{out} was complete already"),
    }
    Ok(())
}
