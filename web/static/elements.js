// What the page's own scripts share.

export const byId = (id) => document.getElementById(id);

export function openDialog(id) {
  if (!byId(id).open) byId(id).showModal();
}

export const megabytes = (bytes) => `${(bytes / (1 << 20)).toFixed(bytes < 10 << 20 ? 1 : 0)} MB`;
