//! Dense, uniform sampling of the surface of a mesh into a coloured cloud.
//!
//! The published clouds were made like this: densely and uniformly from the textured mesh.

mod patch;

use crate::wide::{self, Kernel};
use crate::{PointCloud, TriMesh};
use glam::Vec3;
use patch::{Patch, PointColor};
use rand::{Rng, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rayon::prelude::*;
use std::ops::Range;

/// The number of points to draw.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(feature = "serde", derive(serde::Serialize, serde::Deserialize))]
pub enum Density {
    /// Points per square metre of the sampled faces. The total is rounded to the nearest whole number, half
    /// up.
    PerM2(f64),
    /// The total number of points.
    Total(u64),
}

/// The largest number of points. Beyond it, `f64` does not tell neighbouring points apart.
const MAX_POINTS: u64 = 1 << 52;

/// The random words of a point: one for its place along the cumulative area, two for its place in the
/// triangle.
const WORDS: u128 = 3;

/// The number of points that one task draws.
const CHUNK: usize = 4096;

/// The number of points that are placed before their colours are looked up. Meanwhile the pixels arrive from
/// memory.
const BLOCK: usize = 256;

/// Draws points evenly from the surface of a mesh, in pieces of any size.
///
/// Point i of N is at (i + uᵢ)/N of the cumulative area of the faces, where uᵢ is random in [0, 1). Its
/// place in the triangle is uniform. The points are therefore in the order of the faces, every stretch of
/// surface has its share of points to within two, and any range of points can be drawn alone. The random
/// numbers of a point depend on the seed and its index only.
///
/// ```
/// use s3d_geom::{Density, PointCloud, SurfaceSampler, TriMesh, glam::Vec3};
///
/// let mesh = TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
/// let sampler = SurfaceSampler::new(&mesh, Density::PerM2(1000.0), 7);
/// let mut cloud = PointCloud::default();
/// sampler.sample(100..200, &mut cloud);
/// assert_eq!((sampler.len(), cloud.len()), (500, 100));
/// # Ok::<(), s3d_geom::MeshError>(())
/// ```
#[derive(Clone, Debug)]
pub struct SurfaceSampler<'m> {
    mesh: &'m TriMesh,
    faces: Vec<u32>,
    /// For each face, its end along the cumulative area, counted in points. Ascending; the last is infinite.
    ends: Vec<f64>,
    len: u64,
    rng: ChaCha8Rng,
}

impl<'m> SurfaceSampler<'m> {
    /// Samples all faces, in order.
    ///
    /// # Panics
    /// If a density is negative or not finite.
    pub fn new(mesh: &'m TriMesh, density: Density, seed: u64) -> Self {
        Self::over_faces(mesh, (0..mesh.faces().len() as u32).collect(), density, seed)
    }

    /// Samples only `faces`, in their order. A face listed twice is sampled twice. Without faces, there are
    /// no points.
    ///
    /// # Panics
    /// If a density is negative or not finite, or if the mesh does not have one of `faces`.
    pub fn over_faces(mesh: &'m TriMesh, faces: Vec<u32>, density: Density, seed: u64) -> Self {
        let mut area = 0.0;
        let mut ends: Vec<f64> = Vec::with_capacity(faces.len());
        for &face in &faces {
            area += mesh.area(face);
            ends.push(area);
        }

        let wanted = match density {
            Density::PerM2(per_m2) => {
                assert!(per_m2.is_finite() && per_m2 >= 0.0, "a density of {per_m2} points per square metre");
                // The conversion saturates.
                (area * per_m2 + 0.5).floor() as u64
            }
            Density::Total(total) => total,
        };
        let len = if faces.is_empty() { 0 } else { wanted.min(MAX_POINTS) };

        for end in &mut ends {
            *end *= len as f64 / area;
        }
        if let Some(last) = ends.last_mut() {
            *last = f64::INFINITY;
        }
        Self { mesh, faces, ends, len, rng: ChaCha8Rng::seed_from_u64(seed) }
    }

