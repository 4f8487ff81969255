"""Runs the example as a notebook would, and looks at what it shows. Arguments: the example."""

import sys

import nbclient
import nbformat

notebook = nbformat.read(sys.argv[1], as_version=4)
nbclient.NotebookClient(notebook, timeout=120, kernel_name="python3").execute()
shown = [output for cell in notebook.cells if cell.cell_type == "code" for output in cell.outputs]
assert all(output.output_type != "error" for output in shown), shown
assert any("application/vnd.jupyter.widget-view+json" in output.get("data", {}) for output in shown), "no widget is shown"
widgets = notebook.metadata["widgets"]["application/vnd.jupyter.widget-state+json"]["state"]
view = next(widget["state"] for widget in widgets.values() if "_esm" in widget["state"])
assert view["src"] == "ws://127.0.0.1:8080/ws" and view["height_px"] == 400, view
assert "customElements.define('vantage-view'" in view["_esm"] and "export default { render }" in view["_esm"]
print("the example runs, and shows a view")
