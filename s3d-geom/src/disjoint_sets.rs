//! Disjoint sets, and the segmentation of graphs that is built on them.

/// Disjoint sets of numbers from 0: a union-find forest.
///
/// ```
/// use s3d_geom::DisjointSets;
///
/// let mut sets = DisjointSets::new(4);
/// sets.unite(3, 1);
/// assert_eq!(sets.root(3), 1);
/// assert_eq!(sets.numbered(), (vec![0, 1, 2, 1], 3));
/// ```
///
/// # Panics
/// All methods panic at a number that is in no set.
#[derive(Clone, Debug, Default)]
pub struct DisjointSets(Vec<u32>);

impl DisjointSets {
    /// Makes a set of each number below `len`.
    pub fn new(len: usize) -> Self {
        Self((0..len as u32).collect())
    }

    /// Adds a set of one more number, and returns that.
    pub fn add(&mut self) -> u32 {
        let number = self.0.len() as u32;
        self.0.push(number);
        number
    }

    /// Returns the number that stands for the set of `of`.
    #[inline]
    pub fn root(&mut self, of: u32) -> u32 {
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
    #[inline]
    pub fn join(&mut self, root: u32, other: u32) {
        self.0[other as usize] = root;
    }

    /// Joins the sets of two numbers. The lower of their roots stands for both: the first member, if sets are
    /// joined in no other way.
    #[inline]
    pub fn unite(&mut self, a: u32, b: u32) {
        let [a, b] = [self.root(a), self.root(b)];
        self.join(a.min(b), a.max(b));
    }

    /// Returns the root of each number.
    pub fn roots(mut self) -> Vec<u32> {
        (0..self.0.len() as u32).map(|member| self.root(member)).collect()
    }

    /// Returns the set of each number, and the number of sets. Sets are numbered from 0, by their first
    /// members.
    pub fn numbered(mut self) -> (Vec<u32>, usize) {
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

/// Segments a graph by Felzenszwalb and Huttenlocher's method. `sizes` has the size of each node. `edges`
/// gives pairs of nodes with their difference, from the smallest difference on.
///
/// Two sets of nodes are joined if the edge between them differs no more than each differs within itself,
/// plus an allowance of `scale` divided by its size. A set smaller than `smallest` then joins the neighbour
/// from which it differs least. Source: "Efficient Graph-Based Image Segmentation", IJCV 59(2), 2004.
///
/// ```
/// use s3d_geom::segment_graph;
///
/// // A chain of four nodes with a large step in its middle.
/// let edges = [([0, 1], 0.1), ([2, 3], 0.1), ([1, 2], 9.0)];
/// assert_eq!(segment_graph(vec![1.0; 4], edges.into_iter(), 1.0, 1.0).numbered().0, [0, 0, 1, 1]);
/// assert_eq!(segment_graph(vec![1.0; 4], edges.into_iter(), 1.0, 3.0).numbered().1, 1);
/// ```
///
/// # Panics
/// If an edge has a node without a size.
pub fn segment_graph(
    sizes: Vec<f64>,
    edges: impl Iterator<Item = ([u32; 2], f32)>,
    scale: f64,
    smallest: f64,
) -> DisjointSets {
    let mut sets = DisjointSets::new(sizes.len());
    // The size of each set, and the largest difference that it allows to a neighbour.
    let mut segments: Vec<[f64; 2]> = sizes.into_iter().map(|size| [size, scale / size]).collect();
    let mut between = Vec::new();
    for (nodes, difference) in edges {
        let [a, b] = nodes.map(|node| sets.root(node));
        if a == b {
            continue;
        }
        let difference = f64::from(difference);
        let ([size, allowed], [other_size, other_allowed]) = (segments[a as usize], segments[b as usize]);
        if difference > allowed || difference > other_allowed {
            between.push(nodes);
            continue;
        }
        let (root, other) = if size < other_size { (b, a) } else { (a, b) };
        sets.join(root, other);
        let size = size + other_size;
        segments[root as usize] = [size, difference + scale / size];
    }

    for nodes in between {
        let [a, b] = nodes.map(|node| sets.root(node));
        let [size, other_size] = [segments[a as usize][0], segments[b as usize][0]];
        if a != b && size.min(other_size) < smallest {
            let (root, other) = if size < other_size { (b, a) } else { (a, b) };
            sets.join(root, other);
            segments[root as usize][0] = size + other_size;
        }
    }
    sets
}
