"""A sweep run here or on a cluster: shards are given out, and kept as they come back.

Studies are read here and sent along whole, so that workers need none of their files. A worker that dies takes nothing
with it: its shards are given to another, and what is done lies in its file.
"""

from __future__ import annotations

import hashlib
import logging
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice
from pathlib import Path
from typing import TYPE_CHECKING

from drivetrain.errors import Fault, InputError
from drivetrain.study.document import Document
from drivetrain.study.model import Study
from drivetrain.sweep.points import Point, Sweep, study_of
from drivetrain.sweep.shards import Row, done_shards, rows_of, write_shard

if TYPE_CHECKING:
    from distributed import Client

Report = Callable[[int, int, str], None]
AHEAD = 3  # shards a worker has waiting: it is never idle, and few studies are held at a time
RETRIES = 5  # of a shard whose worker died
KEPT = 16  # studies in memory

Work = list[tuple[Point, Study | str]]


def run_sweep(
    sweep: Sweep,
    out: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Report | None = None,
) -> int:
    """Judge every point that is not done yet, and keep the results in shards.

    Args:
        sweep: What is varied.
        out: Folder of the results; those of the same sweep that lie there are kept.
        workers: Processes of a cluster on this machine; 0: none, one point after another; None: one a core.
        scheduler: Address of a running dask scheduler, such as ``tcp://host:8786``, instead.
        progress: Called with the number of shards done, and of all.

    Returns:
        How many shards were computed, those found done not counted.

    Raises:
        InputError: Results of another sweep in the folder, a negative number of workers, or no such scheduler.
    """
    if workers is not None and workers < 0:
        raise InputError(Fault("--workers", "must be 0 or more", workers))
    folder, shards = Path(out), _Shards(sweep)
    done = done_shards(folder, sweep, shards.digest)
    todo = [shard for shard in range(sweep.shards) if shard not in done]
    report = progress or (lambda *_: None)
    report(len(done), sweep.shards, "shards")
    run: Iterator[tuple[int, list[Row]]] = ((shard, rows_of(sweep, shards.work(shard))) for shard in todo)
    if workers != 0 or scheduler is not None:
        run = _spread(shards, todo, workers, scheduler)
    for count, (shard, rows) in enumerate(run, len(done) + 1):
        write_shard(folder, shard, sweep, shards.digest(shard), rows)
        report(count, sweep.shards, "shards")
    return len(todo)


class _Shards:
    """The studies of a sweep, read once for all points that differ in the task alone."""

    def __init__(self, sweep: Sweep) -> None:
        self.sweep = sweep
        self._kept: dict[str, Study | str] = {}
        self._digests: dict[str, str] = {}

    def work(self, shard: int) -> Work:
        """The points of a shard, each with its study or what is wrong with it."""
        return [(point, self._read(point)) for point in self.sweep.points(shard)]

    def digest(self, shard: int) -> str:
        """Of the sweep and of every file that the studies of a shard were read from."""
        parts = [self.sweep.digest()]
        for point in self.sweep.points(shard):
            key = repr(point.entries)
            if key not in self._digests:
                study = self._read(point)
                self._digests[key] = study if isinstance(study, str) else study.digest
            parts.append(self._digests[key])
        return hashlib.sha256("\0".join(parts).encode()).hexdigest()

    def _read(self, point: Point) -> Study | str:
        key = repr(point.entries)
        if key not in self._kept:
            if len(self._kept) >= KEPT:
                del self._kept[next(iter(self._kept))]
            try:
                self._kept[key] = study_of(self.sweep, point)
            except InputError as error:
                self._kept[key] = str(error)
        return self._kept[key]


def _spread(
    shards: _Shards, todo: list[int], workers: int | None, scheduler: str | None
) -> Iterator[tuple[int, list[Row]]]:
    """Shards on a cluster, in the order in which they are finished."""
    if not todo:
        return
    from distributed import as_completed

    # Workers need only what is varied.
    light = replace(shards.sweep, document=Document(shards.sweep.document.path, b"", {}, {}))
    with _client(workers, scheduler) as client:
        cores = max(len(client.scheduler_info(n_workers=-1)["workers"]), 1)
        waiting = iter(todo)

        def given(shard: int) -> object:
            # Not pure: a scheduler that outlives this run must not hand out answers of an earlier one.
            return client.submit(_shard, light, shard, shards.work(shard), pure=False, retries=RETRIES)

        running = as_completed([given(shard) for shard in islice(waiting, AHEAD * cores)])
        for future in running:
            yield future.result()
            future.release()
            for shard in islice(waiting, 1):
                running.add(given(shard))


def _shard(sweep: Sweep, shard: int, work: Work) -> tuple[int, list[Row]]:
    return shard, rows_of(sweep, work)


@contextmanager
def _client(workers: int | None, scheduler: str | None) -> Iterator[Client]:
    """A running cluster, or one on this machine."""
    from distributed import Client, LocalCluster

    if scheduler is not None:
        try:
            client = Client(scheduler, timeout="10s")
        except (OSError, ValueError) as error:
            problem = "no dask scheduler answers there"
            raise InputError(Fault("--scheduler", problem, scheduler, str(error).splitlines()[0])) from None
        with client:
            yield client
        return
    with (
        LocalCluster(
            n_workers=workers,
            threads_per_worker=1,
            processes=True,
            dashboard_address="127.0.0.1:0",  # any free port: two sweeps at once would want the same
            scheduler_kwargs={"dashboard": False},
            silence_logs=logging.CRITICAL,
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client
