"""Renders over workers that end, hang, or send a part twice: the same bits."""

import logging
import os
import random
import signal
import time

import pytest
import restir
from conftest import same

dask = pytest.importorskip("distributed")
import restir.distributed  # noqa: E402

SIZE = (96, 64)
SAMPLES = 640
ENDED = 20


@pytest.fixture(scope="module")
def client():
    dask.client.logger.setLevel(logging.CRITICAL)
    options = {"n_workers": 4, "threads_per_worker": 1, "dashboard_address": None, "silence_logs": logging.CRITICAL}
    with dask.LocalCluster(**options) as cluster, dask.Client(cluster) as client:
        yield client


@pytest.fixture(scope="module")
def expected(cornell):
    return restir.render(cornell, samples=SAMPLES, size=SIZE)


def pids(client) -> list[int]:
    """Process numbers of the workers that answer: one that has ended may still be listed."""
    answers = client.run(os.getpid, on_error="return").values()
    return sorted(answer for answer in answers if isinstance(answer, int))


def four_workers(client) -> list[int]:
    """Process numbers of four workers or more: Dask starts most of those again that have ended, and gives up on some."""
    for second in range(60):
        found = pids(client)
        if len(found) >= 4:
            return found
        if second % 4 == 3:
            client.cluster.scale(len(client.cluster.worker_spec) + 4 - len(found))
        time.sleep(1.0)
    raise TimeoutError("there are no four workers")


def test_it_has_the_bits_of_one_process(client, expected):
    seen = []
    image = restir.distributed.render(client, "cornell", samples=SAMPLES, part=70, size=SIZE, progress=seen.append)
    assert same(image, expected) and image.metadata["samples"] == str(SAMPLES)
    assert seen[-1] == 1.0 and seen == sorted(seen)


def test_chains_of_frames(client, cornell, tmp_path):
    common = {"technique": "restir-di", "frames": 2, "size": SIZE}
    image = restir.distributed.render(client, "cornell", chains=6, part=2, **common)
    restir.render_part(tmp_path / "a.part", cornell, chains=range(6), **common)
    assert same(image, restir.merge([tmp_path / "a.part"]))


def test_a_sentence_of_the_library_ends_it(client):
    with pytest.raises(restir.RestirError, match="there is no setting"):
        restir.distributed.render(client, "cornell", samples=8, size=SIZE, settings={"nope": 1})
    with pytest.raises(restir.RestirError, match="give one of them"):
        restir.distributed.render(client, "cornell", size=SIZE)
    with pytest.raises(restir.RestirError, match="it renders whole images"):
        restir.distributed.render(client, "cornell", samples=8, tile=restir.Tile(0, 0, 1, 1))
    with pytest.raises(restir.RestirError, match="cannot be sent to workers"):
        restir.distributed.render(client, "cornell", samples=8, device=restir.Device("cpu"))


def test_workers_that_end_change_nothing(client, expected, caplog):
    generator = random.Random(20)
    caplog.set_level(logging.INFO, "restir.distributed")
    for _ in range(ENDED):
        worker = generator.choice(four_workers(client))
        share = generator.uniform(0.0, 0.6)
        ended = []

        def end_one(done):
            if done >= share and not ended:
                os.kill(worker, signal.SIGKILL)
                ended.append(done)

        image = restir.distributed.render(client, "cornell", samples=SAMPLES, part=20, size=SIZE, progress=end_one)
        assert same(image, expected)
        assert ended and ended[0] < 1.0, "the worker ended during the render"
    said = caplog.text.count("has ended; what it had in work is rendered elsewhere")
    assert said >= ENDED // 2, "the log says who has ended"


def test_parts_that_are_late_are_rendered_elsewhere_too(client, expected, caplog):
    caplog.set_level(logging.INFO, "restir.distributed")
    image = restir.distributed.render(client, "cornell", samples=SAMPLES, part=256, size=SIZE, timeout=0.1)
    assert same(image, expected)
    assert "are rendered elsewhere, too" in caplog.text


def test_a_part_that_comes_twice_counts_once(client, tmp_path, caplog):
    caplog.set_level(logging.INFO, "restir.distributed")
    span = range(0, 2)
    call = lambda span: client.submit(restir.distributed._part, "cornell", "samples", *(0, 2), {"size": SIZE}, pure=False)
    work = restir.distributed._Work(client, call, [span], retries=0)
    for task in [work.submit(span), work.submit(span)]:
        dask.wait(task)
        assert restir.distributed._take(work, task, work.tasks.pop(task), tmp_path) is None
    assert not work.missing and len(list(tmp_path.iterdir())) == 1
    assert "samples 0..1 came twice" in caplog.text


def test_what_a_callback_raises_cancels_the_rest(client):
    def stop(_):
        raise RuntimeError("enough")

    with pytest.raises(RuntimeError, match="enough"):
        restir.distributed.render(client, "cornell", samples=1 << 16, part=64, size=SIZE, progress=stop)
    end = time.monotonic() + 30
    while any(client.processing().values()) and time.monotonic() < end:
        time.sleep(0.1)
    assert not any(client.processing().values())


def test_a_worker_that_hangs_changes_nothing(client, expected, caplog):
    caplog.set_level(logging.INFO, "restir.distributed")
    stopped = random.Random(3).choice(pids(client))
    os.kill(stopped, signal.SIGSTOP)
    try:
        image = restir.distributed.render(client, "cornell", samples=SAMPLES, part=32, size=SIZE, timeout=3.0)
    finally:
        os.kill(stopped, signal.SIGCONT)
    assert same(image, expected)
    assert "are rendered elsewhere, too" in caplog.text
