"""Results of a sweep: one row of plain values per point, and the files of rows (shards).

Shards are Parquet files. They are written completely or not at all, and contain the digest of their sweep.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import pandas as pd
import pyarrow as pa
import pyarrow.parquet as pq

from drivetrain.errors import Fault, InputError
from drivetrain.sizing.judge.evaluate import evaluate
from drivetrain.sizing.results import Evaluation, Selection
from drivetrain.sizing.search.search import select
from drivetrain.study.change import changed
from drivetrain.study.model import Study, pair_name
from drivetrain.sweep.points import SELECT, Point, Sweep
from drivetrain.whole_files import write_whole

Row = dict[str, Any]
NUMBERS = ("objective", "mass", "price", "energy", "utilisation")
WORDS = ("verdict", "proof", "binding_joint", "binding_check", "drives", "fault")
FOLDER = "shards"
_DIGEST = b"drivetrain.sweep"


def rows_of(sweep: Sweep, work: Sequence[tuple[Point, Study | str]]) -> list[Row]:
    return [_row(sweep, point, study) for point, study in work]


def _row(sweep: Sweep, point: Point, study: Study | str) -> Row:
    row: Row = {"point": point.index, **dict(zip(sweep.names, point.texts, strict=True)), "feasible": False}
    row |= dict.fromkeys(NUMBERS, math.nan) | dict.fromkeys(WORDS, "")
    if isinstance(study, str):
        return row | {"verdict": "FAULT", "fault": study}
    try:
        return row | _answer(sweep.run, changed(study, point.change))
    except InputError as error:
        return row | {"verdict": "FAULT", "fault": str(error)}


def _answer(run: str, study: Study) -> Row:
    if run == SELECT:
        selection = select(study, advise=False)
        evaluation, drives, proof = selection.evaluation, dict(selection.drives), selection.proof
        found: Selection | Evaluation = selection
    else:
        found = evaluation = evaluate(study)
        drives, proof = {task.name: task.drive for task in study.joints if task.drive}, ""
    known = {name: evaluation.criteria.get(name, math.nan) for name in NUMBERS if name != "objective"}
    if not drives:  # those of the nearest set, which is not chosen
        known |= dict.fromkeys(("mass", "price", "energy"), math.nan)
    place, check = evaluation.binding or ("", None)
    texts = (f"{name}: {pair_name(*keys)}" for name, keys in drives.items())
    return {
        "feasible": found.feasible, "verdict": str(found.verdict), "objective": found.objective, **known,
        "proof": proof, "binding_joint": place, "binding_check": check.name if check else "",
        "drives": "; ".join(texts),
    }  # fmt: skip


def shard_path(out: Path, shard: int) -> Path:
    return out / FOLDER / f"{shard:05d}.parquet"


def write_shard(out: Path, shard: int, sweep: Sweep, digest: str, rows: Sequence[Row]) -> None:
    """Write the rows of one shard, completely or not at all."""
    varied, words = ([(name, pa.string()) for name in names] for names in (sweep.names, WORDS))
    numbers = [(name, pa.float64()) for name in NUMBERS]
    columns = [("point", pa.int64()), *varied, ("feasible", pa.bool_()), *numbers, *words]  # whatever the rows are
    schema = pa.schema(columns, {_DIGEST: f"{digest}:{shard}".encode()})
    table = pa.Table.from_pylist(list(rows), schema=schema)
    place = shard_path(out, shard)
    place.parent.mkdir(parents=True, exist_ok=True)
    write_whole(place, lambda file: pq.write_table(table, file, compression="zstd"))


def done_shards(out: Path, sweep: Sweep, digest: Callable[[int], str]) -> set[int]:
    """Indices of the finished shards; results of another sweep in the folder are a fault."""
    found: set[int] = set()
    for shard in range(sweep.shards):
        place = shard_path(out, shard)
        if not place.is_file():
            continue
        if _digest_of(place) != f"{digest(shard)}:{shard}":
            problem = "holds results of another sweep, or of files that have changed since"
            raise InputError(Fault("--out", problem, str(out), "give another folder, or remove this one"))
        found.add(shard)
    return found


def read_results(out: str | Path) -> pd.DataFrame:
    """Read the results of all finished points of a sweep.

    Args:
        out: Folder of the results.

    Returns:
        One row per point, sorted by ``point``: varied entries (texts), ``feasible``, ``objective``, ``mass`` [kg],
        ``price``, ``energy`` [J per cycle], ``utilisation``, ``verdict``, ``proof``, ``binding_joint`` (or ``supply``,
        ``arm``), ``binding_check``, ``drives``, ``fault``. Where no set is feasible, mass, price and energy are
        unknown; utilisation and binding check are those of the nearest set.

    Raises:
        InputError: The folder contains no results.
    """
    files = sorted((Path(out) / FOLDER).glob("*.parquet"))
    if not files:
        raise InputError(Fault("out", "holds no results of a sweep", str(out)))
    table = pa.concat_tables([pq.read_table(file).replace_schema_metadata(None) for file in files])
    frame: pd.DataFrame = table.to_pandas()
    return frame


def _digest_of(place: Path) -> str:
    """The digest and shard index stored in a file; empty if the file cannot be read."""
    try:
        metadata = pq.read_schema(place).metadata or {}
    except (OSError, pa.ArrowInvalid):
        return ""
    return metadata.get(_DIGEST, b"").decode()
