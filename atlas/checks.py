"""Every check on what a user passes. Each raises ValueError with the rule, the value given and the remedy."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

OUTSIDE_CHOICES = ("raise", "nan", "solve")


def short(value: Any) -> str:
    """A value for a message.

    Parameters
    ----------
    value : object

    Returns
    -------
    str
        At most 60 characters.
    """
    try:
        text = repr(value)
    except ValueError:  # of a whole number of thousands of digits
        return "a number too long to write"
    return text if len(text) <= 60 else text[:57] + "..."


def without_unit(name: str, value: Any, unit: str = "") -> Any:
    """What a pint quantity is in a unit; all else as it is.

    Parameters
    ----------
    name : str
        What it is called in messages.
    value : object
        A quantity, also in lists.
    unit : str
        Dimensionless by default.

    Returns
    -------
    object

    Raises
    ------
    ValueError
        For a quantity of another dimension.
    """
    if isinstance(value, (list, tuple)):
        return [without_unit(name, item, unit) for item in value]
    # Whoever passes a quantity has imported pint.
    if not hasattr(value, "dimensionality"):
        return value
    if not value.is_compatible_with(unit):
        wanted = (
            f"in {unit} or what converts to it" if unit else "dimensionless: a ratio, as of a length to the tow radius"
        )
        raise ValueError(f"{name} must be {wanted}, got {short(f'{value:~}')}")
    return value.m_as(unit)


def check_real(name: str, value: Any, unit: str = "") -> NDArray[np.float64]:
    """Real numbers of any numeric dtype, as float64; masked values become nan, quantities numbers.

    Parameters
    ----------
    name : str
        What they are called in messages.
    value : array_like
        Also pint quantities.
    unit : str
        In which quantities are meant; dimensionless by default.

    Returns
    -------
    ndarray

    Raises
    ------
    ValueError
        For labelled arrays, quantities of another dimension, and what is not real numbers.
    """
    value = without_unit(name, value, unit)
    if hasattr(value, "iloc"):
        raise ValueError(
            f"{name} is a pandas {type(value).__name__}; this function takes plain numbers here: pass "
            f"{name}.to_numpy(), or to what answers of many cables Series, or one DataFrame with such columns"
        )
    if hasattr(value, "dims"):
        raise ValueError(
            f"{name} is a labelled {type(value).__name__}; this function pairs by position and takes plain arrays: "
            f"pass {name}.values, or a DataArray to the methods of an atlas that return one quantity"
        )
    if isinstance(value, np.ma.MaskedArray):
        value = np.ma.filled(value.astype(float), np.nan)
    try:
        array = np.asarray(value)
    except ValueError as error:
        raise ValueError(f"{name} must be a number or an array of numbers: {error}") from None
    if array.dtype.kind not in "iuf":
        raise ValueError(
            f"{name} must be a real number or an array of them, got {short(value)} ({array.dtype}); convert it first"
        )
    return array.astype(np.float64)


# Whole numbers beyond are no int64, which `check_real` refuses.
_LARGEST = 2**63


def one_number(value: Any) -> float | None:
    """A number that needs no check and no conversion: what makes one lookup fast.

    Parameters
    ----------
    value : object

    Returns
    -------
    float or None
        None for all that `check_real` has to look at.
    """
    kind = type(value)
    if kind is float:
        return value
    if kind is int:
        return float(value) if -_LARGEST <= value < _LARGEST else None
    if (isinstance(value, np.number) or kind is np.ndarray) and value.ndim == 0 and value.dtype.kind in "iuf":
        return float(value)
    return None


def check_order(value: Any) -> NDArray[np.int64]:
    """Number of a transition: whole numbers from 1.

    Parameters
    ----------
    value : array_like

    Returns
    -------
    ndarray of int

    Raises
    ------
    ValueError
        For others.
    """
    array = check_real("n", value)
    bad = ~((array >= 1) & (array == np.floor(array)) & (array < 2**31))
    if bad.any():
        raise ValueError(f"n counts the transitions and must be a whole number from 1, got {array[bad].flat[0]:g}")
    return array.astype(np.int64)


def check_broadcast(**arrays: NDArray) -> list[NDArray]:
    """Arrays of one common shape.

    Parameters
    ----------
    **arrays : ndarray
        By the names that they have in messages.

    Returns
    -------
    list of ndarray
        Views, in the same order.

    Raises
    ------
    ValueError
        If the shapes do not broadcast together.
    """
    try:
        return list(np.broadcast_arrays(*arrays.values()))
    except ValueError:
        shapes = ", ".join(f"{name} {array.shape}" for name, array in arrays.items())
        raise ValueError(f"shapes do not broadcast together: {shapes}; add or reorder axes") from None


def check_choice(name: str, choice: Any, choices: tuple[str, ...]) -> str:
    """One of some words.

    Parameters
    ----------
    name : str
        What is chosen, in messages.
    choice : str
    choices : tuple of str

    Returns
    -------
    str
        The choice.

    Raises
    ------
    ValueError
        For any other.
    """
    if not isinstance(choice, str) or choice not in choices:
        raise ValueError(f"{name} must be one of {', '.join(choices)}; got {short(choice)}")
    return choice


def check_outside(choice: Any) -> str:
    """What to do with points outside the atlas, one of OUTSIDE_CHOICES.

    Parameters
    ----------
    choice : str

    Returns
    -------
    str
        The choice.

    Raises
    ------
    ValueError
        For any other.
    """
    return check_choice("outside", choice, OUTSIDE_CHOICES)


def check_positive_finite(name: str, array: NDArray[np.float64], *, zero: bool = False) -> None:
    """Finite and above zero everywhere.

    Parameters
    ----------
    name : str
        What the numbers are called in messages.
    array : ndarray
    zero : bool
        Whether zero is allowed, too.

    Raises
    ------
    ValueError
        For others.
    """
    good = np.isfinite(array) & ((array >= 0.0) if zero else (array > 0.0))
    if not good.all():
        rule = "finite and not negative" if zero else "finite and positive"
        raise ValueError(
            f"{name} must be {rule}, got {array[~good].flat[0]:g} ({np.sum(~good)} of {array.size} values)"
        )


def check_one(name: str, value: Any, *, zero: bool = False) -> float:
    """One finite number above zero.

    Parameters
    ----------
    name : str
        What it is called in messages.
    value : float
    zero : bool
        Whether zero is allowed, too.

    Returns
    -------
    float

    Raises
    ------
    ValueError
        For others, and for arrays.
    """
    array = check_real(name, value)
    if array.ndim:
        raise ValueError(f"{name} must be one number, got an array of shape {array.shape}; call once for each")
    check_positive_finite(name, array, zero=zero)
    return float(array)


def check_finite(name: str, value: Any) -> float:
    """One finite number.

    Parameters
    ----------
    name : str
        What it is called in messages.
    value : float

    Returns
    -------
    float

    Raises
    ------
    ValueError
        For others, and for arrays.
    """
    array = check_real(name, value)
    if array.ndim:
        raise ValueError(f"{name} must be one number, got an array of shape {array.shape}; call once for each")
    if not np.isfinite(array):
        raise ValueError(f"{name} must be finite, got {array:g}")
    return float(array)


def check_speed(value: Any) -> float:
    """A speed gamma: one finite number that is not zero, negative in a turn to port.

    Parameters
    ----------
    value : float

    Returns
    -------
    float

    Raises
    ------
    ValueError
        For others, and for arrays.
    """
    gamma = check_finite("gamma", value)
    if gamma == 0.0:
        raise ValueError("gamma must not be zero: positive in a turn to starboard, negative in one to port")
    return gamma


def check_root(root: Any, branch: NDArray[np.str_], expected: int, median: int = -1) -> int:
    """Row of an equilibrium named by a word, by its branch, or by its number.

    Parameters
    ----------
    root : str or int
        "expected", "median", the name of a branch, or a row.
    branch : ndarray of str, shape (equilibria,)
        The names there are.
    expected, median : int
        Rows of those words; -1 for one that names none.

    Returns
    -------
    int

    Raises
    ------
    ValueError
        For what names none.
    """
    rows = [{"expected": expected, "median": median}.get(root, -1)] if isinstance(root, str) else []
    rows += np.flatnonzero(branch == root).tolist() if isinstance(root, str) else []
    if isinstance(root, (int, np.integer)) and not isinstance(root, bool):
        rows = [int(root)]
    for row in rows:
        if 0 <= row < len(branch):
            return row
    raise ValueError(
        f"root must be expected{', median' if median >= 0 else ''}, one of the branches {', '.join(branch)}, or a "
        f"whole number from 0 to {len(branch) - 1}, the equilibria in rising order of R_x0; got {short(root)}"
    )
