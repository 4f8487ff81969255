// How the scene is put before this viewer: its time, its parts, and where it is cut open. The WebAssembly keeps it, and says so by `staged`:
//   motion   'still', 'endless' or 'loop', whose period_s is after how many seconds it begins again
//   time_s   scene time; rate, how many times as fast as the clock it goes; follows, whether that is a presenter's
//   parts    'all', 'but' or 'only', and objects, those that are named: { object, name }, whose name may not be known yet
//   chooses  whether parts are chosen by clicks; chosen, the one that is
//   section  [normal, offset_m] of the plane that cuts the scene open; bounds, the corners of the scene
import { cut, mark_holes as markHoles, play, seek, set_quality as setQuality, set_tint as setTint, show_parts as showParts, staged } from './vantage_web.js';
import { byId } from './elements.js';
import { say } from './words.js';

const SHOW_INTERVAL_MS = 100;
/** While a slider is dragged the server is asked for no more scenes than this leaves it time to draw. */
const DRAG_INTERVAL_MS = 150;
const NORMALS = { x: [1, 0, 0], y: [0, 1, 0], z: [0, 0, 1] };

let told = {};
let rate = 1;
let quality = 'auto';

const seconds = (value) => `${value.toFixed(1)} s`;
const numbers = (objects) => Uint16Array.from(objects.map(({ object }) => object));

/** Text that is set where it changes alone, so that nothing is read out twice. */
function setText(element, text) {
  if (element.textContent !== text) element.textContent = text;
}

/** Who follows somebody sees what is his: there is nothing to choose. */
function showFollowing({ follows }) {
  byId('parts-toggle').hidden = follows === true;
}

function showTime({ motion, period_s: period, time_s: time, follows }) {
  const moves = motion !== 'still' && motion !== undefined && time !== null;
  byId('time').hidden = !moves;
  byId('play').hidden = !moves || follows;
  if (!moves) return;
  const isPaused = told.rate === 0;
  setText(byId('play').firstElementChild, say(isPaused ? 'Play' : 'Pause'));
  byId('play').setAttribute('aria-pressed', String(!isPaused));
  byId('rate').disabled = follows;
  if (!isPaused && document.activeElement !== byId('rate')) byId('rate').value = String(told.rate);
  const slider = byId('seek');
  slider.hidden = period === null;
  slider.disabled = follows;
  const now = period === null ? time : ((time % period) + period) % period;
  if (period !== null) {
    slider.max = String(period);
    if (!dragged.has(slider)) slider.value = String(now);
  }
  const shown = dragged.has(slider) ? Number(slider.value) : now;
  setText(byId('now'), seconds(shown));
  slider.setAttribute('aria-valuetext', seconds(shown));
}

const nameOf = ({ object, name }) => name || `${say('Part')} ${object}`;

function listed(part) {
  const item = document.createElement('li');
  const name = document.createElement('span');
  name.textContent = nameOf(part);
  const button = document.createElement('button');
  button.type = 'button';
  button.textContent = say(told.parts === 'but' ? 'Show' : 'Hide');
  button.setAttribute('aria-label', `${button.textContent}: ${name.textContent}`);
  button.onclick = () => {
    const left = told.objects.filter(({ object }) => object !== part.object);
    put(left.length > 0 || told.parts === 'only' ? told.parts : 'all', left);
  };
  item.append(name, button);
  return item;
}

let listing = '';

function showChosen({ parts, objects, chosen, section }) {
  setText(byId('part-name'), chosen ? nameOf(chosen) : say('Click on a part'));
  byId('part-hide').disabled = !chosen;
  byId('part-only').disabled = !chosen;
  byId('parts-all').disabled = parts === 'all' && !section;
  setText(byId('parts-kind'), say(parts === 'but' ? 'Hidden' : 'Shown alone'));
  byId('parts-kind').hidden = parts === 'all';
  const key = JSON.stringify([parts, objects]);
  if (key !== listing) {
    listing = key;
    byId('parts-listed').replaceChildren(...objects.map(listed));
  }
  if (!section && !dragged.has(byId('cut-at'))) byId('cut-axis').value = 'none';
  byId('cut-at').disabled = byId('cut-axis').value === 'none';
  byId('cut-flip').disabled = byId('cut-axis').value === 'none';
}

