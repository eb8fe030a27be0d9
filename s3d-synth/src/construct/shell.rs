//! The shell of a room: floor, walls, ceiling, and the fillings of openings.

use super::builder::{Builder, coincide};
use super::light::{Lamp, Light};
use super::openings::{doorway, glazing, handle, leaf, model_leaf, window};
use super::things::{beam, construct_thing};
use crate::BuildingError;
use crate::building::{Beam, Filling, Item, KNEE_M, Opening, RoomPlan, Stairwell, Wall};
use crate::look::{LAMP, Look, Pattern, WHITE, to_bytes};
use s3d_geom::{
    Aabb, MeshParts, NO_INDEX, Raster, Wrap,
    glam::{Vec2, Vec3, vec2, vec3},
};
use s3d_label::Class;

/// How far things may reach into a wall: a thing that touches it does so within rounding. Metres.
const SLACK_M: f32 = 1e-3;
/// Edge of the cells, metres.
const CELL_M: f32 = 0.25;
/// Texels a metre of the images of floors, ceilings and walls, at a scale of 1.
const FLOOR_PER_M: f32 = 100.0;
const CEILING_PER_M: f32 = 60.0;
const WALL_PER_M: f32 = 72.0;

impl RoomPlan {
    /// Builds the room. Its items come first, so that they shade the shell.
    ///
    /// # Errors
    /// [`BuildingError::Outside`] for an item that leaves the room.
    pub(crate) fn construct(&self, b: &mut Builder) -> Result<(), BuildingError> {
        b.enter(self.room, self.floor_m, self.light());
        self.fill(b);
        let inside = self.inside();

        for (index, item) in self.items.iter().enumerate() {
            let first = b.position_count();
            self.construct_item(b, item);
            if !b.positions_since(first).iter().all(|&p| inside.contains(p)) {
                return Err(BuildingError::Outside { room: self.room, what: "item", index });
            }
        }

        self.enclose(b, &self.room.to_string());
        Ok(())
    }

    /// The box that nothing in the room may leave, in building coordinates.
    pub(crate) fn inside(&self) -> Aabb {
        Aabb {
            min: self.low.extend(self.floor_m) - SLACK_M,
            max: self.high.extend(self.floor_m + self.top()) + SLACK_M,
        }
    }

    /// The box around an item of this room, in building coordinates, exactly as [`RoomPlan::construct`]
    /// builds it.
    pub(crate) fn bounds_of(&self, item: &Item) -> Aabb {
        let mut b = Builder::measuring();
        b.enter(self.room, self.floor_m, Light::default());
        self.construct_item(&mut b, item);
        Aabb::from_points(b.positions_since(0).iter().copied())
    }

    fn construct_item(&self, b: &mut Builder, item: &Item) {
        match item {
            Item::Standing { thing, position, yaw_deg } => {
                b.place(*position, *yaw_deg, |b| construct_thing(b, thing));
            }
            Item::OnWall { thing, wall, along } => {
                self.at_wall(b, *wall, *along, |b| construct_thing(b, thing));
            }
            Item::Beam(Beam { from, to, half_width_m, depth_m, look }) => {
                let [from, to] = [from, to].map(|end| end.extend(self.ceiling_at(end.y)));
                beam(b, from, to, *half_width_m, *depth_m, *look);
            }
        }
    }

    /// The light of its windows, doorways and lamps.
    fn light(&self) -> Light {
        let windows = self.openings.iter().map(|o| {
            let ([a, b], [z0, z1]) = (o.span, o.heights);
            let brightness = if o.filling.is_window() { 1.5 } else { 0.25 };
            let center = self.on_wall(o.wall, 0.5 * (a + b)).extend(0.5 * (z0 + z1));
            Lamp { center, normal: o.wall.normal(), power: brightness * (b - a) * (z1 - z0) }
        });
        let lamps = self.lamps.iter().map(|&[x, y, length, width]| {
            let center = vec3(x, y, self.ceiling_at(y) - 0.06);
            Lamp { center, normal: -Vec3::Z, power: 2.6 * length * width + 0.5 }
        });
        Light::new(windows.chain(lamps).collect(), self.top())
    }

    /// Runs `build` in a frame on `wall`: x to the right of someone who looks at it, y into the wall, the
    /// origin at its foot, at `along` (x or y of the building).
    fn at_wall(&self, b: &mut Builder, wall: Wall, along: f32, build: impl FnOnce(&mut Builder)) {
        b.place(self.on_wall(wall, along).extend(0.0), wall.yaw_deg(), build);
    }

