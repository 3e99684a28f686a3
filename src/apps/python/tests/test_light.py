"""The light that arrives, against closed forms."""

import html
import json
import os
import subprocess

import numpy as np
import pytest

import deepshadow as ds

SIGMA = 0.7


def slab(tint=(1.0, 1.0, 1.0)):
    """A uniform slab that light crosses along -y: 20 voxels of 0.1, density 1."""
    volume = ds.Volume(np.ones((20, 20, 20), np.float32), spacing=0.1)
    table = {"density_scale": SIGMA, "tint": tint}
    return ds.Scene(volume, volume=table, light=(0.0, -1.0, 0.0))


def points(count=50):
    y = np.linspace(-0.04, 1.94, count)
    return np.stack([np.full(count, 0.95), y, np.full(count, 0.95)], axis=1)


def beer_lambert(at):
    return np.exp(-SIGMA * (1.95 - at[:, 1]))


def test_the_truth_follows_beer_and_lambert():
    found = ds.transmittance(slab(), points(), exact=True, backend="cpu")
    assert found.shape == (50, 1, 3) and found.dtype == np.float32
    assert np.abs(found[:, 0, 1] - beer_lambert(points())).max() < 1e-6


@pytest.mark.parametrize("kind, tolerance, bound", [
    ("fragments", 0.002, 0.002), ("fragments", 0.01, 0.01),
])
def test_maps_keep_their_tolerance(kind, tolerance, bound):
    found = ds.shadow_map(slab(), kind=kind, size=32, tolerance=tolerance, backend="cpu")
    assert (found.kind, found.size, found.parts) == (kind, 32, 1)
    light = found.transmittance(points())
    # Steps end at depths of 32 bits.
    assert np.abs(light - beer_lambert(points())).max() <= bound + 1e-5


def test_lists_are_the_map():
    found = ds.shadow_map(slab(), size=16, backend="cpu")
    offsets, depth, optical_depth = found.lists()
    assert offsets.shape == (16 * 16 + 1,) and offsets[-1] == len(depth) == len(optical_depth)
    for t in range(16 * 16):
        nodes = slice(offsets[t], offsets[t + 1])
        assert (np.diff(depth[nodes]) >= 0).all() and (np.diff(optical_depth[nodes]) >= 0).all()
    middle = 8 * 16 + 8
    last = optical_depth[offsets[middle + 1] - 1]
    # Two world lengths of it.
    assert last == pytest.approx(SIGMA * 2.0, rel=0.01)


def test_colours_are_three_columns():
    found = ds.shadow_map(slab(tint=(1.0, 0.5, 0.0)), size=16, backend="cpu")
    light = found.transmittance(points())
    assert light.shape == (50, 3) and (light[:, 2] == 1.0).all()
    assert np.abs(light[:, 1] - np.sqrt(beer_lambert(points()))).max() < 0.003


def test_points_that_are_none():
    built = ds.shadow_map(slab(), size=8, backend="cpu")
    assert built.transmittance(np.zeros((0, 3))).shape == (0,)
    for bad in [np.zeros(2), np.zeros((2, 2)), 3.0, [["a", "b", "c"]], [[0.0, np.nan, 0.0]]]:
        with pytest.raises(ValueError, match="points"):
            built.transmittance(bad)
        with pytest.raises(ValueError, match="points"):
            ds.transmittance(slab(), bad, backend="cpu")
    with pytest.raises(ValueError, match="none of the scene's 1 lights"):
        ds.shadow_map(slab(), light_index=3, backend="cpu")
    with pytest.raises(ValueError, match="threshold"):
        ds.shadow_map(slab(), kind="threshold", size=8, backend="cpu").lists()


def test_points_have_any_shape():
    built = ds.shadow_map(slab(), size=16, backend="cpu")
    rows = points()
    one = built.transmittance(rows[7])
    assert one.shape == () and one == built.transmittance(rows)[7]
    assert np.array_equal(built.transmittance(rows.reshape(5, 10, 3)),
                          built.transmittance(rows).reshape(5, 10))
    truth = ds.transmittance(slab(), rows.reshape(5, 10, 3), exact=True, backend="cpu")
    assert truth.shape == (5, 10, 1, 3)


def test_maps_are_saved_as_the_program_does(tmp_path):
    """Both write the same file, but for the program's own name of the input."""
    def program(*arguments):
        command = [os.environ["DEEPSHADOW"], "map", *arguments, "--backend", "cpu", "--quiet"]
        subprocess.run(command, check=True, cwd=tmp_path)

    for kind in ["threshold", "fragments", "nested"]:
        program("bucky", "--map", kind, "--map-size", "32", "-o", f"{kind}.exr")
        built = ds.shadow_map("bucky", kind=kind, size=32, backend="cpu")
        assert built.save(tmp_path / "own.exr") == [tmp_path / "own.exr"]
        assert (tmp_path / "own.exr").read_bytes() == (tmp_path / f"{kind}.exr").read_bytes()
    coloured = ds.shadow_map(slab(tint=(1.0, 0.5, 0.0)), size=8, backend="cpu")
    saved = coloured.save(tmp_path / "c.exr")
    assert len(saved) == coloured.parts == len(set(saved)) and all(p.exists() for p in saved)
    with pytest.raises(ValueError, match="does not end in .exr"):
        built.save(tmp_path / "own.png")
    grid = ds.shadow_map("bucky", kind="grid:16", size=8, backend="cpu")
    with pytest.raises(ValueError, match="not written to files"):
        grid.save(tmp_path / "grid.exr")
    assert not (tmp_path / "grid.exr").exists()


