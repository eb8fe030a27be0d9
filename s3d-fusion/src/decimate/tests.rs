use super::*;
use s3d_geom::glam::vec3;
use s3d_geom::primitives::grid;
use s3d_geom::{Density, MeshParts, NearestFaces, PointCloud, SurfaceSampler, TriMesh};
use s3d_synth::scenes::{furnished_room, scan_like};
use std::collections::BTreeMap;

/// A number from −1 to 1 that depends on `n` alone.
fn noise(n: usize) -> f32 {
    let mut x = (n as u64).wrapping_mul(0x9E37_79B9_7F4A_7C15) ^ 0x5851_F42D_4C95_7F2D;
    x = (x ^ (x >> 31)).wrapping_mul(0xD6E8_FEB8_6659_FD93);
    ((x >> 40) as f32 / (1u64 << 23) as f32) - 1.0
}

fn columns(parts: &MeshParts) -> MeshColumns<'_> {
    MeshColumns { positions: &parts.positions, faces: &parts.faces, colors: &parts.colors }
}

fn run(parts: &MeshParts, options: &DecimateOptions) -> Decimated {
    decimate(&columns(parts), options).unwrap()
}

/// The largest distance from points all over one mesh to another.
fn distance_m(from: &TriMesh, to: &TriMesh, points: u64) -> f32 {
    let mut cloud = PointCloud::default();
    SurfaceSampler::new(from, Density::Total(points), 1).sample(0..points, &mut cloud);
    let mut found = Vec::new();
    NearestFaces::new(to).nearest_many(&cloud.positions, &mut found);
    found.iter().map(|n| n.distance_m).fold(0.0, f32::max)
}

fn mesh(small: &Decimated) -> TriMesh {
    TriMesh::from_faces(small.positions.clone(), small.faces.clone()).unwrap()
}

/// For each edge, how many faces run along it in either direction.
fn edges(faces: &[[u32; 3]]) -> BTreeMap<[u32; 2], [u32; 2]> {
    let mut edges = BTreeMap::new();
    for f in faces {
        for i in 0..3 {
            let (a, b) = (f[i], f[(i + 1) % 3]);
            edges.entry([a.min(b), a.max(b)]).or_insert([0, 0])[usize::from(a > b)] += 1;
        }
    }
    edges
}

fn wall(cells: u32, noise_m: f32) -> MeshParts {
    let mut wall = grid(Vec3::ZERO, Vec3::X * 4.0, Vec3::Z * 3.0, [cells, cells]);
    for (i, p) in wall.positions.iter_mut().enumerate() {
        p.y += noise_m * noise(i);
    }
    wall
}

#[test]
fn a_wall_with_noise_below_the_bound_becomes_a_few_faces() {
    let wall = wall(60, 0.002);
    let small = run(&wall, &DecimateOptions::default());
    assert!(small.faces.len() < 60, "{}", small.faces.len());
    assert!(small.max_error_m < 0.003 && small.rms_error_m < 0.0016, "{small:?}");
    let old = TriMesh::new(wall).unwrap();
    assert!(distance_m(&old, &mesh(&small), 30_000) <= 0.003);

    // Peaks above the bound are not flattened.
    let rough = run(&self::wall(40, 0.008), &DecimateOptions::default());
    assert!(rough.faces.len() > 400 && rough.max_error_m <= 0.003, "{}", rough.faces.len());
}

#[test]
fn the_bound_holds_on_scans_and_the_surface_stays_a_manifold() {
    for (scan, bound) in [(scan_like(6000, 3), 0.01), (furnished_room(7), 0.003)] {
        let columns = MeshColumns { positions: scan.positions(), faces: scan.faces(), colors: &[] };
        let options = DecimateOptions { max_error_m: bound, ..DecimateOptions::default() };
        let small = decimate(&columns, &options).unwrap();
        assert!(small.faces.len() < scan.faces().len() * 2 / 3, "{}", small.faces.len());
        assert!(distance_m(&scan, &mesh(&small), 50_000) <= bound);
        assert!(small.max_error_m <= f64::from(bound));

        // No edge gets more faces, or faces of two minds, than edges had.
        let worst = |faces: &[[u32; 3]]| edges(faces).values().flatten().copied().max();
        assert!(worst(&small.faces) <= worst(scan.faces()));
        let mut sorted: Vec<_> = small
            .faces
            .iter()
            .map(|f| {
                let mut f = *f;
                f.sort();
                f
            })
            .collect();
        sorted.sort();
        sorted.dedup();
        assert_eq!(sorted.len(), small.faces.len(), "no face twice");

        // Each face looks where its old face looked.
        let new = mesh(&small);
        let turned = (0..)
            .zip(&small.face_of)
            .filter(|(i, f)| new.normal(*i).dot(scan.normal(**f)) < -0.5);
        assert!(turned.count() * 200 < small.faces.len());
    }
}