    /// Fills the openings and hangs the lamps.
    fn fill(&self, b: &mut Builder) {
        for o in &self.openings {
            let [a, c] = o.span;
            let left = if matches!(o.wall, Wall::South | Wall::East) {
                c
            } else {
                a
            };

            let width = c - a;
            self.at_wall(b, o.wall, left, |b| match o.filling {
                Filling::Window => window(b, width, o.heights),
                Filling::Door { thickness_m, hinge_left, open_deg } => {
                    doorway(b, width, o.heights[1], thickness_m);
                    // The leaf opens into the room; its thickness lies on the side away from the opening.
                    let (x, yaw, y) = if hinge_left {
                        (0.0, -open_deg, 0.0)
                    } else {
                        (width, 180.0 + open_deg, 0.04)
                    };
                    b.place(vec3(x, -0.03, 0.0), yaw, |b| {
                        b.place(vec3(0.0, y, 0.0), 0.0, |b| leaf(b, width, o.heights[1]));
                    });
                }
                Filling::ShutDoor => {
                    doorway(b, width, o.heights[1], 0.08);
                    b.place(vec3(0.0, 0.12, 0.0), 0.0, |b| {
                        let h = o.heights[1];
                        b.panel(
                            [[0.0, 0.0], [width, 0.0], [width, h], [0.0, h]].map(|[x, z]| vec3(x, -0.04, z)),
                            Look::Fitted(Pattern::Door),
                        );
                        handle(b, width - 0.1, -0.04);
                    });
                }
                Filling::Glazing { panes, depth_m } => glazing(b, width, o.heights, panes, depth_m),
                Filling::Leaf { model, look, depth_m, hinge_left, open_deg } => {
                    doorway(b, width, o.heights[1], depth_m);
                    let height = o.heights[1];
                    let shut = open_deg == 0.0;
                    let (origin, yaw, y) = match (shut, hinge_left) {
                        (true, _) => (vec3(0.0, depth_m + 0.02, 0.0), 0.0, 0.0),
                        (false, true) => (vec3(0.0, -0.03, 0.0), -open_deg, 0.0),
                        (false, false) => (vec3(width, -0.03, 0.0), 180.0 + open_deg, 0.04),
                    };
                    b.place(origin, yaw, |b| {
                        b.place(vec3(0.0, y, 0.0), 0.0, |b| {
                            model_leaf(b, model, [width, height], look, shut)
                        });
                    });
                }
                Filling::Frame { depth_m } => doorway(b, width, o.heights[1], depth_m),
                Filling::Nothing => {}
            });
        }

        for &[x, y, length, width] in &self.lamps {
            b.begin(Class::CLUTTER);
            let z = self.ceiling_at(y) - 0.02;
            let l = 0.5 * length;
            let w = 0.5 * width;
            b.cuboid([x - l, y - w, z - 0.05], [x + l, y + w, z], LAMP, &[]);
        }
    }

    /// Adds floor, walls and ceiling, lit and shaded by everything that was built in this room.
    fn enclose(&self, b: &mut Builder, name: &str) {
        let top = self.top();
        let scale = b.texture_scale();
        let mut cuts: [Vec<f32>; 3] =
            [vec![self.low.x, self.high.x], vec![self.low.y, self.high.y], vec![0.0, top]];

        for o in &self.openings {
            cuts[usize::from(!o.wall.along_x())].extend(o.span);
            cuts[2].extend(o.heights);
        }
        if self.heights_m[0] != self.heights_m[1] {
            cuts[2].push(KNEE_M);
        }

        let well = self.stairwell.map(|well| [well.low, well.high]);
        for corner in self.ceiling_hole.iter().chain(&well).flatten() {
            cuts[0].push(corner.x);
            cuts[1].push(corner.y);
        }

        let [xs, ys, zs] = cuts;
        let xs = subdivided(xs, 0.0);
        let ys = subdivided(ys, 0.0);
        let zs = subdivided(zs, self.floor_m);

        let inside = |p: Vec2| (p - self.low) / (self.high - self.low);
        b.begin(Class::FLOOR);
        let floor = self.bake_level(
            b.light(),
            |p| p.extend(0.0),
            Vec3::Z,
            FLOOR_PER_M * scale,
            |p| self.floor.at(p.x, p.y),
        );

        let floor = b.texture(format!("{name}_floor"), floor, Wrap::Clamp);
        let place = |x, y| (vec3(x, y, 0.0), inside(vec2(x, y)));
        b.baked(lattice(&xs, &ys, place, |p| !is_in(well, p)), floor);
        if let Some(well) = self.stairwell {
            rim(b, well);
        }

        b.begin(Class::CEILING);
        let slope = (self.heights_m[1] - self.heights_m[0]) / (self.high.y - self.low.y);
        let normal = vec3(0.0, slope, -1.0).normalize();

        let ceiling = self.bake_level(
            b.light(),
            |p| p.extend(self.ceiling_at(p.y)),
            normal,
            CEILING_PER_M * scale,
            |p| self.ceiling.at(p.x - self.low.x, p.y - self.low.y),
        );
        let ceiling = b.texture(format!("{name}_ceiling"), ceiling, Wrap::Clamp);

        // Rows from large to small y, so that the front is below.
        let rows: Vec<f32> = ys.iter().rev().copied().collect();
        let place = |x, y| (vec3(x, y, self.squeezed(y, top)), inside(vec2(x, y)));
        b.baked(lattice(&xs, &rows, place, |p| !is_in(self.ceiling_hole, p)), ceiling);

        self.build_walls(b, name, [&xs, &ys, &zs]);
    }

