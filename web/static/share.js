// The dialog that gives the view to others: a link to it, a picture of it, and the path that one goes, as a file and as a video.
import { link, photo, record, replay } from './vantage_web.js';
import { byId, openDialog, pngOf } from './elements.js';
import { say as inWords } from './words.js';

/** Widths that pictures are wanted in beside the screen's own, and times of that. */
const TIMES = [1, 2];
const WIDTHS = [3840, 7680];
/** A side of a picture at most. */
const LARGEST_PX = 7680;

function sizes() {
  const { width, height } = byId('view');
  const all = [...TIMES.map((times) => [width * times, height * times]), ...WIDTHS.map((wide) => [wide, Math.round((wide * height) / width)])];
  return all.filter(([wide, high], index) => Math.max(wide, high) <= LARGEST_PX && all.findIndex(([w]) => w === wide) === index);
}

function say(text, isWrong = false) {
  byId('share-said').textContent = inWords(text);
  byId('share-said').classList.toggle('wrong', isWrong);
}

function open() {
  const address = link();
  if (!address) return;
  byId('share-link').value = address;
  say('');
  const options = sizes().map(([width, height], index) => new Option(inWords(`${width} × ${height}${index === 0 ? ', as on the screen' : ''}`), `${width} ${height}`));
  byId('picture-size').replaceChildren(...options);
  openDialog('share');
}

async function copy() {
  const field = byId('share-link');
  try {
    await navigator.clipboard.writeText(field.value);
    say('Copied');
  } catch {
    // Pages by plain http from another machine have no clipboard.
    field.select();
    say(document.execCommand('copy') ? 'Copied' : 'Copy it by hand: it is selected');
  }
}

/** Saves a file by the scene's name. */
function keep(file, extension) {
  const anchor = document.createElement('a');
  anchor.href = URL.createObjectURL(file);
  anchor.download = `${byId('scene').textContent.replace(/[^\p{L}\p{N}. -]/gu, '_')}.${extension}`;
  anchor.click();
  setTimeout(() => URL.revokeObjectURL(anchor.href), 60_000);
}

/** What is being recorded, and then what was: { recorder, chunks, path, video }; the recorder is null where the browser makes no videos. */
let recording = null;

function startRecording() {
  const chunks = [];
  let recorder = null;
  try {
    recorder = new MediaRecorder(byId('view').captureStream(30), { videoBitsPerSecond: 12_000_000 });
    recorder.ondataavailable = ({ data }) => chunks.push(data);
    recorder.start(1000);
  } catch {
    // The path is written down in any case.
  }
  record(true);
  recording = { recorder, chunks };
  byId('recorded').hidden = true;
  byId('share').close();
  byId('share-open').textContent = inWords('Stop');
  byId('share-open').setAttribute('aria-pressed', 'true');
}

async function stopRecording() {
  const { recorder, chunks } = recording;
  const path = record(false);
  if (recorder) {
    await new Promise((resolve) => {
      recorder.onstop = resolve;
      recorder.stop();
    });
  }
  recording = null;
  byId('share-open').textContent = inWords('Share');
  byId('share-open').removeAttribute('aria-pressed');
  open();
  const video = chunks.some(({ size }) => size > 0) ? new Blob(chunks, { type: recorder.mimeType }) : null;
  byId('recorded').hidden = !path;
  byId('path-save').onclick = () => keep(new Blob([path], { type: 'text/plain' }), 'txt');
  byId('video-save').hidden = !video;
  byId('video-save').onclick = () => keep(video, recorder.mimeType.includes('mp4') ? 'mp4' : 'webm');
}

async function goPath({ target }) {
  const [file] = target.files;
  if (!file) return;
  try {
    const seconds = replay(await file.text());
    byId('share').close();
    say(`It took ${seconds.toFixed(1)} s`);
  } catch (error) {
    say(`That is no path: ${error?.message ?? error}`, true);
  }
  // The same file again is a change, too.
  target.value = '';
}

async function save() {
  const [width, height] = byId('picture-size').value.split(' ').map(Number);
  byId('picture-save').disabled = true;
  say('Drawing');
  try {
    keep(await pngOf(photo, width, height), 'png');
    say('Saved');
  } catch (error) {
    say(`No picture was made: ${error?.message ?? error}`, true);
  }
  byId('picture-save').disabled = false;
}

export function offerSharing() {
  byId('share-open').addEventListener('click', () => (recording ? stopRecording() : open()));
  byId('record').addEventListener('click', startRecording);
  byId('path-file').addEventListener('change', goPath);
  byId('share-copy').addEventListener('click', copy);
  byId('picture-save').addEventListener('click', save);
}
