"""Functions that are compiled as parts of others: translated once, optimised once, where they are used.

Numba takes every function through the whole compiler on its own, machine code included, and optimises it again within
each function that calls it. For a part that nothing else calls, the first time is for nothing: here it is handed on
as it was translated. ``CompiledPart`` leaves it to the optimiser whether it is copied into its callers,
``CompiledLoop`` keeps it a function of its own, whose loops are then optimised without what surrounds the call.

They are given to ``numba.njit`` as ``pipeline_class``, together with ``no_cpython_wrapper`` and ``no_cfunc_wrapper``:
a part has no address, and must not be called from Python but by way of ``on_its_own``. ``CompiledWhole`` is for all
others.
"""

from __future__ import annotations

from functools import cached_property
from typing import Any

import numba as nb
from numba.core.codegen import JITCodeLibrary
from numba.core.compiler import Compiler, Flags

# Options of a function that numba does not hand to what is compiled on its behalf.
_NOT_PASSED_ON = {"no_cpython_wrapper", "no_cfunc_wrapper", "no_compile", "release_gil"}


class _QuickFlags(Flags):  # type: ignore[misc]
    """The options of a compilation, which numba compares at every operator.

    Its own have all the same hash, and also tell apart what makes no difference to the small functions of numba that
    are compiled for an operator: these are then compiled again for each kind of wrapper.
    """

    @cached_property
    def _passed_on(self) -> tuple[Any, ...]:
        values = sorted(self._values.items())
        return tuple((name, str(value)) for name, value in values if name not in _NOT_PASSED_ON)

    def __hash__(self) -> int:
        return hash(self._passed_on)

    def __eq__(self, other: object) -> bool:
        return self is other or (isinstance(other, _QuickFlags) and self._passed_on == other._passed_on)


class CompiledWhole(Compiler):  # type: ignore[misc]
    """Numba's compiler, but that it compares its options faster.

    Args:
        typingctx, targetctx, library, args, return_type, flags, locals: As numba gives them.
    """

    def __init__(
        self, typingctx: Any, targetctx: Any, library: Any, args: Any, return_type: Any, flags: Any, locals: Any
    ):
        super().__init__(typingctx, targetctx, library, args, return_type, _QuickFlags(flags), locals)


class _NoPlace:
    """Where code is made, for a function that none is made of: it has no variable for its surroundings."""

    def __init__(self, codegen: Any):
        self._codegen = codegen

    def __getattr__(self, name: str) -> Any:
        return getattr(self._codegen, name)

    def set_env(self, env_name: str, env: Any) -> None:
        """Nothing to set."""


class _Part(JITCodeLibrary):  # type: ignore[misc]
    """A function with all that it calls, left to whoever it is linked into."""

    kept = False

    @property
    def codegen(self) -> Any:
        return _NoPlace(self._codegen)

    def finalize(self) -> None:
        if self.kept:
            for function in self._final_module.functions:
                if not function.is_declaration:
                    function.add_function_attribute("noinline")
        for library in dict.fromkeys(self._linking_libraries):
            self._reload_init.update(library._reload_init)
            self._final_module.link_in(library._get_module_for_linking(), preserve=True)
        self._finalize_dynamic_globals()
        self._finalized = True


class _Loop(_Part):
    """The same, never copied into who calls it."""

    kept = True


class CompiledPart(CompiledWhole):
    """The compiler of functions that others may take in.

    Args:
        typingctx, targetctx, library, args, return_type, flags, locals: As numba gives them.
    """

    kind: type[_Part] = _Part

    def __init__(
        self, typingctx: Any, targetctx: Any, library: Any, args: Any, return_type: Any, flags: Any, locals: Any
    ):
        super().__init__(typingctx, targetctx, library, args, return_type, flags, locals)

    def compile_extra(self, func: Any) -> Any:
        """Numba's entry."""
        self.state.library = self.kind(self.state.targetctx.codegen(), func.__qualname__)
        self.state.library.enable_object_caching()
        return super().compile_extra(func)


class CompiledLoop(CompiledPart):
    """The compiler of functions that stay functions: loops over samples."""

    kind = _Loop


def on_its_own(part: Any) -> Any:
    """A part as a function that Python can call, to try it."""

    @nb.njit
    def called(*arguments):  # type: ignore[no-untyped-def]
        return part(*arguments)

    return called
