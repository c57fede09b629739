"""Arguments with labels or chunks, and results with the same: xarray, pandas and dask, none of which is imported here.

Whoever passes such an object has imported its library: there is no need to import it to find out.
"""

import sys
from collections.abc import Callable, Mapping
from dataclasses import fields
from functools import wraps
from inspect import Parameter, signature
from typing import TYPE_CHECKING, Any, ClassVar, TypeVar, cast

import numpy as np

from towatlas.kernels import status as codes
from towatlas.nomenclature import DRAG, Symbol

if TYPE_CHECKING:
    import pandas
    import xarray

F = TypeVar("F", bound=Callable[..., Any])


def quantity_of(plain: Callable, name: str, long_name: str, kind: type, **arguments: Any) -> Any:
    """One quantity, in the form of the arguments.

    Parameters
    ----------
    plain : callable
        Of plain arguments, by name; returns an array of their broadcast shape.
    name, long_name : str
        Of the result.
    kind : type
        Of its elements.
    **arguments : array_like, DataArray, Series or dask array
        By name.

    Returns
    -------
    float, ndarray, DataArray, Series or dask array
        DataArrays where there is one among the arguments, lazily where one is chunked; else Series; else dask arrays.

    Raises
    ------
    ValueError
        For labels that do not fit together, and labelled objects of other kinds.
    """

    def placed(*values: Any) -> Any:
        return plain(**dict(zip(arguments, values, strict=True)))

    xarray, dask = sys.modules.get("xarray"), sys.modules.get("dask.array")
    labelled = [value for value in arguments.values() if hasattr(value, "dims")]
    if xarray is not None and labelled:
        if not all(isinstance(value, xarray.DataArray) for value in labelled):
            raise ValueError("labelled arguments must be xarray DataArrays; take one variable out of a Dataset")
        if any(hasattr(value, "iloc") for value in arguments.values()):
            raise ValueError("DataArrays and pandas objects do not go together: convert with Series.to_xarray()")
        found = xarray.apply_ufunc(placed, *arguments.values(), dask="parallelized", output_dtypes=[kind])
        found.name, found.attrs = name, {"long_name": long_name, "units": "1"}
        return found
    index, values = without_index(arguments)
    if index is not None:
        return sys.modules["pandas"].Series(plain(**values), index=index, name=name)
    if dask is not None and any(isinstance(value, dask.Array) for value in values.values()):
        return dask.apply_gufunc(placed, ",".join(["()"] * len(values)) + "->()", *values.values(), output_dtypes=kind)
    return plain(**arguments)


def without_index(arguments: Mapping[str, Any]) -> tuple[Any, dict[str, Any]]:
    """Series among arguments as plain values, in the order of the first of them.

    Parameters
    ----------
    arguments : mapping
        By name.

    Returns
    -------
    index : pandas.Index or None
        None where there is no Series.
    values : dict
        The others as they are.

    Raises
    ------
    ValueError
        For labels that are not the same, and arrays of another shape beside them.
    """
    pandas, values, index = sys.modules.get("pandas"), dict(arguments), None
    if pandas is None:
        return None, values
    for name, value in arguments.items():
        if not isinstance(value, pandas.Series):
            continue
        index = value.index if index is None else index
        if not value.index.equals(index):
            if not (value.index.is_unique and index.is_unique and set(value.index) == set(index)):
                raise ValueError(
                    f"{name} has other labels than the Series before it: give both the same, each once, as by "
                    f"{name}.reindex(...)"
                )
            value = value.reindex(index)
        values[name] = _plain(pandas, name, value)
    if index is not None:
        for name, value in values.items():
            if np.ndim(value) and np.shape(value) != (len(index),):
                raise ValueError(f"{name} has the shape {np.shape(value)} beside Series of {len(index)} values")
    return index, values


def _plain(pandas: Any, name: str, series: Any) -> Any:
    """Values of a Series: those with a unit as a quantity, what is missing as nan."""
    if hasattr(series.dtype, "units"):
        return series.array.quantity
    if pandas.api.types.is_bool_dtype(series.dtype) or not pandas.api.types.is_numeric_dtype(series.dtype):
        raise ValueError(f"{name} must be real numbers, got a Series of {series.dtype}; convert it first")
    return series.to_numpy(dtype=float, na_value=np.nan)


def takes_frames(function: F) -> F:
    """Let a function of arrays, whose result is a dataclass of arrays or a Dataset, take a DataFrame or Series.

    Parameters
    ----------
    function : callable

    Returns
    -------
    callable
        The same; of Series, aligned by their labels, or of a DataFrame whose columns have the names of its arguments, a
        DataFrame with the same index. Other columns are ignored; what a column says is not to be given beside it.
    """
    known = signature(function)
    parameters = {name: one.default for name, one in known.parameters.items() if name != "self"}
    needed = [name for name, default in parameters.items() if default is Parameter.empty]
    columns = [name for name, default in parameters.items() if not isinstance(default, str)]

    @wraps(function)
    def either(*given: Any, **named: Any) -> Any:
        pandas = sys.modules.get("pandas")
        if pandas is None:
            return function(*given, **named)
        at = next((k for k, value in enumerate(given[:2]) if isinstance(value, pandas.DataFrame)), None)
        if at is None:
            for value in (*given, *named.values()):
                if isinstance(value, pandas.Series):
                    break
            else:
                return function(*given, **named)
            index, values = without_index(known.bind(*given, **named).arguments)
            return frame_of(function(**values), index)
        frame = given[at]
        lacking = [name for name in needed if name not in frame and name not in named]
        if lacking or given[at + 1 :] or any(name in columns and name in frame for name in named):
            others = [name for name in columns if name not in needed]
            wrong = f"it lacks {', '.join(lacking)}" if lacking else "something is given twice"
            raise ValueError(
                f"a DataFrame needs the columns {', '.join(needed)} and may have {', '.join(others)}; beside it go "
                f"named arguments that are no columns: {wrong}"
            )
        _, values = without_index({name: frame[name] for name in columns if name in frame} | named)
        return frame_of(function(*given[:at], **values), frame.index)

    return cast(F, either)