def test_threshold_maps_show_their_depths():
    found = ds.shadow_map(slab(), kind="threshold", size=16, backend="cpu")
    depths = found.thresholds
    assert depths.shape == (16, 16, 4)
    middle = depths[8, 8]
    # Depths between 10 and 50 % are apart by ln(0.9 / 0.5) / sigma.
    assert middle[1] - middle[0] == pytest.approx(np.log(0.9 / 0.5) / SIGMA, abs=0.01)
    assert middle[3] == pytest.approx(1 - np.exp(-SIGMA * 2.0), abs=0.005)
    # 90 % are never lost; it is the depth of 85 % of A.
    crossed = -np.log(1 - 0.85 * middle[3]) / SIGMA
    assert middle[2] - middle[0] == pytest.approx(crossed + np.log(0.9) / SIGMA, abs=0.01)


def test_a_chosen_map_keeps_its_limit():
    found = ds.choose("bucky", max_error=0.01, backend="cpu")
    assert found.certificate and found.certificate.count("\n") == 0
    rng = np.random.default_rng(5)
    at = rng.uniform(-0.3, 0.3, (4000, 3))
    light = found.transmittance(at)
    truth = ds.transmittance("bucky", at, exact=True, backend="cpu")[:, 0, 0]
    assert np.sqrt(np.mean((light - truth) ** 2)) < 0.02
    assert ds.choose("bucky", max_bytes=65536, backend="cpu").bytes <= 65536
    given = ds.choose("bucky", max_error=0.05, backend="cpu", map="threshold", shadow={"size": 128})
    assert (given.kind, given.size) == ("threshold", 128)
    with pytest.raises(ValueError, match="max_error"):
        ds.choose("bucky", backend="cpu")
    with pytest.raises(ValueError, match="max_error"):
        ds.choose("bucky", max_error=-1, backend="cpu")
    # Grids have no texels; they count by those that are asked for.
    assert ds.choose("bucky", max_bytes="4/texel", size=16, backend="cpu").bytes <= 4 * 16 * 16
    with pytest.raises(ValueError, match="^max_bytes: "):
        ds.choose("bucky", max_bytes="much", backend="cpu")


def test_comparisons_are_records():
    rows = ds.compare("bucky", maps="threshold,fragments@0.01,fragments@0.001", map_size=64,
                      points=5000, size=32)
    assert [set(row) for row in rows] == [set(rows[0])] * 4
    by = {row["method"]: row for row in rows}
    assert by["fragments@0.001"]["rays_rms"] < by["fragments@0.01"]["rays_rms"] <= 0.01
    assert by["threshold"]["bytes"] == 16 * 64 * 64
    assert by["exact texels"]["rays_rms"] < 1e-6
    with pytest.raises(ValueError, match="nothing"):
        ds.compare("bucky", maps="nothing")
    for points in [0, 10**12, 10**19]:
        with pytest.raises(ValueError, match="points"):
            ds.compare("bucky", maps="threshold", points=points)
    with pytest.raises(MemoryError):
        ds.shadow_map("bucky", size=8192, kind="slices-float:1024", backend="cpu")


def test_lights_are_what_they_say():
    def light(given):
        at = [[0.1, -0.5, 0.1], [0.3, -0.5, 0.2]]
        return ds.transmittance("bucky", at, exact=True, light=given, backend="cpu")[:, 0, 0]

    assert np.array_equal(light({"position": [0.3, 1.5, 0.4]}),
                          light({"kind": "point", "position": [0.3, 1.5, 0.4]}))
    assert not np.array_equal(light({"position": [0.3, 1.5, 0.4]}), light({}))
    both = ds.Scene(slab(), light=[(0, -1, 0), {"direction": (-1, -1, 0)}])
    assert ds.transmittance(both, points(), exact=True, backend="cpu").shape == (50, 2, 3)
    with pytest.raises(ValueError, match="darkness"):
        ds.Scene(slab(), light=[])


def test_comparisons_are_reports(tmp_path):
    found = ds.compare("bucky", maps="threshold,moments:4", map_size=32, points=2000, size=16)
    assert len(found) == 3 and found[-1] == list(found)[2]
    shown = found._repr_html_()
    assert shown.startswith("<iframe srcdoc=") and shown.count('"') == 8
    assert html.unescape(shown.split('"')[1]) == found.html
    found.save(tmp_path / "report")
    names = {path.name: path.read_text() for path in (tmp_path / "report").iterdir()}
    assert names == {"report.html": found.html, "results.csv": found.csv,
                     "results.json": found.json}
    methods = {row["label"] for row in json.loads(found.json)["methods"]}
    assert methods == {row["method"] for row in found} - {"exact texels"}
    with pytest.raises(ValueError):
        found.save(tmp_path)
