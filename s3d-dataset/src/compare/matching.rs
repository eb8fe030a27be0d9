//! Matches the instances of both data sets by the surface that they share.

use super::comparison::Side;
use super::names::{MISSING, NULL};
use s3d_geom::DisjointSets;
use std::collections::{BTreeMap, BTreeSet};

/// Instances are the same thing if they share at least this part of their surface: intersection over union.
const LEAST_IOU: f64 = 0.25;

/// Square metres of a mesh, by the number of the label in A and in B. On A's mesh, the label in B is the one
/// of B's surface at the same place, or [`MISSING`] if there is none; on B's mesh the other way round.
pub(crate) type SharedSurface = BTreeMap<(u32, u32), f64>;

/// Which instance of B is which instance of A. Labels go by their numbers in [`super::names::Names`].
#[derive(Debug)]
pub(crate) struct Matching {
    /// The instance of the other data set that is this one, by instance of A and by instance of B.
    partners: [Vec<Option<u32>>; 2],
    /// The surface of each instance in A and in B, square metres; `None` if the meshes were not compared.
    m2: [Vec<Option<f64>>; 2],
    /// The instances of A and of B that share more than half of the surface of one of them.
    parts: Vec<(u32, u32)>,
}

/// The surface of an instance, and the part of it at whose place the other mesh has a surface.
#[derive(Clone, Copy, Default)]
struct Own {
    m2: f64,
    found_m2: f64,
}

impl Own {
    fn is_mostly_alone(self) -> bool {
        self.found_m2 <= self.m2 / 2.0
    }
}

/// Instances that may be the same thing.
struct Candidate {
    a: u32,
    b: u32,
    iou: f64,
}

impl Matching {
    /// Matches labels by name, by `count` numbers.
    pub(crate) fn by_name(count: usize, is_in_both: impl Fn(u32) -> bool) -> Self {
        let numbers = 0..count as u32;
        let partners: Vec<Option<u32>> = numbers
            .map(|number| (is_instance(number) && is_in_both(number)).then_some(number))
            .collect();
        let m2 = vec![None; count];
        Self { partners: [partners.clone(), partners], m2: [m2.clone(), m2], parts: Vec::new() }
    }

    /// The instance of the other data set that is this instance of a data set.
    pub(crate) fn partner(&self, side: Side, number: u32) -> Option<u32> {
        self.partners[side as usize].get(number as usize).copied().flatten()
    }

    /// The surface of an instance, square metres; `None` if the meshes were not compared.
    pub(crate) fn m2(&self, side: Side, number: u32) -> Option<f64> {
        self.m2[side as usize].get(number as usize).copied().flatten()
    }

    /// Matches the instances of an area anew, by what they share on A's mesh and on B's.
    ///
    /// The pair with the largest intersection over union is matched first. Pairs below [`LEAST_IOU`] are
    /// matched only if their names are the same, and come last. If the ratios are equal, pairs with the same
    /// name come first, then pairs of one class, then the first by name. An instance that is left is matched
    /// by name if the other mesh has nothing at most of its surface.
    pub(crate) fn match_area(
        &mut self,
        on: [&SharedSurface; 2],
        is_in_both: impl Fn(u32) -> bool,
        is_one_class: impl Fn(u32, u32) -> bool,
    ) {
        let own_a = own_surfaces(on[0], |(a, b)| (a, b));
        let own_b = own_surfaces(on[1], |(a, b)| (b, a));
        let of_a = |number| own_a.get(&number).copied().unwrap_or_default();
        let of_b = |number| own_b.get(&number).copied().unwrap_or_default();

        let numbers: BTreeSet<u32> = own_a.keys().chain(own_b.keys()).copied().collect();
        for &number in &numbers {
            self.part(number);
            self.m2[0][number as usize] = Some(of_a(number).m2);
            self.m2[1][number as usize] = Some(of_b(number).m2);
        }

        let mut candidates = Vec::new();
        let pairs: BTreeSet<(u32, u32)> = on.iter().flat_map(|on| on.keys()).copied().collect();
        for (a, b) in pairs.into_iter().filter(|(a, b)| is_instance(*a) && is_instance(*b)) {
            let [on_a, on_b] = on.map(|on| on.get(&(a, b)).copied().unwrap_or_default());
            if on_a > of_a(a).m2 / 2.0 || on_b > of_b(b).m2 / 2.0 {
                self.parts.push((a, b));
            }

            // The meshes may measure what is shared differently. The Dice coefficient takes both, and the
            // intersection over union follows from it.
            let dice = (on_a + on_b) / (of_a(a).m2 + of_b(b).m2);
            let iou = dice / (2.0 - dice);
            if iou >= LEAST_IOU || a == b {
                candidates.push(Candidate { a, b, iou });
            }
        }

        candidates.sort_by(|x, y| {
            let key = |of: &Candidate| (of.a != of.b, !is_one_class(of.a, of.b), of.a, of.b);
            let is_small = |of: &Candidate| of.iou < LEAST_IOU;
            let by_share = y.iou.total_cmp(&x.iou);
            is_small(x)
                .cmp(&is_small(y))
                .then(by_share)
                .then_with(|| key(x).cmp(&key(y)))
        });
        for Candidate { a, b, .. } in candidates {
            self.join_free(a, b);
        }
        for number in numbers {
            let is_alone = of_a(number).is_mostly_alone() || of_b(number).is_mostly_alone();
            if is_alone && is_in_both(number) {
                self.join_free(number, number);
            }
        }
    }