    fn build_walls(&self, b: &mut Builder, name: &str, [xs, ys, zs]: [&[f32]; 3]) {
        let top = self.top();
        let texels = |length_m: f32| texels(length_m, WALL_PER_M * b.texture_scale());
        let rows = texels(top);
        let columns = Wall::ALL.map(|wall| texels(self.length(wall)));
        let all: u32 = columns.iter().sum();
        let mut image = Raster::filled(all, rows, [0; 3]);

        let mut first = 0;
        let mut offsets = [0; 4];
        for (k, wall) in Wall::ALL.into_iter().enumerate() {
            offsets[k] = first;
            let start = self.on_wall(
                wall,
                if matches!(wall, Wall::South | Wall::East) {
                    f32::MAX
                } else {
                    f32::MIN
                },
            );

            let start = start.clamp(self.low, self.high);
            let paint = self
                .accent
                .filter(|(w, _)| *w == wall)
                .map_or(self.paint, |(_, paint)| paint);

            let band = bake(b.light(), [columns[k], rows], |u, v| {
                let along = u * self.length(wall);
                let up = (1.0 - v) * top;
                let p = (start + wall.right() * along).extend(up);
                (p, wall.normal(), paint.at(along, up))
            });

            for y in 0..rows {
                let row = (y * all + first) as usize;
                image.pixels_mut()[row..row + columns[k] as usize].copy_from_slice(band.row(y));
            }
            first += columns[k];
        }

        let texture = b.texture(format!("{name}_walls"), image, Wrap::Clamp);
        for (k, wall) in Wall::ALL.into_iter().enumerate() {
            let mut along = if wall.along_x() { xs.to_vec() } else { ys.to_vec() };
            if matches!(wall, Wall::South | Wall::East) {
                along.reverse();
            }
            let start = along[0];

            let place = |s: f32, z: f32| {
                let foot = self.on_wall(wall, s);
                let z = self.squeezed(foot.y, z);
                let u = offsets[k] as f32 + (s - start).abs() / self.length(wall) * columns[k] as f32;
                (foot.extend(z), vec2(u / all as f32, z / top))
            };

            b.begin(Class::WALL);
            b.baked(
                lattice(&along, zs, place, |p| !self.openings.iter().any(|o| covers(o, p, wall))),
                texture,
            );
        }
    }

    /// Returns the height at `y` of a point that is at height `z` in the room without a slant.
    fn squeezed(&self, y: f32, z: f32) -> f32 {
        let top = self.top();
        if z <= KNEE_M || self.heights_m[0] == self.heights_m[1] {
            z
        } else {
            KNEE_M + (z - KNEE_M) * (self.ceiling_at(y) - KNEE_M) / (top - KNEE_M)
        }
    }

    fn bake_level(
        &self,
        light: &Light,
        place: impl Fn(Vec2) -> Vec3,
        normal: Vec3,
        per_m: f32,
        color: impl Fn(Vec2) -> [f32; 3],
    ) -> Raster<[u8; 3]> {
        let size = self.high - self.low;
        bake(light, [texels(size.x, per_m), texels(size.y, per_m)], |u, v| {
            let p = self.low + size * vec2(u, 1.0 - v);
            (place(p), normal, color(p))
        })
    }
}

fn is_in(hole: Option<[Vec2; 2]>, p: Vec2) -> bool {
    hole.is_some_and(|[a, c]| p.cmpgt(a).all() && p.cmplt(c).all())
}

fn covers(o: &Opening, p: Vec2, wall: Wall) -> bool {
    let s = o.span;
    let z = o.heights;
    o.wall == wall && p.x > s[0] && p.x < s[1] && p.y > z[0] && p.y < z[1]
}

