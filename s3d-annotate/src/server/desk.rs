//! What the server answers with: library calls on one scene. No request is known here.

use super::answers::{InstanceOf, RoomOf, StateOf};
use crate::labelling::{Error, FaceRuns, State};
use crate::outputs::{OutputFormat, OutputOptions, write_output};
use crate::proposals;
use crate::review::{Review, Surroundings};
use crate::structure::find_structure;
use crate::workbench::{Change, Gesture, Knife, Patch, Proposal, Proposals, Workbench};
use rayon::prelude::*;
use s3d_dataset::{BareScene, Context, Result as DatasetResult};
use s3d_geom::{Camera, TriMesh};
use s3d_render::{NO_FACE, Scene, cast};
use std::path::PathBuf;
use std::sync::{Arc, Mutex, MutexGuard, OnceLock, PoisonError};
use std::time::{Duration, Instant, SystemTime};

/// The width of the panoramas whose pixels are counted.
const PANORAMA_PX: u32 = 1024;

/// Labels are written when nobody has changed them for so long.
const REST: Duration = Duration::from_secs(10);

/// A scene on the desk, with its labels, and what is found out about it while the person works already.
pub(super) struct Desk {
    pub(super) scene: BareScene,
    pub(super) name: String,
    pub(super) warnings: Vec<String>,
    total_m2: f64,
    bench: Mutex<Workbench>,
    surroundings: OnceLock<Surroundings>,
    is_structure_found: OnceLock<()>,
    /// The pixels of each face in the planned panoramas.
    pixels: OnceLock<Vec<u32>>,
    /// When the labels were changed last, if they were not written since.
    changed: Mutex<Option<Instant>>,
    ctx: Context,
}

impl Desk {
    pub(super) fn new(scene: BareScene, bench: Workbench, name: String, ctx: &Context) -> Self {
        Self {
            total_m2: scene.mesh().total_area(),
            scene,
            name,
            warnings: bench.labels().warnings().to_vec(),
            bench: Mutex::new(bench),
            surroundings: OnceLock::new(),
            is_structure_found: OnceLock::new(),
            pixels: OnceLock::new(),
            changed: Mutex::default(),
            ctx: ctx.clone(),
        }
    }

    pub(super) fn mesh(&self) -> &Arc<TriMesh> {
        self.scene.mesh()
    }

    /// The workbench. A gesture that has panicked has changed nothing.
    pub(super) fn bench(&self) -> MutexGuard<'_, Workbench> {
        self.bench.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Finds what takes a while: structure, surroundings, the pixels of the planned views. `given` are
    /// proposals of others.
    pub(super) fn look_around(&self, given: Vec<proposals::Proposal>) {
        let structure = find_structure(self.mesh());
        let of_structure = structure.surfaces.into_iter().map(|surface| Proposal {
            class: surface.class.to_owned(),
            faces: surface.faces,
            room: surface.room.map(|room| room as u32),
            source: "structure".to_owned(),
        });
        let of_others = given.into_iter().map(|proposal| Proposal {
            class: proposal.class,
            faces: proposal.faces,
            room: None,
            source: proposal.source,
        });
        let mut bench = self.bench();
        // A taxonomy without walls has none to propose.
        let known = |proposal: &Proposal| bench.labels().taxonomy().class(&proposal.class).is_ok();
        let surfaces = of_structure.chain(of_others).filter(known).collect();
        bench.propose(Proposals { surfaces, rooms: structure.rooms });
        drop(bench);
        let _ = self.is_structure_found.set(());

        self.surroundings();
        if self.ctx.cancel.is_cancelled() {
            return;
        }
        match self.count_pixels() {
            Ok(pixels) => drop(self.pixels.set(pixels)),
            Err(e) => self
                .ctx
                .warn(format!("pixels of the planned views are not counted: {e}")),
        }
    }

    /// Returns whether the structure of the scene is known.
    pub(super) fn is_structure_found(&self) -> bool {
        self.is_structure_found.get().is_some()
    }

    /// Counts the pixels of each face in the panoramas that an export would take.
    fn count_pixels(&self) -> DatasetResult<Vec<u32>> {
        let locations = self.scene.locations(&self.ctx)?;
        let scene = Scene::new(self.mesh());
        let mut pixels = vec![0u32; self.mesh().faces().len()];
        for location in &locations {
            self.ctx.check()?;
            let hits = cast(&scene, &Camera::equirectangular(location.pose, PANORAMA_PX));
            for face in hits.face.pixels().iter().filter(|face| **face != NO_FACE) {
                pixels[*face as usize] += 1;
            }
        }
        Ok(pixels)
    }

