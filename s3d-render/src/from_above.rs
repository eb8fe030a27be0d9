//! A mesh seen straight from above, in parallel rays: the ground of a plan.

use crate::hits::NO_FACE;
use crate::shade::mip_maps::{MipMap, MipMaps, TextureFilter};
use crate::shade::patch::FaceCache;
use crate::shade::pixel_color::seen_color;
use glam::{DVec2, DVec3, dvec2};
use s3d_geom::{FaceColor, Raster, TriMesh};

/// A rectangle of square pixels over the ground, and the heights between which a mesh is seen. Columns go to
/// +X and rows to −Y: the centre of pixel (i, j) is at x = `west` + (i + ½)·`pixel_m` and
/// y = `north` − (j + ½)·`pixel_m`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct GroundGrid {
    /// The least x, metres in the world.
    pub west: f64,
    /// The greatest y, metres in the world.
    pub north: f64,
    /// The side of a pixel, metres.
    pub pixel_m: f64,
    /// The number of columns.
    pub width: u32,
    /// The number of rows.
    pub height: u32,
    /// What is lower is not seen, world z in metres.
    pub low: f64,
    /// What is higher is not seen, world z in metres.
    pub high: f64,
}

/// What is seen from above.
#[derive(Clone, Debug)]
pub struct FromAbove {
    /// The colours; black marks pixels that see nothing, and no others.
    pub rgb: Raster<[u8; 3]>,
    /// The world z of what is seen, in metres; −∞ where nothing is.
    pub z: Raster<f32>,
}

/// Returns what the pixels of `grid` see of some faces of a mesh: the highest of those that face upwards,
/// between the two heights of the grid. The faces are cut at these heights exactly. There are no gaps between
/// adjacent faces, and the order of `faces` changes nothing.
///
/// ```
/// use s3d_geom::{TriMesh, glam::vec3};
/// use s3d_render::{GroundGrid, MipMaps, image_from_above};
///
/// // A floor of 4 × 4 m, and a ceiling above it, which faces downwards.
/// let square = |z| [[0., 0.], [4., 0.], [4., 4.], [0., 4.]].map(|[x, y]| vec3(x, y, z));
/// let faces = vec![[0, 1, 2], [0, 2, 3], [4, 6, 5], [4, 7, 6]];
/// let mesh = TriMesh::from_faces([square(0.0), square(2.5)].concat(), faces)?;
/// let grid =
///     GroundGrid { west: -1.0, north: 5.0, pixel_m: 1.0, width: 6, height: 6, low: -1.0, high: 9.0 };
///
/// let seen = image_from_above(&mesh, &MipMaps::new(&mesh), 0..4, &grid);
/// assert_eq!(seen.z.at(0, 0), f32::NEG_INFINITY);
/// assert_eq!(seen.z.at(1, 1), 0.0);
/// # Ok::<(), s3d_geom::MeshError>(())
/// ```
///
/// # Panics
/// If there is no such face, or `mip_maps` are another mesh's.
pub fn image_from_above(
    mesh: &TriMesh,
    mip_maps: &MipMaps,
    faces: impl IntoIterator<Item = u32>,
    grid: &GroundGrid,
) -> FromAbove {
    let mut z = Raster::filled(grid.width, grid.height, f32::NEG_INFINITY);
    let mut seen = Raster::filled(grid.width, grid.height, NO_FACE);
    for face in faces {
        if let Some(shape) = Shape::new(mesh, face, grid) {
            shape.cover(face, grid, &mut z, &mut seen);
        }
    }

    let mut paints = FaceCache::new();
    let mut rgb = Vec::with_capacity(seen.len());
    for (j, row) in seen.rows().enumerate() {
        rgb.extend(row.iter().enumerate().map(|(i, &face)| {
            if face == NO_FACE {
                return [0; 3];
            }
            let paint = paints.get(face, || Paint::new(mesh, mip_maps, face, grid));
            seen_color(paint.at(dvec2(i as f64, j as f64)))
        }));
    }
    FromAbove { rgb: Raster::from_vec(grid.width, grid.height, rgb), z }
}

/// A face that is seen from above, in pixels: whole numbers are centres of pixels. Its corners have the order
/// in which all [`side`]s of an inner point are positive.
struct Shape {
    corners: [DVec2; 3],
    z: [f64; 3],
    /// Twice its surface in square pixels.
    twice: f64,
}

