//! Small meshes: rooms of panels, as seen from inside.

use s3d_geom::glam::{Quat, Vec2, Vec3, vec2, vec3};
use s3d_geom::primitives::{cuboid, grid};
use s3d_geom::{MeshParts, TriMesh};

/// The edge of the faces, metres.
const EDGE_M: f32 = 0.2;

/// Panels put together.
#[derive(Default)]
pub(super) struct Shapes {
    parts: MeshParts,
}

impl Shapes {
    /// Adds a parallelogram. Its front is where its sides turn left.
    fn panel(&mut self, corner: Vec3, u: Vec3, v: Vec3) -> &mut Self {
        let counts = [u, v].map(|side| (side.length() / EDGE_M).ceil().max(1.0) as u32);
        self.parts.append(grid(corner, u, v, counts));
        self
    }

    /// Adds an upright panel from one place of the plan to another. Its front is on the left.
    pub(super) fn wall(&mut self, from: [f32; 2], to: [f32; 2], [low, high]: [f32; 2]) -> &mut Self {
        let [from, to] = [from, to].map(Vec2::from);
        let corner = to.extend(low);
        self.panel(corner, (from - to).extend(0.0), Vec3::Z * (high - low))
    }

    /// Adds a floor, seen from above.
    pub(super) fn floor(&mut self, low: [f32; 2], high: [f32; 2], z: f32) -> &mut Self {
        let [low, size] = [Vec2::from(low), Vec2::from(high) - Vec2::from(low)];
        self.panel(low.extend(z), Vec3::X * size.x, Vec3::Y * size.y)
    }

    /// Adds a ceiling, seen from below.
    pub(super) fn ceiling(&mut self, low: [f32; 2], high: [f32; 2], z: f32) -> &mut Self {
        let [low, size] = [Vec2::from(low), Vec2::from(high) - Vec2::from(low)];
        self.panel(low.extend(z), Vec3::Y * size.y, Vec3::X * size.x)
    }

    /// Adds four walls around a rectangle, seen from inside, and its floor.
    pub(super) fn walls(&mut self, low: [f32; 2], high: [f32; 2], heights: [f32; 2]) -> &mut Self {
        let [a, b, c, d] = [low, [high[0], low[1]], high, [low[0], high[1]]];
        for (from, to) in [(a, b), (b, c), (c, d), (d, a)] {
            self.wall(from, to, heights);
        }
        self.floor(low, high, heights[0])
    }

    /// Adds a roof with its ridge along y, seen from below, and the gables.
    pub(super) fn roof(&mut self, width: f32, length: f32, low: f32, rise: f32) -> &mut Self {
        let (half, along) = (0.5 * width, Vec3::Y * length);
        self.panel(Vec3::Z * low, along, vec3(half, 0.0, rise));
        self.panel(vec3(width, 0.0, low), vec3(-half, 0.0, rise), along);
        for (y, face) in [(0.0, [0, 2, 1]), (length, [0, 1, 2])] {
            let corners = [(0.0, 0.0), (width, 0.0), (half, rise)];
            let positions = corners.map(|(x, up)| vec3(x, y, low + up)).to_vec();
            self.parts
                .append(MeshParts { positions, faces: vec![face], ..MeshParts::default() });
        }
        self
    }

    pub(super) fn cuboid(&mut self, low: [f32; 3], high: [f32; 3]) -> &mut Self {
        self.parts.append(cuboid(low.into(), high.into()));
        self
    }

    /// Turns every second face over.
    pub(super) fn with_mixed_windings(&mut self) -> &mut Self {
        self.parts.faces.iter_mut().step_by(2).for_each(|face| face.swap(1, 2));
        self
    }

    /// Returns the mesh, turned about Z and moved.
    pub(super) fn turned(&self, degrees: f32) -> TriMesh {
        let mut parts = self.parts.clone();
        for place in &mut parts.positions {
            *place = Quat::from_rotation_z(degrees.to_radians()) * *place + vec2(7.03, -3.01).extend(1.2);
        }
        TriMesh::new(parts).unwrap()
    }
}

/// Two rooms of 4 × 4 m and 3 × 4 m beside each other, 2.6 m high. The wall between them is 10 cm thick and
/// has an opening in its middle, up to `top_m`.
pub(super) fn two_rooms(width_m: f32, top_m: f32, has_ceiling: bool) -> Shapes {
    let mut shapes = Shapes::default();
    let [low, high] = [2.0 - 0.5 * width_m, 2.0 + 0.5 * width_m];
    let all = [0.0, 2.6];
    shapes
        .wall([0.0, 0.0], [4.0, 0.0], all)
        .wall([4.0, 4.0], [0.0, 4.0], all)
        .wall([0.0, 4.0], [0.0, 0.0], all)
        .wall([4.1, 0.0], [7.1, 0.0], all)
        .wall([7.1, 0.0], [7.1, 4.0], all)
        .wall([7.1, 4.0], [4.1, 4.0], all)
        .floor([0.0, 0.0], [4.0, 4.0], 0.0)
        .floor([4.1, 0.0], [7.1, 4.0], 0.0)
        .floor([4.0, low], [4.1, high], 0.0);
    for (x, turn) in [(4.0, false), (4.1, true)] {
        for (from, to, heights) in [(0.0, low, all), (low, high, [top_m, 2.6]), (high, 4.0, all)] {
            let [from, to] = if turn { [to, from] } else { [from, to] };
            if heights[1] > heights[0] {
                shapes.wall([x, from], [x, to], heights);
            }
        }
    }
    // The sides of the opening.
    shapes
        .wall([4.0, low], [4.1, low], [0.0, top_m])
        .wall([4.1, high], [4.0, high], [0.0, top_m]);
    if has_ceiling {
        shapes
            .ceiling([0.0, 0.0], [4.0, 4.0], 2.6)
            .ceiling([4.1, 0.0], [7.1, 4.0], 2.6);
    }
    shapes
}
