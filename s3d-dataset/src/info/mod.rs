//! Describes a scene: what it holds, and what looks wrong.

mod data_set;

pub use crate::useful::{Estimate, Storey};
pub use data_set::{DataSetInfo, data_set_info, is_data_set};

use crate::context::Context;
use crate::error::{Error, Result};
use crate::export::finish::MUCH_UNLABELLED;
use crate::export::input::area::AreaInput;
use crate::export::input::memory::SceneSource;
use crate::export::input::pictures::Pictures;
use crate::export::input::{Inputs, no_scene};
use crate::export::labels::label_area::label_doubts;
use crate::export::labels::survey::{Locating, Survey, SurveyOptions, Surveyor, survey};
use crate::export::location::{Located, room_name};
use crate::options::ExportOptions;
use crate::survey::annotated::Annotated;
use crate::survey::outlook::unlabelled_share;
use crate::useful::{Finding, Headroom, mesh_findings, size_findings, stops_any};
use s3d_geom::{Aabb, NearestFaces};
use s3d_io::Error as FileError;
use s3d_io::camera::ScanLocation;
use s3d_io::mesh::MeshFile;
use s3d_label::{Class, Room};
use s3d_render::Scene;
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

/// The options of [`info`].
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct InfoOptions {
    /// Show the scan locations that an export would place on the floor. No two of a room are nearer than
    /// this, metres.
    pub place_cameras: Option<f64>,
    /// Show the placed scan locations that together see this share of the surface.
    pub see: Option<f64>,
    /// The seed for placing them.
    pub seed: u64,
    /// Skip and count faults in the annotations, like a lenient export.
    pub lenient: bool,
}

/// The contents of a scene. Displayed, it is the text that `s3d info` prints.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct SceneInfo {
    /// The number of its area.
    pub area: u32,
    /// Its mesh.
    pub mesh: MeshInfo,
    /// Its storeys, from the lowest.
    pub storeys: Vec<Storey>,
    /// Findings about it, a sentence each.
    pub notes: Vec<String>,
    /// Whether there are labels. Without labels it has no rooms.
    pub is_labelled: bool,
    /// Its rooms, by name.
    pub rooms: Vec<RoomInfo>,
    /// The number of annotated points.
    pub points: u64,
    /// The number of faces that get a label, contested faces included.
    pub labelled_faces: u64,
    /// The number of faces with votes for several labels.
    pub contested_faces: u64,
    /// The number of points farther than 5 cm from every face.
    pub far_points: u64,
    /// The pictures that colours come from, in a sentence; `None` if the mesh has its own colours, or the
    /// pictures cannot be used.
    pub pictures: Option<String>,
    /// Its scan locations.
    pub locations: Vec<LocationInfo>,
    /// The share of the surface that the locations see, in a sentence; `None` if they were not placed by what
    /// they see.
    pub surface_seen: Option<String>,
    /// The estimated size of an export with the default options.
    pub estimate: Estimate,
    /// What looks wrong, a sentence each.
    pub doubts: Vec<String>,
    /// The text of a scene file that says what was found in the folder of another data set; `None` if the
    /// scene has a file, or is a mesh or a published area.
    pub scene_toml: Option<String>,
}

/// A mesh.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct MeshInfo {
    /// The number of faces.
    pub faces: usize,
    /// The number of vertices.
    pub vertices: usize,
    /// The number of materials.
    pub materials: usize,
    /// Names of its textures, with width and height in pixels.
    pub textures: Vec<(String, u32, u32)>,
    /// The area of its surface, square metres.
    pub area_m2: f64,
    /// Its box, world metres, Z-up.
    pub bounds: Aabb,
    /// The offset in metres that was subtracted from the coordinates of its files, and is subtracted from
    /// points and locations too; 0 without one.
    pub offset_m: [f64; 3],
}

