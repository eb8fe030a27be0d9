//! A picture of a data set: its mesh from above, opened below the ceilings, in colours and in classes.

mod palette;

use crate::areas::{classes, rooms};
use crate::error::{Error, Result};
use crate::faults::{Fault, Faults};
use crate::index::RoomEntry;
use crate::storeys::{Levels, Storeys};
pub(crate) use palette::{palette_of, unlabelled};
use rayon::prelude::*;
use s3d_dataset::store::{NewFile, check_apart};
use s3d_dataset::{Context, DataSet};
use s3d_geom::glam::{DVec2, DVec3, dvec2, dvec3};
use s3d_geom::{Camera, Pose, Raster, TriMesh};
use s3d_io::image::{Compression, Content, write_rgb8};
use s3d_label::LabelId;
use s3d_render::{Hit, MipMaps, Scene, TextureFilter, cast_rays, rgb_of_ray};
use std::path::Path;

/// The size of the picture, in pixels.
const SIZE: [u32; 2] = [1600, 1000];

/// Rays along each side of a pixel.
const SAMPLES: u32 = 2;
const RAYS_A_PIXEL: usize = (SAMPLES * SAMPLES) as usize;

/// The horizontal angle of view, degrees.
const FOV_DEG: f64 = 38.0;

/// The direction from the middle of the building to the camera.
const BACK: DVec3 = dvec3(0.3, -0.62, 0.9);

/// The background, which is the overview's in the dark, and the line between colours and classes.
const GROUND: [u8; 3] = [60, 60, 66];
const LINE: [u8; 3] = [255; 3];
const LINE_PX: u32 = 3;

/// The share of the mesh's own brightness in the colours of classes, so that shapes can be made out, and the
/// weights of red, green and blue in it.
const DETAIL: f32 = 0.35;
const LUMA: [f32; 3] = [0.2126, 0.7152, 0.0722];

/// Draws a picture of the data set in the folder `out`, and writes it to `to`, a PNG of 1600 × 1000 pixels,
/// whole or not at all. It shows the mesh of the first area obliquely from above, with the storey of most
/// rooms opened below its ceilings: colours on the left, classes on the right, in the colours of the page.
/// Without labels it has colours alone. Faces are seen from the front only.
///
/// If an export did not finish, the first area that has a mesh so far is shown. Areas before it, and files
/// that are damaged, become warnings.
///
/// # Errors
/// [`Error::NoMesh`] if no area has a mesh, or none has one yet. [`Error::Dataset`] if there is no data set
/// in `out`, the mesh is damaged, `to` cannot be written, or is there and not to be replaced.
pub fn poster(out: &Path, to: &Path, overwrite: bool, ctx: &Context) -> Result<()> {
    check_apart(to, out)?;
    let data = DataSet::open_as_far_as_it_is(out, ctx)?;
    let file = NewFile::begin(ctx, to, overwrite)?;
    draw(&data, file.path(), ctx)?;
    file.finish()?;
    Ok(())
}

/// Draws the picture of a data set and writes it to `to`.
pub(crate) fn draw(data: &DataSet, to: &Path, ctx: &Context) -> Result<()> {
    let out = data.layout().root();
    let Some((area, mesh)) = first_mesh(data)? else {
        return Err(Error::NoMesh { root: out.to_owned(), is_finished: data.missing_yet().is_none() });
    };

    let mut faults = Faults::default();
    let classes = class_colors(data, area, &mut faults)?;
    let rooms = rooms_of(data, area, &mut faults)?;
    let high = section(&mesh, &rooms.iter().collect::<Vec<_>>());
    let picture = drawing(&mesh, classes.as_deref(), high, SIZE, GROUND).halves();
    write_rgb8(to, &picture, Content::Photo, Compression::default())?;

    for without in data.areas().iter().take_while(|each| **each != area) {
        let words = "has no mesh yet: the poster shows another area";
        ctx.warn(format_args!("{}: area {without} {words}", out.display()));
    }
    for Fault { path, message } in faults.into_vec() {
        ctx.warn(format_args!("{}: {message}", out.join(path).display()));
    }
    Ok(())
}

