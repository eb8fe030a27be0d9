//! A union-find forest.

/// Disjoint sets of numbers from 0.
pub(super) struct Forest(Vec<u32>);

impl Forest {
    /// Makes a set of each number below `len`.
    pub(super) fn new(len: usize) -> Self {
        Self((0..len as u32).collect())
    }

    /// Returns the number that stands for the set of `of`.
    pub(super) fn root(&mut self, of: u32) -> u32 {
        let mut at = of;
        while self.0[at as usize] != at {
            // Path halving: shortens the way for later calls.
            let grandparent = self.0[self.0[at as usize] as usize];
            self.0[at as usize] = grandparent;
            at = grandparent;
        }
        at
    }

    /// Joins the sets of two roots. The first stands for both.
    pub(super) fn join(&mut self, root: u32, other: u32) {
        self.0[other as usize] = root;
    }

    /// Returns the set of each number. Sets are numbered from 0, by their first members.
    pub(super) fn numbered(mut self) -> (Vec<u32>, usize) {
        let mut number_of_root = vec![u32::MAX; self.0.len()];
        let mut sets = 0;
        let set_of = (0..self.0.len() as u32).map(|member| {
            let number = &mut number_of_root[self.root(member) as usize];
            if *number == u32::MAX {
                *number = sets;
                sets += 1;
            }
            *number
        });
        (set_of.collect(), sets as usize)
    }
}
