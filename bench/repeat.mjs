// A GLB whose scene stands there several times, as large scenes of few meshes for load tests:
//
//   node repeat.mjs IN.glb OUT.glb COLUMNS ROWS STEP
//
// COLUMNS along x and ROWS along z, STEP metres apart. Nodes are repeated, meshes are not; bones and clips stay those of the first.
import { readFile, writeFile } from 'node:fs/promises';

const HEADER = 12;
const CHUNK = 8;

const [from, to, ...numbers] = process.argv.slice(2);
const [columns, rows, step] = numbers.map(Number);
if (!to || !(columns >= 1 && rows >= 1 && Number.isFinite(step))) {
  console.error('node repeat.mjs IN.glb OUT.glb COLUMNS ROWS STEP');
  process.exit(2);
}

const glb = await readFile(from);
const jsonBytes = glb.readUInt32LE(HEADER);
const gltf = JSON.parse(glb.toString('utf8', HEADER + CHUNK, HEADER + CHUNK + jsonBytes));
const rest = glb.subarray(HEADER + CHUNK + jsonBytes);

const shown = gltf.scenes[gltf.scene ?? 0];
const own = gltf.nodes;
gltf.nodes = [];
const tiles = [];
for (let tile = 0; tile < columns * rows; tile += 1) {
  const first = gltf.nodes.length;
  const moved = (nodes) => nodes?.map((node) => node + first);
  gltf.nodes.push(...own.map((node) => ({ ...node, children: moved(node.children) })));
  const translation = [(tile % columns) * step, 0, Math.floor(tile / columns) * step];
  tiles.push({ name: `tile ${tile}`, translation, children: moved(shown.nodes) });
}
shown.nodes = tiles.map((_, tile) => gltf.nodes.length + tile);
gltf.nodes.push(...tiles);

const text = Buffer.from(JSON.stringify(gltf));
const json = Buffer.concat([text, Buffer.alloc(-text.length & 3, ' ')]);
const head = Buffer.alloc(HEADER + CHUNK);
glb.copy(head, 0, 0, HEADER + CHUNK);
head.writeUInt32LE(HEADER + CHUNK + json.length + rest.length, 8);
head.writeUInt32LE(json.length, HEADER);
await writeFile(to, Buffer.concat([head, json, rest]));
