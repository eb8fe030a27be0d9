// Marks changed labels on the plan, in the middle of each patch of changed faces.

import type { Index, Rgb } from "../data.js";
import { several } from "../dom.js";
import { spaceLink } from "../route/route.js";
import { CLASS, changedWords, kindOf, loadAgainst, loadChanges, nameOf } from "./data.js";
import { surface } from "./matrix.js";

/** A change of labels at a point of an area. */
export interface ChangeMark {
  at: Rgb;
  /** Whether the class changed, too. */
  isClass: boolean;
  words: string;
  href: string | null;
}

/** The marks by area; areas without changed faces are left out. */
export async function changeMarks(index: Index): Promise<Map<number, ChangeMark[]>> {
  const marks = new Map<number, ChangeMark[]>();
  const against = await loadAgainst(index);
  for (const area of against?.changed_faces ?? []) {
    const changes = against && (await loadChanges(against, area));
    if (!changes) continue;
    const hasMesh = index.meshes.some((mesh) => mesh.area === area);
    const mark = ({ a, b, faces, m2, center }: (typeof changes.patches)[number]): ChangeMark => {
      const was = nameOf(against, a, "instance", "a");
      const is = nameOf(against, b, "instance", "b");
      return {
        at: center,
        isClass: kindOf(against, a, b) === CLASS,
        words: `${changedWords(was, is)}: ${several(faces, "face")}, ${surface(m2)}`,
        href: hasMesh ? spaceLink(area, center, null, "changed") : null,
      };
    };
    marks.set(area, changes.patches.map(mark));
  }
  return marks;
}
