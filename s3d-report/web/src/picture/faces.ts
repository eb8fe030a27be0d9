// The votes for the faces of a mesh: `faces_A.js`.

import { load, unpacked } from "../data.js";

/** The margin of a face without votes. */
export const NO_VOTES = 255;
/** The margin of a face that all votes agree on. */
export const SURE = 254;

export interface FaceVotes {
  /** Indices of labels. */
  label: Uint32Array;
  /** Indices of labels; 0 if all votes agree. */
  runnerUp: Uint32Array;
  /** 254 times the lead of the first label over the second, as a share of all votes. */
  margin: Uint8Array;
}

interface Packed {
  faces: number;
  label: string;
  runner_up: string;
  margin: string;
}

/** The bytes of packed numbers: Base64 of a zlib stream. */
export const unpack = (text: string): Promise<ArrayBuffer> => unpacked(text).arrayBuffer();

async function read(area: number): Promise<FaceVotes> {
  const packed = await load<Packed>(`faces_${area}`);
  const damaged = new Error(`data/faces_${area}.js is damaged: make the report again`);
  try {
    const [label, runnerUp, margin] = await Promise.all(
      [packed.label, packed.runner_up, packed.margin].map(unpack),
    );
    if (!label || !runnerUp || !margin || margin.byteLength !== packed.faces) throw damaged;
    if (label.byteLength !== 4 * packed.faces || runnerUp.byteLength !== label.byteLength) throw damaged;
    return {
      label: new Uint32Array(label),
      runnerUp: new Uint32Array(runnerUp),
      margin: new Uint8Array(margin),
    };
  } catch {
    throw damaged;
  }
}

let last: { area: number; votes: Promise<FaceVotes> } | null = null;

/** The votes of an area's faces. Only the last area is kept. */
export function loadFaceVotes(area: number): Promise<FaceVotes> {
  if (last?.area === area) return last.votes;
  const votes = read(area);
  const mine = { area, votes };
  last = mine;
  votes.catch(() => {
    if (last === mine) last = null;
  });
  return votes;
}
