// What somebody does who comes for the first time: brings a model, looks at it from another side, and sends that view to a colleague. By the mouse, and by keys
// alone; and what is said where something cannot be taken.
import assert from 'node:assert/strict';
import { mkdtemp, readFile, rm, writeFile } from 'node:fs/promises';
import { createRequire } from 'node:module';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { openCoarsePage, openPage } from './lib/browser.mjs';
import { document as gltf } from './lib/models.mjs';
import { once } from './lib/once.mjs';
import { canvasPixels, colours, decoded, difference } from './lib/pixels.mjs';
import { freePort, startServer } from './lib/server.mjs';
import { PATIENCE_MS, still, until } from './lib/state.mjs';

// Mean FLIP is at most the share of pixels that differ, and those around them that its filter reaches.
const SAME_SHARE = 0.002;
const AXE = await readFile(createRequire(import.meta.url).resolve('axe-core/axe.min.js'), 'utf8');

const MATERIALS = ['red 0.8 0.1 0.1', 'green 0.1 0.7 0.2', 'blue 0.15 0.3 0.9', 'grey 0.6 0.6 0.6'];

/** A box of three colours on a grey floor, too small to walk on, and its materials in a file beside it. */
function model() {
  const corners = [[-1, -1], [1, -1], [1, 1], [-1, 1]];
  const ring = (y, side) => corners.map(([x, z]) => `v ${x * side} ${y} ${z * side}`);
  const lines = ['mtllib paint.mtl', ...ring(0, 1.9), ...ring(0, 1), ...ring(1.5, 1)];
  const face = (material, ...of) => lines.push(`usemtl ${material}`, `f ${of.join(' ')}`);
  face('grey', 4, 3, 2, 1);
  face('blue', 12, 11, 10, 9);
  [[5, 6, 10, 9], [6, 7, 11, 10], [7, 8, 12, 11], [8, 5, 9, 12]].forEach((of, index) => face(index % 2 ? 'green' : 'red', ...of.reverse()));
  const paint = MATERIALS.map((text) => text.split(' ')).map(([name, ...colour]) => `newmtl ${name}\nKd ${colour.join(' ')}\n`);
  return { 'first box.obj': `${lines.join('\n')}\n`, 'paint.mtl': paint.join('') };
}

/** A square of one colour that faces +z: red, or blue in its variant; another scene, where it is green; and a camera that sees nothing else. */
function ofMany() {
  const square = { POSITION: [-2, -2, 0, 2, -2, 0, 2, 2, 0, -2, 2, 0], indices: [0, 1, 2, 0, 2, 3], at: [0, 0, 0] };
  const unlit = ([...colour]) => ({ pbrMetallicRoughness: { baseColorFactor: [...colour, 1] }, extensions: { KHR_materials_unlit: {} } });
  const file = gltf([{ ...square, material: 0 }, { ...square, material: 2 }], [[1, 0, 0], [0, 0, 1], [0, 1, 0]].map(unlit), []);
  file.meshes[0].primitives[0].extensions = { KHR_materials_variants: { mappings: [{ material: 1, variants: [0] }] } };
  file.extensions = { KHR_materials_variants: { variants: [{ name: 'Evening & night' }] } };
  file.extensionsUsed.push('KHR_materials_variants');
  file.cameras = [{ type: 'perspective', name: 'close', perspective: { yfov: 0.5, znear: 0.1 } }, { type: 'perspective', name: 'closer', perspective: { yfov: 0.25, znear: 0.1 } }];
  file.nodes.push({ camera: 0, translation: [0, 0, 5] }, { camera: 1, translation: [0, 1, 4] });
  file.scenes = [{ name: 'Square', nodes: [0, 2, 3] }, { name: 'Other', nodes: [1, 2] }];
  return { 'many.gltf': JSON.stringify(file) };
}

/** Hands the paths of files by their names to `use`. */
async function withFiles(files, use) {
  const folder = await mkdtemp(join(tmpdir(), 'vantage-newcomer-'));
  try {
    await Promise.all(Object.entries(files).map(([name, text]) => writeFile(join(folder, name), text)));
    return await use(Object.keys(files).map((name) => join(folder, name)), folder);
  } finally {
    await rm(folder, { recursive: true, force: true });
  }
}

