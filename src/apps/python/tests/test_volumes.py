"""Files and arrays: what is written is what is read, bit for bit."""

import copy
import os
import pickle
from pathlib import Path

import numpy as np
import pytest

import deepshadow as ds

FIXTURES = Path(os.environ["FIXTURES"])
NUMBERS = ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f2", "f4", "f8"]


def numbers(dtype, shape=(5, 6, 7)):
    """Values that no other type of the same size would hold."""
    rng = np.random.default_rng(7)
    raw = rng.integers(0, 256, size=(*shape, np.dtype(dtype).itemsize), dtype=np.uint8)
    array = raw.view(dtype)[..., 0]
    return np.nan_to_num(array, nan=0.5, posinf=2.0, neginf=-2.0) if array.dtype.kind == "f" else array


def ordered(grid):
    """Active voxels by their indices; a file's leaves and tiles have an order of their own."""
    at, values = grid.active_values()
    order = np.lexsort(at.T)
    return at[order], values[order]


@pytest.mark.parametrize("dtype", NUMBERS)
@pytest.mark.parametrize("ending", ["npy", "nrrd", "mha"])
def test_dense_files_keep_every_bit(tmp_path, dtype, ending):
    array = numbers(dtype)
    path = tmp_path / f"a.{ending}"
    ds.write(path, array, spacing=(0.5, 1.0, 2.0), origin=(3, 4, 5))
    found = ds.read(path)
    wide = "f4" if dtype == "f2" and ending != "npy" else dtype
    assert found.array.dtype == np.dtype(wide)
    assert np.array_equal(found.array, array)
    assert found.spacing == (0.5, 1.0, 2.0)
    assert found.origin == (3.0, 4.0, 5.0)


@pytest.mark.parametrize("dtype", ["f4", "f8", "i4", "i8", "f2", "?"])
def test_openvdb_keeps_every_bit(tmp_path, dtype):
    array = numbers("u1") > 100 if dtype == "?" else numbers(dtype)
    volume = ds.Volume(array, name="d", spacing=0.25, index=(-3, 4, 100))
    path = tmp_path / "a.vdb"
    assert ds.write(path, volume) == []
    found = ds.read(path)
    assert found.array.dtype == array.dtype
    assert found.array.tobytes() == array.tobytes()
    assert found.index == (-3, 4, 100)
    assert found.active is None and found.name == "d"


def test_vectors_are_a_last_axis(tmp_path):
    array = numbers("f4", (3, 4, 5, 3))
    ds.write(tmp_path / "v.vdb", array, name="v")
    assert np.array_equal(ds.read(tmp_path / "v.vdb", "v").array, array)


def test_several_grids_and_metadata(tmp_path):
    density = ds.Volume(numbers("f4"), name="density", grid_class="fog volume",
                        metadata={"frame": 12, "author": "me", "time": 0.5, "v": (1.5, 2.0, 3.0)})
    count = ds.Volume(numbers("i4"), name="count")
    ds.write(tmp_path / "a.vdb", [density, count])
    file = ds.open(tmp_path / "a.vdb")
    assert [grid.name for grid in file.grids] == ["density", "count"]
    assert [grid.type for grid in file.grids] == ["float", "int32"]
    assert np.array_equal(file["count"].array, count.array)
    found = file.read()
    assert found.grid_class == "fog volume"
    assert found.metadata == {"frame": 12, "author": "me", "time": 0.5, "v": (1.5, 2.0, 3.0)}


def test_activity_and_background(tmp_path):
    array = np.zeros((4, 5, 6), np.float32)
    array[1:3, 2:4, 3:5] = 2.0
    active = array > 0
    active[1, 2, 1] = True
    ds.write(tmp_path / "a.vdb", ds.Volume(array, active=active, background=0.0))
    sparse = ds.open(tmp_path / "a.vdb").sparse()
    assert sparse.active_voxel_count == 9
    assert sparse.active_bounds == ((1, 2, 1), (4, 3, 2))
    at, values = sparse.active_values()
    rebuilt = np.zeros_like(array)
    rebuilt[at[:, 2], at[:, 1], at[:, 0]] = values
    assert np.array_equal(rebuilt, array)
    seen = np.zeros_like(active)
    for (x, y, z), _, on in sparse.leaves():
        seen[z:z + 8, y:y + 8, x:x + 8] |= on[:4 - z, :5 - y, :6 - x]
    assert np.array_equal(seen, active)
    assert sparse[3, 2, 1] == 2.0 and sparse[0, 0, 0] == 0.0
    assert np.array_equal(sparse.volume((0, 0, 0), (5, 4, 3)).array, array)


