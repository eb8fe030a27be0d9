//! Tells what became of the instances.

use super::comparison::{InstanceChange, InstanceChangeKind, LabelCounts, LabelPairs, RenamedInstance, Side};
use super::names::{Change, Names, size};
use std::cmp::Reverse;
use std::collections::BTreeMap;

/// Instances of the same class with another name: those that stayed in their room, and the others. `pairs`
/// counts the surface and pixels whose labels differ.
pub(crate) fn renamed(names: &Names, pairs: &LabelPairs) -> (Vec<RenamedInstance>, Vec<RenamedInstance>) {
    let partners = names
        .numbers()
        .filter_map(|a| Some((a, names.matching().partner(Side::A, a)?)));
    let renamed = partners.filter(|(a, b)| names.change(*a, *b) == Change::Renumbered);

    let entries = renamed.map(|(a, b)| RenamedInstance {
        a: names.name(a).to_owned(),
        b: names.name(b).to_owned(),
        counts: pairs.get(&(a, b)).copied().unwrap_or_default(),
    });
    entries.partition(|of| room_of(&of.a) == room_of(&of.b))
}

/// The room and the area in the name of a label: its words after the class and the number.
fn room_of(name: &str) -> Option<&str> {
    name.splitn(3, '_').nth(2)
}

/// The instances whose surface or pixels changed, in groups of those that belong together. The largest
/// surface with another class comes first.
pub(crate) fn changes(names: &Names, pairs: &LabelPairs) -> Vec<InstanceChange> {
    let groups = names.matching().groups(|side, number| names.has(side, number));
    let mut group_of: [BTreeMap<u32, usize>; 2] = Default::default();
    for (place, group) in groups.iter().enumerate() {
        for (group_of, numbers) in group_of.iter_mut().zip(group) {
            group_of.extend(numbers.iter().map(|number| (*number, place)));
        }
    }

    let mut all: Vec<InstanceChange> = groups.iter().map(|[a, b]| entry(names, a, b)).collect();
    let [group_of_a, group_of_b] = &group_of;
    for (&(a, b), &counts) in pairs {
        let change = names.change(a, b);
        if !change.is_true() {
            continue;
        }

        let from = group_of_a.get(&a).copied();
        let to = group_of_b.get(&b).copied();
        let is_inside = from == to;
        for (place, is_lost) in [(from, true), (to.filter(|_| !is_inside), false)] {
            let Some(of) = place.and_then(|place| all.get_mut(place)) else { continue };
            match (is_inside, is_lost) {
                (true, _) => of.relabelled += counts,
                (false, true) => of.lost += counts,
                (false, false) => of.gained += counts,
            }
            if change == Change::Class {
                of.class_changed += counts;
            }
        }
    }

    all.retain(|of| total(of) != LabelCounts::default() || is_alone(of));
    // The sort is stable, so the first by name wins a tie.
    all.sort_by_key(|of| {
        let surface = of.m2_a.unwrap_or_default() + of.m2_b.unwrap_or_default();
        Reverse((size(&of.class_changed), size(&total(of)), surface.to_bits()))
    });
    all
}

/// A group without changes.
fn entry(names: &Names, a: &[u32], b: &[u32]) -> InstanceChange {
    let kind = match (a, b) {
        ([], _) => InstanceChangeKind::Appeared,
        (_, []) => InstanceChangeKind::Vanished,
        ([a], [b]) if names.class(Side::A, *a) == names.class(Side::B, *b) => InstanceChangeKind::Extent,
        ([_], [_]) => InstanceChangeKind::Class,
        ([_], _) => InstanceChangeKind::Split,
        (_, [_]) => InstanceChangeKind::Merged,
        _ => InstanceChangeKind::Regrouped,
    };
    let all_names = |numbers: &[u32]| numbers.iter().map(|n| names.name(*n).to_owned()).collect();
    let m2 = |side, numbers: &[u32]| {
        let surfaces = numbers.iter().map(|number| names.matching().m2(side, *number));
        surfaces.sum::<Option<f64>>().filter(|_| !numbers.is_empty())
    };
    InstanceChange {
        kind,
        a: all_names(a),
        b: all_names(b),
        m2_a: m2(Side::A, a),
        m2_b: m2(Side::B, b),
        lost: LabelCounts::default(),
        gained: LabelCounts::default(),
        relabelled: LabelCounts::default(),
        class_changed: LabelCounts::default(),
    }
}

/// All that changed of a group.
fn total(of: &InstanceChange) -> LabelCounts {
    let mut all = of.lost;
    all += of.gained;
    all += of.relabelled;
    all
}

/// Whether a group has a surface, and there is nothing of it in the other data set.
fn is_alone(of: &InstanceChange) -> bool {
    (of.a.is_empty() || of.b.is_empty()) && of.m2_a.or(of.m2_b).is_some_and(|m2| m2 > 0.0)
}
