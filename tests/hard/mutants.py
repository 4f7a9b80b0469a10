"""Mutants of laws, checks, kernels and effects: one thing changed at a time, and whether the tests notice.

    make mutants COUNT=300, which is
    python tests/hard/mutants.py plain|compiled FILE COUNT SEED [ROOM ...] [TESTS ...]  a line of FILE for each mutant
    python tests/hard/mutants.py rate FILE ...                                          the table of docs/trust.md

    python tests/hard/mutants.py compiled build/a.jsonl 40 1 sweep accuracy/auto.py tests/sweep tests/accuracy

draws 40 places of two rooms and asks the tests of two folders. First every test runs once, which tells the functions
that it calls and loads compiled code; then each mutant meets the tests that call its function, one row of each first,
in a process of its own that ends at the first failure.

Code that is compiled is tried as plain Python (``plain_python.py``): a mutant is a function with another code.
Functions of Python, and rows of the table of checks, which are numbers that compiled code is given, are tried with
compiled code.
"""

from __future__ import annotations
import __future__

import ast
import copy
import gc
import importlib
import json
import os
import random
import signal
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from cProfile import Profile
from functools import cache, partial
from itertools import groupby
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PACKAGE = ROOT / "drivetrain"
OURS = (str(PACKAGE), str(ROOT / "tests"))
PLAIN = ("drive", "dynamics/core", "sizing/judge", "sizing/demand", "solvers", "control", "effects",
         "simulation", "sizing/search/bounds.py", "identification")  # fmt: skip
PLAIN_TESTS = ("drive", "control", "dynamics", "agreement", "solvers", "sizing", "identification", "hard", "effects",
               "simulation")  # fmt: skip
PYTHON = ("accuracy", "arm", "catalog", "control", "drive", "dynamics", "export", "motion", "report", "sizing",
          "spatial", "study", "sweep", "units.py")  # fmt: skip
COMPILED_TESTS = (
    "hard", "accuracy", "agreement", "arm", "catalog", "control", "drive", "dynamics", "export", "identification",
    "motion", "published", "report", "sizing", "spatial", "study", "sweep", "test_units.py",
)  # fmt: skip
LAWS = ("law", "kernel", "part", "exact", "fast", "command", "joint_law", "table_law", "scene_law")
WHOLE = ("effects/control/", "effects/friction/", "effects/gear/", "effects/loads/", "effects/motor/",
         "identification/", "simulation/")  # all of whose functions count  # fmt: skip
CALLED_FROM_C = ("_tick",)
SHOWN = ("__post_init__", "ports", "lines", "describe", "faults")  # declarations and messages
TABLE = "sizing/judge/checks.py"
OF_THE_TABLE = ("test_the_law_in_a_table", "test_every_check_has_the_factor_of_its_kind")  # tests that only read it
RUNNING = "sizing/judge/evaluate.py"  # what is called wherever the table is read
OTHER = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Lt: ast.GtE, ast.LtE: ast.Gt,
    ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.And: ast.Or, ast.Or: ast.And,
}  # fmt: skip
NAMES = {"max": "min", "min": "max", "larger": "smaller", "smaller": "larger", "abs": "float"}
OPTIONS = ("-q", "-s", "-p", "no:cacheprovider", "-p", "no:randomly", "-n0", "-W", "ignore::RuntimeWarning")
PER_TEST, PER_FILE, PER_MUTANT = 2.0, 9.0, 12.0  # s of a processor; the first two of plain Python
# Most figures by formulas of their own: asked first where they call a law.
WIDE = (
    "sizing/judge/test_figures_written_out.py", "sizing/judge/test_random_axes.py", "sizing/judge/test_special_axes.py",
    "sizing/judge/test_what_sheets_hide.py", "agreement/test_verdicts.py",
)  # fmt: skip


# --- mutants


