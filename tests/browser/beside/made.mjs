// Models of what sample models lack: a normal map on a mirrored tangent, a second set of texture coordinates, a texture that shines, and sheen.
import { writeFile } from 'node:fs/promises';
import { join } from 'node:path';
import { document, png } from '../lib/models.mjs';

const [COLUMNS, ROWS] = [96, 48];
const TEXELS = 256;

/** A ball of one metre. Texture coordinates run around it from the seam at its back to its front, and back again; tangents along them. */
function ball() {
  const shape = { POSITION: [], NORMAL: [], TANGENT: [], TEXCOORD_0: [], TEXCOORD_1: [], indices: [] };
  for (let row = 0; row <= ROWS; row += 1) {
    for (let column = 0; column <= COLUMNS; column += 1) {
      const [around, down] = [column / COLUMNS, row / ROWS];
      const [azimuth, polar] = [2 * Math.PI * around, Math.PI * down];
      // From the back (-z) over the left (-x) to the front (+z).
      const normal = [-Math.sin(azimuth) * Math.sin(polar), Math.cos(polar), -Math.cos(azimuth) * Math.sin(polar)];
      const turn = around <= 0.5 ? 1 : -1;
      shape.NORMAL.push(...normal);
      shape.POSITION.push(...normal.map((x) => x / 2));
      // Bitangents run up, to smaller v.
      shape.TANGENT.push(-turn * Math.cos(azimuth), 0, turn * Math.sin(azimuth), turn);
      shape.TEXCOORD_0.push(2 - Math.abs(4 * around - 2), 2 * down);
      shape.TEXCOORD_1.push(around, down);
    }
  }
  for (let row = 0; row < ROWS; row += 1) {
    for (let column = 0; column < COLUMNS; column += 1) {
      const [left, below] = [row * (COLUMNS + 1) + column, (row + 1) * (COLUMNS + 1) + column];
      shape.indices.push(left, below, left + 1, left + 1, below, below + 1);
    }
  }
  return shape;
}

/** Slopes of a relief of domes and grooves, as a normal map; the texture repeats. */
function bumps() {
  const height = (x, y) => 0.02 * Math.cos(8 * Math.PI * x) * Math.cos(8 * Math.PI * y) + 0.008 * Math.cos(2 * Math.PI * (3 * x + 5 * y));
  const step = 1 / TEXELS;
  return png(TEXELS, (x, y) => {
    const [u, v] = [(x + 0.5) * step, (y + 0.5) * step];
    const [du, dv] = [height(u + step, v) - height(u - step, v), height(u, v + step) - height(u, v - step)].map((d) => d / (2 * step));
    // Green leans up, where v falls.
    const normal = [-du, dv, 1];
    const length = Math.hypot(...normal);
    return [...normal.map((n) => Math.round((n / length + 1) * 127.5)), 255];
  });
}

const smooth = (x) => Math.round(255 * (0.5 - 0.5 * Math.cos(2 * Math.PI * x)));

/** The models by their names. */
function made() {
  const factors = (rgb, metallicFactor, roughnessFactor) => ({ baseColorFactor: [...rgb, 1], metallicFactor, roughnessFactor });
  const pair = (materials, images) => document(materials.map((_, material) => ({ ...ball(), material, at: [1.1 * material, 0, 0] })), materials, images);
  return {
    'made-normals': pair([
      { pbrMetallicRoughness: factors([0.7, 0.35, 0.2], 0, 0.5), normalTexture: { index: 0 } },
      { pbrMetallicRoughness: factors([0.9, 0.75, 0.4], 1, 0.35), normalTexture: { index: 0, scale: 0.5 } },
    ], [bumps()]),
    'made-second-coordinates': pair([
      { pbrMetallicRoughness: { ...factors([0.8, 0.8, 0.8], 0, 0.6), baseColorTexture: { index: 0 } }, occlusionTexture: { index: 1, texCoord: 1 } },
      { pbrMetallicRoughness: { ...factors([0.5, 0.6, 0.8], 1, 1), metallicRoughnessTexture: { index: 0, texCoord: 1 } }, occlusionTexture: { index: 1 } },
    ], [
      png(TEXELS, (x, y) => [smooth(x / TEXELS), 64 + Math.round(smooth((2 * y) / TEXELS) / 2), smooth((x + y) / TEXELS), 255]),
      png(TEXELS, (x, y) => [smooth((3 * x + y) / TEXELS), 0, 0, 255]),
    ]),
    'made-emission': pair([
      { pbrMetallicRoughness: factors([0.05, 0.05, 0.05], 0, 0.4), emissiveTexture: { index: 0 }, emissiveFactor: [1, 0.8, 0.6] },
      {
        pbrMetallicRoughness: factors([0.2, 0.2, 0.25], 0, 0.7),
        emissiveTexture: { index: 0 },
        emissiveFactor: [0.1, 0.4, 1],
        extensions: { KHR_materials_emissive_strength: { emissiveStrength: 3 } },
      },
    ], [png(TEXELS, (x, y) => (Math.hypot((x % 64) - 31.5, (y % 64) - 31.5) < 20 ? [255, 255, 255, 255] : [0, 0, 0, 255]))]),
    'made-sheen': pair([
      { pbrMetallicRoughness: factors([0.1, 0.02, 0.15], 0, 1), extensions: { KHR_materials_sheen: { sheenColorFactor: [0.6, 0.4, 0.9], sheenRoughnessFactor: 0.3 } } },
      {
        pbrMetallicRoughness: factors([0.05, 0.15, 0.1], 0, 0.9),
        extensions: { KHR_materials_sheen: { sheenColorFactor: [1, 1, 1], sheenColorTexture: { index: 0 }, sheenRoughnessFactor: 0.6 } },
      },
    ], [png(TEXELS, (x, y) => [smooth((4 * x) / TEXELS), smooth((4 * y) / TEXELS), 128, 255])]),
  };
}

/** Writes them into a folder; their paths. */
export async function writeMade(folder) {
  const write = async ([name, model]) => {
    const path = join(folder, `${name}.gltf`);
    await writeFile(path, JSON.stringify(model));
    return path;
  };
  return Promise.all(Object.entries(made()).map(write));
}
