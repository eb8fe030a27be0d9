//! Polygons and their triangles, the floors of rooms, and the direction of walls.

mod footprint;
mod polygon;
mod triangulation;
mod wall_direction;

pub use footprint::{Footprint, FootprintBuilder, FootprintOptions};
pub use polygon::Polygon;
pub use triangulation::{PolygonError, triangulate_face};
pub use wall_direction::dominant_wall_direction_deg;