def mutants_of(function: ast.FunctionDef) -> list[tuple[int, str]]:
    """The places of a function where one thing can be changed, and what stands there."""
    places = enumerate(_places(function))
    return [(k, f"{node.lineno}: {ast.unparse(node)} #{k}") for k, node in places if _change(copy.copy(node))]


def mutant(function: ast.FunctionDef, index: int) -> ast.FunctionDef:
    """A copy of a function, changed at one place."""
    whole = copy.deepcopy(function)
    _change(_places(whole)[index])
    return whole


def _change(node: Any) -> bool:
    """Change a node as a slip would; whether there is anything to change."""
    if isinstance(node, ast.BinOp | ast.BoolOp | ast.AugAssign) and type(node.op) in OTHER:
        node.op = OTHER[type(node.op)]()
    elif isinstance(node, ast.Compare) and type(node.ops[0]) in OTHER:
        node.ops = [OTHER[type(node.ops[0])](), *node.ops[1:]]
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.USub):
        node.op = ast.UAdd()
    elif isinstance(node, ast.Constant) and type(node.value) is float:
        node.value = 1.1 * node.value + 0.1
    elif isinstance(node, ast.Constant) and type(node.value) is int:
        node.value += 1
    elif isinstance(node, ast.Name) and node.id in NAMES:
        node.id = NAMES[node.id]
    elif isinstance(node, ast.Expr) and isinstance(node.value, ast.Call):
        node.value = ast.Constant(None)
    else:
        return False
    return True


def _places(function: ast.FunctionDef) -> list[ast.AST]:
    """What may be changed: no annotation, no message."""
    found, waiting = [], [*function.body, *function.args.defaults]
    while waiting:
        node = waiting.pop(0)
        if isinstance(node, ast.FunctionDef):  # one within another
            waiting[:0] = [*node.body, *node.args.defaults]
            continue
        if isinstance(node, ast.Raise | ast.JoinedStr | ast.expr_context):
            continue
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "Fault":
            continue
        found.append(node)
        waiting[:0] = ast.iter_child_nodes(node) if not isinstance(node, ast.AnnAssign) else [node.value or node.target]
    return found


def functions(path: Path, plain: bool) -> Iterator[tuple[str, ast.FunctionDef]]:
    """The laws, kernels and effects of a file by their qualified names, or its functions of Python."""
    inside = str(path.relative_to(PACKAGE))
    whole = inside.startswith(WHOLE)
    tree = _tree(path)
    for holder in [tree, *(node for node in tree.body if isinstance(node, ast.ClassDef))]:
        prefix = f"{holder.name}." if isinstance(holder, ast.ClassDef) else ""
        for node in holder.body:
            if isinstance(node, ast.FunctionDef) and node.name not in SHOWN:
                marks = {ast.unparse(one).split("(")[0] for one in node.decorator_list}
                known = whole or node.name in CALLED_FROM_C or bool(marks & set(LAWS))
                if known == plain and "super()" not in ast.unparse(node):  # which asks for its class
                    yield prefix + node.name, node


def _tree(path: Path) -> ast.Module:
    if os.environ.get("NUMBA_DISABLE_JIT"):
        from plain_python import tree_of

        return tree_of(path)
    return ast.parse(path.read_text(encoding="utf-8"))


def of_table() -> Iterator[tuple[str, Any]]:
    """The rows of the table of checks with one entry changed."""
    from drivetrain.sizing.judge.checks import GEAR, HEAT, REQUIREMENTS, SUPPLY

    plain = {"factor": "one", "asked": "one", "origin": "zero"}
    for k, row in enumerate(REQUIREMENTS):
        for name in ("stage", "factor", "origin", "peak", "essential", "scale", "asked", "wish", "instant", "required"):
            was = getattr(row, name)
            if was == plain.get(name, "") or (name == "required" and k == 0):
                continue
            if (name == "peak" and was) or (row.stage >= SUPPLY and name not in ("required", "instant")):
                continue  # a look at some samples that only saves time; what rows of these stages have no use for
            new = {"stage": HEAT if was == GEAR else GEAR, "scale": 2.0 * row.scale, "instant": "",
                   "required": REQUIREMENTS[k - 1].required, **plain}.get(name, was is False)  # fmt: skip
            yield f"{row.name}: {name}", (row, name, new)


