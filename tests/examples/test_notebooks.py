"""Every notebook runs from its first cell to its last, and draws; its own assertions compare with closed forms and references."""
import base64
import os
import pathlib

import nbclient
import nbformat
import pytest

FOLDER = pathlib.Path(__file__).resolve().parents[2] / "client_examples" / "notebooks"
SECONDS = int(120 * float(os.environ.get("MBCOSIM_TIME_FACTOR", 1)))
NOTEBOOKS = sorted(FOLDER.glob("*.ipynb"))


def test_there_is_one_for_each_tutorial_and_three_on_coupling():
    assert [path.stem for path in NOTEBOOKS] == ["cantilever", "chain", "coupling_aerodynamics", "coupling_controller", "coupling_two_daemons",
                                                 "hydraulic_actuator", "modal_body", "piezo", "rigid_body", "three_pendulums"]


@pytest.mark.parametrize("path", NOTEBOOKS, ids=lambda path: path.stem)
def test_notebook(path):
    notebook = nbformat.read(path, as_version=4)
    nbformat.validate(notebook)
    code = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert all(not cell.outputs and cell.execution_count is None for cell in code)  # as it is to be committed
    assert any("assert" in cell.source for cell in code)
    nbclient.NotebookClient(notebook, timeout=SECONDS, kernel_name="python3", resources={"metadata": {"path": str(FOLDER)}}).execute()
    pictures = [output for cell in code for output in cell.outputs if "image/png" in output.get("data", {})]
    assert len(pictures) >= 1
    folder = os.environ.get("MBCOSIM_PICTURES")
    if folder:
        os.makedirs(folder, exist_ok=True)
        for k, output in enumerate(pictures):
            pathlib.Path(folder, f"notebook_{path.stem}_{k + 1}.png").write_bytes(base64.b64decode(output["data"]["image/png"]))
