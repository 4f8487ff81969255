
// The front end of a notebook's widget, around the element above: what Python sets becomes attributes, what is shown becomes `state`.
const NAMES = ['src', 'token', 'scene', 'eye', 'target', 'mode', 'fov', 'renderer', 'bare'];

function render({ model, el }) {
  const view = document.createElement('vantage-view');
  const set = (name) => {
    const value = model.get(name);
    if (value === null || value === undefined || value === false) view.removeAttribute(name);
    else view.setAttribute(name, value === true ? '' : String(value));
  };
  const size = () => Object.assign(view.style, { height: `${model.get('height_px')}px`, aspectRatio: 'auto' });
  const say = (name, value) => {
    model.set(name, value);
    model.save_changes();
  };
  const asked = async ({ ask, number, ...what }) => {
    try {
      if (ask === 'goTo') await view.goTo(what);
      if (ask === 'picture') {
        const file = await view.picture({ width: what.width ?? undefined, height: what.height ?? undefined });
        model.send({ number }, undefined, [await file.arrayBuffer()]);
      }
    } catch (error) {
      model.send({ number, error: error.message });
    }
  };
  const changes = NAMES.map((name) => [`change:${name}`, () => set(name)]);
  changes.push(['change:height_px', size], ['msg:custom', asked]);
  changes.forEach(([name, heard]) => model.on(name, heard));
  view.addEventListener('change', ({ detail }) => say('state', detail));
  view.addEventListener('error', ({ detail }) => say('error', detail));
  NAMES.forEach(set);
  size();
  el.append(view);
  return () => {
    changes.forEach(([name, heard]) => model.off(name, heard));
    view.remove();
  };
}

export default { render };
