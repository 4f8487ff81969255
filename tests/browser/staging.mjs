// How a viewer has a scene put before it: parts by their names, sections, and the time of what moves.
import assert from 'node:assert/strict';
import { join } from 'node:path';
import { setTimeout as sleep } from 'node:timers/promises';
import { openCoarsePage } from './lib/browser.mjs';
import { once } from './lib/once.mjs';
import { difference } from './lib/pixels.mjs';
import { freePort, startServer } from './lib/server.mjs';
import { PATIENCE_MS, settled, still, until } from './lib/state.mjs';

/** Tests of a browser that shows by `renderer`. */
export function stagingTests({ bin, web, shots, renderer, at }) {
  const shot = (name) => join(shots, `${renderer}-staging-${name}.png`);

  const opened = async (scene, query, use) => {
    const server = await startServer({ bin, web, port: await freePort(), scene, log: at.log });
    const { page, close } = await openCoarsePage(renderer, at.log);
    const open = async (address) => {
      await page.goto(address, { waitUntil: 'load', timeout: PATIENCE_MS });
      await until(page, 'a picture', (now) => now.picture);
    };
    try {
      await open(`${server.origin}/?renderer=${renderer}&shadows=none&occlusion=none${query}`);
      await use(page, open);
    } finally {
      await close();
      await server.stop();
    }
  };

  /** A picture of the view at rest, which is the scene itself. */
  const atRest = async (page, name) => {
    // Whoever used keys sees where the focus is.
    await page.evaluate(() => document.activeElement?.blur());
    await until(page, 'the view at rest', (now) => now.at_rest);
    return still(page, shot(name));
  };
  const text = (page, id) => page.locator(`#${id}`).textContent();
  const address = async (page) => {
    await page.keyboard.press('l');
    const link = await page.locator('#share-link').inputValue();
    await page.keyboard.press('Escape');
    return link;
  };

  return [
    ['names a part, hides it, shows it alone, and says so in a link', () => opened('pillars', '', async (page, open) => {
      const whole = await atRest(page, 'whole');
      await page.locator('#parts-toggle').click();
      // What is below a pointer that rests is named.
      await page.mouse.move(480, 300);
      await page.locator('#named').waitFor();
      const below = await text(page, 'named');
      assert.ok(below.length > 0);
      await page.mouse.click(480, 300);
      await page.locator('#part-name', { hasText: below }).waitFor();
      await page.screenshot({ path: shot('chosen') });
      await page.keyboard.press('Delete');
      await page.locator('#parts-listed li', { hasText: below }).waitFor();
      await page.keyboard.press('x');
      const without = await atRest(page, 'without');
      const gone = difference(whole, without);
      console.log(`        ${below}: ${(100 * gone).toFixed(2)} % of the pixels are others without it`);
      assert.ok(gone > 0.002, `${gone}`);

      const link = await address(page);
      assert.match(link, /[?&]hide=\d+(&|$)/);
      await open(link);
      const again = difference(without, await atRest(page, 'linked'));
      assert.ok(again < 0.01, `${again} of the pixels differ`);

      await page.keyboard.press('x');
      await page.locator('#parts-all').click();
      await page.locator('#parts-kind').waitFor({ state: 'hidden' });
      await page.keyboard.press('x');
      const back = difference(whole, await atRest(page, 'back'));
      assert.ok(back < 0.01, `${back} of the pixels differ`);

      // By keys alone: the part in the middle of the picture, and nothing else.
      await page.locator('#view').focus();
      await page.keyboard.press('x');
      await page.locator('#parts').waitFor();
      await page.keyboard.press('Space');
      await page.locator('#part-only:enabled').focus();
      await page.keyboard.press('Enter');
      await page.locator('#parts-kind', { hasText: 'Shown alone' }).waitFor();
      const { samples } = await settled(page);
      await page.screenshot({ path: shot('alone') });
      assert.ok(samples > 0);
    })],
    [once('cuts the scene open'), () => opened('pillars', '', async (page, open) => {
      const whole = await atRest(page, 'uncut');
      await page.locator('#parts-toggle').click();
      await page.locator('#cut-axis').selectOption('y');
      await page.locator('#cut-at').fill('0.3');
      await settled(page);
      await page.screenshot({ path: shot('cut-panel') });
      const link = await address(page);
      assert.match(link, /[?&]cut=0,1,0,-?[\d.]+(&|$)/);
      await page.keyboard.press('x');
      const cut = await atRest(page, 'cut');
      assert.ok(difference(whole, cut) > 0.05);
      await open(link);
      await page.keyboard.press('x');
      await page.waitForFunction(() => document.getElementById('cut-axis').value === 'y');
      await page.locator('#cut-axis').selectOption('none');
      await page.keyboard.press('x');
      const closed = difference(whole, await atRest(page, 'closed'));
      assert.ok(closed < 0.01, `${closed} of the pixels differ`);
    })],
    [once('stops what moves, goes on, and goes back'), () => opened('urban-moving', '', async (page, open) => {
      const time = () => page.evaluate(() => Number.parseFloat(document.querySelector('#now').textContent));
      await page.locator('#time').waitFor();
      await page.locator('#view').focus();
      await page.keyboard.press('Space');
      await page.locator('#play', { hasText: 'Play' }).waitFor();
      const stopped = await time();
      const first = await atRest(page, 'stopped');
      const { frames } = await until(page, 'a picture', (now) => now.picture);
      await sleep(1500);
      assert.equal(await time(), stopped);
      assert.equal((await until(page, 'a picture', (now) => now.picture)).frames, frames, 'what stands is not drawn again');
      const link = await address(page);
      assert.match(link, /[?&]time=[\d.]+(&|$)/);

      // Back by the line of its time.
      await page.locator('#seek').fill('1');
      await page.locator('#now', { hasText: '1.0 s' }).waitFor();
      await until(page, 'that moment at rest', (now) => now.at_rest);
      assert.ok(difference(first, await atRest(page, 'back-in-time')) > 0.001);

      await page.locator('#rate').selectOption('4');
      await page.locator('#play').click();
      await page.locator('#play', { hasText: 'Pause' }).waitFor();
      const [begin, from] = [Date.now(), await time()];
      await sleep(2000);
      const rate = (await time() - from) / ((Date.now() - begin) / 1000);
      assert.ok(rate > 3 && rate < 5, `${rate} times as fast`);

      await open(link);
      await page.locator('#play', { hasText: 'Play' }).waitFor();
      assert.equal(await time(), stopped);
      const linked = difference(first, await atRest(page, 'linked-time'));
      assert.ok(linked < 0.01, `${linked} of the pixels differ`);
    })],
    [once('has no time line where nothing moves'), () => opened('pillars', '', async (page) => {
      await sleep(500);
      assert.ok(await page.locator('#time').isHidden());
    })],
  ];
}
