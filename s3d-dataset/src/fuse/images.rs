//! The images of a raw scan, as fusion takes them.

use super::FuseOptions;
use super::places::find_places;
use crate::context::Context;
use crate::error::{Error, Result};
use crate::parallel::map_in_order;
use glam::{DAffine3, DMat3, DQuat, DVec3, Vec3, dvec2};
use s3d_fusion::{FusionOptions, RangeImage, RangeKind, SensorNoise};
use s3d_geom::{Pose, Raster};
use s3d_io::camera::{Distortion, Optics, uuid_from_name};
use s3d_io::mesh::UpAxis;
use s3d_io::raw::{
    ColorPicture, DepthPicture, DepthPictures, LaserScans, RawForm, RawOptions, RawScan, ScanInfo,
};
use std::path::{Path, PathBuf};

/// Depth pictures count up to this range by default, metres: noise grows with its square.
const PICTURE_RANGE_M: f64 = 5.0;

/// Pieces of the mesh of laser scans with less surface than this many faces of cells are left out. The wires
/// and rods that one scan sees are pieces of few cells. People who walk through depth pictures leave larger
/// ones.
const SCAN_PIECE_CELLS: f64 = 5.0;

/// Laser scans count up to this range by default, metres. What is farther is seen through windows.
const SCAN_RANGE_M: f64 = 60.0;

/// So many depth pictures a thread are read while as many are fused.
const PICTURES_AHEAD: usize = 2;

/// Pixels that the sensor is less sure of are left out: 0 is low, 1 medium, 2 high.
const LEAST_CONFIDENCE: u8 = 1;

/// Scans whose places are farther from the origin than this are moved near to it, metres: positions of meshes
/// are numbers of 32 bits.
const FAR_M: f64 = 10_000.0;

/// The share of intensities that become black, and that become white.
const DARK_AND_LIGHT: [f64; 2] = [0.02, 0.98];

/// What a sensor saw, ready to be fused.
pub(super) enum Seen {
    /// From one place.
    Image(Box<RangeImage>),
    /// From a place a point.
    Rays(Rays),
}

/// Points that a mobile scanner measured.
#[derive(Default)]
pub(super) struct Rays {
    pub(super) origins: Vec<Vec3>,
    pub(super) points: Vec<Vec3>,
    pub(super) colors: Vec<[u8; 3]>,
}

/// The images of a raw scan. Pixels and points stay in their files until they are read.
pub(super) struct Images {
    inputs: Vec<(PathBuf, RawForm)>,
    pictures: Vec<DepthPicture>,
    scans: Vec<LaserScans>,
    /// Places of scanners that only the points tell: a sentence each.
    doubts: Vec<String>,
    up: Option<UpAxis>,
    /// What is subtracted from the coordinates of the scan, metres.
    pub(super) offset_m: DVec3,
    range_m: Option<f64>,
    /// How each laser scan is moved; empty if they stay where they are.
    motions: Vec<DAffine3>,
}

impl Images {
    /// Opens the files and folders of a raw scan, and says what was found.
    pub(super) fn open(inputs: &[PathBuf], options: &FuseOptions, ctx: &Context) -> Result<Self> {
        let raw = raw_options(inputs, options)?;
        let mut images = Self {
            inputs: Vec::new(),
            pictures: Vec::new(),
            scans: Vec::new(),
            doubts: Vec::new(),
            up: options.up,
            offset_m: DVec3::ZERO,
            range_m: options.range_m,
            motions: Vec::new(),
        };
        images.read(inputs, &raw, options, ctx)?;

        // Scans in UTM are opened again, near the origin.
        let first_m = images.places().next().unwrap_or_default();
        if first_m.abs().max_element() > FAR_M {
            images.offset_m = (first_m / 100.0).round() * 100.0;
            let world_from_file = DAffine3::from_translation(-images.offset_m) * raw.world_from_file;
            (images.inputs, images.pictures, images.scans) = (Vec::new(), Vec::new(), Vec::new());
            images.doubts.clear();
            images.read(inputs, &RawOptions { world_from_file, ..raw }, options, ctx)?;
            let offset = images.offset_m.to_array();
            ctx.info(format_args!("offset_m = {offset:?} is subtracted from the coordinates of the scan"));
        }

        for (path, form) in &images.inputs {
            ctx.info(format_args!("{}: {form}", path.display()));
        }
        ctx.warn_each(images.scans.iter().flat_map(|scans| &scans.warnings));
        ctx.warn_each(&images.doubts);
        let count = images.len();
        ctx.info(format_args!("{count} {}", images.unit()));
        if count == 1 {
            let path = images.path().display();
            ctx.warn(format_args!("{path}: a single image: what it does not see stays open"));
        }
        Ok(images)
    }