def test_trees_are_written_as_they_are(tmp_path):
    source = FIXTURES / "vdb" / "types_zip.vdb"
    file = ds.open(source)
    grids = [file.sparse(grid.name) for grid in file.grids if grid.refused is None]
    ds.write(tmp_path / "again.vdb", grids)
    again = ds.open(tmp_path / "again.vdb")
    for grid in grids:
        other = again.sparse(grid.name)
        assert other.active_bounds == grid.active_bounds
        for one, two in zip(ordered(grid), ordered(other), strict=True):
            assert one.dtype == two.dtype and one.tobytes() == two.tobytes()
        assert np.array_equal(other.world_from_index, grid.world_from_index)


def test_arrays_are_not_copied_in_or_out(tmp_path):
    array = np.zeros((4, 4, 4), np.float32)
    volume = ds.Volume(array)
    assert volume.array is array
    assert np.shares_memory(np.asarray(volume), array)
    assert not np.shares_memory(np.array(volume), array)
    assert np.asarray(volume, dtype=np.float64).dtype == np.float64
    np.save(tmp_path / "a.npy", array)
    found = ds.read(tmp_path / "a.npy").array
    # A view of the bytes that were read, and its own memory.
    assert found.base is not None and found.flags.writeable and found.flags.c_contiguous


def test_order_and_byte_order_do_not_matter(tmp_path):
    array = numbers("f4")
    for other in [np.asfortranarray(array), array.astype(">f4"), array[::1, ::-1][:, ::-1]]:
        ds.write(tmp_path / "a.nrrd", other)
        assert np.array_equal(ds.read(tmp_path / "a.nrrd").array, array)


def test_other_readers_agree(tmp_path):
    nrrd = pytest.importorskip("nrrd")
    array = numbers("i2")
    ds.write(tmp_path / "a.nrrd", array, spacing=(1.0, 2.0, 3.0))
    found, header = nrrd.read(str(tmp_path / "a.nrrd"), index_order="C")
    assert np.array_equal(found, array)
    assert np.allclose(np.diag(header["space directions"]), [1, 2, 3])
    nibabel = pytest.importorskip("nibabel")
    affine = np.diag([2.0, 3.0, 4.0, 1.0])
    nibabel.save(nibabel.Nifti1Image(array.T, affine), tmp_path / "a.nii.gz")
    found = ds.read(tmp_path / "a.nii.gz")
    assert np.array_equal(found.array, array)
    # x and y are negated: the world of patients is LPS.
    assert np.allclose(np.diag(found.world_from_index), [-2, -3, 4, 1])


@pytest.mark.parametrize("array, what", [
    (np.zeros((2, 2)), "shape"),
    (np.zeros((0, 2, 2)), "empty"),
    (np.zeros((2, 2, 2), complex), "complex128"),
    (np.array([[["a"]]]), "type"),
    (np.full((1, 1, 1), None), "object"),
    ([[[1], [2, 3]]], "inhomogeneous"),
])
def test_what_is_no_volume_is_refused(array, what):
    with pytest.raises(ValueError, match=what):
        ds.Volume(array)


@pytest.mark.parametrize("place, what", [
    ({"spacing": 0}, "spacing"),
    ({"spacing": float("nan")}, "spacing"),
    ({"world_from_index": np.zeros((4, 4))}, "affine"),
    ({"world_from_index": np.diag([1.0, 0, 1, 1])}, "no inverse"),
    ({"world_from_index": np.eye(3)}, "shape"),
    ({"world_from_index": np.eye(4), "spacing": 1}, "not both"),
    ({"background": (1, 2, 3)}, "background"),
    ({"active": np.ones((2, 2, 2))}, "booleans"),
    ({"grid_class": "fog"}, "level set"),
])
def test_places_that_are_none(place, what):
    with pytest.raises(ValueError, match=what):
        ds.Volume(np.ones((2, 2, 2)), **place)


def test_files_that_are_none(tmp_path):
    with pytest.raises(FileNotFoundError):
        ds.read(tmp_path / "none.vdb")
    (tmp_path / "bad.vdb").write_bytes((FIXTURES / "vdb" / "bumps.vdb").read_bytes()[:300])
    with pytest.raises((ValueError, OSError), match="bad.vdb"):
        ds.read(tmp_path / "bad.vdb")
    with pytest.raises(ValueError, match="ending"):
        ds.write(tmp_path / "a.xyz", np.zeros((2, 2, 2)))
    with pytest.raises(ValueError, match="nothing to write"):
        ds.write(tmp_path / "a.vdb", [])
    with pytest.raises(ValueError, match="no grid 'fog'"):
        ds.read(FIXTURES / "vdb" / "bumps.vdb", "fog")
    with pytest.raises(MemoryError):
        ds.read(FIXTURES / "vdb" / "bumps.vdb", max_bytes=10)