impl Shape {
    /// `None` if the face does not face upwards, or lies outside the heights of the grid.
    fn new(mesh: &TriMesh, face: u32, grid: &GroundGrid) -> Option<Self> {
        let [a, b, c] = mesh.triangle(face).map(|corner| corner.as_dvec3());
        let [low, high] = [a.z.min(b.z).min(c.z), a.z.max(b.z).max(c.z)];
        if low > grid.high || high < grid.low {
            return None;
        }
        // Rows go against y, which turns the order of the corners.
        let corners = [a, c, b].map(|corner| pixel_of(grid, corner));
        let twice = (corners[1] - corners[0]).perp_dot(corners[2] - corners[0]);
        (twice > 0.0).then_some(Self { corners, z: [a.z, c.z, b.z], twice })
    }

    /// Writes the face to the pixels in which it is the highest so far; the first of equals stays.
    fn cover(&self, face: u32, grid: &GroundGrid, z: &mut Raster<f32>, seen: &mut Raster<u32>) {
        let [a, b, c] = self.corners;
        let low = a.min(b).min(c);
        let high = a.max(b).max(c);
        let rows = whole(low.y, high.y, grid.height);
        for j in rows {
            let y = f64::from(j);
            let (from, to) = self.crossing(y);
            // Rounding may move the ends of a row by less than a pixel; the sides decide.
            let columns = whole(from.max(low.x) - 1.0, to.min(high.x) + 1.0, grid.width);
            for i in columns {
                let p = dvec2(f64::from(i), y);
                let sides = [side(b, c, p), side(c, a, p), side(a, b, p)];
                if sides.iter().any(|side| *side < 0.0) {
                    continue;
                }
                let height = sides.iter().zip(self.z).map(|(side, z)| side * z).sum::<f64>() / self.twice;
                let place = j as usize * grid.width as usize + i as usize;
                let (at, by) = (&mut z.pixels_mut()[place], &mut seen.pixels_mut()[place]);
                let value = height as f32;
                let is_seen = (grid.low..=grid.high).contains(&height);
                if is_seen && (value > *at || (value == *at && face < *by)) {
                    *at = value;
                    *by = face;
                }
            }
        }
    }

    /// Returns the least and the greatest x on the border at the height `y` of the image.
    fn crossing(&self, y: f64) -> (f64, f64) {
        let [a, b, c] = self.corners;
        let mut ends = (f64::INFINITY, f64::NEG_INFINITY);
        for (from, to) in [(a, b), (b, c), (c, a)] {
            if y < from.y.min(to.y) || y > from.y.max(to.y) {
                continue;
            }
            let xs = if from.y == to.y {
                [from.x, to.x]
            } else {
                [from.x + (to.x - from.x) * (y - from.y) / (to.y - from.y); 2]
            };
            for x in xs {
                ends = (ends.0.min(x), ends.1.max(x));
            }
        }
        ends
    }
}

/// Returns a point in pixels, of which whole numbers are centres.
fn pixel_of(grid: &GroundGrid, point: DVec3) -> DVec2 {
    dvec2(point.x - grid.west, grid.north - point.y) / grid.pixel_m - 0.5
}

/// Returns the whole numbers from `from` to `to` that are less than `end`.
fn whole(from: f64, to: f64, end: u32) -> std::ops::Range<u32> {
    // A conversion of a number out of range takes the nearest one.
    let first = from.ceil().max(0.0) as u32;
    let last = (to.floor() + 1.0).clamp(0.0, f64::from(end)) as u32;
    first..last.max(first)
}

/// Returns twice the surface of a triangle, positive if `p` is on the inner side of the edge. The two faces
/// at an edge get the same number with the other sign, so that no point lies between them.
fn side(from: DVec2, to: DVec2, p: DVec2) -> f64 {
    if (from.x, from.y) <= (to.x, to.y) {
        (to - from).perp_dot(p - from)
    } else {
        -(from - to).perp_dot(p - to)
    }
}

/// The colour of a face as a function of the pixel.
enum Paint<'a> {
    Texture {
        mip_map: MipMap<'a>,
        uv: Affine<2>,
        /// The box of the texture coordinates, out of which no rounding leads.
        min: DVec2,
        max: DVec2,
    },
    Corners(Affine<3>),
    Flat([u8; 3]),
}

impl<'a> Paint<'a> {
    fn new(mesh: &'a TriMesh, mip_maps: &'a MipMaps, face: u32, grid: &GroundGrid) -> Self {
        let corners = mesh.triangle(face).map(|corner| pixel_of(grid, corner.as_dvec3()));
        match mesh.color_of(face) {
            FaceColor::Texture(index, texture, uvs) => {
                let uvs = uvs.map(|uv| uv.as_dvec2());
                Self::Texture {
                    mip_map: mip_maps.mip_map(index, texture),
                    uv: Affine::new(corners, uvs.map(|uv| uv.to_array())),
                    min: uvs[0].min(uvs[1]).min(uvs[2]),
                    max: uvs[0].max(uvs[1]).max(uvs[2]),
                }
            }
            FaceColor::Corners(colors) => {
                Self::Corners(Affine::new(corners, colors.map(|color| color.map(f64::from))))
            }
            FaceColor::Flat(color) => Self::Flat(color),
        }
    }

