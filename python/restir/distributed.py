"""Renders over the workers of a Dask cluster, with the bits of one process.

>>> from dask.distributed import Client, LocalCluster
>>> with Client(LocalCluster(n_workers=2, threads_per_worker=1)) as client:  # doctest: +SKIP
...     image = restir.distributed.render(client, "cornell", samples=256)

Any scheduler will do, also one of dask-jobqueue. A worker renders ranges of samples, and what it sends back is merged here. That a
worker ends, hangs, or sends a part twice, changes no bit of the image: the log, ``logging.getLogger("restir.distributed")``,
says what happened.
"""

from __future__ import annotations

import logging
import os
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

from dask.distributed import Client, Future, as_completed
from distributed.scheduler import KilledWorker

import restir

log = logging.getLogger("restir.distributed")


def _part(scene: str, unit: str, start: int, stop: int, arguments: dict[str, Any]) -> bytes:
    """Renders a part; runs on a worker."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "a.part"
        restir.render_part(path, _scene(scene), **{**arguments, unit: range(start, stop)})
        return path.read_bytes()


_loaded: dict[str, restir.Scene] = {}


def _scene(name: str) -> restir.Scene:
    """A scene is read once by each worker."""
    if name not in _loaded:
        _loaded.clear()
        _loaded[name] = restir.load(name)
    return _loaded[name]


def ranges(count: int, length: int) -> list[range]:
    """The ranges of so many samples each, of which the last may be shorter."""
    if count < 1 or length < 1:
        raise restir.RestirError("a render in parts has at least one sample, and so has each part")
    return [range(start, min(start + length, count)) for start in range(0, count, length)]


class _Workers:
    """Who works; says who comes and goes."""

    def __init__(self, client: Client) -> None:
        self.client = client
        self.known = self.present()
        self.looked = time.monotonic()

    def present(self) -> set[str]:
        return set(self.client.scheduler_info(n_workers=-1)["workers"])

    def look(self, every: float = 0.5) -> None:
        if time.monotonic() - self.looked < every:
            return
        present, self.looked = self.present(), time.monotonic()
        for worker in sorted(self.known - present):
            log.warning("the worker %s has ended; what it had in work is rendered elsewhere", worker)
        for worker in sorted(present - self.known):
            log.info("the worker %s has come", worker)
        self.known = present


class _Work:
    """The parts that are not there yet, and the tasks that make them."""

    def __init__(self, client: Client, call: Callable[[range], Future], wanted: list[range], retries: int) -> None:
        self.client, self.call, self.retries = client, call, retries
        self.tasks: dict[Future, range] = {}
        #: When a task was first seen to be in work, by its key: before, it waits for others.
        self.begun: dict[object, float] = {}
        self.looked = time.monotonic()
        self.failures = dict.fromkeys(wanted, 0)
        self.missing = set(wanted)

    def submit(self, span: range) -> Future:
        future = self.call(span)
        self.tasks[future] = span
        return future

    def failed(self, span: range, error: BaseException) -> Future | None:
        """Another try of a part whose task failed, unless another one is under way."""
        if span not in self.missing or span in self.tasks.values():
            return None
        # a sentence of the library would be the same again
        if isinstance(error, restir.RestirError) or self.failures[span] >= self.retries:
            raise error
        self.failures[span] += 1
        why = "its worker ended" if isinstance(error, KilledWorker) else repr(error)
        log.warning("samples %d..%d are rendered again: %s", span.start, span.stop - 1, why)
        return self.submit(span)

    def late(self, timeout: float) -> list[Future]:
        """More tasks for the parts that take long; whichever comes first counts."""
        now = time.monotonic()
        if now - self.looked < timeout / 4.0:
            return []
        self.looked = now
        in_work = {key for keys in self.client.processing().values() for key in keys}
        hopeful = set()
        for future, span in self.tasks.items():
            begun = self.begun.setdefault(future.key, now) if future.key in in_work else now
            if now - begun <= timeout:
                hopeful.add(span)
        late = self.missing - hopeful
        for span in late:
            log.warning("samples %d..%d take over %g s and are rendered elsewhere, too", span.start, span.stop - 1, timeout)
        return [self.submit(span) for span in late]


def render(
    client: Client,
    scene: str | os.PathLike[str],
    *,
    samples: int | None = None,
    chains: int | None = None,
    part: int | None = None,
    retries: int = 8,
    timeout: float | None = None,
    progress: Callable[[float], object] | None = None,
    **arguments: Any,
) -> restir.Image:
    """Renders an image in parts of ``part`` samples or chains each, on the workers of ``client``.

    ``scene`` is a built-in scene, or a file that every worker can read. Further arguments are those of
    :func:`restir.render_part`. A part whose worker ended is rendered again, up to ``retries`` times; one that a worker has
    had for ``timeout`` seconds is rendered elsewhere, too. What raises an exception here, as Ctrl-C does, cancels the rest.
    """
    asked = [(unit, count) for unit, count in (("samples", samples), ("chains", chains)) if count is not None]
    if len(asked) != 1:
        raise restir.RestirError("an image has samples or chains; give one of them")
    unit, count = asked[0]
    refused = {"tile": "it renders whole images", "of": "samples says how many there are"}
    for name in refused.keys() & arguments.keys():
        raise restir.RestirError(f"distributed.render has no {name}: {refused[name]}; leave it out")
    if isinstance(arguments.get("device"), restir.Device):
        raise restir.RestirError("a device cannot be sent to workers; give its name, cpu or gpu")
    workers = _Workers(client)
    wanted = ranges(count, part or _length(count, max(1, len(workers.known))))
    if unit == "samples":
        arguments["of"] = count

    def call(span: range) -> Future:
        task = os.fspath(scene), unit, span.start, span.stop, arguments
        return client.submit(_part, *task, pure=False, retries=0)

    work = _Work(client, call, wanted, retries)
    with tempfile.TemporaryDirectory() as folder:
        try:
            _collect(work, workers, Path(folder), timeout, progress)
            workers.look(every=0.0)
        finally:
            client.cancel(list(work.tasks), force=True)
        image = restir.merge(sorted(Path(folder).iterdir()))
    return image


def _length(count: int, workers: int) -> int:
    """Samples of a part: some four parts a worker, aligned, so that a part is a single block."""
    length = max(1, count // (4 * workers))
    return 1 << (length.bit_length() - 1)


def _collect(
    work: _Work,
    workers: _Workers,
    folder: Path,
    timeout: float | None,
    progress: Callable[[float], object] | None,
) -> None:
    """Writes the parts to the folder as they come."""
    total = len(work.missing)
    tasks = as_completed([work.submit(span) for span in sorted(work.missing, key=lambda span: span.start)])
    while work.missing:
        future = _next(tasks, 0.5 if timeout is None else min(0.5, timeout / 4.0))
        if future is not None:
            span = work.tasks.pop(future)
            again = _take(work, future, span, folder)
            if again is not None:
                tasks.add(again)
        workers.look()
        if progress is not None:
            progress(1.0 - len(work.missing) / total)
        if timeout is not None:
            for late in work.late(timeout):
                tasks.add(late)


def _next(tasks: as_completed, seconds: float) -> Future | None:
    """The next task that is done, if one is within some time."""
    end = time.monotonic() + seconds
    while time.monotonic() < end:
        if tasks.has_ready():
            return next(tasks)
        time.sleep(0.005)
    return None


def _take(work: _Work, future: Future, span: range, folder: Path) -> Future | None:
    """Writes what a task made; gives another one, if it has to be made again."""
    if future.cancelled():
        return work.failed(span, RuntimeError("the task was cancelled"))
    if future.status != "finished":
        return work.failed(span, future.exception() or RuntimeError("the task was lost"))
    if span not in work.missing:
        log.info("samples %d..%d came twice", span.start, span.stop - 1)
        return None
    try:
        part = future.result(timeout=60)
    except Exception as error:  # its worker ended after the task and before it was asked
        return work.failed(span, error)
    (folder / f"{span.start:010}.part").write_bytes(part)
    work.missing.discard(span)
    future.release()
    return None
