// The cases of report `stability` that stand still, as the web client shows them, beside the native client's pictures of the same servers.
//
// `cargo xtask stiff` builds what it needs and runs it.
//
//   VANTAGE_REPORT_BIN   the binary of reports, which offers the cases
//   VANTAGE_WEB_DIR      the built web client
//   node stiff.mjs [--only WORDS]... [--out DIR] [webgpu|webgl2]...
//
// A line a case and renderer: the share of the pixels that differ by more than 1 and by more than 8 of 255. Both clients are sent what a server of their own finds them to lack,
// and outlines end where a rasterizer rounds them to, so a few pixels may differ by all. What moves is not offered, and named.
// The last line is `N held, N did not, N cases were not offered`; it exits with 1 where one did not.
import { spawn } from 'node:child_process';
import { mkdir, readFile } from 'node:fs/promises';
import { join, resolve } from 'node:path';
import { createInterface } from 'node:readline';
import { parseArgs } from 'node:util';
import { openPage } from './lib/browser.mjs';
import { decoded, difference } from './lib/pixels.mjs';
import { freePort } from './lib/server.mjs';
import { PATIENCE_MS, still } from './lib/state.mjs';

/** The share of the pixels that may differ by more than 8 of 255: those along outlines. */
const MOST = 0.01;

const { values, positionals } = parseArgs({
  allowPositionals: true,
  options: { only: { type: 'string', multiple: true, default: [] }, out: { type: 'string', default: 'stiff' } },
});
const { VANTAGE_REPORT_BIN: bin, VANTAGE_WEB_DIR: web } = process.env;
if (!bin || !web) {
  console.error('VANTAGE_REPORT_BIN and VANTAGE_WEB_DIR must name the binary of reports and the built web client');
  process.exit(2);
}
const out = resolve(values.out);
await mkdir(out, { recursive: true });

const said = [];
const browsers = await Promise.all((positionals.length > 0 ? positionals : ['webgpu', 'webgl2']).map(async (renderer) => (
  { renderer, ...await openPage(renderer, (line) => said.push(`${renderer} ${line}`), { width: 400, height: 250 }) }
)));
const port = await freePort();
const only = values.only.flatMap((words) => ['--only', words]);
const offering = spawn(bin, ['stability', '--offer', `${port}`, '--web', web, '--out', out, ...only], { stdio: ['pipe', 'pipe', 'inherit'] });
const tally = { held: 0, not: 0, left: 0 };
for await (const line of createInterface({ input: offering.stdout })) {
  if (line.startsWith('not offered: ')) {
    tally.left += 1;
    console.log(line);
  }
  if (!line.startsWith('{')) continue;
  const { case: name, place, picture } = JSON.parse(line);
  const [{ page: helper }] = browsers;
  const native = await decoded(helper, await readFile(picture));
  for (const { renderer, page: first } of browsers) {
    const page = await first.context().newPage();
    await page.setViewportSize({ width: 400, height: 250 });
    const from = said.length;
    let told;
    try {
      await page.goto(`http://127.0.0.1:${port}/?renderer=${renderer}&antialias=off&fov=60&shadows=maps&occlusion=none`, { waitUntil: 'load', timeout: PATIENCE_MS });
      const shown = await still(page, join(out, `${String(place).padStart(2, '0')}-${renderer}.png`));
      const shares = [1, 8].map((most) => difference(native, shown, most));
      told = [shares[1] <= MOST, shares.map((share) => `${(100 * share).toFixed(3)} %`).join(', ')];
    } catch (error) {
      told = [false, `${error.message}\n${said.slice(from).join('\n')}`];
    }
    tally[told[0] ? 'held' : 'not'] += 1;
    console.log(`${told[0] ? 'ok     ' : 'FAILED '} ${renderer}: ${name}: ${told[1]}`);
    await page.close();
  }
  offering.stdin.write('\n');
}
await Promise.all(browsers.map(({ close }) => close()));
console.log(`${tally.held} held, ${tally.not} did not, ${tally.left} cases were not offered`);
process.exit(tally.not > 0 || tally.held === 0 ? 1 : 0);
