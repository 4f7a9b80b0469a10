"""The decorators of compiled code, and a disk cache that is right whatever source changes.

Numba's own disk cache looks at the file of a kernel alone, not at the files of what the kernel calls. Here every module
with kernels has a folder that bears the digest of that module and of all modules of the package that it imports: who
changes a law begins a new folder, whether by an edit, a checkout or an upgrade.
"""

from __future__ import annotations

import atexit
import json
import os
import re
import shutil
import sys
import threading
import zlib
from collections.abc import Callable
from functools import cache
from hashlib import blake2b
from pathlib import Path
from typing import Any

PACKAGE = Path(__file__).resolve().parent
ROOM = 200 << 20  # bytes that must be free on a disk: numba gives up where it cannot write
SUMS = "sums.json"  # what the files of a folder were when a process that wrote them ended
KEPT = 2  # folders of earlier sources, for who goes back and forth between two versions
FAST = {"contract", "reassoc", "nsz", "arcp"}  # sums in any order, reciprocals; NaN (unknown) stays NaN
_IMPORT = re.compile(
    r"^\s*(?:from\s+drivetrain\.([\w.]+)\s+import\s+(\([^)]*\)|[^\n]*)|import\s+drivetrain\.([\w.]+))", re.M
)
_SETTING, _REGISTERING = threading.Lock(), threading.RLock()
_WAITING: list[tuple[Any, dict[str, Any]]] = []  # laws that numba does not know yet
_USED: set[Path | None] = set()  # folders of the modules that are loaded; None: nothing can be kept


def law(function: Any = None, **options: Any) -> Any:
    """What compiled code calls, kept on disk with it; Python calls it as it stands. Options of ``numba.njit``."""
    if function is None:
        return lambda function: law(function, **options)
    _WAITING.append((function, {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True, **options}))
    if "numba" in sys.modules:
        _register()
    return function


def kernel(function: Any = None, **options: Any) -> Any:
    """A function that Python calls, compiled with options of ``numba.njit`` and kept on disk."""
    if function is None:
        return lambda function: kernel(function, **options)
    given = {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True, **options}
    return _in_folder(function, lambda keep: _numba().njit(cache=keep, **given)(function))


def callback(signature: Any, function: Any) -> Any:
    """A function with an address, of a signature of C types, kept on disk; compiled at once."""
    return _in_folder(function, lambda keep: _numba().cfunc(signature, cache=keep, error_model="numpy")(function))


def cold() -> bool:
    """Whether nothing of what is loaded is compiled yet; some of it may never be called, so not each must be."""
    return not any(folder is not None and any(folder.rglob("*.nbc")) for folder in _USED)


def kept() -> bool:
    """Whether what is compiled is there at the next run."""
    return None not in _USED


def _numba() -> Any:
    """The compiler, with every law registered."""
    import numba

    _register()
    return numba


def _register() -> None:
    """Make known to compiled code the laws that stood before it was needed: who reads a study needs no compiler."""
    import numba  # noqa: F401  whole first: another thread may be at it, and two ways into its modules lock each other out
    from numba.extending import register_jitable

    with _REGISTERING:  # who finds none waiting must not compile before another thread has made the last one known
        while _WAITING:
            function, options = _WAITING.pop()
            register_jitable(**options)(function)


def _in_folder(function: Any, compiled: Callable[[bool], Any]) -> Any:
    """What numba makes of a function while its cache is the folder of the function's module; kept or not."""
    config = _numba().config
    folder = _folder(Path(sys.modules[function.__module__].__file__ or __file__).resolve())
    _USED.add(folder)
    if folder is None:
        return compiled(False)
    with _SETTING:
        before, config.CACHE_DIR = config.CACHE_DIR, str(folder)
        try:
            return compiled(True)
        except RuntimeError:  # numba finds no file for the function, as for one typed into a shell
            return compiled(False)
        finally:
            config.CACHE_DIR = before


