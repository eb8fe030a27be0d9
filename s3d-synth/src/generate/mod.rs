//! Makes buildings by rule, from a list of rooms and a seed.
//!
//! A storey is a hallway with rooms on both sides, each with a door to it and windows in its outer wall
//! (`arrange`), or several such wings, joined by a cross hallway (`wings`). `furnish` fills a room with the
//! things of its type. `outfit` does the same with furniture of several `models`. `space` keeps account of
//! free places, and `inside` moves things off the walls. `areas` has the options of six areas in three
//! buildings. Furnishing knows nothing about floor plans.

mod areas;
mod arrange;
mod furnish;
mod inside;
mod models;
mod options;
mod outfit;
mod space;
mod style;
mod wings;

pub use models::Models;
pub use options::{BuildingOptions, FloorPlan, RoomOptions};
pub use style::Style;

use crate::BuildingError;
use crate::building::Building;
use furnish::furnish;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use s3d_geom::glam::Vec3;

impl Building {
    /// Makes a building of the rooms wanted. The same options give the same building, and it can be built.
    /// Every room has a scan location, and so has every hallway in which open doors leave a place for one.
    ///
    /// The random choices in a room depend only on the seed and on the room's place in the list.
    ///
    /// ```
    /// use s3d_label::RoomType;
    /// use s3d_synth::{Building, BuildingOptions, RoomOptions};
    ///
    /// let rooms = vec![
    ///     RoomOptions { size_m: [5.0, 4.2], ..RoomOptions::new(RoomType::OFFICE) },
    ///     RoomOptions { heights_m: [2.4, 3.4], ..RoomOptions::new(RoomType::LOUNGE) },
    ///     RoomOptions::new(RoomType::STORAGE),
    /// ];
    /// let options = BuildingOptions { rooms, seed: 7, texture_scale: 0.1, ..BuildingOptions::default() };
    /// let scene = Building::generate(&options)?.build()?;
    /// let names: std::collections::BTreeSet<String> =
    ///     scene.instances.iter().map(|instance| instance.room.to_string()).collect();
    /// assert!(names.iter().eq(["hallway_1", "lounge_1", "office_1", "storage_1"]));
    /// // One in each room, and one for every 8 m of the hallway.
    /// assert_eq!(scene.locations.len(), 3 + 2);
    /// # Ok::<(), s3d_synth::BuildingError>(())
    /// ```
    ///
    /// # Errors
    /// [`BuildingError`]: no room, a room of a type that cannot be furnished, a number out of its range, more
    /// windows than the outer wall takes, a hallway of more than 150 m, a storey more than 10 km above the
    /// ground, a style without a choice. No seed changes the answer.
    pub fn generate(options: &BuildingOptions) -> Result<Self, BuildingError> {
        options.check()?;
        let mut building = Self {
            title: options.title.clone(),
            origin: Vec3::ZERO,
            rooms: Vec::new(),
            locations: Vec::new(),
            texture_scale: options.texture_scale,
        };
        let sites = arrange::arrange(options);
        // A hallway may be too long, a storey too high above the ground.
        sites.iter().try_for_each(|site| site.plan.check_shell())?;

        for (index, site) in (0..).zip(sites) {
            let mut rng = rng(options.seed, index);
            let (room, locations) = furnish(site, options, &mut rng);
            building.rooms.push(room);
            building.locations.extend(locations);
        }
        Ok(building)
    }
}

/// The source of all randomness of one unit of work.
fn rng(seed: u64, unit: u64) -> ChaCha8Rng {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    rng.set_stream(unit);
    rng
}

/// Draws a number from `from` to `to`, which may be equal.
fn between(rng: &mut ChaCha8Rng, from: f32, to: f32) -> f32 {
    from + (to - from) * rng.random::<f32>()
}

/// Draws one of the choices. There is at least one.
fn pick<T: Copy>(rng: &mut ChaCha8Rng, choices: &[T]) -> T {
    choices[rng.random_range(0..choices.len())]
}
