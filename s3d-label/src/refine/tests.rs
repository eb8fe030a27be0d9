use super::*;
use proptest::prelude::*;

/// An image of one colour a label, where `label` is what is true at a pixel and `told` what the mesh says.
struct Scene {
    width: usize,
    truth: Vec<u32>,
    told: Vec<u32>,
    colors: Vec<[u8; 3]>,
    face_px: u8,
    wraps: bool,
}

impl Scene {
    fn new(size: usize, truth: impl Fn(usize, usize) -> u32, told: impl Fn(usize, usize) -> u32) -> Self {
        let all = |of: &dyn Fn(usize, usize) -> u32| -> Vec<u32> {
            (0..size * size).map(|pixel| of(pixel % size, pixel / size)).collect()
        };
        let truth = all(&truth);
        let colors = truth
            .iter()
            .map(|label| [[90, 90, 90], [180, 60, 50], [60, 70, 190]][*label as usize % 3]);
        Self { width: size, told: all(&told), colors: colors.collect(), truth, face_px: 8, wraps: false }
    }

    fn refined(&self) -> Refined {
        let len = self.told.len();
        refine(&RefineInput {
            width: self.width,
            wraps: self.wraps,
            labels: &self.told,
            colors: &self.colors,
            depth_m: &vec![2.0; len],
            normals: &vec![[0, 0, 127]; len],
            face_px: &vec![self.face_px; len],
        })
    }

    fn wrong(&self, labels: &[u32]) -> usize {
        labels.iter().zip(&self.truth).filter(|(a, b)| a != b).count()
    }
}

/// Teeth of triangles, 8 pixels high and wide.
fn teeth(y: usize) -> usize {
    (y % 8).abs_diff(4) * 2
}

#[test]
fn teeth_become_a_straight_edge() {
    let scene =
        Scene::new(64, |x, _| if x < 32 { 1 } else { 2 }, |x, y| if x < 28 + teeth(y) { 1 } else { 2 });
    let refined = scene.refined();
    assert!(scene.wrong(&scene.told) >= 128);
    assert!(scene.wrong(&refined.labels) <= 2, "{}", scene.wrong(&refined.labels));
    let moved = scene.told.iter().zip(&refined.labels).map(|(a, b)| a != b);
    assert!(moved.eq(refined.is_moved.iter().copied()));
}

#[test]
fn thin_things_stay() {
    // A leg of four pixels. The mesh has it one pixel aside.
    let scene = Scene::new(
        64,
        |x, _| if (30..34).contains(&x) { 2 } else { 1 },
        |x, _| if (31..35).contains(&x) { 2 } else { 1 },
    );
    let refined = scene.refined();
    let legs = |labels: &[u32]| labels.iter().filter(|label| **label == 2).count();
    assert!(legs(&refined.labels) >= 4 * 60, "{}", legs(&refined.labels));
    assert!(scene.wrong(&refined.labels) <= 12, "{}", scene.wrong(&refined.labels));
}

#[test]
fn borders_without_an_edge_stay_where_they_are() {
    let mut scene = Scene::new(64, |x, _| if x < 32 { 1 } else { 2 }, |x, _| if x < 32 { 1 } else { 2 });
    scene.colors.fill([120, 118, 110]);
    assert_eq!(scene.refined().labels, scene.told);
}

#[test]
fn what_has_no_label_or_no_picture_stays() {
    let mut scene =
        Scene::new(64, |x, _| if x < 32 { 1 } else { 2 }, |x, y| if x < 28 + teeth(y) { 1 } else { 2 });
    for y in 0..64 {
        scene.told[y * 64 + 31] = if y < 32 { 0 } else { NO_LABEL };
        scene.colors[y * 64 + 30] = [0; 3];
    }
    let refined = scene.refined();
    for y in 0..64 {
        for x in [30, 31] {
            assert_eq!(refined.labels[y * 64 + x], scene.told[y * 64 + x]);
            assert!(!refined.is_moved[y * 64 + x]);
        }
    }
}

#[test]
fn images_may_be_small_or_empty() {
    let none = RefineInput {
        width: 0,
        wraps: false,
        labels: &[],
        colors: &[],
        depth_m: &[],
        normals: &[],
        face_px: &[],
    };
    assert_eq!(refine(&none), Refined::default());
    for wraps in [false, true] {
        let scene = Scene { wraps, ..Scene::new(2, |x, _| x as u32 + 1, |x, _| x as u32 + 1) };
        assert_eq!(scene.refined().labels, scene.told);
    }
}

/// A label, a colour, a depth, a normal and the size of a face.
type DrawnPixel = (u32, [u8; 3], f32, [i8; 3], u8);

/// Draws an image of a few labels and colours in patches, with holes.
fn drawn() -> impl Strategy<Value = (usize, bool, Vec<DrawnPixel>)> {
    let label = prop_oneof![8 => 1u32..4, 1 => Just(0u32), 1 => Just(NO_LABEL)];
    let level = prop_oneof![Just(40u8), Just(60), Just(200)];
    let color = prop_oneof![9 => prop::array::uniform3(level), 1 => Just([0; 3])];
    let patch = (label, color, 0.3f32..9.0, prop::array::uniform3(-90i8..90), 0u8..20);
    (6usize..30, any::<bool>(), prop::collection::vec(patch, 36), 8usize..30, 2usize..6).prop_map(
        |(width, wraps, patches, height, side)| {
            let pixel = |at: usize| patches[(at % width / side + at / width / side * 7) % patches.len()];
            (width, wraps, (0..width * height).map(pixel).collect())
        },
    )
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(48))]

    #[test]
    fn the_fast_way_is_the_reference((width, wraps, pixels) in drawn()) {
        let labels: Vec<u32> = pixels.iter().map(|p| p.0).collect();
        let input = RefineInput {
            width,
            wraps,
            labels: &labels,
            colors: &pixels.iter().map(|p| p.1).collect::<Vec<_>>(),
            depth_m: &pixels.iter().map(|p| p.2).collect::<Vec<_>>(),
            normals: &pixels.iter().map(|p| p.3).collect::<Vec<_>>(),
            face_px: &pixels.iter().map(|p| p.4).collect::<Vec<_>>(),
        };
        let image = Padded::new(&input);
        prop_assert_eq!(band::find(&image), reference::band(&image));
        let plain: Vec<u32> = reference::labels(&input)
            .into_iter()
            .zip(&labels)
            .map(|(new, old)| if new == NO_LABEL { *old } else { new })
            .collect();
        prop_assert_eq!(&refine(&input).labels, &plain);

        // A panorama may begin at any column, but for the chessboard's colours.
        if wraps && width % 2 == 0 {
            let turned = |values: &[u32]| -> Vec<u32> {
                let places = (0..values.len()).map(|at| at / width * width + (at % width + 4) % width);
                places.map(|at| values[at]).collect()
            };
            let turn = |at: usize| at / width * width + (at % width + 4) % width;
            let of = |k: usize| pixels[turn(k)];
            let all = || 0..pixels.len();
            let shifted = RefineInput {
                width,
                wraps,
                labels: &turned(&labels),
                colors: &all().map(|k| of(k).1).collect::<Vec<_>>(),
                depth_m: &all().map(|k| of(k).2).collect::<Vec<_>>(),
                normals: &all().map(|k| of(k).3).collect::<Vec<_>>(),
                face_px: &all().map(|k| of(k).4).collect::<Vec<_>>(),
            };
            prop_assert_eq!(refine(&shifted).labels, turned(&plain));
        }
    }
}
