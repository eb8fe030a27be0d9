//! The time to refine the labels of an image, by its size and by the size of the faces that the labels come
//! from: coarse faces open a wide band.

use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};
use s3d_label::refine::{RefineInput, refine};
use std::hint::black_box;

/// Tiles of 60 pixels in four colours with some noise, whose labels end in teeth as high as a face.
struct Image {
    size: usize,
    labels: Vec<u32>,
    colors: Vec<[u8; 3]>,
    face_px: u8,
}

impl Image {
    fn new(size: usize, face_px: u8) -> Self {
        let teeth = usize::from(face_px);
        let tile = |x: usize, y: usize| 1 + (x / 60 % 2) + 2 * (y / 60 % 2) + 4 * (x / 120 + y / 120 * 31);
        let mut state = 5u32;
        let mut noise = || {
            state = state.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
            (state >> 28) as u8
        };
        let places = || (0..size * size).map(|at| (at % size, at / size));
        let label = |(x, y): (usize, usize)| tile(x + y % teeth.max(1), y + x % teeth.max(1)) as u32;
        let color = |(x, y): (usize, usize)| {
            let [r, g, b] = [[60, 60, 60], [180, 60, 50], [70, 160, 60], [60, 70, 190]][(tile(x, y) - 1) % 4];
            [r + noise(), g + noise(), b + noise()]
        };
        Self { size, labels: places().map(label).collect(), colors: places().map(color).collect(), face_px }
    }

    fn refine(&self, depth_m: &[f32], normals: &[[i8; 3]], face_px: &[u8]) -> usize {
        let refined = refine(&RefineInput {
            width: self.size,
            wraps: false,
            labels: black_box(&self.labels),
            colors: &self.colors,
            depth_m,
            normals,
            face_px,
        });
        refined.is_moved.iter().filter(|is_moved| **is_moved).count()
    }
}

fn bench(c: &mut Criterion) {
    let mut group = c.benchmark_group("refine");
    group.sample_size(10);
    for (size, face_px) in [(270, 6), (540, 6), (1080, 2), (1080, 6), (1080, 16)] {
        let image = Image::new(size, face_px);
        let pixels = size * size;
        let (depth_m, normals) = (vec![2.0; pixels], vec![[0, 0, 127]; pixels]);
        let sizes = vec![image.face_px; pixels];
        group.throughput(Throughput::Elements(pixels as u64));
        group.bench_function(BenchmarkId::new(format!("faces of {face_px} px"), size), |b| {
            b.iter(|| image.refine(&depth_m, &normals, &sizes));
        });
    }
    group.finish();
}

criterion_group!(benches, bench);
criterion_main!(benches);
