"""Reading a file of towatlas: its bytes, checked against their seal, as NetCDF. Needs numpy and netCDF4 only."""

import mmap
import os
import threading
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

from towatlas.tables.seal import AtlasFileError, read_sealed

if TYPE_CHECKING:
    import netCDF4

SCHEMA_VERSION = 1
VARIABLE = "TOWATLAS_FILE"
# The atlas that a wheel brings along.
SHIPPED = Path(__file__).with_name("atlas.nc")

_NETCDF = threading.Lock()


def data_folder() -> Path:
    """Where files are put by default, and looked for.

    Returns
    -------
    Path
        `build` where the working folder is a clone of the repository, else the user's data folder for towatlas.
    """
    if Path("atlas/tables", Path(__file__).name).is_file():
        return Path("build")
    # Who names a file does not wait for the library.
    from platformdirs import user_data_path

    return user_data_path("towatlas", appauthor=False)


def _named() -> Path | None:
    """What $TOWATLAS_FILE names, None where it is not set."""
    text = os.environ.get(VARIABLE)
    if text is None:
        return None
    if not text.strip():
        raise AtlasFileError(f"{VARIABLE} is empty: unset it, or let it name a file")
    return Path(os.path.expanduser(text))


def built_path() -> Path:
    """Where an atlas is put when no place is named.

    Returns
    -------
    Path
        $TOWATLAS_FILE, else atlas.nc in `data_folder()`.

    Raises
    ------
    AtlasFileError
        If $TOWATLAS_FILE is empty.
    """
    return _named() or data_folder() / "atlas.nc"


def default_path() -> Path:
    """The atlas used when none is named.

    Returns
    -------
    Path
        $TOWATLAS_FILE, else the atlas that was built, else the one that came with the package. The second where there
        is neither.

    Raises
    ------
    AtlasFileError
        If $TOWATLAS_FILE is empty.
    FileNotFoundError
        If there is no file where it points.
    """
    path = built_path()
    if path.exists():
        return path
    if _named():
        raise FileNotFoundError(
            f"{VARIABLE} names {path}, where there is no file: unset it, or `towatlas build` puts an atlas there"
        )
    return SHIPPED if SHIPPED.exists() else path


def is_map(path: Path) -> bool:
    """Whether a map is there, by `towatlas map`, and no atlas.

    Parameters
    ----------
    path : Path

    Returns
    -------
    bool
    """
    if path.is_dir():
        return True
    try:
        # Before anything is known of the file: not by the NetCDF library, which is not safe with damaged ones.
        with path.open("rb") as file, mmap.mmap(file.fileno(), 0, access=mmap.ACCESS_READ) as data:
            return data.find(b"tiles_sha256") >= 0
    except (OSError, ValueError):
        return False


def _dataset(path: Path, data: bytes) -> "netCDF4.Dataset":
    # Who opens no file does not wait for the library.
    import netCDF4

    try:
        file = netCDF4.Dataset(path.name, memory=data)
    except (OSError, RuntimeError) as error:
        raise AtlasFileError(f"{path} is not a readable NetCDF-4 file: {error}") from None
    file.set_auto_mask(False)
    return file


@contextmanager
def open_group(path: Path, data: bytes) -> Iterator["netCDF4.Dataset"]:
    """The file whose bytes these are, for reading at once: the NetCDF library is not safe to call from two threads.

    Parameters
    ----------
    path : Path
        For messages.
    data : bytes

    Yields
    ------
    netCDF4.Dataset

    Raises
    ------
    AtlasFileError
        If it is no NetCDF-4 file.
    """
    with _NETCDF, _dataset(path, data) as file:
        yield file


def read_root(path: Path) -> tuple[dict[str, Any], bytes, str]:
    """Global attributes, bytes and seal of any towatlas file, an atlas or a plain table.

    Parameters
    ----------
    path : Path

    Returns
    -------
    attributes : dict
    data : bytes
    seal : str

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    AtlasFileError
        If it is damaged, none of towatlas, or of a newer version.
    """
    data, seal = read_sealed(path)
    with open_group(path, data) as file:
        attributes = {name: file.getncattr(name) for name in file.ncattrs()}
    version = attributes.get("schema_version")
    if version is None:
        raise AtlasFileError(f"{path} is not an atlas: it has no schema_version")
    if version > SCHEMA_VERSION:
        raise AtlasFileError(
            f"{path} has schema version {version}, this towatlas reads up to {SCHEMA_VERSION}; upgrade towatlas"
        )
    return attributes, data, seal
