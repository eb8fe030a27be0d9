//! Which triangles part the corners of a cell: the cases of marching cubes, made by rule.
//!
//! Each side of a cell joins the edges that the surface crosses by lines, seen from the corners of that side
//! alone. So both cells of a side draw the same lines, and the surface has no cracks. Where two opposite
//! corners of a side are in front, each is cut off, and what is behind stays in one piece. The lines of all
//! sides close to loops, and loops are cut into triangles whose new edges do not lie in a side of the cell,
//! so an edge has two faces. Source: the rule of Montani, Scateni and Scopigno 1994, "A modified look-up
//! table for implicit disambiguation of Marching Cubes".

use std::sync::LazyLock;

/// The corners at both ends of each edge. Corner bits are x, y and z. Edge 4·axis + k leads along its axis.
pub(crate) const EDGES: [[u8; 2]; 12] =
    [[0, 1], [2, 3], [4, 5], [6, 7], [0, 2], [1, 3], [4, 6], [5, 7], [0, 4], [1, 5], [2, 6], [3, 7]];

/// The corners of each side, counter-clockwise from outside.
const SIDES: [[u8; 4]; 6] =
    [[0, 4, 6, 2], [1, 3, 7, 5], [0, 1, 5, 4], [2, 6, 7, 3], [0, 2, 3, 1], [4, 5, 7, 6]];

/// The triangles of each set of corners behind the surface, as edges. Fronts show to corners before it.
pub(crate) static TRIANGLES: LazyLock<Vec<Vec<[u8; 3]>>> =
    LazyLock::new(|| (0..=255).map(triangles).collect());

fn triangles(behind: u8) -> Vec<[u8; 3]> {
    let mut next = [u8::MAX; 12];
    for side in SIDES {
        let is_behind = |i: usize| behind >> side[i % 4] & 1 == 1;
        // From where the way around the side comes out to the front to where it goes behind again.
        for start in (0..4).filter(|&i| is_behind(i) && !is_behind(i + 1)) {
            let end = (start + 1..start + 5).find(|&i| !is_behind(i) && is_behind(i + 1));
            let edge = |i: usize| edge_between(side[i % 4], side[(i + 1) % 4]);
            if let Some(end) = end {
                next[edge(end) as usize] = edge(start);
            }
        }
    }

    let mut triangles = Vec::new();
    for start in 0..12 {
        let mut ring = Vec::new();
        let mut at = start as u8;
        while next[at as usize] != u8::MAX {
            ring.push(at);
            at = std::mem::replace(&mut next[at as usize], u8::MAX);
        }
        if ring.len() >= 3 {
            triangles.extend(cut(&ring).1);
        }
    }
    triangles
}

fn edge_between(a: u8, b: u8) -> u8 {
    let ends = [a.min(b), a.max(b)];
    EDGES.iter().position(|e| *e == ends).unwrap_or_default() as u8
}

/// Returns true if two edges are edges of one side.
fn share_side(a: u8, b: u8) -> bool {
    let [a, b] = [a, b].map(|e| EDGES[e as usize]);
    SIDES
        .iter()
        .any(|side| [a, b].iter().flatten().all(|c| side.contains(c)))
}

/// Cuts a ring into triangles with the fewest new edges in sides of the cell, and returns their number too.
fn cut(ring: &[u8]) -> (u32, Vec<[u8; 3]>) {
    if ring.len() < 3 {
        return (0, Vec::new());
    }
    let last = ring.len() - 1;
    let cost = |a: usize, b: usize| u32::from(b - a > 1 && b - a < last && share_side(ring[a], ring[b]));
    // The triangle at the edge from the last place to the first, with any tip.
    let with_tip = |tip: usize| {
        let (a, left) = cut(&ring[..=tip]);
        let (b, right) = cut(&ring[tip..]);
        let all = left
            .into_iter()
            .chain([[ring[0], ring[tip], ring[last]]])
            .chain(right)
            .collect();
        (a + b + cost(0, tip) + cost(tip, last), all)
    };
    (1..last)
        .map(with_tip)
        .min_by_key(|(cost, _)| *cost)
        .unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    #[test]
    fn each_case_is_closed_but_for_its_sides() {
        for behind in 0..=255_u8 {
            let mut edges = BTreeMap::new();
            for t in &TRIANGLES[behind as usize] {
                for k in 0..3 {
                    *edges.entry((t[k], t[(k + 1) % 3])).or_insert(0) += 1;
                }
                for e in t {
                    let [a, b] = EDGES[*e as usize].map(|c| behind >> c & 1);
                    assert_ne!(a, b, "an edge that is not crossed");
                }
            }
            for (&(a, b), &count) in &edges {
                assert_eq!(count, 1, "case {behind}: {a} → {b}");
                let is_inner = edges.contains_key(&(b, a));
                assert_ne!(
                    is_inner,
                    share_side(a, b),
                    "case {behind}: an edge of a side has one face: {a} {b}"
                );
            }
        }
    }

    #[test]
    fn fronts_show_to_what_is_before_the_surface() {
        // Corner 0 alone is behind: the triangle faces away from it.
        let [t] = TRIANGLES[1][..] else { panic!("one triangle") };
        let middle = |e: u8| {
            let [a, b] = EDGES[e as usize].map(|c| [0, 1, 2].map(|k| f32::from(c >> k & 1)));
            s3d_geom::glam::Vec3::from_array([0, 1, 2].map(|k| 0.5 * (a[k] + b[k])))
        };
        let [a, b, c] = t.map(middle);
        assert!((b - a).cross(c - a).dot(s3d_geom::glam::Vec3::ONE) > 0.0);
    }
}
