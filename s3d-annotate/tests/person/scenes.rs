//! Scenes whose instances are known, for a simulated person: from modelled buildings, as they are and as a
//! scanner would have them, and a real scan.

use s3d_geom::glam::{IVec3, Vec3, ivec3, vec3};
use s3d_geom::{FaceColor, MeshParts, NearestFaces, PointCloud, TriMesh};
use s3d_io::cloud::{AnnotationTree, read_points};
use s3d_io::mesh::{UpAxis, read_mesh};
use s3d_label::RoomType;
use s3d_synth::{AnnotatedScene, Building, BuildingOptions, RoomOptions};
use std::collections::{BTreeMap, HashMap};
use std::path::Path;

/// A mesh, and what each of its faces is.
pub(crate) struct Known {
    pub(crate) name: String,
    pub(crate) mesh: TriMesh,
    /// The thing of each face, from 1; 0 for a face of which nothing is known.
    pub(crate) thing_of_face: Vec<u32>,
    /// The other things of faces that lie over a border between things. Nobody can label such a face rightly.
    pub(crate) also: BTreeMap<u32, Vec<u32>>,
    /// The class of each thing; that of 0 is empty.
    pub(crate) classes: Vec<String>,
}

pub(crate) fn demo() -> Known {
    let building = Building { texture_scale: 0.1, ..Building::demo() };
    Known::of("built-in scene", &building.build().expect("it can be built"))
}

pub(crate) fn house() -> Known {
    let options = BuildingOptions { storeys: 2, texture_scale: 0.1, ..BuildingOptions::drawn(4, 42) };
    let building = Building::generate(&options).expect("it can be generated");
    Known::of("house of two storeys", &building.build().expect("it can be built"))
}

/// An open office of about 90 instances, without its hallway.
pub(crate) fn office() -> Known {
    let room = RoomOptions { size_m: [11.0, 8.0], windows: 4, ..RoomOptions::new(RoomType::OPENSPACE) };
    let options =
        BuildingOptions { rooms: vec![room], texture_scale: 0.1, seed: 5, ..BuildingOptions::default() };
    let scene = Building::generate(&options)
        .expect("it can be generated")
        .build()
        .expect("it can be built");
    let is_office = |face: usize| {
        scene.instances[scene.instance_of_face[face] as usize]
            .room
            .to_string()
            .starts_with("openspace")
    };
    Known::of("open office", &scene).part(is_office)
}

/// The scan of a copy room, with labels by rules; `None` if it is not there.
pub(crate) fn copy_room() -> Option<Known> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../../shared/scans/copyroom");
    let mesh = read_mesh(&folder.join("rgb.obj"), UpAxis::Y).ok()?.mesh;
    let tree = AnnotationTree::open(&folder.join("Area_1")).ok()?;
    let nearest = NearestFaces::new(&mesh);
    let mut votes: Vec<HashMap<u32, u32>> = vec![HashMap::new(); mesh.faces().len()];
    let mut classes = vec![String::new()];
    for instance in &tree.rooms[0].instances {
        let mut points = PointCloud::default();
        read_points(&instance.path, &mut points).ok()?;
        let thing = classes.len() as u32;
        classes.push(instance.class.name().to_owned());
        let mut found = Vec::new();
        nearest.nearest_many(&points.positions, &mut found);
        for near in found {
            *votes[near.face as usize].entry(thing).or_default() += 1;
        }
    }
    let most = |votes: &HashMap<u32, u32>| {
        votes
            .iter()
            .max_by_key(|(thing, count)| (**count, u32::MAX - **thing))
            .map_or(0, |(thing, _)| *thing)
    };
    let thing_of_face: Vec<u32> = votes.iter().map(most).collect();
    let also = (0u32..).zip(&votes).filter_map(|(face, votes)| {
        let most = thing_of_face[face as usize];
        // One point in ten may be noise.
        let least = votes.values().sum::<u32>().div_ceil(10);
        let others = votes
            .iter()
            .filter(|(thing, count)| **thing != most && **count >= least);
        let mut others: Vec<u32> = others.map(|(thing, _)| *thing).collect();
        others.sort_unstable();
        (!others.is_empty()).then_some((face, others))
    });
    let also = also.collect();
    drop(nearest);
    Some(Known { name: "copyroom".to_owned(), mesh, thing_of_face, also, classes })
}

impl Known {
    fn of(name: &str, scene: &AnnotatedScene) -> Self {
        let classes = scene.instances.iter().map(|instance| instance.class.name().to_owned());
        Self {
            name: name.to_owned(),
            mesh: scene.mesh.clone(),
            thing_of_face: scene.instance_of_face.iter().map(|instance| instance + 1).collect(),
            also: BTreeMap::new(),
            classes: std::iter::once(String::new()).chain(classes).collect(),
        }
    }

    pub(crate) fn things(&self) -> usize {
        let mut things: Vec<u32> = self.thing_of_face.iter().copied().filter(|thing| *thing != 0).collect();
        things.sort_unstable();
        things.dedup();
        things.len()
    }

