"""Writing a file, so that its bytes depend on nothing but what is in it."""

import importlib.metadata
import os
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr
from tqdm import tqdm

from towatlas.kernels import sweeps
from towatlas.kernels.native import source_hash
from towatlas.tables.file import SCHEMA_VERSION
from towatlas.tables.seal import BLANK_SEAL, AtlasFileError, written_in_place

COMPRESSION = {"zlib": True, "complevel": 4, "shuffle": True, "fletcher32": True}


@dataclass(frozen=True)
class Summary:
    """What a finished build has to say for itself.

    Attributes
    ----------
    path : Path
        The file.
    title : str
        What it holds.
    facts : tuple of (str, str)
        Labels and what they say, in order.
    seconds : float
        How long it took [s], > 0.
    """

    path: Path
    title: str
    facts: tuple[tuple[str, str], ...]
    seconds: float

    @property
    def bytes(self) -> int:
        """Size of the file [bytes]."""
        return self.path.stat().st_size

    def __str__(self) -> str:
        facts = (*self.facts, ("time", f"{self.seconds:.1f} s"))
        lines = [f"  {label:<12} {text}" for label, text in facts]
        return "\n".join([f"{self.path}  ({self.bytes / 1e6:.2f} MB, {self.title})", *lines])


@contextmanager
def limited_threads(count: int | None) -> Iterator[None]:
    """All parallel kernels within the block run on so many threads.

    Parameters
    ----------
    count : int or None
        None for all there are.

    Yields
    ------
    None

    Raises
    ------
    ValueError
        For more than there are, and less than 1.
    """
    if count is not None and not 1 <= count <= sweeps.MOST_THREADS:
        raise ValueError(f"threads must be 1 to {sweeps.MOST_THREADS} on this machine, got {count}")
    with sweeps.limited_threads(count or sweeps.threads()):
        yield


def progress_bar(total: int, unit: str, wanted: bool) -> tqdm:
    """A bar on standard error; none where that is no terminal.

    Parameters
    ----------
    total : int
        What is to be done.
    unit : str
        Of that.
    wanted : bool

    Returns
    -------
    tqdm
    """
    return tqdm(total=total, unit=unit, disable=None if wanted else True, leave=False)


def provenance(options: str) -> dict[str, Any]:
    """Attributes that say with what a file was built; nothing in them depends on the machine or the hour.

    Parameters
    ----------
    options : str
        Of `towatlas build`.

    Returns
    -------
    dict

    Raises
    ------
    ValueError
        If $SOURCE_DATE_EPOCH is set and no number of seconds.
    """
    versions = " ".join(
        f"{name} {importlib.metadata.version(name)}" for name in ("numpy", "numba", "xarray", "netCDF4")
    )
    command = f"towatlas build {options}"
    attributes = {
        "schema_version": np.int32(SCHEMA_VERSION),
        "towatlas_version": importlib.metadata.version("towatlas"),
        "kernel_sources_sha256": source_hash(),
        "library_versions": versions,
        "command": command,
        "history": command,
    }
    # The clock of the machine would make two builds differ.
    if epoch := os.environ.get("SOURCE_DATE_EPOCH"):
        try:
            date = datetime.fromtimestamp(int(epoch), UTC)
        except (ValueError, OverflowError, OSError):
            raise ValueError(f"SOURCE_DATE_EPOCH must be seconds since 1970, got {epoch!r}") from None
        attributes["date_created"] = date.strftime("%Y-%m-%dT%H:%M:%SZ")
        attributes["history"] = f"{attributes['date_created']} {command}"
    return attributes


def _encoding(dataset: xr.Dataset) -> dict[str, dict[str, Any]]:
    encoding: dict[str, dict[str, Any]] = {}
    for name, array in dataset.variables.items():
        # A fill value on a coordinate is a CF error, and xarray writes one unless told not to.
        kind = array.dtype.kind
        plain = name in dataset.coords or kind != "f"
        # Older HDF5 fails on compressed texts of any length.
        compressed = array.ndim and kind not in "OUS"
        encoding[str(name)] = {"_FillValue": None if plain else np.nan} | (COMPRESSION if compressed else {})
    return encoding


def write_atlas(path: Path, root: xr.Dataset, groups: dict[str, xr.Dataset]) -> None:
    """Write a file, seal it and move it into place; see `towatlas.tables.seal`.

    Parameters
    ----------
    path : Path
    root : xarray.Dataset
        What stands at the top.
    groups : dict of xarray.Dataset
        By name.

    Raises
    ------
    AtlasFileError
        If it cannot be written.
    """
    seal = xr.Variable(
        (),
        np.array(BLANK_SEAL, f"S{len(BLANK_SEAL)}"),
        {"long_name": "SHA-256 of all bytes of this file, taken with 64 times the character 0 for its digits here"},
    )
    root = root.assign({"seal": seal})
    with written_in_place(path) as temporary:
        encoding = _encoding(root)
        encoding["seal"] = {"char_dim_name": "seal_length"}
        try:
            root.to_netcdf(temporary, mode="w", engine="netcdf4", format="NETCDF4", encoding=encoding)
            for name, group in groups.items():
                group.to_netcdf(temporary, mode="a", engine="netcdf4", group=name, encoding=_encoding(group))
        except (OSError, RuntimeError) as error:
            # The NetCDF library reports a full disk as an unspecific RuntimeError.
            raise AtlasFileError(f"{path} could not be written ({error}); is the disk full?") from None
