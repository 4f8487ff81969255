// <vantage-view src="wss://host/ws">: a view of a remote scene as an element of any page. A server gives this file to pages of every origin; `packaging/npm` makes a package of it.
//
// It shows the server's own page in a frame, so that its scripts, its memory and its keys stay apart from the page around it, and all of it is gone when the element is. Both
// talk by a channel that is the element's alone. The server says whose pages may frame it (--allow-origin); the page around needs no more in its own policy than
// `script-src` for this file and `frame-src` for the server. What there is to set, to call and to hear is in vantage-view.d.ts.

const GREETING = 'vantage-view';
/** Attributes that the server's page takes in its address, under the same names. */
const OPTIONS = ['scene', 'file-scene', 'variant', 'eye', 'target', 'mode', 'fov', 'exposure', 'renderer', 'shadows', 'occlusion', 'antialias', 'camera', 'present', 'follow', 'time', 'rate', 'hide', 'only', 'cut', 'lang', 'bare'];
/** A page that says nothing for so long is not there, or may not be framed. */
const PATIENCE_MS = 30_000;

const sheet = new CSSStyleSheet();
sheet.replaceSync(`
  :host { display: block; aspect-ratio: 16 / 10; overflow: hidden; }
  :host([hidden]) { display: none; }
  iframe { display: block; width: 100%; height: 100%; border: 0; }
`);

/** The address of a server's page, whose websocket may be named instead. */
function pageOf(src) {
  const url = new URL(src, document.baseURI);
  url.protocol = { 'ws:': 'http:', 'wss:': 'https:' }[url.protocol] ?? url.protocol;
  if (!/^https?:$/.test(url.protocol)) throw new TypeError(`${src}: a server's address begins with wss://, ws://, https:// or http://`);
  url.pathname = url.pathname.replace(/\/ws$/, '/').replace(/\/?$/, '/');
  return url;
}

export class VantageViewElement extends HTMLElement {
  static observedAttributes = ['src', 'token', 'aria-label', ...OPTIONS];

  #root = this.attachShadow({ mode: 'open' });
  #frame = null;
  #origin = '';
  #port = null;
  #patience = 0;
  #loads = false;
  #state = null;
  #failed = null;
  #asked = new Map();
  #number = 0;
  #hear = (event) => this.#greeted(event);

  constructor() {
    super();
    this.#root.adoptedStyleSheets = [sheet];
  }