    /// Those faces that are to be kept.
    fn part(self, is_kept: impl Fn(usize) -> bool) -> Self {
        let kept: Vec<usize> = (0..self.thing_of_face.len()).filter(|face| is_kept(*face)).collect();
        let parts = self.mesh.parts();
        let mut new = parts.clone();
        new.faces = kept.iter().map(|face| parts.faces[*face]).collect();
        let column = |of: &Vec<[u32; 3]>| -> Vec<[u32; 3]> {
            if of.is_empty() {
                Vec::new()
            } else {
                kept.iter().map(|face| of[*face]).collect()
            }
        };
        new.face_uvs = column(&parts.face_uvs);
        new.face_normals = column(&parts.face_normals);
        if !parts.face_materials.is_empty() {
            new.face_materials = kept.iter().map(|face| parts.face_materials[*face]).collect();
        }
        new.face_tags = Vec::new();
        let thing_of_face = kept.iter().map(|face| self.thing_of_face[*face]).collect();
        Self { mesh: TriMesh::new(new).expect("faces of a mesh"), thing_of_face, ..self }
    }

    /// The same as a scanner would have it: one surface with shared edges, in faces of about `cell_m`, rough
    /// by `noise_m`, its colours a little speckled. It is what the method of surface nets (Gibson 1998) makes
    /// of signed distances on a grid, as in most reconstructions; corners are rounded and thin gaps closed.
    pub(crate) fn scanned(&self, cell_m: f32, noise_m: f32) -> Self {
        let mesh = &self.mesh;
        let nearest = NearestFaces::new(mesh);
        // Walls and floors do not lie on corners of the grid.
        let low = mesh.aabb().min - cell_m * vec3(3.37, 3.29, 3.43);
        let place = |corner: IVec3| low + corner.as_vec3() * cell_m;

        // The corners of the grid near the surface.
        let mut corners: Vec<[i32; 3]> = Vec::new();
        for face in 0..mesh.faces().len() as u32 {
            let [a, b, c] = mesh.triangle(face);
            let longest = a.distance(b).max(b.distance(c)).max(c.distance(a));
            let steps = (longest / (0.5 * cell_m)).ceil().max(1.0) as u32;
            let before = corners.len();
            for i in 0..=steps {
                for j in 0..=steps - i {
                    let point = a + (b - a) * (i as f32 / steps as f32) + (c - a) * (j as f32 / steps as f32);
                    corners.push(((point - low) / cell_m).floor().as_ivec3().to_array());
                }
            }
            corners[before..].sort_unstable();
            let mut kept = before;
            for i in before..corners.len() {
                if i == before || corners[i] != corners[kept - 1] {
                    corners[kept] = corners[i];
                    kept += 1;
                }
            }
            corners.truncate(kept);
        }
        corners.sort_unstable();
        corners.dedup();
        let mut all: Vec<[i32; 3]> = Vec::new();
        for [x, y, z] in corners {
            for i in 0..27 {
                all.push([x + i % 3 - 1, y + i / 3 % 3 - 1, z + i / 9 - 1]);
            }
            if all.len() > 30_000_000 {
                all.sort_unstable();
                all.dedup();
            }
        }
        all.sort_unstable();
        all.dedup();

        let places: Vec<Vec3> = all.iter().map(|corner| place(IVec3::from(*corner))).collect();
        let mut found = Vec::new();
        nearest.nearest_many(&places, &mut found);
        let mut distance_at: HashMap<[i32; 3], (f32, u32)> = HashMap::with_capacity(all.len());
        for ((corner, at), near) in all.iter().zip(&places).zip(&found) {
            let side = mesh.normal(near.face).dot(*at - near.point);
            let noise = noise_m * hash(*corner);
            if near.distance_m < 1.5 * cell_m {
                let signed = if side >= 0.0 { near.distance_m } else { -near.distance_m };
                distance_at.insert(*corner, (signed + noise, near.face));
            }
        }

        // A vertex a cell in which the sign changes, and a quadrilateral an edge at which it does.
        let mut vertex_of_cell: HashMap<[i32; 3], u32> = HashMap::new();
        let mut positions: Vec<Vec3> = Vec::new();
        let mut faces: Vec<[u32; 3]> = Vec::new();
        let axes = [ivec3(1, 0, 0), ivec3(0, 1, 0), ivec3(0, 0, 1)];
        for corner in &all {
            let Some(&(here, _)) = distance_at.get(corner) else { continue };
            for axis in 0..3 {
                let other = (IVec3::from(*corner) + axes[axis]).to_array();
                let Some(&(there, _)) = distance_at.get(&other) else { continue };
                let is_near = here.abs() < cell_m && there.abs() < cell_m;
                if (here < 0.0) == (there < 0.0) || !is_near {
                    continue;
                }
                let [u, v] = [axes[(axis + 1) % 3], axes[(axis + 2) % 3]];
                let quad = [IVec3::ZERO, u, u + v, v].map(|offset| {
                    let cell = (IVec3::from(*corner) - offset).to_array();
                    *vertex_of_cell.entry(cell).or_insert_with(|| {
                        positions.push(crossing(cell, &distance_at, &place));
                        positions.len() as u32 - 1
                    })
                });
                let [a, b, c, d] = quad;
                let pair = if here >= 0.0 {
                    [[a, d, c], [a, c, b]]
                } else {
                    [[a, b, c], [a, c, d]]
                };
                faces.extend(pair);
            }
        }

        nearest.nearest_many(&positions, &mut found);
        let colors: Vec<[u8; 3]> = found
            .iter()
            .zip(0..)
            .map(|(near, vertex)| {
                let speckle = 6.0 * hash([vertex, 1, 2]);
                mean_color(mesh, near.face, near.point).map(|c| (c + speckle).clamp(0.0, 255.0) as u8)
            })
            .collect();
        let scanned = TriMesh::new(MeshParts { positions, faces, colors, ..MeshParts::default() })
            .expect("the surface of a mesh");
        // What is nearest to the middle of a face, and to its corners.
        let mut samples: Vec<Vec3> = Vec::new();
        for face in 0..scanned.faces().len() as u32 {
            let corners = scanned.triangle(face);
            let middle = corners.iter().sum::<Vec3>() / 3.0;
            samples.push(middle);
            samples.extend(corners.map(|corner| middle.lerp(corner, 0.9)));
        }
        nearest.nearest_many(&samples, &mut found);
        let things: Vec<u32> = found
            .iter()
            .map(|near| self.thing_of_face[near.face as usize])
            .collect();
        let mut also = BTreeMap::new();
        for (face, of_face) in (0u32..).zip(things.chunks_exact(4)) {
            let mut others: Vec<u32> = of_face[1..]
                .iter()
                .copied()
                .filter(|thing| *thing != of_face[0])
                .collect();
            others.sort_unstable();
            others.dedup();
            if !others.is_empty() {
                also.insert(face, others);
            }
        }
        Self {
            name: format!("{}, scanned", self.name),
            mesh: scanned,
            thing_of_face: things.chunks_exact(4).map(|of_face| of_face[0]).collect(),
            also,
            classes: self.classes.clone(),
        }
    }
}

