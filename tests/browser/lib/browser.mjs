// Chromium as it draws on a machine without a GPU. WebGPU works headless with exactly these flags and with no fewer: with
// others the device is lost, and frames look absurdly fast.
import { mkdtemp, rm } from 'node:fs/promises';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';

const BASE = [
  '--headless=new', '--no-sandbox', '--disable-quic', '--no-first-run', '--disable-background-networking',
  '--disable-component-update', '--disable-sync',
];
const RENDERER = {
  webgpu: [
    '--enable-unsafe-webgpu', '--enable-features=Vulkan', '--use-vulkan=swiftshader', '--use-angle=swiftshader',
  ],
  webgl2: ['--enable-unsafe-swiftshader', '--use-angle=swiftshader'],
};
const VIEWPORT = { width: 640, height: 400 };
/** Device pixels of one of the page, in tests: most of what they take is software drawing 400 x 250 of them. */
const COARSE = 0.625;

/** Opens a page in a browser of its own with a new profile. `close` ends both. */
export async function openPage(renderer, log, viewport = VIEWPORT, deviceScaleFactor = 1) {
  const profile = await mkdtemp(join(tmpdir(), 'vantage-browser-'));
  const context = await chromium.launchPersistentContext(profile, {
    executablePath: process.env.CHROMIUM ?? '/usr/bin/chromium',
    headless: false, // the flag below says which headless
    args: [...BASE, ...RENDERER[renderer]],
    viewport,
    deviceScaleFactor,
  });
  const page = context.pages()[0] ?? await context.newPage();
  page.setDefaultTimeout(60_000);
  page.on('console', (message) => log(`console ${message.type()}: ${message.text()}`));
  page.on('pageerror', (error) => log(`page error: ${error.message}`));
  page.on('crash', () => log('the page crashed'));
  const close = async () => {
    await context.close();
    await rm(profile, { recursive: true, force: true });
  };
  return { page, close };
}

/** The same with fewer pixels, for what does not depend on how many there are. */
export const openCoarsePage = (renderer, log, viewport = VIEWPORT) => openPage(renderer, log, viewport, COARSE);
