"""A view of a remote 3-D scene in a notebook.

The widget is the element that pages have (`vantage-view.js`), which `cargo xtask package` puts beside this file.
"""

from pathlib import Path

import anywidget
import traitlets

__all__ = ["View"]

_HERE = Path(__file__).parent


def _point():
    return traitlets.Tuple(
        traitlets.Float(), traitlets.Float(), traitlets.Float(), default_value=None, allow_none=True
    ).tag(sync=True)


def _text():
    return traitlets.Unicode(None, allow_none=True).tag(sync=True)


class View(anywidget.AnyWidget):
    """A view of what a server shows. Lengths are in metres, y is up.

    `src` is the server's address; the rest is what the server's page takes in its own address. A change of one of them loads anew. `state` is what the view shows, as it
    was told last: `picture`, `connected`, `status`, `scene`, `pose`, `mode`, `atRest`, `samples` and rates; empty before.
    """

    _esm = (_HERE / "vantage-view.js").read_text() + (_HERE / "widget.js").read_text()

    src = traitlets.Unicode("ws://127.0.0.1:8080/ws").tag(sync=True)
    token = _text()
    scene = _text()
    eye = _point()
    target = _point()
    mode = traitlets.Enum(["walk", "turn"], default_value=None, allow_none=True).tag(sync=True)
    fov = traitlets.Float(None, allow_none=True).tag(sync=True)
    renderer = traitlets.Enum(["webgpu", "webgl2"], default_value=None, allow_none=True).tag(sync=True)
    bare = traitlets.Bool(False).tag(sync=True)
    height_px = traitlets.Int(480, min=64).tag(sync=True)
    state = traitlets.Dict().tag(sync=True)
    error = traitlets.Unicode("").tag(sync=True)

    def __init__(self, **settings):
        super().__init__(**settings)
        self._files = {}
        self.on_msg(self._answered)

    def go_to(self, eye, target):
        """Goes to where a point is seen from another."""
        self.send({"ask": "goTo", "eye": list(map(float, eye)), "target": list(map(float, target))})

    def save_picture(self, path, width_px=None, height_px=None):
        """Saves a PNG of the view as it is now, once the browser has drawn it: of any size up to 7,680 pixels a side; without one as large as the view."""
        number = len(self._files)
        self._files[number] = Path(path)
        self.send({"ask": "picture", "number": number, "width": width_px, "height": height_px})

    def _answered(self, _widget, message, buffers):
        if "error" in message:
            self.error = message["error"]
        elif message.get("number") in self._files:
            self._files[message["number"]].write_bytes(bytes(buffers[0]))
