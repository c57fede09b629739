"""The decorators of compiled functions, for `kernels.building` and for kernels run as plain Python.

What is called from Python is in `kernels.calls`.
"""

from collections.abc import Callable
from typing import Any

import numba
from numba import types

# numpy's error model: a division by zero is inf or nan, not an exception. An exception is a branch, and a loop
# with branches does not vectorise. Only `contract` of fastmath: fused multiply-adds, and isnan still works.
# No wrappers: nothing here is called by numba's own means.
_OPTIONS: dict = {
    "error_model": "numpy",
    "fastmath": {"contract"},
    "no_cpython_wrapper": True,
    "no_cfunc_wrapper": True,
}


def _compiled(function: Callable, **options: Any) -> Any:
    dispatcher: Any = numba.njit(**_OPTIONS, **options)(function)
    if not numba.config.DISABLE_JIT:  # type: ignore[attr-defined]
        template = dispatcher.get_call_template

        # numba takes each plain number in an argument for a type of its own, and compiles the function again for it.
        def plain(arguments: Any, keywords: Any) -> Any:
            return template(
                tuple(types.unliteral(kind) for kind in arguments),
                {name: types.unliteral(kind) for name, kind in keywords.items()},
            )

        dispatcher.get_call_template = plain
    return dispatcher


def inlined(function: Callable) -> Callable:
    """Compile a function that is always inlined into its caller, so that the caller's loop vectorises."""
    return _compiled(function, forceinline=True)


def helper(function: Callable) -> Callable:
    """Compile a function that other kernels call."""
    return _compiled(function)


# What Python calls, by its name in `kernels.calls`.
kernel = helper


def opened(function: Callable) -> Callable:
    """A compiled function that Python can call, and compiles anew in each process: for tests and comparisons."""
    return numba.njit(lambda *arguments: function(*arguments))