    /// Returns the number of all points, at most 2⁵².
    pub fn len(&self) -> u64 {
        self.len
    }

    /// Returns true if there is no point to draw.
    pub fn is_empty(&self) -> bool {
        self.len == 0
    }

    /// Returns the sampled faces, in the order of the points.
    pub fn faces(&self) -> &[u32] {
        &self.faces
    }

    /// Returns the number of points on the faces before `position` in [`SurfaceSampler::faces`]. The points
    /// of the faces `a..b` of that list are `points_before(a)..points_before(b)`.
    ///
    /// # Panics
    /// If `position` is greater than the length of the list.
    pub fn points_before(&self, position: usize) -> u64 {
        if position == 0 || self.len == 0 {
            assert!(position <= self.faces.len(), "position {position} of {}", self.faces.len());
            return 0;
        }

        // Point i is in [i, i + 1], so only the points next to the boundary have to be computed.
        let end = self.ends[position - 1];
        let guess = (end.floor() as u64).min(self.len);
        let mut rng = self.rng.clone();
        let mut before = guess.saturating_sub(1);
        while before < self.len {
            rng.set_word_pos(u128::from(before) * WORDS);
            if place(&mut rng, before) >= end {
                break;
            }
            before += 1;
        }
        before
    }

    /// Draws the points `range` into `out`: positions, colours and faces. The old content of `out` is
    /// replaced.
    ///
    /// Runs on all threads of the current rayon pool. The points are the same for any number of threads and
    /// any split into ranges.
    ///
    /// # Panics
    /// If the range ends beyond [`SurfaceSampler::len`], or is too long for memory.
    #[expect(clippy::expect_used, reason = "a caller's mistake: see Panics")]
    pub fn sample(&self, range: Range<u64>, out: &mut PointCloud) {
        assert!(range.end <= self.len, "points {range:?} of {}", self.len);
        let n = usize::try_from(range.end.saturating_sub(range.start)).expect("points that fit into memory");
        out.positions.resize(n, Default::default());
        out.colors.resize(n, Default::default());
        out.faces.resize(n, 0);
        out.positions
            .par_chunks_mut(CHUNK)
            .zip(out.colors.par_chunks_mut(CHUNK))
            .zip(out.faces.par_chunks_mut(CHUNK))
            .enumerate()
            .for_each(|(chunk, ((positions, colors), faces))| {
                let first = range.start + (chunk * CHUNK) as u64;
                wide::run(Draw { sampler: self, first, positions, colors, faces });
            });
    }
}

/// A draw of points from `first` on, as many as the slices hold.
struct Draw<'a> {
    sampler: &'a SurfaceSampler<'a>,
    first: u64,
    positions: &'a mut [Vec3],
    colors: &'a mut [[u8; 3]],
    faces: &'a mut [u32],
}

impl Kernel for Draw<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Draw { sampler, first, positions, colors, faces } = self;
        let mut rng = sampler.rng.clone();
        rng.set_word_pos(u128::from(first) * WORDS);

        let mut position = usize::MAX;
        let mut patch = None;
        let mut awaited = Vec::with_capacity(BLOCK);
        let mut i = first;
        let blocks = positions
            .chunks_mut(BLOCK)
            .zip(colors.chunks_mut(BLOCK))
            .zip(faces.chunks_mut(BLOCK));
        for ((positions, colors), faces) in blocks {
            for (k, ((point, color), face)) in positions.iter_mut().zip(&mut *colors).zip(faces).enumerate() {
                let place = place(&mut rng, i);
                i += 1;

                // The first face is searched; later ones follow.
                if position == usize::MAX {
                    position = sampler.ends.partition_point(|&end| end <= place);
                }
                while sampler.ends[position] <= place {
                    position += 1;
                    patch = None;
                }

                let patch = patch.get_or_insert_with(|| Patch::new(sampler.mesh, sampler.faces[position]));
                let weights = barycentric(unit(&mut rng), unit(&mut rng));
                *point = patch.point(weights);
                *face = sampler.faces[position];
                match patch.color(weights) {
                    PointColor::Known(known) => *color = known,
                    texels => {
                        texels.prefetch();
                        awaited.push((k, texels));
                    }
                }
            }

            for (k, texels) in awaited.drain(..) {
                colors[k] = texels.rounded();
            }
        }
    }
}