    /// Matches two instances, unless one of them has a partner already.
    fn join_free(&mut self, a: u32, b: u32) {
        if self.partner(Side::A, a).is_none() && self.partner(Side::B, b).is_none() {
            self.partners[0][a as usize] = Some(b);
            self.partners[1][b as usize] = Some(a);
        }
    }

    /// Parts the instances with this number from their partners.
    fn part(&mut self, number: u32) {
        for (side, other) in [(0, 1), (1, 0)] {
            if let Some(partner) = self.partners[side][number as usize].take() {
                self.partners[other][partner as usize] = None;
            }
        }
    }

    /// The instances of A and of B in groups: partners, and instances that share more than half of the
    /// surface of one of them. An instance without any of these is a group of its own; so are both of two
    /// that share too little to be partners. The largest of a group comes first.
    pub(crate) fn groups(&self, has: impl Fn(Side, u32) -> bool) -> Vec<[Vec<u32>; 2]> {
        let count = self.partners[0].len();
        // The root of a group is its first instance, and those of B come after A's.
        let mut sets = DisjointSets::new(2 * count);
        let partners = (0..).zip(&self.partners[0]).filter_map(|(a, b)| Some((a, (*b)?)));
        for (a, b) in partners.chain(self.parts.iter().copied()) {
            sets.unite(a, count as u32 + b);
        }

        let mut groups: BTreeMap<u32, [Vec<u32>; 2]> = BTreeMap::new();
        for (side, offset) in [(Side::A, 0), (Side::B, count as u32)] {
            for number in (0..count as u32).filter(|number| is_instance(*number) && has(side, *number)) {
                let group = groups.entry(sets.root(offset + number)).or_default();
                group[side as usize].push(number);
            }
        }

        let mut all = Vec::new();
        for [mut a, mut b] in groups.into_values() {
            if let ([a], [b]) = (&a[..], &b[..])
                && self.partner(Side::A, *a) != Some(*b)
            {
                all.extend([[vec![*a], Vec::new()], [Vec::new(), vec![*b]]]);
                continue;
            }
            for (side, numbers) in [(Side::A, &mut a), (Side::B, &mut b)] {
                let size = |number: &u32| self.m2(side, *number).unwrap_or_default();
                numbers.sort_by(|x, y| size(y).total_cmp(&size(x)));
            }
            all.push([a, b]);
        }
        all
    }
}

/// Whether a number stands for an instance.
pub(crate) fn is_instance(number: u32) -> bool {
    number != NULL && number != MISSING
}