    fn read(
        &mut self,
        inputs: &[PathBuf],
        raw: &RawOptions,
        options: &FuseOptions,
        ctx: &Context,
    ) -> Result<()> {
        for path in inputs {
            let scan = RawScan::open(path, raw)?;
            self.inputs.push((path.clone(), scan.form()));
            match scan {
                RawScan::Pictures(DepthPictures { pictures, .. }) => {
                    self.pictures
                        .extend(pictures.into_iter().step_by(options.every.get() as usize));
                }
                RawScan::Scans(mut scans) => {
                    self.doubts.extend(find_places(&mut scans, ctx)?);
                    self.scans.push(scans);
                }
            }
        }
        Ok(())
    }

    /// Moves each laser scan.
    pub(super) fn move_scans(&mut self, motions: Vec<DAffine3>) {
        self.motions = motions;
    }

    /// Whether laser scans are elsewhere than their files say.
    pub(super) fn are_moved(&self) -> bool {
        !self.motions.is_empty() || self.offset_m != DVec3::ZERO
    }

    /// The first input, for messages.
    pub(super) fn path(&self) -> &Path {
        self.inputs.first().map_or(Path::new(""), |(path, _)| path)
    }

    /// The inputs, and what they are.
    pub(super) fn inputs(&self) -> &[(PathBuf, RawForm)] {
        &self.inputs
    }

    /// The axis of the files that points up, if the caller said it.
    pub(super) fn up(&self) -> Option<UpAxis> {
        self.up
    }

    /// The photographs that were taken together with depth pictures.
    pub(super) fn colors(&self) -> impl Iterator<Item = &ColorPicture> {
        self.pictures.iter().filter_map(|picture| picture.color.as_ref())
    }

    /// The number of pictures and scans.
    pub(super) fn len(&self) -> usize {
        self.pictures.len() + self.scans.iter().map(|scans| scans.scans().len()).sum::<usize>()
    }