/// Returns the first area that has a mesh, and the mesh. An export that did not finish may lack some.
fn first_mesh(data: &DataSet) -> Result<Option<(u32, TriMesh)>> {
    for &area in data.areas() {
        if let Some(file) = data.mesh(area)? {
            return Ok(Some((area, file.mesh)));
        }
    }
    Ok(None)
}

/// Returns the rooms of an area.
pub(crate) fn rooms_of(data: &DataSet, area: u32, faults: &mut Faults) -> Result<Vec<RoomEntry>> {
    let mut rooms = rooms(data, faults)?;
    rooms.retain(|room| room.area == area);
    Ok(rooms)
}

/// Returns the colour of each face's class. `None` without labels.
pub(crate) fn class_colors(data: &DataSet, area: u32, faults: &mut Faults) -> Result<Option<Vec<[u8; 3]>>> {
    let root = data.layout().root();
    let table = faults.keep(root, data.labels())?.flatten();
    let votes = faults.keep(root, data.face_votes(area))?.flatten();
    let (Some(table), Some(votes)) = (table, votes) else { return Ok(None) };

    let names: Vec<&str> = classes(data).iter().map(|class| class.name).collect();
    let palette = palette_of(&names);
    let color = |label: &u32| {
        let class = table.class_of(LabelId(*label))?;
        palette.get(class.index()).copied()
    };
    Ok(Some(
        votes
            .label
            .iter()
            .map(|label| color(label).unwrap_or_else(unlabelled))
            .collect(),
    ))
}

/// Returns the height below which a mesh is shown: just below the ceilings of the storey with the most rooms,
/// or infinity if it has none.
pub(crate) fn section(mesh: &TriMesh, rooms: &[&RoomEntry]) -> f64 {
    let storeys = Storeys::new(rooms, &[]);
    let [_, high] = storeys.slab(storeys.fullest(), &Levels::of(mesh));
    high
}

/// Returns a camera obliquely above a mesh that sees all of it below the height `section`. It has
/// [`SAMPLES`] rays along each side of a pixel.
pub(crate) fn camera_of(mesh: &TriMesh, section: f64, size: [u32; 2]) -> Camera {
    let low = mesh.aabb().min.as_dvec3();
    let high = mesh
        .aabb()
        .max
        .as_dvec3()
        .with_z(section.min(f64::from(mesh.aabb().max.z)));
    let middle = 0.5 * (low + high);
    let back = BACK.normalize();
    let [width, height] = size.map(|side| side * SAMPLES);

    // The least distance from which each corner is in the picture.
    let right = DVec3::Z.cross(back).normalize();
    let up = back.cross(right);
    let half = (0.5 * FOV_DEG.to_radians()).tan();
    let halves = dvec2(half, half * f64::from(height) / f64::from(width));
    let corners = (0..8).map(|i| {
        let pick = |bit: u32, low: f64, high: f64| if i >> bit & 1 == 0 { low } else { high };
        dvec3(pick(0, low.x, high.x), pick(1, low.y, high.y), pick(2, low.z, high.z)) - middle
    });
    let distance = corners
        .map(|corner| {
            let beside: DVec2 = dvec2(corner.dot(right), corner.dot(up)).abs() / halves;
            corner.dot(back) + beside.max_element()
        })
        .fold(0.0, f64::max);

    let eye = middle + 1.04 * distance * back;
    let pose = Pose::look_at(eye, middle, DVec3::Z).unwrap_or_else(|_| Pose::level(eye, 0.0));
    Camera::perspective(pose, FOV_DEG.to_radians(), width, height)
}

/// A mesh obliquely from above.
pub(crate) struct Drawing {
    /// In its own colours.
    pub(crate) own: Raster<[u8; 3]>,
    /// In the colours of its classes.
    pub(crate) classes: Option<Raster<[u8; 3]>>,
}

impl Drawing {
    /// Returns its own colours on the left, and those of classes on the right of a line. Without classes, its
    /// own.
    fn halves(self) -> Raster<[u8; 3]> {
        let Self { own, classes: Some(classes) } = self else { return self.own };
        let [width, height] = [own.width(), own.height()];
        let middle = width / 2;
        let rows = own.rows().zip(classes.rows()).flat_map(|(own, classes)| {
            (0..)
                .zip(own.iter().zip(classes))
                .map(move |(x, (own, class))| match x {
                    x if middle.abs_diff(x) <= LINE_PX / 2 => LINE,
                    x if x < middle => *own,
                    _ => *class,
                })
        });
        Raster::from_vec(width, height, rows.collect())
    }
}

