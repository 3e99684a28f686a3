"""Sequences, frame by frame."""

import os
import pickle
import subprocess

import numpy as np
import pytest

import deepshadow as ds

PROGRAM = os.environ["DEEPSHADOW"]


def frames(tmp_path, numbers=(1, 2, 3)):
    z, y, x = np.mgrid[:16, :16, :16] - 7.5
    for number in numbers:
        ball = np.maximum(0, 1 - np.sqrt(x * x + y * y + z * z) / (2 * number)).astype(np.float32)
        ds.write(tmp_path / f"ball.{number:04}.vdb", ball, name="density", background=0.0)
    return tmp_path / "ball.####.vdb"


def test_frames_are_the_programs(tmp_path):
    name = frames(tmp_path)
    command = [PROGRAM, "render", str(name), "--backend", "cpu", "--size", "48x48", "--quiet",
               "-o", "out.####.npy"]
    subprocess.run(command, check=True, cwd=tmp_path)
    scene = ds.Scene(name, size=48)
    assert scene.frames == [1, 2, 3]
    shot = scene.shot()
    again = ds.Scene.from_toml(shot.to_toml())
    for frame in scene.frames:
        expected = np.load(tmp_path / f"out.{frame:04}.npy")
        assert np.array_equal(ds.render(shot, frame=frame, backend="cpu").array, expected)
        assert np.array_equal(ds.render(again, frame=frame, backend="cpu").array, expected)
    # Chosen for each by itself, they differ.
    alone = ds.render(scene, frame=1, backend="cpu").array
    assert not np.array_equal(alone, np.load(tmp_path / "out.0001.npy"))


def test_text_of_a_scene_keeps_its_surroundings(tmp_path):
    frames(tmp_path, [1])
    scene = ds.Scene(tmp_path / "ball.0001.vdb", volume={"density_scale": 2.0}, size=32,
                     camera={"elevation_degrees": -20})
    again = ds.Scene.from_toml(scene.to_toml())
    picture = ds.render(scene, backend="cpu").array
    assert picture[0, 0, 2] > 0.05 and np.array_equal(ds.render(again, backend="cpu").array, picture)


def test_keyframes_and_turns_are_sequences():
    keyed = ds.Scene("bucky", light={"keyframes": [{"frame": 1, "direction": [0, -1, 0]},
                                                   {"frame": 4, "direction": [-1, 0, 0]}]})
    assert keyed.frames == [1, 2, 3, 4]
    first, last = (ds.shadow_map(keyed, frame=f, size=8, backend="cpu") for f in (1, 4))
    at = [[0.2, 0.1, 0.1]]
    assert first.transmittance(at) != last.transmittance(at)
    around = ds.Scene("bucky", size=24).shot(turns=4)
    # The fifth would be the first again.
    assert around.frames == [1, 2, 3, 4, 5]
    pictures = [ds.render(around, frame=f, backend="cpu").array for f in (1, 3)]
    assert not np.array_equal(*pictures)


def test_frames_that_are_none(tmp_path):
    assert ds.Scene("bucky").frames == []
    with pytest.raises(ValueError, match="frame: the scene has none"):
        ds.render("bucky", frame=1)
    with pytest.raises(ValueError, match="frame"):
        ds.Scene("bucky").shot()
    name = frames(tmp_path, [2])
    with pytest.raises(ValueError, match="say which frame"):
        ds.render(name)
    with pytest.raises(FileNotFoundError):
        ds.render(name, frame=7)
    with pytest.raises(ValueError, match="no file has a name like this"):
        ds.Scene(tmp_path / "none.##.vdb").frames
    with pytest.raises(TypeError):
        ds.render(name, frame="two")
    for turns in [0, 1, 2**31 - 1]:
        with pytest.raises(ValueError, match="turns"):
            ds.Scene("bucky").shot(turns=turns)
    with pytest.raises(ValueError, match="frames: there is none"):
        ds.Scene(name).shot([])


def test_scenes_go_to_other_processes(tmp_path, monkeypatch):
    frames(tmp_path, [1, 2])
    monkeypatch.chdir(tmp_path)
    ball = np.zeros((8, 8, 8), np.float32)
    ball[2:6, 2:6, 2:6] = 1
    floor = ds.Mesh([[-9, -2, -9], [9, -2, -9], [0, -2, 9]], [[0, 1, 2]])
    of_files = ds.Scene("ball.####.vdb", size=24, volume={"density_scale": 2.0}).shot()
    in_memory = ds.Scene(ball, mesh={"array": floor, "albedo": (1, 0, 0)}, size=24,
                         camera={"elevation_degrees": -10})
    for scene, frame in [(of_files, 2), (in_memory, None)]:
        expected = ds.render(scene, frame=frame, backend="cpu").array
        text = pickle.dumps(scene)
        (tmp_path / "elsewhere").mkdir(exist_ok=True)
        with monkeypatch.context() as there:
            there.chdir(tmp_path / "elsewhere")
            again = pickle.loads(text)
            assert np.array_equal(ds.render(again, frame=frame, backend="cpu").array, expected)
    # What is added to one that came has another name.
    more = ds.Scene(pickle.loads(pickle.dumps(in_memory)), hair=ds.Strands(
        np.random.rand(2, 3, 3), thickness=0.1))
    assert "surfaces 2" in repr(more)
    with pytest.raises(ValueError, match="in memory"):
        in_memory.to_toml()
