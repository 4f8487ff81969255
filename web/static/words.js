// The page's words in the reader's language: that of ?lang=, or the first of the browser's that there is. English is what the page and its WebAssembly say; another language is a table of that.
import german from './german.js';

const TABLES = { de: german };
const ATTRIBUTES = ['title', 'aria-label'];

function chosen() {
  const wished = [new URLSearchParams(location.search).get('lang'), ...navigator.languages].filter(Boolean);
  const known = wished.map((tag) => tag.slice(0, 2).toLowerCase()).find((tag) => tag === 'en' || tag in TABLES);
  return known ?? 'en';
}

export const language = chosen();
const table = new Map(Object.entries(TABLES[language] ?? {}));

/** Those with something that differs, as a search for it; the most particular ones first. */
const patterns = [...table].filter(([words]) => words.includes('{0}')).sort(([a], [b]) => b.replace(/\{\d\}/g, '').length - a.replace(/\{\d\}/g, '').length)
  .map(([words, said]) => [new RegExp(`^${words.replace(/[.*+?^$()|[\]\\]/g, '\\$&').replace(/\{\d\}/g, '(.+?)')}$`, 's'), said]);

/** Words in the page's language; what there are none for stays as it is. */
export function say(words) {
  const text = words.replace(/\s+/g, ' ').trim();
  const said = table.get(text);
  if (said !== undefined) return said;
  for (const [pattern, translated] of patterns) {
    const found = text.match(pattern);
    if (found) return translated.replace(/\{(\d)\}/g, (_, index) => say(found[Number(index) + 1]));
  }
  return words;
}

/** Says in the page's language all that stands on it. */
export function sayPage() {
  document.documentElement.lang = language;
  if (table.size === 0) return;
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  while (walker.nextNode()) {
    const { data } = walker.currentNode;
    const [before, after] = [data.match(/^\s*/)[0], data.match(/\s*$/)[0]];
    if (data.trim()) walker.currentNode.data = before + say(data.trim()) + after;
  }
  for (const name of ATTRIBUTES) document.querySelectorAll(`[${name}]`).forEach((element) => element.setAttribute(name, say(element.getAttribute(name))));
}
