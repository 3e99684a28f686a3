"""The notebooks run from the first cell to the last, and end in pictures."""

import json
from pathlib import Path

import pytest

import deepshadow as ds

NOTEBOOKS = Path(__file__).parent.parent / "notebooks"


@pytest.mark.parametrize("name, files", [
    ("volumes", {"puff.vdb", "cut.vdb"}),
    ("shadows", {f"plume.{number}.png" for number in range(6)}),
])
def test_notebooks_run(tmp_path, monkeypatch, name, files):
    monkeypatch.chdir(tmp_path)
    notebook = json.loads((NOTEBOOKS / f"{name}.ipynb").read_text())
    names, pictures = {}, 0
    for cell in notebook["cells"]:
        if cell["cell_type"] != "code":
            continue
        assert cell["outputs"] == [], "outputs are not kept in the repository"
        *lines, last = "".join(cell["source"]).rstrip().split("\n")
        try:
            code = compile(last, name, "eval")
        except SyntaxError:
            exec("\n".join([*lines, last]), names)
            continue
        exec("\n".join(lines), names)
        value = eval(code, names)
        pictures += isinstance(value, ds.Image) and len(value.png()) > 2000
    assert pictures >= 1
    assert {path.name for path in tmp_path.iterdir()} == files
