"""Pictures are the program's, to the bit."""

import os
import re
import subprocess

import numpy as np
import pytest

import deepshadow as ds

PROGRAM = os.environ["DEEPSHADOW"]


def program(tmp_path, *arguments):
    out = tmp_path / "program.npy"
    command = [PROGRAM, "render", *map(str, arguments), "--backend", "cpu", "-o", str(out), "--quiet"]
    subprocess.run(command, check=True, cwd=tmp_path)
    return np.load(out)


def cloud():
    z, y, x = np.mgrid[:24, :20, :28].astype(np.float32)
    soft = 1 - ((x - 13) / 13) ** 2 - ((y - 9) / 9) ** 2 - ((z - 11) / 11) ** 2
    return (np.maximum(soft, 0) * (1 + 0.5 * np.sin(x) * np.cos(y))).astype(np.float32)


@pytest.mark.parametrize("preset", ["bucky", "clouds"])
def test_presets_are_the_programs(tmp_path, preset):
    image = ds.render(preset, backend="cpu", size=(96, 64))
    assert image.array.shape == (64, 96, 4) and image.array.dtype == np.float32
    assert np.array_equal(image.array, program(tmp_path, preset, "--size", "96x64"))


def test_arrays_are_files_of_them(tmp_path):
    array = cloud()
    np.save(tmp_path / "cloud.npy", array)
    image = ds.render(array, backend="cpu", size=80)
    assert np.array_equal(image.array, program(tmp_path, "cloud.npy", "--size", "80x80"))


def test_grids_are_files_of_them(tmp_path):
    volume = ds.Volume(cloud(), name="density", background=0.0, grid_class="fog volume", spacing=0.1)
    ds.write(tmp_path / "cloud.vdb", volume)
    image = ds.render(volume, backend="cpu", size=80)
    expected = program(tmp_path, "cloud.vdb", "--size", "80x80")
    assert np.array_equal(image.array, expected)
    assert np.array_equal(ds.render(ds.read(tmp_path / "cloud.vdb"), backend="cpu", size=80).array,
                          expected)


def test_tables_are_those_of_scene_files(tmp_path):
    np.save(tmp_path / "cloud.npy", cloud())
    text = """
[volume]
path = "cloud.npy"
density_scale = 0.4
[light]
direction = [-1.0, -1.0, 0.2]
irradiance = [3.0, 2.0, 1.0]
[shadow]
map = "threshold"
size = 64
[image]
width = 64
height = 48
"""
    (tmp_path / "scene.toml").write_text(text)
    expected = program(tmp_path, "scene.toml")
    for scene in [
        ds.Scene.from_toml(text, tmp_path),
        ds.Scene({
            "volume": {"array": cloud(), "density_scale": 0.4},
            "light": {"direction": (-1.0, -1.0, 0.2), "irradiance": np.array([3.0, 2.0, 1.0])},
            "shadow": {"map": "threshold", "size": 64},
            "image": {"width": 64, "height": 48},
        }),
        tmp_path / "scene.toml",
    ]:
        assert np.array_equal(ds.render(scene, backend="cpu").array, expected)


def test_what_was_chosen_repeats_the_picture(tmp_path):
    ds.write(tmp_path / "cloud.npy", cloud())
    image = ds.render(tmp_path / "cloud.npy", backend="cpu", size=64)
    assert any("density_scale" in what for what in image.choices)
    again = ds.render(ds.Scene.from_toml(image.to_toml()), backend="cpu")
    assert np.array_equal(again.array, image.array)
    for scene in [ds.Scene(cloud()), ds.render(cloud(), backend="cpu", size=8)]:
        with pytest.raises(ValueError, match="in memory"):
            scene.to_toml()


def test_pictures_as_files(tmp_path):
    image = ds.render(cloud(), backend="cpu", size=(40, 30), background=(0, 0, 0))
    assert image.png()[:8] == b"\x89PNG\r\n\x1a\n" == image._repr_png_()[:8]
    assert image.png(exposure=2.0) != image.png() != image.png(exposure="-1ev")
    image.save(tmp_path / "a.exr")
    image.save(tmp_path / "a.npy")
    assert np.array_equal(np.load(tmp_path / "a.npy"), image.array)
    with pytest.raises(ValueError, match="must end in"):
        image.save(tmp_path / "a.txt")


def test_light_camera_and_ground_in_short(tmp_path):
    ds.write(tmp_path / "cloud.npy", cloud())
    image = ds.render(tmp_path / "cloud.npy", backend="cpu", size=48, light=(0, -1, 0.5),
                      ground=None, transfer="fire")
    expected = program(tmp_path, "cloud.npy", "--size", "48x48", "--light", "0,-1,0.5",
                       "--ground", "none", "--transfer", "fire")
    assert np.array_equal(image.array, expected)


def test_inputs_that_are_not_there():
    with pytest.raises(FileNotFoundError, match="no such file, and not one of the presets"):
        ds.render("cloud", backend="cpu")


def test_containers_that_hold_themselves():
    table, several = {}, []
    table["light"] = table
    several.append(several)
    class Itself:
        def tolist(self):
            return self

    for scene in [table, {"light": several}, {"light": Itself()}]:
        with pytest.raises(ValueError, match="nested too deeply"):
            ds.Scene(scene)
    with pytest.raises(ValueError):
        ds.Scene(volume=several)


@pytest.mark.parametrize("tables, what", [
    ({"size": -1}, "no number of pixels"),
    ({"colour": 3}, "colour"),
    ({"light": {"directoin": (1, 0, 0)}}, "directoin"),
    ({"shadow": {"size": 0}}, "size"),
    ({"map": "none"}, "none"),
    ({"light": (0, 0, 0)}, "light"),
    ({"light": {"direction": (float("nan"), 0, 0)}}, "finite"),
    ({"backend": "tpu"}, "tpu"),
    ({"volume": object()}, "object"),
])
def test_mistakes_have_one_line(tables, what):
    with pytest.raises(ValueError, match=what) as caught:
        ds.render("box", **{"backend": "cpu", "size": 16, **tables})
    assert "\n" not in str(caught.value)


def test_the_keys_that_help_lists_are_those_of_scene_files():
    text = ds.Scene.__doc__.split("The keys of the tables")[1].split("`light` and `camera`")[0]
    seen = 0
    for line in text.split("\n- ")[1:]:
        names, keys = line.split(":", 1)
        keys = re.sub(r'"[a-z]+"', "", keys)
        inner = {table: re.findall("[a-z_]+", listed)
                 for table, listed in re.findall(r"(transfer|emission) \(([^)]*)\)", keys)}
        outer = set(re.findall("[a-z_]+", re.sub(r"\([^)]*\)", "", keys))) | {"path"}
        outer -= {"or", "of", "also", "hair"}
        for name in names.split(" and "):
            if name not in ("volume", "mesh", "hair"):
                outer.discard("path")
            for key in outer:
                assert is_known({name: {key: NOTHING}}, key), (name, key)
            for table, listed in inner.items():
                for key in listed:
                    assert is_known({name: {table: {key: NOTHING}}}, key), (table, key)
            assert not is_known({name: {"no_such_key": NOTHING}}, "no_such_key")
            seen += len(outer)
    assert seen > 70


NOTHING = [[[[]]]]


def is_known(tables, key):
    """Whether tables with a value that no key can have are refused for another reason."""
    with pytest.raises(ValueError) as error:
        ds.Scene(**tables)
    return f"unknown field `{key}`" not in str(error.value)
