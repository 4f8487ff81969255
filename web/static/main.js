// Starts the viewer, and says in words why it could not. What is seen and how one moves is in vantage_web.js and its WebAssembly; the dialogs of scenes and of
// sharing have scripts of their own.
import init, { start, snapshot, lose_device } from './vantage_web.js';
import { byId } from './elements.js';
import { offerEmbedding, tellFailure } from './embed.js';
import { offerHeadset } from './headset.js';
import { offerScenes } from './scenes.js';
import { offerSharing } from './share.js';
import { offerStaging } from './staging.js';
import { say, sayPage } from './words.js';

function fail(text, detail) {
  byId('loading').hidden = false;
  byId('loading-text').textContent = say(text);
  byId('loading-detail').textContent = detail ?? '';
  byId('progress').hidden = true;
  tellFailure(detail ? `${text}: ${detail}` : text);
}

// What the page is doing, for tests and for the curious: `window.vantage` is a fresh plain object at every look.
//   frames      pictures drawn since the page was loaded
//   samples     samples held
//   updates     updates applied in this session
//   uncovered   share of the picture that no sample covers, null before it is known
//   age_ms      scene time now less scene time shown, null before the first picture
//   status      what is wrong, as the page shows it, or an empty string
//   picture     whether a picture of the scene has been drawn
//   renderer    'webgpu' or 'webgl2'
//   adapter     the adapter's name
//   mode        'walk' or 'turn'
//   pose        { position: [x, y, z], quaternion: [x, y, z, w] } of the drawn eye
//   background  what is shown where there is nothing: three sRGB bytes, null before it is known
//   at_rest     whether the view of an eye that stands still is there as a whole: then it is shown pixel by pixel
//   headset     whether one is worn
//   decoder     where updates are decoded: 'worker', or 'page' where the browser gives no worker or it died
//   stats       the figures of the panel
//   device_losses   how often the graphics device was lost and made anew
//   lose_device()   loses it on purpose
let running = false;
Object.defineProperty(window, 'vantage', {
  get: () => ({ ...(running ? JSON.parse(snapshot()) : { frames: 0, status: 'loading', picture: false }), lose_device }),
});

// The WebAssembly says its words by it, too.
window.vantageSays = say;
sayPage();
offerEmbedding();
document.documentElement.classList.toggle('bare', new URLSearchParams(location.search).has('bare'));

try {
  await init({ module_or_path: new URL('./vantage_web_bg.wasm', import.meta.url) });
} catch (error) {
  // Whatever does not compile asks for what the browser does not have yet.
  const old = error instanceof WebAssembly.CompileError ? ' (Chrome 91, Firefox 89, Safari 16.4 or newer is needed)' : '';
  fail('The viewer could not be loaded', String(error?.message ?? error) + old);
  throw error;
}
try {
  await start();
  running = true;
  offerSharing();
  offerStaging();
  offerScenes();
  void offerHeadset();
} catch (error) {
  fail('The viewer could not start', String(error?.message ?? error));
  throw error;
}
