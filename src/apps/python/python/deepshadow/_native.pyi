from collections.abc import Callable, Iterator, Mapping, Sequence
from os import PathLike
from typing import Any, Literal, TypeAlias, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

__all__ = [
    "Comparison",
    "GridInfo",
    "Image",
    "Mesh",
    "Scene",
    "ShadowMap",
    "SparseGrid",
    "Strands",
    "Volume",
    "VolumeFile",
    "__version__",
    "choose",
    "compare",
    "open",
    "read",
    "read_surface",
    "render",
    "shadow_map",
    "transmittance",
    "write",
]

_Path: TypeAlias = str | PathLike[str]
_Index: TypeAlias = tuple[int, int, int]
_Vector: TypeAlias = tuple[float, float, float]
_Progress: TypeAlias = Callable[[str, int, int], object]
_Backend: TypeAlias = Literal["auto", "gpu", "cpu"]
_Up: TypeAlias = Literal["x", "y", "z", "-x", "-y", "-z"]
_Source: TypeAlias = Scene | Volume | ArrayLike | Mesh | Strands | _Path | Mapping[str, Any]

__version__: str

@final
class Volume:
    def __new__(
        cls,
        array: ArrayLike,
        *,
        name: str = "",
        spacing: float | Sequence[float] | None = None,
        origin: Sequence[float] | None = None,
        world_from_index: ArrayLike | None = None,
        index: Sequence[int] = ...,
        active: ArrayLike | None = None,
        background: float | Sequence[float] | None = None,
        grid_class: str | None = None,
        metadata: dict[str, Any] | None = None,
    ) -> Volume: ...
    @property
    def array(self) -> NDArray[Any]: ...
    @property
    def active(self) -> NDArray[np.bool_] | None: ...
    @property
    def metadata(self) -> dict[str, Any]: ...
    @property
    def name(self) -> str: ...
    @property
    def world_from_index(self) -> NDArray[np.float64]: ...
    @property
    def index(self) -> _Index: ...
    @property
    def spacing(self) -> _Vector: ...
    @property
    def origin(self) -> _Vector: ...
    @property
    def background(self) -> float | tuple[float, ...] | None: ...
    @property
    def grid_class(self) -> str | None: ...
    @property
    def space(self) -> str | None: ...
    def replace(self, **changes: Any) -> Volume: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...
    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]: ...

@final
class SparseGrid:
    @property
    def name(self) -> str: ...
    @property
    def world_from_index(self) -> NDArray[np.float64]: ...
    @property
    def metadata(self) -> dict[str, Any]: ...
    @property
    def active_voxel_count(self) -> int: ...
    @property
    def active_bounds(self) -> tuple[_Index, _Index] | None: ...
    @property
    def leaf_count(self) -> int: ...
    @property
    def background(self) -> Any: ...
    @property
    def grid_class(self) -> str: ...
    def tiles(self) -> list[tuple[_Index, int, Any, bool]]: ...
    def active_values(
        self, *, max_bytes: int = ...
    ) -> tuple[NDArray[np.int32], NDArray[Any]]: ...
    def leaves(self) -> Iterator[tuple[_Index, NDArray[Any], NDArray[np.bool_]]]: ...
    def volume(
        self,
        low: Sequence[int] | None = None,
        high: Sequence[int] | None = None,
        *,
        max_bytes: int = ...,
    ) -> Volume: ...
    def __getitem__(self, at: Sequence[int], /) -> Any: ...

@final
class GridInfo:
    @property
    def name(self) -> str: ...
    @property
    def type(self) -> str: ...
    @property
    def dims(self) -> _Index | None: ...
    @property
    def grid_class(self) -> str | None: ...
    @property
    def refused(self) -> str | None: ...
    @property
    def metadata(self) -> dict[str, Any]: ...

@final
class VolumeFile:
    @property
    def path(self) -> PathLike[str]: ...
    @property
    def format(self) -> str: ...
    @property
    def grids(self) -> list[GridInfo]: ...
    @property
    def metadata(self) -> dict[str, Any]: ...
    def read(self, grid: str | None = None) -> Volume: ...
    def sparse(self, grid: str | None = None) -> SparseGrid: ...
    def keys(self) -> list[str]: ...
    def __len__(self) -> int: ...
    def __contains__(self, grid: str, /) -> bool: ...
    def __iter__(self) -> Iterator[str]: ...
    def __getitem__(self, grid: str, /) -> Volume: ...

