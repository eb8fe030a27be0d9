// Sets of faces as the server sends them: a gap, a length, a gap, a length, and so on.

/** The numbers of the faces, ascending. */
export function facesOf(runs: readonly number[]): Uint32Array {
  let count = 0;
  for (let i = 1; i < runs.length; i += 2) count += runs[i] ?? 0;
  const faces = new Uint32Array(count);
  let [at, face] = [0, 0];
  for (let i = 0; i + 1 < runs.length; i += 2) {
    face += runs[i] ?? 0;
    for (let k = runs[i + 1] ?? 0; k > 0; k--) faces[at++] = face++;
  }
  return faces;
}

/** The runs of some faces, in any order. */
export function runsOf(faces: Iterable<number>): number[] {
  const sorted = Uint32Array.from(faces).sort();
  const runs: number[] = [];
  let end = 0;
  let last = -1;
  for (const face of sorted) {
    if (face === last) continue;
    if (face === end && runs.length > 0) runs[runs.length - 1] = (runs.at(-1) ?? 0) + 1;
    else runs.push(face - end, 1);
    end = face + 1;
    last = face;
  }
  return runs;
}