    /// What they are called in messages.
    pub(super) fn unit(&self) -> &'static str {
        if self.scans.is_empty() {
            "depth pictures"
        } else {
            "laser scans"
        }
    }

    /// The line that tells the offset, if there is one.
    pub(super) fn offset_comment(&self) -> Option<String> {
        let [x, y, z] = self.offset_m.to_array();
        let line = format!("offset_m {x:?} {y:?} {z:?}: add it for the scan's own coordinates");
        (self.offset_m != DVec3::ZERO).then_some(line)
    }

    /// The mean of the upward axes of depth cameras; `None` if there are none.
    pub(super) fn mean_up(&self) -> Option<DVec3> {
        let sum: DVec3 = self.pictures.iter().map(|picture| picture.pose.up()).sum();
        (!self.pictures.is_empty()).then(|| sum / self.pictures.len() as f64)
    }

    /// How they are fused with cells of this size.
    pub(super) fn fusion_options(&self, cell_m: f64) -> FusionOptions {
        let mut options = FusionOptions { cell_m, ..FusionOptions::default() };
        if self.pictures.is_empty() {
            options.least_piece_cells = SCAN_PIECE_CELLS;
        }
        options
    }

    /// The places that sensors stood at, metres.
    fn places(&self) -> impl Iterator<Item = DVec3> {
        let scans = self.scans.iter().flat_map(LaserScans::scans);
        let of_scans = scans.filter_map(|scan| scan.origin_m);
        let paths = self.scans.iter().filter_map(LaserScans::trajectory);
        let of_paths = paths.filter_map(|path| path.place_at(path.times_s()[0]));
        self.pictures
            .iter()
            .map(|picture| picture.pose.location)
            .chain(of_scans)
            .chain(of_paths)
    }

    /// The names of the laser scans.
    pub(super) fn scan_names(&self) -> Vec<String> {
        let scans = self.scans.iter().flat_map(LaserScans::scans);
        scans.map(|scan| scan.name.clone()).collect()
    }

    /// The laser scans that have a place, with their motions.
    fn placed(&self) -> impl Iterator<Item = (&ScanInfo, DVec3, DAffine3)> {
        let scans = self.scans.iter().flat_map(LaserScans::scans).enumerate();
        scans.filter_map(|(number, scan)| {
            let motion = self.motions.get(number).copied().unwrap_or_default();
            scan.origin_m
                .map(|origin_m| (scan, motion.transform_point3(origin_m), motion))
        })
    }

    /// A table of the places of laser scans, as lists of scan locations are: a location for each scan, level
    /// and with the heading of the scanner's +Y. `None` if no scan has a place.
    pub(super) fn place_table(&self) -> Option<String> {
        let rows: Vec<_> = self.placed().collect();
        let row = |(scan, place, motion): &(&ScanInfo, DVec3, DAffine3)| {
            let [x, y, z] = place.to_array();
            let uuid = scan.uuid.clone();
            let uuid = uuid.unwrap_or_else(|| uuid_from_name(&format!("{} {x} {y} {z}", scan.name)));
            let ahead = motion.matrix3 * scan.pose.map_or(DVec3::Y, |pose| pose.forward());
            // Headings are 0 along +Y and grow to the left.
            let heading = DQuat::from_rotation_z(libm::atan2(-ahead.x, ahead.y));
            table_row(&uuid, *place, heading)
        };
        (!rows.is_empty()).then(|| TABLE.to_owned() + &rows.iter().map(row).collect::<String>())
    }

    /// A table of how the scans of an E57 file are moved, from the frame of the file to the world of the
    /// mesh: a motion for each scan location.
    pub(super) fn motion_table(&self) -> String {
        let turn = self.up.map_or(DMat3::IDENTITY, UpAxis::rotation);
        let world_from_file = DAffine3::from_translation(-self.offset_m) * DAffine3::from_mat3(turn);
        let row = |(scan, _, motion): (&ScanInfo, DVec3, DAffine3)| {
            let moved = motion * world_from_file;
            let rotation = DQuat::from_mat3(&moved.matrix3);
            scan.uuid
                .as_ref()
                .map(|uuid| table_row(uuid, moved.translation, rotation))
        };
        TABLE.to_owned() + &self.placed().filter_map(row).collect::<String>()
    }

    /// Hands on what sensors saw, in the order of the files, until `each` returns false. Pictures are read on
    /// all threads, some ahead.
    pub(super) fn each(
        &self,
        ctx: &Context,
        mut each: impl FnMut(Seen, &Path) -> Result<bool> + Send,
    ) -> Result<()> {
        let chunks: Vec<_> = self
            .pictures
            .chunks(rayon::current_num_threads() * PICTURES_AHEAD)
            .collect();
        let read = |number: usize| {
            let some = chunks.get(number).copied().unwrap_or_default();
            map_in_order(ctx, some, || (), |(), picture| self.picture(picture))
        };
        let mut images = read(0)?;
        for (number, some) in chunks.iter().enumerate() {
            let mut hand_on = || -> Result<bool> {
                for (image, picture) in images.drain(..).zip(*some) {
                    // A picture may have seen nothing within its range.
                    if let Some(image) = image
                        && !each(Seen::Image(Box::new(image)), picture.path())?
                    {
                        return Ok(false);
                    }
                }
                Ok(true)
            };
            let (goes_on, next) = rayon::join(&mut hand_on, || read(number + 1));
            if !goes_on? {
                return Ok(());
            }
            images = next?;
        }

        let mut motions = self.motions.iter();
        for scans in &self.scans {
            for (number, scan) in scans.scans().iter().enumerate() {
                ctx.check()?;
                let motion = motions.next();
                let Some(seen) = self.scan(scans, number, scan, ctx)? else { continue };
                let seen = match (seen, motion) {
                    (Seen::Image(image), Some(motion)) => Seen::Image(Box::new(image.moved(motion))),
                    (seen, _) => seen,
                };
                if !each(seen, &scan.path)? {
                    return Ok(());
                }
            }
        }
        Ok(())
    }

    /// Reads some depth pictures, evenly spread over all, with the names of their files.
    pub(super) fn some_pictures(&self, count: usize, ctx: &Context) -> Result<Vec<(String, RangeImage)>> {
        let step = self.pictures.len().div_ceil(count).max(1);
        let chosen: Vec<&DepthPicture> = self.pictures.iter().step_by(step).collect();
        let read = map_in_order(ctx, &chosen, || (), |(), picture| self.picture(picture))?;
        let name = |picture: &DepthPicture| {
            let name = picture.path().file_name().unwrap_or_default();
            name.to_string_lossy().into_owned()
        };
        let named = read.into_iter().zip(chosen);
        Ok(named
            .filter_map(|(image, picture)| image.map(|image| (name(picture), image)))
            .collect())
    }

    fn picture(&self, picture: &DepthPicture) -> Result<Option<RangeImage>> {
        let mut depth = picture.read_depth()?;
        let confidence = picture.read_confidence()?;
        let most_m = self.range_m.unwrap_or(PICTURE_RANGE_M) as f32;
        for (i, depth_m) in depth.pixels_mut().iter_mut().enumerate() {
            let is_sure = confidence.as_ref().is_none_or(|of| of.pixels()[i] >= LEAST_CONFIDENCE);
            if !is_sure || *depth_m > most_m {
                *depth_m = f32::NAN;
            }
        }
        if depth.pixels().iter().all(|depth_m| depth_m.is_nan()) {
            return Ok(None);
        }

        let colors = picture.read_colors(&depth)?;
        let noise = SensorNoise::STRUCTURED_LIGHT;
        let unfit = |e: s3d_fusion::FusionError| Error::unfit(picture.path(), e.to_string());
        let image = RangeImage::from_depth(picture.pose, picture.lens, RangeKind::Depth, depth, noise)
            .map_err(unfit)?;
        match colors {
            None => Ok(Some(image)),
            Some(colors) => {
                let pixels = colors.pixels().iter().map(|color| color.unwrap_or_default()).collect();
                let colors = Raster::from_vec(colors.width(), colors.height(), pixels);
                Ok(Some(image.with_colors(colors).map_err(unfit)?))
            }
        }
    }

    fn scan(
        &self,
        scans: &LaserScans,
        number: usize,
        info: &ScanInfo,
        ctx: &Context,
    ) -> Result<Option<Seen>> {
        let most_m = self.range_m.unwrap_or(SCAN_RANGE_M);
        let noise = SensorNoise::LASER;
        let unfit = |e: s3d_fusion::FusionError| Error::unfit(&info.path, format!("scan {}: {e}", info.name));
        if let Some(grid) = scans.read_grid(number)? {
            let is_near = |offset: &Vec3| f64::from(offset.length()) <= most_m;
            let points: Vec<Vec3> = grid
                .offsets_m
                .pixels()
                .iter()
                .map(|offset| {
                    if is_near(offset) {
                        (grid.origin_m + offset.as_dvec3()).as_vec3()
                    } else {
                        Vec3::NAN
                    }
                })
                .collect();
            let colors = match (&grid.colors, &grid.intensities) {
                (Some(colors), _) => colors.pixels().to_vec(),
                (None, Some(intensities)) => greys(intensities.pixels()),
                (None, None) => Vec::new(),
            };
            let pose = pose_of(info, grid.origin_m);
            let size = [grid.offsets_m.width(), grid.offsets_m.height()];
            let image = RangeImage::from_scan(pose, size, &points, &colors, noise).map_err(unfit)?;
            return Ok(Some(Seen::Image(Box::new(image))));
        }

        let mut rays = Rays::default();
        let mut intensities = Vec::new();
        let read = scans.read(number, |block| {
            ctx.check()?;
            for (i, position) in block.positions_m.iter().enumerate() {
                let origin = block.origins_m.get(i).copied().or(info.origin_m).unwrap_or_default();
                if position.distance(origin) > most_m {
                    continue;
                }
                rays.points.push(position.as_vec3());
                rays.colors.extend(block.colors.get(i));
                intensities.extend(block.intensities.get(i));
                if !block.origins_m.is_empty() {
                    rays.origins.push(origin.as_vec3());
                }
            }
            Ok::<(), Error>(())
        })?;
        ctx.warn_each(&read.warnings);
        if rays.points.is_empty() {
            return Ok(None);
        }
        if rays.colors.len() != rays.points.len() {
            let has_intensities = intensities.len() == rays.points.len();
            rays.colors = if has_intensities {
                greys(&intensities)
            } else {
                Vec::new()
            };
        }

        match info.origin_m.filter(|_| rays.origins.is_empty()) {
            Some(origin_m) => {
                let pose = pose_of(info, origin_m);
                let image =
                    RangeImage::from_points(pose, &rays.points, &rays.colors, noise).map_err(unfit)?;
                Ok(Some(Seen::Image(Box::new(image))))
            }
            None => Ok(Some(Seen::Rays(rays))),
        }
    }

    /// The lowest and highest coordinates of all that was measured, metres.
    pub(super) fn bounds(&self, ctx: &Context) -> Result<[DVec3; 2]> {
        let (mut min, mut max) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        self.each(ctx, |seen, _| {
            let [low, high] = match seen {
                Seen::Image(image) => image.bounds().unwrap_or([min, max]),
                Seen::Rays(rays) => {
                    let points = rays.points.iter().map(|point| point.as_dvec3());
                    points.fold([min, max], |[low, high], point| [low.min(point), high.max(point)])
                }
            };
            (min, max) = (min.min(low), max.max(high));
            Ok(true)
        })?;
        Ok([min, max])
    }
}