# --- processes


def prepare(plain: bool) -> None:
    """Make the package ready, and know every module of it."""
    sys.path[:0] = [str(HERE), str(ROOT)]
    if plain:
        import plain_python

        plain_python.prepare()
    for path in sorted(PACKAGE.rglob("*.py")):
        name = ".".join(path.relative_to(ROOT).with_suffix("").parts)
        if not name.endswith(("__main__", "__init__")):
            importlib.import_module(name)


class _Trials:
    """Every test runs once, which loads kernels; then each mutant is a process that ends at the first failure."""

    def __init__(self, drawn: list[tuple[str, str, Callable[[], None]]], results: Path):
        self.drawn, self.results = drawn, results
        self.plain = bool(os.environ.get("NUMBA_DISABLE_JIT"))
        self.sound: dict[str, bool] = {}
        self.out = os.fdopen(os.dup(2), "w", encoding="utf-8")

    def pytest_configure(self) -> None:
        """Few examples of each property, the same each time."""
        import hypothesis

        hypothesis.settings.register_profile("mutants", deadline=None, derandomize=True, max_examples=20)
        hypothesis.settings.load_profile("mutants")

    def pytest_runtestloop(self, session: Any) -> bool:
        items, told = {one.nodeid: one for one in session.items}, {}
        _silence()
        for file, names in groupby(items, lambda name: name.split("::")[0]):
            spent = passed = 0.0
            for name in names:
                if not self.plain or spent < PER_FILE:
                    told[name] = self.watched(items[name])
                    spent, passed = spent + told[name]["seconds"], passed + told[name]["passed"]
            print(f"{file}: {passed:g} tests, {spent:.1f} s", file=self.out, flush=True)
        self.caches = _caches()
        gc.freeze()
        for where, what, change in self.drawn:
            tests = tests_of(told, where, RUNNING if where.startswith(TABLE) else where.split(":")[0])
            asked = [(items[name], seconds) for name, seconds in tests]
            failed = None
            while asked:
                failed = self.first_to_fail(asked, change)
                if failed is None or self.is_sound(failed, asked):
                    break
                asked, failed = [pair for pair in asked if pair[0].nodeid != failed], None
            with self.results.open("a", encoding="utf-8") as out:
                row = {"mutant": what, "noticed": failed is not None, "tests": len(asked), "by": failed or ""}
                out.write(json.dumps(row) + "\n")
            if failed is None:
                print(f"not noticed by {len(asked)} tests: {what}", file=self.out, flush=True)
        return True

    def watched(self, item: Any) -> dict[str, Any]:
        """Of a test its seconds of a processor, whether it passes, and the functions of the package that it calls."""
        from _pytest.runner import runtestprotocol

        if self.plain:
            _stop_after(PER_TEST)
        begin, profile = os.times(), Profile()
        profile.enable()
        try:
            reports = runtestprotocol(item, nextitem=None, log=False)
            passed = all(one.passed for one in reports)
        except TimeoutError:  # between two phases of a test
            passed = False
        finally:
            profile.disable()
            _stop_after(0.0)
        found = [one.code for one in profile.getstats() if isinstance(one.code, CodeType)]
        prefix = f"{PACKAGE}/"
        calls = {f"{one.co_filename.removeprefix(prefix)}:{one.co_qualname}" for one in found
                 if one.co_filename.startswith(prefix)}  # fmt: skip
        user, system, *children = (after - before for before, after in zip(begin[:4], os.times()[:4], strict=True))
        alone = sum(children) < 0.1  # a mutant is not in processes that a test starts
        return {"seconds": user + system, "passed": passed and alone, "calls": calls}

    def is_sound(self, name: str, asked: list[tuple[Any, float]]) -> bool:
        """Whether a test passes here and now without a mutant."""
        if name not in self.sound:
            alone = [pair for pair in asked if pair[0].nodeid == name]
            self.sound[name] = self.first_to_fail(alone, lambda: None) is None
        return self.sound[name]

    def first_to_fail(self, asked: list[tuple[Any, float]], change: Callable[[], None]) -> str | None:
        """The name of the first test that fails, or does not end, once ``change`` was called."""
        read, write = os.pipe()
        if (child := os.fork()) == 0:
            os.close(read)
            try:
                self.run(asked, change, write)
            finally:
                os._exit(0)
        os.close(write)
        with os.fdopen(read, encoding="utf-8") as told:
            begun = told.read().splitlines()
        os.waitpid(child, 0)
        if not begun:
            raise RuntimeError("the mutant could not be made")
        return None if begun[-1] == "passed" else begun[-1]

    def run(self, asked: list[tuple[Any, float]], change: Callable[[], None], told: int) -> None:
        from _pytest.runner import runtestprotocol

        change()
        for one in self.caches:
            one.cache_clear()
        os.write(told, b"passed\n")
        for item, seconds in asked:
            os.write(told, f"{item.nodeid}\n".encode())
            _stop_after(3.0 * seconds + (4.0 if self.plain else 8.0))  # compiled code may be compiled for other types
            reports = runtestprotocol(item, nextitem=None, log=False)
            _stop_after(0.0)
            if not all(one.passed for one in reports):
                return
            os.write(told, b"passed\n")


