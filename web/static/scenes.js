// The dialog of scenes: which the server has, and files of one's own, dropped on the page or chosen.
// Only for the server that the page came from; pages reach others by websockets alone.
import { go, link, snapshot, token } from './vantage_web.js';
import { byId, megabytes, openDialog } from './elements.js';
import { say as inWords } from './words.js';

const MEGABYTE = 1 << 20;

/** What the server offers: { scenes: [{ name, open, sessions, thumbnail }], uploads: { bytes } | null }; null where it offers nothing. */
let offer = null;
/** The request that brings files, while it does. */
let bringing = null;

function headers() {
  const known = token();
  // In hexadecimal: headers hold no letters of most languages.
  const hex = known && [...new TextEncoder().encode(known)].map((byte) => byte.toString(16).padStart(2, '0')).join('');
  return hex ? { Authorization: `Vantage-Hex ${hex}` } : {};
}

async function asked(path) {
  const response = await fetch(path, { headers: headers() });
  return response.ok ? response : null;
}

/** Parts of an address that are of a scene, and of no other. */
const OF_SCENE = ['file-scene', 'variant', 'eye', 'target', 'mode', 'fov', 'time', 'rate', 'hide', 'only', 'cut'];

/** The page's address with another scene, at that one's beginning. */
function addressOf(name) {
  const url = new URL(location.href);
  OF_SCENE.forEach((part) => url.searchParams.delete(part));
  if (name === null) {
    url.searchParams.delete('scene');
  } else {
    url.searchParams.set('scene', name);
  }
  url.hash = '';
  return url.href;
}

function card({ name, open, sessions, thumbnail }, isFirst, isShown) {
  const item = document.createElement('li');
  const link = document.createElement('a');
  link.href = addressOf(isFirst ? null : name);
  if (isShown) link.setAttribute('aria-current', 'page');
  const picture = document.createElement('span');
  picture.className = 'picture';
  picture.setAttribute('aria-hidden', 'true');
  picture.textContent = name.split('/').pop().slice(0, 1).toUpperCase();
  if (thumbnail) showThumbnail(picture, name);
  const title = document.createElement('b');
  title.textContent = name;
  const about = document.createElement('small');
  const people = sessions === 1 ? '1 viewer' : `${sessions} viewers`;
  about.textContent = inWords(open ? people : 'not loaded yet');
  link.append(picture, title, about);
  item.append(link);
  return item;
}

async function showThumbnail(picture, name) {
  const response = await asked(`./thumbnail?scene=${encodeURIComponent(name)}`);
  if (!response) return;
  const image = new Image();
  image.alt = '';
  image.src = URL.createObjectURL(await response.blob());
  image.onload = () => {
    URL.revokeObjectURL(image.src);
    picture.replaceChildren(image);
  };
}

const wished = (part) => new URL(location.href).searchParams.get(part);

/** The page's address with another choice within the scene's file, by `part`; of a variant it is the same view. */
function addressWithin(part, chosen) {
  const url = new URL(part === 'variant' ? link() ?? location.href : addressOf(wished('scene')));
  if (chosen === '') {
    url.searchParams.delete(part);
  } else {
    url.searchParams.set(part, chosen);
  }
  return url.href;
}

/** Offers what else is in the file of the scene that is shown: { scenes, shown_scene, variants, cameras: [{ name, eye, target, fov_deg }] }; whether there is anything. */
async function offerFile() {
  const query = new URLSearchParams(['scene', 'file-scene', 'variant'].filter((part) => wished(part) !== null).map((part) => [part, wished(part)]));
  const { scenes = [], shown_scene: shown, variants = [], cameras = [] } = (await (await asked(`./offer?${query}`).catch(() => null))?.json()) ?? {};
  const fill = (id, first, names, value) => {
    byId(id).replaceChildren(...(first === null ? [] : [new Option(inWords(first), '')]), ...names.map((name) => new Option(name, name)));
    byId(id).value = value;
    byId(id).closest('label').hidden = names.length === 0;
  };
  // An address may name them by their numbers.
  const variant = wished('variant');
  fill('file-scene', null, scenes, scenes[shown]);
  fill('file-variant', 'as the server shows it', variants, variants.includes(variant) ? variant : variants[variant] ?? '');
  fill('file-camera', 'choose', cameras.map(({ name }) => name), '');
  byId('file-scene').onchange = ({ target }) => location.assign(addressWithin('file-scene', target.value));
  byId('file-variant').onchange = ({ target }) => location.assign(addressWithin('variant', target.value));
  byId('file-camera').onchange = ({ target }) => {
    const { eye, target: to, fov_deg: fov } = cameras[target.selectedIndex - 1];
    go(Float64Array.from(eye), Float64Array.from(to), fov);
    target.value = '';
    byId('scenes').close();
  };
  const some = scenes.length + variants.length + cameras.length > 0;
  byId('of-file').hidden = !some;
  return some;
}

async function open() {
  openDialog('scenes');
  // Who is there changes.
  offer = (await askedForOffer()) ?? offer;
  const shown = wished('scene');
  const cards = offer.scenes.map((scene, index) => card(scene, index === 0, shown === null ? index === 0 : shown === scene.name));
  byId('scene-list').replaceChildren(...cards);
}

function say(text, isWrong = false) {
  byId('bring-text').textContent = inWords(text);
  byId('bring-text').classList.toggle('wrong', isWrong);
  byId('bring-text').scrollIntoView({ block: 'nearest' });
}

