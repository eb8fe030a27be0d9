//! Watertight rendering of scans on the CPU: one hit a pixel serves every modality.
//!
//! - [`Scene`]: a mesh and the tree over its faces.
//! - [`cast`]: scene + camera → [`Hits`], the face and the depth that each pixel sees. Exact: no pinhole, no leak, no
//!   dependence on the order of faces or on the processor. [`cast_strided`] casts a part of the pixels, to score a view;
//!   [`cast_ray`] a single ray.
//! - [`depth_image`], [`normal_image`], [`xyz_image`], [`index_image`], [`color_per_face_image`]: hits → the images of
//!   the data set (formats.md, "Images"). A semantic image is an index image: this crate stores faces and knows no
//!   labels.
//! - [`MipMaps`] and [`rgb_image`]: hits → colours, textures filtered over each pixel's footprint.
//! - [`view_images_into`]: all of these in one walk over the hits, in less time and the same to the bit.
//! - [`CubeMap`] and [`picture_image`]: hits → colours from the scanner's own pictures, be they a sky box, a panorama or
//!   captures that overlap ([`stitch()`]).
//!
//! Everything that makes one image runs on the calling thread: callers render many images at once.
//!
//! ```
//! use s3d_geom::{Camera, Pose, TriMesh, glam::{dvec3, vec3}};
//! use s3d_render::{Normals, Scene};
//!
//! // A triangle 2 m ahead of a camera that looks along +Y.
//! let corners = vec![vec3(-1.0, 2.0, 0.5), vec3(1.0, 2.0, 0.5), vec3(0.0, 2.0, 2.5)];
//! let mesh = TriMesh::from_faces(corners, vec![[0, 1, 2]])?;
//! let scene = Scene::new(&mesh);
//! let camera = Camera::perspective(Pose::level(dvec3(0.0, 0.0, 1.5), 0.0), 75f64.to_radians(), 540, 540);
//!
//! let hits = s3d_render::cast(&scene, &camera);
//! assert_eq!((hits.face.at(270, 270), hits.depth.at(270, 270)), (0, 2.0));
//! assert_eq!(s3d_render::depth_image(&hits).at(270, 270), 1024); // 512 units a metre
//! let normals = s3d_render::normal_image(&scene, &hits, &camera, Normals::Flat);
//! assert_eq!(normals.at(270, 270), [128, 128, 255]); // faces the camera
//! assert_eq!(s3d_render::index_image(&hits, &[257]).at(270, 270), [0, 1, 1]);
//! # Ok::<(), s3d_geom::MeshError>(())
//! ```

// Nothing panics but what a caller did wrong, which "Panics" tells. Loops index by what TriMesh::new and Camera checked.
#![cfg_attr(
    not(test),
    deny(clippy::unwrap_used, clippy::expect_used, clippy::panic, clippy::unreachable, clippy::string_slice)
)]

mod hits;
mod picture;
mod raster;
mod ray;
mod scene;
mod shade;
mod simd;

pub use hits::{Hits, NO_FACE};
pub use picture::cube_map::CubeMap;
pub use picture::cube_sources::SkyBoxTurn;
pub use picture::picture_color::{Unseen, picture_image, picture_image_into};
pub use picture::stitch::{Capture, StitchOptions, stitch};
pub use raster::visibility::{Caster, cast, cast_ray_by_ray, cast_strided};
pub use ray::caster::{Hit, cast_ray, cast_ray_brute_force};
pub use scene::Scene;
pub use shade::channels::{
    MISSING_DEPTH, MISSING_INDEX, MISSING_NORMAL, Normals, color_per_face_image, color_per_face_image_into,
    coverage, depth_image, depth_image_into, depth_image_mm_into, index_image, index_image_into,
    normal_image, normal_image_into,
};
pub use shade::color::{rgb_image, rgb_image_into, rgb_image_with};
pub use shade::mip_maps::{MipMaps, TextureFilter};
pub use shade::pixel_color::{rgb_image_pixel_by_pixel, rgb_of_ray};
pub use shade::points::{xyz_image, xyz_image_half, xyz_image_half_into, xyz_image_into};
pub use shade::view::{FaceImages, Modalities, Shading, ViewImages, view_images_into};

#[cfg(doctest)]
#[doc = include_str!("../README.md")]
struct Readme;
