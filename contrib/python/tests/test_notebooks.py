"""That the notebooks are kept without what they print, and Fig. 5 takes ten lines."""

import json
import pathlib

NOTEBOOKS = sorted((pathlib.Path(__file__).parent.parent / "notebooks").glob("*.ipynb"))


def code(path: pathlib.Path) -> list[dict]:
    return [cell for cell in json.loads(path.read_text())["cells"] if cell["cell_type"] == "code"]


def test_the_notebooks_are_kept_without_output():
    assert [path.stem for path in NOTEBOOKS] == ["delay", "fig5", "trigger"]
    for path in NOTEBOOKS:
        for cell in code(path):
            assert cell["outputs"] == [] and cell["execution_count"] is None, path


def test_fig_5_takes_ten_lines():
    (fig5,) = [path for path in NOTEBOOKS if path.stem == "fig5"]
    lines = [line for cell in code(fig5) for line in cell["source"] if line.strip()]
    assert len(lines) == 10
    assert max(len(line) for line in lines) <= 130
