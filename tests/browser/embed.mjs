// The viewer as an element of a page of somebody else, which has a policy of its own: two on one page, what can be asked of them, and that nothing is left of those that are removed.
import assert from 'node:assert/strict';
import { readFile } from 'node:fs/promises';
import { createServer } from 'node:http';
import { join } from 'node:path';
import { openCoarsePage } from './lib/browser.mjs';
import { once } from './lib/once.mjs';
import { contrast, decoded } from './lib/pixels.mjs';
import { freePort, startServer } from './lib/server.mjs';
import { PATIENCE_MS } from './lib/state.mjs';

/** How often an element is removed and added again; every tenth time it shows a picture. */
const ROUNDS = 50;
/** What has grown by no more than this share between the twentieth round and the last has not grown: a browser keeps something of the first ones. */
const GROWTH = 1.05;

/** What a notebook loads of its widget: the element, and what is around it there. */
const widget = async () => (await Promise.all(['../../web/static/vantage-view.js', '../../packaging/python/vantage_view/widget.js']
  .map((path) => readFile(new URL(path, import.meta.url), 'utf8')))).join('\n');

/** Serves a page with a policy that lets in nothing but what its elements need of a server. */
async function startForeigner(server) {
  const policy = `default-src 'none'; script-src 'self' ${server}; frame-src ${server}; base-uri 'none'`;
  const files = {
    '/': ['text/html', '<!doctype html><html lang="en"><title>Somebody</title><script type="module" src="/page.js"></script><h1>A page of somebody</h1>'],
    '/page.js': ['text/javascript', `import '${server}/vantage-view.js'; window.wrong = []; document.addEventListener('securitypolicyviolation', (event) => window.wrong.push(event.violatedDirective));`],
  };
  files['/widget.js'] = ['text/javascript', await widget()];
  const foreigner = createServer((request, response) => {
    const [type, text] = files[request.url] ?? [];
    response.writeHead(type ? 200 : 404, { 'content-type': type ?? 'text/plain', 'content-security-policy': policy });
    response.end(text);
  });
  await new Promise((resolve) => foreigner.listen(0, '127.0.0.1', resolve));
  return { origin: `http://127.0.0.1:${foreigner.address().port}`, stop: () => foreigner.close() };
}

/** In the page: an element with attributes, once what it says has happened. */
const added = (page, attributes, event) => page.evaluate(([given, name]) => {
  const view = document.createElement('vantage-view');
  Object.entries(given).forEach(([key, value]) => view.setAttribute(key, value));
  const said = new Promise((resolve, reject) => {
    view.addEventListener(name, ({ detail }) => resolve(detail ?? null), { once: true });
    view.addEventListener('error', ({ detail }) => reject(new Error(detail)), { once: true });
  });
  document.body.append(view);
  return said;
}, [attributes, event]);

/** Bytes of all processes of a browser. */
async function residentBytes(context) {
  const session = await context.browser()?.newBrowserCDPSession();
  const { processInfo } = await session.send('SystemInfo.getProcessInfo');
  await session.detach();
  const pages = await Promise.all(processInfo.map(({ id }) => readFile(`/proc/${id}/statm`, 'utf8').catch(() => '0 0')));
  return pages.reduce((sum, text) => sum + 4096 * Number(text.split(' ')[1]), 0);
}

/** What a page holds, once what is of no use any more is given back. */
async function holdings(page) {
  const session = await page.context().newCDPSession(page);
  for (let time = 0; time < 3; time += 1) await session.send('HeapProfiler.collectGarbage');
  const { documents, nodes, jsEventListeners } = await session.send('Memory.getDOMCounters');
  const { usedSize } = await session.send('Runtime.getHeapUsage');
  await session.detach();
  return { documents, nodes, jsEventListeners, heap: usedSize };
}

