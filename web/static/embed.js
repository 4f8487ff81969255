// What a page that frames this one asks of it, through its element (vantage-view.js), and what it is told. The server says who may frame the page, so whoever does may ask.
import { cut, go, link, photo, play, seek, show_parts as showParts, staged } from './vantage_web.js';
import { byId, pngOf } from './elements.js';

const GREETING = 'vantage-view';
const TELL_INTERVAL_MS = 100;

/** What others are told of what is shown: words and numbers that stay, whatever becomes of the page's own. */
function state() {
  const { picture, connected, status, pose, mode, at_rest: atRest, samples, stats } = window.vantage;
  return { picture, connected: connected ?? false, status, scene: stats?.scene ?? '', pose: pose ?? null, mode: mode ?? null, atRest: atRest ?? false, samples: samples ?? 0,
    picturesPerSecond: stats?.fps ?? 0, megabitPerSecond: stats?.mbit_per_s ?? 0 };
}

const answers = {
  go: ({ eye, target }) => go(Float64Array.from(eye), Float64Array.from(target)),
  link: () => {
    const url = new URL(link());
    url.searchParams.delete('bare');
    return url.href;
  },
  play: ({ rate }) => play(rate),
  seek: ({ time }) => seek(time),
  parts: ({ which, objects }) => {
    const wrong = objects.find((object) => !Number.isInteger(object) || object < 0 || object > 65_535);
    if (wrong !== undefined) throw new Error(`${wrong} is no number of an object`);
    showParts(which, Uint16Array.from(objects));
  },
  cut: ({ normal, offset }) => cut(Float64Array.from(normal), offset),
  staging: () => {
    const { motion, period_s: period, time_s: time, rate, parts: which, objects, section } = JSON.parse(staged());
    return { motion, period, time, rate, which, objects, section: section && { normal: section[0], offset: section[1] } };
  },
  picture: ({ width, height }) => {
    const view = byId('view');
    return pngOf(photo, width ?? view.width, height ?? view.height);
  },
};

/** Until there is a picture: what is asked for sooner waits. */
async function shown() {
  while (!window.vantage.picture) {
    if (failed !== null) throw new Error(failed);
    await new Promise((resolve) => { setTimeout(resolve, TELL_INTERVAL_MS); });
  }
}

async function answer(port, message) {
  const { ask, number } = message ?? {};
  try {
    if (!Object.hasOwn(answers, ask)) throw new Error(`${ask} is nothing that can be asked for`);
    await shown();
    port.postMessage({ tell: 'answer', number, value: await answers[ask](message) });
  } catch (error) {
    port.postMessage({ tell: 'refusal', number, text: String(error?.message ?? error) });
  }
}

let told = '';
let failed = null;
let port = null;

function tell() {
  let now;
  try {
    now = state();
  } catch (error) {
    // It ended by a fault of its own, and tells nothing any more.
    tellFailure(`the viewer stopped: ${error?.message ?? error}`);
    return;
  }
  const text = JSON.stringify(now);
  if (text === told) return;
  told = text;
  port.postMessage({ tell: 'state', state: now });
}

/** Says that this page shows nothing, and why. */
export function tellFailure(text) {
  failed = text;
  port?.postMessage({ tell: 'failed', text });
}

/** Greets the page around this one, if there is one that listens. */
export function offerEmbedding() {
  if (window.parent === window) return;
  window.addEventListener('message', ({ source, data, ports: [given] }) => {
    if (source !== window.parent || data !== GREETING || !given) return;
    port?.close();
    port = given;
    port.onmessage = ({ data: message }) => answer(given, message);
    if (failed !== null) return tellFailure(failed);
    told = '';
    tell();
  });
  setInterval(() => port && failed === null && tell(), TELL_INTERVAL_MS);
  // Its element was there before this page, which it made. There is nothing in this that others might not read.
  window.parent.postMessage(GREETING, '*');
}
