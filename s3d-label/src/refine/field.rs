//! Finds the best labels of the open pixels, in rounds.

use super::NO_LABEL;
use super::band::{OpenPixel, first_sure};
use super::kernel::{Kernel, Windows};
use super::padded::{Padded, set};

/// How often all open pixels are updated.
pub(super) const ROUNDS: usize = 4;

/// The number of labels that a pixel chooses among: its own, and the first others in its window.
pub(super) const CHOICES: usize = 4;

/// How many pixels of the mean similarity each label's model has beside its own, in weights of a pixel that
/// counts fully. It keeps models of few pixels from deciding.
const BESIDE: u64 = 40 * 255;

/// What all eight neighbours together say at most, in 64ths of a doubling.
const NEIGHBOURS: i32 = 200;

/// The share of the logarithm of a label's count, percent.
const COUNT_PERCENT: i32 = 15;

/// The least share of 4095 that a label's count is taken for. A window of few pixels may miss a thin thing.
const LEAST_SHARE: u64 = 64;

/// A pixel that keeps the projected label with this lead, in 64ths of a doubling, is not asked again.
const SETTLED: i32 = 250;

/// The least and the largest certainty of a pixel after a round.
const SURE: [i32; 2] = [20, 255];

/// What speaks for a label at a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Choice {
    pub(super) label: u32,
    /// The sum of the weights of its pixels in the window, each times 255.
    pub(super) count: u32,
    /// The sum of their weights times their similarities.
    pub(super) alike: u32,
    /// The sum of the similarities of the neighbours with this label.
    pub(super) near: u32,
}

impl Choice {
    pub(super) fn new(label: u32) -> Self {
        Self { label, count: 0, alike: 0, near: 0 }
    }
}

/// What a round decides about a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Decision {
    pub(super) label: u32,
    /// How sure it is, of 255.
    pub(super) sure: u8,
    /// Whether later rounds need not ask again.
    pub(super) is_settled: bool,
}

impl Decision {
    /// Of a pixel that cannot be asked.
    const NONE: Self = Self { label: NO_LABEL, sure: 0, is_settled: false };
}

/// Logarithms of shares of 4095, in 64ths of a doubling.
pub(super) struct Logarithms(Vec<i32>);

impl Logarithms {
    pub(super) fn new() -> Self {
        let entry = |share: u32| (64.0 * libm::log2(f64::from(share).max(0.25) / 4095.0)).round() as i32;
        Self((0..4096).map(entry).collect())
    }

    fn of(&self, share: u64) -> i32 {
        self.0.get(share.min(4095) as usize).copied().unwrap_or_default()
    }

    /// Chooses a label. The first choice is the projected label, which has the advantage.
    pub(super) fn decide(&self, choices: &[Choice], advantage: u16) -> Decision {
        let projected = choices.first().map_or(NO_LABEL, |choice| choice.label);
        if choices.len() < 2 {
            return Decision { label: projected, sure: u8::MAX, is_settled: true };
        }
        let alike: u64 = choices.iter().map(|choice| u64::from(choice.alike)).sum();
        let count: u64 = choices.iter().map(|choice| u64::from(choice.count)).sum::<u64>().max(1);

        let mut best = (projected, i32::MIN);
        let mut second = i32::MIN;
        for (at, choice) in choices.iter().enumerate() {
            let of_label = u64::from(choice.alike) * 255 + BESIDE * alike * 255 / count;
            let likelihood = of_label * 4095 / ((u64::from(choice.count) + BESIDE) * 255);
            let share = (u64::from(choice.count) * 4095 / count).max(LEAST_SHARE);
            let mut score = self.of(likelihood)
                + COUNT_PERCENT * self.of(share) / 100
                + NEIGHBOURS * choice.near as i32 / (8 * 255);
            if at == 0 {
                score += i32::from(advantage);
            }
            if score > best.1 {
                second = best.1;
                best = (choice.label, score);
            } else {
                second = second.max(score);
            }
        }

        let lead = best.1.saturating_sub(second);
        let [least, most] = SURE;
        Decision {
            label: best.0,
            sure: lead.clamp(least, most) as u8,
            is_settled: best.0 == projected && lead >= SETTLED,
        }
    }
}

