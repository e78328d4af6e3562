"""ReSTIR, path tracing and subsurface scattering, with the same bits on CPU and GPU.

>>> import restir
>>> scene = restir.load("cornell")
>>> image = restir.render(scene, technique="restir-di", samples=4, size=(32, 24))
>>> image.color.shape
(24, 32, 3)

Images are numpy arrays of linear RGB radiance, rows from top to bottom. Every error is a :class:`RestirError` whose
text says what is wrong, where, and what to do.
"""

from __future__ import annotations

import json
import os
import time
import warnings
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from . import _restir
from ._restir import Device, RestirError, __version__

__all__ = [
    "Camera",
    "Device",
    "Image",
    "RestirError",
    "Scene",
    "Session",
    "Tile",
    "bench",
    "compare",
    "devices",
    "explain",
    "load",
    "merge",
    "noise",
    "read",
    "render",
    "render_part",
    "scenes",
    "settings",
    "techniques",
]

Progress = Callable[[float], object]
Settings = Mapping[str, object]


@dataclass(frozen=True)
class Camera:
    """A perspective camera.

    ``fov`` is the vertical field of view in degrees. With a ``lens_radius`` of 0 everything is sharp, else what is
    ``focus_distance`` away along the view, or as far as ``target``.
    """

    position: Sequence[float]
    target: Sequence[float]
    up: Sequence[float] = (0.0, 1.0, 0.0)
    fov: float = 40.0
    lens_radius: float = 0.0
    focus_distance: float | None = None

    def _tuple(self) -> tuple:
        names = ("position", "target", "up")
        position, target, up = (_vector(f"the camera's {name}", getattr(self, name)) for name in names)
        focus = None if self.focus_distance is None else _finite("the camera's focus_distance", self.focus_distance)
        fov, lens_radius = _finite("the camera's fov", self.fov), _finite("the camera's lens_radius", self.lens_radius)
        return position, target, up, fov, lens_radius, focus


@dataclass(frozen=True)
class Tile:
    """A rectangle of pixels; ``x`` and ``y`` are the column and row of its upper left one."""

    x: int
    y: int
    width: int
    height: int


@dataclass(frozen=True)
class Image:
    """An image: ``color`` is (height, width, 3), float32; ``layers`` are further arrays by name.

    ``np.asarray(image)`` and ``np.from_dlpack(image)`` give the colour without a copy. ``metadata`` says how it was made.
    """

    color: np.ndarray
    layers: dict[str, np.ndarray] = field(default_factory=dict)
    metadata: dict[str, str] = field(default_factory=dict)

    def __getitem__(self, name: str) -> np.ndarray:
        """The colour, or a layer by its name."""
        return self.color if name == "color" else self.layers[name]

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        if dtype is None and not copy:
            return self.color
        return np.array(self.color, dtype=dtype, copy=True)

    def __dlpack__(self, **arguments: Any) -> Any:
        return self.color.__dlpack__(**arguments)

    def __dlpack_device__(self) -> Any:
        return self.color.__dlpack_device__()

    def write(self, path: str | os.PathLike[str]) -> None:
        """Writes the colour: radiance to an ``.exr`` file, or what a screen shows to a ``.png`` file."""
        color = _array("the pixels of an image", self.color, np.float32, 3)
        _restir.write_image(os.fspath(path), color, list(self.metadata.items()))


