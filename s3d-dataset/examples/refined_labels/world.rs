//! A building as it is, and as a scan of it has it: true labels, and the inputs of an export.

use s3d_dataset::s3d_geom::glam::{DVec2, DVec3, Vec3};
use s3d_dataset::s3d_geom::{Camera, FaceColor, NearestFaces, NormalAxes, PhotoLens, Pose, Raster, TriMesh};
use s3d_fusion::{
    DecimateOptions, Fusion, FusionOptions, MeshColumns, RangeImage, RangeKind, SensorNoise, decimate,
};
use s3d_label::refine::{NO_LABEL, RefineInput};
use s3d_label::{LabelId, Labeler, fill_labels};
use s3d_render::{
    Caster, Hits, MipMaps, NO_FACE, Normals, Scene, face_size_image_into, normal_vectors, rgb_image,
};
use s3d_synth::device::{DepthCamera, ScanTarget, turntable_poses};
use s3d_synth::{AnnotatedScene, ScanOptions};

pub(crate) type Error = Box<dyn std::error::Error>;

/// The mesh that a scan of a building gives, with labels that points voted for.
pub(crate) struct Scanned {
    pub(crate) mesh: TriMesh,
    /// The instance of each face and 1; 0 without one.
    pub(crate) label_of_face: Vec<u32>,
}

/// How a building is scanned.
pub(crate) struct ScanPlan {
    /// The size of the fusion's cells, metres.
    pub(crate) cell_m: f64,
    /// The bound of the decimation, metres.
    pub(crate) max_error_m: f32,
    /// The share of the depth cameras' pixels.
    pub(crate) pixels: f64,
    /// Scanned points of a square metre, which vote for labels.
    pub(crate) points_per_m2: f64,
}

/// Scans a building: depth cameras on a turntable at each location measure it with their noise, the pictures
/// are fused and decimated, and scanned points vote for labels.
pub(crate) fn scanned(scene: &AnnotatedScene, plan: &ScanPlan) -> Result<Scanned, Error> {
    let target = ScanTarget::new(scene);
    let camera = DepthCamera { range_m: [0.4, 8.0], ..DepthCamera::turntable() }.scaled(plan.pixels);
    let mut fusion = Fusion::new(FusionOptions { cell_m: plan.cell_m, ..FusionOptions::default() })?;
    let stops = scene.locations.iter().flat_map(turntable_poses);
    for (number, stop) in (0..).zip(stops) {
        let picture = target.depth_picture(&stop.pose, &camera, number)?;
        let lens = PhotoLens::Straight(picture.lens);
        let noise = SensorNoise::STRUCTURED_LIGHT;
        let image = RangeImage::from_depth(picture.pose, lens, RangeKind::Depth, picture.depth, noise)?;
        fusion.add(&image.with_colors(picture.colors)?)?;
    }

    let fused = fusion.mesh()?;
    let columns = MeshColumns { positions: &fused.positions, faces: &fused.faces, colors: &fused.colors };
    let small = decimate(&columns, &DecimateOptions { max_error_m: plan.max_error_m, ..Default::default() })?;
    let mesh = TriMesh::from_faces(small.positions, small.faces)?;

    let nearest = NearestFaces::new(&mesh);
    let mut labeler = Labeler::new(&nearest);
    let scan = ScanOptions { points_per_m2: plan.points_per_m2, ..ScanOptions::default() };
    for (instance, points) in scene.scan(&scan)? {
        let labels = vec![LabelId(instance as u32 + 1); points.positions.len()];
        labeler.add_labelled_points(&points.positions, &labels)?;
    }
    let mut labels = labeler.finish().into_label_of_face();
    fill_labels(&mesh, &mut labels, 0.1);
    Ok(Scanned { label_of_face: labels.iter().map(|label| label.0).collect(), mesh })
}

/// What an image has: the inputs of the refinement, and the true labels.
pub(crate) struct Shot {
    pub(crate) width: u32,
    pub(crate) labels: Vec<u32>,
    pub(crate) colors: Vec<[u8; 3]>,
    pub(crate) depth_m: Vec<f32>,
    pub(crate) normals: Vec<[i8; 3]>,
    pub(crate) face_px: Vec<u8>,
    /// [`NO_LABEL`] where it is not known.
    pub(crate) truth: Vec<u32>,
}

impl Shot {
    pub(crate) fn input(&self) -> RefineInput<'_> {
        RefineInput {
            width: self.width as usize,
            wraps: false,
            labels: &self.labels,
            colors: &self.colors,
            depth_m: &self.depth_m,
            normals: &self.normals,
            face_px: &self.face_px,
        }
    }
}

/// Both worlds, ready for images.
pub(crate) struct World<'s> {
    scene: &'s AnnotatedScene,
    scanned: &'s Scanned,
    true_scene: Scene<'s>,
    scanned_scene: Scene<'s>,
    textures: MipMaps,
    nearest: NearestFaces<'s>,
}