/** Tests of a browser that shows by `renderer`. */
export function embedTests({ bin, web, shots, renderer, at }) {
  const shot = (name) => join(shots, `${renderer}-embed-${name}.png`);
  const plain = { renderer, shadows: 'none', occlusion: 'none' };

  const opened = async (use, log = at.log) => {
    const server = await startServer({ bin, web, port: await freePort(), scene: 'pillars', log: at.log });
    const foreigner = await startForeigner(server.origin);
    const { page, close } = await openCoarsePage(renderer, log, { width: 640, height: 900 });
    try {
      await page.goto(foreigner.origin, { waitUntil: 'load', timeout: PATIENCE_MS });
      await page.waitForFunction(() => customElements.get('vantage-view'));
      await use(page, server);
    } finally {
      await close();
      foreigner.stop();
      await server.stop();
    }
  };

  return [
    ['is an element of a page of somebody else, twice, under its policy', () => opened(async (page, server) => {
      const src = server.origin.replace('http', 'ws');
      await added(page, { ...plain, src: `${src}/ws`, bare: '', id: 'one' }, 'ready');
      await added(page, { ...plain, src, id: 'two', eye: '0,1.6,2', target: '0,1.6,0' }, 'ready');
      await page.screenshot({ path: shot('two') });
      const state = await page.evaluate(() => document.getElementById('two').state);
      assert.deepEqual(state.pose.position.map((metres) => Number(metres.toFixed(3))), [0, 1.6, 2]);
      assert.equal(state.scene, 'pillars');
      assert.equal(state.status, '');
      assert.ok(state.connected && state.samples > 1000, JSON.stringify(state));
      // One is led somewhere; the other stays.
      await page.evaluate(() => document.getElementById('one').goTo({ eye: [1, 1.6, 1], target: [0, 1.5, 0] }));
      await page.waitForFunction(() => {
        const { pose: { position: [x, , z] } } = document.getElementById('one').state;
        return Math.hypot(x - 1, z - 1) < 0.01;
      });
      assert.deepEqual(await page.evaluate(() => document.getElementById('two').state.pose), state.pose);
      const link = new URL(await page.evaluate(() => document.getElementById('one').link()));
      const [x, y, z] = link.searchParams.get('eye').split(',').map(Number);
      assert.ok(Math.hypot(x - 1, y - 1.6, z - 1) < 0.01 && link.origin === server.origin && !link.searchParams.has('bare'), link.href);
      const text = await page.evaluate(async () => {
        const file = await document.getElementById('one').picture({ width: 320, height: 200 });
        const bytes = new Uint8Array(await file.arrayBuffer());
        return btoa(bytes.reduce((text, byte) => text + String.fromCharCode(byte), ''));
      });
      const picture = await decoded(page, Buffer.from(text, 'base64'));
      assert.deepEqual([picture.width, picture.height], [320, 200]);
      assert.ok(contrast(picture) > 50, 'it shows nothing');
      const staged = await page.evaluate(async () => {
        const one = document.getElementById('one');
        await one.hide(3, 1);
        await one.cut({ normal: [0, 2, 0], offset: 1.5 });
        const before = await one.staging();
        await one.hide();
        await one.cut();
        return [before, await one.staging(), await one.cut({ normal: [0, 0, 0] }).catch(({ message }) => message)];
      });
      assert.deepEqual(staged[0].objects.map(({ object }) => object), [1, 3]);
      assert.deepEqual([staged[0].which, staged[0].section, staged[0].motion], ['but', { normal: [0, 1, 0], offset: 1.5 }, 'still']);
      assert.deepEqual([staged[1].which, staged[1].section], ['all', null]);
      assert.match(staged[2], /points somewhere/);
      const refused = await page.evaluate(() => document.getElementById('one').goTo({ eye: [1, 1], target: [0, 0, 0] }).catch(({ message }) => message));
      assert.match(refused, /eye: three numbers/);
      await page.screenshot({ path: shot('led') });
      assert.deepEqual(await page.evaluate(() => window.wrong), [], 'the page refuses what the element needs');
    })],
    [once('is a widget of a notebook, which leads it and saves what it shows'), () => opened(async (page, server) => {
      await page.evaluate(async ({ src, given }) => {
        const { default: { render } } = await import('/widget.js');
        const heard = {};
        window.model = {
          values: { ...given, src, height_px: 300, bare: true, eye: [0, 1.6, 2], target: [0, 1.6, 0] },
          sent: [],
          get(name) { return this.values[name]; },
          set(name, value) { this.values[name] = value; },
          save_changes() {},
          on: (name, hear) => { heard[name] = hear; },
          off: (name) => { delete heard[name]; },
          send: (message, _, buffers) => window.model.sent.push({ ...message, bytes: buffers?.[0].byteLength }),
          say: (message) => heard['msg:custom'](message),
          heard,
        };
        window.leave = render({ model: window.model, el: document.body });
      }, { src: server.origin.replace('http', 'ws'), given: { renderer } });
      await page.waitForFunction(() => window.model.values.state?.picture, undefined, { timeout: PATIENCE_MS });
      assert.equal(await page.evaluate(() => document.querySelector('vantage-view').clientHeight), 300);
      assert.deepEqual(await page.evaluate(() => window.model.values.state.pose.position), [0, 1.6, 2]);
      await page.evaluate(() => window.model.say({ ask: 'goTo', eye: [1, 1.6, 1], target: [0, 1.5, 0] }));
      await page.waitForFunction(() => Math.abs(window.model.values.state.pose.position[0] - 1) < 0.01);
      await page.evaluate(() => window.model.say({ ask: 'picture', number: 7, width: 320, height: 200 }));
      await page.waitForFunction(() => window.model.sent.length > 0, undefined, { timeout: PATIENCE_MS });
      const [{ number, bytes }] = await page.evaluate(() => window.model.sent);
      assert.ok(number === 7 && bytes > 1000, `${bytes} bytes of ${number}`);
      await page.evaluate(() => window.leave());
      assert.deepEqual(await page.evaluate(() => [document.querySelectorAll('vantage-view').length, Object.keys(window.model.heard).length]), [0, 0]);
    })],
    [once('says why it shows nothing'), () => opened(async (page, server) => {
      await page.clock.install();
      const nobody = `ws://127.0.0.1:${await freePort()}/ws`;
      const failed = added(page, { ...plain, src: nobody }, 'ready').catch(({ message }) => message);
      await page.waitForFunction(() => document.querySelector('vantage-view').shadowRoot.querySelector('iframe'));
      await page.clock.fastForward(31_000);
      assert.match(await failed, /does not answer, or does not let .* frame it \(--allow-origin\)/);
      await page.clock.resume();
      const address = await added(page, { ...plain, src: 'ftp://somewhere' }, 'ready').catch(({ message }) => message);
      assert.match(address, /begins with wss:/);
      // What is asked for where nothing is shown is answered, too.
      const refused = await page.evaluate(async () => {
        const view = document.createElement('vantage-view');
        document.body.append(view);
        return view.link().catch(({ message }) => message);
      });
      assert.match(refused, /shows nothing/);
      const wish = await added(page, { ...plain, src: server.origin, mode: 'swim' }, 'ready').catch(({ message }) => message);
      assert.match(wish, /use walk or turn/);
      // What is refused on purpose the browser says as well.
    }, (line) => /Framing|use walk or turn/.test(line) || at.log(line))],
    ['leaves nothing behind when it is removed, fifty times', () => opened(async (page, server) => {
      const remove = () => page.evaluate(() => document.querySelector('vantage-view').remove());
      const seen = [];
      for (let round = 1; round <= ROUNDS; round += 1) {
        await added(page, { ...plain, src: server.origin, bare: '' }, round % 10 === 0 ? 'ready' : 'change');
        await page.waitForFunction(() => document.querySelector('vantage-view').state.connected, undefined, { timeout: PATIENCE_MS });
        await remove();
        if (round % 10 === 0) seen.push({ ...await holdings(page), resident: await residentBytes(page.context()) });
      }
      const [first, last] = [seen[1], seen.at(-1)];
      console.log(`        after 20 and after ${ROUNDS}: ${[first, last].map(({ heap, resident }) => `${(heap / 1e6).toFixed(2)} MB of scripts, ${(resident / 1e6).toFixed(0)} MB in all`).join('; ')}`);
      for (const name of ['documents', 'nodes', 'jsEventListeners']) assert.ok(last[name] <= first[name], `${name}: ${seen.map((one) => one[name])}`);
      // What stays is there at the end and ten rounds before it; what is not yet collected is not.
      for (const name of ['heap', 'resident']) {
        const stays = Math.min(...seen.slice(-2).map((one) => one[name]));
        assert.ok(stays <= GROWTH * first[name], `${name}: ${seen.map((one) => one[name])}`);
      }
      const health = await (await fetch(`${server.origin}/healthz`)).json();
      assert.equal(health.clients, 0, 'sessions of elements that are gone');
    })],
  ];
}