/// The names of the columns of tables of places and motions.
const TABLE: &str = "uuid,x,y,z,qx,qy,qz,qw\n";

/// A line of a table of places or motions.
fn table_row(uuid: &str, at: DVec3, turn: DQuat) -> String {
    let ([x, y, z], [qx, qy, qz, qw]) = (at.to_array(), turn.normalize().to_array());
    format!("{uuid},{x:?},{y:?},{z:?},{qx:?},{qy:?},{qz:?},{qw:?}\n")
}

/// How a scanner stood: upright, unless its file tells it.
fn pose_of(info: &ScanInfo, origin_m: DVec3) -> Pose {
    info.pose.unwrap_or_else(|| Pose::level(origin_m, 0.0))
}

/// Turns intensities into greys. Most of them lie in a small part of their range.
fn greys(intensities: &[f32]) -> Vec<[u8; 3]> {
    let mut known: Vec<f32> = intensities.iter().copied().filter(|i| i.is_finite()).collect();
    if known.is_empty() {
        return vec![[128; 3]; intensities.len()];
    }
    let [dark, light] = DARK_AND_LIGHT.map(|share| {
        let at = ((known.len() - 1) as f64 * share) as usize;
        *known.select_nth_unstable_by(at, f32::total_cmp).1
    });
    let span = (light - dark).max(f32::MIN_POSITIVE);
    let grey = |i: &f32| {
        if i.is_finite() {
            ((i - dark) / span).clamp(0.0, 1.0) * 255.0
        } else {
            0.0
        }
    };
    intensities.iter().map(|i| [grey(i) as u8; 3]).collect()
}