  connectedCallback() {
    window.addEventListener('message', this.#hear);
    this.#load();
  }

  disconnectedCallback() {
    window.removeEventListener('message', this.#hear);
    this.#leave();
    this.#giveUp('the element was removed');
  }

  attributeChangedCallback(name, before, after) {
    if (before === after || !this.isConnected) return;
    if (name !== 'aria-label') this.#load();
    else if (this.#frame) this.#frame.title = this.#title();
  }

  get src() { return this.getAttribute('src') ?? ''; }
  set src(src) { this.setAttribute('src', src); }

  /** What is shown, as it was told last; null before. */
  get state() { return this.#state; }

  /** Goes to where a point is seen from another. */
  goTo({ eye, target }) { return this.#ask({ ask: 'go', eye: [...eye], target: [...target] }); }

  /** A PNG of the view as it is now, of any size up to 7,680 pixels a side; as large as the element without one. */
  picture({ width, height } = {}) { return this.#ask({ ask: 'picture', width, height }); }

  /** The address of the view as it is now, for another browser. */
  link() { return this.#ask({ ask: 'link' }); }

  /** The scene's time goes on so many times as fast from now on, for this view alone; 0 stops it. */
  play(rate = 1) { return this.#ask({ ask: 'play', rate }); }

  pause() { return this.play(0); }

  /** The scene's time is this one now, in seconds. */
  seek(time) { return this.#ask({ ask: 'seek', time }); }

  /** All of the scene's objects but these are shown. */
  hide(...objects) { return this.#ask({ ask: 'parts', which: objects.length > 0 ? 'but' : 'all', objects }); }

  /** These objects alone are shown; all of them without any. */
  showOnly(...objects) { return this.#ask({ ask: 'parts', which: objects.length > 0 ? 'only' : 'all', objects }); }

  /** Nothing is shown that lies farther along a normal than so many metres from the origin; all is, without one. */
  cut({ normal = [], offset = 0 } = {}) { return this.#ask({ ask: 'cut', normal: [...normal], offset }); }

  /** How the scene is put before this view now. */
  staging() { return this.#ask({ ask: 'staging' }); }

  focus(options) { this.#frame?.focus(options); }

  #title() { return this.getAttribute('aria-label') ?? 'View of a remote scene'; }

  /** Loads anew, once for all attributes that change together. */
  #load() {
    if (this.#loads) return;
    this.#loads = true;
    queueMicrotask(() => {
      this.#loads = false;
      if (!this.isConnected) return;
      this.#leave();
      if (this.src) this.#open();
      else this.#giveUp('the element shows nothing');
    });
  }

  #open() {
    let url;
    try {
      url = pageOf(this.src);
    } catch (error) {
      this.#fail(error.message);
      return;
    }
    OPTIONS.filter((name) => this.hasAttribute(name)).forEach((name) => url.searchParams.set(name, this.getAttribute(name)));
    if (this.hasAttribute('token')) url.hash = `token=${encodeURIComponent(this.getAttribute('token'))}`;
    const frame = document.createElement('iframe');
    frame.title = this.#title();
    frame.allow = 'fullscreen; clipboard-write; gamepad; xr-spatial-tracking';
    frame.src = url.href;
    this.#origin = url.origin;
    this.#frame = frame;
    this.#root.replaceChildren(frame);
    const why = `${url.origin} does not answer, or does not let ${location.origin} frame it (--allow-origin)`;
    this.#patience = setTimeout(() => this.#fail(why), PATIENCE_MS);
  }

  /** The framed page is there, and is given an end of a channel. */
  #greeted({ source, origin, data }) {
    if (data !== GREETING || !this.#frame || source !== this.#frame.contentWindow || origin !== this.#origin) return;
    clearTimeout(this.#patience);
    this.#failed = null;
    this.#port?.close();
    const { port1, port2 } = new MessageChannel();
    this.#port = port1;
    port1.onmessage = ({ data: told }) => this.#told(told);
    source.postMessage(GREETING, this.#origin, [port2]);
    this.#asked.forEach(({ message }, number) => port1.postMessage({ ...message, number }));
  }

  #told({ tell, state, text, number, value }) {
    if (tell === 'state') {
      const before = this.#state;
      this.#state = Object.freeze(state);
      if (state.picture && !before?.picture) this.dispatchEvent(new Event('ready'));
      this.dispatchEvent(new CustomEvent('change', { detail: this.#state }));
    } else if (tell === 'failed') {
      this.#fail(text);
    } else if (tell === 'answer' || tell === 'refusal') {
      const asked = this.#asked.get(number);
      this.#asked.delete(number);
      if (tell === 'answer') asked?.resolve(value);
      else asked?.reject(new Error(text));
    }
  }

  #ask(message) {
    return new Promise((resolve, reject) => {
      if (this.#failed !== null || !(this.#frame || this.#loads)) {
        reject(new Error(this.#failed ?? 'the element shows nothing'));
        return;
      }
      this.#number += 1;
      this.#asked.set(this.#number, { message, resolve, reject });
      this.#port?.postMessage({ ...message, number: this.#number });
    });
  }

  #fail(text) {
    clearTimeout(this.#patience);
    this.#failed = text;
    this.dispatchEvent(new CustomEvent('error', { detail: text }));
    this.#giveUp(text);
  }

  #giveUp(text) {
    this.#asked.forEach(({ reject }) => reject(new Error(text)));
    this.#asked.clear();
  }

  #leave() {
    clearTimeout(this.#patience);
    this.#port?.close();
    this.#root.replaceChildren();
    [this.#frame, this.#port, this.#state, this.#failed] = [null, null, null, null];
  }
}

if (!customElements.get('vantage-view')) customElements.define('vantage-view', VantageViewElement);
