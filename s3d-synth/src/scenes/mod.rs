//! Scenes for benches and tests: meshes of any size without an annotation. The same numbers give the same
//! mesh.
//!
//! [`furnished_room`] is small and closed, [`classroom`] has a fine texture, [`scan_like`] is as untidy as a
//! scan. All begin at the origin, in metres, Z-up. `LargeScan` writes the files of a scan of any size.
//!
//! ```
//! use s3d_synth::scenes::{furnished_room, scan_like};
//!
//! assert_eq!(scan_like(20_000, 7).faces().len(), 20_000);
//! assert!(furnished_room(7).aabb().max.z < 3.0);
//! ```

mod classroom;
mod furnished_room;
#[cfg(feature = "files")]
mod large;
mod scan_like;
mod shell;

pub use classroom::{CLASSROOM_LOCATION, classroom};
pub use furnished_room::furnished_room;
#[cfg(feature = "files")]
pub use large::{LargeScan, LargeScanSummary, PointFormat};
pub use scan_like::{scan_like, scan_like_rooms};

use s3d_geom::{MeshParts, TriMesh};

#[expect(clippy::expect_used, reason = "fixtures are made here, of finite corners and faces with an area")]
pub(super) fn checked(parts: MeshParts) -> TriMesh {
    TriMesh::new(parts).expect("a fixture is a mesh")
}
