// What the viewer's page is doing, and waiting for it.
import { setTimeout as sleep } from 'node:timers/promises';
import { canvasPixels } from './pixels.mjs';

/** Software drawing stalls for seconds at times: every wait has room, and every assertion is on content. */
export const PATIENCE_MS = 120_000;
/** A picture into which frames still come after so many looks will not be still. */
const LOOKS = 60;
/** Nothing is drawn for so long: longer than the server needs for a look on a busy machine. */
const QUIET_MS = 2500;
/** Where all that the view shows is there: what may still come is hidden from it. */
const QUIET_AT_REST_MS = 1200;

/** Waits until `ready(window.vantage)` is true, and returns that state. */
export async function until(page, what, ready, patienceMs = PATIENCE_MS) {
  const giveUp = Date.now() + patienceMs;
  let state;
  for (;;) {
    state = await page.evaluate(() => JSON.parse(JSON.stringify(window.vantage ?? null)));
    if (state && ready(state)) return state;
    if (Date.now() > giveUp) throw new Error(`waited in vain for ${what}; last: ${JSON.stringify(state)}`);
    await sleep(100);
  }
}

/** Whether no more of a lamp's points are to come. */
const isAllSoft = ({ soft_points: points }) => !points || points[0] === points[1];

/** Waits until nothing was drawn for a while. */
export async function settled(page) {
  const giveUp = Date.now() + PATIENCE_MS;
  let [state, since] = [null, Date.now()];
  for (;;) {
    const next = await until(page, 'a picture', (now) => now.picture);
    if (next.frames !== state?.frames || next.updates !== state.updates || !isAllSoft(next)) since = Date.now();
    state = next;
    if (Date.now() - since >= (state.at_rest ? QUIET_AT_REST_MS : QUIET_MS)) return state;
    if (Date.now() > giveUp) throw new Error(`frames do not end; last: ${JSON.stringify(state)}`);
    await sleep(100);
  }
}

/** The picture once it is settled, kept at `path`. One that a frame came into, as by an update that took the server long, is taken again. */
export async function still(page, path) {
  for (let look = 0; look < LOOKS; look += 1) {
    const before = await settled(page);
    const picture = await canvasPixels(page, path);
    const after = await until(page, 'a picture', (now) => now.picture);
    if (after.frames === before.frames) return picture;
  }
  throw new Error(`a frame came into every picture at ${path}`);
}

/** The angle between two poses, in radians. */
export const turned = (a, b) => 2 * Math.acos(Math.min(1, Math.abs(a.quaternion.reduce((s, x, i) => s + x * b.quaternion[i], 0))));
