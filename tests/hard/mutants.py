"""Mutants of laws, checks, kernels and effects: one thing changed at a time, and whether the tests notice.

    make mutants EACH=6, which is
    python tests/hard/mutants.py map FILE [TESTS ...]           which test calls which function, and for how long
    python tests/hard/mutants.py try FILE EACH SEED [FILE ...]  EACH of every file, drawn; results go to FILE's .jsonl
    python tests/hard/mutants.py rate FILE ...                  the table of docs/trust.md

Most is tried as plain Python (``plain_python.py``): a mutant is a function with another code, in a process of its own.
Effects and the engines of simulation would take too long so, and are compiled, with nothing taken from the disk cache
that the mutant is part of. A mutant meets the tests that call its function, the quickest first, for half a minute.
"""

from __future__ import annotations

import ast
import copy
import importlib
import json
import os
import random
import signal
import sys
import time
from collections.abc import Iterator
from functools import partial
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
PACKAGE = ROOT / "drivetrain"
PLAIN = ("drive", "dynamics/core", "sizing/judge", "sizing/search/bounds.py", "solvers", "control/laws.py")
COMPILED = ("effects", "simulation/core", "simulation/engines")
PLAIN_TESTS = ("drive", "control", "dynamics", "agreement", "solvers", "sizing", "identification", "hard")
COMPILED_TESTS = ("effects", "simulation", "hard", "accuracy")
LAWS = ("law", "kernel", "part", "exact", "fast", "command", "joint_law", "table_law", "scene_law")
WHOLE = ("effects/", "simulation/engines/starting.py")  # all functions of these count, decorated or not
SHOWN = ("__post_init__", "ports", "lines", "describe", "faults")  # declarations and messages
TABLE = "sizing/judge/checks.py"
RUNNING = "sizing/judge/evaluate.py"  # what is called wherever the table is read
OTHER = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Lt: ast.GtE, ast.LtE: ast.Gt,
    ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.And: ast.Or, ast.Or: ast.And,
}  # fmt: skip
NAMES = {"max": "min", "min": "max", "larger": "smaller", "smaller": "larger", "abs": "float"}
ASKED_NOTHING = 99
PER_TEST, PER_FILE, PER_MUTANT = 3.0, 15.0, 30.0  # s of a processor


# --- mutants


def mutants_of(function: ast.FunctionDef) -> list[tuple[int, str]]:
    """The places of a function where one thing can be changed, and what stands there."""
    places = enumerate(_places(function))
    return [(index, f"{node.lineno}: {ast.unparse(node)}") for index, node in places if _change(copy.copy(node))]


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
        if isinstance(node, ast.Raise | ast.JoinedStr | ast.expr_context | ast.FunctionDef):
            continue
        if isinstance(node, ast.Call) and ast.unparse(node.func) == "Fault":
            continue
        found.append(node)
        waiting[:0] = ast.iter_child_nodes(node) if not isinstance(node, ast.AnnAssign) else [node.value or node.target]
    return found


def functions(path: Path) -> Iterator[tuple[str, ast.FunctionDef]]:
    """The laws, kernels and effects of a file, by their qualified names."""
    inside = str(path.relative_to(PACKAGE))
    whole = inside.startswith(WHOLE)
    tree = _tree(path)
    for holder in [tree, *(node for node in tree.body if isinstance(node, ast.ClassDef))]:
        prefix = f"{holder.name}." if isinstance(holder, ast.ClassDef) else ""
        for node in holder.body:
            if isinstance(node, ast.FunctionDef) and node.name not in SHOWN:
                marks = {ast.unparse(one).split("(")[0] for one in node.decorator_list}
                if whole or marks & set(LAWS):
                    yield prefix + node.name, node


def _tree(path: Path) -> ast.Module:
    if os.environ.get("NUMBA_DISABLE_JIT"):
        from plain_python import tree_of

        return tree_of(path)
    return ast.parse(path.read_text(encoding="utf-8"))


def of_table() -> Iterator[tuple[str, Any]]:
    """The rows of the table of checks with one entry changed."""
    from drivetrain.sizing.judge.checks import GEAR, HEAT, REQUIREMENTS

    plain = {"factor": "one", "asked": "one", "origin": "zero"}
    for k, row in enumerate(REQUIREMENTS):
        for name in ("stage", "factor", "origin", "peak", "essential", "scale", "asked", "wish", "instant", "required"):
            was = getattr(row, name)
            if was == plain.get(name, "") or (name == "required" and k == 0):
                continue
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