def frame_of(result: Any, index: Any = None) -> "pandas.DataFrame":
    """The arrays of a result, of one shape, as a DataFrame.

    Parameters
    ----------
    result : dataclass or Dataset over (system, shape)
    index : pandas.Index, optional
        By default the places in the arrays.

    Returns
    -------
    pandas.DataFrame
        A row a point, a column a field; of a Dataset a row a shape, its number behind the index, and one for a system
        that has none.
    """
    import pandas

    if hasattr(result, "data_vars"):
        frame = result.to_dataframe()
        frame = frame[frame.index.get_level_values("shape") < np.maximum(frame["count"], 1)]
        row, shape_number = (frame.index.get_level_values(name) for name in ("system", "shape"))
        levels = [index[row].get_level_values(k) for k in range(index.nlevels)]
        return frame.set_index(pandas.MultiIndex.from_arrays([*levels, shape_number], names=[*index.names, "shape"]))
    columns = result.columns()
    shape = np.shape(next(iter(columns.values())))
    if index is None and len(shape) > 1:
        dims = [f"{result.DIMENSION}_{k}" for k in range(len(shape))]
        index = pandas.MultiIndex.from_product([range(size) for size in shape], names=dims)
    return pandas.DataFrame({name: np.ravel(column) for name, column in columns.items()}, index=index)


class Answer:
    """A result whose arrays have one shape: as a table, a dataset, or in a few lines.

    Attributes
    ----------
    DIMENSION : str
        What they are over.
    SYMBOLS : dict of Symbol
        What they are called in words.
    """

    DIMENSION: ClassVar[str] = "point"
    SYMBOLS: ClassVar[dict[str, Symbol]] = DRAG

    def columns(self) -> dict[str, Any]:
        """The arrays by name, those of what it is about, as the equilibria of a stability, first.

        Returns
        -------
        dict of ndarray
        """
        columns: dict[str, Any] = {}
        for field in fields(self):  # type: ignore[arg-type]
            value = getattr(self, field.name)
            if isinstance(value, Answer):
                columns |= {
                    f"{field.name}_{name}" if hasattr(self, name) else name: column
                    for name, column in value.columns().items()
                }
            elif isinstance(value, np.ndarray):
                columns[field.name] = value
        return columns

    def to_dataframe(self) -> "pandas.DataFrame":
        """The arrays as a table.

        Returns
        -------
        pandas.DataFrame
            A row a point, a column an array.
        """
        return frame_of(self)

    def to_dataset(self) -> "xarray.Dataset":
        """The arrays as variables, all else as attributes.

        Returns
        -------
        xarray.Dataset
            Over DIMENSION, numbered where there is more than one.
        """
        import xarray

        variables: dict[str, Any] = {}
        for name, column in self.columns().items():
            dims = (self.DIMENSION,) if column.ndim == 1 else [f"{self.DIMENSION}_{k}" for k in range(column.ndim)]
            variables[name] = (dims, column, self._about(name, column))
        return xarray.Dataset(variables, attrs=_facts(self))

    def _about(self, name: str, column: Any) -> dict[str, Any]:
        about: dict[str, Any] = {"long_name": self.SYMBOLS[name].long_name} if name in self.SYMBOLS else {}
        if name.startswith("status"):
            meanings = codes.FLAG_MEANINGS
            return about | {"flag_values": np.arange(len(meanings.split()), dtype=np.int8), "flag_meanings": meanings}
        return about | ({"units": "degree" if name.endswith("_deg") else "1"} if column.dtype.kind in "if" else {})

    def __repr__(self) -> str:
        columns = self.columns()
        shape = next(iter(columns.values())).shape
        many = f"{shape[0]} {self.DIMENSION}s" if len(shape) == 1 else f"shape {shape}"
        lines = {name: str(value) for name, value in _facts(self, whole=True).items()}
        for name, column in columns.items():
            text = np.array2string(column.ravel(), precision=6, threshold=12, edgeitems=3, max_line_width=10**6)
            lines[name] = text.strip("[]").strip()
        width = max(len(name) for name in lines)
        return "\n".join(
            [f"{type(self).__name__}, {many}", *(f"  {name:{width}}  {text}" for name, text in lines.items())]
        )


def _facts(result: Any, whole: bool = False) -> dict[str, Any]:
    """What of a result is one number, word or sentence; of a system its numbers, or the whole of it."""
    facts: dict[str, Any] = {}
    for field in fields(result):
        value = getattr(result, field.name)
        if isinstance(value, Answer) or (field.name == "system" and not whole):
            facts |= _facts(value, whole)
        elif isinstance(value, (bool, np.bool_)):
            facts[field.name] = int(value)
        elif isinstance(value, (int, float, str, np.number)) or field.name == "system":
            facts[field.name] = value
    return facts
