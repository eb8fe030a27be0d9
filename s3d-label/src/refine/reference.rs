//! The same by the definition, pixel by pixel: slow, and without what makes `field` fast. Tests compare both.

use super::band::{self, OpenPixel, Room, STEPS};
use super::field::{CHOICES, Choice, Logarithms, ROUNDS, State, of_label, settled_in_fours};
use super::kernel::{Kernel, Windows};
use super::padded::Padded;
use super::{NO_LABEL, RefineInput};
use std::collections::BTreeSet;

/// Returns the band: each pixel asks all borders of the image.
pub(super) fn band(image: &Padded) -> Vec<OpenPixel> {
    let len = image.labels.len();
    let borders: Vec<(usize, Room)> =
        (0..len).filter_map(|at| Some((at, band::border(image, at)?))).collect();
    let place = |at: usize| [at % image.width, at / image.width];
    let distance = |a: usize, b: usize| {
        let [dx, dy] = [0, 1].map(|k| place(a)[k].abs_diff(place(b)[k]) as u16);
        STEPS[0] * (dx.max(dy) - dx.min(dy)) + STEPS[1] * dx.min(dy)
    };

    let room = |at: usize| {
        let rooms = borders.iter().map(|(border, room)| match distance(*border, at) {
            0 => *room,
            distance => room.beyond(distance),
        });
        rooms.max().unwrap_or_default()
    };
    let places = image.inner_places().filter(|at| image.labels[*at] != NO_LABEL);
    places.filter_map(|at| room(at).open_pixel(at)).collect()
}

/// Returns the labels of the image without margins.
pub(super) fn labels(input: &RefineInput<'_>) -> Vec<u32> {
    let image = &Padded::new(input);
    let band = band(image);
    let (kernel, windows, logarithms) = (Kernel::new(), Windows::new(), Logarithms::new());
    let mut state = State::new(image, &band);
    let width = image.width as isize;

    let decide = |pixel: &OpenPixel, state: &State| {
        let moved = |x: i16, y: i16| (pixel.at as isize + y as isize * width + x as isize) as usize;
        let similarity = |at: usize| u32::from(kernel.similarity(&image.looks[pixel.at], &image.looks[at]));
        let mut choices = [Choice::new(image.labels[pixel.at]); CHOICES];
        let mut known = 1;

        let is_black = (pixel.at % image.width + pixel.at / image.width) % 2 == 1;
        for window_pixel in windows.of(pixel.reach, is_black) {
            let at = moved(window_pixel.offset[0], window_pixel.offset[1]);
            if image.labels[at] == NO_LABEL {
                continue;
            }
            let weight = (u32::from(window_pixel.weight) * u32::from(state.sure[at])) >> 8;
            if let Some(choice) = of_label(&mut choices, &mut known, state.labels[at]) {
                choice.count += weight * 255;
                choice.alike += weight * similarity(at);
            }
        }
        for (x, y) in [(-1, -1), (0, -1), (1, -1), (-1, 0), (1, 0), (-1, 1), (0, 1), (1, 1)] {
            let at = moved(x, y);
            for choice in &mut choices[..known] {
                if image.labels[at] != NO_LABEL && state.labels[at] == choice.label {
                    choice.near += similarity(at);
                }
            }
        }
        logarithms.decide(&choices[..known], pixel.advantage)
    };

    let in_fours = settled_in_fours(image, &band, |pixel| decide(pixel, &state));
    state.update(image, &in_fours);
    let mut settled: BTreeSet<usize> = in_fours.iter().map(|(at, _)| *at).collect();
    for _ in 0..ROUNDS {
        let asked = band.iter().filter(|pixel| !settled.contains(&pixel.at));
        let decided: Vec<_> = asked.map(|pixel| (pixel.at, decide(pixel, &state))).collect();
        settled.extend(
            decided
                .iter()
                .filter(|(_, decision)| decision.is_settled)
                .map(|(at, _)| *at),
        );
        state.update(image, &decided);
    }
    image.inner(&state.labels)
}
