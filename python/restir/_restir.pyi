"""The native half of the package; use :mod:`restir`, which wraps it."""

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

__version__: str

_Vector = Sequence[float]
_Camera = tuple[_Vector, _Vector, _Vector, float, float, float | None]
_Path = str
_Pairs = list[tuple[str, str]]
_Color = NDArray[np.float32]
_Progress = Callable[[float], object] | None

class RestirError(Exception):
    """What cannot be done: one sentence that says what, where and what to do."""

class Device:
    """A CPU, of so many threads, or an opened GPU, of the flavour "exact" or "fast"."""

    def __new__(
        cls, name: str = "cpu", *, adapter: str | None = None, flavour: str = "exact", threads: int | None = None
    ) -> Device: ...
    @property
    def name(self) -> str:
        """What it is called."""

class Scene:
    def __new__(cls) -> Scene: ...
    @staticmethod
    def load(path: _Path) -> Scene: ...
    def copy(self) -> Scene: ...
    @property
    def name(self) -> str: ...
    @property
    def warnings(self) -> list[str]: ...
    @property
    def default_size(self) -> tuple[int, int] | None: ...
    @property
    def mesh_names(self) -> list[str]: ...
    @property
    def material_names(self) -> list[str]: ...
    @property
    def instance_count(self) -> int: ...
    @property
    def camera(self) -> _Camera | None: ...
    def set_camera(self, camera: _Camera) -> None: ...
    def add_material(
        self,
        name: str,
        *,
        base_color: _Vector,
        emission: _Vector,
        metallic: float,
        roughness: float,
        ior: float,
        transmission: float,
        two_sided_emission: bool,
        attenuation: tuple[_Vector, float] | None = None,
        mean_free_path: _Vector | None = None,
        anisotropy: float = 0.0,
    ) -> int: ...
    def add_mesh(
        self,
        name: str,
        positions: NDArray[np.float32],
        indices: NDArray[np.uint32],
        material: int,
        normals: NDArray[np.float32] | None = None,
        uvs: NDArray[np.float32] | None = None,
    ) -> int: ...
    def positions(self, mesh: int) -> NDArray[np.float32]: ...
    def indices(self, mesh: int) -> NDArray[np.uint32]: ...
    def set_positions(self, mesh: int, positions: NDArray[np.float32]) -> None: ...
    def add_instance(self, mesh: int, transform: NDArray[np.float64] | None = None) -> int: ...
    def set_transform(self, instance: int, transform: NDArray[np.float64]) -> None: ...
    def add_light(
        self,
        kind: str,
        intensity: _Vector,
        position: _Vector | None = None,
        direction: _Vector | None = None,
        inner: float = 0.0,
        outer: float = 45.0,
    ) -> None: ...
    def set_environment(self, radiance: _Color, scale: float, rotation: float) -> list[str]: ...
    def fill(self, medium: str, scale: float | None = None) -> None: ...
    def add_default_light(self) -> None: ...

class Session:
    def __new__(
        cls,
        scene: Scene,
        technique: str,
        settings: list[str],
        size: list[int],
        seed: int,
        samples: int,
        mean_of: int | None,
        denoise: bool,
        device: Device,
    ) -> Session: ...
    def render(
        self, camera: _Camera | None = None, frame: float | None = None, scene: Scene | None = None
    ) -> tuple[_Color, str]: ...
    @property
    def frames(self) -> int: ...
    def reset(self) -> None: ...

def render(
    scene: Scene, request: dict[str, Any], layers: list[str], inspect: bool, device: Device, progress: _Progress
) -> tuple[_Color, dict[str, NDArray[np.float32]], _Pairs]: ...
def explain(
    scene: Scene, request: dict[str, Any], pixel: list[int], sample: int, device: Device
) -> tuple[str, str]: ...
def render_part(
    path: _Path,
    scene: Scene,
    request: dict[str, Any],
    unit: str,
    range: tuple[int, int],
    tile: tuple[int, int, int, int] | None,
    device: Device,
    progress: _Progress,
) -> None: ...
def merge_parts(paths: list[_Path]) -> tuple[_Color, _Pairs]: ...
def noise_of_parts(paths: list[_Path]) -> tuple[float, int]: ...
def read_exr(path: _Path) -> tuple[_Color, _Pairs]: ...
def write_image(path: _Path, color: _Color, metadata: _Pairs) -> None: ...
def techniques() -> list[tuple[str, str, str]]: ...
def settings(name: str) -> list[tuple[str, str, str, str]]: ...
def presets(name: str) -> list[str]: ...
def biases(name: str, settings: list[str]) -> list[str]: ...
def scenes() -> list[tuple[str, str]]: ...
def compare(test: _Color, reference: _Color) -> dict[str, Any]: ...
def devices() -> list[dict[str, str]]: ...
