"""Mutants of the laws in `drive/`: one operator, comparison or number changed at a time, and whether the tests notice.

Run as `python tests/hard/mutants.py [how many] [seed] [module ...]`. A law is plain Python: its code is exchanged in a
process of its own, in which the tests of its room run, those named like its module first. What is compiled is compiled
before, without a mutant, so what is counted here is what the tests say of the laws alone.
"""

from __future__ import annotations

import ast
import copy
import importlib
import inspect
import os
import random
import sys
import tempfile
import textwrap
from collections.abc import Iterator
from pathlib import Path
from types import CodeType, FunctionType
from typing import Any

ROOT = Path(__file__).resolve().parents[2]
ROOM = ROOT / "tests" / "drive"
MODULES = (  # all whose laws the tests call as they stand; those of periodic heat are only reached compiled
    "amplifier", "brake", "drive", "friction", "gear", "gear_loss", "heat", "motor", "motor_limits", "output_bearing",
    "overload", "stops",
)  # fmt: skip
OTHER = {
    ast.Add: ast.Sub, ast.Sub: ast.Add, ast.Mult: ast.Div, ast.Div: ast.Mult, ast.Lt: ast.GtE, ast.LtE: ast.Gt,
    ast.Gt: ast.LtE, ast.GtE: ast.Lt, ast.Eq: ast.NotEq, ast.NotEq: ast.Eq, ast.And: ast.Or, ast.Or: ast.And,
}  # fmt: skip
NAMES = {"max": "min", "min": "max", "larger": "smaller", "smaller": "larger", "abs": "float"}
SECONDS = 600  # a mutant that makes the tests run for longer is noticed


def mutants(tree: ast.Module) -> Iterator[tuple[str, ast.Module]]:
    """Every copy of a function with one thing changed, and what that is."""
    places = [node for node in ast.walk(tree) if not isinstance(node, ast.expr_context)]
    for index, node in enumerate(places):
        whole = copy.deepcopy(tree)
        mine: Any = [one for one in ast.walk(whole) if not isinstance(one, ast.expr_context)][index]
        if isinstance(node, ast.BinOp | ast.BoolOp | ast.AugAssign) and type(node.op) in OTHER:
            mine.op = OTHER[type(node.op)]()
        elif isinstance(node, ast.Compare) and type(node.ops[0]) in OTHER:
            mine.ops[0] = OTHER[type(node.ops[0])]()
        elif isinstance(node, ast.Constant) and type(node.value) in (int, float):
            mine.value = 1.1 * node.value + 0.1
        elif isinstance(node, ast.Name) and node.id in NAMES:
            mine.id = NAMES[node.id]
        else:
            continue
        yield f"line {node.lineno}: {ast.unparse(node)}", whole


def laws(module: Any) -> Iterator[tuple[FunctionType, list[tuple[str, ast.Module]]]]:
    """The functions of a module that are decorated as laws, with their mutants."""
    for function in vars(module).values():
        if not isinstance(function, FunctionType) or function.__module__ != module.__name__:
            continue
        tree = ast.parse(textwrap.dedent(inspect.getsource(function)))
        head = tree.body[0]
        if isinstance(head, ast.FunctionDef) and any(ast.unparse(one).startswith("law") for one in head.decorator_list):
            head.decorator_list, head.returns = [], None
            for argument in head.args.args:
                argument.annotation = None
            ast.increment_lineno(tree, function.__code__.co_firstlineno - head.lineno)
            yield function, list(mutants(tree))


def code_of(tree: ast.Module) -> CodeType:
    """The code of the one function in a tree."""
    made = compile(ast.fix_missing_locations(tree), "<mutant>", "exec")
    return next(one for one in made.co_consts if isinstance(one, CodeType))


def passes(function: FunctionType | None = None, tree: ast.Module | None = None, module: str = "") -> bool:
    """Whether the tests of the room pass, and end, with a mutant in place."""
    child = os.fork()
    if child == 0:
        import signal

        import pytest

        signal.alarm(SECONDS)
        if function is not None and tree is not None:
            function.__code__ = code_of(tree)
        files = sorted(ROOM.glob("test_*.py"), key=lambda path: (module not in path.name, path.name))
        silent = os.open(os.devnull, os.O_WRONLY)
        os.dup2(silent, 1)
        os.dup2(silent, 2)
        os._exit(int(pytest.main(["-x", "-q", "-p", "no:cacheprovider", "-n0", *map(str, files)])) != 0)
    return os.waitpid(child, 0)[1] == 0


def main(count: int, seed: int, names: tuple[str, ...]) -> int:
    """Try some mutants; 0 when all were noticed."""
    sys.path.insert(0, str(ROOT))
    found = []
    if not passes():
        print("the tests fail without a mutant", file=sys.stderr)
        return 2
    for name in names:
        module = importlib.import_module(f"drivetrain.drive.{name}")
        found += [(name, function, *one) for function, made in laws(module) for one in made]
    some = random.Random(seed).sample(found, min(count, len(found)))
    left = 0
    for name, function, what, tree in some:
        if passes(function, tree, name):
            left += 1
            print(f"not noticed: {name}.{function.__name__}, {what}", flush=True)
    print(f"{len(some)} of {len(found)} mutants tried, {len(some) - left} noticed")
    return 1 if left else 0


if __name__ == "__main__":
    count, seed, *given = [*sys.argv[1:], *("50", "0")[len(sys.argv) - 1 :]]
    with tempfile.TemporaryDirectory() as cache:  # a kernel that is compiled with a mutant must stay nowhere
        os.environ["NUMBA_CACHE_DIR"] = cache
        outcome = main(int(count), int(seed), tuple(given) or MODULES)
    raise SystemExit(outcome)
