// The web client in headless Chromium against a real server: on WebGPU, and on WebGL2; what does not depend on that, on WebGL2 alone.
//
//   VANTAGE_SERVER_BIN   the server's binary
//   VANTAGE_WEB_DIR      the built web client
//   VANTAGE_SHOTS        folder for screenshots [default: shots]
//   node run.mjs [webgpu|webgl2]...
//
// Prints a line a test, then "N passed, N failed, N skipped", and exits with 1 where one failed.
import assert from 'node:assert/strict';
import { mkdir, mkdtemp, rm, writeFile } from 'node:fs/promises';
import { networkInterfaces, tmpdir } from 'node:os';
import { basename, join } from 'node:path';
import { setTimeout as sleep } from 'node:timers/promises';
import { openCoarsePage } from './lib/browser.mjs';
import { withLitSquare, withMaterials } from './lib/models.mjs';
import { once, testsOf } from './lib/once.mjs';
import { brightness, canvasPixels, colours, contrast, difference } from './lib/pixels.mjs';
import { startRelay } from './lib/relay.mjs';
import { freePort, startServer } from './lib/server.mjs';
import { PATIENCE_MS, settled, still, turned, until } from './lib/state.mjs';
import { embedTests } from './embed.mjs';
import { findingTests } from './finding.mjs';
import { headsetTests } from './headset.mjs';
import { newcomerTests } from './newcomer.mjs';
import { stagingTests } from './staging.mjs';

// A closed room with columns: every pixel of the true picture shows a surface.
const SCENE = 'pillars';

const bin = process.env.VANTAGE_SERVER_BIN;
const web = process.env.VANTAGE_WEB_DIR;
const shots = process.env.VANTAGE_SHOTS ?? 'shots';

/** The picture once it is settled, which stays in a file. */
const stillPicture = (page, name) => still(page, join(shots, `${name}.png`));

/** Whether what both of `lamp-teapots`' lamps see is there, from four points each at least. */
const seesLamps = ({ light_images: images }) => images.patches >= 8;
const panel = (page, id) => page.locator(`#${id}`).textContent();
const far = (a, b) => Math.hypot(...a.position.map((x, i) => x - b.position[i]));

/** In the page: workers start, but what comes to them instead of an update makes them fail. */
function mortalWorkers() {
  window.Worker = class extends window.Worker {
    postMessage(message, ...rest) {
      super.postMessage(Array.isArray(message) ? -1 : message, ...rest);
    }
  };
}

/** What is off where an address says nothing of it: whether frames come in time with it, no test shall hang on. */
const OFF = { shadows: 'none', occlusion: 'none' };

/** A further page of the browser at an address. */
async function smallPage({ page: first, log }, address) {
  const page = await first.context().newPage();
  page.on('console', (message) => log(`console ${message.type()}: ${message.text()}`));
  const url = new URL(address);
  Object.entries(OFF).forEach(([name, value]) => url.searchParams.has(name) || url.searchParams.set(name, value));
  await page.goto(url.href, { waitUntil: 'load', timeout: PATIENCE_MS });
  return page;
}

/** Pictures of a scene by what addresses wish for, once a page's state suffices for its wish. */
async function pictures(at, scene, wishes, suffices, more = undefined) {
  const { renderer, log } = at;
  const server = await startServer({ bin, web, port: await freePort(), scene, log, more });
  const taken = [];
  for (const wish of wishes) {
    const page = await smallPage(at, `${server.origin}/?renderer=${renderer}${wish}`);
    await until(page, 'all of a picture', (now) => now.picture && suffices(now, wish));
    taken.push(await stillPicture(page, `${renderer}-9-${basename(scene)}${wish.replace(/\W/g, '-')}`));
    await page.close();
  }
  await server.stop();
  return taken;
}

/** What a viewer sees of a file from 5.5 m before its place, under an environment, its light as it is, once it is there. */
async function showsMaterials(at, { scene, environment }, name, options, isThere, [x, y, z] = [0, 0, 0]) {
  const more = ['--image-size', '256', '--images', '2', '--environment', environment, '--tone', 'none', ...options];
  const server = await startServer({ bin, web, port: await freePort(), scene, log: at.log, more });
  try {
    const page = await smallPage(at, `${server.origin}/?renderer=${at.renderer}&antialias=on&eye=${x},${y},${z + 5.5}&target=${x},${y},${z}&fov=39.966`);
    await isThere(page);
    const picture = await still(page, join(shots, `${at.renderer}-${name}.png`));
    await page.close();
    return picture;
  } finally {
    await server.stop();
  }
}

