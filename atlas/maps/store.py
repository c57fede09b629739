"""The tiles of a map put together: one Zarr store, or a NetCDF file."""

import hashlib
import os
import shutil
import uuid
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from towatlas.builders.file import COMPRESSION, progress_bar, provenance
from towatlas.cf import symbol_attributes
from towatlas.maps.folds import check_errors
from towatlas.maps.layout import Tiles, place_of, stages, variables
from towatlas.maps.systems import NAMES, Spec
from towatlas.maps.tiles import Columns, padded, read_tile, tile_path
from towatlas.nomenclature import DRAG

COMMENT = (
    "Over the axes and shape: equilibria in rising order of R_x0, nothing beyond the last of them. Do not interpolate "
    "between points of different count, nodes or kind: towatlas.open_map does not. All quantities are dimensionless: "
    "lengths over the tow radius R, forces over (mu + rho A) g R, speeds over sqrt(g R), rates over sqrt(g/R)."
)


def store_path(folder: Path) -> Path:
    """The store of a map.

    Parameters
    ----------
    folder : Path

    Returns
    -------
    Path
    """
    return folder / "map.zarr"


def whole_tile(folder: Path, number: int) -> tuple[Columns, str] | None:
    """What a tile holds, and its SHA-256; one that has been damaged is thrown away.

    Parameters
    ----------
    folder : Path
    number : int

    Returns
    -------
    (dict of ndarray, str) or None
        None where there is none.
    """
    path = tile_path(folder, number)
    found = read_tile(path)
    if found is None:
        with suppress(FileNotFoundError):
            path.unlink()
    return found


def write_store(folder: Path, spec: Spec, widths: dict[str, int], digests: list[str], progress: bool = False) -> None:
    """Put the tiles of a map together, and the store into place: there is none, or a whole one.

    Parameters
    ----------
    folder : Path
    spec : Spec
    widths : dict of int
        Sizes of the dimensions "shape" and "fold".
    digests : list of str
        SHA-256 of the tiles, in order.
    progress : bool
        Whether a bar is drawn on a terminal.

    Raises
    ------
    OSError
        If it cannot be written, or a tile has changed since it was read.
    """
    import zarr

    temporary = folder / f"map.{uuid.uuid4().hex}.part"
    try:
        _template(spec, widths, digests, temporary)
        group: Any = zarr.open_group(str(temporary), mode="r+")
        arrays = {name: group[name] for name in variables(spec)}
        for number, digest in enumerate(digests):
            found = read_tile(tile_path(folder, number))
            if found is None or found[1] != digest:
                raise OSError(f"{tile_path(folder, number)} changed while it was read; --resume does it again")
            stage, tiles, k = place_of(spec, number)
            place = tiles.slices(k)
            shape = tuple(part.stop - part.start for part in place)
            for name, column in found[0].items():
                (column,) = padded([column], widths["shape" if stage == "shapes" else "fold"])
                arrays[name][place] = column.reshape(*shape, *column.shape[1:])
        if spec.checks:
            arrays["check_error"][:] = _measured(spec, temporary, progress)
            for name, column in spec.check_points().items():
                arrays[f"check_{name}"][:] = column
        path = store_path(folder)
        shutil.rmtree(path, ignore_errors=True)
        os.replace(temporary, path)
    finally:
        shutil.rmtree(temporary, ignore_errors=True)


def _measured(spec: Spec, path: Path, progress: bool) -> NDArray[np.float64]:
    with (
        xr.open_dataset(str(path), engine="zarr", chunks=None) as data,
        progress_bar(spec.checks, "check", progress) as bar,
    ):
        return check_errors(spec, data, bar.update)