def _silence() -> None:
    null = os.open(os.devnull, os.O_WRONLY)
    os.dup2(null, 1)
    os.dup2(null, 2)


def _stop_after(seconds: float) -> None:
    """``TimeoutError`` after some seconds of a processor; 0: never."""

    def stop(*given: Any) -> None:
        raise TimeoutError

    signal.signal(signal.SIGPROF, stop)
    signal.setitimer(signal.ITIMER_PROF, seconds)


def _caches() -> list[Any]:
    """The caches of package and tests: what they hold was computed without the mutant."""
    kind = type(cache(len))
    found = ((one, getattr(one.__wrapped__, "__code__", None)) for one in gc.get_objects() if type(one) is kind)
    return [one for one, code in found if code and code.co_filename.startswith(OURS)]


def swap(path: Path, name: str, function: ast.FunctionDef, index: int) -> None:
    """Put a mutant in place of its function."""
    module = sys.modules[".".join(path.relative_to(ROOT).with_suffix("").parts)]
    bare = mutant(function, index)
    bare.decorator_list = []
    whole = ast.fix_missing_locations(ast.Module([bare], []))
    made = compile(whole, str(path), "exec", flags=__future__.annotations.compiler_flag, dont_inherit=True)
    code = next(one for one in made.co_consts if isinstance(one, CodeType))
    holder: Any = module
    for part in name.split("."):
        holder = vars(holder)[part]
    found = _function_in(holder)
    found.__code__ = code
    if bare.args.defaults:
        defaults = ast.Expression(ast.Tuple(bare.args.defaults, ast.Load()))
        found.__defaults__ = eval(compile(ast.fix_missing_locations(defaults), str(path), "eval"), vars(module))


def _function_in(holder: Any) -> FunctionType:
    """The function that decorators have wrapped, one after another."""
    names = ("py_func", "fget", "func", "__wrapped__", "_function", "__func__")
    while (inner := next((getattr(holder, name) for name in names if hasattr(holder, name)), None)) is not None:
        holder = inner
    assert isinstance(holder, FunctionType)
    return holder


def files(rooms: tuple[str, ...]) -> list[Path]:
    """The sources of some rooms."""
    found = [PACKAGE / room for room in rooms]
    return sorted({one for path in found for one in ([path] if path.suffix else path.rglob("*.py"))})


