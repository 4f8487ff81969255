// A vantage-server process.
import { spawn } from 'node:child_process';
import { createServer } from 'node:net';
import { setTimeout as sleep } from 'node:timers/promises';

/** A port that was free a moment ago. */
export async function freePort() {
  const server = createServer();
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  const { port } = server.address();
  await new Promise((resolve) => server.close(resolve));
  return port;
}

/** Starts a server and waits until it answers. It looks ahead for nobody: a picture is settled once what is in view is there, and a software renderer is slow
 * enough without. `more`: arguments beside these, by default small images. */
export async function startServer({ bin, web, port, scene, log, more = ['--image-size', '256', '--images', '2'] }) {
  const args = [scene, '--port', `${port}`, '--web', web, '--anticipation', 'off', ...more];
  const child = spawn(bin, args, { stdio: ['ignore', 'pipe', 'pipe'] });
  for (const stream of [child.stdout, child.stderr]) {
    stream.setEncoding('utf8');
    stream.on('data', (text) => log(`server: ${text.trimEnd()}`));
  }
  const exited = new Promise((resolve) => child.once('exit', resolve));
  child.once('error', (error) => log(`server: ${error.message}`));
  const origin = `http://127.0.0.1:${port}`;
  const giveUp = Date.now() + 120_000;
  for (;;) {
    if (child.exitCode !== null || child.signalCode !== null || child.pid === undefined) {
      throw new Error(`the server ended at once (${child.exitCode ?? child.signalCode ?? 'not started'})`);
    }
    const answer = await fetch(`${origin}/healthz`).catch(() => null);
    if (answer?.ok) break;
    if (Date.now() > giveUp) {
      child.kill('SIGKILL');
      throw new Error('the server did not answer within two minutes');
    }
    await sleep(100);
  }
  const stop = async (signal = 'SIGTERM') => {
    child.kill(signal);
    const late = setTimeout(() => child.kill('SIGKILL'), 15_000);
    await exited;
    clearTimeout(late);
  };
  return { origin, stop };
}

