//! The labels of a mesh while they are made.

mod carried;
mod folders;
mod folds;
mod kills;
mod rooms;

use s3d_annotate::labelling::{Action, Event, FaceRuns, Fault, State};
use s3d_geom::TriMesh;
use s3d_geom::glam::vec3;
use std::path::Path;

/// A strip of `n` squares of 1 m along x, at height `z`, two faces each, cut into `m` parts along y.
fn strip(n: u32, m: u32, z: f32) -> TriMesh {
    let rows = m + 1;
    let positions = (0..=n).flat_map(|i| (0..rows).map(move |j| vec3(i as f32, j as f32 / m as f32, z)));
    let faces = (0..n).flat_map(|i| {
        (0..m).flat_map(move |j| {
            let at = |i: u32, j: u32| i * rows + j;
            [[at(i, j), at(i + 1, j), at(i, j + 1)], [at(i, j + 1), at(i + 1, j), at(i + 1, j + 1)]]
        })
    });
    TriMesh::from_faces(positions.collect(), faces.collect()).unwrap()
}

fn faces(faces: &[u32]) -> FaceRuns {
    faces.iter().copied().collect()
}

fn paint(of: &[u32], instance: u32, class: &str) -> Action {
    Action::Paint { faces: faces(of), instance, class: Some(class.into()) }
}

/// Applies an action as the next event.
fn act(state: &mut State, action: Action) -> Result<(), Fault> {
    state.apply(Event { version: 1, number: state.revision() + 1, at_ms: None, action })
}

/// A folder in memory, if there is one: tests that sync each event would mostly wait for the disk.
fn fast_folder() -> tempfile::TempDir {
    let memory = Path::new("/dev/shm");
    let made = if memory.is_dir() {
        tempfile::tempdir_in(memory)
    } else {
        tempfile::tempdir()
    };
    made.unwrap()
}

/// What two states must have in common to be the same labels.
fn labels(state: &State) -> impl PartialEq + std::fmt::Debug + use<> {
    (
        state.instance_of_face().to_vec(),
        state.painted_room_of_face().to_vec(),
        state.instances().clone(),
        state.rooms().clone(),
        state.unlabelled(),
        state
            .classes()
            .into_iter()
            .map(|(c, t)| (c.to_owned(), t))
            .collect::<Vec<_>>(),
    )
}