/// The labels of an image between two rounds, and how sure each pixel is of its own.
pub(super) struct State {
    pub(super) labels: Vec<u32>,
    pub(super) sure: Vec<u8>,
}

impl State {
    /// The labels before the first round.
    pub(super) fn new(image: &Padded, band: &[OpenPixel]) -> Self {
        Self { labels: image.labels.clone(), sure: first_sure(image, band) }
    }

    /// Takes over what a round decided.
    pub(super) fn update(&mut self, image: &Padded, decided: &[(usize, Decision)]) {
        for (at, decision) in decided {
            set(&mut self.labels, *at, decision.label);
            set(&mut self.sure, *at, decision.sure);
        }
        image.close(&mut self.labels);
        image.close(&mut self.sure);
    }
}

/// Decides the far pixels whose square's first pixel settles: with it, and for good.
pub(super) fn settled_in_fours(
    image: &Padded,
    band: &[OpenPixel],
    decide: impl Fn(&OpenPixel) -> Decision,
) -> Vec<(usize, Decision)> {
    let is_scout = |pixel: &&OpenPixel| pixel.is_far && pixel.scout(image.width) == pixel.at;
    let asked = band.iter().filter(is_scout).map(|pixel| (pixel.at, decide(pixel)));
    let mut settled = vec![None; image.labels.len()];
    for (at, decision) in asked.filter(|(_, decision)| decision.is_settled) {
        set(&mut settled, at, Some(decision));
    }

    let label = |at: usize| image.labels.get(at).copied();
    let of_square = |pixel: &OpenPixel| {
        let scout = pixel.scout(image.width);
        let decision = settled.get(scout).copied().flatten().filter(|_| pixel.is_far)?;
        (label(scout) == label(pixel.at)).then_some((pixel.at, decision))
    };
    band.iter().filter_map(of_square).collect()
}

/// An open pixel with what does not change from round to round.
struct Open<'w> {
    pixel: OpenPixel,
    /// Steps to the pixels of its window, with their weights.
    window: &'w [(isize, u8)],
    /// Where the similarities of its window and of its neighbours begin.
    similar: usize,
}

/// What decides about pixels of an image.
struct Field<'a> {
    image: &'a Padded,
    kernel: Kernel,
    logarithms: Logarithms,
    windows: Steps,
    /// Steps to the eight neighbours.
    near: [isize; 8],
}

/// Returns the labels of all pixels of the image with margins.
pub(super) fn labels(image: &Padded, band: &[OpenPixel]) -> Vec<u32> {
    let width = image.width as isize;
    let field = Field {
        image,
        kernel: Kernel::new(),
        logarithms: Logarithms::new(),
        windows: steps(&Windows::new(), width),
        near: [-width - 1, -width, -width + 1, -1, 1, width - 1, width, width + 1],
    };
    let mut state = State::new(image, band);

    let alone = |pixel: &OpenPixel| {
        let mut similar = Vec::with_capacity(64);
        field
            .open(pixel, &mut similar)
            .map_or(Decision::NONE, |open| field.decide(&open, &similar, &state))
    };
    let settled = settled_in_fours(image, band, alone);
    state.update(image, &settled);

    // Both lists have the order of the image.
    let mut settled = settled.iter().map(|(at, _)| *at).peekable();
    let mut similar = Vec::with_capacity(band.len() * 20);
    let rest = band.iter().filter(|pixel| settled.next_if_eq(&pixel.at).is_none());
    let mut open: Vec<Open<'_>> = rest.filter_map(|pixel| field.open(pixel, &mut similar)).collect();
    for _ in 0..ROUNDS {
        let mut decided = Vec::with_capacity(open.len());
        open.retain(|open| {
            let decision = field.decide(open, &similar, &state);
            decided.push((open.pixel.at, decision));
            !decision.is_settled
        });
        state.update(image, &decided);
    }
    state.labels
}

