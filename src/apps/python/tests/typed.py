"""A program that a type checker reads; nothing runs it."""

import numpy as np
import numpy.typing as npt

import deepshadow as ds

volume: ds.Volume = ds.Volume(np.zeros((2, 3, 4), np.float32), spacing=0.5)
grids: list[ds.Volume | ds.SparseGrid] = [volume, ds.open("b.vdb").sparse("density")]
lost: list[str] = ds.write("a.vdb", grids)
picture: npt.NDArray[np.float32] = ds.render(volume, light=(0, -1, 0), size=64).array
light: npt.NDArray[np.float32] = ds.shadow_map(volume, size=64).transmittance(np.zeros((5, 3)))
for low, values, active in ds.open("b.vdb").sparse().leaves():
    first: int = low[0]
