"""Functions compiled by numba and kept on disk until anything that they are made from changes.

numba's own cache watches the file of a function. It does not watch what the compiler takes from
other files: the functions that it calls, which are inlined, and constants, which are frozen. Here
the key of a cached function covers these as well.
"""

import hashlib
import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any

import numba
import numpy as np
from numba.core.caching import FunctionCache
from numba.core.dispatcher import Dispatcher

NOTICE = "compiling, once on this machine and after changes; it may take half a minute"
"""What is said on stderr when a function is called first that nothing is kept of."""

FAST: dict[str, Any] = {"error_model": "numpy", "fastmath": {"contract", "nsz", "arcp"}}
"""Options for plain algebra: a division by zero is not an error, and roundings may be fused."""


def compiled(**options: Any) -> Callable[[Callable], Dispatcher]:
    """Decorate a function to be compiled at its first call, or loaded if nothing has changed.

    Compiled functions and constants of other modules have to be imported by name: attributes of
    a module are not looked into.

    Args:
        options: those of `numba.njit`, but for ``cache``.
    """

    def decorate(function: Callable) -> Dispatcher:
        dispatcher = numba.njit(**options)(function)
        # What `cache=True` does, with another key.
        dispatcher._cache = _Cache(dispatcher)
        return dispatcher

    return decorate


def fingerprint(dispatcher: Dispatcher) -> str:
    """SHA-256 over a compiled function's code, options, constants, and all functions it calls."""
    options = sorted((name, str(_ordered(x))) for name, x in dispatcher.targetoptions.items())
    code, known = dispatcher.py_func.__code__, dispatcher.py_func.__globals__
    digest = hashlib.sha256(repr((code.co_code, code.co_consts, code.co_names, options)).encode())
    for name in code.co_names:
        value = known.get(name)
        if isinstance(value, Dispatcher):
            digest.update(fingerprint(value).encode())
        elif isinstance(value, np.ndarray):
            digest.update(repr((value.dtype, value.shape)).encode() + value.tobytes())
        elif not isinstance(value, ModuleType):
            digest.update(repr(value).encode())
    return digest.hexdigest()


def _ordered(value: Any) -> Any:
    return sorted(value) if isinstance(value, set) else value


class _Cache(FunctionCache):
    said = False

    def load_overload(self, signature: Any, target_context: Any) -> Any:
        """What was kept on disk; says once that compiling takes a while, if nothing was."""
        kept = super().load_overload(signature, target_context)
        if kept is None and not _Cache.said:
            _Cache.said = True
            print(f"models: {NOTICE}", file=sys.stderr)
        return kept

    def __init__(self, dispatcher: Dispatcher) -> None:
        super().__init__(dispatcher.py_func)
        self._dispatcher = dispatcher

    def _index_key(self, signature: Any, codegen: Any) -> tuple:
        return *super()._index_key(signature, codegen), fingerprint(self._dispatcher)
