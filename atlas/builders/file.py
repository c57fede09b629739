"""Writing a file, so that its bytes depend on nothing but what is in it."""

import importlib.metadata
import os
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from towatlas.kernels.compiling import source_hash
from towatlas.tables.critical import SCHEMA_VERSION
from towatlas.tables.seal import BLANK_SEAL, AtlasFileError, written_in_place

COMPRESSION = {"zlib": True, "complevel": 4, "shuffle": True, "fletcher32": True}


def provenance(options: str) -> dict[str, Any]:
    """Attributes that say with what a file was built; nothing in them depends on the machine or the hour."""
    versions = " ".join(
        f"{name} {importlib.metadata.version(name)}" for name in ("numpy", "numba", "xarray", "netCDF4")
    )
    command = f"python -m towatlas build {options}"
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
        plain = name in dataset.coords or array.dtype.kind != "f"
        encoding[str(name)] = {"_FillValue": None if plain else np.nan} | (COMPRESSION if array.ndim else {})
    return encoding


def write_atlas(path: Path, root: xr.Dataset, groups: dict[str, xr.Dataset]) -> None:
    """Write a file, seal it and move it into place; see `towatlas.tables.seal`."""
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
