//! A piece of a mesh that edges are collapsed in: who is next to whom, and the points that must stay near.

use super::quadric::Quadric;
use s3d_geom::glam::{DVec3, Vec3};

/// Stands for a missing link.
pub(super) const NONE: u32 = u32::MAX;

/// What a collapse may do with a vertex.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Freedom {
    /// It may move and go.
    Free,
    /// It keeps its place; others may be merged into it.
    Fixed,
    /// Nothing around it changes: other pieces own it, or the surface is not a manifold there.
    Frozen,
}

/// A point of the old surface, with its colour in 0 to 255.
#[derive(Clone, Copy, Debug)]
pub(super) struct Sample {
    pub(super) at: Vec3,
    pub(super) color: [u8; 3],
}

/// Lists of numbers, one per owner, as links: a number moves to another owner without a copy.
#[derive(Clone, Debug)]
pub(super) struct Lists {
    first: Vec<u32>,
    next: Vec<u32>,
}

impl Lists {
    pub(super) fn new(owners: usize, members: usize) -> Self {
        Self { first: vec![NONE; owners], next: vec![NONE; members] }
    }

    pub(super) fn clear(&mut self, owner: u32) {
        self.first[owner as usize] = NONE;
    }

    pub(super) fn push(&mut self, owner: u32, member: u32) {
        self.next[member as usize] = self.first[owner as usize];
        self.first[owner as usize] = member;
    }

    /// Drops the members of a list that do not pass.
    pub(super) fn retain(&mut self, owner: u32, passes: impl Fn(u32) -> bool) {
        let mut at = std::mem::replace(&mut self.first[owner as usize], NONE);
        while at != NONE {
            let next = self.next[at as usize];
            if passes(at) {
                self.push(owner, at);
            }
            at = next;
        }
    }

    pub(super) fn of(&self, owner: u32) -> impl Iterator<Item = u32> + '_ {
        let some = |link: u32| (link != NONE).then_some(link);
        std::iter::successors(some(self.first[owner as usize]), move |&at| some(self.next[at as usize]))
    }
}

/// A piece of a mesh. Everything is numbered within the piece.
#[derive(Clone, Debug)]
pub(super) struct Patch {
    pub(super) positions: Vec<Vec3>,
    /// Colours in 0 to 255.
    pub(super) colors: Vec<Vec3>,
    pub(super) freedom: Vec<Freedom>,
    /// Whether a vertex lies on a border.
    pub(super) on_border: Vec<bool>,
    /// An old vertex that is near.
    pub(super) nearest_vertex: Vec<u32>,
    pub(super) faces: Vec<[u32; 3]>,
    pub(super) is_alive: Vec<bool>,
    pub(super) alive: usize,
    /// Corners (three times the face, plus the corner) by vertex. Only corners of living faces.
    pub(super) corners: Lists,
    pub(super) quadrics: Vec<Quadric>,
    /// The points of the old surface, and for each face those that it is near to.
    pub(super) samples: Vec<Sample>,
    pub(super) samples_of: Lists,
    /// Points of the old border. Each belongs to the border edge that starts at a vertex, seen along its
    /// face.
    pub(super) border_points: Vec<Vec3>,
    pub(super) border_points_of: Lists,
    /// Quadrics are relative to this place, which is near.
    pub(super) origin: DVec3,
    /// Metres for a step of the colour by one.
    pub(super) color_scale_m: f64,
}

impl Patch {
    /// The corners at a vertex, each with the two vertices that follow the vertex in the face.
    pub(super) fn fan(&self, vertex: u32) -> impl Iterator<Item = (u32, u32, u32)> + '_ {
        self.corners.of(vertex).map(|corner| {
            let [a, b, c] = self.faces[(corner / 3) as usize];
            let (next, last) = match corner % 3 {
                0 => (b, c),
                1 => (c, a),
                _ => (a, b),
            };
            (corner, next, last)
        })
    }

    pub(super) fn triangle(&self, face: u32) -> [Vec3; 3] {
        self.faces[face as usize].map(|v| self.positions[v as usize])
    }

    pub(super) fn local(&self, p: Vec3) -> DVec3 {
        p.as_dvec3() - self.origin
    }

    /// Finds borders, freezes vertices around which the surface is not a manifold, and sums quadrics.
    pub(super) fn prepare(&mut self) {
        for face in 0..self.faces.len() as u32 {
            for (at, vertex) in (0..).zip(self.faces[face as usize]) {
                self.corners.push(vertex, 3 * face + at);
            }
        }
        let mut out = Vec::new();
        for vertex in 0..self.positions.len() as u32 {
            if self.freedom[vertex as usize] == Freedom::Frozen {
                continue;
            }
            match self.border_around(vertex, &mut out) {
                Some(border) => self.on_border[vertex as usize] = border,
                None => self.freedom[vertex as usize] = Freedom::Frozen,
            }
        }
        self.sum_quadrics();
    }

    /// Whether a vertex lies on a border; `None` if the faces around it are not one fan.
    fn border_around(&self, vertex: u32, fan: &mut Vec<(u32, u32)>) -> Option<bool> {
        fan.clear();
        fan.extend(self.fan(vertex).map(|(_, a, b)| (a, b)));
        if fan.is_empty() {
            return None;
        }

        // An edge that starts, or ends, twice at the vertex has more than two faces, or faces of two minds.
        let is_repeated = |i: usize| fan[..i].iter().any(|f| f.0 == fan[i].0 || f.1 == fan[i].1);
        if (1..fan.len()).any(is_repeated) {
            return None;
        }

        // From a face without a predecessor, if there is one, the walk must reach all faces.
        let start = fan.iter().position(|f| fan.iter().all(|g| g.1 != f.0));
        let (begin, mut at) = fan[start.unwrap_or(0)];
        let mut seen = 1;
        while let Some(next) = fan.iter().find(|f| f.0 == at).filter(|f| f.0 != begin) {
            at = next.1;
            seen += 1;
        }
        (seen == fan.len()).then_some(start.is_some())
    }

    fn sum_quadrics(&mut self) {
        for face in 0..self.faces.len() as u32 {
            let corners = self.faces[face as usize];
            let p = corners.map(|v| self.local(self.positions[v as usize]));
            let colors = corners.map(|v| self.color_scale_m * self.colors[v as usize].as_dvec3());
            let quadric = Quadric::of_face(p, colors);
            for v in corners {
                self.quadrics[v as usize] += &quadric;
            }

            for i in 0..3 {
                let (from, to) = (corners[i], corners[(i + 1) % 3]);
                if self.is_border(from, to) {
                    let quadric = Quadric::of_border(p[i], p[(i + 1) % 3], p[(i + 2) % 3]);
                    self.quadrics[from as usize] += &quadric;
                    self.quadrics[to as usize] += &quadric;
                }
            }
        }
    }

    /// Whether the edge that a face has from one vertex to another has no face on its other side.
    fn is_border(&self, from: u32, to: u32) -> bool {
        self.on_border[from as usize]
            && self.on_border[to as usize]
            && self.fan(to).all(|(_, next, _)| next != from)
    }

    /// The vertex that the border comes from before `vertex`, and the one that it goes to.
    pub(super) fn along_border(&self, vertex: u32) -> Option<(u32, u32)> {
        let from = self.fan(vertex).find(|f| self.fan(vertex).all(|g| g.1 != f.2))?;
        let to = self.fan(vertex).find(|f| self.fan(vertex).all(|g| g.2 != f.1))?;
        Some((from.2, to.1))
    }
}