fn raw_options(inputs: &[PathBuf], options: &FuseOptions) -> Result<RawOptions> {
    let path = inputs.first().map_or(Path::new(""), |path| path);
    let numbers = |what: &str, given: &[f64], count: usize| match given.len() {
        0 => Ok(false),
        n if n == count && given.iter().all(|v| v.is_finite()) => Ok(true),
        n => Err(Error::unfit(path, format!("{what} has {n} numbers, and needs {count}"))),
    };

    let depth_optics = numbers("the intrinsics of the depth camera", &options.intrinsics, 4)?.then(|| {
        let [fx, fy, cx, cy] = [0, 1, 2, 3].map(|i| options.intrinsics[i]);
        let (focal_px, center_px) = (dvec2(fx, fy), Some(dvec2(cx, cy)));
        Optics::Pinhole { focal_px, center_px, distortion: Distortion::None }
    });
    let has_origin = numbers("the scanner's place", &options.origin_m, 3)?;
    let turn = options.up.map_or(DMat3::IDENTITY, UpAxis::rotation);
    Ok(RawOptions {
        world_from_file: DAffine3::from_mat3(turn),
        depth_unit_m: options.depth_unit_m,
        depth_optics,
        origin_m: has_origin.then(|| DVec3::from_slice(&options.origin_m)),
        trajectory: options.trajectory.clone(),
        ..RawOptions::default()
    })
}