/// The sides of a stairwell, seen from within.
fn rim(b: &mut Builder, Stairwell { low, high, depth_m }: Stairwell) {
    let ring = [low, vec2(low.x, high.y), high, vec2(high.x, low.y)];
    for (k, from) in ring.into_iter().enumerate() {
        let to = ring[(k + 1) % ring.len()];
        b.panel([from.extend(-depth_m), to.extend(-depth_m), to.extend(0.0), from.extend(0.0)], WHITE);
    }
}

/// The number of texels along a length, at least one.
fn texels(length_m: f32, per_m: f32) -> u32 {
    ((length_m * per_m) as u32).max(1)
}

/// Makes the image of a surface. `surface` gives place, normal and unlit colour at (u, v) in 0..1, v
/// downwards.
fn bake(
    light: &Light,
    size: [u32; 2],
    surface: impl Fn(f32, f32) -> (Vec3, Vec3, [f32; 3]),
) -> Raster<[u8; 3]> {
    // Light changes slowly: it is computed at every fourth pixel and interpolated.
    const STEP: u32 = 4;
    let [w, h] = size;

    let at = |x: f32, y: f32| surface((x + 0.5) / w as f32, (y + 0.5) / h as f32);
    let nx = w / STEP + 2;
    let ny = h / STEP + 2;

    let lit: Vec<f32> = (0..nx * ny)
        .map(|i| {
            let (p, n, _) = at((i % nx * STEP) as f32, (i / nx * STEP) as f32);
            light.at(p, n)
        })
        .collect();

    let pixels = (0..w * h).map(|i| {
        let x = i % w;
        let y = i / w;
        let fx = (x % STEP) as f32 / STEP as f32;
        let fy = (y % STEP) as f32 / STEP as f32;
        let k = (y / STEP * nx + x / STEP) as usize;
        let row = |k: usize| lit[k] + (lit[k + 1] - lit[k]) * fx;
        let lit = row(k) + (row(k + nx as usize) - row(k)) * fy;
        to_bytes(at(x as f32, y as f32).2.map(|c| c * lit))
    });
    Raster::from_vec(w, h, pixels.collect())
}

/// Makes the quads between the lines `us` and `vs` whose middles `keep` accepts. `place` gives a corner and
/// its texture coordinate. Fronts look along u × v.
fn lattice(
    us: &[f32],
    vs: &[f32],
    place: impl Fn(f32, f32) -> (Vec3, Vec2),
    keep: impl Fn(Vec2) -> bool,
) -> MeshParts {
    let mut parts = MeshParts::default();
    let mut known = vec![NO_INDEX; us.len() * vs.len()];
    for (j, v) in vs.windows(2).enumerate() {
        for (i, u) in us.windows(2).enumerate() {
            if !keep(0.5 * vec2(u[0] + u[1], v[0] + v[1])) {
                continue;
            }

            let [a, b, c, d] = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)].map(|(i, j)| {
                let slot = &mut known[j * us.len() + i];
                if *slot == NO_INDEX {
                    *slot = parts.positions.len() as u32;
                    let (position, uv) = place(us[i], vs[j]);
                    parts.positions.push(position);
                    parts.uvs.push(uv);
                }
                *slot
            });
            parts.faces.extend([[a, b, c], [a, c, d]]);
        }
    }

    parts.face_uvs = parts.faces.clone();
    parts
}

/// Sorts `cuts` and adds more between them, so that no step is longer than a cell. Cuts that the builder
/// would move to one place become one: doors that face one another across a hallway begin at the same place
/// but for rounding. `raised_m` is added to the cuts later.
fn subdivided(mut cuts: Vec<f32>, raised_m: f32) -> Vec<f32> {
    cuts.sort_by(f32::total_cmp);
    cuts.dedup_by(|a, b| coincide(*a + raised_m, *b + raised_m));
    let mut all = vec![cuts[0]];
    for pair in cuts.windows(2) {
        let n = ((pair[1] - pair[0]) / CELL_M).ceil().max(1.0);
        all.extend((1..n as u32).map(|i| pair[0] + (pair[1] - pair[0]) * i as f32 / n));
        all.push(pair[1]);
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn cuts_are_kept_and_steps_are_short() {
        let all = subdivided(vec![4.5, 0.0, 1.3, 0.0, 1.5, 1.300001], 0.0);
        assert!([0.0, 1.3, 1.5, 4.5].iter().all(|c| all.contains(c)));
        assert!(
            all.windows(2)
                .all(|p| p[1] > p[0] + 0.1 && p[1] - p[0] <= CELL_M + 1e-6)
        );
    }
}