@final
class Mesh:
    def __new__(
        cls,
        positions: ArrayLike,
        triangles: ArrayLike,
        *,
        normals: ArrayLike | None = None,
        smooth_degrees: float | None = None,
        albedo: ArrayLike | None = None,
        opacity: ArrayLike | None = None,
        up: _Up = "y",
        name: str = "",
    ) -> Mesh: ...
    @property
    def positions(self) -> NDArray[np.float32]: ...
    @property
    def triangles(self) -> NDArray[np.uint32]: ...
    @property
    def normals(self) -> NDArray[np.float32] | None: ...
    @property
    def albedo(self) -> NDArray[np.float32]: ...
    @property
    def opacity(self) -> NDArray[np.float32]: ...
    @property
    def up(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def notes(self) -> list[str]: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...

@final
class Strands:
    def __new__(
        cls,
        points: ArrayLike,
        counts: ArrayLike | None = None,
        *,
        thickness: ArrayLike,
        opacity: ArrayLike | None = None,
        albedo: ArrayLike | None = None,
        up: _Up = "y",
        name: str = "",
    ) -> Strands: ...
    @property
    def points(self) -> NDArray[np.float32]: ...
    @property
    def counts(self) -> NDArray[np.uint32]: ...
    @property
    def thickness(self) -> float | NDArray[np.float32]: ...
    @property
    def opacity(self) -> float | NDArray[np.float32]: ...
    @property
    def albedo(self) -> NDArray[np.float32]: ...
    @property
    def up(self) -> str: ...
    @property
    def name(self) -> str: ...
    @property
    def notes(self) -> list[str]: ...
    def __getnewargs_ex__(self) -> tuple[tuple[Any, ...], dict[str, Any]]: ...
    def __len__(self) -> int: ...

@final
class Scene:
    def __new__(
        cls, source: _Source | None = None, *, frame: int | None = None, **tables: Any
    ) -> Scene: ...
    @property
    def frames(self) -> list[int]: ...
    def shot(
        self,
        frames: Sequence[int] | None = None,
        *,
        turns: int | None = None,
        progress: _Progress | None = None,
    ) -> Scene: ...
    def to_toml(self) -> str: ...
    @staticmethod
    def from_toml(text: str, folder: _Path = ...) -> Scene: ...
    def __reduce__(self) -> tuple[Any, ...]: ...

@final
class Image:
    @property
    def array(self) -> NDArray[np.float32]: ...
    @property
    def choices(self) -> dict[str, str]: ...
    @property
    def notes(self) -> list[str]: ...
    @property
    def backend(self) -> str: ...
    def to_toml(self) -> str: ...
    def png(
        self, *, exposure: float | str | None = None, tonemap: str | None = None
    ) -> bytes: ...
    def save(
        self, path: _Path, *, exposure: float | str | None = None, tonemap: str | None = None
    ) -> None: ...
    def _repr_png_(self) -> bytes: ...
    def __array__(self, dtype: Any = None, copy: bool | None = None) -> NDArray[Any]: ...

@final
class ShadowMap:
    @property
    def kind(self) -> str: ...
    @property
    def backend(self) -> str: ...
    @property
    def size(self) -> int: ...
    @property
    def bytes(self) -> int: ...
    @property
    def parts(self) -> int: ...
    @property
    def certificate(self) -> str | None: ...
    @property
    def thresholds(self) -> NDArray[np.float32]: ...
    def transmittance(self, points: ArrayLike) -> NDArray[np.float32]: ...
    def lists(
        self,
    ) -> tuple[NDArray[np.uint32], NDArray[np.float32], NDArray[np.float32]]: ...
    def save(self, path: _Path) -> list[PathLike[str]]: ...

@final
class Comparison:
    @property
    def html(self) -> str: ...
    @property
    def csv(self) -> str: ...
    @property
    def json(self) -> str: ...
    def save(self, path: _Path) -> None: ...
    def __len__(self) -> int: ...
    def __getitem__(self, index: Any, /) -> Any: ...
    def __iter__(self) -> Iterator[dict[str, Any]]: ...
    def _repr_html_(self) -> str: ...

def open(
    path: _Path,
    *,
    dims: Sequence[int] | None = None,
    type: str | None = None,
    endian: str | None = None,
    spacing: Sequence[float] | None = None,
    max_bytes: int = ...,
) -> VolumeFile: ...
def read(
    path: _Path,
    grid: str | None = None,
    *,
    dims: Sequence[int] | None = None,
    type: str | None = None,
    endian: str | None = None,
    spacing: Sequence[float] | None = None,
    max_bytes: int = ...,
) -> Volume: ...
def read_surface(path: _Path, *, max_bytes: int = ...) -> Mesh | Strands: ...
def write(
    path: _Path,
    volume: Volume | SparseGrid | ArrayLike | Sequence[Volume | SparseGrid] | Mesh | Strands,
    *,
    compression: str | None = None,
    half: bool | None = None,
    **place: Any,
) -> list[str]: ...
def render(
    scene: _Source,
    *,
    backend: _Backend = "auto",
    progress: _Progress | None = None,
    **tables: Any,
) -> Image: ...
def transmittance(
    scene: _Source,
    points: ArrayLike,
    *,
    exact: bool = False,
    normals: ArrayLike | None = None,
    footprint: float | None = None,
    backend: _Backend = "auto",
    progress: _Progress | None = None,
    **tables: Any,
) -> NDArray[np.float32]: ...
def shadow_map(
    scene: _Source,
    *,
    kind: str | None = None,
    size: int | None = None,
    tolerance: float | None = None,
    light_index: int = 0,
    backend: _Backend = "auto",
    progress: _Progress | None = None,
    **tables: Any,
) -> ShadowMap: ...
def choose(
    scene: _Source,
    *,
    max_error: float | None = None,
    max_bytes: int | str | None = None,
    kind: str | None = None,
    size: int | None = None,
    light_index: int = 0,
    backend: _Backend = "auto",
    progress: _Progress | None = None,
    **tables: Any,
) -> ShadowMap: ...
def compare(
    scene: _Source,
    *,
    maps: str | None = None,
    map_size: int = 256,
    points: int = 100_000,
    seed: int = 1,
    progress: _Progress | None = None,
    **tables: Any,
) -> Comparison: ...
