// Predicts classes of points for `s3d eval sem3d`: every seventh point has the next class.
//   node predict.mjs DATASET PREDICTIONS

import { mkdirSync, readFileSync, readdirSync, writeFileSync } from "node:fs";
import { join } from "node:path";

const [, , dataset, predictions] = process.argv;
const CLASSES = "ceiling floor wall beam column window door table chair sofa bookcase board clutter".split(
  " ",
);

/** An array of bytes in numpy's form. */
function npy(bytes) {
  const header = `{'descr': '|u1', 'fortran_order': False, 'shape': (${bytes.length},), }`;
  const text = header.padEnd(117) + "\n";
  const head = Buffer.from([0x93, ...Buffer.from("NUMPY"), 1, 0, text.length, 0]);
  return Buffer.concat([head, Buffer.from(text), Buffer.from(bytes)]);
}

mkdirSync(predictions);
const tree = join(dataset, "s3dis/Area_1");
for (const room of readdirSync(tree, { withFileTypes: true })) {
  if (!room.isDirectory()) continue;
  const annotations = join(tree, room.name, "Annotations");
  const truth = readdirSync(annotations)
    .filter((name) => name.endsWith(".txt"))
    .sort()
    .flatMap((name) => {
      const lines = readFileSync(join(annotations, name), "utf8").trimEnd().split("\n").length;
      return Array(lines).fill(CLASSES.indexOf(name.slice(0, name.lastIndexOf("_"))));
    });
  const found = truth.map((label, i) => (i % 7 === 0 ? (label + 1) % CLASSES.length : label));
  writeFileSync(join(predictions, `Area_1_${room.name}.npy`), npy(found));
}
