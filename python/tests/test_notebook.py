"""The example notebook runs."""

from pathlib import Path

import nbformat
import pytest
from nbclient import NotebookClient

import grainscope

NOTEBOOK = Path(__file__).parent.parent / "notebooks" / "silo.ipynb"


def test_the_notebook_runs_and_is_kept_without_outputs(
    program: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("GRAINSCOPE", program)
    notebook = nbformat.read(NOTEBOOK, as_version=4)
    cells = [cell for cell in notebook.cells if cell.cell_type == "code"]
    assert not any(cell.outputs or cell.execution_count for cell in cells)
    NotebookClient(notebook, timeout=60, resources={"metadata": {"path": tmp_path}}).execute()
    figures = [o for cell in cells for o in cell.outputs if "image/png" in o.get("data", {})]
    assert len(figures) == 2
    soft, stiff = (grainscope.load(tmp_path / "runs" / name) for name in ("soft", "stiff"))
    # A larger internal length slows the discharge down.
    assert stiff.series.outflow_rate[0] < 0.8 * soft.series.outflow_rate[0]
    assert stiff.series.outflow_volume.iloc[-1] < soft.series.outflow_volume.iloc[-1]
