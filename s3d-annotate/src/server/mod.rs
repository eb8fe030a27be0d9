//! The page to label on, and its small server.
//!
//! [`label`] opens a scene and serves the page on 127.0.0.1 until it is cancelled. Each gesture is on the
//! disk when the page is told so. The address has a random token, requests must name the server's own host
//! and origin, and no other interface is ever listened on. The work itself is that of the other modules:
//! handlers call them, and add nothing.
//!
//! What is written when: [`LabelFolder`] appends each event to `events.jsonl`
//! at once; `labels.npz` and `rooms.json` follow when nobody has changed the labels for ten seconds, on
//! request, and at the end.

mod answers;
mod connections;
mod desk;
mod guard;
mod mesh_bytes;
mod options;
mod routes;
mod scene_file;

pub use options::LabelOptions;

use crate::labelling::{CarriedOver, Error as LabelError, LabelFolder, carry_over};
use crate::outputs::write_output;
use crate::proposals::{Target, read_proposals};
use crate::segments::segment_faces;
use crate::workbench::Workbench;
use connections::Bounded;
use desk::Desk;
use guard::Guard;
use s3d_dataset::export::SceneSource;
use s3d_dataset::{BareScene, Context, Error, Result};
use s3d_io::Error as FileError;
use std::io;
use std::net::Ipv4Addr;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::thread;
use std::time::Duration;
use tokio::net::TcpListener;

/// How often the server looks whether it has to end, or to write.
const TICK: Duration = Duration::from_millis(100);

/// Labels a scene: serves the page until `ctx` is cancelled, which is its usual end. Labels are kept in a
/// folder beside the scene, or where the options say; it is made if it does not exist. `ready` gets the
/// address of the page.
///
/// With [`LabelOptions::write`] no page is served: the labels are written for another program. `ready` gets
/// the place.
///
/// # Errors
/// [`Error::Input`] and [`Error::File`] if the scene or the labels cannot be read, are of another mesh, or
/// are in use; [`Error::Usage`] if options do not fit; [`Error::Cancelled`] before the page is served.
pub fn label(
    scene: impl Into<SceneSource>,
    options: &LabelOptions,
    ctx: &Context,
    ready: impl FnOnce(&str),
) -> Result<()> {
    let scene = BareScene::open(scene, ctx)?;
    ctx.check()?;
    let folder = options.output.clone().unwrap_or_else(|| usual_folder(scene.path()));
    let mut proposals = Vec::new();
    for path in &options.proposals {
        proposals.extend(read_proposals(path, &Target::from(&scene), ctx)?);
    }
    if let [old_scene, old_labels] = &options.carry_over[..] {
        carry(Path::new(old_scene), old_labels, &scene, &folder, ctx)?;
    }

    if options.write.is_some() && !folder.is_dir() {
        return Err(FileError::format(&folder, "there are no labels yet: make some with `s3d label`").into());
    }
    ctx.info(format_args!("{} faces are cut into segments", scene.mesh().faces().len()));
    let segments = segment_faces(scene.mesh(), &options.segments);
    ctx.check()?;

    let mesh = Arc::clone(scene.mesh());
    let bench = Workbench::open(&folder, mesh, segments, scene.taxonomy()).map_err(failure)?;
    bench.labels().warnings().iter().for_each(|warning| ctx.warn(warning));
    if let Some(format) = options.write {
        let labels = bench.labels();
        let to = options.to.clone().unwrap_or_else(|| format.usual_place(labels.path()));
        let outputs = crate::outputs::OutputOptions { offset_m: scene.offset_m(), ..options.outputs };
        let written = write_output(format, labels, bench.mesh(), bench.segments(), &to, &outputs, ctx)?;
        ready(&written.display().to_string());
        return Ok(());
    }

    bench.labels().write_segments(bench.segments()).map_err(failure)?;
    let name = file_name(scene.path());
    let desk = Arc::new(Desk::new(scene, bench, name, ctx));
    let looking = Arc::clone(&desk);
    thread::spawn(move || looking.look_around(proposals));

    serve(&desk, options, ctx, ready).map_err(|e| FileError::io("127.0.0.1".as_ref(), "serve", e))?;
    desk.save(true).map_err(failure)?;
    let shown = folder.display();
    if scene_file::write_scene_file(&desk.scene, &folder)? {
        ctx.info(format_args!("the labels are in {shown}: s3d export takes this folder"));
    } else {
        ctx.info(format_args!("the labels are in {shown}: the scene takes them as [annotations] path"));
    }
    Ok(())
}

