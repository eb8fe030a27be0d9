//! Chooses few places that together see much: the greedy cover of the art-gallery problem.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A candidate asks for one more place if the chosen ones see less than this share of its view. So a small
/// room is not left out because it is little of a large building.
const SHARE_OF_EVERY_VIEW: f64 = 0.5;

/// Numbers of samples that are seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cover {
    /// The samples seen by any candidate.
    pub(super) visible: usize,
    /// The samples seen by at least one, two and three chosen places.
    pub(super) seen_by: [usize; 3],
}

impl Cover {
    /// Counts what the chosen places see, and what all places see.
    pub(super) fn of<'a>(
        chosen: &[Vec<u32>],
        all: impl Iterator<Item = &'a Vec<u32>>,
        samples: usize,
    ) -> Self {
        let mut times = vec![0; samples];
        chosen.iter().for_each(|list| see(&mut times, list));
        Self { visible: visible(all, samples), seen_by: seen_by(&times) }
    }
}

/// Chooses places one by one. The next place has the largest product of `weight` and the number of its
/// samples that no chosen place sees; the first wins a tie. Ends when the chosen places see `share` of what
/// all places see together, and at least half of what each place sees.
///
/// The gain of a place only shrinks. So a place with a new gain above the old gain of every other is the
/// best, and those others need not be counted again (Minoux 1978).
/// smaller than its new one (Minoux 1978).
pub(super) fn greedy(lists: &[Vec<u32>], weights: &[u64], samples: usize, share: f64) -> (Vec<usize>, Cover) {
    let visible = visible(lists.iter(), samples);
    let enough = (share * visible as f64).ceil() as usize;
    let mut times = vec![0u8; samples];
    let mut chosen = Vec::new();
    let mut seen = 0;

    let mut heap: BinaryHeap<(u64, Reverse<usize>)> = lists
        .iter()
        .zip(weights)
        .enumerate()
        .map(|(i, (l, w))| (l.len() as u64 * w, Reverse(i)))
        .collect();

    while seen < enough
        && let Some((old, Reverse(place))) = heap.pop()
    {
        let new = unseen(&times, &lists[place]);
        let gain = new as u64 * weights[place];
        if gain < old {
            // It gets another turn with its new gain, unless it adds nothing.
            heap.extend((gain > 0).then_some((gain, Reverse(place))));
            continue;
        }
        seen += new;
        see(&mut times, &lists[place]);
        chosen.push(place);
    }

    // The set of asking candidates only shrinks.
    let mut asking: Vec<usize> = (0..lists.len()).collect();
    loop {
        asking.retain(|&i| {
            let list = &lists[i];
            let seen = list.len() - unseen(&times, list);
            (seen as f64) < SHARE_OF_EVERY_VIEW * list.len() as f64
        });
        let best = asking
            .iter()
            .max_by_key(|&&i| (unseen(&times, &lists[i]) as u64 * weights[i], Reverse(i)));
        let Some(&place) = best else { break };
        see(&mut times, &lists[place]);
        chosen.push(place);
    }

    (chosen, Cover { visible, seen_by: seen_by(&times) })
}

fn unseen(times: &[u8], list: &[u32]) -> usize {
    list.iter().filter(|&&sample| times[sample as usize] == 0).count()
}

fn see(times: &mut [u8], list: &[u32]) {
    for &sample in list {
        let times = &mut times[sample as usize];
        *times = times.saturating_add(1);
    }
}

/// Returns how many samples are in at least one list.
fn visible<'a>(lists: impl Iterator<Item = &'a Vec<u32>>, samples: usize) -> usize {
    let mut times = vec![0; samples];
    lists.for_each(|list| see(&mut times, list));
    times.iter().filter(|&&n| n > 0).count()
}

fn seen_by(times: &[u8]) -> [usize; 3] {
    [1, 2, 3].map(|least| times.iter().filter(|&&n| n >= least).count())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_gain_is_taken_first_and_equal_ones_in_order() {
        let lists = [vec![0, 1], vec![2, 3, 4, 5], vec![4, 5, 6, 7], vec![6, 7, 8]];
        let (chosen, cover) = greedy(&lists, &[1; 4], 10, 1.0);
        assert_eq!(chosen, [1, 3, 0]);
        assert_eq!(cover, Cover { visible: 9, seen_by: [9, 0, 0] });

        // With twice the weight, four samples count as eight.
        let (chosen, cover) = greedy(&lists, &[1, 1, 2, 1], 10, 1.0);
        assert_eq!(chosen, [2, 0, 1, 3]);
        assert_eq!(cover.seen_by, [9, 4, 0]);
    }

    #[test]
    fn a_small_room_is_not_left_out_for_being_small() {
        // Two of a hundred samples are in a room of their own.
        let lists = [(0..98).collect::<Vec<u32>>(), (0..50).collect(), vec![98, 99]];
        let (chosen, cover) = greedy(&lists, &[1; 3], 100, 0.9);
        assert_eq!((chosen, cover.seen_by[0]), (vec![0, 2], 100));

        // Half of the third view is seen already.
        let lists = [(0..98).collect::<Vec<u32>>(), vec![], vec![96, 97, 98, 99]];
        assert_eq!(greedy(&lists, &[1; 3], 100, 0.9).0, [0]);
    }

    #[test]
    fn nothing_to_see_chooses_nothing() {
        assert_eq!(greedy(&[vec![], vec![]], &[500; 2], 3, 0.95).0, [0usize; 0]);
        assert_eq!(greedy(&[], &[], 0, 1.0).1, Cover { visible: 0, seen_by: [0; 3] });
    }
}
