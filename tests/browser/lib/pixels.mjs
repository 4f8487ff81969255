// What is on the canvas, as the browser shows it: a screenshot, decoded by the browser itself.

/** How long a screenshot may wait for what the software adapter still has to draw. */
const PATIENCE_MS = 120_000;

/** Pixels of the page as shown, without what lies over the canvas: { width, height, data } with RGBA bytes. */
export async function canvasPixels(page, path) {
  // The page's policy lets no style in that is added as text.
  await page.evaluate(() => {
    const sheet = new CSSStyleSheet();
    sheet.replaceSync('#panel, nav, #status, #loading, #tape, #measured, #named, #parts, #time { visibility: hidden !important; }');
    document.adoptedStyleSheets = [sheet];
  });
  // Frames come no faster than they are drawn: after two more, what was drawn before is shown.
  await page.evaluate(() => new Promise((done) => { requestAnimationFrame(() => requestAnimationFrame(done)); }));
  const png = await page.screenshot({ path, caret: 'initial', timeout: PATIENCE_MS });
  await page.evaluate(() => { document.adoptedStyleSheets = []; });
  return decoded(page, png);
}

/** Pixels of the bytes of a PNG, by the browser of a page. */
export async function decoded(page, png) {
  const helper = await page.context().newPage();
  try {
    const [width, height, text] = await helper.evaluate(async (base64) => {
      const bytes = Uint8Array.from(atob(base64), (c) => c.charCodeAt(0));
      const bitmap = await createImageBitmap(new Blob([bytes], { type: 'image/png' }));
      const canvas = new OffscreenCanvas(bitmap.width, bitmap.height);
      const context = canvas.getContext('2d');
      context.drawImage(bitmap, 0, 0);
      const { data } = context.getImageData(0, 0, bitmap.width, bitmap.height);
      let text = '';
      for (let i = 0; i < data.length; i += 32768) text += String.fromCharCode(...data.subarray(i, i + 32768));
      return [bitmap.width, bitmap.height, btoa(text)];
    }, png.toString('base64'));
    return { width, height, data: Buffer.from(text, 'base64') };
  } finally {
    await helper.close();
    await page.bringToFront();
  }
}

/** How many different colours there are, at 5 bits a channel, that fill at least 0.1 % of the picture. */
export function colours({ width, height, data }) {
  const counts = new Map();
  for (let i = 0; i < data.length; i += 4) {
    const key = (data[i] >> 3) << 10 | (data[i + 1] >> 3) << 5 | data[i + 2] >> 3;
    counts.set(key, (counts.get(key) ?? 0) + 1);
  }
  return [...counts.values()].filter((count) => count >= width * height / 1000).length;
}

/** The share of pixels that differ by more than `most` of 255 in some channel. */
export function difference(a, b, most = 24) {
  if (a.width !== b.width || a.height !== b.height) return 1;
  let differing = 0;
  for (let i = 0; i < a.data.length; i += 4) {
    if ([0, 1, 2].some((c) => Math.abs(a.data[i + c] - b.data[i + c]) > most)) differing += 1;
  }
  return differing / (a.width * a.height);
}

/** Mean brightness, 0 to 255. */
export function brightness({ data }) {
  let sum = 0;
  for (let i = 0; i < data.length; i += 4) sum += 0.299 * data[i] + 0.587 * data[i + 1] + 0.114 * data[i + 2];
  return sum / (data.length / 4);
}

/** Variance of brightness over the picture, 0 for a blank one. */
export function contrast({ data }) {
  let [sum, squares] = [0, 0];
  for (let i = 0; i < data.length; i += 4) {
    const value = 0.299 * data[i] + 0.587 * data[i + 1] + 0.114 * data[i + 2];
    sum += value;
    squares += value * value;
  }
  const count = data.length / 4;
  return squares / count - (sum / count) ** 2;
}