class Scene:
    """A scene, read by :func:`load` or made of arrays. Editing it changes what is rendered next."""

    def __init__(self, _native: _restir.Scene | None = None) -> None:
        self._native = _restir.Scene() if _native is None else _native

    def __repr__(self) -> str:
        return repr(self._native)

    def copy(self) -> Scene:
        """The same scene, which can be edited apart; meshes are shared until then."""
        return Scene(self._native.copy())

    @property
    def name(self) -> str:
        """A built-in scene's name, or the file."""
        return self._native.name

    @property
    def warnings(self) -> list[str]:
        """What the import skipped or assumed, a sentence each."""
        return self._native.warnings

    @property
    def default_size(self) -> tuple[int, int] | None:
        """Width and height that suit the scene, in pixels."""
        return self._native.default_size

    @property
    def mesh_names(self) -> list[str]:
        """Names of the meshes, by their index."""
        return self._native.mesh_names

    @property
    def material_names(self) -> list[str]:
        """Names of the materials, by their index."""
        return self._native.material_names

    @property
    def instance_count(self) -> int:
        """How many placed meshes there are."""
        return self._native.instance_count

    @property
    def camera(self) -> Camera | None:
        """The camera; without one the scene is framed automatically."""
        camera = self._native.camera
        return None if camera is None else Camera(*camera)

    @camera.setter
    def camera(self, camera: Camera) -> None:
        given = _camera(camera)
        if given is None:
            raise RestirError("a scene cannot lose its camera; give one, or make a scene without")
        self._native.set_camera(given)

    def add_material(
        self,
        name: str = "material",
        *,
        base_color: Sequence[float] = (0.8, 0.8, 0.8),
        emission: Sequence[float] = (0.0, 0.0, 0.0),
        metallic: float = 0.0,
        roughness: float = 1.0,
        ior: float = 1.0,
        transmission: float = 0.0,
        two_sided_emission: bool = False,
        attenuation: tuple[Sequence[float], float] | None = None,
        mean_free_path: Sequence[float] | None = None,
        anisotropy: float = 0.0,
    ) -> int:
        """Adds a material of glTF's model, and gives its index.

        With an ``ior`` of 1 it has no specular reflection. ``attenuation`` is the colour that is left of white light
        after a distance inside; with a ``mean_free_path`` by channel the inside scatters light, and ``base_color`` is
        the colour of a thick body of it.
        """
        return self._native.add_material(
            name,
            base_color=list(base_color),
            emission=list(emission),
            metallic=metallic,
            roughness=roughness,
            ior=ior,
            transmission=transmission,
            two_sided_emission=two_sided_emission,
            attenuation=None if attenuation is None else (list(attenuation[0]), attenuation[1]),
            mean_free_path=None if mean_free_path is None else list(mean_free_path),
            anisotropy=anisotropy,
        )

    def add_mesh(
        self,
        positions: Any,
        indices: Any,
        material: int,
        *,
        normals: Any = None,
        uvs: Any = None,
        name: str = "mesh",
    ) -> int:
        """Adds a triangle mesh, and gives its index: positions (n, 3), indices (m, 3), counter-clockwise in front.

        It is seen once :meth:`add_instance` has placed it. Without ``normals`` (n, 3) it is faceted.
        """
        positions = _array("positions", positions, np.float32, 2)
        indices = _array("indices", _indices("indices", indices), np.uint32, 2)
        normals = None if normals is None else _array("normals", normals, np.float32, 2)
        uvs = None if uvs is None else _array("uvs", uvs, np.float32, 2)
        return self._native.add_mesh(name, positions, indices, _whole("material", material), normals, uvs)

    def positions(self, mesh: int) -> np.ndarray:
        """The vertices of a mesh, (n, 3); a copy."""
        return self._native.positions(_whole("mesh", mesh))

    def indices(self, mesh: int) -> np.ndarray:
        """The triangles of a mesh, (m, 3); a copy."""
        return self._native.indices(_whole("mesh", mesh))

    def set_positions(self, mesh: int, positions: Any) -> None:
        """Moves the vertices of a mesh, whose number stays."""
        self._native.set_positions(_whole("mesh", mesh), _array("positions", positions, np.float32, 2))

    def add_instance(self, mesh: int, transform: Any = None) -> int:
        """Places a mesh by a matrix (4, 4) that multiplies column vectors; gives the index of the instance."""
        matrix = None if transform is None else _array("the numbers of a transform", transform, np.float64, 2)
        return self._native.add_instance(_whole("mesh", mesh), matrix)

    def set_transform(self, instance: int, transform: Any) -> None:
        """Places an instance anew."""
        matrix = _array("the numbers of a transform", transform, np.float64, 2)
        self._native.set_transform(_whole("instance", instance), matrix)

    def add_light(
        self,
        kind: str,
        intensity: Sequence[float],
        *,
        position: Sequence[float] | None = None,
        direction: Sequence[float] | None = None,
        inner: float = 0.0,
        outer: float = 45.0,
    ) -> None:
        """Adds a ``point``, ``spot`` or ``directional`` light; the angles of a spot light are in degrees."""
        position, direction = (None if v is None else [float(x) for x in v] for v in (position, direction))
        self._native.add_light(kind, list(intensity), position, direction, inner, outer)

    def set_environment(self, radiance: Any, *, scale: float = 1.0, rotation: float = 0.0) -> None:
        """Light from all around: a latitude-longitude image (height, width, 3), or one colour; turned about +y by degrees."""
        if np.ndim(radiance) == 1:
            radiance = np.broadcast_to(radiance, (1, 2, 3))
        pixels = _array("the pixels of an environment", radiance, np.float32, 3)
        for warning in self._native.set_environment(pixels, scale, rotation):
            warnings.warn(warning, stacklevel=2)

    def fill(self, medium: str, scale: float | None = None) -> None:
        """Fills all closed meshes that emit nothing with a medium that scatters light.

        ``medium`` is a name or a colour ("milk", "0.9,0.5,0.2"), ``scale`` the length of a millimetre in the scene.
        """
        self._native.fill(medium, scale)

    def add_default_light(self) -> None:
        """Adds a light above the scene."""
        self._native.add_default_light()


