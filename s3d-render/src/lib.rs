//! Watertight rendering of scans on the CPU: one hit a pixel serves every modality.
//!
//! # From a mesh to images
//!
//! - [`Scene`] is a mesh with a tree over its faces. [`MipMaps`] are the textures of the mesh, ready to be
//!   filtered. Both are built once and shared by threads.
//! - [`cast`] makes the [`Hits`] of a camera: the face and the depth that each pixel sees. A [`Caster`] makes
//!   hits for many cameras and keeps its memory between them.
//! - [`view_images_into`] turns hits into [`ViewImages`]: colour, depth, normals, points and indices of
//!   faces.
//!
//! ```
//! use s3d_geom::{Camera, NormalAxes, Pose, TriMesh, glam::{dvec3, vec3}};
//! use s3d_render::{
//!     MISSING_DEPTH, MipMaps, Modalities, Scene, Shading, TextureFilter, ViewImages, cast, view_images_into,
//! };
//!
//! // A floor of one triangle, and a camera 1.5 m above it that looks along +Y.
//! let corners = vec![vec3(-9.0, -9.0, 0.0), vec3(9.0, -9.0, 0.0), vec3(0.0, 9.0, 0.0)];
//! let mesh = TriMesh::from_faces(corners, vec![[0, 1, 2]])?;
//! let camera = Camera::perspective(Pose::level(dvec3(0.0, 0.0, 1.5), 0.0), 90f64.to_radians(), 64, 64);
//!
//! let scene = Scene::new(&mesh);
//! let mip_maps = MipMaps::new(&mesh);
//! let hits = cast(&scene, &camera);
//! let shading = Shading {
//!     scene: &scene,
//!     mip_maps: &mip_maps,
//!     filter: TextureFilter::default(),
//!     normal_axes: NormalAxes::Paper,
//!     index_of_face: &[257],
//!     color_of_face: &[[9, 8, 7]],
//! };
//! let mut images = ViewImages::default();
//! view_images_into(&shading, &hits, &camera, Modalities::ALL, &mut images);
//!
//! // The middle of the lowest row looks down by nearly 45°: 1.5 m below is 1.524 m along the axis.
//! assert_eq!(images.depth.at(32, 63), 780); // 512 units a metre
//! assert_eq!(images.rgb.at(32, 63), s3d_geom::DEFAULT_COLOR);
//! assert_eq!(images.faces.index.at(32, 63), [0, 1, 1]); // 257
//! assert_eq!(images.faces.color.at(32, 63), [9, 8, 7]);
//! assert!(images.xyz.at(32, 63)[2].to_f32().abs() < 1e-3); // on the floor
//! assert_eq!(images.depth.at(32, 0), MISSING_DEPTH); // the sky
//! # Ok::<(), s3d_geom::MeshError>(())
//! ```
//!
//! # Visibility
//!
//! Hits are exact: there are no pinholes and no leaks, and neither the order of faces nor the processor
//! changes a hit. [`cast_strided`] casts some of the pixels, to score a view. [`cast_ray`] casts a single
//! ray. [`Sight`] tells whether a point is hidden from a place.
//!
//! # Images
//!
//! The data set defines the images (`s3d_io::formats`, "What is written"). A function makes each of them:
//! [`rgb_image`], [`depth_image`], [`normal_image`], [`xyz_image`], [`index_image`] and
//! [`color_per_face_image`]. [`view_images_into`] makes the same bytes in one walk over the hits, in less
//! time. A semantic image is an index image: this crate stores faces and knows no labels. [`sample_edges`]
//! removes stair-steps from a colour image. A function that ends in `_into` writes to an image that exists
//! already.
//!
//! [`image_from_above`] needs no camera: it sees a mesh straight from above, cut at two heights, as a plan
//! does.
//!
//! # Cues
//!
//! Further images follow from hits ([`euclidean_depth_image_into`], [`mask_image_into`],
//! [`reshading_image_into`], [`curvature_image_into`], [`occlusion_edge_image_into`], [`corner_image_into`],
//! [`surface_segment_image_into`]), from colours ([`texture_edge_image_into`], [`keypoint_image_into`],
//! [`color_segment_image_into`]) and from a number a face ([`border_image_into`],
//! [`border_distance_image_into`]).
//!
//! # Objects
//!
//! [`SeenObjects`] finds the objects of an image: the visible pixels of each, those that it would have if it
//! stood alone, and what hides it. An object is a number a face.
//!
//! # Pairs of images
//!
//! [`view_pairs`] tells which images see the same surface: the share of each that the other sees, by exact
//! rays, with angles, scales and distances. [`correspondences`] returns the pixels of two images that show
//! the same places.
//!
//! # Colours from pictures
//!
//! A [`CubeMap`] holds the pictures taken at a place. It is made from a sky box, a panorama or overlapping
//! captures ([`stitch()`]). [`picture_image`] colours hits from it instead of from textures. [`undistort`]
//! and [`level_panorama`] turn a single photograph into the image of a view.
//!
//! # Threads and processors
//!
//! A function that makes one image runs on the calling thread: callers render many images at once. The
//! vector instructions are chosen when the program runs, and all give the same bytes. The environment
//! variable `S3D_SIMD` limits them: see [`SimdLevel`].

