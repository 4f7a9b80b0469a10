"""The decorators of compiled code, and a disk cache that is valid after any change of source.

Numba's own disk cache checks only the file of a kernel, not the files of the functions that the kernel calls. Here each
module with kernels has a cache folder named after the digest of that module and of all modules of the package that it
imports, so that any change of a law, by an edit, a checkout or an upgrade, starts a new folder.
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
ROOM = 200 << 20  # bytes that must be free on a disk: numba fails if it cannot write
SUMS = "sums.json"  # checksums of a folder's files, written when a process that wrote files ends
KEPT = 2  # number of folders of earlier sources to keep, for switching between versions
FAST = {"contract", "reassoc", "nsz", "arcp"}  # allows reordered sums and reciprocals; NaN (unknown) stays NaN
_IMPORT = re.compile(
    r"^\s*(?:from\s+drivetrain\.([\w.]+)\s+import\s+(\([^)]*\)|[^\n]*)|import\s+drivetrain\.([\w.]+))", re.M
)
_SETTING, _REGISTERING = threading.Lock(), threading.RLock()
_WAITING: list[tuple[Any, dict[str, Any]]] = []  # laws that are not registered with numba yet
_USED: set[Path | None] = set()  # cache folders of the loaded modules; None: caching is impossible


def law(function: Any = None, **options: Any) -> Any:
    """Decorator of a function that compiled code calls, and that Python calls uncompiled; options of ``numba.njit``."""
    if function is None:
        return lambda function: law(function, **options)
    _WAITING.append((function, {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True, **options}))
    if "numba" in sys.modules:
        _register()
    return function


def kernel(function: Any = None, **options: Any) -> Any:
    """Decorator of a function that Python calls compiled, cached on disk; options of ``numba.njit``."""
    if function is None:
        return lambda function: kernel(function, **options)
    given = {"error_model": "numpy", "nogil": True, "no_cfunc_wrapper": True, **options}
    return _in_folder(function, lambda keep: _numba().njit(cache=keep, **given)(function))


def callback(signature: Any, function: Any) -> Any:
    """A C callback of a function with a signature of C types, compiled immediately and cached on disk."""
    return _in_folder(function, lambda keep: _numba().cfunc(signature, cache=keep, error_model="numpy")(function))


def cold() -> bool:
    """Whether no function of the loaded modules has been compiled yet; some may never need compiling."""
    return not any(folder is not None and any(folder.rglob("*.nbc")) for folder in _USED)


def kept() -> bool:
    """Whether compiled functions can be cached for the next run."""
    return None not in _USED


def _numba() -> Any:
    """The module numba, with all laws registered."""
    import numba

    _register()
    return numba


def _register() -> None:
    """Register with numba the laws that were defined before it was imported; reading a study does not need numba."""
    import numba  # noqa: F401  first as a whole: two threads that import its modules in different order would deadlock
    from numba.extending import register_jitable

    # A thread that finds no law waiting must not compile before another thread has registered the last one.
    with _REGISTERING:
        while _WAITING:
            function, options = _WAITING.pop()
            register_jitable(**options)(function)


def _in_folder(function: Any, compiled: Callable[[bool], Any]) -> Any:
    """Compile a function with the cache folder of its module; ``compiled`` takes whether to cache."""
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
    """The cache folder of a module for its current sources; None if none can be written."""
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
    """Remove damaged cache files, which numba would execute; they are compiled again when needed.

    Of files without a checksum, from a process that was killed or still runs, only beginning and end are checked.
    """
    sums = _sums(folder)
    for file in folder.rglob("*.nb?"):
        content = file.read_bytes()
        whole = content[:1] == b"\x80" and content[-1:] == b"."  # first and last byte of a pickle
        if not whole or sums.get(_written(file), zlib.crc32(content)) != zlib.crc32(content):
            file.unlink(missing_ok=True)


def _written(file: Path) -> str:
    """Key of a checksum, with the time of writing: another process may rewrite a file, and store sums when it ends."""
    return f"{file.name} {file.stat().st_mtime_ns}"


def _sums(folder: Path) -> dict[str, int]:
    try:
        found = json.loads((folder / SUMS).read_text(encoding="utf-8"))
        return found if isinstance(found, dict) else {}
    except (OSError, ValueError):
        return {}


@atexit.register
def _keep_sums() -> None:
    """Store the checksums of the cache files when this process ends."""
    for folder in _USED - {None}:
        assert folder is not None
        try:
            sums = {_written(file): zlib.crc32(file.read_bytes()) for file in folder.rglob("*.nb?")}
            if sums != _sums(folder):
                beside = folder / f"{SUMS}.{os.getpid()}"
                beside.write_text(json.dumps(sums), encoding="utf-8")
                beside.replace(folder / SUMS)
        except OSError:  # another process clears the folder, or the disk is full: the next one checks the files itself
            continue


def _clear(base: Path, name: str) -> None:
    """Remove the cache folders of earlier sources of a module, except the latest ``KEPT``."""
    found = sorted(base.glob(f"{name}-????????????????"), key=lambda path: path.stat().st_mtime)
    for old in found[: -(KEPT + 1)]:
        shutil.rmtree(old, ignore_errors=True)


@cache
def _places() -> tuple[Path, ...]:
    """Possible cache locations in order of preference: set by the user, beside the code, the user's cache folder."""
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