def load(
    scene: str | os.PathLike[str],
    *,
    environment: Any = None,
    subsurface: str | None = None,
    default_light: bool = False,
) -> Scene:
    """Loads a built-in scene by its name (:func:`scenes` lists them), or a ``.gltf`` or ``.glb`` file.

    ``environment`` is a latitude-longitude image, as an array, an :class:`Image` or an EXR file. What the import skips
    or assumes comes as warnings.
    """
    loaded = Scene(_restir.Scene.load(os.fspath(scene)))
    for warning in loaded.warnings:
        warnings.warn(warning, stacklevel=2)
    if environment is not None:
        is_file = isinstance(environment, (str, os.PathLike))
        loaded.set_environment(np.asarray(read(environment) if is_file else environment))
    if subsurface is not None:
        loaded.fill(subsurface)
    if default_light:
        loaded.add_default_light()
    return loaded


_opened: dict[str, Device] = {}


def _device(device: str | Device) -> Device:
    """A device by its name is opened once; the CPU has as many threads as RAYON_NUM_THREADS says, or one a core."""
    if isinstance(device, Device):
        return device
    if device not in _opened:
        threads = os.environ.get("RAYON_NUM_THREADS", "") if device == "cpu" else ""
        _opened[device] = Device(device, threads=int(threads) if threads.isdecimal() and int(threads) > 0 else None)
    return _opened[device]


def _text(value: object) -> str:
    if isinstance(value, bool):
        return "on" if value else "off"
    return str(value)


def _pairs(given: Settings | None, max_depth: int | None = None) -> list[str]:
    if max_depth is not None and "max_depth" in (given or {}):
        raise RestirError("max_depth was given twice, once among the settings; leave one of them out")
    pairs = [f"{key}={_text(value)}" for key, value in (given or {}).items()]
    # a preset sets everything
    pairs.sort(key=lambda pair: not pair.startswith("preset="))
    return pairs + ([] if max_depth is None else [f"max_depth={max_depth}"])


def _repeats(technique: str) -> str:
    for name, repeats, _ in _restir.techniques():
        if name == technique:
            return repeats
    return "samples"


def _scene(scene: Any) -> _restir.Scene:
    if not isinstance(scene, Scene):
        raise RestirError(f"{scene!r} is no scene; give restir.load(...) of it, or a restir.Scene")
    return scene._native


def _camera(camera: Any) -> tuple | None:
    if camera is not None and not isinstance(camera, Camera):
        raise RestirError(f"{camera!r} is no camera; give a restir.Camera")
    return None if camera is None else camera._tuple()


def _whole(name: str, value: Any, least: int = 0) -> int:
    """A whole number that fits into 32 bits."""
    is_whole = isinstance(value, (int, np.integer)) and not isinstance(value, bool)
    if not is_whole or not least <= value < 2**32:
        raise RestirError(f"{name} is {value!r}; give a whole number from {least} to {2**32 - 1}")
    return int(value)


def _finite(name: str, value: Any) -> float:
    if not isinstance(value, (int, float, np.integer, np.floating)) or not np.isfinite(value):
        raise RestirError(f"{name} is {value!r}; give a number")
    return float(value)


