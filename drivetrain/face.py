"""What a call of a public function with arguments of the wrong kind says: their names, not where it went wrong inside.

A call that succeeds is not looked at. Where one ends in an error of Python's own, its arguments are held against the
function's annotations; where these are right the error is ours and stays as it is.
"""

from __future__ import annotations

import inspect
import types
from collections.abc import Callable, Sequence
from functools import wraps
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

from drivetrain.errors import DrivetrainError, Fault, InputError, nearest


def guarded(function: Callable[..., Any], module: str) -> Callable[..., Any]:
    """The function, saying which of its arguments are none that it takes.

    Args:
        function: A public one.
        module: In which it is found by its own name.
    """

    @wraps(function)
    def call(*args: Any, **named: Any) -> Any:
        try:
            return function(*args, **named)
        except DrivetrainError:
            raise
        except (TypeError, AttributeError, ValueError, LookupError) as error:
            faults = misused(function, args, named)
            if not faults:
                raise
            raise InputError(faults) from error

    call.__module__ = module  # so that other processes find it
    return call


def misused(function: Callable[..., Any], args: tuple[Any, ...], named: dict[str, Any]) -> list[Fault]:
    """What is wrong with the names and the kinds of a call's arguments; what cannot be told is taken for right."""
    signature = inspect.signature(function)
    known = list(signature.parameters)
    spreads = any(one.kind is one.VAR_KEYWORD for one in signature.parameters.values())
    faults = [
        Fault(f"{function.__name__}({name}=)", "is no argument of it", hint=nearest(name, known))
        for name in named
        if name not in known and not spreads
    ]
    if faults:
        return faults
    try:
        given = signature.bind(*args, **named).arguments
    except TypeError as error:
        return [Fault(f"{function.__name__}()", str(error))]
    try:
        hints = get_type_hints(function)
    except NameError:  # a name that is only imported for type checkers
        return []
    single = {name: value for name, value in given.items() if signature.parameters[name].kind not in (2, 4)}
    return [
        Fault(f"{function.__name__}({name}=)", f"must be {_described(hints[name])}", _kind(value))
        for name, value in single.items()
        if name in hints and not _is(value, hints[name])
    ]


def _is(value: Any, hint: Any) -> bool:
    """Whether a value is of an annotated kind, as far as a look at it tells."""
    origin, inner = get_origin(hint), get_args(hint)
    if origin in (Union, types.UnionType):
        return any(_is(value, one) for one in inner)
    if origin is Literal:
        return value in inner
    if hint is None or hint is types.NoneType:
        return value is None
    if hint is float:
        return isinstance(value, float | int) or hasattr(value, "__float__")
    if hint is int:
        return hasattr(value, "__index__")
    kind = origin or hint
    if hint is Any or not isinstance(kind, type) or kind.__module__.partition(".")[0] == "numpy":
        return True  # Any; what becomes an array is looked at by who makes it one
    if kind is Sequence and isinstance(value, str):
        return False
    return isinstance(value, kind)


def _described(hint: Any) -> str:
    """A kind in words."""
    inner = get_args(hint)
    if get_origin(hint) in (Union, types.UnionType):
        return " or ".join(dict.fromkeys(_described(one) for one in inner))
    if get_origin(hint) is Literal:
        return " or ".join(repr(one) for one in inner)
    if hint is types.NoneType:
        return "None"
    name = getattr(get_origin(hint) or hint, "__name__", str(hint))
    return {"str": "a text", "float": "a number", "int": "a whole number"}.get(name, f"of kind {name}")


def _kind(value: Any) -> str:
    return "None" if value is None else type(value).__name__
