// Files for pages, over the loopback: named folders and nothing outside of them.
import { createReadStream } from 'node:fs';
import { realpath, stat } from 'node:fs/promises';
import { createServer } from 'node:http';
import { extname, join, sep } from 'node:path';

/** Browsers start modules and compile WebAssembly of these types only. */
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.wasm': 'application/wasm', '.json': 'application/json' };

/** Serves `folders`, a Map from the first part of a path to a folder; it may change meanwhile. */
export async function serveFiles(folders) {
  const server = createServer(async (request, response) => {
    const path = await fileOf(folders, request.url).catch(() => null);
    if (!path) {
      response.writeHead(404).end();
      return;
    }
    response.writeHead(200, { 'content-type': TYPES[extname(path)] ?? 'application/octet-stream', 'cache-control': 'no-store' });
    createReadStream(path).on('error', () => response.destroy()).pipe(response);
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  const stop = () => new Promise((resolve) => {
    server.close(resolve);
    server.closeAllConnections();
  });
  return { origin: `http://127.0.0.1:${server.address().port}`, stop };
}

async function fileOf(folders, url) {
  const [, first, ...rest] = decodeURIComponent(new URL(url, 'http://localhost').pathname).split('/');
  const folder = await realpath(folders.get(first));
  const path = await realpath(join(folder, ...rest));
  return path.startsWith(folder + sep) && (await stat(path)).isFile() ? path : null;
}
