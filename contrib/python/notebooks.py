#!/usr/bin/env python3
"""Runs notebooks from beginning to end and keeps nothing of it: `notebooks.py FILE…`. One that fails is named with its error."""

import pathlib
import sys
import time

import nbformat
from nbclient import NotebookClient


def main(files: list[str]) -> None:
    for name in files:
        path = pathlib.Path(name)
        notebook = nbformat.read(path, as_version=4)
        began = time.monotonic()
        NotebookClient(notebook, timeout=1200, kernel_name="python3").execute()
        figures = sum("image/png" in output.get("data", {}) for cell in notebook.cells for output in cell.get("outputs", []))
        if figures == 0:
            sys.exit(f"{path.name}: it drew no figure")
        print(f"{path.name}: {figures} figures, {time.monotonic() - began:.1f} s", file=sys.stderr)


if __name__ == "__main__":
    main(sys.argv[1:])