// Only a caller's mistake panics, and `# Panics` names it. Loops rely on the indices that `TriMesh::new` and
// `Camera` have checked.
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::string_slice)
)]

mod cues;
mod edge_samples;
mod from_above;
mod hits;
mod objects;
mod pairs;
mod picture;
mod pixel_box;
mod raster;
mod ray;
mod scene;
mod shade;
mod simd;

pub use cues::borders::border_image_into;
pub use cues::boundary_distance::{BORDER_UNITS, MISSING_DISTANCE, border_distance_image_into};
pub use cues::corners::corner_image_into;
pub use cues::curvature::{
    CURVATURE_RADIUS_M, MISSING_CURVATURE, SMALLEST_RADIUS_M, curvature_image_into, face_curvatures,
};
pub use cues::distance::{euclidean_depth_image_into, mask_image_into};
pub use cues::face_sizes::face_size_image_into;
pub use cues::gray::gray_image;
pub use cues::hessian::keypoint_image_into;
pub use cues::occlusion::occlusion_edge_image_into;
pub use cues::reshading::reshading_image_into;
pub use cues::segments::{color_segment_image_into, surface_segment_image_into};
pub use cues::texture_edges::texture_edge_image_into;
pub use edge_samples::sample_edges;
pub use from_above::{FromAbove, GroundGrid, image_from_above};
pub use hits::{Hits, NO_FACE};
pub use objects::{Beyond, Mask, NO_OBJECT, ObjectMeshes, ObjectScenes, SeenObject, SeenObjects};
pub use pairs::{Correspondence, PairFinder, PairOptions, ViewPair, correspondences, view_pairs};
pub use picture::cube_map::CubeMap;
pub use picture::cube_sources::SkyBoxTurn;
pub use picture::level_panorama::level_panorama;
pub use picture::picture_color::{Unseen, picture_image, picture_image_into};
pub use picture::stitch::{StitchOptions, capture::Capture, stitch};
pub use picture::undistort::undistort;
pub use pixel_box::PixelBox;
pub use raster::visibility::{Caster, cast, cast_ray_by_ray, cast_strided};
pub use ray::caster::{Hit, Sight, cast_ray, cast_ray_brute_force};
pub use ray::inside::are_inside;
pub use ray::wide::{are_rays_blocked, cast_rays, count_hits};
pub use s3d_simd::SimdLevel;
pub use scene::Scene;
pub use shade::channels::{
    MISSING_DEPTH, MISSING_INDEX, MISSING_NORMAL, Normals, byte_per_face_image, byte_per_face_image_into,
    color_per_face_image, color_per_face_image_into, coverage, depth_image, depth_image_into,
    depth_image_mm_into, index_image, index_image_into, normal_image, normal_image_into, normal_vectors,
};
pub use shade::color::{rgb_image, rgb_image_into, rgb_image_with};
pub use shade::mip_maps::{MipMaps, TextureFilter};
pub use shade::pixel_color::{rgb_image_pixel_by_pixel, rgb_of_ray};
pub use shade::points::{xyz_image, xyz_image_half, xyz_image_half_into, xyz_image_into};
pub use shade::view::{FaceImages, Modalities, Shading, ViewImages, view_images_into};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
