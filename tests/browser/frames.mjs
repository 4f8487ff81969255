// How often a page shows a picture while somebody walks, beside a server on the same machine.
//
// `cargo xtask frames` builds what it needs and runs it.
//
//   VANTAGE_SERVER_BIN   the server's binary
//   VANTAGE_WEB_DIR      the built web client
//   node frames.mjs [--scene NAME] [--size 960x600] [--seconds 15] [--query '&antialias=off'] [webgpu|webgl2|auto]...
//
// A line a renderer: pictures a second, the intervals between them in milliseconds, and how fine the page drew them, second by second. The page walks by keys that are
// held down. 'auto' takes what the page takes by itself.
//
// --slow also lists intervals of more than 200 ms, with the tasks of the page's thread that took more than 50 ms meanwhile; --shot PATH takes a picture of the page.
import { writeFile } from 'node:fs/promises';
import { parseArgs } from 'node:util';
import { openPage } from './lib/browser.mjs';
import { freePort, startServer } from './lib/server.mjs';
import { PATIENCE_MS, until } from './lib/state.mjs';

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: {
    scene: { type: 'string', default: 'pillars' },
    size: { type: 'string', default: '960x600' },
    seconds: { type: 'string', default: '15' },
    query: { type: 'string', default: '' },
    shot: { type: 'string' },
    json: { type: 'string' },
    slow: { type: 'boolean', default: false },
  },
});
const [width, height] = values.size.split('x').map(Number);
const seconds = Number(values.seconds);
const quiet = () => {};

/** In the page: when each picture was drawn, in milliseconds. */
function recordFrames() {
  window.drawnAt = [];
  window.longTasks = [];
  new PerformanceObserver((list) => list.getEntries().forEach(({ startTime, duration }) => window.longTasks.push([startTime, duration]))).observe({ type: 'longtask' });
  let last = window.vantage.frames;
  const look = (now) => {
    const { frames } = window.vantage;
    if (frames !== last) window.drawnAt.push(now);
    last = frames;
    requestAnimationFrame(look);
  };
  requestAnimationFrame(look);
}

const quantile = (sorted, share) => sorted[Math.min(sorted.length - 1, Math.floor(share * sorted.length))];

async function measure(renderer) {
  const bin = process.env.VANTAGE_SERVER_BIN;
  const web = process.env.VANTAGE_WEB_DIR;
  const server = await startServer({ bin, web, port: await freePort(), scene: values.scene, log: quiet, more: [] });
  const { page, close } = await openPage(renderer === 'auto' ? 'webgpu' : renderer, quiet, { width, height });
  try {
    await page.goto(`${server.origin}/?${renderer === 'auto' ? '' : `renderer=${renderer}`}${values.query}`, { waitUntil: 'load', timeout: PATIENCE_MS });
    await until(page, 'a picture', (now) => now.picture);
    await page.locator('canvas').click({ position: { x: 5, y: height - 5 } });
    // To the left and forward in turn: a walk that stays in a room.
    const keys = ['ArrowLeft', 'KeyW'];
    await page.evaluate(recordFrames);
    const begin = Date.now();
    const shares = [];
    while (Date.now() - begin < seconds * 1e3) {
      const key = keys[shares.length % keys.length];
      await page.keyboard.down(key);
      await page.waitForTimeout(1000);
      await page.keyboard.up(key);
      shares.push(await page.evaluate(() => window.vantage.resolution ?? null));
    }
    if (values.shot) await page.screenshot({ caret: 'initial', path: `${values.shot}-${renderer}-moving.png` });
    const drawnAt = await page.evaluate(() => window.drawnAt);
    const state = await page.evaluate(() => JSON.parse(JSON.stringify(window.vantage)));
    const tasks = await page.evaluate(() => window.longTasks);
    if (values.slow) {
      drawnAt.slice(1).forEach((at, i) => {
        const ms = at - drawnAt[i];
        const within = tasks.filter(([start, took]) => start + took > drawnAt[i] && start < at).map(([, took]) => took);
        if (ms > 200) console.log(`at ${Math.round(at - drawnAt[0])}: ${Math.round(ms)} ms, tasks ${within.map(Math.round)}`);
      });
    }
    const intervals = drawnAt.slice(1).map((at, i) => at - drawnAt[i]).sort((a, b) => a - b);
    const span = (drawnAt.at(-1) - drawnAt[0]) / 1e3;
    return {
      renderer: state.renderer, scene: values.scene, size: values.size, frames: drawnAt.length, fps: intervals.length / span,
      median_ms: quantile(intervals, 0.5), p99_ms: quantile(intervals, 0.99), longest_ms: intervals.at(-1),
      age_ms: state.age_ms, samples: state.samples, updates: state.updates, resolution: shares,
    };
  } finally {
    await close();
    await server.stop();
  }
}

const found = [];
for (const renderer of positionals.length > 0 ? positionals : ['webgpu', 'webgl2']) {
  const row = await measure(renderer);
  found.push(row);
  console.log(Object.entries(row).map(([name, value]) => `${name} ${typeof value === 'number' ? Math.round(value * 10) / 10 : value}`).join(', '));
}
if (values.json) await writeFile(values.json, `${JSON.stringify(found, null, 1)}\n`);