class _Watch:
    """Of each test its seconds of a processor, its end, and on demand the functions of the package that it calls."""

    def __init__(self, limit: float, profile: bool):
        self.limit, self.profile, self.tests = limit, profile, {}  # type: ignore[var-annotated]
        self.begun, self.all = time.process_time(), PER_FILE if profile else 1e9
        if not os.environ.get("NUMBA_DISABLE_JIT"):  # the first test of all waits for the compiler
            self.limit, self.all = 60.0 + limit, 120.0 + self.all

    def pytest_configure(self) -> None:
        import hypothesis

        hypothesis.settings.register_profile("mutants", deadline=None, derandomize=True, max_examples=20)
        hypothesis.settings.load_profile("mutants")

    def pytest_runtest_protocol(self, item: Any, nextitem: Any) -> Any:
        import pytest

        if time.process_time() - self.begun > self.all:
            pytest.exit("enough")
        found: set[CodeType] = set()

        def seen(frame: Any, event: str, argument: Any) -> None:
            if event == "call":
                found.add(frame.f_code)

        def stop(*given: Any) -> None:
            raise TimeoutError

        signal.signal(signal.SIGPROF, stop)
        signal.setitimer(signal.ITIMER_PROF, self.limit)
        self.item, self.found, begin = item.nodeid, found, time.process_time()
        self.tests[item.nodeid] = {"seconds": 0.0, "passed": True, "calls": []}
        if self.profile:
            sys.setprofile(seen)
        try:
            from _pytest.runner import runtestprotocol

            reports = runtestprotocol(item, nextitem=nextitem, log=True)
        finally:
            sys.setprofile(None)
            signal.setitimer(signal.ITIMER_PROF, 0.0)
        prefix = f"{PACKAGE}/"
        self.tests[item.nodeid] = {
            "seconds": round(time.process_time() - begin, 3), "passed": all(one.passed for one in reports),
            "calls": sorted({f"{one.co_filename.removeprefix(prefix)}:{one.co_qualname}" for one in found
                             if one.co_filename.startswith(prefix)}),
        }  # fmt: skip
        return True


