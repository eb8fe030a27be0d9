//! A page as PDF.

use super::sheet::{Item, Picture, Sheet, Step, Stroke};
use flate2::write::ZlibEncoder;
use pdf_writer::{Content, Filter, Finish, Name, Pdf, Rect, Ref};
use s3d_io::image::encode_jpeg;
use std::io::{self, Write};

/// The quality of photographs as JPEG, 1 to 100.
const QUALITY: u8 = 92;

/// Returns the file of a page. Photographs are JPEG, other pictures keep each pixel, and words are outlines.
pub(super) fn pdf(sheet: &Sheet) -> io::Result<Vec<u8>> {
    let [catalog, pages, page, contents] = [1, 2, 3, 4].map(Ref::new);
    let pictures = || {
        sheet.items.iter().filter_map(|item| match item {
            Item::Picture { picture, .. } => Some(picture),
            _ => None,
        })
    };
    let named = |i: usize| (format!("P{i}"), Ref::new(5 + i as i32));

    let mut pdf = Pdf::new();
    pdf.catalog(catalog).pages(pages);
    pdf.pages(pages).kids([page]).count(1);
    let [width, height] = sheet.size;
    let mut about = pdf.page(page);
    about
        .media_box(Rect::new(0.0, 0.0, width, height))
        .parent(pages)
        .contents(contents);
    let mut resources = about.resources();
    let mut list = resources.x_objects();
    for i in 0..pictures().count() {
        let (name, id) = named(i);
        list.pair(Name(name.as_bytes()), id);
    }
    list.finish();
    resources.finish();
    about.finish();

    for (i, picture) in pictures().enumerate() {
        let (filter, bytes) = encoded(picture)?;
        let mut object = pdf.image_xobject(named(i).1, &bytes);
        object.filter(filter);
        object
            .width(picture.pixels.width() as i32)
            .height(picture.pixels.height() as i32);
        object.color_space().device_rgb();
        object.bits_per_component(8);
    }
    let bytes = deflated(&content(sheet, |i| named(i).0))?;
    pdf.stream(contents, &bytes).filter(Filter::FlateDecode);
    Ok(pdf.finish())
}

fn encoded(picture: &Picture) -> io::Result<(Filter, Vec<u8>)> {
    if picture.is_photo {
        return Ok((Filter::DctDecode, encode_jpeg(&picture.pixels, QUALITY)));
    }
    Ok((Filter::FlateDecode, deflated(picture.pixels.pixels().as_flattened())?))
}

fn deflated(bytes: &[u8]) -> io::Result<Vec<u8>> {
    let mut encoder = ZlibEncoder::new(Vec::new(), flate2::Compression::default());
    encoder.write_all(bytes)?;
    encoder.finish()
}

/// Returns the operators of a page. `name` names the pictures in their order.
fn content(sheet: &Sheet, name: impl Fn(usize) -> String) -> Vec<u8> {
    let mut content = Content::new();
    // PDF counts from the lower left corner.
    let [_, height] = sheet.size;
    content.transform([1.0, 0.0, 0.0, -1.0, 0.0, height]);

    let mut pictures = 0;
    for item in &sheet.items {
        match item {
            Item::Picture { at: [x, y], size: [w, h], .. } => {
                content.save_state().transform([*w, 0.0, 0.0, -h, *x, y + h]);
                content.x_object(Name(name(pictures).as_bytes())).restore_state();
                pictures += 1;
            }
            Item::Fill { path, color } => {
                let [r, g, b] = color.map(|c| f32::from(c) / 255.0);
                content.set_fill_rgb(r, g, b);
                draw(&mut content, path);
                content.fill_nonzero();
            }
            Item::Line { path, stroke: Stroke { color, width, dashes } } => {
                let [r, g, b] = color.map(|c| f32::from(c) / 255.0);
                content.set_stroke_rgb(r, g, b).set_line_width(*width);
                content.set_dash_pattern(dashes.iter().flatten().copied(), 0.0);
                draw(&mut content, path);
                content.stroke();
            }
        }
    }
    content.finish().into_vec()
}

fn draw(content: &mut Content, path: &[Step]) {
    for step in path {
        match *step {
            Step::Move([x, y]) => content.move_to(x, y),
            Step::Line([x, y]) => content.line_to(x, y),
            Step::Cubic([ax, ay], [bx, by], [x, y]) => content.cubic_to(ax, ay, bx, by, x, y),
            Step::Close => content.close_path(),
        };
    }
}
