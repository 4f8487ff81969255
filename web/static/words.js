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

/** What differs stands for anything, which stays as it is ({0}), is looked up as well ({0~}), or is a number with a unit ({0#}). */
const MARK = /\{(\d)([~#]?)\}/g;
const searchFor = (words) => words.split(/(\{\d[~#]?\})/).map((part, index) => {
  if (index % 2 === 0) return part.replace(/[.*+?^$(){}|[\]\\]/g, '\\$&');
  return part.endsWith('#}') ? '([\\d.]+(?: [A-Za-z]+)?)' : '(.+?)';
}).join('');
const length = (words) => words.replace(MARK, '').length;

/** Those with something that differs, as a search for it; the most particular ones first. */
const patterns = [...table].filter(([words]) => words.match(MARK)).sort(([a], [b]) => length(b) - length(a))
  .map(([words, said]) => ({ pattern: new RegExp(`^${searchFor(words)}$`, 's'), said, lookedUp: words.includes('~}') ? [...words.matchAll(MARK)].map(([, , kind]) => kind === '~') : [] }));

/** Words in the page's language; what there are none for stays as it is. */
export function say(words) {
  const text = words.replace(/\s+/g, ' ').trim();
  const said = table.get(text);
  if (said !== undefined) return said;
  for (const { pattern, said: translated, lookedUp } of patterns) {
    const found = text.match(pattern);
    if (found) return translated.replace(MARK, (_, index) => (lookedUp[index] ? say(found[Number(index) + 1]) : found[Number(index) + 1]));
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