/// A room.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct RoomInfo {
    /// Its name.
    pub room: Room,
    /// The number of its annotated points.
    pub points: u64,
    /// The area of its floor, square metres.
    pub floor_m2: f64,
    /// The direction of its walls, degrees from +X, in [0, 90).
    pub wall_direction_deg: u32,
    /// The number of its instances, by class.
    pub instances: BTreeMap<Class, u32>,
}

/// A scan location.
#[derive(Clone, Debug)]
#[non_exhaustive]
pub struct LocationInfo {
    /// The uuid and pose.
    pub location: ScanLocation,
    /// Its room, if there are rooms.
    pub room: Option<Room>,
    /// The share of directions in which it sees the mesh, 0 to 1.
    pub coverage: f64,
    /// The distance to the nearest surface that it sees, metres.
    pub nearest_m: f32,
}

/// Describes a scene file, or the folder of a published area. The whole scene is read, and labelled as in an
/// export.
///
/// # Errors
/// [`Error::Input`] or [`Error::File`] if the scene cannot be
/// exported; [`Error::Cancelled`].
pub fn info(scene: impl Into<SceneSource>, options: &InfoOptions, ctx: &Context) -> Result<SceneInfo> {
    let InfoOptions { place_cameras, see, seed, lenient } = *options;
    let placing = ExportOptions { place_cameras, see, ..ExportOptions::default() }
        .canonical()?
        .placing();
    let inputs = Inputs::open(&[scene.into().fused(ctx)?], placing, lenient)?;
    let area = &inputs.areas[0];
    let file = area.read_mesh()?;
    let mesh = &file.mesh;
    let defaults = if area.is_labelled {
        ExportOptions::default()
    } else {
        ExportOptions::default().without_labels()?
    };

    // What looks wrong before anything is surveyed.
    let mut doubts: Vec<String> = area.doubts(&file).cloned().collect();
    let pictures = picture_summary(area, &mut doubts);
    let mut findings = mesh_findings(mesh, area.shows_mesh_colors());
    findings.extend(size_findings(mesh, defaults.points_per_m2)?);

    let scene = Scene::new(mesh);
    let survey_options = SurveyOptions { table: &inputs.table, fill_m: None, trim_m: None, seed };
    let mut surveyor = InfoSurveyor { doubts: &mut doubts, findings: &mut findings };
    let survey = survey(ctx, area, &scene, NearestFaces::new(mesh), survey_options, &mut surveyor)?;
    let Survey { annotated, located, outlooks } = survey;
    let Located { locations, rooms: room_of_location, surface_seen } = located;

    // What looks wrong about the survey.
    if area.is_labelled {
        doubts.extend(unlabelled_doubt(&scene, &locations, &annotated));
    }
    doubts.extend(findings.iter().map(Finding::sentence));
    for (location, outlook) in locations.iter().zip(&outlooks) {
        doubts.extend(outlook.warnings(location));
    }
    doubts.extend(label_doubts(area, &annotated, &inputs.table));

    let estimate = match locations.len() {
        0 => area.estimate(mesh, &defaults),
        count => Estimate::new(mesh.total_area(), count as f64, &defaults),
    };
    let locations = locations
        .into_iter()
        .zip(room_of_location)
        .zip(outlooks)
        .map(|((location, room), outlook)| LocationInfo {
            location,
            room,
            coverage: outlook.coverage,
            nearest_m: outlook.nearest_m,
        })
        .collect();

    let total = &annotated.report.total;
    Ok(SceneInfo {
        area: area.number,
        mesh: MeshInfo::of(&file),
        storeys: Headroom::of(&scene, glam::DVec3::Z).storeys(),
        notes: area.notes.iter().chain(&area.photographs.notes).cloned().collect(),
        is_labelled: area.is_labelled,
        rooms: rooms(area, &annotated),
        points: annotated.points,
        labelled_faces: total.faces,
        contested_faces: total.contested,
        far_points: total.far_points,
        pictures,
        locations,
        surface_seen: surface_seen.map(|seen| seen.to_string()),
        estimate,
        doubts,
        scene_toml: area.found.clone(),
    })
}