/** Drops files on the page as a person does, by the browser's own events; once more where the browser, busy, did not hand the drop to the page. */
async function drop(page, files) {
  const session = await page.context().newCDPSession(page);
  const data = { items: [], files, dragOperationsMask: 1 };
  for (let tries = 0; tries < 3; tries += 1) {
    await page.evaluate(() => {
      window.heardDrop = new Promise((resolve) => {
        window.addEventListener('drop', () => resolve(true), { once: true, capture: true });
        setTimeout(() => resolve(false), 5000);
      });
    });
    for (const type of ['dragEnter', 'dragOver', 'drop']) {
      await session.send('Input.dispatchDragEvent', { type, x: 300, y: 200, data });
    }
    // A page that went on to what was dropped knows nothing of it.
    if (await page.evaluate(() => window.heardDrop ?? true).catch(() => true)) break;
  }
  await session.detach().catch(() => {});
}

/** The page once it shows a picture of a scene. */
async function shows(page, scene) {
  await page.waitForFunction((name) => window.vantage?.picture && document.getElementById('scene').textContent === name, scene, { timeout: PATIENCE_MS });
}

async function copiedLink(page) {
  await page.locator('#share-said', { hasText: 'Copied' }).waitFor();
  return page.evaluate(() => navigator.clipboard.readText());
}

async function saved(page, press) {
  const [download] = await Promise.all([page.waitForEvent('download', { timeout: PATIENCE_MS }), press()]);
  return { name: download.suggestedFilename(), png: await readFile(await download.path()) };
}

/** What axe-core finds wrong with a page as it is now. */
async function violations(page) {
  // The page's policy lets in no scripts of others; what the debugger evaluates is not of the page.
  await page.evaluate(AXE);
  const found = await page.evaluate(() => window.axe.run(document, { resultTypes: ['violations'] }));
  return found.violations.map(({ id, nodes }) => `${id}: ${nodes.map(({ target }) => target).join(', ')}`);
}

/** In the page: all words on it, shown or not, and those that there are no German ones for. */
const words = (page) => page.evaluate(async () => {
  const { default: german } = await import('./german.js');
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  const found = new Set();
  // What is said where no script runs no script can say in German.
  while (walker.nextNode()) if (walker.currentNode.parentNode.tagName !== 'NOSCRIPT') found.add(walker.currentNode.data.replace(/\s+/g, ' ').trim());
  for (const name of ['title', 'aria-label']) document.querySelectorAll(`[${name}]`).forEach((element) => found.add(element.getAttribute(name).replace(/\s+/g, ' ').trim()));
  // What is the same in both: marks, units, single keys, names.
  const differs = (text) => /\p{L}{2}/u.test(text) && !/^(ms|Mbit\/s|Vantage|pillars|WebGPU|WebGL2|MB|\d+ MB)$/.test(text);
  const all = [...found].filter(differs);
  return { all, unknown: all.filter((text) => !(text in german) && !/\d/.test(text)), german: Object.values(german) };
});