def test_a_failed_write_leaves_the_older_file(tmp_path):
    path = tmp_path / "a.vdb"
    ds.write(path, np.ones((3, 3, 3), np.float32))
    before = path.read_bytes()
    with pytest.raises(ValueError, match="numbers per voxel"):
        ds.write(path, np.ones((3, 3, 3, 2), np.float32))
    assert path.read_bytes() == before
    assert os.listdir(tmp_path) == ["a.vdb"]


def test_metadata_of_every_kind_come_back(tmp_path):
    given = {"b": True, "i": 3, "l": 2**40, "d": 0.1, "s": "ä", "v2": (1, 2), "v3": (1.5, 2.0, 3.0),
             "v4": (1, 2, 3, 4), "m": tuple(float(i) for i in range(16))}
    ds.write(tmp_path / "a.vdb", np.ones((2, 2, 2), np.float32), metadata=given)
    assert ds.read(tmp_path / "a.vdb").metadata == given
    with pytest.raises(ValueError, match="'x' is a list"):
        ds.write(tmp_path / "b.vdb", np.ones((2, 2, 2), np.float32), metadata={"x": [1, 2, 3, 4, 5]})
    assert not (tmp_path / "b.vdb").exists()


def test_tiles_are_no_leaves(tmp_path):
    ds.write(tmp_path / "a.vdb", ds.Volume(np.full((16, 16, 16), 2.0, np.float32), background=0.0))
    sparse = ds.open(tmp_path / "a.vdb").sparse()
    assert sparse.leaf_count == 0 and list(sparse.leaves()) == []
    tiles = sparse.tiles()
    assert sum(edge**3 for _, edge, _, active in tiles if active) == 16**3
    assert {float(value) for _, _, value, active in tiles if active} == {2.0}
    assert sparse.background == 0.0


def test_files_are_mappings(tmp_path):
    ds.write(tmp_path / "a.vdb", [ds.Volume(numbers("f4"), name=name) for name in ["b", "a", "a"]])
    file = ds.open(tmp_path / "a.vdb")
    assert list(file) == file.keys() == ["b", "a", "a"] and len(file) == 3
    assert "a" in file and "a[1]" in file and "c" not in file
    with pytest.raises(KeyError, match="no grid 'c'"):
        file["c"]


def test_volumes_are_changed_copied_and_pickled(tmp_path):
    array = numbers("f4")
    volume = ds.Volume(array, name="a", spacing=0.5, origin=(1, 2, 3), index=(4, 5, 6),
                       background=array[0, 0, 0], metadata={"frame": 3})
    moved = volume.replace(spacing=2.0, name="b")
    assert (moved.name, moved.spacing, moved.origin) == ("b", (2.0, 2.0, 2.0), (1.0, 2.0, 3.0))
    assert moved.array is array and moved.index == (4, 5, 6) and moved.metadata == {"frame": 3}
    ds.write(tmp_path / "a.vdb", volume)
    for other in [copy.copy(volume), pickle.loads(pickle.dumps(volume)), ds.read(tmp_path / "a.vdb"),
                  pickle.loads(pickle.dumps(ds.read(tmp_path / "a.vdb")))]:
        ds.write(tmp_path / "b.vdb", other)
        assert (tmp_path / "b.vdb").read_bytes() == (tmp_path / "a.vdb").read_bytes()


def test_trees_and_opened_files_are_volumes(tmp_path):
    array = numbers("u1").astype(np.float32)
    ds.write(tmp_path / "a.vdb", array)
    file = ds.open(tmp_path / "a.vdb")
    for source in [file, file.sparse()]:
        ds.write(tmp_path / "a.npy", source)
        assert np.array_equal(np.load(tmp_path / "a.npy"), array)


def test_a_grid_of_nothing_is_a_voxel_of_it(tmp_path):
    ds.write(tmp_path / "none.vdb", np.zeros((4, 4, 4), np.float32), background=0.0)
    volume = ds.read(tmp_path / "none.vdb")
    assert volume.array.tolist() == [[[0.0]]] and not volume.active.any()


def test_what_files_cannot_hold_is_refused(tmp_path):
    array = np.ones((2, 2, 2), np.float32)
    for origin in [(np.inf, 0, 0), (0, np.nan, 0)]:
        with pytest.raises(ValueError, match="origin: is not finite"):
            ds.Volume(array, origin=origin)
    ds.write(tmp_path / "n.vdb", ds.Volume(array, metadata={"fps": np.float32(24), "n": np.int64(3)}))
    assert ds.open(tmp_path / "n.vdb").grids[0].metadata["fps"] == 24.0
    with pytest.raises(ValueError, match="half"):
        ds.write(tmp_path / "a.npy", array, half=True)
    with pytest.raises(ValueError, match="not one of none$"):
        ds.write(tmp_path / "a.npy", array, compression="gzip")
    with pytest.raises(ValueError, match="no grid 'x'"):
        ds.write(tmp_path / "a.npy", array)
        ds.read(tmp_path / "a.npy", "x")
    assert ds.__version__.count(".") == 2