/** Shows all as it is. */
function show() {
  told = JSON.parse(staged());
  if (told.rate > 0) rate = told.rate;
  showFollowing(told);
  showTime(told);
  if (told.chooses) showChosen(told);
}

function put(which, objects) {
  try {
    showParts(which, numbers(objects));
    show();
  } catch (error) {
    setText(byId('part-name'), say(String(error?.message ?? error)));
  }
}

function hide() {
  const { parts, objects, chosen } = told;
  if (!chosen) return;
  if (parts === 'only') put('only', objects.filter(({ object }) => object !== chosen.object));
  else put('but', [...objects, chosen]);
}

/** Where the plane of the sliders is. */
function putSection() {
  const axis = byId('cut-axis').value;
  if (axis === 'none' || !told.bounds) {
    cut(new Float64Array(), 0);
    return;
  }
  const index = 'xyz'.indexOf(axis);
  const [from, to] = told.bounds.map((corner) => corner[index]);
  const at = from + (to - from) * Number(byId('cut-at').value);
  const sign = byId('cut-flip').checked ? -1 : 1;
  byId('cut-at').setAttribute('aria-valuetext', `${at.toFixed(2)} m`);
  cut(Float64Array.from(NORMALS[axis], (value) => sign * value), sign * at);
}

const dragged = new Set();

/** While a slider is dragged, and once it is let go. */
function followSlider(slider, act) {
  let waits = 0;
  slider.addEventListener('input', () => {
    dragged.add(slider);
    if (waits) return;
    waits = setTimeout(() => {
      waits = 0;
      act();
    }, DRAG_INTERVAL_MS);
  });
  slider.addEventListener('change', () => {
    clearTimeout(waits);
    waits = 0;
    act();
    dragged.delete(slider);
    show();
  });
}

export function offerStaging() {
  byId('play').addEventListener('click', () => {
    play(told.rate === 0 ? rate : 0);
    show();
  });
  byId('rate').addEventListener('change', () => {
    rate = Number(byId('rate').value);
    if (told.rate !== 0) play(rate);
  });
  followSlider(byId('seek'), () => seek(Number(byId('seek').value)));
  byId('part-hide').addEventListener('click', hide);
  byId('part-only').addEventListener('click', () => told.chosen && put('only', [told.chosen]));
  byId('parts-all').addEventListener('click', () => {
    byId('cut-axis').value = 'none';
    cut(new Float64Array(), 0);
    put('all', []);
  });
  byId('cut-axis').addEventListener('change', () => {
    putSection();
    show();
  });
  byId('cut-flip').addEventListener('change', putSection);
  followSlider(byId('cut-at'), putSection);
  byId('quality').addEventListener('change', ({ target }) => {
    try {
      setQuality(target.value);
      quality = target.value;
    } catch {
      // While the graphics device is made anew.
      target.value = quality;
    }
  });
  byId('holes').addEventListener('change', ({ target }) => markHoles(target.checked));
  byId('tint').addEventListener('change', ({ target }) => setTint(target.value));
  const { section } = JSON.parse(staged());
  if (section) takeSection(section);
  setInterval(() => document.hidden || show(), SHOW_INTERVAL_MS);
}

/** A plane that the address asked for, where the sliders can show it. */
function takeSection([normal, offset]) {
  const index = normal.findIndex((value) => Math.abs(value) > 0.999);
  if (index < 0) return;
  const wait = setInterval(() => {
    if (!told.bounds) return;
    clearInterval(wait);
    const [from, to] = told.bounds.map((corner) => corner[index]);
    byId('cut-axis').value = 'xyz'[index];
    byId('cut-flip').checked = normal[index] < 0;
    byId('cut-at').value = String((offset * Math.sign(normal[index]) - from) / (to - from));
  }, SHOW_INTERVAL_MS);
}