/** Tests of a browser that shows by `renderer`. */
export function newcomerTests({ bin, web, shots, renderer, at }) {
  const shot = (name) => join(shots, `${renderer}-new-${name}.png`);
  const served = async (more) => startServer({ bin, web, port: await freePort(), scene: 'pillars', log: at.log, more: ['--image-size', '256', '--images', '2', ...more] });
  const opened = async (url) => {
    const browser = await openCoarsePage(renderer, at.log);
    await browser.page.context().grantPermissions(['clipboard-read', 'clipboard-write']);
    await browser.page.goto(url, { waitUntil: 'load', timeout: PATIENCE_MS });
    return browser;
  };

  /** A picture of the second browser's at a link. */
  const pictureAt = async (link, name) => {
    const { page, close } = await opened(link);
    await until(page, 'a picture', (now) => now.picture);
    const picture = await still(page, shot(name));
    await close();
    return picture;
  };

  /** Turned a model, shared it, and saved a picture: all is the same view. */
  const isOneView = async (page, { link, file }, name) => {
    assert.match(link, /[?&]scene=brought%2F[0-9a-f]{32}%2Ffirst/);
    const here = await still(page, shot(`${name}-here`));
    const there = await pictureAt(link, `${name}-there`);
    const picture = await decoded(page, file.png);
    await writeFile(shot(`${name}-saved`), file.png);
    const [shared, kept] = [difference(here, there), difference(here, picture)];
    console.log(`        ${(100 * shared).toFixed(3)} % of the pixels differ in the second browser, ${(100 * kept).toFixed(3)} % in the file`);
    assert.ok(colours(here) >= 4, 'the model is not to be seen');
    assert.equal(file.name, 'first box.png');
    assert.ok(shared <= SAME_SHARE && kept <= SAME_SHARE, `${shared} and ${kept} differ`);
  };

  return [
    ['takes a model that is dropped, and leads others to the same view', async () => withFiles(model(), async (paths) => {
      const server = await served(['--allow-uploads']);
      const { page, close } = await opened(`${server.origin}/?renderer=${renderer}&shadows=none&occlusion=none`);
      await until(page, 'a picture', (now) => now.picture);
      await page.locator('#scenes-open').waitFor({ state: 'visible' });
      await drop(page, paths);
      await shows(page, 'first box');
      const first = await still(page, shot('dropped'));
      await page.mouse.move(300, 200);
      await page.mouse.down();
      await page.mouse.move(420, 240, { steps: 6 });
      await page.mouse.up();
      const turned = await still(page, shot('turned'));
      assert.ok(difference(first, turned) > 0.05, 'it did not turn');
      await page.locator('#share-open').click();
      await page.locator('#share-copy').click();
      const link = await copiedLink(page);
      await page.screenshot({ path: shot('share') });
      const file = await saved(page, () => page.locator('#picture-save').click());
      await page.locator('#share').getByText('Close').click();
      await isOneView(page, { link, file }, 'mouse');
      // Twice as wide, each pixel of the first is four.
      await page.keyboard.press('l');
      await page.locator('#picture-size').selectOption({ index: 1 });
      const { png } = await saved(page, () => page.locator('#picture-save').click());
      const fine = await decoded(page, png);
      await writeFile(shot('fine'), png);
      assert.deepEqual([fine.width, fine.height], [2 * first.width, 2 * first.height]);
      await close();
      await server.stop();
    })],
    ['does the same by keys alone', async () => withFiles(model(), async (paths) => {
      const server = await served(['--allow-uploads']);
      const { page, close } = await opened(`${server.origin}/?renderer=${renderer}&shadows=none&occlusion=none`);
      await until(page, 'a picture', (now) => now.picture);
      await page.locator('#scenes-open').waitFor({ state: 'visible' });
      const reach = async (id) => {
        for (let presses = 0; presses < 12; presses += 1) {
          await page.keyboard.press('Tab');
          if (await page.evaluate(() => document.activeElement.id) === id) return;
        }
        assert.fail(`#${id} is not reached by Tab`);
      };
      // The browser is to leave its chooser to us before it is asked for.
      const chooser = new Promise((resolve) => { page.once('filechooser', resolve); });
      await page.keyboard.press('o');
      await reach('bring-files');
      await page.screenshot({ path: shot('focus') });
      await page.keyboard.press('Enter');
      await (await chooser).setFiles(paths);
      await shows(page, 'first box');
      const before = await until(page, 'a picture', (now) => now.picture);
      await page.keyboard.down('ArrowRight');
      await until(page, 'a turn', (now) => now.pose.position.some((x, axis) => Math.abs(x - before.pose.position[axis]) > 0.5));
      await page.keyboard.up('ArrowRight');
      await still(page, shot('keys'));
      await page.keyboard.press('l');
      await reach('share-copy');
      await page.keyboard.press('Enter');
      const link = await copiedLink(page);
      await reach('picture-save');
      const file = await saved(page, () => page.keyboard.press('Enter'));
      await page.keyboard.press('Escape');
      // What has the focus is marked, which is no part of the picture.
      await page.evaluate(() => document.activeElement.blur());
      await isOneView(page, { link, file }, 'keys');
      await close();
      await server.stop();
    })],
    [once('says why something is not taken, and takes the next'), async () => withFiles({ 'notes.txt': 'no model', 'large.obj': '#'.repeat(1 << 21), ...model() }, async ([notes, large, ...right]) => {
      const server = await served(['--allow-uploads', '--upload-size', '1']);
      const { page, close } = await opened(`${server.origin}/?renderer=${renderer}`);
      await page.locator('#scenes-open').waitFor({ state: 'visible' });
      for (const [files, words] of [[[notes], /was not taken: there is no scene file in it/], [[large], /2\.0 MB are too many: this server takes 1\.0 MB/]]) {
        await drop(page, files);
        await page.locator('#bring-text', { hasText: words }).waitFor();
      }
      await page.screenshot({ path: shot('not-taken') });
      await drop(page, right);
      await shows(page, 'first box');
      await close();
      await server.stop();
    })],
    [once('cancels what it brings, and brings the next'), async () => withFiles({ 'slow.obj': '#'.repeat(1 << 21), ...model() }, async ([slow, ...right]) => {
      const server = await served(['--allow-uploads']);
      const { page, close } = await opened(`${server.origin}/?renderer=${renderer}`);
      await page.locator('#scenes-open').waitFor({ state: 'visible' });
      // 20 kB a second up: a minute and a half.
      const network = await page.context().newCDPSession(page);
      await network.send('Network.emulateNetworkConditions', { offline: false, latency: 0, downloadThroughput: -1, uploadThroughput: 20_000 });
      await drop(page, [slow]);
      await page.locator('#bring-cancel').click();
      await page.locator('#bring-text', { hasText: 'Cancelled' }).waitFor();
      await page.locator('#bring-cancel').waitFor({ state: 'hidden' });
      await network.send('Network.emulateNetworkConditions', { offline: false, latency: 0, downloadThroughput: -1, uploadThroughput: -1 });
      await drop(page, right);
      await shows(page, 'first box');
      await close();
      await server.stop();
    })],
    [once('chooses among scenes by their pictures'), async () => withFiles(model(), async (_, folder) => {
      const server = await served(['--scenes', folder]);
      const { page, close } = await opened(`${server.origin}/?renderer=${renderer}&scene=first+box&eye=9,9,9&target=0,0,0`);
      await shows(page, 'first box');
      await page.keyboard.press('o');
      const cards = page.locator('#scene-list a');
      await page.waitForFunction(() => document.querySelectorAll('#scene-list img').length === 2);
      assert.deepEqual(await cards.locator('b').allTextContents(), ['pillars', 'first box']);
      assert.equal(await page.locator('#scene-list [aria-current]').textContent(), 'first box1 viewer');
      await page.screenshot({ path: shot('scenes') });
      assert.ok(await page.locator('#bring').isHidden(), 'nothing may be brought');
      await cards.first().click();
      await shows(page, 'pillars');
      assert.equal(new URL(page.url()).search, `?renderer=${renderer}`);
      await close();
      await server.stop();
    })],
    [once('chooses scene, variant and camera of a file'), async () => withFiles(ofMany(), async ([scene]) => {
      const server = await startServer({ bin, web, port: await freePort(), scene, log: at.log, more: ['--image-size', '256', '--images', '2'] });
      const { page, close } = await opened(`${server.origin}/?renderer=${renderer}`);
      const colour = async (name) => {
        const { width, height, data } = await still(page, shot(name));
        const pixel = (Math.floor(height / 2) * width + Math.floor(width / 2)) * 4;
        return ['red', 'green', 'blue'].filter((_, channel) => data[pixel + channel] > 128).join(' ');
      };
      const chosen = async (id, value) => {
        await page.locator('#scenes-open').click();
        await page.locator(`#${id}`).selectOption(value);
      };
      await page.locator('#scenes-open').waitFor({ state: 'visible' });
      assert.equal(await colour('of-file'), 'red');
      await page.locator('#scenes-open').click();
      await page.screenshot({ path: shot('of-file-dialog') });
      await page.keyboard.press('Escape');
      await chosen('file-camera', 'closer');
      const { fov_deg: fov } = await until(page, 'the camera', ({ pose }) => Math.hypot(pose.position[0], pose.position[1] - 1, pose.position[2] - 4) < 0.01);
      assert.ok(Math.abs(fov - 0.25 * 180 / Math.PI) < 1e-3, `${fov} degrees`);
      await chosen('file-variant', 'Evening & night');
      await page.waitForURL(/variant=Evening/);
      assert.equal(await colour('variant'), 'blue');
      const { pose } = await until(page, 'the same view', (now) => now.pose);
      assert.ok(Math.abs(pose.position[1] - 1) < 0.01, 'a variant is the same view');
      await chosen('file-scene', 'Other');
      await page.waitForURL(/file-scene=Other/);
      assert.equal(await colour('other'), 'green');
      assert.equal(new URL(page.url()).searchParams.get('variant'), null);
      await page.goto(`${server.origin}/?renderer=${renderer}&variant=Noon`, { waitUntil: 'load', timeout: PATIENCE_MS });
      await page.locator('#status', { hasText: 'there is no variant "Noon" in this file; there are: "Evening & night"' }).waitFor();
      await close();
      await server.stop();
    })],
    ['goes to what is double-clicked, and to where all is seen', async () => withFiles(model(), async ([scene]) => {
      const server = await startServer({ bin, web, port: await freePort(), scene, log: at.log, more: ['--image-size', '256', '--images', '2'] });
      const { page, close } = await opened(`${server.origin}/?renderer=${renderer}&shadows=none&occlusion=none&eye=0,2,9&target=0,2,0`);
      const eye = async () => (await until(page, 'a picture', (now) => now.picture)).pose;
      const arrived = async (from, what) => {
        await until(page, what, ({ pose }) => Math.hypot(...pose.position.map((x, axis) => x - from.position[axis])) > 0.05);
        await still(page, shot(what));
        return eye();
      };
      await still(page, shot('before'));
      const before = await eye();
      assert.deepEqual(before.position, [0, 2, 9]);
      // The front of the box is a metre before the middle, and reaches from the floor up to 1.5 m: its middle lies below that of the view.
      const pixelsPerMetre = 400 / 2 / Math.tan(Math.PI / 6) / 8;
      await page.mouse.dblclick(320, 200 + 1.25 * pixelsPerMetre);
      const turning = await arrived(before, 'to-the-box');
      turning.position.forEach((x, axis) => assert.ok(Math.abs(x - [0, 0.75, 9][axis]) < 0.05, `${turning.position}`));
      await page.keyboard.press('m');
      await page.mouse.dblclick(320, 200);
      const walking = await arrived(turning, 'nearer');
      walking.position.forEach((x, axis) => assert.ok(Math.abs(x - [0, 0.75, 1 + 0.35 * 8][axis]) < 0.05, `${walking.position}`));
      await page.keyboard.press('3');
      const above = await arrived(walking, 'from-above');
      assert.ok(above.position[1] > 5 && Math.abs(above.position[0]) < 0.05, `${above.position}`);
      await close();
      await server.stop();
    })],
    [once('records a path and goes it again'), async () => withFiles(model(), async ([scene], folder) => {
      const server = await startServer({ bin, web, port: await freePort(), scene, log: at.log, more: ['--image-size', '256', '--images', '2'] });
      const { page, close } = await opened(`${server.origin}/?renderer=${renderer}&shadows=none&occlusion=none`);
      await still(page, shot('before-the-path'));
      const { pose: begin } = await until(page, 'a picture', (now) => now.picture);
      await page.keyboard.press('l');
      await page.locator('#record').click();
      await page.keyboard.down('ArrowRight');
      await until(page, 'a turn', ({ pose }) => Math.abs(pose.position[0] - begin.position[0]) > 1);
      await page.keyboard.up('ArrowRight');
      await still(page, shot('end-of-the-path'));
      const { pose: end } = await until(page, 'a picture', (now) => now.picture);
      await page.locator('#share-open', { hasText: 'Stop' }).click();
      const { name, png: text } = await saved(page, () => page.locator('#path-save').click());
      assert.equal(name, 'first box.txt');
      const lines = text.toString().trim().split('\n').map((line) => line.split(' ').map(Number));
      assert.ok(lines.length > 3 && lines.every((line) => line.length === 7), `${lines.length} lines`);
      const off = (line, { position }) => Math.hypot(...position.map((x, axis) => x - line[axis]));
      assert.ok(off(lines[0], begin) < 1e-3 && off(lines.at(-1), end) < 1e-3, `${lines[0]} to ${lines.at(-1)}`);
      const video = await saved(page, () => page.locator('#video-save').click());
      await writeFile(join(shots, `${renderer}-new-path.webm`), video.png);
      assert.ok(/^first box\.(webm|mp4)$/.test(video.name) && video.png.length > 1000, `${video.name}: ${video.png.length} bytes`);
      await page.keyboard.press('Escape');
      await page.keyboard.press('r');
      await until(page, 'the start', ({ pose }) => off(lines[0], pose) < 1e-3);
      const path = join(folder, name);
      await writeFile(path, text);
      await page.keyboard.press('l');
      await page.locator('#path-file').setInputFiles(path);
      await until(page, 'the end of the path', (now) => !now.replays && off(lines.at(-1), now.pose) < 1e-3);
      await page.keyboard.press('l');
      await page.locator('#path-file').setInputFiles({ name: 'a.txt', mimeType: 'text/plain', buffer: Buffer.from('1 2 3') });
      await page.locator('#share-said', { hasText: 'That is no path: trace line 1: not seven finite numbers' }).waitFor();
      await page.screenshot({ path: shot('record') });
      await close();
      await server.stop();
    })],
    [once('fits a phone'), async () => {
      const server = await served(['--allow-uploads']);
      const { page, close } = await openPage(renderer, at.log, { width: 360, height: 640 }, 3);
      await page.goto(`${server.origin}/?renderer=${renderer}&shadows=none&occlusion=none`, { waitUntil: 'load', timeout: PATIENCE_MS });
      await until(page, 'a picture', (now) => now.picture);
      await page.locator('#scenes-open').waitFor({ state: 'visible' });
      await page.screenshot({ path: shot('phone') });
      for (const id of ['panel', 'scenes-open', 'mode', 'share-open', 'inventory-open', 'help-open']) {
        const { x, y, width, height } = await page.locator(`#${id}`).boundingBox();
        assert.ok(x >= 0 && y >= 0 && x + width <= 360 && y + height <= 640, `#${id} is at ${x}, ${y}, ${width} x ${height}`);
      }
      for (const id of ['scenes', 'share', 'help']) {
        await page.locator(`#${id}-open`).click();
        await page.screenshot({ path: shot(`phone-${id}`) });
        const { scrollWidth, clientWidth } = await page.evaluate((name) => {
          const { scrollWidth: all, clientWidth: seen } = document.getElementById(name);
          return { scrollWidth: all, clientWidth: seen };
        }, id);
        assert.ok(scrollWidth <= clientWidth, `#${id} is ${scrollWidth} wide in ${clientWidth}`);
        await page.keyboard.press('Escape');
      }
      await close();
      await server.stop();
    }],
    [once('speaks German where that is asked for'), async () => {
      const server = await served(['--allow-uploads']);
      const { page, close } = await opened(`${server.origin}/?renderer=${renderer}&shadows=none&lang=en`);
      await until(page, 'a picture', (now) => now.picture);
      const { unknown } = await words(page);
      assert.deepEqual(unknown, [], 'nobody said these in German');
      await page.goto(`${server.origin}/?renderer=${renderer}&shadows=none&lang=de`, { waitUntil: 'load', timeout: PATIENCE_MS });
      await until(page, 'a picture', (now) => now.picture);
      await page.locator('#mode', { hasText: 'Gehen' }).waitFor();
      const { all, german } = await words(page);
      const said = new Set(german);
      assert.deepEqual(all.filter((text) => !said.has(text) && !/\d/.test(text)), [], 'these stayed English');
      assert.equal(await page.evaluate(() => document.documentElement.lang), 'de');
      await page.locator('#share-open').click();
      await page.locator('#share-copy').click();
      await page.locator('#share-said', { hasText: 'Kopiert' }).waitFor();
      await page.screenshot({ path: shot('german-share') });
      await page.keyboard.press('Escape');
      await page.keyboard.press('h');
      await page.screenshot({ path: shot('german-help') });
      assert.deepEqual(await violations(page), []);
      await close();
      await server.stop();
    }],
    [once('is sound to axe, with and without its dialogs'), async () => {
      const server = await served(['--allow-uploads']);
      const { page, close } = await opened(`${server.origin}/?renderer=${renderer}`);
      await until(page, 'a picture', (now) => now.picture);
      await page.locator('#scenes-open').waitFor({ state: 'visible' });
      for (const colorScheme of ['dark', 'light']) {
        await page.emulateMedia({ colorScheme });
        const found = { page: await violations(page) };
        for (const [key, dialog] of [['o', 'scenes'], ['l', 'share'], ['h', 'help'], ['i', 'inventory']]) {
          await page.keyboard.press(key);
          await page.locator(`#${dialog}`).waitFor({ state: 'visible' });
          found[dialog] = await violations(page);
          if (dialog !== 'inventory') await page.screenshot({ path: shot(`${colorScheme}-${dialog}`) });
          await page.keyboard.press('Escape');
        }
        assert.deepEqual(found, { page: [], scenes: [], share: [], help: [], inventory: [] }, colorScheme);
      }
      await close();
      await server.stop();
    }],
  ];
}