    fn surroundings(&self) -> &Surroundings {
        self.surroundings.get_or_init(|| {
            let bench = self.bench();
            let (segments, index) = (Arc::clone(bench.segments()), Arc::clone(bench.face_index()));
            drop(bench);
            Surroundings::new(self.mesh(), &segments, index)
        })
    }

    /// Looks at the labels as they are.
    pub(super) fn review<T>(&self, look: impl FnOnce(&Review<'_>) -> T) -> T {
        let surroundings = self.surroundings();
        let bench = self.bench();
        look(&Review {
            mesh: bench.mesh(),
            segments: bench.segments(),
            surroundings,
            state: bench.labels().state(),
        })
    }

    /// Does what a gesture says: see [`Workbench::perform`]. Returns what has changed, and the labels then.
    pub(super) fn perform(&self, revision: u64, gesture: &Gesture) -> Result<(Change, StateOf), Error> {
        let since_1970 = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
        let at_ms = since_1970.ok().map(|time| time.as_millis() as u64);
        let mut bench = self.bench();
        let change = bench.perform(revision, gesture, at_ms)?;
        let state = self.state_of(&bench);
        *self.changed() = Some(Instant::now());
        Ok((change, state))
    }

    /// Returns the faces that a cut would take: see [`Workbench::cut`].
    pub(super) fn cut(&self, at: Patch, by: &Knife) -> Result<FaceRuns, Error> {
        Ok(self.bench().cut(at, by)?)
    }

    pub(super) fn state(&self) -> StateOf {
        self.state_of(&self.bench())
    }

    fn state_of(&self, bench: &Workbench) -> StateOf {
        let state = bench.labels().state();
        let names = state.instance_names();
        let instances = state.instances().iter().map(|(&number, class)| {
            let (faces, area_m2) = state.size_of(number);
            InstanceOf { number, name: names.get(&number).cloned(), class: class.clone(), faces, area_m2 }
        });
        let room_names = state.room_names();
        let rooms = state.rooms().iter().map(|(&number, is)| RoomOf {
            number,
            name: room_names.get(&number).cloned(),
            is: is.clone(),
        });
        let (_, unlabelled_m2) = state.unlabelled();
        let (labelled_pixels, total_pixels) = self.pixels_of(state);
        StateOf {
            revision: state.revision(),
            instances: instances.collect(),
            rooms: rooms.collect(),
            labelled_m2: (self.total_m2 - unlabelled_m2).max(0.0),
            total_m2: self.total_m2,
            labelled_pixels,
            total_pixels,
            can_undo: state.next_undo().is_some(),
            can_redo: state.next_redo().is_some(),
            is_structure_found: self.is_structure_found(),
        }
    }

    /// The pixels of the planned views with a label, and all that see the mesh; 0 until they are counted.
    fn pixels_of(&self, state: &State) -> (u64, u64) {
        let Some(pixels) = self.pixels.get() else { return (0, 0) };
        let of_faces = pixels.par_iter().zip(state.instance_of_face());
        of_faces
            .map(|(&pixels, &instance)| (u64::from(pixels) * u64::from(instance != 0), u64::from(pixels)))
            .reduce(|| (0, 0), |a, b| (a.0 + b.0, a.1 + b.1))
    }

    /// Writes `labels.npz` and `rooms.json` if the labels were changed and are at rest, or at once.
    ///
    /// # Errors
    /// Those of [`LabelFolder::write_labels`](crate::labelling::LabelFolder::write_labels).
    pub(super) fn save(&self, at_once: bool) -> Result<(), Error> {
        let is_at_rest = self.changed().is_some_and(|changed| changed.elapsed() >= REST);
        if at_once || is_at_rest {
            let bench = self.bench();
            bench.labels().write_labels(self.mesh())?;
            *self.changed() = None;
        }
        Ok(())
    }

    /// Writes the labels for other programs, at their usual place. Returns it.
    ///
    /// # Errors
    /// Those of [`write_output`].
    pub(super) fn write(&self, format: OutputFormat) -> DatasetResult<PathBuf> {
        let bench = self.bench();
        let labels = bench.labels();
        let to = format.usual_place(labels.path());
        let offset_m = self.scene.offset_m();
        let options = OutputOptions { overwrite: true, offset_m, ..OutputOptions::default() };
        write_output(format, labels, self.mesh(), bench.segments(), &to, &options, &self.ctx)
    }

    fn changed(&self) -> MutexGuard<'_, Option<Instant>> {
        self.changed.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