def _template(spec: Spec, widths: dict[str, int], digests: list[str], path: Path) -> None:
    """All of the store but its chunks."""
    import dask.array
    import zarr

    sizes = widths | {"station": spec.stations}
    arrays: dict[str, Any] = {}
    encoding: dict[str, Any] = {}
    for name, variable in variables(spec).items():
        tiles: Tiles = stages(spec)[variable.stage]
        beyond = tuple(sizes[dim] for dim in variable.beyond)
        shape = (*(len(axis.values) for axis in tiles.axes), *beyond)
        kind = np.asarray(variable.fill).dtype
        dims = (*(axis.name for axis in tiles.axes), *variable.beyond)
        blank = dask.array.empty(shape, chunks=(*tiles.block, *beyond), dtype=kind)
        arrays[name] = (dims, blank, variable.attributes)
        encoding[name] = {"chunks": (*tiles.block, *beyond)} | ({"_FillValue": np.nan} if kind.kind == "f" else {})
    axes: dict[str, Any] = {
        axis.name: ((axis.name,), axis.values, _axis(axis.name, axis.spacing)) for axis in spec.axes
    }
    if spec.stations:
        about = {"long_name": "arc length from the tow point over that of the cable", "units": "1"}
        axes["station"] = (("station",), np.linspace(0.0, 1.0, spec.stations), about)
    encoding |= {name: {"_FillValue": None} for name in axes}
    template = xr.Dataset(arrays, axes, attrs=_attributes(spec, digests))
    # Consolidated metadata belong to version 2 of the format, which zarr 2 writes anyway.
    version: dict[str, Any] = {"zarr_format": 2} if zarr.__version__ >= "3" else {}
    template.to_zarr(str(path), mode="w", compute=False, consolidated=True, encoding=encoding, **version)


def _axis(name: str, spacing: str) -> dict[str, Any]:
    about = {"long_name": NAMES[name], "units": "1", "spacing": spacing}
    return about | ({"references": symbol_attributes(name, DRAG)["references"]} if name in DRAG else {})


def _attributes(spec: Spec, digests: list[str]) -> dict[str, Any]:
    made = provenance("")
    del made["command"], made["history"], made["schema_version"]
    made.pop("date_created", None)
    return {
        "Conventions": "CF-1.11",
        "title": spec.title or "Map of towed cables",
        "institution": "towatlas",
        "source": "towatlas map",
        "history": "towatlas map",
        "comment": COMMENT,
        "fields": " ".join(spec.fields),
        "branches": spec.branches,
        "spec_sha256": spec.sha256,
        "tiles_sha256": hashlib.sha256("".join(digests).encode()).hexdigest(),
        **{f"system_{name}": value for name, value in spec.fixed.items()},
        **({"folds_gamma": list(spec.span)} if spec.span else {}),
        **{name: value.item() if isinstance(value, np.generic) else value for name, value in made.items()},
    }


def merge(folder: Path, spec: Spec, file: Path) -> None:
    """Write the store of a map as one NetCDF file.

    Parameters
    ----------
    folder : Path
        Of the map.
    spec : Spec
    file : Path

    Raises
    ------
    OSError
        If it cannot be written.
    """
    import netCDF4

    file.parent.mkdir(parents=True, exist_ok=True)
    temporary = file.with_name(f".{file.name}.{uuid.uuid4().hex}.part")
    try:
        with xr.open_dataset(str(store_path(folder)), engine="zarr", chunks=None) as whole:
            axes = whole.drop_vars(list(whole.data_vars))
            axes.to_netcdf(
                temporary,
                engine="netcdf4",
                format="NETCDF4",
                encoding={name: {"_FillValue": None} for name in axes.coords},
            )
            with netCDF4.Dataset(temporary, "a") as out:
                for name, variable in variables(spec).items():
                    _copy(out, whole[name].variable, name, stages(spec)[variable.stage], variable.attributes)
        with temporary.open("rb+") as written:
            os.fsync(written.fileno())
        os.replace(temporary, file)
    except RuntimeError as error:
        # The NetCDF library reports a full disk so.
        raise OSError(f"{file} could not be written ({error}); is the disk full?") from None
    finally:
        with suppress(FileNotFoundError):
            temporary.unlink()


def _copy(out: Any, array: xr.Variable, name: str, tiles: Tiles, attributes: dict[str, Any]) -> None:
    """A variable into a NetCDF file, tile by tile, with attributes whose types Zarr does not keep."""
    for dim, size in zip(array.dims, array.shape, strict=True):
        if dim not in out.dimensions:
            out.createDimension(dim, size)
    kind = array.dtype.newbyteorder("=")
    beyond = array.shape[len(tiles.axes) :]
    copy = out.createVariable(
        name,
        kind,
        array.dims,
        fill_value=np.nan if kind.kind == "f" else None,
        chunksizes=(*tiles.block, *beyond) if array.dims else None,
        **(COMPRESSION if array.dims else {}),
    )
    copy.setncatts(attributes)
    for number in range(len(tiles)):
        place = tiles.slices(number)
        copy[place] = array[place].values
