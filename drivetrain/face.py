"""Public names of ``dt`` and its subpackages, imported on first use, and messages for arguments of wrong types.

The ``__init__`` of a subpackage imports its public names for type checkers only. This list is read here, so that it is
the only place that names them.

An array that a function takes may be whatever numpy converts to one, such as a list; its numbers must be finite.
Otherwise calls that succeed are not checked. If a call raises an error of Python, its arguments are compared with the
function's annotations; if these agree, the error is internal and is raised unchanged.
"""

from __future__ import annotations

import ast
import inspect
import sys
import types
from collections.abc import Callable, Iterable, Sequence
from enum import Enum
from functools import cache, wraps
from importlib import import_module
from pathlib import Path
from typing import Any, Literal, TypeVar, Union, get_args, get_origin, get_type_hints

from drivetrain.errors import DrivetrainError, Fault, InputError, nearest

_PACKAGE = Path(__file__).resolve().parent


@cache
def homes(room: str) -> dict[str, str]:
    """The public names of a subpackage with the module of each."""
    source = _PACKAGE.joinpath(*room.split(".")[1:], "__init__.py").read_text(encoding="utf-8")
    block = next(node for node in ast.parse(source).body if isinstance(node, ast.If))
    imports = [node for node in block.body if isinstance(node, ast.ImportFrom)]
    return {alias.name: node.module or "" for node in imports for alias in node.names if alias.name != "*"}


def shown(room: str) -> tuple[Callable[[str], Any], Callable[[], list[str]]]:
    """The ``__getattr__`` and the ``__dir__`` of a subpackage."""

    def load(name: str) -> Any:
        if name == "__all__":
            return names()
        home = homes(room).get(name)
        if home is None:
            raise AttributeError(f"module {room!r} has no attribute {name!r}")
        if home == room:  # a module
            return import_module(f"{room}.{name}")
        found = guarded(getattr(import_module(home), name), room)
        setattr(sys.modules[room], name, found)
        return found

    def names() -> list[str]:
        return sorted(homes(room))

    sys.modules[room].__class__ = _Room
    return load, names


class _Room(types.ModuleType):
    """A subpackage: where a command of the same name is meant, a call says which functions there are."""

    def __call__(self, *_: Any, **__: Any) -> Any:
        place = self.__name__.replace("drivetrain", "dt", 1)
        hint = f"call one of its functions: {', '.join(homes(self.__name__))}"
        raise InputError(Fault(place, "is a module, not a function", hint=hint))


def guarded(found: Any, room: str) -> Any:
    """A public function or class whose calls report arguments of wrong names or types as ``InputError``."""
    if isinstance(found, types.FunctionType):
        call = _guard(found, takes_lists=True)
        call.__module__ = room  # so that it can be pickled for other processes
        return call
    if isinstance(found, type) and not issubclass(found, Exception | Enum | tuple):
        for kind in (one for one in found.__mro__ if one.__module__.startswith("drivetrain.")):
            for name, method in list(vars(kind).items()):
                if name in ("__init__", "__call__") or not name.startswith("_"):
                    _guard_method(kind, name, method)
    return found


def _guard_method(kind: type, name: str, method: Any) -> None:
    function = method.__func__ if isinstance(method, classmethod | staticmethod) else method
    if isinstance(function, types.FunctionType) and not hasattr(function, "__wrapped__"):
        call = _guard(function)
        setattr(kind, name, call if function is method else type(method)(call))


def _guard(function: Callable[..., Any], *, takes_lists: bool = False) -> Callable[..., Any]:
    """A function whose wrong arguments are reported; ``takes_lists``: its arrays are converted, and must be finite."""

    @wraps(function)
    def call(*args: Any, **named: Any) -> Any:
        try:
            if takes_lists and _arrays_of(function):
                args, named = _with_arrays(function, args, named)
            return function(*args, **named)
        except DrivetrainError:
            raise
        except (TypeError, AttributeError, ValueError, LookupError) as error:
            faults = misused(function, args, named) or _unequal(function, args, named)
            if not faults:
                raise
            raise InputError(faults) from error

    return call


@cache
def _arrays_of(function: Callable[..., Any]) -> dict[str, tuple[int, Any]]:
    """Place and type of each parameter of a function that is annotated as an array, by name."""
    try:
        hints = get_type_hints(function)
    except NameError:  # a name that is only imported for type checkers
        return {}
    listed = enumerate(inspect.signature(function).parameters)
    return {name: (at, hints[name]) for at, name in listed if name in hints and _holds_array(hints[name])}


def _holds_array(hint: Any) -> bool:
    inner = hint.__constraints__ if isinstance(hint, TypeVar) else ()
    inner = get_args(hint) if get_origin(hint) in (Union, types.UnionType) else inner
    kind = get_origin(hint) or hint
    return any(map(_holds_array, inner)) or (isinstance(kind, type) and kind.__module__.partition(".")[0] == "numpy")


