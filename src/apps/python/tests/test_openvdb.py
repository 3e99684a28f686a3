"""Against OpenVDB itself, where Blender's wheel (`pip install bpy`) brings it; else not run."""

import sys
from pathlib import Path

import numpy as np
import pytest

import deepshadow as ds

bpy = pytest.importorskip("bpy", reason="Blender's wheel is not installed")
for folder in Path(sys.prefix).glob("lib/python3*/site-packages/bpy/*/python/lib/python3*/*"):
    sys.path.append(str(folder))
vdb = pytest.importorskip("openvdb", reason="Blender's wheel has no OpenVDB")

GRIDS = [
    ("FloatGrid", np.float32), ("DoubleGrid", np.float64), ("Int32Grid", np.int32),
    ("Int64Grid", np.int64), ("BoolGrid", np.bool_),
]
VECTORS = [("Vec3SGrid", np.float32), ("Vec3DGrid", np.float64), ("Vec3IGrid", np.int32)]


def values(dtype, components=()):
    """Numbers of which half are zero."""
    rng = np.random.default_rng(3)
    array = rng.integers(-5, 6, (11, 9, 14, *components)).astype(dtype)
    keep = rng.random((11, 9, 14)) < 0.5
    return array * keep.reshape(keep.shape + (1,) * len(components)).astype(dtype)


def theirs(grid, low, array):
    """The same box of a grid of OpenVDB's, whose axes are (x, y, z)."""
    found = np.zeros(array.shape[2::-1] + array.shape[3:], array.dtype)
    grid.copyToArray(found, ijk=low)
    return found.transpose(2, 1, 0, *range(3, array.ndim))


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("compression", ["blosc", "zip", "mask", "none"])
@pytest.mark.parametrize("name, dtype", GRIDS + VECTORS)
def test_openvdb_reads_what_is_written(tmp_path, name, dtype, compression, half):
    array = values(dtype, (3,) if name.startswith("Vec") else ())
    floats = np.issubdtype(dtype, np.floating)
    if half and not floats:
        pytest.skip("half is of floats")
    matrix = np.diag([0.5, 0.25, 2.0, 1.0])
    matrix[:3, 3] = [1, 2, 3]
    zero = [0.0] * 3 if name.startswith("Vec") else 0.0
    volume = ds.Volume(array, name="own", index=(-3, 7, 100), world_from_index=matrix,
                       background=zero, metadata={"text": "word", "number": 7, "real": 0.5})
    ds.write(tmp_path / "own.vdb", volume, compression=compression, half=half if floats else None)
    (grid,), metadata = vdb.readAll(str(tmp_path / "own.vdb"))
    assert type(grid).__name__ == name and grid.name == "own"
    assert np.array_equal(theirs(grid, (-3, 7, 100), array), array)
    on = array.any(axis=3) if array.ndim == 4 else array != 0
    assert grid.activeVoxelCount() == on.sum()
    assert (grid["text"], grid["number"], grid["real"]) == ("word", 7, 0.5)
    for at in [(0, 0, 0), (-3, 7, 100), (5, -6, 7)]:
        found = grid.transform.indexToWorld(at)
        assert np.allclose(found, (matrix @ [*at, 1])[:3], rtol=1e-15)
    assert grid.saveFloatAsHalf == (half and floats)


@pytest.mark.parametrize("half", [False, True])
@pytest.mark.parametrize("name, dtype", GRIDS + VECTORS)
def test_what_openvdb_writes_is_read(tmp_path, name, dtype, half):
    array = values(dtype, (3,) if name.startswith("Vec") else ())
    grid = getattr(vdb, name)()
    grid.name = "theirs"
    grid.copyFromArray(np.ascontiguousarray(array.transpose(2, 1, 0, *range(3, array.ndim))),
                       ijk=(-3, 7, 100))
    grid.transform = vdb.createLinearTransform(0.25)
    grid.saveFloatAsHalf = half
    grid["text"], grid["number"], grid["real"] = "word", 7, 0.5
    # A tile that is no part of the array.
    grid.fill((1024, 0, 0), (1031, 7, 7), grid.oneValue, True)
    vdb.write(str(tmp_path / "theirs.vdb"), grids=[grid], metadata={"of": "the file"})
    file = ds.open(tmp_path / "theirs.vdb")
    assert file.keys() == ["theirs"] and file.metadata["of"] == "the file"
    tree = file.sparse()
    assert tree.active_voxel_count == grid.activeVoxelCount()
    box = tree.volume((-3, 7, 100), (-3 + 13, 7 + 8, 100 + 10))
    kept = np.float16 if half and np.issubdtype(dtype, np.floating) else dtype
    assert box.array.dtype == kept and np.array_equal(box.array, array)
    assert np.array_equal(tree[1030, 3, 3], np.ones_like(tree[1030, 3, 3]))
    assert np.array_equal(tree.world_from_index, np.diag([0.25, 0.25, 0.25, 1.0]))
    assert (tree.metadata["text"], tree.metadata["number"], tree.metadata["real"]) == \
        ("word", 7, 0.5)
