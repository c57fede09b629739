"""How much CPU time a call may take before it has to say so: patience.

Every public function that computes begins with a budget of its own, or uses that of the caller. Loops ask before each
round whether it is used up. Kernels are compiled in other processes, once: that does not count.
"""

import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from contextvars import ContextVar
from dataclasses import dataclass

# What a call may take unless told otherwise, s of CPU of the whole process, so that parallel kernels count in full.
SECONDS = 30.0


class TooMuchWork(ArithmeticError):
    """A computation that was refused, or given up, because it takes more CPU time than allowed; see `patience`."""


@dataclass(frozen=True)
class Progress:
    """How far a call has come.

    Attributes
    ----------
    what : str
        What is being done.
    used, seconds : float
        CPU time used and allowed [s], >= 0; inf for no limit.
    done, of : float
        Part of `what` that is done, and all of it, in units of its own; nan where not known.
    """

    what: str
    used: float
    seconds: float
    done: float = float("nan")
    of: float = float("nan")

    @property
    def known(self) -> bool:
        """Whether it is known how much is done."""
        return self.done == self.done

    @property
    def words(self) -> str:
        """What is being done, and how far it has come where that is known."""
        if not self.known:
            return self.what
        return f"{self.what}, {self.done:,.6g} {f'of {self.of:,.6g} ' if self.of == self.of else ''}done"


@dataclass(frozen=True)
class _Budget:
    seconds: float
    began: float
    each: float

    @property
    def used(self) -> float:
        return _clock() - self.began


_budget: ContextVar[_Budget | None] = ContextVar("towatlas_patience", default=None)
# Steps of shots that are left of those that `counted` allows.
_left: ContextVar[list[float] | None] = ContextVar("towatlas_steps", default=None)
_listener: Callable[[Progress | None], object] = repr


def _clock() -> float:
    """CPU time of this process, s; kernels are compiled in others."""
    return time.process_time()


@contextmanager
def patience(seconds: float = SECONDS, each: float | None = None) -> Iterator[None]:
    """Allow everything within, together, so much CPU time; within another one, the outer counts.

    Parameters
    ----------
    seconds : float
        CPU time of the process without compilations [s], > 0; inf for no limit. Without this every call has 30 s.
    each : float, optional
        What one of many computations within may take, about [s], > 0: limits that grow with patience, as that of the
        steps of a shot, follow it. Equal to `seconds` by default.

    Returns
    -------
    context manager
        For `with`.

    Raises
    ------
    ValueError
        For what is not a positive number.
    TooMuchWork
        By what is called within, an ArithmeticError: at once where the work can be foreseen.

    Examples
    --------
    >>> import towatlas
    >>> with towatlas.patience(300):
    ...     len(towatlas.equilibria(1000.0, 1.0, 1.0))
    39
    """
    for name, value in (("seconds", seconds), ("each", seconds if each is None else each)):
        if isinstance(value, bool) or not isinstance(value, (int, float)) or not value > 0:
            raise ValueError(f"{name} must be a positive number, of CPU time, or inf for no limit; got {value!r}")
    if _budget.get() is not None:
        try:
            yield
        finally:
            _listener(None)
        return
    token = _budget.set(_Budget(seconds, _clock(), seconds if each is None else each))
    try:
        yield
    finally:
        _budget.reset(token)


@contextmanager
def at_most(share: float) -> Iterator[None]:
    """Allow what is within no more than a share of the patience there is, and no more than is left of it.

    Parameters
    ----------
    share : float
        [-], > 0, at most 1.

    Returns
    -------
    context manager
        For `with`; for what an answer can do without.

    Raises
    ------
    TooMuchWork
        As `patience`.
    """
    budget = _budget.get()
    if budget is None:
        yield
        return
    seconds = min(share * budget.seconds, max(0.0, budget.seconds - budget.used))
    token = _budget.set(_Budget(seconds, _clock(), budget.each))
    try:
        yield
    finally:
        _budget.reset(token)


