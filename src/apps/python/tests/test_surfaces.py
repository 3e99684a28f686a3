"""Meshes and hair as arrays."""

import os
import pickle
import subprocess

import numpy as np
import pytest

import deepshadow as ds

PROGRAM = os.environ["DEEPSHADOW"]


def pane(half=1.0, height=0.0, **how):
    """A horizontal square."""
    corners = [[-half, height, -half], [half, height, -half], [half, height, half],
               [-half, height, half]]
    return ds.Mesh(corners, [[0, 1, 2], [2, 3, 0]], **how)


def curls(count=20, each=24, up="y", **how):
    t = np.linspace(0, 6, each)
    roots = np.random.default_rng(1).uniform(-1, 1, (count, 1, 2))
    x, z = roots[..., 0] + 0.1 * np.cos(t), roots[..., 1] + 0.1 * np.sin(t)
    axes = [x, np.broadcast_to(-t / 3, x.shape), z]
    if up == "z":
        axes = [axes[0], -axes[2], axes[1]]
    how = {"thickness": 0.02, "opacity": 0.5, **how}
    return ds.Strands(np.stack(axes, axis=-1), up=up, **how)


def program(tmp_path, *arguments):
    out = tmp_path / "program.npy"
    command = [PROGRAM, "render", *map(str, arguments), "--backend", "cpu", "-o", str(out), "--quiet"]
    subprocess.run(command, check=True, cwd=tmp_path)
    return np.load(out)


def test_a_pane_takes_the_share_that_it_says():
    scene = ds.Scene(pane(opacity=[0.25, 0.75]), light=(0, -1, 0))
    at = [[-0.5, -1, 0.2], [0.5, -1, -0.2], [0.5, 1, 0.2], [5, -1, 0]]
    light = ds.transmittance(scene, at, exact=True, backend="cpu")
    # The first triangle has the corner with x > 0 and z < 0.
    assert np.allclose(light[:, 0, 0], [0.25, 0.75, 1, 1], atol=1e-6)
    built = ds.shadow_map(scene, size=64, backend="cpu")
    assert np.allclose(built.transmittance(at), [0.25, 0.75, 1, 1], atol=0.003)


def test_arrays_are_what_was_given():
    normals = np.tile(np.float32([0, 0, 1]), (4, 1))
    mesh = pane(normals=normals, albedo=[[1, 0.5, 0.25], [0, 0, 1]], name="pane")
    assert mesh.positions.shape == (4, 3) and mesh.positions.dtype == np.float32
    assert mesh.triangles.tolist() == [[0, 1, 2], [2, 3, 0]]
    assert (mesh.normals == [0, 0, 1]).all() and mesh.normals.shape == (2, 3, 3)
    assert mesh.albedo.tolist() == [[1, 0.5, 0.25], [0, 0, 1]] and mesh.opacity.tolist() == [1, 1]
    assert pane().normals is None and pane(smooth_degrees=30).normals.shape == (2, 3, 3)
    hair = curls(3, 4, thickness=np.arange(12), albedo=(0.5, 0.25, 0.125))
    assert len(hair) == 3 and hair.counts.tolist() == [4, 4, 4] and hair.points.shape == (12, 3)
    assert hair.thickness.tolist() == list(range(12)) and hair.opacity == 0.5
    assert hair.albedo.tolist() == [0.5, 0.25, 0.125]
    assert ds.Strands(np.zeros((3, 3)), [1, 2], thickness=1).notes[0].endswith(": 1")
    ragged = ds.Strands(np.random.rand(7, 3), [4, 3], thickness=1)
    assert ragged.counts.tolist() == [4, 3]
    for own in [mesh, hair]:
        back = pickle.loads(pickle.dumps(own))
        for field in ["up", "name", "albedo", "opacity"]:
            assert np.array_equal(getattr(own, field), getattr(back, field))
    assert np.array_equal(pickle.loads(pickle.dumps(mesh)).normals, mesh.normals)


def test_files_are_read_as_they_were_written(tmp_path):
    mesh = pane(albedo=[[1, 0.5, 0.25], [0, 0, 1]], opacity=0.5)
    ds.write(tmp_path / "pane.glb", mesh)
    back = ds.read_surface(tmp_path / "pane.glb")
    assert isinstance(back, ds.Mesh) and back.up == "y" and back.notes == []
    assert np.array_equal(back.positions[back.triangles], mesh.positions[mesh.triangles])
    assert np.array_equal(back.albedo, mesh.albedo) and (back.opacity == 0.5).all()
    hair = curls(up="z")
    ds.write(tmp_path / "curls.hair", hair)
    back = ds.read_surface(tmp_path / "curls.hair")
    assert isinstance(back, ds.Strands) and back.up == "z" and back.opacity == 0.5
    assert np.array_equal(back.points, hair.points) and np.array_equal(back.counts, hair.counts)
    # Files of hair have z up, whatever the arrays have.
    ds.write(tmp_path / "turned.hair", curls(up="y"))
    assert np.allclose(ds.read_surface(tmp_path / "turned.hair").points, hair.points, atol=1e-6)
    with pytest.raises(ValueError, match=r"must end in \.hair"):
        ds.write(tmp_path / "curls.obj", hair)
    with pytest.raises(ValueError, match=r"must end in \.glb"):
        ds.write(tmp_path / "pane.vdb", mesh)
    with pytest.raises(ValueError, match="does not apply to meshes"):
        ds.write(tmp_path / "pane.glb", mesh, spacing=2)
    with pytest.raises(FileNotFoundError):
        ds.read_surface(tmp_path / "none.obj")


