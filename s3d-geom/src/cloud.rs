//! Point clouds, as columns.

use glam::Vec3;

/// A coloured point cloud in world metres, Z-up. Every column is empty or has one entry per point.
#[derive(Clone, Debug, Default, PartialEq)]
#[cfg_attr(
    feature = "serde",
    derive(serde::Serialize, serde::Deserialize),
    serde(try_from = "as_data::PointCloud")
)]
///
/// ```
/// use s3d_geom::{Density, PointCloud, SurfaceSampler, TriMesh, glam::Vec3};
///
/// let mesh = TriMesh::from_faces(vec![Vec3::ZERO, Vec3::X, Vec3::Y], vec![[0, 1, 2]])?;
/// let mut cloud = PointCloud::default();
/// SurfaceSampler::new(&mesh, Density::Total(50), 1).sample(0..50, &mut cloud);
/// assert_eq!((cloud.len(), cloud.colors.len(), cloud.faces.len()), (50, 50, 50));
/// assert!(cloud.positions.iter().all(|p| p.x + p.y <= 1.0 + 1e-6 && p.z == 0.0));
/// # Ok::<(), s3d_geom::MeshError>(())
/// ```
pub struct PointCloud {
    /// The positions of the points.
    pub positions: Vec<Vec3>,
    /// Colours R G B; empty if unknown.
    pub colors: Vec<[u8; 3]>,
    /// The mesh face that each point was drawn from; empty if unknown.
    pub faces: Vec<u32>,
}

impl PointCloud {
    /// Returns the number of points.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Returns true if there is no point.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Removes all points but keeps the allocated memory.
    pub fn clear(&mut self) {
        self.positions.clear();
        self.colors.clear();
        self.faces.clear();
    }
}

#[cfg(feature = "serde")]
mod as_data {
    use glam::Vec3;

    /// A cloud before it is checked.
    #[derive(serde::Deserialize)]
    pub(super) struct PointCloud {
        positions: Vec<Vec3>,
        colors: Vec<[u8; 3]>,
        faces: Vec<u32>,
    }

    impl TryFrom<PointCloud> for super::PointCloud {
        type Error = String;

        fn try_from(PointCloud { positions, colors, faces }: PointCloud) -> Result<Self, String> {
            for (what, count) in [("colours", colors.len()), ("faces", faces.len())] {
                if count != 0 && count != positions.len() {
                    return Err(format!("{count} {what} for {} points", positions.len()));
                }
            }
            Ok(Self { positions, colors, faces })
        }
    }
}
