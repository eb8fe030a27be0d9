//! The boxes of the faces of an instance.

use s3d_geom::glam::{DMat3, DVec3};
use s3d_geom::{Aabb, OrientedBox};
use serde::{Deserialize, Serialize};

/// Boxes around the faces that carry an instance's label: what images show of it. The box of its annotated
/// points is another one.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct SurfaceBoxes {
    /// The box along the axes of the world: `[xmin, ymin, zmin, xmax, ymax, zmax]`, metres.
    pub bbox: [f32; 6],
    /// The smallest box that stands upright.
    pub upright: UprightBox,
    /// A box of small volume in any orientation, as [`OrientedBox::smallest`] finds it.
    pub oriented: FreeBox,
}

/// A box whose third axis is +Z.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct UprightBox {
    /// The centre, world metres.
    pub center: [f64; 3],
    /// The lengths along the longer horizontal axis, the other horizontal axis, and +Z, metres.
    pub size: [f64; 3],
    /// The direction of the longer horizontal axis, counter-clockwise from +X, degrees: (−90, 90].
    pub yaw_deg: f64,
}

/// A box in any orientation.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
pub struct FreeBox {
    /// The centre, world metres.
    pub center: [f64; 3],
    /// The lengths along the axes, metres, the longest first.
    pub size: [f64; 3],
    /// The unit axes in the world, an axis a row; right-handed.
    pub axes: [[f64; 3]; 3],
}

impl SurfaceBoxes {
    /// Returns the boxes in their written form.
    pub fn new(bbox: Aabb, upright: &OrientedBox, oriented: &OrientedBox) -> Self {
        Self {
            bbox: bbox.to_array(),
            upright: UprightBox {
                center: upright.center.to_array(),
                size: upright.size.to_array(),
                yaw_deg: upright.yaw_deg(),
            },
            oriented: FreeBox {
                center: oriented.center.to_array(),
                size: oriented.size.to_array(),
                axes: oriented.axes.to_cols_array_2d(),
            },
        }
    }
}

impl UprightBox {
    /// Returns the box.
    pub fn to_box(&self) -> OrientedBox {
        OrientedBox {
            center: DVec3::from_array(self.center),
            axes: DMat3::from_rotation_z(self.yaw_deg.to_radians()),
            size: DVec3::from_array(self.size),
        }
    }
}

impl FreeBox {
    /// Returns the box.
    pub fn to_box(&self) -> OrientedBox {
        OrientedBox {
            center: DVec3::from_array(self.center),
            axes: DMat3::from_cols_array_2d(&self.axes),
            size: DVec3::from_array(self.size),
        }
    }
}