def _with_arrays(
    function: Callable[..., Any], args: tuple[Any, ...], named: dict[str, Any]
) -> tuple[tuple[Any, ...], dict[str, Any]]:
    """The arguments of a call with arrays in place of lists and the like; raises InputError for what is no numbers."""
    import numpy as np

    values, options, faults, called = list(args), dict(named), [], function.__qualname__
    for name, (at, hint) in _arrays_of(function).items():
        holder: Any = values if at < len(values) else options
        key: Any = at if at < len(values) else name
        if holder is options and name not in options:
            continue
        given = holder[key]
        if given is None and _is(None, hint):
            continue
        try:
            real = not (given is None or isinstance(given, str) or np.iscomplexobj(given))
            array = np.asarray(given, dtype=np.float64) if real else None
        except (TypeError, ValueError, OverflowError):
            array = None
        if array is None:
            faults.append(Fault(f"{called}({name}=)", f"must be {_described(hint)}", _kind(given)))
        elif not np.isfinite(array).all():
            faults.append(Fault(f"{called}({name}=)", "must be finite numbers"))
        elif array.ndim and not isinstance(given, np.ndarray):
            holder[key] = np.asarray(given)
    if faults:
        raise InputError(faults)
    return tuple(values), options


def _unequal(function: Callable[..., Any], args: Sequence[Any], named: dict[str, Any]) -> list[Fault]:
    """A fault if the arrays of a call have shapes that do not go together; empty if they do."""
    import numpy as np

    given = dict(zip(inspect.signature(function).parameters, args, strict=False)) | named
    shapes = {name: np.shape(given[name]) for name in _arrays_of(function) if given.get(name) is not None}
    try:
        np.broadcast_shapes(*shapes.values())
    except ValueError:
        found = ", ".join(f"{name} {shape}" for name, shape in shapes.items())
        return [Fault(f"{function.__qualname__}()", "its arrays must have one shape", found)]
    return []


def misused(function: Callable[..., Any], args: tuple[Any, ...], named: dict[str, Any]) -> list[Fault]:
    """Faults of the names and types of a call's arguments; types that cannot be checked are accepted."""
    signature, called = inspect.signature(function), function.__qualname__.removesuffix(".__init__")
    known = list(signature.parameters)
    spreads = any(one.kind is one.VAR_KEYWORD for one in signature.parameters.values())
    faults = [
        Fault(f"{called}({name}=)", "is no argument of it", hint=nearest(name, known))
        for name in named
        if name not in known and not spreads
    ]
    if faults:
        return faults
    try:
        given = signature.bind(*args, **named).arguments
    except TypeError as error:
        return [Fault(f"{called}()", str(error))]
    try:
        hints = get_type_hints(function)
    except NameError:  # a name that is only imported for type checkers
        return []
    spread = {name for name in given if signature.parameters[name].kind is inspect.Parameter.VAR_POSITIONAL}
    named_all = {name for name in given if signature.parameters[name].kind is inspect.Parameter.VAR_KEYWORD}
    return [
        Fault(f"{called}({name}=)", f"must be {_described(hints[name])}", _kind(value))
        for name, values in given.items()
        if name in hints and name not in named_all
        for value in (values if name in spread else (values,))
        if not _is(value, hints[name])
    ]


def _is(value: Any, hint: Any) -> bool:
    """Whether a value has an annotated type, as far as that can be checked."""
    origin, inner = get_origin(hint), get_args(hint)
    inner = getattr(hint, "__constraints__", ()) or inner
    if origin in (Union, types.UnionType) or isinstance(hint, TypeVar):
        return not inner or any(_is(value, one) for one in inner)
    if origin is Literal:
        return value in inner
    if hint is None or hint is types.NoneType:
        return value is None
    if hint is float:
        return isinstance(value, float | int) or (hasattr(value, "__float__") and getattr(value, "ndim", 0) == 0)
    if hint is int:
        return hasattr(value, "__index__") and getattr(value, "ndim", 0) == 0
    kind = origin or hint
    if isinstance(kind, type) and kind.__module__.partition(".")[0] == "numpy":
        return _becomes_array(value)
    if hint is Any or not isinstance(kind, type) or getattr(kind, "_is_protocol", False):
        return True
    if kind in (Sequence, Iterable) and isinstance(value, str):
        return False
    if kind in (Sequence, Iterable) and isinstance(value, list | tuple) and inner:
        return all(_is(one, inner[0]) for one in value)
    return isinstance(value, kind)


def _becomes_array(value: Any) -> bool:
    """Whether numpy converts the value to an array of numbers."""
    import numpy as np

    try:
        return np.asarray(value, dtype=float).ndim > 0
    except (TypeError, ValueError):
        return False


def _described(hint: Any) -> str:
    inner = get_args(hint)
    if get_origin(hint) in (Union, types.UnionType):
        return " or ".join(dict.fromkeys(_described(one) for one in inner))
    if get_origin(hint) is Literal:
        return " or ".join(repr(one) for one in inner)
    if hint is types.NoneType:
        return "None"
    if isinstance(hint, TypeVar):
        return " or ".join(_described(one) for one in hint.__constraints__)
    name = getattr(get_origin(hint) or hint, "__name__", str(hint))
    return {"str": "a text", "float": "a number", "int": "a whole number", "ndarray": "an array of numbers"}.get(
        name, f"of kind {name}"
    )


def _kind(value: Any) -> str:
    return "None" if value is None else type(value).__name__
