// How fast the browser client's WebAssembly decodes, on one thread:
//   vantage-report codec --quick --write-updates --out DIR
//   node bench/wasm-decode.mjs target/web/web DIR
// MB/s count raw bytes, as the report does; medians. The client says itself what decoding took, without handing the update over.
import { readFile } from 'node:fs/promises';
import { join } from 'node:path';

const [web, updates] = process.argv.slice(2);
if (!updates) {
  console.error('usage: node bench/wasm-decode.mjs WEB_DIR UPDATES_DIR');
  process.exit(2);
}
const REPEATS = 15;
// A module whatever node makes of its name.
const script = await readFile(join(web, 'vantage_web.js'));
const { initSync, decode } = await import(`data:text/javascript;base64,${script.toString('base64')}`);
initSync({ module: await readFile(join(web, 'vantage_web_bg.wasm')) });

let rawBytes = 0;
let sumMs = 0;
for (const { file, raw_bytes } of JSON.parse(await readFile(join(updates, 'updates.json'), 'utf8'))) {
  const bytes = new Uint8Array(await readFile(join(updates, file)));
  const times = [];
  for (let run = 0; run <= REPEATS; run++) {
    // 0: without surfaces.
    const answer = new Uint8Array(decode(bytes, 0)[0]);
    if (answer[0] !== 1) throw new Error(`${file}: ${new TextDecoder().decode(answer.subarray(9))}`);
    times.push(new DataView(answer.buffer, answer.byteOffset).getFloat64(1, true));
  }
  times.shift(); // warms up
  times.sort((a, b) => a - b);
  const ms = times[REPEATS >> 1];
  rawBytes += raw_bytes;
  sumMs += ms;
  console.log(`${file.padEnd(40)} ${(raw_bytes / ms / 1000).toFixed(0).padStart(5)} MB/s`);
}
console.log(`${'all'.padEnd(40)} ${(rawBytes / sumMs / 1000).toFixed(0).padStart(5)} MB/s`);
