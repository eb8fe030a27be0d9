// The built-in scan with its exported panoramas as photographs: `node photographed.mjs DATA_SET` writes
// scan/photographed.toml and what it names.

import { readFileSync, readdirSync, writeFileSync } from "node:fs";

const set = process.argv[2];
const pano = `${set}/area_1/pano`;
const frames = readdirSync(`${pano}/rgb`).map((name) => {
  const pose = JSON.parse(readFileSync(`${pano}/pose/${name.replace("_rgb.png", "_pose.json")}`, "utf8"));
  const rows = pose.camera_rt_matrix;
  // The transpose turns from the camera to the world; OpenGL's axes y and z are the other way round.
  const transform_matrix = [0, 1, 2].map((axis) => [
    rows[0][axis],
    -rows[1][axis],
    -rows[2][axis],
    pose.camera_location[axis],
  ]);
  return { file_path: `../area_1/pano/rgb/${name}`, transform_matrix: [...transform_matrix, [0, 0, 0, 1]] };
});
const png = readFileSync(`${pano}/rgb/${readdirSync(`${pano}/rgb`)[0]}`);
const [w, h] = [png.readUInt32BE(16), png.readUInt32BE(20)];
const document = { camera_model: "EQUIRECTANGULAR", w, h, frames };
writeFileSync(`${set}/scan/transforms.json`, JSON.stringify(document));
writeFileSync(
  `${set}/scan/photographed.toml`,
  'area = 1\n\n[mesh]\npath = "rgb.obj"\nup = "y"\n\n[frames]\npath = "transforms.json"\n',
);