#[test]
fn any_number_of_threads_gives_the_same_bytes() {
    let wall = wall(70, 0.002);
    let options = DecimateOptions { target_faces: Some(900), ..DecimateOptions::default() };
    let on = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let run = || decimate_in_pieces(&columns(&wall), &options, [1000.0; 3], &mut |_| true).unwrap();
        pool.install(|| compact(&run(), false))
    };
    let one = on(1);
    assert_eq!(one, on(3));
    assert!((890..=900).contains(&one.faces.len()), "{}", one.faces.len());
    assert!(one.max_error_m <= 0.003);
    assert!(edges(&one.faces).values().all(|sides| sides.iter().all(|&n| n <= 1)));

    // Without a target, in rounds of pieces alone.
    let as_far_as_it_goes = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        let options = DecimateOptions::default();
        let run = || decimate_in_pieces(&columns(&wall), &options, [1000.0; 3], &mut |_| true).unwrap();
        pool.install(|| compact(&run(), false))
    };
    let rounds = as_far_as_it_goes(1);
    assert_eq!(rounds, as_far_as_it_goes(3));
    assert!(rounds.faces.len() * 10 < wall.faces.len(), "{}", rounds.faces.len());
    assert!(distance_m(&TriMesh::new(wall.clone()).unwrap(), &mesh(&rounds), 30_000) <= 0.003);
    assert!(edges(&rounds.faces).values().all(|sides| sides.iter().all(|&n| n <= 1)));
}

#[test]
fn the_border_of_a_hole_stays() {
    let mut wall = wall(40, 0.0005);
    let middle = |f: &[u32; 3]| f.iter().map(|&v| wall.positions[v as usize]).sum::<Vec3>() / 3.0;
    let is_hole = |f: &[u32; 3]| middle(f).distance(vec3(2.0, 0.0, 1.5)) < 0.6;
    let faces: Vec<[u32; 3]> = wall.faces.iter().filter(|f| !is_hole(f)).copied().collect();
    wall.faces = faces;
    let small = run(&wall, &DecimateOptions::default());
    assert!(small.faces.len() < 400, "{}", small.faces.len());

    // Every point of the old border is near the new border.
    let border = |faces: &[[u32; 3]], at: &[Vec3]| -> Vec<[Vec3; 2]> {
        let all = edges(faces)
            .into_iter()
            .filter(|(_, sides)| sides.iter().sum::<u32>() == 1);
        all.map(|(edge, _)| edge.map(|v| at[v as usize])).collect()
    };
    let new = border(&small.faces, &small.positions);
    for edge in border(&wall.faces, &wall.positions) {
        for share in [0.0, 0.3, 0.5] {
            let p = edge[0].lerp(edge[1], share);
            let nearest = new
                .iter()
                .map(|e| distance::to_segment(p, *e))
                .fold(f32::INFINITY, f32::min);
            assert!(nearest.sqrt() <= 0.003, "{p}");
        }
    }
}

#[test]
fn a_box_keeps_its_edges_and_stays_closed() {
    // Six sides that share their vertices, by position.
    let sides = [
        (Vec3::ZERO, Vec3::Y, Vec3::X),
        (Vec3::Z, Vec3::X, Vec3::Y),
        (Vec3::ZERO, Vec3::X, Vec3::Z),
        (Vec3::Y, Vec3::Z, Vec3::X),
        (Vec3::ZERO, Vec3::Z, Vec3::Y),
        (Vec3::X, Vec3::Y, Vec3::Z),
    ];
    let parts = MeshParts::merge(sides.map(|(at, u, v)| grid(at, u, v, [16, 16])));
    let (mut numbers, mut positions) = (BTreeMap::new(), Vec::new());
    let mut number = |p: Vec3| {
        *numbers
            .entry((p * 16.0).round().as_ivec3().to_array())
            .or_insert_with(|| {
                positions.push(p);
                positions.len() as u32 - 1
            })
    };
    let faces: Vec<[u32; 3]> = parts
        .faces
        .iter()
        .map(|f| f.map(|v| number(parts.positions[v as usize])))
        .collect();
    let parts = MeshParts { positions, faces, ..MeshParts::default() };

    let small = run(&parts, &DecimateOptions::default());
    assert!(small.faces.len() <= 40, "{}", small.faces.len());
    assert!(edges(&small.faces).values().all(|sides| *sides == [1, 1]), "closed");
    for corner in 0..8u32 {
        let at = vec3((corner & 1) as f32, (corner >> 1 & 1) as f32, (corner >> 2) as f32);
        assert!(small.positions.iter().any(|p| p.distance(at) < 0.003), "{at}");
    }

    // Nothing is left to collapse in a tetrahedron: two faces would lie on each other.
    let tetrahedron = MeshParts {
        positions: vec![Vec3::ZERO, Vec3::X * 1e-3, Vec3::Y * 1e-3, Vec3::Z * 1e-3],
        faces: vec![[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]],
        ..MeshParts::default()
    };
    assert_eq!(run(&tetrahedron, &DecimateOptions::default()).faces.len(), 4);
}

