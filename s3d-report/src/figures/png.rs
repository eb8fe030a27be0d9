//! A page as pixels.

use super::sheet::{INCH, Item, Picture, Sheet, Step, Stroke};
use s3d_geom::Raster;
use tiny_skia::{
    Color, FillRule, FilterQuality, IntSize, Paint, Path, PathBuilder, Pixmap, PixmapPaint, StrokeDash,
    Transform,
};

/// Returns the pixels of a page, so many an inch.
pub(super) fn pixels(sheet: &Sheet, dpi: u32) -> Raster<[u8; 3]> {
    let scale = dpi as f32 / INCH;
    let [width, height] = sheet.size.map(|side| ((side * scale).round() as u32).max(1));
    let mut page = Pixmap::new(width, height).expect("a page has pixels");
    page.fill(Color::WHITE);
    let enlarged = Transform::from_scale(scale, scale);

    for item in &sheet.items {
        match item {
            Item::Picture { at: [x, y], size: [w, h], picture } => {
                let size = [picture.pixels.width() as f32, picture.pixels.height() as f32];
                let [sx, sy] = [w / size[0], h / size[1]];
                let turn = Transform::from_row(sx, 0.0, 0.0, sy, *x, *y).post_scale(scale, scale);
                let quality = if picture.is_photo {
                    FilterQuality::Bicubic
                } else {
                    FilterQuality::Nearest
                };
                let paint = PixmapPaint { quality, ..PixmapPaint::default() };
                if let Some(source) = pixmap(picture) {
                    page.draw_pixmap(0, 0, source.as_ref(), &paint, turn, None);
                }
            }
            Item::Fill { path, color } => {
                if let Some(path) = path_of(path) {
                    page.fill_path(&path, &paint_of(*color), FillRule::Winding, enlarged, None);
                }
            }
            Item::Line { path, stroke: Stroke { color, width, dashes } } => {
                let dash = dashes.and_then(|dashes| StrokeDash::new(dashes.to_vec(), 0.0));
                let stroke = tiny_skia::Stroke { width: *width, dash, ..tiny_skia::Stroke::default() };
                if let Some(path) = path_of(path) {
                    page.stroke_path(&path, &paint_of(*color), &stroke, enlarged, None);
                }
            }
        }
    }
    let rgb = page.pixels().iter().map(|p| [p.red(), p.green(), p.blue()]).collect();
    Raster::from_vec(width, height, rgb)
}

fn pixmap(picture: &Picture) -> Option<Pixmap> {
    let size = IntSize::from_wh(picture.pixels.width(), picture.pixels.height())?;
    let rgba = picture.pixels.pixels().iter().flat_map(|[r, g, b]| [*r, *g, *b, 255]);
    Pixmap::from_vec(rgba.collect(), size)
}

fn paint_of([r, g, b]: [u8; 3]) -> Paint<'static> {
    let mut paint = Paint { anti_alias: true, ..Paint::default() };
    paint.set_color_rgba8(r, g, b, 255);
    paint
}

fn path_of(steps: &[Step]) -> Option<Path> {
    let mut path = PathBuilder::new();
    for step in steps {
        match *step {
            Step::Move([x, y]) => path.move_to(x, y),
            Step::Line([x, y]) => path.line_to(x, y),
            Step::Cubic([ax, ay], [bx, by], [x, y]) => path.cubic_to(ax, ay, bx, by, x, y),
            Step::Close => path.close(),
        }
    }
    path.finish()
}