/// Draws a mesh below the height `section`, obliquely from above, before a ground of this colour. `classes`
/// are the colours of the faces' classes.
pub(crate) fn drawing(
    mesh: &TriMesh,
    classes: Option<&[[u8; 3]]>,
    section: f64,
    size: [u32; 2],
    ground: [u8; 3],
) -> Drawing {
    let camera = camera_of(mesh, section, size);
    let scene = Scene::new(mesh);
    let textures = MipMaps::new(mesh);
    let filter = TextureFilter::default();
    let rays = camera.rays();
    let [width, height] = size;
    let fronts = Fronts::new(mesh, camera.pose.location);
    let shown = fronts.as_ref().map(|fronts| (Scene::new(&fronts.mesh), &fronts.faces));

    // Its own colour and that of its class.
    let colors = |face: Option<u32>, direction: DVec3| -> [[f32; 3]; 2] {
        let Some(face) = face else { return [ground.map(f32::from); 2] };
        let own = rgb_of_ray(&scene, &textures, &camera, direction, face, &filter).map(f32::from);
        let Some(classes) = classes else { return [own; 2] };

        let class = classes.get(face as usize).copied().unwrap_or_else(unlabelled);
        let facing = mesh.normal(face).as_dvec3().dot(direction.normalize()).abs() as f32;
        let gray: f32 = LUMA.iter().zip(own).map(|(weight, channel)| weight * channel).sum();
        let shade = |channel| (1.0 - DETAIL) * f32::from(channel) * (0.6 + 0.4 * facing) + DETAIL * gray;
        [own, class.map(shade)]
    };
    let row = |y: u32| -> Vec<[[u8; 3]; 2]> {
        // The rays of a pixel follow each other.
        let samples = (0..width).flat_map(|x| (0..SAMPLES * SAMPLES).map(move |sample| (x, sample)));
        let directions: Vec<DVec3> = samples
            .map(|(x, sample)| rays.at(x * SAMPLES + sample % SAMPLES, y * SAMPLES + sample / SAMPLES))
            .collect();
        let faces = match &shown {
            Some((scene, faces)) => first_faces(scene, faces, camera.pose.location, &directions, section),
            None => vec![None; directions.len()],
        };

        let of_pixels = directions.chunks(RAYS_A_PIXEL).zip(faces.chunks(RAYS_A_PIXEL));
        let pixel = |(directions, faces): (&[DVec3], &[Option<u32>])| {
            let mut sums = [[0.0; 3]; 2];
            for (direction, face) in directions.iter().zip(faces) {
                let seen = colors(*face, *direction);
                let channels = sums.as_flattened_mut().iter_mut();
                channels
                    .zip(seen.as_flattened())
                    .for_each(|(sum, channel)| *sum += channel);
            }
            sums.map(|sum| sum.map(|channel: f32| (channel / RAYS_A_PIXEL as f32).round() as u8))
        };
        of_pixels.map(pixel).collect()
    };

    let rows: Vec<Vec<[[u8; 3]; 2]>> = (0..height).into_par_iter().map(row).collect();
    let both = Raster::from_vec(width, height, rows.concat());
    Drawing { own: both.map(|[own, _]| own), classes: classes.map(|_| both.map(|[_, class]| class)) }
}

/// The faces of a mesh whose fronts are seen from a place.
struct Fronts {
    mesh: TriMesh,
    /// For each of its faces the face of the whole mesh.
    faces: Vec<u32>,
}

impl Fronts {
    /// Returns `None` if all faces show their backs.
    fn new(mesh: &TriMesh, eye: DVec3) -> Option<Self> {
        let is_front = |(face, _): &(u32, [u32; 3])| {
            let to_face = mesh.triangle(*face)[0].as_dvec3() - eye;
            mesh.normal(*face).as_dvec3().dot(to_face) < 0.0
        };
        let all = (0..).zip(mesh.faces().iter().copied());
        let (faces, corners) = all.filter(is_front).unzip();
        let mesh = TriMesh::from_faces(mesh.positions().to_vec(), corners).ok()?;
        Some(Self { mesh, faces })
    }
}

