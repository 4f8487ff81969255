// Decodes updates and builds their surfaces, away from the page's thread. See web/src/worker.rs, the other end.
//   comes   the page's compiled WebAssembly first, then the bytes of updates, each an ArrayBuffer with the code of how to build surfaces
//   goes    an answer an update, ArrayBuffers, in the same order; or words, where there will be no answers any more
import { initSync, decode } from './vantage_web.js';

onmessage = ({ data }) => {
  try {
    if (data instanceof WebAssembly.Module) {
      initSync({ module: data });
    } else {
      const [bytes, build] = data;
      const parts = decode(new Uint8Array(bytes), build);
      postMessage(parts, parts);
    }
  } catch (error) {
    postMessage(String(error?.message ?? error));
  }
};
