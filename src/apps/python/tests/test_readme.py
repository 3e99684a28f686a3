"""The README's code runs as it stands."""

import re
from pathlib import Path


def test_the_readme_runs(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    text = (Path(__file__).parent.parent / "README.md").read_text()
    blocks = re.findall(r"```python\n(.*?)```", text, re.S)
    assert len(blocks) == 5
    names = {}
    for block in blocks:
        exec(block, names)
    assert (tmp_path / "ball.png").stat().st_size > 2000
    assert names["file"].keys() == ["density"]
    assert names["light"].transmittance(names["points"]).min() < 0.5