/// Returns the first face along each ray from `eye`, below the height `section`. `faces` are the names of the
/// scene's faces.
fn first_faces(
    scene: &Scene<'_>,
    faces: &[u32],
    eye: DVec3,
    directions: &[DVec3],
    section: f64,
) -> Vec<Option<u32>> {
    let above = (eye.z - section).max(0.0);
    let origin = |direction: &DVec3| {
        if above > 0.0 && direction.z < 0.0 {
            eye + *direction * (above / -direction.z)
        } else {
            eye
        }
    };
    let origins: Vec<DVec3> = directions.iter().map(origin).collect();
    let hits = cast_rays(scene, &origins, directions);
    let face = |(hit, direction): (Option<Hit>, &DVec3)| {
        // A ray that does not go down stays above the section.
        let is_below = above == 0.0 || direction.z < 0.0;
        hit.filter(|_| is_below)
            .and_then(|hit| faces.get(hit.face as usize).copied())
    };
    hits.into_iter().zip(directions).map(face).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::storeys::tests::{room, slabs};

    #[test]
    fn the_storey_of_most_rooms_is_opened_below_its_ceiling() {
        let house = slabs(&[(0.0, true), (2.5, false), (2.8, true), (5.2, false)]);
        let opened = |floors: [f64; 3]| {
            let rooms = floors.map(|floor| room("a", floor));
            section(&house, &rooms.each_ref())
        };
        assert!((opened([0.0, 0.1, 2.8]) - 2.4).abs() < 1e-5);
        assert!((opened([0.0, 2.8, 2.9]) - 5.1).abs() < 1e-5);
        // Without a ceiling, and without rooms.
        assert_eq!(section(&slabs(&[(1.0, true)]), &[]), f64::INFINITY);
    }

    #[test]
    fn all_corners_are_in_the_picture() {
        let house = slabs(&[(0.0, true), (2.5, false)]);
        let camera = camera_of(&house, 2.4, SIZE);
        for corner in house.positions() {
            let (pixel, _) = camera.project(corner.with_z(corner.z.min(2.4)).as_dvec3()).unwrap();
            let is_inside = pixel.cmpge(DVec2::ZERO).all()
                && pixel.x <= f64::from(camera.width)
                && pixel.y <= f64::from(camera.height);
            assert!(is_inside, "{corner}: {pixel}");
        }
    }

    #[test]
    fn ceilings_are_cut_away_and_backs_seen_through() {
        let house = slabs(&[(0.0, true), (1.0, false), (2.5, false)]);
        let eye = dvec3(2.2, 1.9, 9.0);
        let fronts = Fronts::new(&house, eye).unwrap();
        let scene = Scene::new(&fronts.mesh);
        let along = [DVec3::NEG_Z, DVec3::Z];
        // The table at 1 m has no front here.
        let found = first_faces(&scene, &fronts.faces, eye, &along, 2.4);
        assert!(matches!(found[..], [Some(0 | 1), None]), "{found:?}");
        // From below it has, and the ceiling too.
        let low = dvec3(2.2, 1.9, 0.5);
        let fronts = Fronts::new(&house, low).unwrap();
        let scene = Scene::new(&fronts.mesh);
        let found = first_faces(&scene, &fronts.faces, low, &along, 2.4);
        assert!(matches!(found[..], [Some(0 | 1), Some(2 | 3)]), "{found:?}");
        assert!(Fronts::new(&slabs(&[(2.5, false)]), eye).is_none());

        let picture = drawing(&house, Some(&[[200, 0, 0]; 6]), 2.4, SIZE, GROUND).halves();
        let right = picture.at(SIZE[0] * 5 / 8, SIZE[1] / 2);
        assert!(right[0] > right[1] + 80 && right[1] == right[2], "{right:?}");
        assert_eq!(picture.at(SIZE[0] / 2, 10), [255; 3]);
        assert_eq!(picture.at(0, 0), GROUND);
    }
}