function showShare(share) {
  byId('bring-progress').hidden = share === null;
  byId('bring-cancel').hidden = share === null;
  byId('bring-files').disabled = share !== null;
  if (share === null) return;
  const percent = Math.round(share * 100);
  byId('bring-progress').setAttribute('aria-valuenow', percent);
  byId('bring-progress').firstElementChild.style.width = `${percent}%`;
}

/** Brings files, [{ path, file }], and goes to the first scene in them. */
function bring(files) {
  if (bringing || files.length === 0) return;
  if (!byId('scenes').open) open();
  const bytes = files.reduce((sum, { file }) => sum + file.size, 0);
  if (bytes > offer.uploads.bytes) {
    return say(`${megabytes(bytes)} are too many: this server takes ${megabytes(offer.uploads.bytes)} at once.`, true);
  }
  const list = JSON.stringify(files.map(({ path, file }) => ({ path, bytes: file.size })));
  const request = new XMLHttpRequest();
  const ends = (text, isWrong) => {
    bringing = null;
    showShare(null);
    say(text, isWrong);
  };
  request.open('POST', './uploads');
  Object.entries(headers()).forEach(([name, value]) => request.setRequestHeader(name, value));
  request.setRequestHeader('Content-Type', 'application/vnd.vantage.files');
  request.upload.onprogress = ({ loaded, total }) => {
    showShare(loaded / total);
    say(loaded < total ? `${megabytes(loaded)} of ${megabytes(total)}` : 'The server looks at it');
  };
  request.onload = () => {
    if (request.status !== 200) return ends(`It was not taken: ${request.responseText.trim()}.`, true);
    ends('It is there');
    location.assign(addressOf(JSON.parse(request.responseText).scenes[0]));
  };
  // An answer that comes before all was sent may end the connection.
  request.onerror = () => ends(request.responseText ? `It was not taken: ${request.responseText.trim()}.` : 'The server cannot be reached.', true);
  request.onabort = () => ends('Cancelled');
  bringing = request;
  showShare(0);
  say('Begins');
  request.send(new Blob([list, '\n', ...files.map(({ file }) => file)]));
}

/** All files of what was dropped, folders with what is in them. */
async function dropped(transfer) {
  // Entries must be taken before anything is waited for.
  const entries = [...transfer.items].map((item) => item.webkitGetAsEntry?.()).filter(Boolean);
  const files = [];
  const walk = async (entry) => {
    if (entry.isFile) {
      const file = await new Promise((resolve, reject) => entry.file(resolve, reject));
      files.push({ path: entry.fullPath.replace(/^\//, ''), file });
      return;
    }
    const reader = entry.createReader();
    for (;;) {
      const some = await new Promise((resolve, reject) => reader.readEntries(resolve, reject));
      if (some.length === 0) return;
      for (const one of some) await walk(one);
    }
  };
  for (const entry of entries) await walk(entry);
  return files.length > 0 ? files : chosen(transfer.files);
}

const chosen = (files) => [...files].map((file) => ({ path: file.webkitRelativePath || file.name, file }));

function listenForDrops() {
  const hasFiles = ({ dataTransfer }) => dataTransfer?.types.includes('Files');
  const mark = (isOver) => byId('drop').hidden = !isOver;
  addEventListener('dragover', (event) => {
    if (!hasFiles(event)) return;
    // Otherwise the browser would leave the page for the file.
    event.preventDefault();
    event.dataTransfer.dropEffect = offer?.uploads ? 'copy' : 'none';
    mark(true);
  });
  addEventListener('dragleave', ({ relatedTarget }) => relatedTarget === null && mark(false));
  addEventListener('drop', async (event) => {
    if (!hasFiles(event)) return;
    event.preventDefault();
    mark(false);
    if (offer?.uploads) bring(await dropped(event.dataTransfer));
  });
}

const askedForOffer = async () => (await (await asked('./scenes').catch(() => null))?.json()) ?? null;

/** What the server offers, at the latest once the page is connected: before its first scene is loaded it offers nothing yet. */
async function firstOffer() {
  for (;;) {
    const { connected } = JSON.parse(snapshot());
    const found = await askedForOffer();
    if (found === null || connected || found.scenes.length > 1 || found.uploads) return found;
    await new Promise((resolve) => { setTimeout(resolve, 1000); });
  }
}

/** Once its scene is shown. */
async function connected() {
  while (!JSON.parse(snapshot()).connected) await new Promise((resolve) => { setTimeout(resolve, 1000); });
}

/** Shows the button of scenes where there is something to choose, and takes what is dropped where the server does. */
export async function offerScenes() {
  listenForDrops();
  if (wished('server') !== null) return;
  byId('scenes-open').addEventListener('click', open);
  offer = await firstOffer();
  if (!offer) return;
  byId('scenes-open').hidden = offer.scenes.length < 2 && !offer.uploads;
  if (offer.uploads) byId('drop-text').textContent = inWords('Drop it to see it');
  byId('bring').hidden = !offer.uploads;
  byId('bring-most').textContent = offer.uploads ? `${Math.round(offer.uploads.bytes / MEGABYTE)} MB` : '';
  byId('bring-files').addEventListener('change', ({ target }) => {
    bring(chosen(target.files));
    // The same file again is a change, too.
    target.value = '';
  });
  byId('bring-cancel').addEventListener('click', () => bringing?.abort());
  await connected();
  if (await offerFile()) byId('scenes-open').hidden = false;
}
