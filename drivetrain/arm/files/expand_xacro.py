"""Expand one xacro file to standard output, in a separate process: ``python -P expand_xacro.py FILE ROOT...``.

Expressions in xacro files are Python. Only arithmetic and listed functions are permitted; only files below the given
folders are read, nothing is written and no process is started; time and memory are limited.
"""

from __future__ import annotations

import ast
import errno
import os
import re
import sys
from pathlib import Path
from typing import Any

SECONDS, MEMORY, LONGEST = 5, 1 << 30, 1 << 25  # [s] of processor time, bytes of memory, bytes of the result

COMPUTING = (
    ast.Expression, ast.Constant, ast.Name, ast.Load, ast.BinOp, ast.operator, ast.UnaryOp, ast.unaryop, ast.BoolOp,
    ast.boolop, ast.Compare, ast.cmpop, ast.IfExp, ast.Subscript, ast.Slice, ast.List, ast.Tuple, ast.Dict, ast.Call,
    ast.keyword, ast.Attribute,
)  # fmt: skip
FUNCTIONS = frozenset(
    "abs all any bool float int len list dict max min round sorted str sum tuple range load_yaml dotify arg tokenize "
    "abs_filename warning error fatal message print_location acos acosh asin asinh atan atan2 atanh ceil copysign cos "
    "cosh degrees exp fabs floor fmod hypot log log10 log2 pow radians sin sinh sqrt tan tanh trunc isnan isinf".split()
)
METHODS = frozenset(
    "split rsplit strip lower upper startswith endswith replace index count get keys values items".split()
)
SPACES = ("math", "xacro", "python")  # modules whose functions may be called
STARTS = (
    "os.system os.exec os.fork os.posix_spawn os.spawn os.startfile os.remove os.rename os.rmdir os.mkdir os.link "
    "os.symlink os.chmod os.truncate os.kill os.putenv subprocess. socket. ctypes. shutil. pty. webbrowser."
).split()
REFUSED = re.compile(r"\$\((?:eval|env|optenv|anon|command)\b")
FIND = re.compile(r"\$\(find\s+([\w.-]+)\s*\)")


def main() -> None:
    """Expand the file that the command line names."""
    file, roots = Path(sys.argv[1]), [Path(one).resolve() for one in sys.argv[2:]]
    import xacro
    import xacro.substitution_args
    import yaml  # noqa: F401  imported before ``shut`` restricts access to files

    evaluate, resolve = xacro.safe_eval, xacro.substitution_args.resolve_args

    def computed(text: str, *names: Any) -> Any:
        check(text)
        return evaluate(text, *names)

    def resolved(text: str, *rest: Any, **more: Any) -> Any:
        if text and REFUSED.search(text):
            raise ValueError(f"{text} is not evaluated")
        return resolve(FIND.sub(lambda found: package(found[1], roots), text), *rest, **more) if text else text

    xacro.safe_eval, xacro.substitution_args.resolve_args = computed, resolved
    shut(roots)
    limit()
    out = xacro.process_file(str(file)).toxml(encoding="utf-8")
    if len(out) > LONGEST:
        raise ValueError(f"what it stands for has more than {LONGEST >> 20} MB")
    sys.stdout.buffer.write(out)


def check(text: str) -> None:
    """Raise ValueError for an expression with anything but arithmetic and permitted functions."""
    for node in ast.walk(ast.parse(text.strip(), mode="eval")):
        if not isinstance(node, COMPUTING):
            raise ValueError(f"{type(node).__name__} is not evaluated")
        if isinstance(node, ast.Attribute) and node.attr.startswith("_"):
            raise ValueError(f".{node.attr} is not evaluated")
        if isinstance(node, ast.Call) and not _known(node.func):
            raise ValueError(f"calling {ast.unparse(node.func)} is not evaluated")


def _known(called: ast.expr) -> bool:
    """Whether a called function is permitted, such as ``radians``, ``math.radians`` or ``text.split``."""
    if isinstance(called, ast.Attribute):
        of_module = isinstance(called.value, ast.Name) and called.value.id in SPACES
        return called.attr in (FUNCTIONS if of_module else METHODS)
    return isinstance(called, ast.Name) and called.id in FUNCTIONS


def package(name: str, roots: list[Path]) -> str:
    """The folder of a package: one of the given folders or one in them."""
    for folder in (one for root in roots for one in (root, root / name, root.parent / name)):
        if folder.name == name and folder.is_dir() and any(folder.is_relative_to(root) for root in roots):
            return str(folder)
    raise ValueError(f"$(find {name}) is not below {', '.join(map(str, roots))}")


def shut(roots: list[Path]) -> None:
    """From now on, forbid starting processes, writing files, and reading outside of these folders and Python's own."""
    readable = [*roots, *(Path(one).resolve() for one in (*sys.path, sys.prefix, sys.base_prefix) if one)]
    writing = os.O_WRONLY | os.O_RDWR | os.O_CREAT | os.O_TRUNC | os.O_APPEND

    def gate(event: str, given: Any) -> None:
        if event == "open":
            path, _, flags = given
            if isinstance(path, int):
                return
            file = Path(os.fsdecode(path)).resolve()
            if flags & writing or not any(file.is_relative_to(one) for one in readable):
                raise PermissionError(errno.EACCES, f"is not below {', '.join(map(str, roots))}", str(file))
        elif event.startswith(tuple(STARTS)):
            raise PermissionError(f"{event} is not allowed")

    sys.addaudithook(gate)


def limit() -> None:
    """Limit time and memory, if the operating system supports it."""
    try:
        import resource
    except ImportError:
        return
    resource.setrlimit(resource.RLIMIT_CPU, (SECONDS, SECONDS + 1))
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY, MEMORY))


if __name__ == "__main__":
    try:
        main()
    except Exception as error:
        cause = getattr(error, "exc", None)
        error = cause if isinstance(cause, ValueError) else error  # xacro would add the class, and the text again
        sys.stderr.write(f"\0{str(error) or type(error).__name__}")
        sys.exit(2)
