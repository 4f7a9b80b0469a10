"""The package as plain Python: every law and kernel is the function as written, so that one of them can be exchanged.

`prepare()` before the package is imported. Numba is told to compile nothing; records get attributes, and functions that
are called by their address are found in a table.
"""

from __future__ import annotations

import ast
import ctypes
import os
import sys
from functools import cache
from importlib.machinery import FileFinder, SourceFileLoader
from itertools import count
from pathlib import Path
from types import CodeType, SimpleNamespace
from typing import Any

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
PACKAGE = ROOT / "drivetrain"
FUNCTIONS: dict[int, Any] = {}  # by the address that stands for them
ADDRESSES = count(16, 16)


def _field(name: str) -> property:
    return property(lambda record: record[name], lambda record, value: record.__setitem__(name, value))


@cache
def with_attributes(dtype: Any) -> Any:
    """A record type whose fields are attributes too, as they are in compiled code."""
    if dtype.subdtype is not None:
        return np.dtype((with_attributes(dtype.subdtype[0]), dtype.shape))
    if dtype.names is None:
        return dtype
    inner = {
        "names": dtype.names, "formats": [with_attributes(dtype.fields[name][0]) for name in dtype.names],
        "offsets": [dtype.fields[name][1] for name in dtype.names], "itemsize": dtype.itemsize,
    }  # fmt: skip
    # A class of its own: its fields come before what numpy has under their names, as ``size``.
    return np.dtype((type("Record", (np.void,), {name: _field(name) for name in dtype.names}), inner))


def dtype_of(*given: Any, **options: Any) -> Any:
    return with_attributes(np.dtype(*given, **options))


def carray(pointer: Any, shape: Any, dtype: Any = None) -> Any:
    """An array at an address or a pointer of C."""
    kind = with_attributes(np.dtype(np.float64 if dtype is None else dtype))
    address = pointer if isinstance(pointer, int | np.integer) else ctypes.cast(pointer, ctypes.c_void_p).value
    size = int(np.prod(shape)) * kind.itemsize
    return np.ndarray(shape, kind, (ctypes.c_char * size).from_address(int(address or 0)) if size else None)


def in_c_types(signature: Any) -> list[Any]:
    from numba.core.typing.ctypes_utils import to_ctypes

    return [to_ctypes(one) for one in signature.args]


def callback(signature: Any, function: Any) -> Any:
    """What stands for a compiled function with an address."""
    kinds, address = in_c_types(signature), next(ADDRESSES)

    def called(*given: Any) -> Any:
        taken = []
        for kind, value in zip(kinds, given, strict=True):
            is_pointer = isinstance(kind, type) and issubclass(kind, ctypes._Pointer)
            if is_pointer and isinstance(value, int | np.integer):
                value = ctypes.cast(int(value), kind)
            taken.append(value)
        return function(*taken)

    called.argtypes = kinds  # type: ignore[attr-defined]
    FUNCTIONS[address] = called
    return SimpleNamespace(address=address, ctypes=called)


def call_address(address: Any, given: Any) -> None:
    """Call what stands at an address; one that is not in the table is C's."""
    if int(address) in FUNCTIONS:
        FUNCTIONS[int(address)](*given)
        return
    values = [ctypes.c_double(one) if isinstance(one, float) else ctypes.c_void_p(int(one)) for one in given]
    ctypes.CFUNCTYPE(None, *map(type, values))(int(address))(*values)


class _Records(ast.NodeTransformer):
    """``np.dtype(...)`` gives a type with attributes."""

    def visit_Call(self, node: ast.Call) -> ast.AST:
        self.generic_visit(node)
        if ast.unparse(node.func) == "np.dtype":
            node.func = ast.copy_location(ast.Name("_dtype_of", ast.Load()), node.func)
        return node


def tree_of(path: Path) -> ast.Module:
    return _Records().visit(ast.parse(path.read_text(encoding="utf-8")))


def code_of(tree: ast.Module, path: Path) -> CodeType:
    return compile(ast.fix_missing_locations(tree), str(path), "exec", dont_inherit=True)


class _Loader(SourceFileLoader):
    def get_code(self, fullname: str) -> CodeType:
        return code_of(tree_of(Path(self.path)), Path(self.path))

    def exec_module(self, module: Any) -> None:
        module._dtype_of = dtype_of
        super().exec_module(module)


def _hook(folder: str) -> Any:
    if not Path(folder).is_relative_to(PACKAGE):
        raise ImportError
    return FileFinder(folder, (_Loader, [".py"]))


def prepare() -> None:
    os.environ["NUMBA_DISABLE_JIT"] = "1"
    sys.path.insert(0, str(ROOT))
    sys.path_hooks.insert(0, _hook)
    import numba

    numba.carray = carray
    from drivetrain import call_address as calling
    from drivetrain import jit, vector

    jit.callback, calling.call_address = callback, call_address
    vector.larger, vector.smaller = max, min
