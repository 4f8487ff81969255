// A relay before a server, whose network can go away.
import { connect, createServer } from 'node:net';

/** Passes connections on to a port of this machine. `freeze` lets nothing through any more, and closes nothing; `thaw` lets new connections through. */
export async function startRelay(target) {
  let frozen = false;
  const open = new Set();
  const relay = createServer((socket) => {
    const ends = [socket];
    open.add(socket);
    socket.on('error', () => {});
    socket.on('close', () => { open.delete(socket); ends.forEach((end) => end.destroy()); });
    if (frozen) return;
    const other = connect(target, '127.0.0.1');
    ends.push(other);
    open.add(other);
    other.on('error', () => {});
    other.on('close', () => { open.delete(other); if (!frozen) socket.destroy(); });
    socket.pipe(other).pipe(socket);
  });
  await new Promise((resolve) => relay.listen(0, '127.0.0.1', resolve));
  const each = (act) => open.forEach(act);
  return {
    origin: `http://127.0.0.1:${relay.address().port}`,
    freeze: () => { frozen = true; each((socket) => { socket.unpipe(); socket.pause(); }); },
    thaw: () => { frozen = false; },
    stop: () => { relay.close(); each((socket) => socket.destroy()); },
  };
}
