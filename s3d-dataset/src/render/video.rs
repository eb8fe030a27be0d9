//! Makes a video of images by ffmpeg, a program that may be installed beside this one.

use crate::context::Context;
use crate::error::{InputError, Result, UsageError};
use crate::place::MOST_RATE;
use s3d_io::Error as FileError;
use s3d_io::dataset::Domain;
use s3d_io::fs::read_file;
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

/// The name of a video in a folder of views.
const VIDEO: &str = "rgb.mp4";

/// The threads of an encoder decide its bytes, so there are as many everywhere.
const THREADS: &str = "4";

/// Checks that a video can be made: that there are colour images, and ffmpeg.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) if the rate is out of range, or there are no colour images;
/// [`Error::Input`](crate::Error::Input) if there is no ffmpeg.
pub(super) fn check(rate: f64, modalities: &[Domain]) -> Result<()> {
    if !(rate > 0.0 && rate <= MOST_RATE) {
        let range = format!("above 0, at most {MOST_RATE} a second");
        return Err(UsageError::OutOfRange { option: "rate", range }.into());
    }
    if !modalities.contains(&Domain::Rgb) {
        let value = modalities.iter().map(ToString::to_string).collect::<Vec<_>>().join(",");
        let why = "a video is made of the images rgb".to_owned();
        return Err(UsageError::InvalidValue { option: "modalities", value, why }.into());
    }
    let refuse = |why| Err(InputError::Unfit { path: "ffmpeg".into(), why }.into());
    match program()
        .arg("-version")
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
    {
        Ok(ended) if ended.success() => Ok(()),
        Ok(ended) => refuse(format!("does not run ({ended}): mend it, or make images without a video")),
        Err(e) => refuse(format!("does not start ({e}): install it, or make images without a video")),
    }
}

/// Writes a video of PNG files into a folder. Images of odd sizes get a black column or row.
///
/// # Errors
/// [`Error::File`](crate::Error::File) if an image cannot be read, or with what ffmpeg said;
/// [`Error::Cancelled`](crate::Error::Cancelled).
pub(super) fn write(
    ctx: &Context,
    pictures: impl ExactSizeIterator<Item = PathBuf>,
    rate: f64,
    folder: &Path,
) -> Result<()> {
    let video = folder.join(VIDEO);
    let failed = |e| FileError::io(&video, "write by ffmpeg", e);
    let progress = ctx.progress("making a video", "images", pictures.len() as u64);
    let mut encoder = start(rate, &video).map_err(failed)?;

    let fed = feed(&mut encoder, pictures, || {
        progress.add(1);
        ctx.check()
    });
    if matches!(fed, Err(Fed::Stopped(_))) {
        // It reads its input to the end otherwise.
        let _ = encoder.kill();
    }

    // What ffmpeg says tells more than that it reads no longer.
    let ended = encoder.wait_with_output().map_err(failed)?;
    match fed {
        Err(Fed::Stopped(error)) => return Err(error),
        Ok(()) if ended.status.success() => return Ok(()),
        _ => {}
    }
    let said = String::from_utf8_lossy(&ended.stderr);
    let said = said.lines().last().unwrap_or("it said nothing");
    Err(failed(io::Error::other(format!("{}: {said}", ended.status))).into())
}

/// Why not all images were handed over.
enum Fed {
    /// By this side.
    Stopped(crate::Error),
    /// ffmpeg reads no longer.
    Refused,
}

/// Hands images to an encoder, and closes its input.
fn feed(
    encoder: &mut Child,
    pictures: impl Iterator<Item = PathBuf>,
    after_each: impl Fn() -> Result<()>,
) -> std::result::Result<(), Fed> {
    let Some(mut input) = encoder.stdin.take() else { return Err(Fed::Refused) };
    for path in pictures {
        let picture = read_file(&path).map_err(|e| Fed::Stopped(e.into()))?;
        input.write_all(&picture).map_err(|_| Fed::Refused)?;
        after_each().map_err(Fed::Stopped)?;
    }
    Ok(())
}

fn program() -> Command {
    let mut command = Command::new("ffmpeg");
    command.args(["-hide_banner", "-loglevel", "error"]);
    command
}

/// Starts an encoder of PNG files that come through its input.
fn start(rate: f64, video: &Path) -> io::Result<Child> {
    let mut command = program();
    command.args(["-f", "image2pipe", "-c:v", "png", "-framerate", &rate.to_string(), "-i", "-"]);
    // Players want even sizes and halved colours. The header first lets a browser begin at once.
    command.args(["-vf", "pad=ceil(iw/2)*2:ceil(ih/2)*2", "-pix_fmt", "yuv420p", "-movflags", "+faststart"]);
    command.args(["-threads", THREADS, "-fflags", "+bitexact", "-flags:v", "+bitexact", "-y"]);
    command.arg(video);
    command
        .stdin(Stdio::piped())
        .stdout(Stdio::null())
        .stderr(Stdio::piped())
        .spawn()
}
