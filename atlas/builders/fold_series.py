"""The series that the package brings along, from which the direct solver starts: those of the atlas, shortened."""

import sys
from collections.abc import Mapping
from io import BytesIO
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile, ZipInfo

import netCDF4
import numpy as np
from numpy.typing import NDArray

from towatlas.solve.fold_seeds import SERIES
from towatlas.tables.critical import FIELDS, INTERPOLANT

Array = NDArray[np.float64]

# Terms along y and x: what is left out is below 1e-8.
TERMS = 64, 80
# Coefficients are whole multiples of this, which leaves little to store; their sum moves by 1e-10.
GRAIN = 2.0**-36


def shortened(series: Mapping[str, Array]) -> Array:
    """Series of what the solver is started from.

    Parameters
    ----------
    series : mapping of ndarray, shape (n, y degree, x degree)
        Those of the atlas, by `towatlas.tables.critical.FIELDS`.

    Returns
    -------
    ndarray, shape (n, 4, y degree, x degree)
        log(a excess) with the offset a = gamma^2 |x_f|, log(gamma sqrt(excess)), log|R_x0|, log z_f.
    """
    fields = series["x_f"] + 2.0 * series["gamma"], series["gamma"], series["R_x0"], series["z_f"]
    return GRAIN * np.round(np.stack(fields, axis=1)[:, :, : TERMS[0], : TERMS[1]] / GRAIN)


def write_series(atlas: Path, path: Path = SERIES) -> None:
    """Shorten the series of an atlas file into the file of the package.

    Parameters
    ----------
    atlas : Path
        As `towatlas build` makes it.
    path : Path
        Where it goes.
    """
    with netCDF4.Dataset(atlas) as file:
        group = file[INTERPOLANT]
        series = shortened({name: np.asarray(group[f"{name}_series"][:], np.float64) for name in FIELDS})
        table: dict[str, Any] = {"excess": [group.excess_min, group.excess_max], "w_f": [0.0, group.w_f_max]}
    table["n"] = np.arange(1, len(series) + 1)
    table |= {f"series_{n}": one for n, one in zip(table["n"], series, strict=True)}
    # What np.savez_compressed makes, but for the time of day.
    with ZipFile(path, "w") as file:
        for name, values in table.items():
            content = BytesIO()
            np.save(content, values)
            file.writestr(ZipInfo(f"{name}.npy"), content.getvalue(), ZIP_DEFLATED)


if __name__ == "__main__":
    write_series(Path(sys.argv[1]))
