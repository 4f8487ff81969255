// Scene files that are made, and environments, whose pictures are known.
import { mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { crc32, deflateSync } from 'node:zlib';

const UINT = 5125;
const FLOAT = 5126;
const UNLIT = { KHR_materials_unlit: {} };

/** A PNG file of `size` x `size` texels; `texel(x, y)` gives RGBA bytes. */
export function png(size, texel) {
  const rows = [];
  for (let y = 0; y < size; y += 1) {
    rows.push(0);
    for (let x = 0; x < size; x += 1) rows.push(...texel(x, y));
  }
  const chunk = (type, data) => {
    const body = Buffer.concat([Buffer.from(type), data]);
    const [length, sum] = [Buffer.alloc(4), Buffer.alloc(4)];
    length.writeUInt32BE(data.length);
    sum.writeUInt32BE(crc32(body));
    return Buffer.concat([length, body, sum]);
  };
  const header = Buffer.alloc(13);
  header.writeUInt32BE(size, 0);
  header.writeUInt32BE(size, 4);
  header.set([8, 6], 8);
  const signature = Buffer.from([0x89, 0x50, 0x4e, 0x47, 0x0d, 0x0a, 0x1a, 0x0a]);
  return Buffer.concat([signature, chunk('IHDR', header), chunk('IDAT', deflateSync(Buffer.from(rows))), chunk('IEND', Buffer.alloc(0))]);
}

/** What the left and the right half of a texture hold. */
const halves = (left, right) => png(16, (x) => (x < 8 ? left : right));

const dataUri = (type, bytes) => `data:${type};base64,${bytes.toString('base64')}`;

/** Components of the attributes that a shape may have. */
const ATTRIBUTES = { POSITION: 3, NORMAL: 3, TANGENT: 4, TEXCOORD_0: 2, TEXCOORD_1: 2 };

/**
 * A glTF document of shapes, each a node: numbers by the names of their attributes, `indices`, `material` and `at`, its place. Images are PNG files, and
 * textures of the same numbers.
 */
export function document(shapes, materials, images) {
  const [bufferViews, accessors, parts] = [[], [], []];
  let byteLength = 0;
  const accessor = (numbers, componentType, components) => {
    const bytes = Buffer.from(numbers.buffer);
    bufferViews.push({ buffer: 0, byteOffset: byteLength, byteLength: bytes.length });
    byteLength += parts.push(bytes) && bytes.length;
    const type = components === 1 ? 'SCALAR' : `VEC${components}`;
    return accessors.push({ bufferView: bufferViews.length - 1, componentType, type, count: numbers.length / components }) - 1;
  };
  const meshes = shapes.map((shape) => {
    const given = Object.entries(ATTRIBUTES).filter(([name]) => shape[name]);
    const attributes = Object.fromEntries(given.map(([name, components]) => [name, accessor(Float32Array.from(shape[name]), FLOAT, components)]));
    const along = (axis) => shape.POSITION.filter((_, index) => index % 3 === axis);
    const ends = (of) => [0, 1, 2].map((axis) => Math.fround(along(axis).reduce((a, b) => of(a, b))));
    Object.assign(accessors[attributes.POSITION], { min: ends(Math.min), max: ends(Math.max) });
    return { primitives: [{ attributes, indices: accessor(Uint32Array.from(shape.indices), UINT, 1), material: shape.material }] };
  });
  const used = new Set(materials.flatMap(({ extensions }) => Object.keys(extensions ?? {})));
  return {
    asset: { version: '2.0' },
    scene: 0,
    scenes: [{ nodes: shapes.map((_, node) => node) }],
    nodes: shapes.map(({ at }, mesh) => ({ mesh, translation: at })),
    meshes,
    materials,
    ...(images.length > 0 && {
      textures: images.map((_, source) => ({ source })),
      images: images.map((image) => ({ uri: dataUri('image/png', image) })),
    }),
    accessors,
    bufferViews,
    buffers: [{ uri: dataUri('application/octet-stream', Buffer.concat(parts)), byteLength }],
    ...(used.size > 0 && { extensionsUsed: [...used] }),
  };
}

/** A square of one metre that faces +z. */
const SQUARE = {
  POSITION: [-0.5, -0.5, 0, 0.5, -0.5, 0, 0.5, 0.5, 0, -0.5, 0.5, 0],
  NORMAL: [0, 0, 1, 0, 0, 1, 0, 0, 1, 0, 0, 1],
  TEXCOORD_0: [0, 1, 1, 1, 1, 0, 0, 0],
  indices: [0, 1, 2, 0, 2, 3],
};

/** A Radiance file: light of 1 from above, none from below. */
function lightFromAbove() {
  const [width, height] = [4, 32];
  const [bright, dark] = [[128, 128, 128, 129], [0, 0, 0, 0]];
  const pixels = Array.from({ length: width * height }, (_, index) => (index < (width * height) / 2 ? bright : dark)).flat();
  return Buffer.concat([Buffer.from(`#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y ${height} +X ${width}\n`), Buffer.from(pixels)]);
}

/** Four squares around the middle of a view from +z, each about a metre from it: a normal map whose left half leans up and whose right one down; a metal, smooth to the
 * left and rough to the right; one that shines red to the left; and a red pane, half see-through, before blue. */
function materialsFile() {
  const images = [
    halves([128, 230, 204, 255], [128, 26, 204, 255]),
    halves([255, 26, 255, 255], [255, 255, 255, 255]),
    halves([255, 0, 0, 255], [0, 0, 0, 255]),
  ];
  const plain = (r, g, b, a = 1) => ({ baseColorFactor: [r, g, b, a], metallicFactor: 0, roughnessFactor: 1 });
  const materials = [
    { pbrMetallicRoughness: plain(0.5, 0.5, 0.5), normalTexture: { index: 0 } },
    { pbrMetallicRoughness: { metallicRoughnessTexture: { index: 1 } } },
    { pbrMetallicRoughness: plain(0, 0, 0), emissiveTexture: { index: 2 }, emissiveFactor: [0.5, 0.5, 0.5] },
    { pbrMetallicRoughness: plain(0, 0, 1), extensions: UNLIT },
    { pbrMetallicRoughness: plain(1, 0, 0, 0.5), alphaMode: 'BLEND', extensions: UNLIT },
  ];
  const places = [[-0.6, -0.6, 0], [0.6, 0.6, 0], [0.6, -0.6, 0], [-0.6, 0.6, 0], [-0.6, 0.6, 0.1]];
  return document(places.map((at, material) => ({ ...SQUARE, at, material })), materials, images);
}

/** The same document at another place in metres: below a node, so that no number of it is rounded. */
function movedBy(place, file) {
  const nodes = [...file.nodes, { translation: place, children: file.nodes.map((_, node) => node) }];
  return { ...file, nodes, scenes: [{ nodes: [file.nodes.length] }] };
}

/** A grey square of four metres before which a lamp hangs: nothing is there that could hide it. */
function litFile() {
  const grey = { doubleSided: true, pbrMetallicRoughness: { baseColorFactor: [0.5, 0.5, 0.5, 1], metallicFactor: 0, roughnessFactor: 1 } };
  const file = document([{ ...SQUARE, POSITION: SQUARE.POSITION.map((x) => 4 * x), at: [0, 0, 0], material: 0 }], [grey], []);
  const lamp = { translation: [0.4, -0.3, 2], extensions: { KHR_lights_punctual: { light: 0 } } };
  return {
    ...file,
    extensionsUsed: ['KHR_lights_punctual'],
    extensions: { KHR_lights_punctual: { lights: [{ type: 'point', intensity: 300 }] } },
    nodes: [...file.nodes, lamp],
    scenes: [{ nodes: [0, 1] }],
  };
}

/** Writes files by their names, hands the folder to `use`, and takes it away. */
async function withFiles(files, use) {
  const folder = await mkdtemp(join(tmpdir(), 'vantage-'));
  try {
    await Promise.all(Object.entries(files).map(([name, content]) => writeFile(join(folder, name), content)));
    return await use(folder);
  } finally {
    await rm(folder, { recursive: true, force: true });
  }
}

/** Hands the paths of the file, at a place, and of the environment to `use`. */
export function withMaterials(use, place = [0, 0, 0]) {
  const files = { 'materials.gltf': JSON.stringify(movedBy(place, materialsFile())), 'above.hdr': lightFromAbove() };
  return withFiles(files, (folder) => use({ scene: join(folder, 'materials.gltf'), environment: join(folder, 'above.hdr') }));
}

/** Hands the path of a lit square to `use`. */
export function withLitSquare(use) {
  return withFiles({ 'lit.gltf': JSON.stringify(litFile()) }, (folder) => use(join(folder, 'lit.gltf')));
}