    fn at(&self, pixel: DVec2) -> [f32; 3] {
        match self {
            Self::Texture { mip_map, uv, min, max } => {
                let [x, y] = [uv.x, uv.y].map(DVec2::from_array);
                let at = DVec2::from_array(uv.at(pixel)).max(*min).min(*max);
                mip_map.sample(at, x, y, &TextureFilter::default())
            }
            Self::Corners(colors) => colors.at(pixel).map(|channel| channel.clamp(0.0, 255.0) as f32),
            Self::Flat(color) => color.map(f32::from),
        }
    }
}

/// Values that change evenly over the image.
struct Affine<const N: usize> {
    first: DVec2,
    value: [f64; N],
    /// The changes by column and by row.
    x: [f64; N],
    y: [f64; N],
}

impl<const N: usize> Affine<N> {
    /// The values that are given at three corners.
    fn new([a, b, c]: [DVec2; 3], values: [[f64; N]; 3]) -> Self {
        let twice = (b - a).perp_dot(c - a);
        let change = |of_b: f64, of_c: f64| -> [f64; N] {
            std::array::from_fn(|k| {
                let [of_a, at_b, at_c] = values.map(|value| value[k]);
                (of_b * (at_b - of_a) + of_c * (at_c - of_a)) / twice
            })
        };
        let [to_b, to_c] = [b - a, c - a];
        Self { first: a, value: values[0], x: change(to_c.y, -to_b.y), y: change(-to_c.x, to_b.x) }
    }