/// The surfaces of the instances of a mesh. `split` returns the mesh's own label and the other's.
fn own_surfaces(on: &SharedSurface, split: impl Fn((u32, u32)) -> (u32, u32)) -> BTreeMap<u32, Own> {
    let mut all: BTreeMap<u32, Own> = BTreeMap::new();
    for (&labels, &m2) in on {
        let (number, other) = split(labels);
        if is_instance(number) {
            let own = all.entry(number).or_default();
            own.m2 += m2;
            own.found_m2 += if other == MISSING { 0.0 } else { m2 };
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Matches labels 1 to 6 by what they share on one mesh. Labels of one parity are of one class. Those
    /// that are not in the mesh are in both data sets.
    fn matched(shared: &[(u32, u32, f64)]) -> Matching {
        let mut matching = Matching::by_name(7, |_| true);
        let on: SharedSurface = shared.iter().map(|(a, b, m2)| ((*a, *b), *m2)).collect();
        let is_in_a = |number| on.keys().any(|(a, _)| *a == number);
        let is_in_b = |number| on.keys().any(|(_, b)| *b == number);
        let is_in_both = |number| is_in_a(number) == is_in_b(number);
        matching.match_area([&on, &on], is_in_both, |a, b| a % 2 == b % 2);
        matching
    }

    fn partners(matching: &Matching) -> Vec<Option<u32>> {
        (1..7).map(|number| matching.partner(Side::A, number)).collect()
    }

    fn groups(matching: &Matching) -> Vec<[Vec<u32>; 2]> {
        let is_changed = |[a, b]: &[Vec<u32>; 2]| a.len() != 1 || b.len() != 1;
        matching.groups(|_, _| true).into_iter().filter(is_changed).collect()
    }

    #[test]
    fn the_largest_share_of_both_is_matched_first_and_names_decide_ties() {
        // 1 and 2 changed their numbers; what is not in the meshes keeps its name.
        let renumbered = matched(&[(1, 2, 3.0), (2, 1, 1.0), (0, 3, 0.5), (3, 3, 2.0)]);
        assert_eq!(partners(&renumbered), [2, 1, 3, 4, 5, 6].map(Some));
        assert_eq!((renumbered.m2(Side::A, 1), renumbered.m2(Side::B, 3)), (Some(3.0), Some(2.5)));
        assert_eq!((renumbered.m2(Side::A, 4), groups(&renumbered)), (None, vec![]));

        // Halves: first the same name, then the same class, then the first by name.
        assert_eq!(matched(&[(2, 1, 1.0), (2, 2, 1.0)]).partner(Side::A, 2), Some(2));
        assert_eq!(matched(&[(2, 1, 1.0), (2, 4, 1.0)]).partner(Side::A, 2), Some(4));
        assert_eq!(matched(&[(2, 1, 1.0), (2, 3, 1.0)]).partner(Side::A, 2), Some(1));
    }

    #[test]
    fn instances_are_split_merged_and_lost() {
        let split = matched(&[(1, 1, 1.0), (1, 2, 3.0), (2, 0, 1.0)]);
        assert_eq!((split.partner(Side::A, 1), split.partner(Side::B, 1)), (Some(2), None));
        // 2 lost all of its surface to no label, and 1 is in two parts.
        assert_eq!(groups(&split), [[vec![1], vec![2, 1]], [vec![2], vec![]]]);
        let merged = matched(&[(1, 1, 3.0), (2, 1, 1.0)]);
        assert_eq!(groups(&merged), [[vec![1, 2], vec![1]], [vec![], vec![2]]]);
        assert_eq!(partners(&merged)[..2], [Some(1), None]);

        // What is left of a wall is no board, but a wall that is left is the wall.
        let board = matched(&[(1, 2, 1.0), (1, 0, 9.0)]);
        assert_eq!((partners(&board)[0], groups(&board).len()), (None, 4));
        assert_eq!(partners(&matched(&[(1, 1, 1.0), (1, 0, 9.0)]))[0], Some(1));
    }

    #[test]
    fn what_the_other_mesh_lacks_is_matched_by_name() {
        let mut matching = Matching::by_name(7, |_| true);
        let on_a = SharedSurface::from([((1, MISSING), 2.0), ((1, 3), 1.0), ((3, 3), 4.0)]);
        let on_b = SharedSurface::from([((MISSING, 1), 2.0), ((1, 3), 1.1), ((3, 3), 3.9)]);
        matching.match_area([&on_a, &on_b], |_| true, |_, _| true);
        assert_eq!(partners(&matching), [1, 2, 3, 4, 5, 6].map(Some));
        // The same surface on one mesh is another instance.
        let other = matched(&[(1, 3, 2.0), (0, 1, 2.0), (3, 3, 4.0)]);
        assert_eq!((other.partner(Side::A, 1), other.partner(Side::B, 1)), (None, None));
    }
}
