//! Point clouds, as a struct of columns.

use glam::Vec3;

/// A coloured point cloud in world metres, Z-up. Every column that is not empty has one entry a point.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PointCloud {
    /// Where the points are.
    pub positions: Vec<Vec3>,
    /// Colours R G B; empty if unknown.
    pub colors: Vec<[u8; 3]>,
    /// The mesh face that each point was drawn from; empty if unknown.
    pub faces: Vec<u32>,
}

impl PointCloud {
    /// Number of points.
    pub fn len(&self) -> usize {
        self.positions.len()
    }

    /// Whether there is no point.
    pub fn is_empty(&self) -> bool {
        self.positions.is_empty()
    }

    /// Removes all points and keeps the memory.
    pub fn clear(&mut self) {
        self.positions.clear();
        self.colors.clear();
        self.faces.clear();
    }
}
