"""Selection for a whole arm: time to a proven optimum, sets judged a second, and the command from file to report.

One process, one thread, in processor time: what the clock shows where nothing else runs. The cases are interleaved and
medians compared, because machines are noisy: read the ratios.
The catalogues are scaled from the shipped rows (``selection_tasks.py``), every pair at every joint; the task is the
example's pick and place on six joints, for other numbers of joints a chain of links. ``basis`` is the reduction of the
motion to loads per unit of each load parameter, ``reduce`` everything up to the search: the basis and the rows of the
catalogue as arrays; ``search`` ends with the proven optimum of mass.

    python benchmarks/selection.py [--repeats 5] [--seeds 3] [--random 30] [--catalog DIR] [--picture FILE]
                                    [--quick] [--check]

``--catalog`` names a folder of ``drivetrain catalog import``; all its published pairs are then searched as well.
"""

from __future__ import annotations

import argparse
import gc
import math
import os
import platform
import resource
import subprocess
import sys
import time
import warnings
from dataclasses import dataclass, field, replace
from importlib.metadata import version
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np
from matplotlib.figure import Figure
from selection_random import random_met
from selection_rivals import Compiled, Plainly, median_time, random_sets
from selection_tasks import (
    EXAMPLE,
    chain_study,
    published_pairs,
    resampled,
    scaled_catalog,
    with_pairs,
    write_study,
)

import drivetrain as dt
from drivetrain.errors import PhysicsWarning
from drivetrain.report.charts.chart import BLUE, ORANGE
from drivetrain.report.charts.plotting import house_style, png_bytes
from drivetrain.sizing.demand.demand import workload
from drivetrain.sizing.search.candidates import build_candidates
from drivetrain.sizing.search.problem import build_problem
from drivetrain.sizing.search.tree import Tree
from drivetrain.study.model import Study

CANDIDATES, SAMPLES, JOINTS = (100, 1000, 10_000), (500, 2000, 8000), (2, 3, 4, 5, 6, 7, 8)
MIDDLE, USUAL = 1000, 2000  # candidates and samples where another size is varied
JUDGED, AT_ONCE, PLAIN = 10_000_000, 1_000_000, 40  # sets judged by compiled code, in parts, and the plain way
SEARCH_AT_MOST, COMMAND_AT_MOST, PUBLISHED_AT_MOST, FASTER, COLD_AT_MOST = 0.1, 5.0, 1.0, 10_000.0, 15.0
BASIS_AT_MOST = 0.01  # s


@dataclass
class Case:
    """One task with one catalogue, and what it took.

    Attributes:
        group, size: What is varied, and to what.
        study: The task.
        basis, reduce, search: Seconds, one a run.
        nodes: Of the search.
        answer: How it ended.
    """

    group: str
    size: float
    study: Study
    basis: list[float] = field(default_factory=list)
    reduce: list[float] = field(default_factory=list)
    search: list[float] = field(default_factory=list)
    nodes: int = 0
    answer: str = ""


