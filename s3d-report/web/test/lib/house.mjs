// A house of two storeys: a copy of the built-in scene's report, with half of it once more above itself.

import { index, readPicture, report } from "./common.mjs";

/** The height of the storey above. */
export const UP = 3.2;
const raised = ([x, y, z]) => [x, y, z + UP];

/** The index of the house, and its files that differ from the report's. */
export function house() {
  const changed = structuredClone(index);
  const [mesh] = changed.meshes;
  const upper = changed.rooms.slice(0, 2).map((room) => {
    const { name, heights } = room;
    return {
      ...room,
      name: name.replace(/\d+$/, (number) => String(Number(number) + 1)),
      floor: (room.floor ?? heights[0]) + UP,
      heights: heights.map((z) => z + UP),
    };
  });
  // A room of the lower storey is as high as both.
  changed.rooms[2].heights[1] += UP;
  changed.rooms.push(...upper);
  const files = { index: changed };
  for (let part = 0; part < mesh.files; part++) {
    const key = `mesh_${mesh.area}_${part}`;
    const read = readPicture(report, key);
    files[`mesh_${mesh.area}_${mesh.files + part}`] = { ...read, origin: raised(read.origin) };
  }
  mesh.files *= 2;
  mesh.max = raised(mesh.max);
  return files;
}
