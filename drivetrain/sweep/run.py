"""Run a sweep in this process or on a cluster: shards are distributed to workers, and written when they are done.

Studies are read here and sent to the workers, which therefore need no files. If a worker dies, its shards are
computed by another one; finished shards are already written.
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
from drivetrain.study.document import Document, varied
from drivetrain.study.model import Study
from drivetrain.study.read import study_from
from drivetrain.sweep.points import Point, Sweep
from drivetrain.sweep.shards import Row, done_shards, rows_of, write_shard

if TYPE_CHECKING:
    from distributed import Client

Report = Callable[[int, int, str], None]
AHEAD = 3  # shards queued per worker: enough to keep it busy, without holding many studies in memory
RETRIES = 5  # attempts to recompute a shard whose worker died
KEPT = 16  # largest number of studies held in memory
SCHEDULER_ANSWERS = "10s"  # time within which a running scheduler must answer

Work = list[tuple[Point, Study | str]]


def run_sweep(
    sweep: Sweep,
    out: str | Path,
    *,
    workers: int | None = None,
    scheduler: str | None = None,
    progress: Report | None = None,
) -> int:
    """Evaluate every point that has no result yet, and write the results in shards.

    Args:
        sweep: The sweep.
        out: Folder of the results; existing results of the same sweep are kept.
        workers: Number of processes on this machine; 0: this process only; None: one per core.
        scheduler: Address of a running dask scheduler, such as ``tcp://host:8786``, to use instead.
        progress: Called with the number of finished shards, the number of all shards, and a text.

    Returns:
        Number of shards that were computed, without those found finished.

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
    """The studies of a sweep, each read once for all points that differ only in the task."""

    def __init__(self, sweep: Sweep) -> None:
        self.sweep = sweep
        self._kept: dict[str, Study | str] = {}
        self._digests: dict[str, str] = {}

    def work(self, shard: int) -> Work:
        """The points of a shard, each with its study or the text of its faults."""
        return [(point, self._read(point)) for point in self.sweep.points(shard)]

    def digest(self, shard: int) -> str:
        """Digest of the sweep and of all files from which the studies of a shard were read."""
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
                self._kept[key] = study_from(varied(self.sweep.document, dict(point.entries)))
            except InputError as error:
                self._kept[key] = str(error)
        return self._kept[key]


def _spread(
    shards: _Shards, todo: list[int], workers: int | None, scheduler: str | None
) -> Iterator[tuple[int, list[Row]]]:
    """Index and rows of shards computed on a cluster, in the order in which they finish."""
    if not todo:
        return
    from distributed import as_completed

    # The workers do not need the study file, only the varied entries.
    light = replace(shards.sweep, document=Document(shards.sweep.document.path, b"", {}, {}))
    with _client(workers, scheduler) as client:
        cores = max(len(client.scheduler_info(n_workers=-1)["workers"]), 1)
        waiting = iter(todo)

        def given(shard: int) -> object:
            # pure=False: a scheduler that keeps running must not return cached results of an earlier run.
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
    """Client of the running scheduler, or of a cluster on this machine for the duration of the context."""
    from distributed import Client, LocalCluster

    if scheduler is not None:
        try:
            client = Client(scheduler, timeout=SCHEDULER_ANSWERS)
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
            dashboard_address="127.0.0.1:0",  # any free port, since two sweeps may run at the same time
            scheduler_kwargs={"dashboard": False},
            silence_logs=logging.CRITICAL,
        ) as cluster,
        Client(cluster) as client,
    ):
        yield client
