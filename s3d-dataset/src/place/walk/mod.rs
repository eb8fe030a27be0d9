//! Walks of a camera through rooms, doors and stairs.
//!
//! There are two steps, in a file each. `route` finds a way over the floor that comes near every place, and
//! `curve` makes a smooth walk of it, at a steady speed.

mod curve;
mod route;

use crate::context::Context;
use crate::error::{InputError, Result, UsageError};
use crate::place::free_space::interior;
use curve::{Curve, Surroundings};
use glam::DVec3;
use route::Route;
use s3d_geom::{NearestFaces, Pose};
use s3d_render::Scene;

/// The range of heights of a camera, metres. Nobody knows whether a way is free above or below.
const HEIGHTS_M: [f64; 2] = [0.3, 2.5];

/// The most poses of a walk, and its greatest length, metres.
const MOST_FRAMES: usize = 1_000_000;
const MOST_METRES: f64 = 100_000.0;

/// The most poses a second, or images of a video.
pub(crate) const MOST_RATE: f64 = 1000.0;

/// Smoothing shortens a route, so it is found longer by this share and length, and longer again if needed.
const LONGER: f64 = 1.15;
const LONGER_M: f64 = 2.0;

/// How [`walk`] goes through a building. With the feature `clap` it is a group of arguments of a command
/// line that has `--at` and `--poses` as well.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "clap", derive(clap::Args))]
pub struct WalkOptions {
    /// The number of poses.
    #[cfg_attr(feature = "clap", arg(skip))]
    pub frames: usize,
    /// Poses a second, and images a second of a video.
    #[cfg_attr(feature = "clap", arg(long, value_name = "N", default_value_t = 30.0,
        conflicts_with = "at", value_parser = crate::options::words::positive))]
    pub rate: f64,
    /// The speed of a walk, metres a second.
    #[cfg_attr(feature = "clap", arg(long = "speed", value_name = "M/S", default_value_t = 1.0,
        conflicts_with_all = ["at", "poses"], value_parser = crate::options::words::positive))]
    pub speed_m_s: f64,
    /// The height of a walk's camera above the floor, metres.
    #[cfg_attr(feature = "clap", arg(long = "eye-height", value_name = "METRES", default_value_t = 1.5,
        conflicts_with_all = ["at", "poses"], value_parser = crate::options::words::positive))]
    pub height_m: f64,
    /// The seed of a walk, which decides where it begins.
    #[cfg_attr(feature = "clap", arg(long, default_value_t = 0, conflicts_with_all = ["at", "poses"]))]
    pub seed: u64,
}

impl Default for WalkOptions {
    fn default() -> Self {
        Self { frames: 900, rate: 30.0, speed_m_s: 1.0, height_m: 1.5, seed: 0 }
    }
}

impl WalkOptions {
    fn check(&self) -> Result<()> {
        let [low, high] = HEIGHTS_M;
        let refuse = |option, range| Err(UsageError::OutOfRange { option, range }.into());
        if self.frames == 0 || self.frames > MOST_FRAMES {
            return refuse("trajectory", format!("1 to {MOST_FRAMES} images, at the rate"));
        }
        if !(self.rate > 0.0 && self.rate <= MOST_RATE) {
            return refuse("rate", format!("above 0, at most {MOST_RATE} a second"));
        }
        if !(self.speed_m_s > 0.0 && self.speed_m_s.is_finite()) {
            return refuse("speed", "above 0 metres a second".to_owned());
        }
        if !(low..=high).contains(&self.height_m) {
            return refuse("eye_height", format!("{low} to {high} metres"));
        }
        if self.frames as f64 * self.step_m() > MOST_METRES {
            return refuse("speed", format!("a walk of at most {MOST_METRES} metres"));
        }
        Ok(())
    }

    /// Returns the distance from a pose to the next, metres.
    fn step_m(&self) -> f64 {
        self.speed_m_s / self.rate
    }
}

/// Returns the poses of somebody who walks through a building at a steady speed and looks ahead: through
/// doors, up and down stairs, round furniture. The walk comes within 2 m of every place that it can reach,
/// the nearest first, and then begins anew. Poses are level, at a height above the floor; a walk where no
/// door is open stays in the part of the building with most floor.
///
/// The mesh is in metres, Z-up, with fronts of faces inside. The same mesh and options give the same poses,
/// for any number of threads.
///
/// # Errors
/// [`Error::Usage`](crate::Error::Usage) if a number is out of range.
/// [`Error::Input`](crate::Error::Input) if there is no way of a metre inside; the error says what was found
/// and what may be wrong. [`Error::Cancelled`](crate::Error::Cancelled).
pub fn walk(scene: &Scene<'_>, options: &WalkOptions, ctx: &Context) -> Result<Vec<Pose>> {
    options.check()?;
    let nearest = NearestFaces::new(scene.mesh());
    let inside = interior(ctx, scene, &nearest)?;
    let around = Surroundings { scene, nearest: &nearest };
    let mut route = Route::begin(&inside, &around, options)?;
    let progress = ctx.progress("walking", "poses", options.frames as u64);

    let mut told = 0;
    let mut tell = |walked_m: f64| {
        let done = ((walked_m / LONGER / options.step_m()) as u64).clamp(told, options.frames as u64);
        progress.add(done - told);
        told = done;
    };

    let needed_m = options.frames as f64 * options.step_m();
    let mut length_m = LONGER * needed_m + LONGER_M;
    let curve = loop {
        route.extend_to(length_m, ctx, &mut tell)?;
        let curve = Curve::smooth(route.eyes(), options.height_m, &around);
        if curve.length_m() >= needed_m {
            break curve;
        }
        length_m *= LONGER;
    };

    tell(f64::INFINITY);
    Ok(curve.poses(options.frames, options.step_m(), options.rate))
}

/// Returns the error of a building in which nobody can walk.
fn no_way(height_m: f64, at: Option<DVec3>) -> crate::Error {
    let from = at.map_or(String::new(), |at| {
        format!(" from {:.1},{:.1},{:.1}, in the part of the building with most floor", at.x, at.y, at.z)
    });
    let why = format!(
        "shows no way of a metre for a camera {height_m} m above the floor{from}; another height may have \
         one, or give a list of poses"
    );
    InputError::Unfit { path: "the mesh".into(), why }.into()
}

#[cfg(test)]
mod tests;
