//! Puts surfaces together: places them, cuts them into cells, notes their instances, and bakes light into
//! their looks.

use super::light::Light;
use crate::BuildingError;
use crate::look::{Look, scaled};
use crate::scene::Instance;
use glam::{Vec2, Vec3};
use s3d_geom::{Aabb, Material, MeshParts, Raster, Texture, TriMesh, Wrap, glam, primitives::grid};
use s3d_label::{Class, Room, RoomType};
use std::collections::{BTreeMap, BTreeSet};

/// A side of a body in the body's frame: x to the right, y away from someone who looks at its front, z up.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    Front,
    Right,
    Back,
    Left,
    Top,
    Bottom,
}

/// Steps a metre of the lattice that all corners lie on.
const LATTICE_PER_M: f32 = 16384.0;

/// Whether two coordinates come to lie on one step of the lattice.
pub(super) fn coincide(a: f32, b: f32) -> bool {
    (a * LATTICE_PER_M).round() == (b * LATTICE_PER_M).round()
}

/// Where something stands: its origin, and the direction of its x axis in the plan.
#[derive(Clone, Copy)]
struct Frame {
    origin: Vec3,
    x_axis: Vec2,
}

impl Frame {
    fn apply(self, p: Vec3) -> Vec3 {
        self.origin + (self.x_axis * p.x + self.x_axis.perp() * p.y).extend(p.z)
    }

    fn then(self, origin: Vec3, yaw_deg: f32) -> Self {
        let turn = match yaw_deg.rem_euclid(360.0) {
            // Exact, so that a thing at a wall touches it.
            0.0 => Vec2::X,
            90.0 => Vec2::Y,
            180.0 => Vec2::NEG_X,
            270.0 => Vec2::NEG_Y,
            other => Vec2::from_angle(other.to_radians()),
        };
        Self { origin: self.apply(origin), x_axis: self.x_axis.rotate(turn) }
    }
}

/// The scene under construction. Coordinates are the building's own, metres; [`Builder::finish`] moves it.
pub(crate) struct Builder {
    parts: MeshParts,
    instance_of_face: Vec<u32>,
    instances: Vec<Instance>,
    room: Room,
    /// The height of the room's floor. Frames, light and new surfaces are relative to it.
    floor_m: f32,
    light: Light,
    frame: Frame,
    materials: BTreeMap<(Look, u32), u32>,
    /// The names of materials and textures so far.
    names: BTreeSet<String>,
    texture_scale: f32,
    /// Whether only corners are wanted.
    only_measures: bool,
}

impl Builder {
    pub(crate) fn new(texture_scale: f32) -> Self {
        Self {
            parts: MeshParts::default(),
            instance_of_face: Vec::new(),
            instances: Vec::new(),
            room: Room { room_type: RoomType::OFFICE, number: 0 },
            floor_m: 0.0,
            light: Light::default(),
            frame: Frame { origin: Vec3::ZERO, x_axis: Vec2::X },
            materials: BTreeMap::new(),
            names: BTreeSet::new(),
            texture_scale,
            only_measures: false,
        }
    }

    /// A builder that only notes where corners lie. [`Builder::positions_since`] then tells how far a thing
    /// reaches, to the last bit, in a small part of the time.
    pub(crate) fn measuring() -> Self {
        Self { only_measures: true, ..Self::new(1.0) }
    }

    /// From here on everything belongs to `room`, whose floor is at `floor_m`, lit by `light`.
    pub(crate) fn enter(&mut self, room: Room, floor_m: f32, light: Light) {
        (self.room, self.floor_m, self.light) = (room, floor_m, light);
    }

    /// The light of the room. Everything built in the room so far is an obstacle to it.
    pub(crate) fn light(&self) -> &Light {
        &self.light
    }

    /// How fine the images of floors, walls and ceilings are.
    pub(crate) fn texture_scale(&self) -> f32 {
        self.texture_scale
    }