/// Writes the scene file that the folder of another data set amounts to into the folder. Returns its path.
///
/// # Errors
/// [`Error::File`] if the folder holds no scene of a known data set, or has a scene file already.
pub fn write_scene_toml(folder: &Path) -> Result<PathBuf> {
    let path = folder.join("scene.toml");
    if path.exists() {
        return Err(FileError::format(&path, "is there already: move it away first").into());
    }
    let found = s3d_io::scene::find_scene(folder)?.ok_or_else(|| no_scene(folder))?;
    s3d_io::fs::write_bytes(&path, found.toml.as_bytes())?;
    Ok(path)
}

/// Collects everything that looks wrong in a survey. It stops at nothing that would stop an export.
struct InfoSurveyor<'a> {
    doubts: &'a mut Vec<String>,
    findings: &'a mut Vec<Finding>,
}

impl Surveyor for InfoSurveyor<'_> {
    fn label_findings(&mut self, labels: Vec<Finding>, locations: Vec<Finding>) -> Result<Locating> {
        // This many locations would take hours to place.
        let too_many = stops_any(&locations);
        self.findings.extend(labels);
        self.findings.extend(locations);
        Ok(if too_many { Locating::Skipped } else { Locating::Wanted })
    }

    fn unplaced(&mut self, why: Error) -> Result<()> {
        // The rest of the description is still true.
        let Error::Input(why) = why else { return Err(why) };
        self.doubts.push(format!("{why}; an export stops here"));
        Ok(())
    }

    fn outlook_findings(&mut self, findings: Vec<Finding>) -> Result<()> {
        self.findings.extend(findings);
        Ok(())
    }
}

/// A sentence on the scanner's pictures that colours come from. `None` if the mesh has its own colours, or
/// the pictures cannot be used. Doubts about the pictures go to `doubts`.
fn picture_summary(area: &AreaInput, doubts: &mut Vec<String>) -> Option<String> {
    match Pictures::open(area, |_| true) {
        Ok(pictures) => pictures.map(|pictures| {
            let summary = pictures.summary();
            doubts.extend(pictures.warnings);
            summary
        }),
        Err(e) => {
            doubts.push(e.to_string());
            None
        }
    }
}

/// A sentence on the unlabelled surface that scan locations see, if it is much.
fn unlabelled_doubt(scene: &Scene<'_>, locations: &[ScanLocation], annotated: &Annotated) -> Option<String> {
    let share = unlabelled_share(scene, locations, &annotated.label_of_face)?;
    (share > MUCH_UNLABELLED).then(|| {
        format!(
            "{:.0} % of what scan locations see has no label: no annotated point is next to it (the \
             option `fill` of an export gives it the label of the surface beside it)",
            100.0 * share
        )
    })
}

fn rooms(area: &AreaInput, annotated: &Annotated) -> Vec<RoomInfo> {
    let rooms = annotated.rooms.iter().zip(&area.rooms).map(|(surveyed, room)| {
        let mut instances: BTreeMap<Class, u32> = BTreeMap::new();
        room.instances
            .iter()
            .for_each(|i| *instances.entry(i.label.class).or_default() += 1);
        RoomInfo {
            room: surveyed.room,
            points: surveyed.points,
            floor_m2: surveyed.footprint.area_m2,
            wall_direction_deg: surveyed.wall_direction_deg,
            instances,
        }
    });
    rooms.collect()
}

impl MeshInfo {
    fn of(file: &MeshFile) -> Self {
        let mesh = &file.mesh;
        let textures = mesh
            .textures()
            .iter()
            .map(|t| (t.name.clone(), t.image.width(), t.image.height()));
        Self {
            faces: mesh.faces().len(),
            vertices: mesh.positions().len(),
            materials: mesh.materials().len(),
            textures: textures.collect(),
            area_m2: mesh.total_area(),
            bounds: mesh.aabb(),
            offset_m: file.offset_m.to_array(),
        }
    }
}