@contextmanager
def to_the_end() -> Iterator[None]:
    """Let what is within come to its end, whatever is left of the patience.

    Returns
    -------
    context manager
        For `with`; for little work, without which what was done is no answer.
    """
    token = _budget.set(None)
    try:
        yield
    finally:
        _budget.reset(token)


def each_allowed() -> float:
    """What each of many computations may take, where only they are limited, and not all of them together.

    Returns
    -------
    float
        CPU time [s], > 0; inf where nothing limits them.
    """
    budget = _budget.get()
    return budget.each if budget is not None and budget.seconds == float("inf") else float("inf")


@contextmanager
def counted(steps: float) -> Iterator[None]:
    """Allow what is within so many steps of shots: counted, for time is not the same on any two runs.

    Parameters
    ----------
    steps : float
        > 0; inf for no limit.

    Returns
    -------
    context manager
        For `with`.

    Raises
    ------
    TooMuchWork
        By what shoots within.
    """
    token = _left.set([steps])
    try:
        yield
    finally:
        _left.reset(token)


def count_steps(steps: float) -> None:
    """Take steps off those that `counted` allows.

    Parameters
    ----------
    steps : float
        That were made, >= 0.

    Raises
    ------
    TooMuchWork
        If they were more than there were.
    """
    if (left := _left.get()) is not None:
        left[0] -= steps
        if left[0] < 0.0:
            raise TooMuchWork("more steps of shots than one of many computations may take")


def scaled(limit: int, most: int) -> int:
    """A limit of one call of a kernel, which grows and shrinks with the patience of the caller.

    Parameters
    ----------
    limit : int
        For SECONDS.
    most : int
        For any patience, and where nobody has set one.

    Returns
    -------
    int
    """
    budget = _budget.get()
    return most if budget is None else int(min(most, max(1.0, limit * budget.each / SECONDS)))


def check_patience(what: str, remedy: str, *, done: float = float("nan"), of: float = float("nan")) -> None:
    """Go on, or give up because the time is used up; called before every batch of work.

    Parameters
    ----------
    what : str
        What is being done, as "searching offsets of the fish".
    remedy : str
        What to ask for instead, as "a shorter cable (lam) has fewer nodes".
    done, of : float
        How much of it is done, and all of it, in the units that `what` speaks of; nan where not known.

    Raises
    ------
    TooMuchWork
    """
    budget = _budget.get()
    if budget is None:
        return
    progress = Progress(what, budget.used, budget.seconds, done, of)
    _listener(progress)
    if progress.used > budget.seconds:
        raise TooMuchWork(f"{progress.words}: not finished in {budget.seconds:g} s of CPU; {_go_on(remedy)}")


def limited() -> bool:
    """Whether the time that there is has an end.

    Returns
    -------
    bool
    """
    budget = _budget.get()
    return budget is not None and budget.seconds < float("inf")


def check_foreseen(seconds: float, what: str, remedy: str) -> None:
    """Refuse work before it begins where it would take longer than is left.

    Parameters
    ----------
    seconds : float
        Estimate of its CPU time [s].
    what : str
        What it is, as "shapes of up to 5000 nodes".
    remedy : str
        As of `check_patience`.

    Raises
    ------
    TooMuchWork
    """
    budget = _budget.get()
    # An estimate of nan, of what overflows, foresees nothing. What is used up already, the next check says.
    if budget is not None and seconds > (left := budget.seconds - budget.used) > 0.0:
        takes = f"{float(f'{seconds:.1g}'):g}" if seconds < 1e6 else "a million"
        allowed = (
            f"{budget.seconds:g} s" if seconds > budget.seconds else f"the {left:.2g} s left of {budget.seconds:g} s"
        )
        raise TooMuchWork(f"{what}, too many for {allowed} of CPU: {takes} s or more; {_go_on(remedy)}")


def listen(listener: Callable[[Progress | None], object]) -> None:
    """Have `listener` told how far calls have come.

    Parameters
    ----------
    listener : callable
        Called from within loops with a Progress, and with None where a call within another's patience ends.
    """
    global _listener
    _listener = listener


def _go_on(remedy: str) -> str:
    return f"{remedy}, or go on with --patience SECONDS (in Python: with towatlas.patience(SECONDS))"
