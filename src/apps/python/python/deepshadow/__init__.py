"""Volumes, their shadows and OpenVDB files as NumPy arrays.

>>> import deepshadow as ds
>>> volume = ds.read("smoke.vdb")                          # doctest: +SKIP
>>> ds.render(volume, light=(-1, -1, 0)).save("smoke.png") # doctest: +SKIP

World positions are (x, y, z), right-handed, y up; arrays of voxels are (z, y, x).
"""

from ._native import *
from ._native import __all__ as __all__
