"""The files of a sweep: Parquet, each whole or not there, each knowing which sweep it belongs to."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from pathlib import Path

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from drivetrain.errors import Fault, InputError
from drivetrain.sweep.points import Sweep
from drivetrain.sweep.rows import NUMBERS, WORDS, Row
from drivetrain.whole_files import write_whole

FOLDER = "shards"
_DIGEST = b"drivetrain.sweep"


def shard_path(out: Path, shard: int) -> Path:
    """Where the file of a shard lies."""
    return out / FOLDER / f"{shard:05d}.parquet"


def write_shard(out: Path, shard: int, sweep: Sweep, digest: str, rows: Sequence[Row]) -> None:
    """Write the rows of one shard, whole or not at all."""
    schema = _schema(sweep).with_metadata({_DIGEST: f"{digest}:{shard}".encode()})
    table = pa.Table.from_pylist(list(rows), schema=schema)
    place = shard_path(out, shard)
    place.parent.mkdir(parents=True, exist_ok=True)
    write_whole(place, lambda file: pq.write_table(table, file, compression="zstd"))


def done_shards(out: Path, sweep: Sweep, digest: Callable[[int], str]) -> set[int]:
    """The shards that need no more work."""
    found: set[int] = set()
    for shard in range(sweep.shards):
        place = shard_path(out, shard)
        if not place.is_file():
            continue
        if _told(place) != f"{digest(shard)}:{shard}":
            problem = "holds results of another sweep, or of files that have changed since"
            raise InputError(Fault("--out", problem, str(out), "give another folder, or remove this one"))
        found.add(shard)
    return found


def read_results(out: str | Path) -> pd.DataFrame:
    """All points of a sweep that are done.

    Args:
        out: Folder of its results.

    Returns:
        One row a point, by ``point``: what was varied (texts), ``feasible``, ``objective``, ``mass`` [kg], ``price``,
        ``energy`` [J a cycle], ``utilisation``, ``verdict``, ``proof``, ``binding_joint``, ``binding_check``,
        ``drives``, ``fault``.

    Raises:
        InputError: No results there.
    """
    files = sorted((Path(out) / FOLDER).glob("*.parquet"))
    if not files:
        raise InputError(Fault("out", "holds no results of a sweep", str(out)))
    table = pa.concat_tables([pq.read_table(file).replace_schema_metadata(None) for file in files])
    frame: pd.DataFrame = table.to_pandas()
    return frame


def _schema(sweep: Sweep) -> pa.Schema:
    """The columns, whatever the rows hold."""
    varied = [(name, pa.string()) for name in sweep.names]
    numbers = [(name, pa.float64()) for name in NUMBERS]
    words = [(name, pa.string()) for name in WORDS]
    return pa.schema([("point", pa.int64()), *varied, ("feasible", pa.bool_()), *numbers, *words])


def _told(place: Path) -> str:
    """What a file says it belongs to; nothing for one that cannot be read."""
    try:
        metadata = pq.read_schema(place).metadata or {}
    except (OSError, pa.ArrowInvalid):
        return ""
    return metadata.get(_DIGEST, b"").decode()
