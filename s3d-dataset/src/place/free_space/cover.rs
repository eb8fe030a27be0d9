//! Few places that together see much: the greedy cover of the art-gallery problem.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

/// A candidate of whose view less than this share is seen by the chosen ones asks for one more: so a small
/// room is not left out because it is little of a large building.
const SHARE_OF_EVERY_VIEW: f64 = 0.5;

/// How many samples are seen.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Cover {
    /// By any candidate.
    pub(super) visible: usize,
    /// By one chosen place or more, by two or more, by three or more.
    pub(super) seen_by: [usize; 3],
}

impl Cover {
    /// What is seen by the chosen places, of what is by all that there are.
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

/// Chooses places one by one, each that with the largest `weight` times the number of samples that it sees
/// and no place before it does; of equal ones the first. Ends when `share` of what all together see is seen,
/// and of what each of them sees at least half.
///
/// The gain of a place only shrinks, so that it need not be counted again while the old count of another is
/// smaller than its new one (Minoux 1978).
pub(super) fn greedy(lists: &[Vec<u32>], weights: &[u64], samples: usize, share: f64) -> (Vec<usize>, Cover) {
    let visible = visible(lists.iter(), samples);
    let enough = (share * visible as f64).ceil() as usize;
    let mut times = vec![0u8; samples];
    let (mut chosen, mut seen) = (Vec::new(), 0);
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
            // Again when it is its turn; what adds nothing never is.
            heap.extend((gain > 0).then_some((gain, Reverse(place))));
            continue;
        }
        seen += new;
        see(&mut times, &lists[place]);
        chosen.push(place);
    }
    // Those that ask for one more are never more than before.
    let mut asking: Vec<usize> = (0..lists.len()).collect();
    loop {
        asking.retain(|&i| {
            let list = &lists[i];
            let seen = list.len() - unseen(&times, list);
            (seen as f64) < SHARE_OF_EVERY_VIEW * list.len() as f64
        });
        let gain = |i: usize| (unseen(&times, &lists[i]) as u64 * weights[i], Reverse(i));
        let Some(&place) = asking.iter().max_by_key(|&&i| gain(i)) else { break };
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

/// How many samples are in any of some lists.
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
        // Twice the weight: four samples count eight.
        let (chosen, cover) = greedy(&lists, &[1, 1, 2, 1], 10, 1.0);
        assert_eq!(chosen, [2, 0, 1, 3]);
        assert_eq!(cover.seen_by, [9, 4, 0]);
    }

    #[test]
    fn a_small_room_is_not_left_out_for_being_small() {
        // Two samples of a hundred are in a room of their own.
        let lists = [(0..98).collect::<Vec<u32>>(), (0..50).collect(), vec![98, 99]];
        let (chosen, cover) = greedy(&lists, &[1; 3], 100, 0.9);
        assert_eq!((chosen, cover.seen_by[0]), (vec![0, 2], 100));
        // Half of what the third sees is seen already.
        let lists = [(0..98).collect::<Vec<u32>>(), vec![], vec![96, 97, 98, 99]];
        assert_eq!(greedy(&lists, &[1; 3], 100, 0.9).0, [0]);
    }

    #[test]
    fn nothing_to_see_chooses_nothing() {
        assert_eq!(greedy(&[vec![], vec![]], &[500; 2], 3, 0.95).0, [0usize; 0]);
        assert_eq!(greedy(&[], &[], 0, 1.0).1, Cover { visible: 0, seen_by: [0; 3] });
    }
}