    fn at(&self, pixel: DVec2) -> [f64; N] {
        let away = pixel - self.first;
        std::array::from_fn(|k| self.value[k] + self.x[k] * away.x + self.y[k] * away.y)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::caster::cast_ray;
    use crate::scene::Scene;
    use glam::{Vec3, dvec3, vec2, vec3};
    use s3d_geom::{Material, MeshParts, Texture, Wrap};

    /// Numbers from 0 to 1 that look random.
    fn noise(seed: u32) -> f32 {
        let mixed = (seed ^ 0x9e37_79b9).wrapping_mul(0x85eb_ca6b);
        (mixed ^ (mixed >> 13)).wrapping_mul(0xc2b2_ae35) as f32 / u32::MAX as f32
    }

    /// A hilly ground of 12 × 12 squares, with a corner of each cut by the heights.
    fn hills() -> TriMesh {
        let side = 13u32;
        let positions: Vec<Vec3> = (0..side * side)
            .map(|k| {
                let [x, y] = [k % side, k / side].map(|c| c as f32);
                vec3(x + 0.4 * noise(3 * k), y + 0.4 * noise(3 * k + 1), 2.0 * noise(3 * k + 2))
            })
            .collect();
        let colors = (0..side * side)
            .map(|k| [0, 1, 2].map(|c| (255.0 * noise(7 * k + c)) as u8))
            .collect();
        let faces = (0..side - 1)
            .flat_map(|y| (0..side - 1).map(move |x| y * side + x))
            .flat_map(|a| [[a, a + 1, a + side], [a + 1, a + side + 1, a + side]])
            .collect();
        TriMesh::from_faces(positions, faces)
            .unwrap()
            .with_vertex_colors(colors)
    }

    const GRID: GroundGrid =
        GroundGrid { west: -0.3, north: 12.7, pixel_m: 0.11, width: 120, height: 119, low: 0.3, high: 1.6 };

    #[test]
    fn pixels_see_what_rays_from_above_hit() {
        let mesh = hills();
        let all = 0..mesh.faces().len() as u32;
        let seen = image_from_above(&mesh, &MipMaps::new(&mesh), all.clone(), &GRID);
        let backwards = image_from_above(&mesh, &MipMaps::new(&mesh), all.rev(), &GRID);
        assert_eq!((&seen.rgb, &seen.z), (&backwards.rgb, &backwards.z));

        let scene = Scene::new(&mesh);
        let mut counts = [0; 2];
        for (j, i) in (0..GRID.height).flat_map(|j| (0..GRID.width).map(move |i| (j, i))) {
            let x = GRID.west + (f64::from(i) + 0.5) * GRID.pixel_m;
            let y = GRID.north - (f64::from(j) + 0.5) * GRID.pixel_m;
            // The hills do not overlap, so that a ray meets one face.
            let hit = cast_ray(&scene, dvec3(x, y, 9.0), DVec3::NEG_Z).map(|hit| 9.0 - hit.t);
            let expected = hit.filter(|z| (GRID.low..=GRID.high).contains(z));
            let z = f64::from(seen.z.at(i, j));
            match expected {
                Some(expected) => assert!((z - expected).abs() < 1e-5, "({i}, {j}): {z}, {expected}"),
                None => assert_eq!(z, f64::NEG_INFINITY, "({i}, {j}): {hit:?}"),
            }
            assert_eq!(seen.rgb.at(i, j) == [0; 3], expected.is_none());
            counts[usize::from(expected.is_some())] += 1;
        }
        assert!(counts.iter().all(|count| *count > 2000), "{counts:?}");
    }

    #[test]
    fn colors_of_corners_are_interpolated() {
        let corners = vec![vec3(0.0, 0.0, 1.0), vec3(10.0, 0.0, 1.0), vec3(0.0, 10.0, 1.0)];
        let colors = vec![[0, 50, 9], [200, 50, 9], [0, 250, 9]];
        let mesh = TriMesh::from_faces(corners, vec![[0, 1, 2]])
            .unwrap()
            .with_vertex_colors(colors);
        let grid =
            GroundGrid { west: 0.0, north: 10.0, pixel_m: 1.0, width: 10, height: 10, low: 0.0, high: 2.0 };
        let seen = image_from_above(&mesh, &MipMaps::new(&mesh), [0], &grid);
        // Pixel (2, 6) is around x = 2.5, y = 3.5.
        assert_eq!(seen.rgb.at(2, 6), [50, 120, 9]);
        assert_eq!(seen.rgb.at(9, 0), [0; 3]);
    }

    #[test]
    fn textures_are_filtered_over_a_pixel() {
        let chequers = (0..64).map(|k| [if (k + k / 8) % 2 == 0 { 50 } else { 150 }; 3]);
        let image = Raster::from_vec(8, 8, chequers.collect());
        let mesh = TriMesh::new(MeshParts {
            positions: vec![vec3(0.0, 0.0, 0.0), vec3(8.0, 0.0, 0.0), vec3(0.0, 8.0, 0.0)],
            faces: vec![[0, 1, 2]],
            uvs: vec![vec2(0.0, 0.0), vec2(1.0, 0.0), vec2(0.0, 1.0)],
            face_uvs: vec![[0, 1, 2]],
            materials: vec![Material { name: "floor".into(), color: [0; 3], texture: Some(0) }],
            face_materials: vec![0],
            textures: vec![Texture { name: "chequers".into(), image, wrap: [Wrap::Repeat; 2] }],
            ..MeshParts::default()
        })
        .unwrap();
        let mip_maps = MipMaps::new(&mesh);
        let grid = |pixel_m: f64, width| GroundGrid {
            west: 0.0,
            north: 8.0,
            pixel_m,
            width,
            height: width,
            low: -1.0,
            high: 1.0,
        };
        // A texel is a metre wide; the lowest row of the texture is the last one of the image.
        let fine = image_from_above(&mesh, &mip_maps, [0], &grid(1.0, 8));
        assert_eq!([fine.rgb.at(0, 7), fine.rgb.at(1, 7)], [[150; 3], [50; 3]]);
        let coarse = image_from_above(&mesh, &mip_maps, [0], &grid(4.0, 2));
        assert_eq!(coarse.rgb.at(0, 1), [100; 3]);
    }

    #[test]
    fn ceilings_and_what_is_cut_away_are_not_seen() {
        let square = |z| [[0., 0.], [4., 0.], [4., 4.], [0., 4.]].map(|[x, y]| vec3(x, y, z));
        let corners = [square(0.0), square(0.7), square(2.5), square(2.8)].concat();
        let up = |k: u32| [[k, k + 1, k + 2], [k, k + 2, k + 3]];
        let down = |k: u32| up(k).map(|[a, b, c]| [a, c, b]);
        let mesh = TriMesh::from_faces(corners, [up(0), up(4), down(8), up(12)].concat()).unwrap();
        let mip_maps = MipMaps::new(&mesh);
        let z = |low, high| {
            let grid = GroundGrid { west: 1.0, north: 3.0, pixel_m: 1.0, width: 2, height: 2, low, high };
            image_from_above(&mesh, &mip_maps, 0..8, &grid).z.at(1, 1)
        };
        assert_eq!([z(-1.0, 9.0), z(-1.0, 2.6), z(-1.0, 0.5)], [2.8, 0.7, 0.0]);
        assert_eq!(z(1.0, 2.6), f32::NEG_INFINITY);
    }
}