    /// From here on every face belongs to a new instance of `class` in this room.
    pub(crate) fn begin(&mut self, class: Class) {
        let number = 1 + self
            .instances
            .iter()
            .filter(|i| i.class == class && i.room == self.room)
            .count();
        self.instances
            .push(Instance { class, number: number as u32, room: self.room });
    }

    /// Runs `build` in a frame with its origin at `origin`, turned by `yaw_deg` counter-clockwise seen from
    /// above.
    pub(crate) fn place(&mut self, origin: Vec3, yaw_deg: f32, build: impl FnOnce(&mut Self)) {
        let outer = self.frame;
        self.frame = outer.then(origin, yaw_deg);
        build(self);
        self.frame = outer;
    }

    /// Adds the box between two corners without the sides `omit`, which lie on something else.
    pub(crate) fn cuboid(&mut self, low: [f32; 3], high: [f32; 3], look: Look, omit: &[Side]) {
        let ([x0, y0, z0], [x1, y1, z1]) = (low, high);
        let plan = [[x0, y0], [x1, y0], [x1, y1], [x0, y1]];
        self.hexahedron(
            std::array::from_fn(|i| Vec3::new(plan[i % 4][0], plan[i % 4][1], if i < 4 { z0 } else { z1 })),
            look,
            omit,
        );
    }

    /// Adds a body of six sides. The corners of its bottom come first, counter-clockwise seen from above,
    /// starting at the front left. The corners of its top follow in the same order.
    pub(crate) fn hexahedron(&mut self, corners: [Vec3; 8], look: Look, omit: &[Side]) {
        let sides = [
            (Side::Front, [0, 1, 5, 4]),
            (Side::Right, [1, 2, 6, 5]),
            (Side::Back, [2, 3, 7, 6]),
            (Side::Left, [3, 0, 4, 7]),
            (Side::Top, [4, 5, 6, 7]),
            (Side::Bottom, [3, 2, 1, 0]),
        ];
        for (side, indices) in sides {
            if !omit.contains(&side) {
                self.panel(indices.map(|i| corners[i]), look);
            }
        }
        self.light
            .block(Aabb::from_points(corners.map(|p| self.frame.apply(p))));
    }

    /// Adds a four-sided surface. Its corners run counter-clockwise seen from the front, and start at the
    /// texture's bottom left.
    pub(crate) fn panel(&mut self, corners: [Vec3; 4], look: Look) {
        self.shifted_panel(corners, look, 0.0);
    }

    /// Adds a surface like [`Builder::panel`]. Its texture starts at `shift` of the texture's width.
    pub(crate) fn shifted_panel(&mut self, corners: [Vec3; 4], look: Look, shift: f32) {
        let corners = corners.map(|p| self.frame.apply(p));
        if self.only_measures {
            let seated = corners.map(|p| self.seated(p));
            self.parts.positions.extend(seated);
            return;
        }

        let [a, b, c, d] = corners;
        let width = a.distance(b).max(d.distance(c));
        let height = a.distance(d).max(b.distance(c));
        let cells = [width, height].map(|m| ((m / look.cell_m() - 0.01).ceil() as u32).max(1));

        let mut parts = grid(Vec3::ZERO, Vec3::X, Vec3::Y, cells);
        for p in &mut parts.positions {
            *p = a.lerp(b, p.x).lerp(d.lerp(c, p.x), p.y);
        }

        // Grain runs along the longer side.
        let size = if look.has_grain() && height > width {
            parts.uvs.iter_mut().for_each(|uv| *uv = Vec2::new(uv.y, uv.x));
            Vec2::new(height, width)
        } else {
            Vec2::new(width, height)
        };
        let scale = look.uv_scale(size);
        parts.uvs.iter_mut().for_each(|uv| *uv = *uv * scale + Vec2::X * shift);

        let normal = (b - a).cross(d - a).normalize();
        let lit = self.light.open(0.25 * (a + b + c + d), normal);
        self.add(parts, look, lit);
    }

