// All pairs of a comparison on one sheet: of each model three.js's picture and ours, and the errors beneath.
//
//   node beside/sheet.mjs REPORT SHEET.jpg [WITHOUT...]
//
// REPORT is the folder that `cargo xtask beside` has written; names of models that are not to be shown follow.
import { readFile } from 'node:fs/promises';
import { join } from 'node:path';
import { openPage } from '../lib/browser.mjs';

const [COLUMNS, SIDE_PX, GAP_PX] = [5, 200, 6];

async function cell(report, { scene, error }) {
  const picture = async (file) => {
    const png = await readFile(join(report, 'pairs', scene, file));
    return `<img width="${SIDE_PX}" src="data:image/png;base64,${png.toString('base64')}">`;
  };
  const [plain, toFine, ofThree] = ['flip_covered', 'flip_to_fine', 'three_flip_to_fine'].map((name) => error[name].mean.toFixed(3));
  const pictures = await Promise.all(['three.png', 'ours.png'].map(picture));
  return `<div><div style="display:flex">${pictures.join('')}</div>${scene} ${plain}; ${toFine}, ${ofThree}</div>`;
}

async function main([report, path, ...without]) {
  if (!path) {
    console.error('usage: node beside/sheet.mjs REPORT SHEET.jpg [WITHOUT...]');
    process.exit(2);
  }
  const { rows } = JSON.parse(await readFile(join(report, 'beside.json'), 'utf8'));
  // Pairs that failed have no errors.
  const shown = rows.filter(({ scene, error }) => error.flip_covered && !without.includes(scene));
  shown.sort((a, b) => b.error.flip_covered.mean - a.error.flip_covered.mean);
  const cells = await Promise.all(shown.map((row) => cell(report, row)));
  const width = COLUMNS * 2 * SIDE_PX + (COLUMNS - 1) * GAP_PX;
  const { page, close } = await openPage('webgl2', console.log, { width, height: 600 });
  await page.setContent(`<body style="margin:0;font:15px sans-serif"><div style="display:grid;gap:${GAP_PX}px;grid-template-columns:repeat(${COLUMNS},${2 * SIDE_PX}px)">${cells.join('')}</div></body>`);
  await page.screenshot({ path, type: 'jpeg', quality: 82, fullPage: true });
  await close();
  console.log(`${path}: ${shown.length} models`);
}

await main(process.argv.slice(2));
