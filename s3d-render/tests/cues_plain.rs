//! Cues that are made in wide registers, or by way of a smaller graph, against their definitions pixel by
//! pixel.

use s3d_geom::glam::{DVec3, Vec3, dvec3};
use s3d_geom::{Camera, Pose, Raster, TriMesh};
use s3d_render::{
    Hits, NO_FACE, Scene, cast, color_segment_image_into, corner_image_into, euclidean_depth_image_into,
    reshading_image_into, surface_segment_image_into,
};
use s3d_synth::scenes::scan_like;

/// Calls `check` with images of a scan: of odd sizes, near a wall, of panoramas, and partly beside the scan.
fn for_each_image(mut check: impl FnMut(&Scene<'_>, &Camera, &Hits)) {
    let mesh = scan_like(20_000, 3);
    let scene = Scene::new(&mesh);
    let places = [dvec3(3.0, 2.5, 1.5), dvec3(0.12, 2.5, 1.2), dvec3(0.03, 2.5, 1.2), dvec3(-3.0, 2.5, 4.0)];
    for (n, place) in places.into_iter().enumerate() {
        let pose = Pose::level(place, 1.3 + n as f64).turned(0.0, -0.2);
        for (width, height) in [(163, 117), (64, 200), (1, 5), (5, 1)] {
            let camera = Camera::perspective(pose, 1.2, width, height);
            check(&scene, &camera, &cast(&scene, &camera));
        }
        let panorama = Camera::equirectangular(Pose::level(place, 0.3), 148);
        check(&scene, &panorama, &cast(&scene, &panorama));
    }
}

/// The normal of a face and the distance of its plane from the eye, by the winding of the face.
fn plane(mesh: &TriMesh, face: u32, eye: DVec3) -> (DVec3, f64) {
    let [a, b, c] = mesh.triangle(face).map(|corner| corner.as_dvec3());
    let normal = (b - a).cross(c - a).normalize_or_zero();
    (normal, normal.dot(a - eye))
}

fn written<T: Copy + Default>(make: impl FnOnce(&mut Raster<T>)) -> Raster<T> {
    let mut out = Raster::filled(0, 0, T::default());
    make(&mut out);
    out
}

#[test]
fn distances_and_light_are_those_of_each_pixel() {
    for_each_image(|scene, camera, hits| {
        let depth = written(|out| euclidean_depth_image_into(hits, camera, 512.0, out));
        let light = written(|out| reshading_image_into(scene, hits, camera, out));
        let rays = camera.rays();
        for (x, y, face) in pixels(hits) {
            let ray = rays.at(x, y);
            let length = if camera.is_panorama() { 1.0 } else { ray.length() };
            let distance = f64::from(hits.depth.at(x, y)) * length;
            if face == NO_FACE {
                assert_eq!((depth.at(x, y), light.at(x, y)), (65_535, 0));
                continue;
            }
            // The length of a ray is summed up in another order here.
            assert!((f64::from(depth.at(x, y)) - distance * 512.0).abs() < 0.5 + 1e-6);
            let cosine = plane(scene.mesh(), face, camera.pose.location).1.abs() / distance;
            let exact = (255.0 * 2.5 * 8.0 * cosine / (8.0 + distance * distance)).clamp(1.0, 255.0);
            assert!((f64::from(light.at(x, y)) - exact).abs() < 0.5 + 1e-6);
        }
    });
}

fn pixels(hits: &Hits) -> impl Iterator<Item = (u32, u32, u32)> {
    let width = hits.face.width();
    (0..hits.face.len() as u32).map(move |at| (at % width, at / width, hits.face.at(at % width, at / width)))
}

#[test]
fn corners_are_those_of_each_block() {
    for_each_image(|scene, camera, hits| {
        let image = written(|out| corner_image_into(scene, hits, camera, out));
        let mut levels = std::collections::BTreeMap::new();
        for (x, y, face) in pixels(hits) {
            let block = [x / 4, y / 4];
            let expected = *levels
                .entry(block)
                .or_insert_with(|| corner(scene, camera, hits, block));
            assert_eq!(image.at(x, y), if face == NO_FACE { 0 } else { expected }, "at {x}, {y}");
        }
    });
}

/// The level of a block: see [`corner_image_into`].
fn corner(scene: &Scene<'_>, camera: &Camera, hits: &Hits, [column, row]: [u32; 2]) -> u8 {
    let (width, height) = (hits.face.width(), hits.face.height());
    let (columns, rows) = (width.div_ceil(4) as i32, height.div_ceil(4) as i32);
    let rays = camera.rays();
    let sample = |column: i32, row: i32| {
        let column = if camera.is_panorama() {
            column.rem_euclid(columns)
        } else {
            column.clamp(0, columns - 1)
        };
        let x = (column as u32 * 4 + 2).min(width - 1);
        let y = (row.clamp(0, rows - 1) as u32 * 4 + 2).min(height - 1);
        let (face, depth) = (hits.face.at(x, y), hits.depth.at(x, y));
        if face == NO_FACE {
            return (Vec3::ZERO, Vec3::ZERO, f32::INFINITY);
        }
        let ray = rays.at(x, y);
        let normal = plane(scene.mesh(), face, camera.pose.location).0.as_vec3();
        let normal = if normal.dot(ray.as_vec3()) > 0.0 {
            -normal
        } else {
            normal
        };
        ((ray * f64::from(depth)).as_vec3(), normal, depth)
    };

    let pixels_per_m = if camera.is_panorama() {
        width as f32 / std::f32::consts::TAU
    } else {
        camera.k_matrix()[0][0].max(camera.k_matrix()[1][1]) as f32
    };
    let (column, row) = (column as i32, row as i32);
    let (middle, own, depth) = sample(column, row);
    let apart = ((0.15 * pixels_per_m / (depth * 4.0) / 2.0 + 0.5) as i32).max(1);
    let (mut sums, mut count, mut is_plane) = ([0f32; 6], 0f32, true);
    for dy in -2..=2 {
        for dx in -2..=2 {
            let (point, normal, _) = sample(column + dx * apart, row + dy * apart);
            if (point - middle).length_squared() > 0.15 * 0.15 {
                continue;
            }
            is_plane &= normal == own;
            let Vec3 { x, y, z } = normal;
            for (sum, square) in sums.iter_mut().zip([x * x, y * y, z * z, x * y, x * z, y * z]) {
                *sum += square;
            }
            count += 1.0;
        }
    }
    if is_plane || depth == f32::INFINITY {
        return 0;
    }
    let [xx, yy, zz, xy, xz, yz] = sums.map(|sum| sum / count);
    let determinant = xx * (yy * zz - yz * yz) - xy * (xy * zz - yz * xz) + xz * (xy * yz - yy * xz);
    (255.0 * (27.0 * determinant.max(0.0)).sqrt() + 0.5).min(255.0) as u8
}

#[test]
fn segments_of_colours_are_those_of_the_whole_graph() {
    for_each_image(|_, camera, hits| {
        // Colours of faces, so that many neighbours are alike.
        let colors = hits
            .face
            .map(|face| [face as u8 / 3, (face / 700) as u8, if face % 5 == 0 { 90 } else { 0 }]);
        let wraps = camera.is_panorama();
        let image = written(|out| color_segment_image_into(&colors, hits, wraps, out));
        let nodes = blurred(&colors, wraps);
        let expected = segments(hits, wraps, |a, b| {
            let square = |k: usize| (i32::from(nodes[a][k]) - i32::from(nodes[b][k])).pow(2);
            ((square(0) + square(1) + square(2)) as f32).sqrt() + 0.5
        });
        assert_eq!(image, expected);
    });
}

#[test]
fn segments_of_surfaces_are_those_of_the_whole_graph() {
    for_each_image(|scene, camera, hits| {
        let image = written(|out| surface_segment_image_into(scene, hits, camera, out));
        let rays = camera.rays();
        let seen = seen_pixels(hits);
        let expected = segments(hits, camera.is_panorama(), |a, b| {
            let [(from, ray, depth), (to, other_ray, other_depth)] = [a, b].map(|node| {
                let (x, y) = seen[node].expect("edges are between nodes that see something");
                (hits.face.at(x, y), rays.at(x, y), f64::from(hits.depth.at(x, y)))
            });
            if from == to {
                return 0.0;
            }
            let [from, to] = [from, to].map(|face| plane(scene.mesh(), face, camera.pose.location));
            let side = |(normal, offset): (DVec3, f64)| if offset > 0.0 { -normal } else { normal };
            let gap =
                |plane: (DVec3, f64), ray: DVec3, depth: f64| (plane.0.dot(ray) * depth - plane.1).abs();
            let gap = gap(from, other_ray, other_depth).max(gap(to, ray, depth));
            let turn = (side(from) - side(to)).length();
            (128.0 * turn + 255.0 * 20.0 * gap / depth.min(other_depth) + 0.5).min(511.0) as f32
        });
        assert_eq!(image, expected);
    });
}

/// The first pixel of each 2 × 2 that sees something.
fn seen_pixels(hits: &Hits) -> Vec<Option<(u32, u32)>> {
    let (width, height) = (hits.face.width(), hits.face.height());
    let nodes = (0..height)
        .step_by(2)
        .flat_map(|y| (0..width).step_by(2).map(move |x| (x, y)));
    nodes
        .map(|(x, y)| {
            let four = [(x, y), (x + 1, y), (x, y + 1), (x + 1, y + 1)];
            four.into_iter()
                .find(|(x, y)| *x < width && *y < height && hits.face.at(*x, *y) != NO_FACE)
        })
        .collect()
}

/// The mean colours of 2 × 2 pixels, blurred.
fn blurred(colors: &Raster<[u8; 3]>, wraps: bool) -> Vec<[u8; 3]> {
    let (full, rows) = (colors.width(), colors.height());
    let (width, height) = (full.div_ceil(2) as i32, rows.div_ceil(2) as i32);
    let mean = |x: i32, y: i32, k: usize| {
        let x = if wraps {
            x.rem_euclid(width)
        } else {
            x.clamp(0, width - 1)
        } as u32
            * 2;
        let y = y.clamp(0, height - 1) as u32 * 2;
        let (right, below) = ((x + 1).min(full - 1), (y + 1).min(rows - 1));
        let four = [(x, y), (right, y), (x, below), (right, below)];
        (four
            .into_iter()
            .map(|(x, y)| u32::from(colors.at(x, y)[k]))
            .sum::<u32>()
            + 2)
            / 4
    };
    let weights = [(-1, 1), (0, 2), (1, 1)];
    let nodes = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    nodes
        .map(|(x, y)| {
            [0, 1, 2].map(|k| {
                let across = |y: i32| {
                    weights
                        .iter()
                        .map(|(dx, weight)| weight * mean(x + dx, y, k))
                        .sum::<u32>()
                };
                let sum: u32 = weights.iter().map(|(dy, weight)| weight * across(y + dy)).sum();
                ((sum + 8) / 16) as u8
            })
        })
        .collect()
}

/// Felzenszwalb and Huttenlocher's segments of all nodes of an image, by whole differences of neighbours.
fn segments(hits: &Hits, wraps: bool, mut difference: impl FnMut(usize, usize) -> f32) -> Raster<u16> {
    let (full, rows) = (hits.face.width() as usize, hits.face.height() as usize);
    let (width, height) = (full.div_ceil(2), rows.div_ceil(2));
    let seen = seen_pixels(hits);
    let mut edges = Vec::new();
    for node in 0..width * height {
        let (x, y) = (node % width, node / width);
        let right = if x + 1 < width {
            Some(node + 1)
        } else {
            (wraps && width > 2).then_some(node + 1 - width)
        };
        let below = (y + 1 < height).then_some(node + width);
        for other in [right, below].into_iter().flatten() {
            if seen[node].is_some() && seen[other].is_some() {
                edges.push((difference(node, other).floor(), node, other));
            }
        }
    }
    edges.sort_by(|a, b| a.0.total_cmp(&b.0));

    let mut segment: Vec<usize> = (0..width * height).collect();
    let mut size = vec![1.0; width * height];
    let mut allowed = vec![300.0; width * height];
    let join = |segment: &mut Vec<usize>, size: &mut Vec<f64>, a: usize, b: usize| {
        segment.iter_mut().filter(|of| **of == b).for_each(|of| *of = a);
        size[a] += size[b];
    };
    for (difference, node, other) in &edges {
        let (a, b) = (segment[*node], segment[*other]);
        let difference = f64::from(*difference);
        if a != b && difference <= allowed[a] && difference <= allowed[b] {
            join(&mut segment, &mut size, a, b);
            allowed[a] = difference + 300.0 / size[a];
        }
    }
    for (_, node, other) in &edges {
        let (a, b) = (segment[*node], segment[*other]);
        if a != b && size[a].min(size[b]) < 50.0 {
            join(&mut segment, &mut size, a, b);
        }
    }

    let mut numbers = std::collections::BTreeMap::new();
    for node in (0..width * height).filter(|node| seen[*node].is_some()) {
        let next = numbers.len() as u16 + 1;
        numbers.entry(segment[node]).or_insert(next);
    }
    let mut image = Raster::filled(full as u32, rows as u32, 0);
    for ((x, y, face), out) in pixels(hits).zip(image.pixels_mut()) {
        if face != NO_FACE {
            *out = numbers[&segment[y as usize / 2 * width + x as usize / 2]];
        }
    }
    image
}
