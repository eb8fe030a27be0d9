// The tree of patches. Its leaves are the segments of the mesh; a join has two or more nodes below it.

/** The parent of a root. */
export const NO_PARENT = 0xffffffff;

export class Tree {
  /** The faces, so ordered that those of each node follow one another. */
  private readonly faces: Uint32Array;
  /** Where the faces of each node begin and end in `faces`. */
  private readonly first: Uint32Array;
  private readonly end: Uint32Array;

  constructor(
    /** The segment of each face. */
    readonly segment: Uint32Array,
    /** The parent of each node, which comes after the node. */
    private readonly parents: Uint32Array,
    /** What each join costs, 0 for segments. */
    private readonly costs: Float32Array,
  ) {
    const nodes = parents.length;
    const size = new Uint32Array(nodes);
    for (const of of segment) size[of] = (size[of] ?? 0) + 1;
    const own = size.slice();
    parents.forEach((parent, node) => {
      if (parent !== NO_PARENT) size[parent] = (size[parent] ?? 0) + (size[node] ?? 0);
    });
    this.first = new Uint32Array(nodes);
    this.end = new Uint32Array(nodes);
    // From the roots down: each node takes the next place in that of its parent.
    const next = new Uint32Array(nodes);
    let roots = 0;
    for (let node = nodes - 1; node >= 0; node--) {
      const parent = parents[node] ?? NO_PARENT;
      const at = parent === NO_PARENT ? roots : (next[parent] ?? 0);
      const end = at + (size[node] ?? 0);
      if (parent === NO_PARENT) roots = end;
      else next[parent] = end;
      this.first[node] = at;
      this.end[node] = end;
      next[node] = at;
    }
    this.faces = new Uint32Array(segment.length);
    const place = this.first.slice();
    segment.forEach((of, face) => {
      if (own[of]) this.faces[place[of]!++] = face;
    });
  }

  get nodes(): number {
    return this.parents.length;
  }

  /** The faces of a node. */
  facesOf(node: number): Uint32Array {
    return this.faces.subarray(this.first[node], this.end[node]);
  }

  /** The node above; null for a root. */
  parent(node: number): number | null {
    const parent = this.parents[node] ?? NO_PARENT;
    return parent === NO_PARENT ? null : parent;
  }

  /** Whether a node has a face. */
  holds(node: number, face: number): boolean {
    const leaf = this.segment[face] ?? NO_PARENT;
    const at = this.first[leaf] ?? NO_PARENT;
    return at >= (this.first[node] ?? 0) && at < (this.end[node] ?? 0);
  }

  /** The largest node with a face that costs no more than this: its segment at the least. */
  nodeAt(face: number, cost: number): number {
    let node = this.segment[face] ?? 0;
    for (;;) {
      const parent = this.parent(node);
      if (parent === null || this.cost(parent) > cost) return node;
      node = parent;
    }
  }

  /** The root above a face. */
  rootAt(face: number): number {
    return this.nodeAt(face, Infinity);
  }

  /** The node below that has a face; the node itself if that is a segment. */
  childAt(node: number, face: number): number {
    let below = this.segment[face] ?? 0;
    for (;;) {
      const parent = this.parent(below);
      if (below === node || parent === null || parent === node) return below;
      below = parent;
    }
  }

  cost(node: number): number {
    return this.costs[node] ?? 0;
  }

  /** The number of joins between a node and the segment of one of its faces. */
  steps(node: number, face: number): number {
    let steps = 0;
    for (let at: number | null = this.segment[face] ?? 0; at !== null && at !== node; at = this.parent(at))
      steps++;
    return steps;
  }

  /** The patch at a face: those faces of the node that belong to the same instance as this face. */
  patch(node: number, face: number, instances: Uint32Array): Uint32Array {
    const of = instances[face];
    return this.facesOf(node).filter((other) => instances[other] === of);
  }
}