    /// Adds triangles from `apex` to each edge of `ring`, which runs counter-clockwise seen from the front.
    fn fan(&mut self, apex: Vec3, ring: &[Vec3], look: Look) {
        let apex = self.frame.apply(apex);
        let low = ring.iter().fold(apex, |low, &p| low.min(self.frame.apply(p)));
        if self.only_measures {
            let seated = ring.iter().map(|&p| self.seated(self.frame.apply(p)));
            let seated: Vec<Vec3> = seated.chain([self.seated(apex)]).collect();
            self.parts.positions.extend(seated);
            return;
        }

        for i in 0..ring.len() {
            let [a, b] = [i, (i + 1) % ring.len()].map(|k| self.frame.apply(ring[k]));
            let corner = |p: Vec3| (p - low).truncate() * look.uv_scale(Vec2::ONE);
            let parts = MeshParts {
                positions: vec![apex, a, b],
                faces: vec![[0, 1, 2]],
                uvs: vec![corner(apex), corner(a), corner(b)],
                face_uvs: vec![[0, 1, 2]],
                ..MeshParts::default()
            };
            let lit = self
                .light
                .open((apex + a + b) / 3.0, (a - apex).cross(b - apex).normalize());
            self.add(parts, look, lit);
        }
    }

    /// Adds an upright cone stump of `sides` sides from radius `radii[0]` at `foot` to `radii[1]` at `foot` +
    /// `height`, with lids unless `omit` has its top or bottom.
    pub(crate) fn stump(
        &mut self,
        foot: [f32; 3],
        radii: [f32; 2],
        height: f32,
        sides: u32,
        look: Look,
        omit: &[Side],
    ) {
        let foot = Vec3::from_array(foot);
        let low = ring(foot, radii[0], sides);
        let high = ring(foot + Vec3::Z * height, radii[1], sides);
        for i in 0..sides as usize {
            let j = (i + 1) % sides as usize;
            self.panel([low[i], low[j], high[j], high[i]], look);
        }
        if !omit.contains(&Side::Top) {
            self.fan(foot + Vec3::Z * height, &high, look);
        }
        if !omit.contains(&Side::Bottom) {
            self.fan(foot, &low.iter().rev().copied().collect::<Vec<_>>(), look);
        }
        let r = radii[0].max(radii[1]) * 0.8;
        let a = foot - Vec3::new(r, r, 0.0);
        let b = foot + Vec3::new(r, r, height);
        self.light.block(Aabb::from_points([a, b].map(|p| self.frame.apply(p))));
    }

    /// Adds a round surface that looks up, as the lid of a stump of another material.
    pub(crate) fn disc(&mut self, center: [f32; 3], radius: f32, sides: u32, look: Look) {
        let center = Vec3::from_array(center);
        self.fan(center, &ring(center, radius, sides), look);
    }

    /// Adds a leaf: a flat spindle from `base` to `tip`, `width` metres wide.
    pub(crate) fn leaf(&mut self, base: Vec3, tip: Vec3, width: f32, look: Look) {
        let along = tip - base;
        let across = along.cross(Vec3::Z).normalize() * 0.5 * width;
        let over = across.cross(along).normalize() * 0.1 * width;
        let middle = base + along * 0.45;
        let ring = [middle + across, middle - over, middle - across, middle + over];
        self.fan(tip, &ring, look);
        self.fan(base, &ring.into_iter().rev().collect::<Vec<_>>(), look);
    }

    /// Adds parts that are in building coordinates and have coordinates in a texture of their own.
    pub(crate) fn baked(&mut self, parts: MeshParts, texture: u32) {
        let first = self.parts.materials.iter().position(|m| m.texture == Some(texture));
        let material = first.unwrap_or_else(|| {
            let name = self.parts.textures[texture as usize].name.clone();
            self.parts
                .materials
                .push(Material { name, color: [255; 3], texture: Some(texture) });
            self.parts.materials.len() - 1
        });
        self.push(parts, material as u32);
    }

