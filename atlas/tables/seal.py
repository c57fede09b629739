"""The seal of a file: a SHA-256 of every byte of it, kept inside it, and the move into place that keeps it whole.

The seal is a text variable of the file, `SEAL_MARK` and 64 hexadecimal digits; the digest is that of the file with
zeros for those digits. It is checked on the raw bytes, before any NetCDF library sees them.
"""

import hashlib
import os
import re
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path

SEAL_MARK = b"towatlas-sha256:"
DIGITS = 64
BLANK_SEAL = SEAL_MARK + b"0" * DIGITS


class AtlasFileError(OSError):
    """A file that cannot be read as an atlas: missing parts, damaged, of another kind or of a newer version."""


def _digits_at(data: bytes) -> int:
    places = [match.end() for match in re.finditer(re.escape(SEAL_MARK), data)]
    return places[0] if len(places) == 1 else -1


def _digest(data: bytes, at: int) -> str:
    digest = hashlib.sha256(data[:at])
    digest.update(b"0" * DIGITS)
    digest.update(data[at + DIGITS :])
    return digest.hexdigest()


def write_seal(path: Path) -> str:
    """Fill in the blank seal of a closed file.

    Parameters
    ----------
    path : Path

    Returns
    -------
    str
        The digest.

    Raises
    ------
    AtlasFileError
        If there is not one blank seal in it.
    """
    data = path.read_bytes()
    at = _digits_at(data)
    if at < 0:
        raise AtlasFileError(f"{path}: the file was not written with one blank seal in it")
    digest = _digest(data, at)
    with path.open("r+b") as file:
        file.seek(at)
        file.write(digest.encode())
        file.flush()
        os.fsync(file.fileno())
    return digest


def read_sealed(path: Path) -> tuple[bytes, str]:
    """All bytes of a file whose seal is unbroken, and the digest.

    Parameters
    ----------
    path : Path

    Returns
    -------
    data : bytes
    seal : str

    Raises
    ------
    FileNotFoundError
        If there is no such file.
    AtlasFileError
        If it cannot be read, is no atlas, or has been changed since it was written, if only by one bit.
    """
    try:
        data = path.read_bytes()
    except FileNotFoundError:
        raise FileNotFoundError(
            f"no file at {path}; `towatlas build` makes an atlas, `towatlas build --help` says what else there is; one "
            "built elsewhere, as in build of a clone, is named by --atlas or $TOWATLAS_FILE"
        ) from None
    except OSError as error:
        raise AtlasFileError(f"{path} cannot be read: {error.strerror}") from None
    if not data:
        raise AtlasFileError(f"{path} is empty; build it again with `towatlas build`")
    if not data.startswith(b"\x89HDF\r\n\x1a\n"):
        kind = "looks like a web page" if data.lstrip()[:1] == b"<" else "does not begin as one"
        raise AtlasFileError(f"{path} is not a NetCDF-4 file: it {kind}")
    at = _digits_at(data)
    if at < 0:
        raise AtlasFileError(f"{path} is not a whole towatlas file: it carries no seal. Copy or build it again")
    stored = data[at : at + DIGITS].decode("ascii", "replace")
    if stored != _digest(data, at):
        raise AtlasFileError(f"{path} has been damaged: its bytes do not match their seal. Copy or build it again")
    return data, stored


def check_writable(path: Path) -> None:
    """Make sure that a file can be put somewhere; makes its folder.

    Parameters
    ----------
    path : Path

    Raises
    ------
    AtlasFileError
        If it can not.
    """
    if path.is_dir():
        raise AtlasFileError(f"{path} is a folder; name a file in it")
    try:
        path.absolute().parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise AtlasFileError(f"{path} cannot be written: {error.strerror}") from None
    if not os.access(path.absolute().parent, os.W_OK):
        raise AtlasFileError(f"{path} cannot be written: no permission to write in its folder")


@contextmanager
def written_in_place(path: Path) -> Iterator[Path]:
    """A temporary path beside `path`; what is written there is sealed and moved into place when the block ends well.

    The file at `path` is at any moment the old one or the new one, whole: a writer that fails or is killed leaves the
    old one, two at once leave that of the last to finish.

    Parameters
    ----------
    path : Path

    Yields
    ------
    Path
    """
    path = path.absolute()
    path.parent.mkdir(parents=True, exist_ok=True)
    _remove_orphans(path)
    temporary = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        yield temporary
        write_seal(temporary)
        os.replace(temporary, path)
        folder = os.open(path.parent, os.O_RDONLY)
        try:
            os.fsync(folder)
        finally:
            os.close(folder)
    finally:
        with suppress(FileNotFoundError):
            temporary.unlink()


def _remove_orphans(path: Path) -> None:
    """Delete the temporary files of builds that were killed."""
    for orphan in path.parent.glob(f".{path.name}.*.part"):
        owner = orphan.name.split(".")[-2]
        if owner.isdigit() and not Path(f"/proc/{owner}").exists() and Path("/proc").exists():
            with suppress(OSError):
                orphan.unlink()