@pytest.mark.parametrize("up", ["y", "z"])
def test_hair_in_memory_looks_as_in_a_file(tmp_path, up):
    hair = curls(up=up)
    ds.write(tmp_path / "curls.hair", hair)
    image = ds.render(hair, backend="cpu", size=64)
    of_file = program(tmp_path, "curls.hair", "--size", "64x64")
    # Files of hair have z up; others are turned, and turned back in the last digit.
    assert np.abs(image.array - of_file).max() <= (0 if up == "z" else 1e-5)


def test_surfaces_stand_in_scenes_with_volumes(tmp_path):
    ds.write(tmp_path / "pane.glb", pane(0.3, 0.45, albedo=0.5))
    ds.write(tmp_path / "curls.hair", curls(5))
    text = """
[[volume]]
preset = "bucky"
[[mesh]]
path = "pane.glb"
opacity = 0.5
[[hair]]
path = "curls.hair"
scale = 0.2
[image]
width = 48
height = 48
"""
    (tmp_path / "scene.toml").write_text(text)
    image = ds.render("bucky", mesh={"array": pane(0.3, 0.45, albedo=0.5), "opacity": 0.5},
                      hair=[{"array": curls(5), "scale": 0.2}], size=48, backend="cpu")
    # The program's scene says neither light nor camera, and stands as the preset does.
    assert np.array_equal(image.array, program(tmp_path, "scene.toml"))
    as_path = ds.render("bucky", mesh=tmp_path / "pane.glb", size=48, backend="cpu")
    in_memory = ds.render("bucky", mesh=pane(0.3, 0.45, albedo=0.5), size=48, backend="cpu")
    assert np.array_equal(as_path.array, in_memory.array)


@pytest.mark.parametrize("make, said", [
    (lambda: ds.Mesh([[0, 0, 0]], [[0, 0, 1]]), "vertex 1 of 1"),
    (lambda: ds.Mesh([[0, 0]], [[0, 0, 0]]), "positions: has shape"),
    (lambda: ds.Mesh(np.zeros((3, 3)), [[0, 1, 2.5]]), "triangles: must be whole"),
    (lambda: ds.Mesh(np.zeros((3, 3)), [[0, 1, -1]]), "-1 is not"),
    (lambda: ds.Mesh(np.zeros((3, 3)), [0, 1, 2]), "triangles: has shape"),
    (lambda: ds.Mesh(np.zeros((3, 3)), np.zeros((0, 3), int)), "no triangles"),
    (lambda: ds.Mesh(np.full((3, 3), np.nan), [[0, 1, 2]]), "finite"),
    (lambda: pane(albedo=2), "albedo: is not in 0..1"),
    (lambda: pane(opacity=np.nan), "opacity"),
    (lambda: pane(opacity=[0.5, 2]), "opacity"),
    (lambda: pane(normals=np.zeros((3, 3))), "normals"),
    (lambda: pane(smooth_degrees=np.nan), "smooth_degrees"),
    (lambda: pane(up="w"), "up"),
    (lambda: ds.Strands(np.zeros((4, 3)), thickness=1), "counts"),
    (lambda: ds.Strands(np.zeros((4, 3)), [3], thickness=1), "3 points, but there are 4"),
    (lambda: ds.Strands(np.zeros((4, 3)), [2**40], thickness=1), "32 bits"),
    (lambda: ds.Strands(np.zeros((2, 2, 3)), [2, 2], thickness=1), "counts"),
    (lambda: ds.Strands(np.zeros((1, 2, 3)), thickness=-1), "thickness"),
    (lambda: ds.Strands(np.zeros((1, 2, 3)), thickness=np.nan), "thickness"),
    (lambda: ds.Strands(np.zeros((1, 2, 3)), thickness="thick"), "thickness"),
    (lambda: ds.Strands(np.zeros((0, 2, 3)), thickness=1), "no strands"),
    (lambda: ds.Strands(np.zeros((1, 2, 3)), thickness=1, opacity=[0.1, 0.2, 0.3]), "opacity"),
    (lambda: ds.render("bucky", mesh=curls()), "neither a Mesh"),
    (lambda: ds.render("bucky", hair=pane()), "neither Strands"),
    (lambda: ds.render("bucky", hair=3), "neither Strands"),
])
def test_what_is_wrong_is_said(make, said):
    with pytest.raises(ValueError, match=said):
        make()
