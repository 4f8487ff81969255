// What one measures, sees over time, and moves by beside mouse and keys.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { setTimeout as sleep } from 'node:timers/promises';
import { openCoarsePage } from './lib/browser.mjs';
import { once } from './lib/once.mjs';
import { canvasPixels, difference } from './lib/pixels.mjs';
import { freePort, startServer } from './lib/server.mjs';
import { PATIENCE_MS, settled, turned, until } from './lib/state.mjs';

/** In the page: a gamepad of the standard mapping, whose sticks are what `window.sticks` says. */
function withGamepad() {
  window.sticks = [0, 0, 0, 0];
  const fields = { connected: true, mapping: 'standard', buttons: [], get axes() { return window.sticks; } };
  const pad = Object.create(Gamepad.prototype, Object.getOwnPropertyDescriptors(fields));
  Object.defineProperty(navigator, 'getGamepads', { value: () => [pad] });
}

/** Tests of a browser that shows by `renderer`. */
export function findingTests({ bin, web, shots, renderer, at }) {
  const shot = (name) => join(shots, `${renderer}-finding-${name}.png`);

  const opened = async (query, use, prepare = undefined, more = undefined) => {
    const server = await startServer({ bin, web, port: await freePort(), scene: 'pillars', log: at.log, more });
    const { page, close } = await openCoarsePage(renderer, at.log);
    try {
      if (prepare) await page.addInitScript(prepare);
      await page.goto(`${server.origin}/?renderer=${renderer}&shadows=none&occlusion=none${query}`, { waitUntil: 'load', timeout: PATIENCE_MS });
      await until(page, 'a picture', (now) => now.picture);
      await use(page);
    } finally {
      await close();
      await server.stop();
    }
  };

  return [
    // From 2 m above the floor, looking down at it beside a crate: 2 m of it from top to bottom of 400 pixels at 53.13 degrees.
    ['measures with a tape', () => opened('&eye=-2,2,-2&target=-2,0,-2.0001&fov=53.1301', async (page) => {
      await settled(page);
      await page.locator('#tape-toggle').click();
      await page.locator('#measured', { hasText: 'Click on one end' }).waitFor();
      await page.mouse.click(540, 230);
      await page.locator('#measured', { hasText: 'other end' }).waitFor();
      await page.mouse.click(590, 230);
      await page.locator('#measured', { hasText: '±' }).waitFor();
      const words = await page.locator('#measured').textContent();
      await page.screenshot({ path: shot('tape') });
      const [, number, unit, off, offUnit] = words.match(/^([\d.]+) (cm|m) ± ([\d.]+) (mm|cm)$/) ?? assert.fail(words);
      const [measured, most] = [Number(number) * (unit === 'cm' ? 0.01 : 1), Number(off) * (offUnit === 'cm' ? 0.01 : 0.001)];
      // A pixel is 5 mm of the floor there.
      console.log(`        ${words} of 0.25 m`);
      assert.ok(Math.abs(measured - 0.25) <= most + 0.0051 && most < 0.05, words);
      // By keys: the middle of the picture, twice; then it is put away.
      await page.keyboard.press('Space');
      await page.locator('#measured', { hasText: 'other end' }).waitFor();
      await page.keyboard.press('t');
      await page.locator('#measured').waitFor({ state: 'hidden' });
    })],
    [once('goes to the middle of the picture, and has a wider view, by keys'), () => opened('', async (page) => {
      const before = await settled(page);
      await page.keyboard.press('Enter');
      const there = await until(page, 'a move', (now) => Math.hypot(...now.pose.position.map((x, axis) => x - before.pose.position[axis])) > 0.5);
      assert.ok(there.pose);
      await page.keyboard.press(']');
      await until(page, 'a wider view', (now) => Math.abs(now.fov_deg - 65) < 1e-6);
      await page.keyboard.press('l');
      assert.match(await page.locator('#share-link').inputValue(), /[?&]fov=65(&|$)/);
    })],
    [once('goes and looks by a gamepad'), () => opened('', async (page) => {
      const before = await settled(page);
      await page.evaluate(() => { window.sticks = [0, -1, 0, 0]; });
      const gone = await until(page, 'a step', (now) => Math.hypot(...now.pose.position.map((x, axis) => x - before.pose.position[axis])) > 0.3);
      await page.evaluate(() => { window.sticks = [0.05, 0, 1, 0]; });
      await until(page, 'a turn', (now) => turned(now.pose, gone.pose) > 0.2);
      await page.evaluate(() => { window.sticks = [0.05, -0.05, 0, 0]; });
      await sleep(1000);
      const rests = await until(page, 'a picture', (now) => now.picture);
      await sleep(500);
      assert.deepEqual((await until(page, 'a picture', (now) => now.picture)).pose, rests.pose, 'a stick at rest moves the eye');
    }, withGamepad)],
    [once('glides on after a drag, unless less motion is wanted'), () => opened('', async (page) => {
      const glided = async () => {
        await settled(page);
        await page.mouse.move(300, 200);
        await page.mouse.down();
        await page.mouse.move(420, 200, { steps: 12 });
        await page.mouse.up();
        const up = await page.evaluate(() => window.vantage.pose);
        const { pose } = await settled(page);
        return turned(pose, up);
      };
      const thrown = await glided();
      await page.emulateMedia({ reducedMotion: 'reduce' });
      await page.keyboard.press('r');
      const calm = await glided();
      console.log(`        glides by ${thrown.toFixed(4)} rad, and by ${calm.toFixed(4)}`);
      assert.ok(thrown > 0.005 && calm < thrown / 3, `${thrown} and ${calm}`);
    })],
    // The hall is 12 m to each side, and its start looks along it.
    ['is stopped by walls, slides along them, and goes through where it is let', () => opened('&eye=-9,1.6,3&target=-12,1.6,3', async (page) => {
      await settled(page);
      const at = async () => (await until(page, 'a picture', (now) => now.picture)).pose.position;
      await page.locator('#view').focus();
      await page.keyboard.down('w');
      await sleep(6000);
      await page.keyboard.up('w');
      const stopped = await at();
      console.log(`        stands at x ${stopped[0].toFixed(2)} m`);
      assert.ok(stopped[0] > -12 && stopped[0] < -9.5, `${stopped}`);
      // Ahead and to the side: along the wall.
      await page.keyboard.down('w');
      await page.keyboard.down('d');
      await sleep(1500);
      await page.keyboard.up('w');
      await page.keyboard.up('d');
      const slid = await at();
      assert.ok(slid[0] > -12 && Math.abs(slid[2] - stopped[2]) > 0.5, `${slid}`);
      await page.keyboard.press('c');
      await page.keyboard.down('w');
      const through = await until(page, 'the other side', (now) => now.pose.position[0] < -12.5);
      await page.keyboard.up('w');
      assert.equal(through.walls, false);
    })],
    ['draws as finely as one chooses, and marks what it does not hold', () => opened('&eye=2,1.6,2&target=0,1.6,-3&soft-points=2', async (page) => {
      await settled(page);
      await page.locator('#quality').selectOption('fine');
      const fine = await until(page, 'shadows', (now) => now.picture && now.effects?.every((drawn) => drawn === 'on'));
      assert.ok(fine.connected);
      await page.locator('#quality').selectOption('fast');
      await until(page, 'no shadows', (now) => now.picture && now.effects?.every((drawn) => drawn === 'off'));
      // Without its ceiling there is nothing above the walls.
      const magenta = async () => {
        const { data } = await canvasPixels(page, shot('holes'));
        let count = 0;
        for (let i = 0; i < data.length; i += 4) count += Number(data[i] === 255 && data[i + 1] === 0 && data[i + 2] === 255);
        return count;
      };
      await page.locator('#cut-axis').evaluate((axis) => { axis.value = 'y'; axis.dispatchEvent(new Event('change')); });
      await settled(page);
      assert.equal(await magenta(), 0);
      await page.locator('#holes').check();
      await settled(page);
      assert.ok(await magenta() > 1000, 'nothing is marked');
      await page.locator('#holes').uncheck();
      await settled(page);
      const own = await canvasPixels(page, shot('own-colours'));
      const shown = [own];
      for (const name of ['density', 'age']) {
        await page.locator('#tint').selectOption(name);
        await sleep(1500);
        const tinted = await canvasPixels(page, shot(name));
        shown.forEach((other) => assert.ok(difference(other, tinted) > 0.3, `${name} looks like something else`));
        shown.push(tinted);
      }
      await page.locator('#tint').selectOption('picture');
      await settled(page);
      assert.ok(difference(own, await canvasPixels(page, shot('own-again'))) < 0.01, 'the picture is not what it was');
      await page.locator('#quality').selectOption('auto');
      const { updates } = await until(page, 'a picture', (now) => now.picture && now.effects);
      assert.ok(updates > 0, 'the session goes on');
      // A view at rest is all that there is.
    }, undefined, ['--rest', 'off'])],
    [once('draws curves of its figures, and its last updates'), () => opened('', async (page) => {
      await page.keyboard.down('w');
      await sleep(3000);
      await page.keyboard.up('w');
      const points = (id) => page.evaluate((name) => document.querySelector(`#${name} > *`).getAttribute('points')?.trim().split(' ').map((pair) => pair.split(',').map(Number)), id);
      const curve = await points('curve-fps');
      assert.ok(curve.length > 8 && curve.every(([x, y]) => x >= 0 && x <= 1 && y >= 0 && y <= 1), JSON.stringify(curve));
      assert.ok(curve.every(([x], index) => index === 0 || x > curve[index - 1][0]), 'time goes on');
      assert.match(await page.locator('#updates').textContent(), /^\d+ in 10 s, up to [\d.]+ kB and [\d.]+ ms$/);
      assert.match(await page.evaluate(() => document.querySelector('#timeline path').getAttribute('d')), /^(M[\d.]+ 1V[\d.]+)+$/);
      await page.screenshot({ path: shot('curves') });
    })],
  ];
}