/// Draws a number uniform in [0, 1).
#[inline(always)]
fn unit(rng: &mut ChaCha8Rng) -> f64 {
    f64::from(rng.next_u32()) * (1.0 / 4_294_967_296.0)
}

/// Returns the place of point `i` along the cumulative area, counted in points: in [i, i + 1], ascending with
/// i. `rng` is at the first word of the point.
#[inline(always)]
fn place(rng: &mut ChaCha8Rng, i: u64) -> f64 {
    i as f64 + unit(rng)
}

/// Maps the unit square uniformly to a triangle, by folding the upper half of the square onto the lower.
#[inline(always)]
fn barycentric(u: f64, v: f64) -> [f64; 3] {
    let (u, v) = if u + v > 1.0 { (1.0 - u, 1.0 - v) } else { (u, v) };
    [1.0 - u - v, u, v]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Aabb, FaceColor, Material, MeshParts, Raster, Texture, Wrap};
    use glam::{Vec2, vec2, vec3};
    use proptest::prelude::*;

    /// Returns a tilted fan of triangles around the origin, with very different areas.
    fn fan(spokes: u32) -> TriMesh {
        let mut positions = vec![Vec3::ZERO];
        for i in 0..=spokes {
            let (s, c) = libm::sincosf(i as f32 * 0.37);
            let r = 0.3 + 2.0 * (i * i % 7) as f32;
            positions.push(vec3(r * c, r * s, 0.5 * r * s + 0.1 * i as f32));
        }
        TriMesh::from_faces(positions, (0..spokes).map(|i| [0, i + 1, i + 2]).collect()).unwrap()
    }

    fn draw(sampler: &SurfaceSampler<'_>) -> PointCloud {
        let mut cloud = PointCloud::default();
        sampler.sample(0..sampler.len(), &mut cloud);
        cloud
    }

    fn chi_square(counts: &[f64], expected: &[f64]) -> f64 {
        counts.iter().zip(expected).map(|(c, e)| (c - e) * (c - e) / e).sum()
    }

    #[test]
    fn every_face_has_its_share_of_points() {
        let mesh = fan(17);
        let sampler = SurfaceSampler::new(&mesh, Density::Total(20_000), 1);
        let cloud = draw(&sampler);
        let mut counts = vec![0.0; 17];
        cloud.faces.iter().for_each(|&f| counts[f as usize] += 1.0);
        let expected: Vec<f64> = (0..17)
            .map(|f| mesh.area(f) / mesh.total_area() * cloud.len() as f64)
            .collect();
        for (c, e) in counts.iter().zip(&expected) {
            assert!((c - e).abs() < 2.0, "{c} points where {e} were due");
        }
        // 16 degrees of freedom, 5 %: 26.30.
        assert!(chi_square(&counts, &expected) < 26.30);
    }

    #[test]
    fn a_face_of_less_than_a_point_has_its_share_over_many_seeds() {
        let mesh = fan(17);
        let mut counts = vec![0.0; 17];
        for seed in 0..4000 {
            draw(&SurfaceSampler::new(&mesh, Density::Total(5), seed))
                .faces
                .iter()
                .for_each(|&f| counts[f as usize] += 1.0);
        }
        let expected: Vec<f64> = (0..17).map(|f| mesh.area(f) / mesh.total_area() * 20_000.0).collect();
        // 16 degrees of freedom, 1 %: 32.00.
        let x = chi_square(&counts, &expected);
        assert!(x < 32.00, "{x}: {counts:?} for {expected:?}");
    }

    #[test]
    fn points_are_uniform_within_a_face() {
        let mesh = TriMesh::from_faces(
            vec![vec3(1.0, 2.0, 3.0), vec3(5.0, 2.5, 1.0), vec3(0.0, 9.0, 4.0)],
            vec![[0, 1, 2]],
        );
        let mesh = mesh.unwrap();
        let cloud = draw(&SurfaceSampler::new(&mesh, Density::Total(64_000), 3));

        // Every edge is cut in 8. This makes 64 triangles of equal area, 36 upright and 28 upside down.
        let mut counts = [0.0; 64];
        let [a, b, c] = mesh.triangle(0).map(|p| p.as_dvec3());
        let n = (b - a).cross(c - a);
        for p in &cloud.positions {
            let d = p.as_dvec3() - a;
            let u = (d.cross(c - a).dot(n) / n.length_squared() * 8.0).clamp(0.0, 7.999_999);
            let v = ((b - a).cross(d).dot(n) / n.length_squared() * 8.0).clamp(0.0, 7.999_999);
            let upside_down = u.fract() + v.fract() > 1.0;
            // The triangles upside down fill the 28 places above the diagonal.
            let i = u as usize;
            let j = v as usize;
            let bin = if upside_down { (7 - i) * 8 + (7 - j) } else { i * 8 + j };
            counts[bin] += 1.0;
        }

        // 63 degrees of freedom, 5 %: 82.53.
        let x = chi_square(&counts, &[1000.0; 64]);
        assert!(x < 82.53, "{x}: {counts:?}");
    }

    #[test]
    fn points_are_on_the_face_that_they_carry() {
        let mesh = fan(23);
        let cloud = draw(&SurfaceSampler::new(&mesh, Density::PerM2(100.0), 5));
        assert!(cloud.len() > 1000);
        for (p, &f) in cloud.positions.iter().zip(&cloud.faces) {
            assert!(Aabb::from_points(mesh.triangle(f)).contains(*p));
            let [a, b, c] = mesh.triangle(f).map(|p| p.as_dvec3());
            let n = (b - a).cross(c - a).normalize();
            let rounding = 1e-6 * p.abs().max_element().max(1e-3) as f64;
            let d = p.as_dvec3();
            assert!((d - a).dot(n).abs() < rounding);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                assert!(n.cross((to - from).normalize()).dot(d - from) > -rounding);
            }
        }
    }

    #[test]
    fn the_number_of_threads_changes_nothing() {
        let mesh = fan(9);
        let sampler = SurfaceSampler::new(&mesh, Density::Total(50_000), 11);
        let with = |threads| {
            rayon::ThreadPoolBuilder::new()
                .num_threads(threads)
                .build()
                .unwrap()
                .install(|| draw(&sampler))
        };
        assert_eq!(with(1), with(2));
    }

    #[test]
    fn a_seed_is_a_cloud() {
        let mesh = fan(9);
        let of = |seed| draw(&SurfaceSampler::new(&mesh, Density::Total(1000), seed));
        assert_eq!(of(4), of(4));
        assert_ne!(of(4).positions, of(5).positions);
    }

    fn points_of(density: Density, mesh: &TriMesh) -> u64 {
        SurfaceSampler::new(mesh, density, 0).len()
    }

    #[test]
    fn number_of_points() {
        let mesh = fan(9);
        let area = mesh.total_area();
        assert_eq!(points_of(Density::Total(0), &mesh), 0);
        assert_eq!(points_of(Density::Total(123), &mesh), 123);
        assert_eq!(points_of(Density::PerM2(0.0), &mesh), 0);
        assert_eq!(points_of(Density::PerM2(7.4 / area), &mesh), 7);
        assert_eq!(points_of(Density::PerM2(7.6 / area), &mesh), 8);
        assert_eq!(points_of(Density::PerM2(0.4 / area), &mesh), 0);
        assert_eq!(points_of(Density::PerM2(1e300), &mesh), MAX_POINTS);
        assert!(draw(&SurfaceSampler::new(&mesh, Density::Total(0), 0)).is_empty());
    }

    #[test]
    fn no_face_has_no_point() {
        let mesh = fan(2);
        let sampler = SurfaceSampler::over_faces(&mesh, vec![], Density::Total(10), 0);
        assert!(sampler.is_empty() && draw(&sampler).is_empty());
        assert_eq!(sampler.points_before(0), 0);
    }

    #[test]
    fn a_mesh_as_large_as_numbers_go() {
        let far = 3e38;
        let mesh =
            TriMesh::from_faces(vec![Vec3::splat(-far), Vec3::X * far, Vec3::Y * far], vec![[0, 1, 2]])
                .unwrap();
        let sampler = SurfaceSampler::new(&mesh, Density::PerM2(1.0), 0);
        assert_eq!(sampler.len(), MAX_POINTS);
        let mut cloud = PointCloud::default();
        sampler.sample(MAX_POINTS - 10..MAX_POINTS, &mut cloud);
        assert!(cloud.len() == 10 && cloud.positions.iter().all(|p| p.is_finite()));
    }

    #[test]
    #[should_panic(expected = "a density of -1 points")]
    fn a_negative_density_is_a_callers_mistake() {
        let _ = SurfaceSampler::new(&fan(1), Density::PerM2(-1.0), 0);
    }

    #[test]
    #[should_panic(expected = "a density of NaN points")]
    fn a_density_that_is_no_number_is_a_callers_mistake() {
        let _ = SurfaceSampler::new(&fan(1), Density::PerM2(f64::NAN), 0);
    }

    #[test]
    #[should_panic(expected = "points 5..11 of 10")]
    fn points_past_the_end_are_a_callers_mistake() {
        SurfaceSampler::new(&fan(1), Density::Total(10), 0).sample(5..11, &mut PointCloud::default());
    }

    /// Returns the unit square as two triangles, with texture coordinates `scale` times as large.
    fn textured_square(image: Raster<[u8; 3]>, wrap: Wrap, scale: f32) -> TriMesh {
        TriMesh::new(MeshParts {
            positions: vec![Vec3::ZERO, Vec3::X, vec3(1.0, 1.0, 0.0), Vec3::Y],
            faces: vec![[0, 1, 2], [0, 2, 3]],
            uvs: [Vec2::ZERO, Vec2::X, Vec2::ONE, Vec2::Y].map(|uv| uv * scale).to_vec(),
            face_uvs: vec![[0, 1, 2], [0, 2, 3]],
            materials: vec![Material { name: "m".into(), color: [0; 3], texture: Some(0) }],
            face_materials: vec![0, 0],
            textures: vec![Texture { name: "t".into(), image, wrap: [wrap; 2] }],
            ..MeshParts::default()
        })
        .unwrap()
    }

    #[test]
    fn colours_follow_a_gradient() {
        // Red grows by 2 per pixel to the right, green by 3 per pixel downwards.
        let pixels = (0..64).flat_map(|y| (0..64).map(move |x| [2 * x as u8, 3 * y as u8, 77]));
        let image = Raster::from_vec(64, 64, pixels.collect());
        let cloud =
            draw(&SurfaceSampler::new(&textured_square(image, Wrap::Clamp, 1.0), Density::Total(5000), 2));
        for (p, color) in cloud.positions.iter().zip(&cloud.colors) {
            let x = (p.x * 64.0 - 0.5).clamp(0.0, 63.0);
            let y = ((1.0 - p.y) * 64.0 - 0.5).clamp(0.0, 63.0);
            assert!((f32::from(color[0]) - 2.0 * x).abs() <= 0.501, "{color:?} at {p}");
            assert!((f32::from(color[1]) - 3.0 * y).abs() <= 0.501, "{color:?} at {p}");
            assert_eq!(color[2], 77);
        }
    }

    #[test]
    fn colours_wrap_as_the_texture_says() {
        // The texture has four columns. Far from their borders, a point has the colour of one.
        let image = Raster::from_vec(4, 1, vec![[10; 3], [20; 3], [30; 3], [40; 3]]);
        for (wrap, expected) in [
            (Wrap::Repeat, [10, 20, 30, 40, 10, 20, 30, 40]),
            (Wrap::Mirror, [10, 20, 30, 40, 40, 30, 20, 10]),
            (Wrap::Clamp, [10, 20, 30, 40, 40, 40, 40, 40]),
        ] {
            let mesh = textured_square(image.clone(), wrap, 2.0);
            let cloud = draw(&SurfaceSampler::new(&mesh, Density::Total(20_000), 2));
            let mut seen = [false; 8];
            for (p, color) in cloud.positions.iter().zip(&cloud.colors) {
                let column = p.x * 8.0;
                if (column.fract() - 0.5).abs() < 0.01 {
                    assert!((i32::from(color[0]) - expected[column as usize]).abs() <= 1, "{wrap:?} at {p}");
                    seen[column as usize] = true;
                }
            }
            assert_eq!(seen, [true; 8]);
        }
    }

    #[test]
    fn colours_of_corners_are_interpolated_and_flat_ones_kept() {
        let mut parts = fan(1).into_parts();
        parts.positions = vec![Vec3::ZERO, Vec3::X, Vec3::Y];
        parts.colors = vec![[0, 100, 200], [255, 100, 0], [0, 100, 0]];
        let mesh = TriMesh::new(parts).unwrap();
        let cloud = draw(&SurfaceSampler::new(&mesh, Density::Total(1000), 2));
        for (p, c) in cloud.positions.iter().zip(&cloud.colors) {
            assert!((f32::from(c[0]) - 255.0 * p.x).abs() <= 0.501);
            assert!((f32::from(c[2]) - 200.0 * (1.0 - p.x - p.y)).abs() <= 0.501);
            assert_eq!(c[1], 100);
        }
        let plain = draw(&SurfaceSampler::new(&fan(3), Density::Total(10), 2));
        assert!(plain.colors.iter().all(|&c| c == crate::DEFAULT_COLOR));
    }

    #[test]
    fn halves_round_up() {
        let image = Raster::from_vec(2, 1, vec![[0; 3], [1; 3]]);
        let mesh = textured_square(image, Wrap::Clamp, 1.0);
        let patch = Patch::new(&mesh, 0);
        assert!(matches!(patch.color, FaceColor::Texture(_, _, [_, Vec2::X, _])));
        // The middle of the texture, where the colour is exactly ½.
        assert_eq!(patch.color([0.5, 0.0, 0.5]).rounded(), [1; 3]);
        assert_eq!(mesh.textures()[0].sample(vec2(0.5, 0.5)), [0.5; 3]);
    }

    proptest! {
        #[test]
        fn a_range_may_be_split_anywhere(
            total in 1u64..9000,
            cuts in prop::collection::vec(0.0..1.0f64, 0..6),
        ) {
            let mesh = fan(5);
            let sampler = SurfaceSampler::new(&mesh, Density::Total(total), 8);
            let mut at: Vec<u64> = cuts.iter().map(|c| (c * total as f64) as u64).chain([0, total]).collect();
            at.sort_unstable();
            let mut all = PointCloud::default();
            let mut piece = PointCloud::default();
            for w in at.windows(2) {
                sampler.sample(w[0]..w[1], &mut piece);
                all.positions.extend(&piece.positions);
                all.colors.extend(&piece.colors);
                all.faces.extend(&piece.faces);
            }
            prop_assert_eq!(all, draw(&sampler));
        }

        #[test]
        fn points_before_counts_what_sample_draws(
            order in Just((0..13u32).collect::<Vec<_>>()).prop_shuffle(),
            keep in 1usize..13,
            total in 0u64..500,
            seed: u64,
        ) {
            let mesh = fan(13);
            let faces = order[..keep].to_vec();
            let sampler = SurfaceSampler::over_faces(&mesh, faces.clone(), Density::Total(total), seed);
            let cloud = draw(&sampler);
            prop_assert_eq!(sampler.points_before(keep), total);
            for (position, &face) in faces.iter().enumerate() {
                let on = sampler.points_before(position)..sampler.points_before(position + 1);
                prop_assert_eq!(on.end - on.start, cloud.faces.iter().filter(|&&f| f == face).count() as u64);
                for i in on {
                    prop_assert_eq!(cloud.faces[i as usize], face);
                }
            }
        }
    }
}
