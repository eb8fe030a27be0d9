//! A panorama with the views that were sampled there.

use super::images::Look;
use super::sheet::{Align, INK, Point, SIZE, Sheet, Stroke, WIDTH};
use super::{Book, Drawn, words_of};
use crate::error::Result;
use s3d_geom::Camera;
use s3d_io::dataset::{DatasetImage, Frame};

const GAP: f32 = 6.0;
/// So many views are shown by themselves.
const SHOWN: usize = 4;
/// Their colours, which differ in grey too.
const COLORS: [[u8; 3]; SHOWN] = [[213, 94, 0], [0, 158, 115], [240, 228, 66], [86, 180, 233]];
/// Points along each edge of a view.
const ALONG: u32 = 24;
/// The width at which panoramas are projected to.
const AROUND: u32 = 4096;

/// Draws the richest panorama with the frames of its views, and some of the views below it.
pub(super) fn samples(book: &Book<'_>) -> Result<Option<Drawn>> {
    let Some(panorama) = book.richest_panorama().filter(|image| image.has(Look::Colors.domain())) else {
        return Ok(None);
    };
    let views = book.views_at(panorama);
    let shown = spread(&views, SHOWN);
    if shown.is_empty() {
        return Ok(None);
    }

    let height = 0.5 * WIDTH;
    let small = (WIDTH - GAP * (SHOWN - 1) as f32) / SHOWN as f32;
    let mut sheet = Sheet::new(height + GAP + small + 1.6 * SIZE);
    sheet.picture([0.0; 2], [WIDTH, height], book.images.picture(panorama, Look::Colors, WIDTH)?);
    let around = book.camera(panorama, AROUND)?;
    for (view, _) in &views {
        for line in outline(&book.camera(view, book.data.options().size)?, &around) {
            sheet.line(&line, Stroke { dashes: Some([2.0, 2.0]), ..Stroke::new([255; 3], 0.4) });
        }
    }
    for (i, (view, color)) in shown.into_iter().zip(COLORS).enumerate() {
        for line in outline(&book.camera(view, book.data.options().size)?, &around) {
            sheet.line(&line, Stroke::new(INK, 2.4));
            sheet.line(&line, Stroke::new(color, 1.4));
        }
        let at = [i as f32 * (small + GAP), height + GAP];
        sheet.picture(at, [small; 2], book.images.picture(view, Look::Colors, small)?);
        sheet.frame(at, [small; 2], Stroke::new(color, 2.0));
        let words = format!("view {}", i + 1);
        sheet.words([at[0] + 0.5 * small, at[1] + small + 1.2 * SIZE], Align::Middle, INK, &words);
        let view = book.camera(view, book.data.options().size)?;
        let half = 0.5 * f64::from(view.width);
        if let Some([x, y]) = place(&view, half, half, &around) {
            sheet.fill([x - SIZE, y - SIZE], [2.0 * SIZE; 2], color);
            sheet.words([x, y + 0.35 * SIZE], Align::Middle, INK, &(i + 1).to_string());
        }
    }
    let caption = format!(
        "The panorama of {} (area {}) with the frames of the {} views that were kept there.",
        words_of(&panorama.room),
        panorama.area,
        views.len()
    );
    Ok(Some(Drawn { name: "samples".into(), caption, sheet }))
}

/// Returns views of high entropy that look in different directions: the richest of each part of the turn.
fn spread<'a>(views: &[(&'a DatasetImage, [f64; 2])], count: usize) -> Vec<&'a DatasetImage> {
    let turn = std::f64::consts::TAU;
    let part = |yaw: f64| (((yaw / turn).rem_euclid(1.0)) * count as f64) as usize;
    (0..count)
        .filter_map(|i| {
            let there = views.iter().filter(|(_, [yaw, _])| part(*yaw) == i);
            there
                .max_by(|(_, [_, a]), (_, [_, b])| a.total_cmp(b))
                .map(|(view, _)| *view)
        })
        .collect()
}

/// Returns the edges of a view on a panorama that is [`WIDTH`] points wide. They are cut where the panorama
/// is.
fn outline(view: &Camera, around: &Camera) -> Vec<Vec<Point>> {
    let [w, h] = [f64::from(view.width), f64::from(view.height)];
    let corners = [[0.0, 0.0], [w, 0.0], [w, h], [0.0, h], [0.0, 0.0]];
    let mut lines: Vec<Vec<Point>> = vec![Vec::new()];
    for (from, to) in corners.iter().zip(corners.iter().skip(1)) {
        for step in 0..=ALONG {
            let share = f64::from(step) / f64::from(ALONG);
            let [[ax, ay], [bx, by]] = [*from, *to];
            let at = place(view, ax + (bx - ax) * share, ay + (by - ay) * share, around);
            let (Some([x, y]), Some(line)) = (at, lines.last_mut()) else { continue };
            let jumps = line.last().is_some_and(|[last, _]| (x - last).abs() > 0.5 * WIDTH);
            if jumps {
                lines.push(vec![[x, y]]);
            } else {
                line.push([x, y]);
            }
        }
    }
    lines.retain(|line| line.len() > 1);
    lines
}

/// Returns where a pixel of a view is on a panorama that is [`WIDTH`] points wide.
fn place(view: &Camera, x: f64, y: f64, around: &Camera) -> Option<Point> {
    let direction = view.direction(x, y);
    let (pixel, _) = around.project(around.pose.location + direction)?;
    let scale = f64::from(WIDTH) / f64::from(around.width);
    Some([(pixel.x * scale) as f32, (pixel.y * scale) as f32])
}

impl Book<'_> {
    /// The kept views of the location of a panorama that have colours, with their yaw and their entropy.
    fn views_at(&self, panorama: &DatasetImage) -> Vec<(&DatasetImage, [f64; 2])> {
        self.views
            .iter()
            .filter(|(view, _)| view.uuid == panorama.uuid && view.area == panorama.area)
            .filter(|(view, _)| view.frame != Frame::Panorama && view.has(Look::Colors.domain()))
            .map(|(view, record)| (view, [record.yaw_rad, record.entropy]))
            .collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use s3d_geom::Pose;
    use s3d_geom::glam::DVec3;

    #[test]
    fn frames_of_views_are_where_they_look() {
        let level = |yaw| Pose::level(DVec3::new(3.0, 1.0, 1.5), yaw);
        let around = Camera::equirectangular(level(0.4), 4096);
        let quarter = std::f64::consts::FRAC_PI_2;
        // A turn to the left is towards the left of the panorama, whose middle looks ahead.
        let view = Camera::perspective(level(0.4 + quarter), quarter, 100, 100);
        let [x, y] = place(&view, 50.0, 50.0, &around).unwrap();
        assert!((x - 0.25 * WIDTH).abs() < 0.01 && (y - 0.25 * WIDTH).abs() < 0.01, "{x} {y}");

        let lines = outline(&view, &around);
        assert_eq!(lines.len(), 1);
        let left = lines.iter().flatten().map(|[x, _]| *x).fold(f32::INFINITY, f32::min);
        assert!((left - 0.125 * WIDTH).abs() < 0.01, "{left}");

        // One that looks back is cut in two where the panorama is.
        let back = Camera::perspective(level(0.4 + 2.0 * quarter), quarter, 100, 100);
        let lines = outline(&back, &around);
        assert!(lines.len() >= 2);
        assert!(
            lines
                .iter()
                .all(|line| line.windows(2).all(|w| (w[0][0] - w[1][0]).abs() < 0.5 * WIDTH))
        );
    }
}