def _vector(name: str, value: Any) -> list[float]:
    try:
        vector = [float(x) for x in value]
    except (TypeError, ValueError):
        vector = []
    if len(vector) != 3:
        raise RestirError(f"{name} is {value!r}; give three numbers")
    return vector


def _files(parts: Iterable[str | os.PathLike[str]]) -> list[str]:
    if isinstance(parts, (str, os.PathLike)):
        raise RestirError(f"{os.fspath(parts)!r} is one file; give a list of the files of all parts")
    return [os.fspath(part) for part in parts]


def _size(size: Any) -> list[int]:
    if not isinstance(size, Sequence) or len(size) != 2:
        raise RestirError(f"size is {size!r}; give (width, height) in pixels")
    return [_whole("size", side) for side in size]


def _indices(name: str, array: Any) -> np.ndarray:
    """Whole numbers as 32 bits have them: others would become something else."""
    array = np.asarray(array)
    if array.dtype.kind not in "iu" or (array.size and (array.min() < 0 or array.max() >= 2**32)):
        raise RestirError(f"{name} are to be whole numbers from 0 to {2**32 - 1}; convert them first")
    return np.ascontiguousarray(array, np.uint32)


def _array(name: str, array: Any, dtype: Any, dimensions: int) -> np.ndarray:
    try:
        array = np.ascontiguousarray(array, dtype)
    except (TypeError, ValueError) as error:
        raise RestirError(f"{name} cannot be made an array of numbers: {error}") from error
    if array.ndim != dimensions:
        raise RestirError(f"{name} have the shape {array.shape}; give an array of {dimensions} dimensions")
    return array


def _request(
    technique: str,
    settings: Settings | None,
    size: tuple[int, int] | None,
    count: int | None,
    accumulate: bool,
    seed: int,
    camera: Camera | None,
    frame: float,
    denoise: bool,
    max_depth: int | None,
) -> dict[str, Any]:
    return {
        "technique": technique,
        "settings": _pairs(settings, max_depth),
        "size": None if size is None else _size(size),
        "count": None if count is None else _whole("the number of samples or frames", count, 1),
        "accumulate": accumulate,
        "seed": _whole("seed", seed),
        "camera": _camera(camera),
        "frame": _finite("frame", frame),
        "denoise": denoise,
    }


def render(
    scene: Scene,
    *,
    technique: str = "path",
    samples: int | None = None,
    frames: int | None = None,
    settings: Settings | None = None,
    size: tuple[int, int] | None = None,
    max_depth: int | None = None,
    seed: int = 0,
    camera: Camera | None = None,
    frame: float = 0.0,
    denoise: bool = False,
    layers: Iterable[str] = (),
    inspect: bool = False,
    device: str | Device = "cpu",
    progress: Progress | None = None,
) -> Image:
    """Renders an image.

    ``samples`` are samples a pixel of path tracing, and of techniques that reuse the frames that the image is the mean
    of. With ``frames`` instead, the image is the last one of so many frames. ``settings`` are those that
    :func:`settings` lists. ``size`` is (width, height). ``layers`` are what the camera sees: albedo, normal, depth,
    position, motion, id, scattering; with ``inspect`` the image also has those of the technique, its reservoirs.
    ``progress`` is called with the share that is done. The interpreter's lock is free meanwhile, and Ctrl-C ends it.
    """
    count, accumulate = _count(technique, samples, frames)
    request = _request(technique, settings, size, count, accumulate, seed, camera, frame, denoise, max_depth)
    names = [layers] if isinstance(layers, str) else list(layers)
    color, more, metadata = _restir.render(_scene(scene), request, names, inspect, _device(device), progress)
    return Image(color, more, dict(metadata))


def _count(technique: str, samples: int | None, frames: int | None) -> tuple[int | None, bool]:
    if samples is not None and frames is not None:
        raise RestirError("samples and frames were both given; give samples for the mean, or frames for the last of them")
    if frames is not None and _repeats(technique) == "samples":
        raise RestirError(f"{technique} has no frames that reuse each other; give samples")
    return (samples, _repeats(technique) == "frames" and samples is not None) if frames is None else (frames, False)