function darkens(before, after) {
  const [plain, dark] = [before, after].map(brightness);
  assert.ok(plain - dark > 0.5, `brightness goes from ${plain} to ${dark}`);
}

/** One browser, one server, every test on it in order. */
function tests(renderer) {
  const at = { renderer };
  const all = [
    ['shows the first picture', async () => {
      at.port = await freePort();
      at.server = await startServer({ bin, web, port: at.port, scene: SCENE, log: at.log });
      Object.assign(at, await openCoarsePage(renderer, at.log));
      await at.page.goto(`${at.server.origin}/?renderer=${renderer}`, { waitUntil: 'load', timeout: PATIENCE_MS });
      const state = await settled(at.page);
      assert.equal(state.renderer, renderer);
      assert.equal(state.status, '');
      assert.ok(state.samples > 10_000, `${state.samples} samples`);
      at.first = await canvasPixels(at.page, join(shots, `${renderer}-1-first.png`));
      await at.page.screenshot({ caret: 'initial', path: join(shots, `${renderer}-1-page.png`) });
      assert.ok(contrast(at.first) > 50, `the canvas is nearly blank: contrast ${contrast(at.first)}`);
      assert.ok(colours(at.first) >= 8, `only ${colours(at.first)} colours`);
    }],
    ['covers a closed room', async () => {
      // The share is counted a few frames late: the first one read may be that of the empty frame before.
      await until(at.page, 'a covered picture', (now) => now.uncovered !== null && now.uncovered < 0.05);
    }],
    ['fills the panel', async () => {
      await until(at.page, 'the figures', (now) => now.stats.samples > 0);
      await sleep(600);
      assert.match(await panel(at.page, 'samples'), /^\d/);
      assert.match(await panel(at.page, 'uncovered'), /^\d/);
      assert.match(await panel(at.page, 'round-trip'), /^\d/);
      assert.equal(await panel(at.page, 'renderer'), renderer === 'webgpu' ? 'WebGPU' : 'WebGL2');
      assert.equal(await panel(at.page, 'scene'), SCENE);
      assert.match(await panel(at.page, 'resolution'), /^(full|\d+ % in motion)$/);
      assert.ok(await at.page.locator('#loading').isHidden());
      assert.ok(await at.page.locator('#status').isHidden());
    }],
    ['decides by its frames whether shadows and occlusion are drawn', async () => {
      const { effects } = await until(at.page, 'a decision', (now) => now.effects.every((effect) => effect !== 'not yet'));
      console.log(`        shadows ${effects[0]}, occlusion ${effects[1]}`);
      await sleep(600);
      assert.deepEqual([await panel(at.page, 'shadows'), await panel(at.page, 'occlusion')], effects);
    }],
    ['is as bright as the address says', async () => {
      const [plain, bright] = await Promise.all(['', '&exposure=1.5'].map(async (wish) => {
        const page = await smallPage(at, `${at.server.origin}/?renderer=${renderer}${wish}`);
        await until(page, 'a picture', (now) => now.picture);
        const picture = await still(page, join(shots, `${renderer}-1-exposure${wish.replace(/\W/g, '-')}.png`));
        await page.close();
        return picture;
      }));
      assert.ok(brightness(bright) - brightness(plain) > 10, `brightness goes from ${brightness(plain)} to ${brightness(bright)}`);
    }],
    ['decodes in a worker', async () => {
      const state = await until(at.page, 'updates', (now) => now.updates > 0);
      assert.equal(state.decoder, 'worker');
      assert.ok(state.stats.ms.decode > 0, 'it took no time');
      assert.equal(at.page.workers().length, 1);
    }],
    ['begins where the address says', async () => {
      const page = await smallPage(at, `${at.server.origin}/?renderer=${renderer}&eye=0.5,1.2,-1&target=0.5,1.2,-9&fov=40`);
      const { pose } = await until(page, 'a picture', (now) => now.picture);
      assert.ok(far(pose, { position: [0.5, 1.2, -1] }) < 1e-6, `it begins at ${pose.position}`);
      const narrow = await still(page, join(shots, `${renderer}-1-narrow.png`));
      await page.goto(`${at.server.origin}/?renderer=${renderer}&eye=0.5,1.2,-1&target=0.5,1.2,-9&fov=80`);
      const wide = await still(page, join(shots, `${renderer}-1-wide.png`));
      assert.ok(difference(narrow, wide) > 0.1, 'the field of view hardly changes the picture');
      await page.goto(`${at.server.origin}/?renderer=${renderer}&eye=0.5,1.2`);
      await page.locator('#loading-detail', { hasText: '?eye= and ?target= go together' }).waitFor();
      await page.close();
    }],
    ['turns by dragging', async () => {
      const before = await settled(at.page);
      await at.page.mouse.move(320, 220);
      await at.page.mouse.down();
      await at.page.mouse.move(400, 220, { steps: 4 });
      await at.page.mouse.up();
      const after = await until(at.page, 'a turn', (now) => turned(before.pose, now.pose) > 0.1);
      assert.ok(after.frames > before.frames);
      at.turned = await stillPicture(at.page, `${renderer}-2-turned`);
      assert.ok(difference(at.first, at.turned) > 0.1, 'the picture hardly changed');
      assert.ok(contrast(at.turned) > 50, 'the canvas is nearly blank');
    }],
    ['moves by keys, and the panel changes', async () => {
      const before = await settled(at.page);
      await at.page.locator('#view').focus();
      await at.page.keyboard.down('KeyS');
      await until(at.page, 'a step back', (now) => far(before.pose, now.pose) > 0.5);
      await at.page.keyboard.up('KeyS');
      await until(at.page, 'new samples', (now) => now.updates > before.updates && now.samples !== before.samples);
      const after = await settled(at.page);
      assert.ok(after.uncovered < 0.2, `${after.uncovered} of the picture is uncovered`);
      const moved = await canvasPixels(at.page, join(shots, `${renderer}-3-moved.png`));
      assert.ok(difference(at.turned, moved) > 0.05, 'the picture hardly changed');
    }],
    ['opens the help', async () => {
      await at.page.keyboard.press('KeyH');
      assert.ok(await at.page.locator('#help').isVisible());
      await at.page.screenshot({ caret: 'initial', path: join(shots, `${renderer}-4-help.png`) });
      await at.page.keyboard.press('Escape');
      assert.ok(await at.page.locator('#help').isHidden());
    }],
    ['says what is sent, and what is left out', async () => {
      await at.page.keyboard.press('KeyI');
      const layers = at.page.locator('#inventory-parts tr', { hasText: 'layers' });
      await layers.waitFor();
      assert.match(await layers.innerText(), /left out\s+nothing is blended/);
      await at.page.keyboard.press('Escape');
      assert.ok(await at.page.locator('#inventory').isHidden());
    }],
    [once('follows a presenter, and looks around on its own'), async () => {
      const open = (role) => smallPage(at, `${at.server.origin}/?renderer=${renderer}&${role}=Ada`);
      const presenter = await open('present');
      const goes = async (key) => {
        const { pose } = await until(presenter, 'a picture', (now) => now.picture);
        await presenter.bringToFront();
        await presenter.locator('#view').focus();
        await presenter.keyboard.down(key);
        await until(presenter, 'a step', (now) => far(pose, now.pose) > 0.5);
        await presenter.keyboard.up(key);
        return (await settled(presenter)).pose;
      };
      const isAt = (pose) => (now) => now.picture && now.led && far(now.pose, pose) < 0.01 && turned(now.pose, pose) < 0.01;
      const first = await goes('KeyS');
      const follower = await open('follow');
      const came = await until(follower, 'the place of the presenter', isAt(first));
      assert.ok(came.samples > 10_000, `${came.samples} samples`);
      assert.equal(await presenter.locator('#role').textContent(), 'Presenting as Ada');
      const second = await goes('KeyA');
      await follower.bringToFront();
      await until(follower, 'the next place of the presenter', isAt(second));
      assert.equal(await follower.locator('#role').textContent(), 'Following Ada');
      const followed = await still(follower, join(shots, `${renderer}-4-followed.png`));
      assert.ok(contrast(followed) > 50, 'the canvas is nearly blank');
      await follower.mouse.move(320, 120);
      await follower.mouse.down();
      await follower.mouse.move(360, 120, { steps: 4 });
      await follower.mouse.up();
      await until(follower, 'a look of its own', (now) => !now.led && turned(now.pose, second) > 0.1);
      await follower.locator('#role', { hasText: /^Follow Ada$/ }).waitFor();
      await follower.screenshot({ caret: 'initial', path: join(shots, `${renderer}-4-follower.png`) });
      await follower.locator('#role').click();
      await until(follower, 'the presenter again', isAt(second));
      await follower.close();
      await presenter.close();
    }],
    ['survives a restart of the server', async () => {
      const before = await settled(at.page);
      await at.server.stop('SIGKILL');
      const lost = await until(at.page, 'the status', (now) => now.status !== '');
      assert.match(lost.status, /lost|cannot reach|connecting|closed the connection/);
      await at.page.locator('#status').waitFor({ state: 'visible' });
      await at.page.screenshot({ caret: 'initial', path: join(shots, `${renderer}-5-lost.png`) });
      assert.ok(lost.picture && lost.samples > before.samples / 2, 'the old picture stays');
      at.server = await startServer({ bin, web, port: at.port, scene: SCENE, log: at.log });
      await until(at.page, 'a new session with a picture', (now) => now.connected && now.status === '' && now.updates > 0);
      const after = await settled(at.page);
      assert.ok(far(before.pose, after.pose) < 1e-6, 'the eye stays where it was');
      const again = await canvasPixels(at.page, join(shots, `${renderer}-6-again.png`));
      assert.ok(contrast(again) > 50, 'the canvas is nearly blank');
      assert.ok(await at.page.locator('#status').isHidden());
    }],
    [once('goes on with what it holds when its network comes back'), async () => {
      const relay = await startRelay(at.port);
      const page = await smallPage(at, `${relay.origin}/?renderer=${renderer}`);
      const before = await settled(page);
      const picture = await stillPicture(page, `${renderer}-6-before-the-cut`);
      relay.freeze();
      const cut = await until(page, 'the status', (now) => now.status !== '');
      assert.ok(cut.picture && cut.samples === before.samples, 'the old picture stays');
      relay.thaw();
      const thawed = Date.now();
      await until(page, 'a session', (now) => now.connected && now.status === '');
      const back_s = (Date.now() - thawed) / 1000;
      const after = await settled(page);
      const share = after.stats.bytes_received / before.stats.bytes_received;
      console.log(`        back after ${back_s.toFixed(1)} s, for ${(100 * share).toFixed(1)} % of the bytes of the first set`);
      assert.ok(share <= 0.1, `${after.stats.bytes_received} bytes of ${before.stats.bytes_received}`);
      assert.equal(after.samples, before.samples, 'it holds what it held');
      assert.equal(difference(picture, await stillPicture(page, `${renderer}-6-after-the-cut`), 0), 0, 'the same picture');
      await page.close();
      relay.stop();
    }],
    [once('is told why it is not let in, and keeps its token to itself'), async () => {
      const token = 'open/Sesame+ü';
      const heard = [];
      const log = (line) => { heard.push(line); at.log(line); };
      const server = await startServer({ bin, web, port: await freePort(), scene: SCENE, log, more: ['--image-size', '256', '--images', '2', '--token', token] });
      const address = (hash) => `${server.origin}/?renderer=${renderer}${hash}`;
      for (const [hash, words] of [['', /does not let you in: a token is needed/], ['#token=other', /does not let you in: the token is wrong/]]) {
        const page = await smallPage(at, address(hash));
        const { status } = await until(page, 'a word', (now) => words.test(now.status));
        await sleep(2000);
        assert.equal((await until(page, 'a word', () => true)).status, status, 'it does not try again by itself');
        await page.screenshot({ caret: 'initial', path: join(shots, `${renderer}-6-not-let-in.png`) });
        if (hash) {
          const reloaded = page.waitForEvent('load', { timeout: PATIENCE_MS });
          await page.evaluate((right) => { window.location.hash = `token=${right}`; }, encodeURIComponent(token));
          await reloaded;
          await until(page, 'a picture by the token that was put right', (now) => now.picture);
        }
        await page.close();
      }
      const page = await at.page.context().newPage();
      const urls = [];
      page.on('request', (request) => urls.push(`${request.url()} ${JSON.stringify(request.headers())}`));
      page.on('websocket', (socket) => urls.push(socket.url()));
      await page.goto(address(`#token=${encodeURIComponent(token)}`), { waitUntil: 'load', timeout: PATIENCE_MS });
      await until(page, 'a picture', (now) => now.picture);
      const hidden = [token, encodeURIComponent(token)];
      const tells = (text) => hidden.some((word) => text.includes(word));
      assert.ok(!tells(page.url()), `the address has the token: ${page.url()}`);
      assert.ok(!(await page.content()).includes(token), 'the page shows the token');
      await page.reload({ waitUntil: 'load', timeout: PATIENCE_MS });
      await until(page, 'a picture after a reload', (now) => now.picture);
      assert.deepEqual([...urls, ...heard].filter(tells), []);
      assert.ok(urls.some((url) => url.startsWith('ws://')), 'the socket was seen');
      await page.close();
      await server.stop();
    }],
    [once('is shown the scene that its address names'), async () => {
      const folder = await mkdtemp(join(tmpdir(), 'vantage-scenes-'));
      await writeFile(join(folder, 'a square.obj'), 'v -1 -1 0\nv 1 -1 0\nv 1 1 0\nv -1 1 0\nf 1 2 3 4\n');
      await writeFile(join(folder, 'broken.glb'), 'glTF and no more');
      const more = ['--image-size', '64', '--images', '1', '--scenes', folder, '--token', 'open'];
      const server = await startServer({ bin, web, port: await freePort(), scene: SCENE, log: at.log, more });
      const address = (name) => `${server.origin}/?renderer=${renderer}${name && `&scene=${encodeURIComponent(name)}`}`;
      const page = await smallPage(at, `${address('a square')}#token=open`);
      await until(page, 'a picture', (now) => now.picture);
      await sleep(600);
      assert.equal(await panel(page, 'scene'), 'a square');
      await page.screenshot({ caret: 'initial', path: join(shots, `${renderer}-6-scene.png`) });
      // The tab's token is the server's, whichever scene is asked for.
      for (const [name, words] of [['broken', /broken cannot be shown/], ['other', /there is no scene "other" here; there are: a square, broken/]]) {
        await page.goto(address(name), { waitUntil: 'load', timeout: PATIENCE_MS });
        await until(page, 'a word', (now) => words.test(now.status));
      }
      await page.goto(address(''), { waitUntil: 'load', timeout: PATIENCE_MS });
      await until(page, 'a picture', (now) => now.picture);
      await sleep(600);
      assert.equal(await panel(page, 'scene'), SCENE);
      await page.close();
      await server.stop();
      await rm(folder, { recursive: true });
    }],
    ['says why a page from another machine has no WebGPU', async () => {
      // This machine by its name in the network, as colleagues open it; without one there is nothing to see.
      const name = Object.values(networkInterfaces()).flat().find(({ family, internal }) => family === 'IPv4' && !internal)?.address;
      assert.ok(await at.page.locator('#insecure').isHidden(), 'loopback is secure');
      if (!name) return;
      const more = ['--image-size', '64', '--images', '1', '--bind', '0.0.0.0', '--token', 'open'];
      const port = await freePort();
      const server = await startServer({ bin, web, port, scene: SCENE, log: at.log, more });
      const page = await smallPage(at, `http://${name}:${port}/#token=open`);
      const state = await until(page, 'a picture', (now) => now.picture);
      assert.equal(state.renderer, 'webgl2');
      await page.locator('#insecure').waitFor({ state: 'visible' });
      await page.screenshot({ caret: 'initial', path: join(shots, `${renderer}-6-insecure.png`) });
      await page.close();
      await server.stop();
    }],
    ['makes a new device when one is lost', async () => {
      const before = await settled(at.page);
      await at.page.evaluate(() => window.vantage.lose_device());
      await until(at.page, 'a new device', (now) => now.device_losses === 1 && now.renderer === renderer && now.status === '');
      await until(at.page, 'a picture on it', (now) => now.frames > before.frames);
      const again = await stillPicture(at.page, `${renderer}-7-new-device`);
      assert.ok(contrast(again) > 50, 'the canvas is nearly blank');
      await at.page.mouse.move(320, 220);
      await at.page.mouse.down();
      await at.page.mouse.move(260, 220, { steps: 3 });
      await at.page.mouse.up();
      await until(at.page, 'the new canvas to listen', (now) => turned(before.pose, now.pose) > 0.05);
    }],
    ['draws without a worker', async () => {
      // A browser that has none, one whose script is not there, and one that dies of its first update.
      const without = [
        (page) => page.addInitScript(() => { delete window.Worker; }),
        (page) => page.route('**/worker.js', (route) => route.abort()),
        (page) => page.addInitScript(mortalWorkers),
      ];
      for (const prepare of without) {
        const page = await at.page.context().newPage();
        const said = [];
        page.on('console', (message) => said.push(`${message.type()}: ${message.text()}`));
        await prepare(page);
        await page.goto(`${at.server.origin}/?renderer=${renderer}`, { waitUntil: 'load', timeout: PATIENCE_MS });
        const state = await until(page, 'a picture', (now) => now.picture && now.samples > 10_000);
        assert.equal(state.decoder, 'page');
        assert.match(said.join('\n'), /^warning: updates are decoded on the page's own thread, as there is no worker: ./m);
        const pixels = await canvasPixels(page, join(shots, `${renderer}-8-no-worker.png`));
        assert.ok(contrast(pixels) > 50, 'the canvas is nearly blank');
        await page.close();
      }
    }],
    ['shows what a mirror reflects, and occlusion where asked for', async () => {
      // The other pot, and six sides of what is around.
      const wishes = ['', '&occlusion=graph'];
      const [plain, occluded] = await pictures(at, 'mirror-teapots', wishes, ({ impostors }) => impostors === 7);
      assert.ok(colours(plain) >= 8, `only ${colours(plain)} colours`);
      darkens(plain, occluded);
    }],
    ['shows what is near as a blur in rough metals', async () => {
      const more = ['--image-size', '256', '--images', '2', '--look', 'full'];
      const [{ data, width, height }] = await pictures(at, 'rough-teapots', [''], ({ impostors }) => impostors > 6, more);
      // On the tray, below the red pot and beside it.
      const redness = (x, y) => {
        const pixel = (Math.round(y * height) * width + Math.round(x * width)) * 4;
        return data[pixel] / Math.max(data[pixel + 1], 1);
      };
      const [below, beside] = [redness(0.59, 0.67), redness(0.2, 0.67)];
      assert.ok(below > beside + 0.2, `as red as ${below} below the pot, ${beside} beside it`);
    }],
    ['shows barrels by reliefs', async () => {
      // Their triangles are less than images.
      const more = ['--image-size', '256', '--images', '2', '--bodies', 'off'];
      const [barrels] = await pictures(at, 'barrels', [''], ({ impostors }) => impostors > 0, more);
      assert.ok(colours(barrels) >= 8, `only ${colours(barrels)} colours`);
    }],
    ['shows hard and soft shadows where asked for', async () => {
      const wishes = ['', '&shadows=maps', ...['maps', 'march'].map((method) => `&shadows=soft&soft-points=2&soft-method=${method}`)];
      const [plain, hard, ...soft] = await pictures(at, 'lamp-teapots', wishes, (now, wish) => !wish.includes('soft') || (now.soft_points && seesLamps(now)));
      [hard, ...soft].forEach((picture) => darkens(plain, picture));
      assert.ok(difference(hard, soft[0]) > 0.002, 'soft shadows look like hard ones');
      assert.ok(difference(...soft) < difference(hard, soft[0]), 'what method draws soft shadows shows');
    }],
    ['shows no shadow of a surface on itself', async () => {
      // Sent as its triangles, whose depth a rasterizer interpolates as it likes.
      const from = '&eye=0.3,-3,2.2&target=0,0,0.2&fov=60';
      const more = ['--image-size', '256', '--images', '2', '--look', 'plain', '--rest', 'off'];
      const [plain, shadowed] = await withLitSquare((scene) => pictures(at, scene, [from, `${from}&shadows=maps`], ({ connected }) => connected, more));
      assert.ok(brightness(plain) > 60, `it is not lit: brightness ${brightness(plain)}`);
      assert.ok(difference(plain, shadowed, 8) < 0.002, `${100 * difference(plain, shadowed, 8)} % of the picture is in shadow`);
    }],
    ['keeps soft shadows while the eye moves, and follows lamps', async () => {
      // From a still scene nothing of what lamps see is sent again; where lamps swing and pots turn only what comes into view.
      for (const scene of ['lamp-teapots', 'lamp-teapots-moving']) {
        const server = await startServer({ bin, web, port: await freePort(), scene, log: at.log });
        const page = await smallPage(at, `${server.origin}/?renderer=${renderer}&shadows=soft&soft-points=2`);
        const before = await until(page, 'soft shadows', (now) => now.soft_points && seesLamps(now));
        const first = await canvasPixels(page, join(shots, `${renderer}-10-${scene}.png`));
        await page.locator('#view').focus();
        await page.keyboard.down('KeyD');
        await until(page, 'the eye elsewhere', (now) => far(before.pose, now.pose) > 0.2 && now.updates > before.updates + 4);
        await page.keyboard.up('KeyD');
        const after = await until(page, 'soft shadows there', (now) => now.soft_points);
        assert.match(await panel(page, 'soft-points'), /^\d+ of 4, (warp|maps|march)$/);
        const then = await canvasPixels(page, join(shots, `${renderer}-11-${scene}.png`));
        assert.ok(difference(first, then) > 0.01, 'the picture hardly changed');
        await page.screenshot({ caret: 'initial', path: join(shots, `${renderer}-12-${scene}.png`) });
        const [was, is] = [before, after].map((state) => state.light_images);
        if (scene === 'lamp-teapots') assert.deepEqual(is, was);
        else assert.ok(is.newest > was.newest, 'nothing of the swinging lamp came');
        const [bytes, updates] = ['bytes_received', 'updates'].map((figure) => after.stats[figure] - before.stats[figure]);
        console.log(`        ${scene}: ${before.stats.bytes_received} bytes at first, ${bytes} in ${updates} updates while the eye moves; `
          + `of lamps ${was.samples} samples in ${was.patches} images, then ${is.samples} in ${is.patches}, by ${after.soft_method}`);
        await page.close();
        await server.stop();
      }
    }],
    ['shows materials of a file, and what lies behind a pane', async () => {
      const { data, width, height } = await withMaterials((file) => showsMaterials(at, file, 'materials-at-rest', [], (page) => until(page, 'the view at rest', (now) => now.at_rest)));
      // Of a place in metres: the view is 4 m high, seen from 5.5 m away.
      const at_m = (x, y) => {
        const pixel = (Math.round(height / 2 - y * height / 4) * width + Math.round(width / 2 + x * height / 4)) * 4;
        return [...data.subarray(pixel, pixel + 3)];
      };
      const [leansUp, leansDown] = [at_m(-0.85, -0.6), at_m(-0.35, -0.6)];
      assert.ok(leansUp[1] > leansDown[1] + 40, `a normal map: ${leansUp} and ${leansDown}`);
      const [smooth, rough] = [at_m(0.35, 0.8), at_m(0.85, 0.8)];
      assert.ok(smooth[1] > rough[1] + 25 && rough[1] > 60, `a smooth and a rough metal: ${smooth} and ${rough}`);
      const [shines, dark] = [at_m(0.35, -0.6), at_m(0.85, -0.6)];
      assert.ok(shines[0] > 170 && shines[0] > dark[0] + 100 && Math.abs(shines[1] - dark[1]) < 25, `an emissive texture: ${shines} and ${dark}`);
      const pane = at_m(-0.6, 0.6);
      assert.ok(pane.every((value, channel) => Math.abs(value - [188, 0, 188][channel]) <= 6), `a pane before blue: ${pane}`);
    }],
    ['sees through a pane from samples of other views', async () => {
      // Without a view at rest, from samples alone.
      const seen = (file) => showsMaterials(at, file, 'materials-moving', ['--rest', 'off'], settled);
      const { data, width, height } = await withMaterials(seen);
      const pixel = (Math.round(height / 2 - 0.6 * height / 4) * width + Math.round(width / 2 - 0.6 * height / 4)) * 4;
      const pane = [...data.subarray(pixel, pixel + 3)];
      assert.ok(pane.every((value, channel) => Math.abs(value - [188, 0, 188][channel]) <= 6), `a pane before blue: ${pane}`);
    }],
    ['shows what is far from the origin as at the origin', async () => {
      // 1e7 m away; as triangles where these are less, and as samples alone.
      const away = [8e6, 2e6, -5.6e6];
      for (const bodies of ['auto', 'off']) {
        const options = ['--rest', 'off', '--bodies', bodies];
        const [near, distant] = await Promise.all([[0, 0, 0], away].map((place, index) => withMaterials((file) => (
          showsMaterials(at, file, `place-${index}-bodies-${bodies}`, options, settled, place)
        ), place)));
        assert.ok(colours(near) >= 8, `only ${colours(near)} colours`);
        const share = difference(near, distant, 1);
        console.log(`        bodies ${bodies}: ${(100 * share).toFixed(3)} % of the pixels differ`);
        assert.ok(share <= 0.001, `${100 * share} % of the pixels differ by more than 1 of 255`);
      }
    }],
    ['was refused nothing by its own policy, which refuses scripts and styles of others', async () => {
      assert.deepEqual(at.lines.filter((line) => /Content Security Policy|Permissions-Policy/i.test(line)), []);
      // A page whose console is not looked at.
      const page = await at.page.context().newPage();
      await page.goto(`${at.server.origin}/?renderer=${renderer}`, { waitUntil: 'load', timeout: PATIENCE_MS });
      const refused = await page.evaluate(async () => {
        const kinds = [];
        document.addEventListener('securitypolicyviolation', ({ effectiveDirective }) => kinds.push(effectiveDirective));
        const add = (kind, fields) => document.body.append(Object.assign(document.createElement(kind), fields));
        add('script', { textContent: 'window.inlined = true' });
        add('style', { textContent: 'body { --inlined: 1 }' });
        add('img', { src: 'https://192.0.2.1/picture.png' });
        add('iframe', { src: 'https://192.0.2.1/' });
        await fetch('https://192.0.2.1/').catch(() => {});
        await new Promise((resolve) => { setTimeout(resolve, 500); });
        return { kinds, inlined: window.inlined };
      });
      assert.equal(refused.inlined, undefined);
      for (const kind of ['script-src-elem', 'style-src-elem', 'img-src', 'frame-src', 'connect-src']) {
        assert.ok(refused.kinds.includes(kind), `${kind} among ${refused.kinds}`);
      }
      await page.close();
    }],
    ...newcomerTests({ bin, web, shots, renderer, at }),
    ...stagingTests({ bin, web, shots, renderer, at }),
    ...findingTests({ bin, web, shots, renderer, at }),
    ...headsetTests({ bin, web, shots, renderer, at }),
    ...embedTests({ bin, web, shots, renderer, at }),
    ['said nothing wrong in the console', async () => {
      const wrong = at.lines.filter((line) => /^(page error|console error)/.test(line))
        // The browser itself reports the sockets that the restart broke.
        .filter((line) => !/WebSocket connection|ERR_CONNECTION_REFUSED|favicon/.test(line))
        // What it was refused it says in words, and the browser in its own.
        .filter((line) => !/Failed to load resource: .* status of (403|413|422)/.test(line))
        // And that a page from another machine without TLS is kept apart from others by nothing.
        .filter((line) => !/Cross-Origin-Opener-Policy header has been ignored/.test(line));
      assert.deepEqual(wrong, []);
    }],
  ];
  return testsOf(renderer, all).map(([name, run]) => ({ name: `${renderer}: ${name}`, run, at }));
}

async function runAll(renderer, tally) {
  const all = tests(renderer);
  const { at } = all[0];
  at.lines = [];
  at.log = (line) => at.lines.push(line);
  let broken = false;
  for (const { name, run } of all) {
    const begin = Date.now();
    if (broken) {
      tally.failed += 1;
      console.log(`FAILED  ${name}: not reached`);
      continue;
    }
    try {
      await run();
      tally.passed += 1;
      console.log(`ok      ${name} (${((Date.now() - begin) / 1000).toFixed(1)} s)`);
    } catch (error) {
      tally.failed += 1;
      console.log(`FAILED  ${name}: ${error.stack ?? error}`);
      await at.page?.screenshot({ caret: 'initial', path: join(shots, `${renderer}-failed.png`) }).catch(() => {});
      console.log(at.lines.slice(-40).map((line) => `        ${line}`).join('\n'));
      // Without a page that shows something the rest says nothing.
      broken = name === all[0].name;
    }
  }
  await at.close?.().catch((error) => console.log(`closing the browser: ${error.message}`));
  await at.server?.stop();
}

const tally = { passed: 0, failed: 0 };
if (!bin || !web) {
  console.error('VANTAGE_SERVER_BIN and VANTAGE_WEB_DIR must name the server and the built web client');
  process.exit(2);
}
await mkdir(shots, { recursive: true });
const asked = process.argv.slice(2);
for (const renderer of asked.length > 0 ? asked : ['webgpu', 'webgl2']) await runAll(renderer, tally);
console.log(`${tally.passed} passed, ${tally.failed} failed, 0 skipped`);
process.exit(tally.failed > 0 ? 1 : 0);
