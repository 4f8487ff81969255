// Tests of what is the same whichever way the page draws: dialogs, words, keys, connections.

/** By the renderer that software draws faster. */
const BY = 'webgl2';

/** Names a test that is run by one renderer alone. */
export const once = (name) => ({ name, isOnce: true });

/** Those that are run by a renderer, [name, run], of tests of which some are named by `once`. */
export function testsOf(renderer, tests) {
  return tests.filter(([{ isOnce }]) => !isOnce || renderer === BY).map(([name, run]) => [name.name ?? name, run]);
}