def render_part(
    path: str | os.PathLike[str],
    scene: Scene,
    *,
    samples: range | None = None,
    chains: range | None = None,
    frames: range | int | None = None,
    tile: Tile | None = None,
    of: int | None = None,
    technique: str = "path",
    settings: Settings | None = None,
    size: tuple[int, int] | None = None,
    max_depth: int | None = None,
    seed: int = 0,
    camera: Camera | None = None,
    frame: float = 0.0,
    device: str | Device = "cpu",
    progress: Progress | None = None,
) -> None:
    """Renders a part of an image to a file, which :func:`merge` puts together with others to the bits of one render.

    The part is a range of ``samples`` of path tracing, of a ``tile`` if there is one; of ``chains`` of ``frames``
    frames each, with a seed of its own each; or a range of ``frames`` of one chain. ``of`` is how many samples the image
    has in all: merging then refuses an image of fewer.
    """
    ranges = {"samples": samples, "chains": chains, "frames": frames if isinstance(frames, range) else None}
    given = [(unit, of_unit) for unit, of_unit in ranges.items() if of_unit is not None]
    if len(given) != 1:
        raise RestirError("a part is of samples, of chains or of frames; give one range of them")
    unit, span = given[0]
    if not isinstance(span, range):
        raise RestirError(f"{unit} is {span!r}; give a range of them, as in range(0, 64)")
    if span.step != 1:
        raise RestirError(f"the range of {unit} has a step of {span.step}; give consecutive ones")
    length = None if isinstance(frames, range) else frames
    if unit != "chains" and length is not None:
        raise RestirError(f"frames is {frames!r}; a number of them is for chains, and frames of one chain are a range")
    if unit != "samples" and of is not None:
        raise RestirError(f"of is how many samples an image has, and this is a part of {unit}; leave it out")
    count = {"samples": span.stop if of is None else of, "chains": length, "frames": span.stop}[unit]
    request = _request(technique, settings, size, count, unit == "chains", seed, camera, frame, False, max_depth)
    corners = None
    if tile is not None:
        if not isinstance(tile, Tile):
            raise RestirError(f"{tile!r} is no tile; give a restir.Tile")
        x, y, width, height = (_whole("a tile", side) for side in (tile.x, tile.y, tile.width, tile.height))
        corners = (x, y, width, height)
    ends = _whole(unit, span.start), _whole(unit, span.stop)
    _restir.render_part(os.fspath(path), _scene(scene), request, unit, ends, corners, _device(device), progress)


def merge(parts: Iterable[str | os.PathLike[str]]) -> Image:
    """Merges parts of one image, in any order. Missing parts, parts given twice and parts of another render are errors."""
    color, metadata = _restir.merge_parts(_files(parts))
    return Image(color, {}, dict(metadata))


def noise(parts: Iterable[str | os.PathLike[str]]) -> tuple[float, int]:
    """The noise of the mean of parts, by how far they differ, and how many samples or chains it has.

    It is the standard error, root mean square over the image, relative to the image's mean.
    """
    return _restir.noise_of_parts(_files(parts))


class Session:
    """Frame after frame, each of which reuses what those before it have found."""

    def __init__(
        self,
        scene: Scene,
        *,
        technique: str = "restir-di",
        settings: Settings | None = None,
        size: tuple[int, int] | None = None,
        seed: int = 0,
        samples: int = 1,
        mean_of: int | None = None,
        denoise: bool = False,
        device: str | Device = "cpu",
    ) -> None:
        """Of path tracing a frame has so many ``samples``; with ``mean_of`` the image is the mean of frames, of at most
        so many, until the view changes."""
        pixels = _size(size or scene.default_size or (512, 512))
        counts = _whole("seed", seed), _whole("samples", samples, 1), None if mean_of is None else _whole("mean_of", mean_of, 1)
        native = technique, _pairs(settings), pixels, *counts, denoise, _device(device)
        self._native = _restir.Session(_scene(scene), *native)
        #: What became of earlier frames in the last one: "new", "kept", or what has changed.
        self.history = "new"

    def render(
        self, *, camera: Camera | None = None, frame: float | None = None, scene: Scene | None = None
    ) -> Image:
        """The next frame, of the scene at a ``frame`` of its animation or as it was edited, if either is given."""
        edited = None if scene is None else _scene(scene)
        color, self.history = self._native.render(_camera(camera), frame, edited)
        return Image(color, {}, {"frame": str(self.frames - 1)})

    @property
    def frames(self) -> int:
        """How many frames there were since the history began."""
        return self._native.frames

    def reset(self) -> None:
        """Forgets earlier frames."""
        self._native.reset()