@cache
def _folder(module: Path) -> Path | None:
    """Of a module's kernels, made afresh when a source has changed; None where nothing can be written."""
    sources = blake2b(f"{_numba().__version__} {sys.version}".encode(), digest_size=8)
    for path in sorted(_closure(module)):
        sources.update(path.read_bytes())
    name = ".".join(module.relative_to(PACKAGE).with_suffix("").parts) if PACKAGE in module.parents else module.stem
    for base in _places():
        folder = base / f"{name}-{sources.hexdigest()}"
        try:
            if not folder.is_dir():
                folder.mkdir(parents=True, exist_ok=True)
                _clear(base, name)
            if os.access(folder, os.W_OK) and shutil.disk_usage(folder).free > ROOM:
                _drop_damaged(folder)
                return folder
        except OSError:
            continue
    return None


def _drop_damaged(folder: Path) -> None:
    """Take away files that are not what was written, which numba would run; made anew when they are needed.

    Of files that a process has written which was killed, or still runs, beginning and end are looked at.
    """
    sums = _sums(folder)
    for file in folder.rglob("*.nb?"):
        content = file.read_bytes()
        whole = content[:1] == b"\x80" and content[-1:] == b"."  # as every pickle
        if not whole or sums.get(_written(file), zlib.crc32(content)) != zlib.crc32(content):
            file.unlink(missing_ok=True)


def _written(file: Path) -> str:
    """What a sum is of: another process may write the file anew, and note its own sums only when it ends."""
    return f"{file.name} {file.stat().st_mtime_ns}"


def _sums(folder: Path) -> dict[str, int]:
    try:
        found = json.loads((folder / SUMS).read_text(encoding="utf-8"))
        return found if isinstance(found, dict) else {}
    except (OSError, ValueError):
        return {}


@atexit.register
def _keep_sums() -> None:
    """Note what the files are that this process leaves."""
    for folder in _USED - {None}:
        assert folder is not None
        try:
            sums = {_written(file): zlib.crc32(file.read_bytes()) for file in folder.rglob("*.nb?")}
            if sums != _sums(folder):
                beside = folder / f"{SUMS}.{os.getpid()}"
                beside.write_text(json.dumps(sums), encoding="utf-8")
                beside.replace(folder / SUMS)
        except OSError:  # another process clears it, or the disk is full: the next looks closer
            continue


def _clear(base: Path, name: str) -> None:
    """Take away the folders of a module that were made of sources long gone."""
    found = sorted(base.glob(f"{name}-????????????????"), key=lambda path: path.stat().st_mtime)
    for old in found[: -(KEPT + 1)]:
        shutil.rmtree(old, ignore_errors=True)


@cache
def _places() -> tuple[Path, ...]:
    """Where caches may lie, the best first: where the user says, beside the code, in the user's folder for caches."""
    own = os.environ.get("NUMBA_CACHE_DIR")
    if own:
        return (Path(own) / "drivetrain",)
    caches = os.environ.get("LOCALAPPDATA") or os.environ.get("XDG_CACHE_HOME")
    home = [Path(caches)] if caches else [Path.home() / ".cache"] if os.environ.get("HOME") else []
    return (PACKAGE / "__pycache__" / "kernels", *(folder / "drivetrain" for folder in home))


def _closure(module: Path) -> set[Path]:
    """A module and all modules of the package that it imports, directly or not."""
    found, waiting = {module}, [module]
    while waiting:
        for path in _imported(waiting.pop()) - found:
            found.add(path)
            waiting.append(path)
    return found


@cache
def _imported(module: Path) -> set[Path]:
    names: set[str] = set()
    for base, what, plain in _IMPORT.findall(module.read_text(encoding="utf-8")):
        names |= {base or plain, *(f"{base}.{name}" for name in re.findall(r"\w+", what))}
    paths = (PACKAGE.joinpath(*name.split(".")).with_suffix(".py") for name in names)
    return {path for path in paths if path.is_file()}