    /// Adds a texture to be used once, and returns its index.
    pub(crate) fn texture(&mut self, name: String, image: Raster<[u8; 3]>, wrap: Wrap) -> u32 {
        let name = self.unique(name);
        self.push_texture(name, image, wrap)
    }

    fn push_texture(&mut self, name: String, image: Raster<[u8; 3]>, wrap: Wrap) -> u32 {
        self.parts.textures.push(Texture { name, image, wrap: [wrap; 2] });
        (self.parts.textures.len() - 1) as u32
    }

    fn add(&mut self, parts: MeshParts, look: Look, lit: f32) {
        let level = look.level(lit);
        let material = match self.materials.get(&(look, level)) {
            Some(&known) => known,
            None => {
                let name = self.unique(format!("{}_{level:02}", look.name()));
                let factor = look.factor(level);
                let texture = look.pattern().map(|pattern| {
                    let image = scaled(pattern.image(), factor);
                    self.push_texture(name.clone(), image, look.wrap())
                });
                let color = scaled(&Raster::filled(1, 1, look.color()), factor).at(0, 0);
                self.parts.materials.push(Material { name, color, texture });
                let new = (self.parts.materials.len() - 1) as u32;
                self.materials.insert((look, level), new);
                new
            }
        };
        self.push(parts, material);
    }

    /// Returns `name`, or a longer name that begins with it if it is taken. Names are written into files, so
    /// they are words without spaces.
    fn unique(&mut self, name: String) -> String {
        let name = name.replace(|c: char| !c.is_ascii_alphanumeric(), "_");
        let mut unique = name.clone();
        for n in 2.. {
            if self.names.insert(unique.clone()) {
                break;
            }
            unique = format!("{name}_{n}");
        }
        unique
    }

    fn push(&mut self, mut parts: MeshParts, material: u32) {
        for p in &mut parts.positions {
            *p = self.seated(*p);
        }
        self.parts.append(parts);
        let n = self.parts.faces.len();
        self.parts.face_materials.resize(self.instance_of_face.len(), material);
        self.parts.face_materials.resize(n, material);
        // `begin` is called before anything is added.
        self.instance_of_face
            .resize(n, self.instances.len().saturating_sub(1) as u32);
    }

    /// A point of the room in building coordinates, on a lattice of 61 µm: things that touch by design then
    /// touch in the last bit, also after [`Builder::finish`].
    fn seated(&self, p: Vec3) -> Vec3 {
        let raised = Vec3 { z: p.z + self.floor_m, ..p };
        (raised * LATTICE_PER_M).round() / LATTICE_PER_M
    }

    /// The corners after the first `first` ones, in building coordinates.
    pub(crate) fn positions_since(&self, first: usize) -> &[Vec3] {
        self.parts.positions.get(first..).unwrap_or_default()
    }

    /// The number of corners so far.
    pub(crate) fn position_count(&self) -> usize {
        self.parts.positions.len()
    }

    /// The mesh, moved by `offset`, the instance of each of its faces, and the instances.
    pub(crate) fn finish(
        mut self,
        offset: Vec3,
    ) -> Result<(TriMesh, Vec<u32>, Vec<Instance>), BuildingError> {
        self.parts.positions.iter_mut().for_each(|p| *p += offset);
        let mesh = TriMesh::new(self.parts)?;
        match mesh.report().zero_area_faces {
            0 => Ok((mesh, self.instance_of_face, self.instances)),
            faces => Err(BuildingError::NoArea { faces }),
        }
    }
}

/// The corners of a level polygon around `center`, counter-clockwise seen from above.
fn ring(center: Vec3, radius: f32, sides: u32) -> Vec<Vec3> {
    let step = std::f32::consts::TAU / sides as f32;
    (0..sides)
        .map(|i| center + (Vec2::from_angle(i as f32 * step) * radius).extend(0.0))
        .collect()
}