/// Serves the page of a desk until it is cancelled.
fn serve(
    desk: &Arc<Desk>,
    options: &LabelOptions,
    ctx: &Context,
    ready: impl FnOnce(&str),
) -> io::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    runtime.block_on(async {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, options.port)).await?;
        let address = listener.local_addr()?;
        let token = guard::token()?;
        let url = format!("http://{address}/{token}/");
        let service = routes::routes(Arc::clone(desk), &token, Guard::of(address));

        ready(&url);
        if !options.no_open
            && let Err(e) = open::that_detached(&url)
        {
            ctx.warn(format_args!("no browser was opened ({e}): open the address yourself"));
        }
        let served = axum::serve(Bounded::new(listener), service);
        tokio::select! {
            ended = served => ended,
            () = until_cancelled(desk, ctx) => Ok(()),
        }
    })
}

/// Writes labels that are at rest, until the end.
async fn until_cancelled(desk: &Arc<Desk>, ctx: &Context) {
    let mut has_failed = false;
    while !ctx.cancel.is_cancelled() {
        tokio::time::sleep(TICK).await;
        let desk = Arc::clone(desk);
        let saved = tokio::task::spawn_blocking(move || desk.save(false)).await;
        if let Ok(Err(e)) = saved
            && !std::mem::replace(&mut has_failed, true)
        {
            ctx.warn(format_args!("labels.npz is not written ({e}); the log has everything"));
        }
    }
}

/// Carries labels of an earlier mesh over into a new folder.
fn carry(old_scene: &Path, old_labels: &Path, scene: &BareScene, folder: &Path, ctx: &Context) -> Result<()> {
    let old = BareScene::open(old_scene.to_owned(), ctx)?;
    let from = LabelFolder::open(old_labels, old.mesh(), old.taxonomy()).map_err(failure)?;
    let mut to = LabelFolder::open(folder, scene.mesh(), scene.taxonomy()).map_err(failure)?;
    if to.state().revision() > 0 {
        let why = "has labels already: others are carried over into a new folder only";
        return Err(FileError::format(folder, why).into());
    }

    let CarriedOver { actions, report } = carry_over(old.mesh(), from.state(), scene.mesh());
    for action in actions {
        to.add(to.state().revision(), action, None).map_err(failure)?;
    }
    ctx.info(format_args!(
        "{:.1} m² of labels are carried over; {:.1} m² have none, {:.1} m² are disputed",
        report.carried_m2, report.unlabelled_m2, report.disputed_m2
    ));
    if !report.lost.is_empty() {
        let lost: Vec<String> = report.lost.iter().map(u32::to_string).collect();
        ctx.warn(format_args!("{} instances have no face any more: {}", lost.len(), lost.join(", ")));
    }
    Ok(())
}

/// Where the labels of a scene are by default: beside it, as `NAME.labels`.
fn usual_folder(scene: &Path) -> PathBuf {
    let is_file = !scene.is_dir();
    let stem = if is_file { scene.file_stem() } else { scene.file_name() };
    let mut name = stem.unwrap_or("scan".as_ref()).to_owned();
    name.push(".labels");
    scene.with_file_name(name)
}

fn file_name(path: &Path) -> String {
    path.file_name()
        .unwrap_or(path.as_os_str())
        .to_string_lossy()
        .into_owned()
}

/// An error of the labels as an error of the scene.
fn failure(error: LabelError) -> Error {
    match error {
        LabelError::File(error) => error.into(),
        error => s3d_dataset::error::InputError::Labels { why: error.to_string() }.into(),
    }
}
