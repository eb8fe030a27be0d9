// What all tools work on.

import type { Hover } from "./hand/hover.js";
import type { Look } from "./look.js";
import type { Mesh } from "./mesh/mesh.js";
import type { Proposals } from "./proposals.js";
import type { Frame, Gesture, Scene } from "./scene.js";
import type { FaceTable } from "./space/table.js";
import type { View } from "./space/view.js";
import type { Work } from "./work.js";

export interface Desk {
  scene: Scene;
  where: Frame;
  mesh: Mesh;
  look: Look;
  view: View;
  table: FaceTable;
  work: Work;
  hover: Hover;
  proposals: Proposals;
  /** The class in hand. */
  inHand: () => string;
  /** Sends a gesture. Returns whether it is on disk. */
  perform: (gesture: Gesture) => Promise<boolean>;
  /** Tells the user something. */
  say: (words: string, isFault?: boolean) => void;
}
