// What the page's own scripts share.

export const byId = (id) => document.getElementById(id);

export function openDialog(id) {
  if (byId(id).open) return;
  byId(id).showModal();
  // Its words first, and then its buttons. A frame within another page may not say so by an attribute.
  byId(id).focus();
  byId(id).scrollTop = 0;
}

export const megabytes = (bytes) => `${(bytes / (1 << 20)).toFixed(bytes < 10 << 20 ? 1 : 0)} MB`;

/** A file of a picture that `photo` takes. */
export async function pngOf(photo, width, height) {
  const canvas = document.createElement('canvas');
  Object.assign(canvas, { width, height });
  canvas.getContext('2d').putImageData(await photo(width, height), 0, 0);
  const file = await new Promise((resolve) => canvas.toBlob(resolve, 'image/png'));
  if (!file) throw new Error('the browser makes no picture of that size');
  return file;
}