def tests_of(told: dict[str, Any], where: str, inside: str) -> list[tuple[str, float]]:
    """Tests that call a function, else those that call anything of its file: ``WIDE``, then the quickest of each."""

    def calling(wanted: Any) -> list[tuple[str, float]]:
        found = (
            (one["seconds"], name) for name, one in told.items() if one["passed"] and any(map(wanted, one["calls"]))
        )
        rows: Counter[str] = Counter()
        ordered = []
        for seconds, name in sorted(found):
            rows[name.split("[")[0]] += 1
            ordered.append((0 if any(one in name for one in WIDE) else rows[name.split("[")[0]], seconds, name))
        return [(name, seconds) for _, seconds, name in sorted(ordered)]

    found = calling(lambda call: call == where)
    if not found and inside == RUNNING:  # what is compiled is not seen when it is called
        found = calling(lambda call: call.startswith(f"{inside}:"))
    if inside == RUNNING:
        found = [(name, 0.0) for name in told if name.endswith(OF_THE_TABLE)] + found
    chosen, spent = [], 0.0
    for name, seconds in found:
        if spent + seconds > PER_MUTANT and chosen:
            continue
        chosen.append((name, seconds))
        spent += seconds
    return chosen


def tried(results: Path, plain: bool, count: int, seed: int, only: tuple[str, ...], tests: list[str]) -> None:
    """Try ``count`` mutants of some rooms, each place as likely as any other; one line of JSON each."""
    import pytest

    prepare(plain)
    done = {json.loads(line)["mutant"] for line in results.read_text().splitlines()} if results.exists() else set()
    every: list[tuple[str, str, Callable[[], None]]] = []
    for path in files(PLAIN if plain else PYTHON):
        inside = str(path.relative_to(PACKAGE))
        if only and not inside.startswith(only):
            continue
        for name, node in functions(path, plain):
            where = f"{inside}:{name}"
            every += [(where, f"{where} {what}", partial(swap, path, name, node, k)) for k, what in mutants_of(node)]
    if not plain and (not only or TABLE.startswith(only)):  # numbers that compiled code is given, not code
        where = f"{TABLE}:REQUIREMENTS"
        every += [(where, f"{where} {what}", partial(object.__setattr__, *row)) for what, row in of_table()]
    drawn = random.Random(seed).sample(every, min(count, len(every)))
    pytest.main([*OPTIONS, *tests], plugins=[_Trials([one for one in drawn if one[1] not in done], results)])


def rate(places: list[Path]) -> None:
    """How many were noticed, room by room, and which were not."""
    from scipy.stats import binomtest

    lines = [json.loads(line) for place in places for line in place.read_text().splitlines()]
    found = {one["mutant"]: one["noticed"] for one in lines}  # the last word on each
    print("| mutants of | tried | noticed |\n|---|---|---|")
    for room in (*PLAIN, *(one for one in PYTHON if one not in PLAIN)):
        mine = [noticed for mutant, noticed in found.items() if mutant.startswith(room)]
        print(f"| `{room}` | {len(mine)} | {sum(mine)} |")
    low, high = binomtest(sum(found.values()), len(found)).proportion_ci(0.95)
    print(f"| all | {len(found)} | {sum(found.values())}: with 95 % confidence {low:.1%} to {high:.1%} |")
    print("\n".join(f"not noticed: {mutant}" for mutant, noticed in found.items() if not noticed))


if __name__ == "__main__":
    what, place, *rest = sys.argv[1:]
    if what == "rate":
        rate([Path(one) for one in (place, *rest)])
    else:
        tests = [str(ROOT / one) for one in rest[2:] if one.startswith("tests/")]
        rooms = tuple(one for one in rest[2:] if not one.startswith("tests/"))
        everywhere = [str(ROOT / "tests" / one) for one in (PLAIN_TESTS if what == "plain" else COMPILED_TESTS)]
        tried(Path(place), what == "plain", int(rest[0]), int(rest[1]), rooms, tests or everywhere)
