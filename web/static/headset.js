// Looking around in a headset, where the browser has WebXR and one is there. The viewer draws each eye onto the page's canvas; from there it is copied to the headset's own, which takes
// nothing of WebGPU's. Thumbsticks: the left one goes, the right one turns by steps and goes up and down.
import { look, put_on as putOn, show_eye as showEye, take_off as takeOff } from './vantage_web.js';
import { byId } from './elements.js';
import { say } from './words.js';

const KIND = 'immersive-vr';
/** Thumbsticks at rest are off their middle by as much. */
const AT_REST = 0.15;
/** For how long it is said that there was none. */
const SAID_MS = 5000;

let session;

/** Copies a canvas to a part of a framebuffer, stretched over it. */
function copier(gl) {
  const shader = (kind, text) => {
    const made = gl.createShader(kind);
    gl.shaderSource(made, `#version 300 es\n${text}`);
    gl.compileShader(made);
    return made;
  };
  const program = gl.createProgram();
  gl.attachShader(program, shader(gl.VERTEX_SHADER, `out vec2 at; void main() {
    at = vec2(gl_VertexID & 1, gl_VertexID >> 1) * 2.0;
    gl_Position = vec4(at * 2.0 - 1.0, 0.0, 1.0);
  }`));
  gl.attachShader(program, shader(gl.FRAGMENT_SHADER, `precision mediump float; uniform sampler2D eye; in highp vec2 at; out vec4 colour;
    void main() { colour = vec4(texture(eye, at).rgb, 1.0); }`));
  gl.linkProgram(program);
  if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program) ?? 'the copy to the headset was refused');
  gl.bindTexture(gl.TEXTURE_2D, gl.createTexture());
  for (const [name, value] of [[gl.TEXTURE_MIN_FILTER, gl.LINEAR], [gl.TEXTURE_MAG_FILTER, gl.LINEAR], [gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE], [gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE]]) {
    gl.texParameteri(gl.TEXTURE_2D, name, value);
  }
  gl.pixelStorei(gl.UNPACK_FLIP_Y_WEBGL, true);
  return (canvas, { x, y, width, height }) => {
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA, gl.RGBA, gl.UNSIGNED_BYTE, canvas);
    gl.viewport(x, y, width, height);
    gl.useProgram(program);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
  };
}

const pose = ({ position: p, orientation: q }) => [p.x, p.y, p.z, q.x, q.y, q.z, q.w];

/** Right, up and forward that the thumbsticks ask for, and to the right that they turn. */
function sticks({ inputSources }) {
  const of = (hand) => {
    const { axes = [] } = [...inputSources].find(({ handedness, gamepad }) => handedness === hand && gamepad)?.gamepad ?? {};
    return axes.slice(-2).map((value) => (Math.abs(value) > AT_REST ? value : 0));
  };
  const [[right = 0, back = 0], [turn = 0, down = 0]] = [of('left'), of('right')];
  return [right, -down, -back, turn];
}

function run(gl, space, its) {
  const copy = copier(gl);
  const frame = (_, seen) => {
    its.requestAnimationFrame(frame);
    const head = seen.getViewerPose(space);
    if (!head) return; // Nobody knows where it is: the picture before stays.
    const layer = its.renderState.baseLayer;
    const eyes = head.views.map((view) => ({ view, viewport: layer.getViewport(view) })).filter(({ viewport }) => viewport?.width > 0);
    const numbers = eyes.flatMap(({ view }) => [...pose(view.transform), ...view.projectionMatrix]);
    const rows = Math.max(0, ...eyes.map(({ viewport }) => viewport.height));
    gl.bindFramebuffer(gl.FRAMEBUFFER, layer.framebuffer);
    gl.clearColor(0, 0, 0, 1);
    gl.clear(gl.COLOR_BUFFER_BIT);
    if (!look(pose(head.transform), numbers, sticks(its), rows)) return;
    eyes.forEach(({ viewport }, index) => showEye(index) && copy(byId('view'), viewport));
  };
  its.requestAnimationFrame(frame);
}

/** What it does when it is pressed is what it says. */
function showWorn(isWorn) {
  byId('headset').textContent = say(isWorn ? 'Leave headset' : 'Headset');
  byId('headset').title = say('Look around in a headset');
}

async function enter() {
  const its = await navigator.xr.requestSession(KIND);
  session = its;
  const gl = document.createElement('canvas').getContext('webgl2', { xrCompatible: true, alpha: false, depth: false, antialias: false });
  its.addEventListener('end', () => {
    session = undefined;
    takeOff();
    showWorn(false);
    // Browsers have few contexts for a page.
    gl?.getExtension('WEBGL_lose_context')?.loseContext();
  });
  if (!gl) throw new Error('this browser draws nothing for headsets');
  await its.updateRenderState({ baseLayer: new XRWebGLLayer(its, gl, { antialias: false, depth: false, alpha: false }) });
  const space = await its.requestReferenceSpace('local');
  if (session !== its) return; // It was taken off meanwhile.
  putOn();
  run(gl, space, its);
  showWorn(true);
}

/** Shows the button where there is a headset. */
export async function offerHeadset() {
  if (!navigator.xr) return;
  const offer = async () => { byId('headset').hidden = !await navigator.xr.isSessionSupported(KIND).catch(() => false); };
  let isBusy = false;
  navigator.xr.addEventListener?.('devicechange', offer);
  byId('headset').addEventListener('click', async () => {
    if (isBusy) return;
    isBusy = true;
    try {
      await (session ? session.end() : enter());
    } catch (error) {
      await session?.end().catch(() => {});
      byId('headset').textContent = say('No headset');
      byId('headset').title = say(String(error?.message ?? error));
      setTimeout(() => showWorn(session !== undefined), SAID_MS);
    }
    isBusy = false;
  });
  await offer();
}