impl<'s> World<'s> {
    pub(crate) fn new(scene: &'s AnnotatedScene, scanned: &'s Scanned) -> Self {
        Self {
            scene,
            scanned,
            true_scene: Scene::new(&scene.mesh),
            scanned_scene: Scene::new(&scanned.mesh),
            textures: MipMaps::new(&scene.mesh),
            nearest: NearestFaces::new(&scene.mesh),
        }
    }

    /// Returns the class of a label; `None` for what has none.
    pub(crate) fn class_of(&self, label: u32) -> Option<u32> {
        let instance = label.checked_sub(1).filter(|_| label != NO_LABEL)?;
        Some(self.scene.instances[instance as usize].class.index() as u32)
    }

    /// A photograph: the picture shows the building itself, and the mesh is seen from a pose that is off by
    /// `off_rad`.
    pub(crate) fn photograph(&self, pose: Pose, fov_rad: f64, size: u32, off_rad: f64) -> Shot {
        let camera = Camera::perspective(pose, fov_rad, size, size);
        let hits = self.cast(&self.true_scene, &camera);
        let colors = rgb_image(&self.true_scene, &self.textures, &hits, &camera).into_vec();
        let truth = hits.face.pixels().iter().map(|face| match *face {
            NO_FACE => NO_LABEL,
            face => self.scene.instance_of_face[face as usize] + 1,
        });
        let truth = truth.collect();
        let off = Camera { pose: pose.turned(off_rad, 0.5 * off_rad), ..camera };
        self.shot(&off, colors, truth)
    }

    /// A view of the scanned mesh with a texture that is displaced by `shift_m`. What a texture shows at a
    /// place is what the label should say of it.
    pub(crate) fn textured(&self, pose: Pose, fov_rad: f64, size: u32, shift_m: Vec3) -> Shot {
        let camera = Camera::perspective(pose, fov_rad, size, size);
        let hits = self.cast(&self.scanned_scene, &camera);
        let rays = camera.rays();
        let mut colors = Vec::with_capacity(hits.face.len());
        let mut truth = Vec::with_capacity(hits.face.len());
        for y in 0..size {
            for x in 0..size {
                if hits.face.at(x, y) == NO_FACE {
                    colors.push([0; 3]);
                    truth.push(NO_LABEL);
                    continue;
                }
                let depth = f64::from(hits.depth.at(x, y));
                let point = (camera.pose.location + rays.at(x, y) * depth).as_vec3() + shift_m;
                let found = self.nearest.nearest(point);
                colors.push(color_at(&self.scene.mesh, found.face, found.point));
                truth.push(self.scene.instance_of_face[found.face as usize] + 1);
            }
        }
        self.shot(&camera, colors, truth)
    }

    fn cast(&self, scene: &Scene<'_>, camera: &Camera) -> Hits {
        let mut hits = Hits::default();
        Caster::new(scene).cast_into(camera, 1, &mut hits);
        hits
    }

    fn shot(&self, camera: &Camera, colors: Vec<[u8; 3]>, truth: Vec<u32>) -> Shot {
        let scene = &self.scanned_scene;
        let hits = self.cast(scene, camera);
        let label = |face: &u32| match *face {
            NO_FACE => NO_LABEL,
            face => self.scanned.label_of_face[face as usize],
        };
        let normals = normal_vectors(scene, &hits, camera, Normals::Flat, NormalAxes::Paper);
        let mut sizes = Raster::filled(0, 0, 0);
        face_size_image_into(scene, &hits, camera, &mut sizes);
        Shot {
            width: camera.width,
            labels: hits.face.pixels().iter().map(label).collect(),
            colors,
            depth_m: hits.depth.into_vec(),
            normals: normals.map(|n| n.map(|c| (c * 127.0).round() as i8)).into_vec(),
            face_px: sizes.into_vec(),
            truth,
        }
    }
}

/// The colour of a face's texture at a point.
fn color_at(mesh: &TriMesh, face: u32, point: Vec3) -> [u8; 3] {
    let [a, b, c] = mesh.triangle(face).map(|corner| corner.as_dvec3());
    let normal: DVec3 = (b - a).cross(c - a);
    let p = point.as_dvec3();
    let area = normal.length_squared();
    let [u, v] = [(c - b).cross(p - b), (a - c).cross(p - c)].map(|part| part.dot(normal) / area);
    let weights = [u, v, 1.0 - u - v];
    match mesh.color_of(face) {
        FaceColor::Texture(_, texture, uvs) => {
            let uv: DVec2 = uvs.iter().zip(weights).map(|(uv, w)| uv.as_dvec2() * w).sum();
            texture.sample(uv.as_vec2()).map(|c| c.round().clamp(0.0, 255.0) as u8)
        }
        FaceColor::Corners(colors) => std::array::from_fn(|k| {
            let sum: f64 = colors
                .iter()
                .zip(weights)
                .map(|(color, w)| f64::from(color[k]) * w)
                .sum();
            sum.round().clamp(0.0, 255.0) as u8
        }),
        FaceColor::Flat(color) => color,
    }
}