/// The mean of the places on the edges of a cell at which the sign changes.
fn crossing(
    cell: [i32; 3],
    distance_at: &HashMap<[i32; 3], (f32, u32)>,
    place: &impl Fn(IVec3) -> Vec3,
) -> Vec3 {
    let corner = |i: i32| IVec3::from(cell) + ivec3(i & 1, i >> 1 & 1, i >> 2);
    let (mut sum, mut count) = (Vec3::ZERO, 0.0);
    for i in 0..8 {
        for bit in [1, 2, 4] {
            let ends = [corner(i), corner(i | bit)];
            let [Some((a, _)), Some((b, _))] = ends.map(|end| distance_at.get(&end.to_array())) else {
                continue;
            };
            if i & bit == 0 && (*a < 0.0) != (*b < 0.0) {
                sum += place(ends[0]).lerp(place(ends[1]), a / (a - b));
                count += 1.0;
            }
        }
    }
    if count > 0.0 {
        sum / count
    } else {
        place(IVec3::from(cell))
    }
}

/// The colour of a face at a place of it: of a texture at the corner weights, or the mean of the corners.
fn mean_color(mesh: &TriMesh, face: u32, at: Vec3) -> [f32; 3] {
    match mesh.color_of(face) {
        FaceColor::Flat(color) => color.map(f32::from),
        FaceColor::Corners(colors) => {
            [0, 1, 2].map(|i| colors.iter().map(|c| f32::from(c[i])).sum::<f32>() / 3.0)
        }
        FaceColor::Texture(_, texture, uvs) => {
            let [a, b, c] = mesh.triangle(face);
            let normal = (b - a).cross(c - a);
            let weight = |p: Vec3, q: Vec3| normal.dot((p - at).cross(q - at)) / normal.length_squared();
            let [wa, wb, wc] = [weight(b, c), weight(c, a), weight(a, b)].map(|w| w.clamp(0.0, 1.0));
            texture.sample((uvs[0] * wa + uvs[1] * wb + uvs[2] * wc) / (wa + wb + wc).max(1e-9))
        }
    }
}

/// A number from −1 to 1 that looks random.
fn hash(of: [i32; 3]) -> f32 {
    let [x, y, z] = of.map(|i| i as u32);
    let mut h = x.wrapping_mul(0x9E37_79B1) ^ y.wrapping_mul(0x85EB_CA77) ^ z.wrapping_mul(0xC2B2_AE3D);
    h = (h ^ h >> 15).wrapping_mul(0x2C1B_3C6D);
    h = (h ^ h >> 12).wrapping_mul(0x297A_2D39);
    (h >> 8) as f32 / 8_388_608.0 - 1.0
}