def explain(
    scene: Scene,
    pixel: tuple[int, int],
    *,
    technique: str = "path",
    sample: int = 0,
    frames: int | None = None,
    settings: Settings | None = None,
    size: tuple[int, int] | None = None,
    max_depth: int | None = None,
    seed: int = 0,
    camera: Camera | None = None,
    device: str | Device = "cpu",
) -> dict[str, Any]:
    """How a pixel (column, row) came about: its path, or where its reservoir's sample came from.

    The item ``text`` has lines to read.
    """
    request = _request(technique, settings, size, frames, False, seed, camera, 0.0, False, max_depth)
    place = [_whole("pixel", side) for side in pixel]
    text, data = _restir.explain(_scene(scene), request, place, _whole("sample", sample), _device(device))
    return {**json.loads(data), "text": text}


@dataclass(frozen=True)
class Technique:
    """A technique: what its renders repeat ("samples" or "frames"), and what it does."""

    name: str
    repeats: str
    summary: str


def techniques() -> dict[str, Technique]:
    """The techniques by name."""
    return {technique[0]: Technique(*technique) for technique in _restir.techniques()}


@dataclass(frozen=True)
class Setting:
    """A setting: its default, what it may be with its unit, and what it does."""

    default: str
    expected: str
    doc: str


def settings(technique: str) -> dict[str, Setting]:
    """The settings of a technique by key."""
    return {key: Setting(*rest) for key, *rest in _restir.settings(technique)}


def presets(technique: str) -> list[str]:
    """The names of a technique's presets, for ``settings={"preset": name}``."""
    return _restir.presets(technique)


def biases(technique: str, settings: Settings | None = None) -> list[str]:
    """Why the mean of images with these settings may be wrong; empty for unbiased ones."""
    return _restir.biases(technique, _pairs(settings))


def scenes() -> dict[str, str]:
    """The built-in scenes, and what each shows."""
    return dict(_restir.scenes())


def devices() -> list[dict[str, str]]:
    """The GPU adapters, hardware first."""
    return _restir.devices()


def read(path: str | os.PathLike[str]) -> Image:
    """Reads an EXR file."""
    color, metadata = _restir.read_exr(os.fspath(path))
    return Image(color, {}, dict(metadata))


def compare(image: Any, reference: Any) -> dict[str, Any]:
    """How far an image is from a reference: identical, rmse, rel_mse, rmae, mean_ratio and others."""
    return _restir.compare(*(_array("the pixels of an image", array, np.float32, 3) for array in (image, reference)))


def bench(
    scene: Scene,
    candidates: Mapping[str, Mapping[str, Any]],
    *,
    reference: Any,
    repeats: int = 4,
    **common: Any,
) -> list[dict[str, Any]]:
    """Time and error of renders: a row for each of the candidates, which are arguments of :func:`render` by name.

    Each is rendered ``repeats`` times with other seeds, in turn with the others. A row has the median of the ``seconds``,
    the root mean square ``rmse`` and mean ``rel_mse`` over the repeats, and ``efficiency``, 1 / (rmse² seconds), where
    more is better.
    """
    rows: dict[str, list[tuple[float, dict[str, Any]]]] = {name: [] for name in candidates}
    for repeat in range(_whole("repeats", repeats, 1)):
        for name, arguments in candidates.items():
            arguments = {**common, **arguments}
            arguments["seed"] = arguments.get("seed", 0) + 1000 * repeat
            start = time.perf_counter()
            image = render(scene, **arguments)
            rows[name].append((time.perf_counter() - start, compare(image, reference)))
    return [_row(name, measured) for name, measured in rows.items()]


def _row(name: str, measured: list[tuple[float, dict[str, Any]]]) -> dict[str, Any]:
    seconds = float(np.median([seconds for seconds, _ in measured]))
    mse = float(np.mean([error["rmse"] ** 2 for _, error in measured]))
    rel_mse = float(np.mean([error["rel_mse"] for _, error in measured]))
    efficiency = float("inf") if mse == 0.0 else 1.0 / (mse * seconds)
    return {"name": name, "seconds": seconds, "rmse": mse**0.5, "rel_mse": rel_mse, "efficiency": efficiency}