def main(arguments: list[str] | None = None) -> int:
    """Measure, print the tables, draw the figure, and with --check say by the exit code whether the targets are met."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--repeats", type=int, default=5, help="interleaved runs of each, default 5")
    parser.add_argument("--seeds", type=int, default=3, help="catalogues of each size, default 3")
    parser.add_argument("--random", type=int, default=30, help="random tasks of each kind, default 30")
    parser.add_argument("--catalog", type=Path, help="an imported catalogue, all of whose pairs are searched as well")
    parser.add_argument("--picture", type=Path, default=Path("out/selection.png"), help="default out/selection.png")
    parser.add_argument("--quick", action="store_true", help="small sizes only, without the command")
    parser.add_argument("--check", action="store_true", help="exit 1 when a target is missed")
    options = parser.parse_args(arguments)
    warnings.simplefilter("ignore", PhysicsWarning)
    print(header())
    found = cases(dt.load_study(EXAMPLE), options.seeds, options.catalog, options.quick)
    measure(found, options.repeats)
    print(table(found))
    options.picture.parent.mkdir(parents=True, exist_ok=True)
    draw(found, options.picture)
    met = searches_met(found)
    met += random_met(dt.load_study(EXAMPLE), CANDIDATES[1] if options.quick else CANDIDATES[-1], options.random)
    met += rivals(next(case.study for case in found if case.size == (MIDDLE if options.quick else CANDIDATES[-1])))
    if not options.quick:
        met += command()
    print("\n".join(f"{'met   ' if good else 'MISSED'}  {text}" for text, good in met))
    print(f"figure: {options.picture}")
    return int(options.check and not all(good for _, good in met))


def header() -> str:
    """What was measured, where, with which versions."""
    versions = ", ".join(f"{name} {version(name)}" for name in ("numpy", "numba", "pin"))
    machine = f"{platform.machine()}, Python {platform.python_version()}, drivetrain {dt.__version__}, {versions}"
    return f"Selection of drives for a whole arm, one thread\n{machine}\n"


# ---------------------------------------------------------------- time to a proven optimum


def cases(task: Study, seeds: int, folder: Path | None, quick: bool) -> list[Case]:
    """Everything that is searched."""
    usual = resampled(task, USUAL)
    found = [
        Case("candidates", size, with_pairs(usual, *scaled_catalog(size, seed)))
        for size in (CANDIDATES[:2] if quick else CANDIDATES)
        for seed in range(1, seeds + 1)
    ]
    found += [
        Case("samples", size, with_pairs(resampled(task, size), *scaled_catalog(MIDDLE, seed)))
        for size in (SAMPLES[:2] if quick else SAMPLES)
        for seed in range(1, seeds + 1)
    ]
    found += [
        Case("joints", size, with_pairs(chain_study(task, size, USUAL), *scaled_catalog(MIDDLE, seed)))
        for size in (JOINTS[:3] if quick else JOINTS)
        for seed in range(1, seeds + 1)
    ]
    if folder is not None:
        catalog, pairs = published_pairs(folder)
        found.append(Case("published", len(pairs), with_pairs(usual, catalog, pairs), [], []))
    return found


def measure(found: list[Case], repeats: int) -> None:
    """Reduce and search each case several times, in turns of changing order, the first turn not counted."""
    order = np.random.default_rng(0)
    gc.disable()
    for turn in range(repeats + 1):
        for case in (found[i] for i in order.permutation(len(found))):
            seconds = searched_once(case)
            if turn:
                for name, one in seconds.items():
                    getattr(case, name).append(one)
        gc.collect()
    gc.enable()


def searched_once(case: Case) -> dict[str, float]:
    """One run: its times [s]."""
    start = time.process_time()
    work = workload(case.study)  # not the one of the run before, which was of another case
    reduced = time.process_time()
    offered = build_candidates(case.study, work)
    middle = time.process_time()
    tree = Tree(build_problem(offered, replace(case.study.wanted, sets=1)))
    tree.run(time.perf_counter() + 120.0, lambda done, total, text: None)
    end = time.process_time()
    case.nodes = tree.counters["nodes made"]
    best = f"{tree.best[0].objective:.3f} kg" if tree.best else "nothing fits"
    case.answer = f"{best}, {'proven' if tree.finished else f'bound {tree.bound:.3f}'}"
    return {"basis": reduced - start, "reduce": middle - start, "search": end - middle}


def groups(found: list[Case]) -> dict[tuple[str, float], list[Case]]:
    """Cases of the same size together, in order."""
    together: dict[tuple[str, float], list[Case]] = {}
    for case in found:
        together.setdefault((case.group, case.size), []).append(case)
    return together


def table(found: list[Case]) -> str:
    """One line a size: medians over catalogues and runs, and the worst run."""
    lines = [
        f"{'varied':12} {'size':>7}  {'basis ms':>8}  {'reduce ms':>9}  {'search ms':>9}  {'worst':>7}  nodes made"
        "  first catalogue"
    ]
    for (group, size), some in groups(found).items():
        basis, reduced, searched = (
            1e3 * np.array([value for case in some for value in getattr(case, name)])
            for name in ("basis", "reduce", "search")
        )
        nodes = np.median([case.nodes for case in some])
        numbers = f"{np.median(basis):8.1f}  {np.median(reduced):9.1f}  {np.median(searched):9.2f}"
        lines.append(f"{group:12} {size:7.0f}  {numbers}  {searched.max():7.2f}  {nodes:10.0f}  {some[0].answer}")
    return "\n".join(lines) + "\n"


def medians(found: list[Case], group: str, name: str) -> tuple[np.ndarray, np.ndarray]:
    """Sizes of a group, and the median time of each."""
    some = {size: cases for (kind, size), cases in groups(found).items() if kind == group}
    times = [np.median([value for case in cases for value in getattr(case, name)]) for cases in some.values()]
    return np.array(list(some)), np.array(times)


def draw(found: list[Case], picture: Path) -> None:
    """How the cost grows with candidates, samples and joints, with fitted exponents."""
    with house_style("selection"):
        figure = Figure(figsize=(9.2, 3.4))
        for axes, group in zip(figure.subplots(1, 3, sharey=True), ("candidates", "samples", "joints"), strict=True):
            for name, colour in (("reduce", ORANGE), ("search", BLUE)):
                size, seconds = medians(found, group, name)
                slope, offset = np.polyfit(np.log(size), np.log(seconds), 1)
                label = f"{name} ~ size$^{{{slope:.2f}}}$"
                axes.plot(size, 1e3 * seconds, "o", color=colour, markersize=5, label=label)
                axes.plot(size, 1e3 * np.exp(offset) * size**slope, color=colour, linewidth=0.9)
            if group == "candidates":
                for case in (case for case in found if case.group == "published"):
                    axes.plot(case.size, 1e3 * np.median(case.search), "s", color=BLUE, markersize=6, label="published")
            axes.set_xscale("log")
            axes.set_yscale("log")
            axes.set_xlabel({"candidates": "pairs at each joint", "samples": "samples of the motion"}.get(group, group))
            axes.set_xticks(size, [f"{value:g}" for value in size])
            axes.minorticks_off()
            axes.legend(loc="upper left")
        figure.axes[0].set_ylabel("median time [ms]")
        picture.write_bytes(png_bytes(figure))


def searches_met(found: list[Case]) -> list[tuple[str, bool]]:
    """The targets of the search."""
    met = []
    sizes, seconds = medians(found, "candidates", "search")
    size, median = sizes[-1], seconds[-1]
    proven = all("proven" in case.answer for case in found)
    met.append((f"every search ended with a proof: {proven}", proven))
    text = f"proven optimum at 6 x {size:.0f} in {1e3 * median:.1f} ms (at most {1e3 * SEARCH_AT_MOST:.0f})"
    met.append((text, bool(median <= SEARCH_AT_MOST)))
    median = dict(zip(*medians(found, "samples", "basis"), strict=True))[USUAL]
    text = f"basis of {USUAL} samples in {1e3 * median:.1f} ms (at most {1e3 * BASIS_AT_MOST:.0f})"
    met.append((text, bool(median <= BASIS_AT_MOST)))
    for case in (case for case in found if case.group == "published"):
        median = float(np.median(case.search))
        text = f"all {case.size:.0f} published pairs searched in {median:.2f} s (at most {PUBLISHED_AT_MOST:g})"
        met.append((text, median <= PUBLISHED_AT_MOST))
    return met


# ---------------------------------------------------------------- sets judged a second


def rivals(study: Study) -> list[tuple[str, bool]]:
    """Judging set by set, against the plain way and against what the machine can do."""
    start = time.process_time()
    offered = build_candidates(study)
    reduced = time.process_time() - start
    Compiled(offered)  # compiles
    ours, plain = Compiled(offered), Plainly(offered)
    everything = [np.arange(low, high) for low, high in zip(offered.first_pair, offered.first_pair[1:], strict=False)]
    hard = random_sets(ours.pools, 2000, 1)
    fast, some = 0.0, np.zeros((0, len(everything)), dtype=np.int64)
    for part in range(JUDGED // AT_ONCE):
        sets = random_sets(everything, AT_ONCE, 2 + part)
        start = time.process_time()
        ours.holds(sets)
        fast += (time.process_time() - start) / JUDGED
        some = sets[:PLAIN] if part == 0 else some
    stand = hard[ours.holds(hard)]
    some = np.concatenate([some, stand[:5]])
    wanted = ours.holds(some)
    found, each = [], []
    for one in some:
        start = time.process_time()
        found.append(plain.holds(one))
        each.append(time.process_time() - start)
    slow, slow_end = float(np.mean(each[:PLAIN])), float(np.mean(each[PLAIN:])) if len(stand) else math.nan
    whole = fast + (ours.preparation + reduced) / JUDGED
    from_scratch = median_time(lambda: ours.holds(sets[:500], possible=False), 3) / 500
    tough = median_time(lambda: ours.holds(hard), 3) / len(hard)
    end = median_time(lambda: ours.holds(np.repeat(stand, 10, axis=0)), 3) / max(10 * len(stand), 1)
    print(f"Sets of drives judged, {len(everything)} x {len(everything[0])} pairs, N = {len(study.cycle.time)}")
    print(f"{'':66} us a set   times the plain way")
    for name, seconds, rival in (
        ("pinocchio rnea at every sample, then the same checks: random sets", slow, slow),
        (f"reduction {reduced:.2f} s, presolve filter {ours.preparation:.2f} s, {JUDGED:.0e} random sets", whole, slow),
        ("the judge of them alone, after the filter", fast, slow),
        ("random sets, each from scratch, no filter", from_scratch, slow),
        ("sets of pairs that the filter leaves", tough, slow),
        ("pinocchio, sets that hold: every check to the end", slow_end, slow_end),
        ("sets that hold: every check to the end", end, slow_end),
    ):
        print(f"{name:66} {1e6 * seconds:8.3f}   {rival / seconds:10.0f}")
    agreed = found == wanted.tolist()
    return [
        (f"{slow / whole:.0f} times the plain way, everything counted (at least {FASTER:.0f})", slow / whole >= FASTER),
        (f"both ways agree on {len(some)} sets, {int(wanted.sum())} of which hold", agreed),
    ]


# ---------------------------------------------------------------- the command, from file to report


def command() -> list[tuple[str, bool]]:
    """``drivetrain select`` on 10 000 pairs a joint: with an empty compile cache, and warm."""
    with TemporaryDirectory() as scratch:
        folder = Path(scratch)
        study = write_study(folder, scaled_catalog(CANDIDATES[-1], 1)[0])
        environment = {**os.environ, "NUMBA_CACHE_DIR": str(folder / "cache")}
        times, told = [], ""
        for _ in range(4):
            start = _of_children()
            done = subprocess.run(
                [sys.executable, "-m", "drivetrain", "select", str(study), "--out", str(folder / "out")],
                env=environment, cwd=folder, capture_output=True, text=True, check=False,
            )  # fmt: skip
            times.append(_of_children() - start)
            told = told or done.stderr.strip()
            if done.returncode:
                print(done.stdout, done.stderr)
                return [("drivetrain select finds a set", False)]
        fallen = sum(1 for _ in (folder / "out" / "rejected.csv").open(encoding="utf-8")) - 1
    warm, extra = float(np.median(times[1:])), times[0] - float(np.median(times[1:]))
    print(f"drivetrain select, file to report, 6 x {CANDIDATES[-1]} pairs, {fallen} candidates rejected:")
    print(f"  warm {warm:.2f} s; with an empty compile cache {times[0]:.1f} s, told as: {told.splitlines()[:1]}\n")
    return [
        (f"file to report in {warm:.2f} s (at most {COMMAND_AT_MOST:g})", warm <= COMMAND_AT_MOST),
        (f"an empty cache costs {extra:.1f} s more (at most {COLD_AT_MOST:g})", extra <= COLD_AT_MOST),
    ]


def _of_children() -> float:
    """Processor time of all commands that were run and have ended [s]."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


if __name__ == "__main__":
    sys.exit(main())
