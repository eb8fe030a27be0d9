//! PCD files of the Point Cloud Library, 0.6 and 0.7: ASCII, binary and compressed. Source: "The PCD (Point
//! Cloud Data) file format", pointclouds.org, and PCL's `pcd_io.cpp` and `lzf.cpp`.
//!
//! The header's VIEWPOINT is where the sensor was. PCL does not apply it to the points, nor does this reader.

mod header;
mod lzf;
pub(crate) mod read;
