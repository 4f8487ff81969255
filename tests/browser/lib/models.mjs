// Scene files of squares with materials, and environments, whose pictures are known.
import { mkdtemp, rm, writeFile } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { crc32, deflateSync } from 'node:zlib';

const UINT = 5125;
const FLOAT = 5126;
const UNLIT = { KHR_materials_unlit: {} };

/** A PNG file of `size` x `size` texels; `texel(x, y)` gives RGBA bytes. */
function png(size, texel) {
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

/** A glTF document of squares of one metre that face +z: their middles, and their materials. */
function squares(places, materials, images) {
  const [positions, normals, uvs, indices] = [[-0.5, -0.5, 0, 0.5, -0.5, 0, 0.5, 0.5, 0, -0.5, 0.5, 0], [], [0, 1, 1, 1, 1, 0, 0, 0], [0, 1, 2, 0, 2, 3]];
  for (let corner = 0; corner < 4; corner += 1) normals.push(0, 0, 1);
  const parts = [Float32Array.from(positions), Float32Array.from(normals), Float32Array.from(uvs), Uint32Array.from(indices)];
  const bytes = parts.map((part) => Buffer.from(part.buffer));
  let offset = 0;
  const bufferViews = bytes.map(({ length }) => {
    offset += length;
    return { buffer: 0, byteOffset: offset - length, byteLength: length };
  });
  const accessors = [[FLOAT, 'VEC3', 4], [FLOAT, 'VEC3', 4], [FLOAT, 'VEC2', 4], [UINT, 'SCALAR', 6]]
    .map(([componentType, type, count], bufferView) => ({ bufferView, componentType, type, count }));
  Object.assign(accessors[0], { min: [-0.5, -0.5, 0], max: [0.5, 0.5, 0] });
  const primitive = { attributes: { POSITION: 0, NORMAL: 1, TEXCOORD_0: 2 }, indices: 3 };
  return {
    asset: { version: '2.0' },
    scene: 0,
    scenes: [{ nodes: places.map((_, node) => node) }],
    nodes: places.map((translation, mesh) => ({ mesh, translation })),
    meshes: materials.map((_, material) => ({ primitives: [{ ...primitive, material }] })),
    materials,
    textures: images.map((_, source) => ({ source })),
    images: images.map((image) => ({ uri: dataUri('image/png', image) })),
    accessors,
    bufferViews,
    buffers: [{ uri: dataUri('application/octet-stream', Buffer.concat(bytes)), byteLength: offset }],
    extensionsUsed: ['KHR_materials_unlit'],
  };
}

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
  return squares(places, materials, images);
}

/** Writes both, hands their paths to `use`, and takes them away. */
export async function withMaterials(use) {
  const folder = await mkdtemp(join(tmpdir(), 'vantage-'));
  try {
    const [scene, environment] = [join(folder, 'materials.gltf'), join(folder, 'above.hdr')];
    await writeFile(scene, JSON.stringify(materialsFile()));
    await writeFile(environment, lightFromAbove());
    return await use({ scene, environment });
  } finally {
    await rm(folder, { recursive: true, force: true });
  }
}
