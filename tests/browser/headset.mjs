// A headset, as the emulator of Meta's has it: each eye sees what a page sees from there, heads and thumbsticks move, and it is taken off again.
import assert from 'node:assert/strict';
import { createRequire } from 'node:module';
import { join } from 'node:path';
import { openCoarsePage, openPage } from './lib/browser.mjs';
import { once } from './lib/once.mjs';
import { decoded, difference } from './lib/pixels.mjs';
import { freePort, startServer } from './lib/server.mjs';
import { PATIENCE_MS, settled, still, turned, until } from './lib/state.mjs';

const EMULATOR = createRequire(import.meta.url).resolve('iwer/build/iwer.min.js');
/** Two eyes, side by side. */
const VIEWPORT = { width: 480, height: 320 };
const EYE = { width: VIEWPORT.width / 2, height: VIEWPORT.height };
const FOV_DEG = 70;
/** Metres between them: far more than anybody's, so that what one sees is not what the other does. */
const APART_M = 0.3;

/** In the page: a headset that is worn by somebody who looks to the left in his room. */
function wears([fovDeg, apartM]) {
  const headset = new window.IWER.XRDevice(window.IWER.metaQuest3, { stereoEnabled: true, fovy: fovDeg * Math.PI / 180, ipd: apartM, visibilityMask: null });
  headset.installRuntime({ forceInstall: true });
  headset.quaternion.set(0, Math.SQRT1_2, 0, Math.SQRT1_2);
  window.headset = headset;
}

/** Half of a picture. */
function half({ width, height, data }, index) {
  const rows = Array.from({ length: height }, (_, y) => data.subarray((y * width + index * width / 2) * 4, (y * width + (index + 1) * width / 2) * 4));
  return { width: width / 2, height, data: Buffer.concat(rows) };
}

/** Tests of a browser that shows by `renderer`. */
export function headsetTests({ bin, web, shots, renderer, at }) {
  const shot = (name) => join(shots, `${renderer}-headset-${name}.png`);
  const plain = `renderer=${renderer}&shadows=none&occlusion=none&antialias=on`;

  return [
    ['shows each eye of a headset what it sees, and goes where its wearer goes', async () => {
      const server = await startServer({ bin, web, port: await freePort(), scene: 'pillars', log: at.log, more: ['--image-size', '256', '--images', '2', '--rest', 'off'] });
      const { page, close } = await openPage(renderer, at.log, VIEWPORT);
      await page.addInitScript({ path: EMULATOR });
      await page.addInitScript(wears, [FOV_DEG, APART_M]);
      await page.goto(`${server.origin}/?${plain}&eye=0,1.6,3&target=0,1.6,-3`, { waitUntil: 'load', timeout: PATIENCE_MS });
      const before = await settled(page);
      await page.locator('#headset').click();
      await until(page, 'a headset', (now) => now.headset && now.picture);
      await page.locator('#headset', { hasText: 'Leave headset' }).waitFor({ state: 'attached' });
      // It draws on and on: what it holds is all there when no more comes.
      const complete = async () => {
        for (let updates = -1, since = Date.now(); Date.now() - since < 4000;) {
          const now = await until(page, 'a picture', (state) => state.picture);
          if (now.updates !== updates) [updates, since] = [now.updates, Date.now()];
          await page.waitForTimeout(200);
        }
      };
      await complete();
      const both = await decoded(page, await page.screenshot({ path: shot('eyes'), timeout: PATIENCE_MS }));
      const seen = [half(both, 0), half(both, 1)];
      const { pose } = await until(page, 'a pose', (now) => now.pose);
      assert.ok(Math.hypot(pose.position[0], pose.position[1] - 1.6, pose.position[2] - 3) < 0.01, `he stands where the eye was: ${pose.position}`);

      // What a page sees from where each eye is.
      const pages = [];
      for (const side of [-1, 1]) {
        const flat = await page.context().newPage();
        await flat.setViewportSize(EYE);
        const x = side * APART_M / 2;
        await flat.goto(`${server.origin}/?${plain}&eye=${x},1.6,3&target=${x},1.6,-3&fov=${FOV_DEG}`, { waitUntil: 'load', timeout: PATIENCE_MS });
        pages.push(await still(flat, shot(`flat-${pages.length}`)));
        await flat.close();
      }
      const own = [0, 1].map((eye) => difference(seen[eye], pages[eye]));
      const other = [0, 1].map((eye) => difference(seen[eye], pages[1 - eye]));
      console.log(`        ${own.map((share) => (100 * share).toFixed(2)).join(' and ')} % of its pixels are not those of a page there; ${other.map((share) => (100 * share).toFixed(2)).join(' and ')} % not those of the other eye's`);
      own.forEach((share, eye) => assert.ok(share < 0.03 && share < other[eye] / 4, `eye ${eye}`));

      // A step of half a metre ahead, to the left in the room, and a look to the right.
      await page.bringToFront();
      await page.evaluate(() => {
        window.headset.position.x -= 0.5;
        window.headset.quaternion.set(0, 0, 0, 1);
      });
      const stepped = await until(page, 'a step', (now) => Math.abs(now.pose.position[2] - 2.5) < 0.01);
      assert.ok(Math.abs(turned(stepped.pose, pose) - Math.PI / 2) < 0.01, 'a quarter turn');
      // Thumbsticks: ahead of where he looks, which is along x; and a turn to the left, by a step.
      await page.evaluate(() => window.headset.controllers.left.updateAxes('thumbstick', 0, -1));
      await until(page, 'a walk', (now) => now.pose.position[0] > stepped.pose.position[0] + 0.3);
      await page.evaluate(() => {
        window.headset.controllers.left.updateAxes('thumbstick', 0, 0);
        window.headset.controllers.right.updateAxes('thumbstick', -1, 0);
      });
      await until(page, 'a turn', (now) => Math.abs(turned(now.pose, stepped.pose) - Math.PI / 6) < 0.01);

      await page.evaluate(() => document.getElementById('headset').click());
      const after = await until(page, 'the page', (now) => !now.headset);
      await settled(page);
      const { size_px: size } = await until(page, 'a picture', (now) => now.picture);
      assert.deepEqual(size, before.size_px);
      assert.ok(turned(after.pose, stepped.pose) < Math.PI / 6 + 0.01);
      await page.locator('#headset', { hasText: /^Headset$/ }).waitFor();
      await close();
      await server.stop();
    }],
    [once('offers no headset where there is none'), async () => {
      const server = await startServer({ bin, web, port: await freePort(), scene: 'pillars', log: at.log, more: ['--image-size', '256', '--images', '2'] });
      const { page, close } = await openCoarsePage(renderer, at.log);
      await page.goto(`${server.origin}/?${plain}`, { waitUntil: 'load', timeout: PATIENCE_MS });
      await until(page, 'a picture', (now) => now.picture);
      assert.ok(await page.locator('#headset').isHidden());
      await close();
      await server.stop();
    }],
  ];
}