impl Field<'_> {
    /// Prepares an open pixel. Appends the similarities of its window's pixels and of its neighbours, one
    /// after the other: 0 for pixels that take no part.
    fn open(&self, pixel: &OpenPixel, similar: &mut Vec<u8>) -> Option<Open<'_>> {
        let image = self.image;
        let is_black = (pixel.at % image.width + pixel.at / image.width) % 2 == 1;
        let [white, black] = self.windows.get(usize::from(pixel.reach))?;
        let window: &[(isize, u8)] = if is_black { black } else { white };
        let here = image.looks.get(pixel.at)?;
        let to = |step: isize| {
            let at = pixel.at.wrapping_add_signed(step);
            match (image.labels.get(at), image.looks.get(at)) {
                (Some(label), Some(look)) if *label != NO_LABEL => self.kernel.similarity(here, look),
                _ => 0,
            }
        };
        let open = Open { pixel: *pixel, window, similar: similar.len() };
        similar.extend(window.iter().map(|(step, _)| to(*step)));
        similar.extend(self.near.iter().map(|step| to(*step)));
        Some(open)
    }

    /// Decides about a pixel by what the last round left.
    fn decide(&self, open: &Open<'_>, similar: &[u8], state: &State) -> Decision {
        let at = open.pixel.at;
        let ends = open.similar + open.window.len();
        let of_window = similar.get(open.similar..ends).unwrap_or_default();
        let of_near = similar.get(ends..ends + self.near.len()).unwrap_or_default();
        let own = self.image.labels.get(at).copied().unwrap_or(NO_LABEL);
        let mut choices = [Choice::new(own); CHOICES];
        let mut known = 1;

        for ((step, weight), similar) in open.window.iter().zip(of_window) {
            // Nothing takes part there.
            if *similar == 0 {
                continue;
            }
            let at = at.wrapping_add_signed(*step);
            let (Some(label), Some(sure)) = (state.labels.get(at), state.sure.get(at)) else { continue };
            let weight = (u32::from(*weight) * u32::from(*sure)) >> 8;
            if let Some(choice) = of_label(&mut choices, &mut known, *label) {
                choice.count += weight * 255;
                choice.alike += weight * u32::from(*similar);
            }
        }
        for (step, similar) in self.near.iter().zip(of_near) {
            let label = state.labels.get(at.wrapping_add_signed(*step));
            let choice = choices
                .iter_mut()
                .take(known)
                .find(|choice| Some(&choice.label) == label);
            if let Some(choice) = choice {
                choice.near += u32::from(*similar);
            }
        }
        self.logarithms
            .decide(choices.get(..known).unwrap_or_default(), open.pixel.advantage)
    }
}

/// Returns the choice of a label; a new one if there is room.
#[inline(always)]
pub(super) fn of_label<'c>(
    choices: &'c mut [Choice; CHOICES],
    known: &mut usize,
    label: u32,
) -> Option<&'c mut Choice> {
    let found = choices.iter().take(*known).position(|choice| choice.label == label);
    let at = found.unwrap_or(*known);
    let choice = choices.get_mut(at)?;
    if found.is_none() {
        *choice = Choice::new(label);
        *known += 1;
    }
    Some(choice)
}

/// Windows as steps through an image of this width.
type Steps = Vec<[Vec<(isize, u8)>; 2]>;

fn steps(windows: &Windows, width: isize) -> Steps {
    let of = |reach: u8, is_black: bool| {
        let window = windows.of(reach, is_black).iter();
        window
            .map(|p| (isize::from(p.offset[1]) * width + isize::from(p.offset[0]), p.weight))
            .collect()
    };
    (0..=24).map(|reach| [of(reach, false), of(reach, true)]).collect()
}
