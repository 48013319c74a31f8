"""That the examples of docs/python.md run, one after the other."""

import pathlib
import re
import shutil

import matplotlib

DOCUMENT = pathlib.Path(__file__).parents[3] / "docs" / "python.md"


def test_every_example_of_the_document_runs(recorded, tmp_path, monkeypatch):
    matplotlib.use("agg")
    monkeypatch.chdir(tmp_path)
    shutil.copy(recorded, "run.mcap")
    examples = re.findall(r"^```python\n(.*?)^```", DOCUMENT.read_text(), re.DOTALL | re.MULTILINE)
    assert len(examples) == 7
    names: dict[str, object] = {}
    for example in examples:
        exec(compile(example, str(DOCUMENT), "exec"), names)
