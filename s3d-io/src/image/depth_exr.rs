//! Writes OpenEXR images of depth.

use exr::image::{AnyChannel, AnyChannels, Encoding, FlatSamples, Image, Layer};
use exr::meta::attribute::LineOrder;
use exr::meta::header::LayerAttributes;
use exr::prelude::{Blocks, Compression, SmallVec, WritableImage};
use s3d_geom::Raster;
use std::io::Cursor;

/// Encodes depth as an OpenEXR file of 32-bit floats. Its one channel is Y, which readers of gray images look
/// for. Scan lines run from the top; the compression is ZIP.
///
/// # Panics
/// If the image has no pixel.
#[expect(clippy::expect_used, reason = "a writer, into memory")]
pub fn encode_depth_float(image: &Raster<f32>) -> Vec<u8> {
    assert!(!image.is_empty(), "an OpenEXR image needs pixels: {} × {}", image.width(), image.height());
    let samples = FlatSamples::F32(image.pixels().to_vec());
    let channels = AnyChannels::sort(SmallVec::from_iter([AnyChannel::new("Y", samples)]));
    let encoding = Encoding {
        compression: Compression::ZIP16,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let size = (image.width() as usize, image.height() as usize);
    let layer = Layer::new(size, LayerAttributes::default(), encoding, channels);

    let mut file = Cursor::new(Vec::new());
    Image::from_layer(layer)
        .write()
        .non_parallel()
        .to_buffered(&mut file)
        .expect("memory takes any bytes");
    file.into_inner()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_reader_finds_the_depth() {
        let depth = Raster::from_vec(5, 3, (0..15).map(|i| i as f32 * 0.37).collect());
        let file = encode_depth_float(&depth);
        let read = exr::prelude::read()
            .no_deep_data()
            .largest_resolution_level()
            .all_channels()
            .first_valid_layer()
            .all_attributes();
        use exr::prelude::{ReadChannels, ReadLayers};
        let image = read.from_buffered(Cursor::new(&file)).unwrap();
        let channels = &image.layer_data.channel_data.list;
        assert_eq!(channels.len(), 1);
        assert_eq!(channels[0].name, *"Y");
        let back: Vec<f32> = channels[0].sample_data.values_as_f32().collect();
        assert_eq!(back, depth.pixels());
        assert_eq!(file, encode_depth_float(&depth));
    }
}