def pytest_run(given: list[str], watch: _Watch, log: str = os.devnull) -> int:
    """Pytest without noise, one test after the other."""
    import pytest

    silent = os.open(log, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(silent, 1)
    os.dup2(silent, 2)
    options = ["-x"] if not watch.profile else []
    options += ["-q", "-p", "no:cacheprovider", "-p", "no:randomly", "-n0", "-W", "ignore::RuntimeWarning"]
    return int(pytest.main([*options, *given], plugins=[watch]))


def map_tests(out: Path, folders: tuple[str, ...], plain: bool) -> None:
    """Of all tests in some folders what ``_Watch`` sees."""
    prepare(plain)
    told: dict[str, Any] = {}
    places = [ROOT / "tests" / one for one in folders]
    for path in [one for place in places for one in ([place] if place.suffix else sorted(place.glob("test_*.py")))]:
        kept = HERE / f".map-{os.getpid()}"
        if (child := os.fork()) == 0:
            watch = _Watch(PER_TEST, profile=True)
            pytest_run([str(path)], watch)
            kept.write_text(json.dumps(watch.tests), encoding="utf-8")
            os._exit(0)
        os.waitpid(child, 0)
        if kept.exists():
            told |= json.loads(kept.read_text(encoding="utf-8"))
            kept.unlink()
        out.write_text(json.dumps({"plain": plain, "tests": told}), encoding="utf-8")
        print(path.relative_to(ROOT), sum(one["passed"] for one in told.values()), len(told), flush=True)


def noticed(tests: list[tuple[str, float]], change: Any) -> bool | None:
    """Whether tests fail once ``change`` was called; None where they could not be asked."""
    if (child := os.fork()) == 0:
        code = ASKED_NOTHING
        try:
            change()
            longest = max(seconds for _, seconds in tests)
            code = pytest_run([name for name, _ in tests], _Watch(3.0 * longest + 20.0, profile=False))
        finally:
            os._exit(code)
    ended = os.waitpid(child, 0)[1]
    code = os.waitstatus_to_exitcode(ended)
    return True if code < 0 or code in (1, 2) else False if code == 0 else None  # a signal, a failure, no import


def swap(path: Path, name: str, function: ast.FunctionDef, index: int) -> None:
    """Put a mutant in place of its function, and take nothing compiled with that function from the disk."""
    module = sys.modules[".".join(path.relative_to(ROOT).with_suffix("").parts)]
    bare = mutant(function, index)
    bare.decorator_list, bare.returns = [], None
    for argument in [*bare.args.args, *bare.args.kwonlyargs]:
        argument.annotation = None
    made = compile(ast.fix_missing_locations(ast.Module([bare], [])), str(path), "exec", dont_inherit=True)
    code = next(one for one in made.co_consts if isinstance(one, CodeType))
    holder: Any = module
    for part in name.split("."):
        holder = vars(holder)[part]
    found = next(one for one in _functions_in(holder) if isinstance(one, FunctionType))
    found.__code__ = code
    if not os.environ.get("NUMBA_DISABLE_JIT"):
        _without_cache(path)


def _functions_in(holder: Any) -> Iterator[Any]:
    """What a decorator has wrapped."""
    yield holder
    for name in ("py_func", "fget", "func", "__wrapped__", "_function", "__func__"):
        if (inner := getattr(holder, name, None)) is not None:
            yield inner


def _without_cache(path: Path) -> None:
    from numba.core.caching import NullCache

    from drivetrain import jit

    kept = jit._folder
    jit._folder = lambda module: None if path in jit._closure(module) else kept(module)  # type: ignore[assignment]
    for name, module in list(sys.modules.items()):
        file = getattr(module, "__file__", None)
        if name.startswith("drivetrain") and file and path in jit._closure(Path(file)):
            for one in vars(module).values():
                if hasattr(one, "py_func") and hasattr(one, "_cache"):
                    one._cache = NullCache()


def files(rooms: tuple[str, ...]) -> list[Path]:
    """The sources of some rooms."""
    found = [PACKAGE / room for room in rooms]
    return sorted({one for path in found for one in ([path] if path.suffix else path.rglob("*.py"))})


def tests_of(told: dict[str, Any], where: str, inside: str) -> list[tuple[str, float]]:
    """Tests that call a function, else those that call anything of its file, the quickest first."""

    def calling(wanted: Any) -> list[tuple[str, float]]:
        return sorted(
            ((name, one["seconds"]) for name, one in told.items() if one["passed"] and any(map(wanted, one["calls"]))),
            key=lambda pair: pair[1],
        )

    found = calling(lambda call: call == where) or calling(lambda call: call.startswith(f"{inside}:"))
    if not found and inside.startswith("simulation/core/"):
        found = calling(lambda call: call.startswith("simulation/engines/fixed_step.py:FixedStep.run"))
    chosen, spent = [], 0.0
    for name, seconds in found:
        if spent > PER_MUTANT:
            break
        chosen.append((name, seconds))
        spent += seconds
    return chosen


def tried(place: Path, each: int, seed: int, only: tuple[str, ...]) -> None:
    """Try mutants of every file; one line of JSON each."""
    told = json.loads(place.read_text(encoding="utf-8"))
    plain, results = told["plain"], place.with_suffix(".jsonl")
    prepare(plain)
    done = {json.loads(line)["mutant"] for line in results.read_text().splitlines()} if results.exists() else set()
    jobs: list[tuple[str, str, str, Any]] = []
    for path in files(PLAIN if plain else COMPILED):
        inside = str(path.relative_to(PACKAGE))
        if only and not inside.startswith(only):
            continue
        every = [(f"{inside}:{name}", node, *one) for name, node in functions(path) for one in mutants_of(node)]
        some = random.Random(f"{seed} {inside}").sample(every, min(each, len(every)))
        for where, node, index, what in some:
            jobs.append((where, what, inside, partial(swap, path, where.split(":")[1], node, index)))
    if plain and (not only or TABLE.startswith(only)):
        rows = list(of_table())
        for what, change in random.Random(f"{seed} {TABLE}").sample(rows, min(5 * each, len(rows))):
            jobs.append((f"{TABLE}:REQUIREMENTS", what, RUNNING, lambda change=change: object.__setattr__(*change)))
    random.Random(seed).shuffle(jobs)
    sound: dict[str, bool] = {}
    for where, what, inside, change in jobs:
        tests = tests_of(told["tests"], where, inside)
        if f"{where} {what}" in done or not tests:
            if not tests:
                print(f"no test: {where} {what}", flush=True)
            continue
        if where not in sound:  # without a mutant they pass, here and now
            sound[where] = noticed(tests, str) is False
        found = noticed(tests, change) if sound[where] else None
        if found is not None:
            with results.open("a", encoding="utf-8") as out:
                out.write(json.dumps({"mutant": f"{where} {what}", "noticed": found, "tests": len(tests)}) + "\n")
        if not found:
            print(f"{'not noticed' if found is False else 'cannot be asked'}: {where} {what}", flush=True)


def rate(places: list[Path]) -> None:
    """How many were noticed, room by room."""
    lines = [json.loads(line) for place in places for line in place.with_suffix(".jsonl").read_text().splitlines()]
    print("| mutants of | tried | noticed |\n|---|---|---|")
    for room in (*PLAIN, *COMPILED):
        mine = [one["noticed"] for one in lines if one["mutant"].startswith(room)]
        print(f"| `{room}` | {len(mine)} | {sum(mine)} |")
    print(f"| all | {len(lines)} | {sum(one['noticed'] for one in lines)} |")


if __name__ == "__main__":
    what, place, *rest = sys.argv[1:]
    if what in ("map", "map-compiled"):
        plain = what == "map"
        folders = tuple(rest) or (PLAIN_TESTS if plain else COMPILED_TESTS)
        map_tests(Path(place), folders, plain)
    elif what == "try":
        tried(Path(place), int(rest[0]), int(rest[1]), tuple(rest[2:]))
    else:
        rate([Path(one) for one in (place, *rest)])
