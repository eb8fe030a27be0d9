//! An export writes every cue, and `verify` makes each of them again.

use crate::common;

use common::options;
use s3d_dataset::verify::VerifyOptions;
use s3d_dataset::{Context, Export, ExportOptions, verify};
use s3d_geom::Raster;
use s3d_io::dataset::{Domain, Frame, Layout, PixelKind, dataset_images};
use s3d_io::image::{
    Compression, Content, decode_gray16, decode_rgb8, encode_gray8, encode_gray16, encode_rgb8, read_numbers8,
};
use s3d_synth::{Building, ScanOptions};
use std::fs;
use std::path::Path;

/// The modalities that the published data set lacks and that are images of their own.
fn cues() -> Vec<Domain> {
    let first = Domain::ALL
        .iter()
        .position(|domain| *domain == Domain::DepthEuclidean)
        .unwrap();
    Domain::ALL[first..].to_vec()
}

/// Changes the value of one pixel of a file.
fn damage(path: &Path, kind: PixelKind) {
    let bytes = fs::read(path).unwrap();
    let changed = match kind {
        PixelKind::Gray16 => {
            let image = decode_gray16(&bytes, path).unwrap();
            let mut at = 0..;
            encode_gray16(&image.map(|v| if at.next() == Some(777) { v ^ 1 } else { v }), Compression::Fast)
        }
        PixelKind::Gray8 => {
            let image: Raster<u8> = read_numbers8(path).unwrap();
            let mut at = 0..;
            encode_gray8(&image.map(|v| if at.next() == Some(777) { v ^ 1 } else { v }))
        }
        PixelKind::Rgb8 => {
            let image = decode_rgb8(&bytes, path).unwrap();
            let mut at = 0..;
            let changed = image.map(|v| {
                if at.next() == Some(777) {
                    [v[0] ^ 1, v[1], v[2]]
                } else {
                    v
                }
            });
            encode_rgb8(&changed, Content::Photo, Compression::Fast)
        }
        other => panic!("{other:?}"),
    };
    fs::write(path, changed).unwrap();
}

#[test]
fn every_cue_is_written_and_checked() {
    let dir = tempfile::tempdir().unwrap();
    let scan = Building::demo().build().unwrap();
    let scan = scan
        .write_scan(&dir.path().join("scan"), &ScanOptions::default(), || true)
        .unwrap();
    let [out, alone] = ["out", "alone"].map(|name| dir.path().join(name));
    let run = |out: &Path, modalities: &[Domain]| {
        let options = ExportOptions { modalities: modalities.to_vec(), views: 2, ..options(1) };
        Export::new([scan.clone()])
            .options(options)
            .run(out, &Context::default())
            .unwrap();
        let report = verify(out, &VerifyOptions::default(), &Context::default()).unwrap();
        assert_eq!(report.fault_count(), 0, "{report}");
    };
    run(&out, &Domain::ALL);
    run(&alone, &[&cues()[..], &[Domain::Pose]].concat());

    // Cues are the same without the images that they are made from.
    let (layout, others) = (Layout::new(out.clone()), Layout::new(alone));
    let images = dataset_images(&layout, 1).unwrap();
    assert!(images.iter().any(|image| image.frame == Frame::Panorama) && images.len() > 6);
    for (image, domain) in images
        .iter()
        .flat_map(|image| cues().into_iter().map(move |d| (image, d)))
    {
        let [a, b] = [&layout, &others].map(|layout| fs::read(image.path(layout, domain)).unwrap());
        assert_eq!(a, b, "{}", image.relative_path(domain));
    }

    // A changed pixel is told of any of them.
    for (image, domain) in images.iter().cycle().zip(cues()) {
        damage(&image.path(&layout, domain), domain.pixels().unwrap());
    }
    let report = verify(&out, &VerifyOptions::default(), &Context::default()).unwrap();
    let text = report.to_string();
    for (image, domain) in images.iter().cycle().zip(cues()) {
        assert!(text.contains(&image.relative_path(domain)), "{domain}: {text}");
    }
    assert!(text.contains("1 of "), "{text}");
}
