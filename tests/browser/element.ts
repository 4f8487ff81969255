// What a page's own TypeScript does with the element: it is held against the types of its package, and not run.
import type { Point, VantageState, VantageViewElement } from '../../packaging/npm/vantage-view';

const view: VantageViewElement = document.createElement('vantage-view');
view.src = 'wss://localhost:8080/ws';
view.addEventListener('ready', () => view.goTo({ eye: [0, 1.6, 3], target: [0, 1, 0] }));
view.addEventListener('change', ({ detail }) => {
  const state: VantageState = detail;
  const at: Point | undefined = state.pose?.position;
  console.log(at?.[0].toFixed(2), state.status.length, state.atRest);
});
view.addEventListener('error', ({ detail }) => console.log(detail.toUpperCase()));

export async function saved(): Promise<[Blob, string]> {
  await view.pause();
  await view.hide(3, 4);
  await view.cut({ normal: [0, 1, 0], offset: (await view.staging()).time ?? 0 });
  return [await view.picture({ width: 3840, height: 2160 }), await view.link()];
}

// @ts-expect-error A point has three numbers.
view.goTo({ eye: [0, 1], target: [0, 0, 0] });
// @ts-expect-error What is shown is told, and not set.
view.state = null;
