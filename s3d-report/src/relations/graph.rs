//! The overlap graph of an area: the places of cameras, joined where images share surface.

use super::partners::{Pairs, Place};
use crate::index::rounded;
use serde::Serialize;
use std::collections::BTreeMap;

/// An edge is left out if it is not among so many with the highest shares at either of its ends.
const MOST_EDGES: usize = 12;

/// `data/graph_A.js`.
#[derive(Serialize)]
pub(crate) struct Graph {
    /// Edges with the highest shares first.
    edges: Vec<Edge>,
    /// The number of edges that are left out.
    left_out: usize,
}

#[derive(Serialize)]
struct Edge {
    ends: [Place; 2],
    /// The highest mean, of all pairs of images of the two places, of the shares that each image sees of the
    /// other one's points.
    share: f64,
    /// The number of pairs of images.
    pairs: usize,
}

impl Graph {
    pub(crate) fn new(pairs: &Pairs<'_>) -> Self {
        // Each pair once.
        let mut joined: BTreeMap<[Place; 2], (f32, usize)> = BTreeMap::new();
        for (row, member) in pairs.members.iter().enumerate() {
            let Some(from) = member else { continue };
            for pair in pairs.of(row).filter(|pair| pair.other > row) {
                let Some(Some(to)) = pairs.members.get(pair.other) else { continue };
                if from.place == to.place {
                    continue;
                }
                let mut ends = [from.place, to.place];
                ends.sort_unstable();
                let [here, there] = pairs.shared(row, &pair);
                let (share, count) = joined.entry(ends).or_default();
                *share = share.max(0.5 * (here + there));
                *count += 1;
            }
        }

        let mut edges: Vec<Edge> = joined
            .into_iter()
            .map(|(ends, (share, pairs))| Edge { ends, share: rounded(share.into(), 3), pairs })
            .collect();
        edges.sort_by(|a, b| b.share.total_cmp(&a.share).then(a.ends.cmp(&b.ends)));
        let all = edges.len();
        let mut at: BTreeMap<Place, usize> = BTreeMap::new();
        edges.retain(|edge| {
            let ranks = edge.ends.map(|end| {
                let rank = at.entry(end).or_default();
                *rank += 1;
                *rank
            });
            ranks.iter().any(|rank| *rank <= MOST_EDGES)
        });
        Self { left_out: all - edges.len(), edges }
    }
}
