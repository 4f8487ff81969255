// Pictures of models by three.js and by the web client: the same camera, the same background, in the same headless Chromium.
//
//   VANTAGE_SERVER_BIN   the server's binary
//   VANTAGE_WEB_DIR      the built web client
//   VANTAGE_SIDE_PX      side of the pictures [default: 512]
//   VANTAGE_MADE         set: models that are made here, too
//   node beside/main.mjs OUT ENVIRONMENT.hdr FILE...
//
// Writes of each file OUT/NAME/three.png, fine.png (of it, too, 16 shaded samples a pixel), covered.png
// (white where three.js shows something) and ours.png, and for all of them
// OUT/pairs.json, which `vantage-report beside` reads. A file that one of them cannot show stays in that list, with the reason.
import { mkdir, readFile, writeFile } from 'node:fs/promises';
import { basename, dirname, extname, join, resolve } from 'node:path';
import { fileURLToPath } from 'node:url';
import { openPage } from '../lib/browser.mjs';
import { freePort, startServer } from '../lib/server.mjs';
import { PATIENCE_MS, still, until } from '../lib/state.mjs';
import { serveFiles } from './files.mjs';
import { writeMade } from './made.mjs';

// On a software adapter it draws as fast as WebGPU, and three.js uses it too.
const RENDERER = 'webgl2';
// What stands still is sent as it is seen, pixel by pixel, so nothing but time depends on the images before that.
const SERVER = ['--image-size', '512', '--images', '2', '--hold', '0'];

// As long as a software adapter may take for it.
const REST_MS = 300_000;

const here = dirname(fileURLToPath(import.meta.url));
const packages = join(here, '..', 'node_modules');
const bin = process.env.VANTAGE_SERVER_BIN;
const web = process.env.VANTAGE_WEB_DIR;
const sidePx = Number(process.env.VANTAGE_SIDE_PX ?? 512);

/** A name for each file: its stem, or where that is taken its folder's too, or a number. */
function named(files) {
  const taken = new Set();
  return files.map((file) => {
    const stem = basename(file, extname(file));
    const candidates = [stem, `${basename(dirname(file))}-${stem}`];
    let name = candidates.find((candidate) => !taken.has(candidate));
    for (let number = 2; !name; number += 1) name = taken.has(`${stem}-${number}`) ? undefined : `${stem}-${number}`;
    taken.add(name);
    return { name, file };
  });
}

const png = (dataUrl) => Buffer.from(dataUrl.slice(dataUrl.indexOf(',') + 1), 'base64');

/** Our picture at a camera, kept at `path`; gives its background. */
async function ours(context, { file, environment, camera, path, log }) {
  const server = await startServer({ bin, web, port: await freePort(), scene: file, log, more: [...SERVER, '--environment', environment] });
  const page = await context.newPage();
  try {
    const { eye, target, fov_y_deg: fov } = camera;
    await page.goto(`${server.origin}/?renderer=${RENDERER}&antialias=on&shadows=none&occlusion=none&eye=${eye}&target=${target}&fov=${fov}`, { timeout: PATIENCE_MS });
    // Until then it shows what was sampled for other views; a look at a heavy model takes the server longer than any stillness tells.
    await until(page, 'the view at rest', (now) => now.at_rest, REST_MS);
    await still(page, path);
    const { background, pose } = await until(page, 'the background', (now) => now.background);
    const off = Math.hypot(...pose.position.map((x, axis) => x - eye[axis]));
    if (!(off <= 1e-6 * Math.hypot(...eye))) throw new Error(`the eye is at ${pose.position} instead of ${eye}`);
    return background;
  } finally {
    await page.close();
    await server.stop();
  }
}

/** Both pictures of a file. */
async function pair(context, files, { name, file, environment, out, log }) {
  const folder = join(out, name);
  await mkdir(folder, { recursive: true });
  files.folders.set('model', dirname(file));
  const page = await context.newPage();
  page.on('console', (message) => log(`console ${message.type()}: ${message.text()}`));
  try {
    await page.goto(`${files.origin}/beside/three.html`, { waitUntil: 'load', timeout: PATIENCE_MS });
    await page.waitForFunction(() => window.beside);
    const model = `/model/${encodeURIComponent(basename(file))}`;
    const camera = await page.evaluate((wish) => window.beside.load(wish), { model, environment: `/environment/${basename(environment)}`, sidePx });
    const background = await ours(context, { file, environment, camera, path: join(folder, 'ours.png'), log });
    await writeFile(join(folder, 'three.png'), png(await page.evaluate((colour) => window.beside.picture(colour), background)));
    await writeFile(join(folder, 'fine.png'), png(await page.evaluate((colour) => window.beside.finePicture(colour), background)));
    await writeFile(join(folder, 'covered.png'), png(await page.evaluate(() => window.beside.covered())));
    return { name, camera, background };
  } finally {
    await page.close();
  }
}

async function main([out, environment, ...paths]) {
  if (process.env.VANTAGE_MADE) paths.push(...await writeMade(out));
  if (!bin || !web || !environment || paths.length === 0) {
    console.error('usage: node beside/main.mjs OUT ENVIRONMENT.hdr FILE..., with VANTAGE_SERVER_BIN and VANTAGE_WEB_DIR');
    process.exit(2);
  }
  const lines = [];
  const log = (line) => lines.push(line);
  const folders = new Map([['beside', here], ['three', join(packages, 'three')], ['environment', dirname(resolve(environment))]]);
  const files = { ...await serveFiles(folders), folders };
  const pairs = [];
  for (const { name, file } of named(paths.map((path) => resolve(path)))) {
    const begin = Date.now();
    lines.length = 0;
    // Of its own: a browser that dies takes no other model with it.
    const { page, close } = await openPage(RENDERER, log, { width: sidePx, height: sidePx });
    const made = await pair(page.context(), files, { name, file, environment: resolve(environment), out, log }).catch((error) => {
      console.log(lines.slice(-10).map((line) => `        ${line}`).join('\n'));
      return { name, failed: String(error?.message ?? error) };
    });
    await close().catch((error) => log(`closing the browser: ${error.message}`));
    pairs.push(made);
    if (process.env.VERBOSE) console.log(lines.join("\n"));
    console.log(`${name}: ${made.failed ?? `${((Date.now() - begin) / 1000).toFixed(1)} s`}`);
  }
  await files.stop();
  const { version } = JSON.parse(await readFile(join(packages, 'three', 'package.json'), 'utf8'));
  const written = { three: version, environment: basename(environment), side_px: sidePx, pairs };
  await writeFile(join(out, 'pairs.json'), JSON.stringify(written, null, 2));
}

await main(process.argv.slice(2));