impl fmt::Display for SceneInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        if let Some(toml) = &self.scene_toml {
            writeln!(f, "the folder amounts to this scene.toml:\n")?;
            toml.lines().try_for_each(|line| writeln!(f, "  {line}"))?;
            writeln!(f)?;
        }
        writeln!(f, "area {}\n\n{}", self.area, self.mesh)?;

        if !self.storeys.is_empty() {
            let storeys: Vec<String> = self.storeys.iter().map(Storey::to_string).collect();
            let plural = if storeys.len() == 1 { "storey" } else { "storeys" };
            writeln!(f, "  {} {plural}: {}", storeys.len(), storeys.join("; "))?;
        }
        self.notes.iter().try_for_each(|note| writeln!(f, "  {note}"))?;

        if self.is_labelled {
            writeln!(f, "annotations: {} points, {} rooms", self.points, self.rooms.len())?;
            self.rooms.iter().try_for_each(|room| writeln!(f, "{room}"))?;
            writeln!(
                f,
                "  {} of {} faces get a label, {} of them contested; {} points are farther than 5 cm from \
                 every face",
                self.labelled_faces, self.mesh.faces, self.contested_faces, self.far_points
            )?;
        } else {
            writeln!(f, "annotations: none, so that a data set of it has no labels")?;
        }

        if let Some(pictures) = &self.pictures {
            writeln!(f, "\ncolours: {pictures}")?;
        }

        writeln!(f, "\nscan locations: {}", self.locations.len())?;
        for LocationInfo { location, room, coverage, nearest_m } in &self.locations {
            let uuid = &location.uuid;
            let at = location.pose.location;
            let room = room_name(*room);
            writeln!(
                f,
                "  {uuid}  ({:.2}, {:.2}, {:.2})  {room}  sees the mesh in {:.0} %, the nearest of it at \
                 {nearest_m:.2} m",
                at.x,
                at.y,
                at.z,
                100.0 * coverage
            )?;
        }

        if let Some(seen) = &self.surface_seen {
            writeln!(f, "  {seen}")?;
        }

        writeln!(f, "\nan export with the default options: {}", self.estimate)?;
        let verdict = if self.doubts.is_empty() {
            "nothing looks wrong"
        } else {
            "what looks wrong:"
        };
        writeln!(f, "\n{verdict}")?;
        self.doubts.iter().try_for_each(|doubt| writeln!(f, "  {doubt}"))
    }
}

impl fmt::Display for MeshInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let b = self.bounds;
        let s = b.size();
        writeln!(
            f,
            "mesh: {} faces, {} vertices, {} materials, {} textures, {:.1} m²",
            self.faces,
            self.vertices,
            self.materials,
            self.textures.len(),
            self.area_m2
        )?;
        writeln!(
            f,
            "  {:.2} × {:.2} × {:.2} m, from ({:.2}, {:.2}, {:.2}) to ({:.2}, {:.2}, {:.2}), Z-up",
            s.x, s.y, s.z, b.min.x, b.min.y, b.min.z, b.max.x, b.max.y, b.max.z
        )?;

        if self.offset_m != [0.0; 3] {
            writeln!(f, "  less offset_m = {:?}, as are points and scan locations", self.offset_m)?;
        }

        self.textures
            .iter()
            .try_for_each(|(name, width, height)| writeln!(f, "  {name} {width} × {height}"))
    }
}

impl fmt::Display for RoomInfo {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let instances: Vec<String> = self.instances.iter().map(|(class, n)| format!("{n} {class}")).collect();
        write!(
            f,
            "  {}: {} points, {:.1} m² of floor, walls along {}°: {}",
            self.room,
            self.points,
            self.floor_m2,
            self.wall_direction_deg,
            instances.join(", ")
        )
    }
}