#[test]
fn a_flush_board_keeps_the_edge_of_its_colour() {
    let mut wall = wall(50, 0.001);
    let on_board = |p: &Vec3| p.x > 1.02 && p.x < 3.02 && p.z > 1.03 && p.z < 2.04;
    wall.colors = (0..)
        .zip(&wall.positions)
        .map(|(i, p)| {
            let shade = (6.0 * noise(i + 7)) as i32;
            let color: [i32; 3] = if on_board(p) { [40, 90, 60] } else { [210, 205, 200] };
            color.map(|c| (c + shade) as u8)
        })
        .collect();

    let difference = |small: &Decimated| {
        let new = mesh(small);
        let nearest = NearestFaces::new(&new);
        let wrong = wall.positions.iter().zip(&wall.colors).filter(|(p, c)| {
            let found = nearest.nearest(**p);
            let corners = small.faces[found.face as usize];
            let (_, weights) = distance::to_triangle(**p, corners.map(|v| small.positions[v as usize]));
            let green: f32 = corners
                .iter()
                .zip(weights)
                .map(|(v, w)| f32::from(small.colors[*v as usize][1]) * w)
                .sum();
            (green - f32::from(c[1])).abs() > 50.0
        });
        wrong.count()
    };
    let kept = run(&wall, &DecimateOptions::default());
    let blind = run(
        &wall,
        &DecimateOptions { max_color_error: 255.0, color_weight_m: 0.0, ..DecimateOptions::default() },
    );
    assert!(kept.faces.len() < wall.faces.len() / 10, "{}", kept.faces.len());
    assert!(difference(&kept) * 50 < wall.positions.len(), "{}", difference(&kept));
    assert!(difference(&blind) > 4 * difference(&kept));
}

#[test]
fn what_is_no_manifold_is_left_alone() {
    // Three sheets that share an edge of many vertices.
    let sheet = |u: Vec3| grid(Vec3::ZERO, u, Vec3::Z, [20, 20]);
    let parts = MeshParts::merge([sheet(Vec3::X), sheet(Vec3::Y), sheet(-Vec3::X)]);
    let fold = |v: u32| {
        if parts.positions[v as usize].truncate().length() < 1e-6 {
            v % 441
        } else {
            v
        }
    };
    let faces: Vec<[u32; 3]> = parts.faces.iter().map(|f| f.map(fold)).collect();
    let small = run(&MeshParts { faces, ..parts }, &DecimateOptions::default());
    let joined = edges(&small.faces)
        .values()
        .filter(|s| s.iter().sum::<u32>() == 3)
        .count();
    assert_eq!(joined, 20);
    assert!(small.faces.len() < 400);
}

#[test]
fn bad_columns_and_options_are_refused() {
    let parts = wall(2, 0.0);
    let fails = |mesh: &MeshColumns<'_>| decimate(mesh, &DecimateOptions::default()).unwrap_err().to_string();
    assert!(fails(&MeshColumns { faces: &[[0, 1, 9]], ..columns(&parts) }).contains("names vertex 9"));
    assert!(
        fails(&MeshColumns { colors: &[[0; 3]], ..columns(&parts) }).contains("1 colours for 9 vertices")
    );
    let lost = [Vec3::NAN; 9];
    assert!(fails(&MeshColumns { positions: &lost, ..columns(&parts) }).contains("vertex 0 is not finite"));
    let options = DecimateOptions { max_error_m: -1.0, ..DecimateOptions::default() };
    assert!(decimate(&columns(&parts), &options).is_err());
    assert_eq!(decimate(&MeshColumns::default(), &DecimateOptions::default()).unwrap(), Decimated::default());

    // A bound of nothing changes no place, and a face that is a point goes.
    let faces = [parts.faces[0], [4, 4, 4]];
    let options = DecimateOptions { max_error_m: 0.0, ..DecimateOptions::default() };
    let same = decimate(&MeshColumns { faces: &faces, ..columns(&parts) }, &options).unwrap();
    assert_eq!((same.faces.len(), same.positions.len(), same.face_of), (1, 3, vec![0]));
}

#[test]
fn it_tells_how_far_it_is_and_ends_when_told() {
    let wall = wall(70, 0.002);
    let in_pieces = |most: f64| {
        let mut told = Vec::new();
        let options = DecimateOptions::default();
        let whole = decimate_in_pieces(&columns(&wall), &options, [100.0; 3], &mut |share| {
            told.push(share);
            share <= most
        });
        (whole.is_some(), told)
    };
    let (is_done, told) = in_pieces(1.0);
    assert!(is_done && told.len() > 3 && told[0] == 0.0);
    assert!(told.is_sorted() && told.iter().all(|share| (0.0..1.0).contains(share)));

    let (is_done, told) = in_pieces(0.3);
    assert!(!is_done && told.last().is_some_and(|share| *share > 0.3));
    assert!(told[..told.len() - 1].iter().all(|share| *share <= 0.3));
}
