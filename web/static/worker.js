// Decodes updates away from the page's thread. See web/src/worker.rs, the other end.
//   comes   the page's compiled WebAssembly first, then the bytes of updates, each an ArrayBuffer
//   goes    an answer an update, an ArrayBuffer, in the same order; or words, where there will be no answers any more
import { initSync, decode } from './vantage_web.js';

onmessage = ({ data }) => {
  try {
    if (data instanceof WebAssembly.Module) {
      initSync({ module: data });
    } else {
      const { buffer } = decode(new Uint8Array(data));
      postMessage(buffer, [buffer]);
    }
  } catch (error) {
    postMessage(String(error?.message ?? error));
  }
};
