"""CF attributes: what the variables and files of towatlas say of themselves, as xarray datasets.

Root of an atlas: the plain table on the grid (n, w_f, lam). Group support/interpolant: Chebyshev series for lookup.
Group support/witness: critical speeds of some cables by an independent method.
"""

from typing import Any

import numpy as np
import xarray as xr
from numpy.typing import NDArray

from towatlas.kernels.status import FLAG_MEANINGS, SENTENCES
from towatlas.nomenclature import EQUILIBRIA, EQUILIBRIUM, REPORT, SYMBOLS, Symbol

# Beside INTERPOLANT in one group: compliance-checker 6.1 stops with an error at files that have two at the top.
WITNESS = "support/witness"


def symbol_attributes(name: str, symbols: dict[str, Symbol] = SYMBOLS) -> dict[str, Any]:
    """CF attributes of a quantity of the nomenclature.

    Parameters
    ----------
    name : str
    symbols : dict of Symbol
        In which it is looked up.

    Returns
    -------
    dict
    """
    symbol = symbols[name]
    attributes: dict[str, Any] = {"long_name": symbol.long_name, "references": symbol.source}
    if name == "status":
        attributes |= {"flag_values": np.array(sorted(SENTENCES), np.int8), "flag_meanings": FLAG_MEANINGS}
    else:
        attributes["units"] = "1"
    return attributes


def variable(dims: tuple[str, ...], name: str, data: NDArray[Any], **attributes: Any) -> xr.Variable:
    """A variable with the CF attributes of a quantity.

    Parameters
    ----------
    dims : tuple of str
    name : str
        Of the quantity, in `nomenclature.SYMBOLS`.
    data : ndarray
    **attributes : object
        Others.

    Returns
    -------
    xarray.Variable
    """
    if name == "n":
        data = np.asarray(data, np.int32)
    return xr.Variable(dims, data, symbol_attributes(name) | attributes)


def equilibrium_variable(dims: tuple[str, ...], name: str, data: NDArray[Any], **attributes: Any) -> xr.Variable:
    """The same for a quantity of any equilibrium.

    Parameters
    ----------
    dims : tuple of str
    name : str
        Of the quantity, in `nomenclature.EQUILIBRIUM`.
    data : ndarray
    **attributes : object
        Others.

    Returns
    -------
    xarray.Variable
    """
    return xr.Variable(dims, data, symbol_attributes(name, EQUILIBRIUM) | attributes)


def with_units(known: xr.Variable, tow_radius: float, force: float) -> xr.Variable:
    """A length or a force of the nomenclature in SI; what is neither stays as it is.

    Parameters
    ----------
    known : xarray.Variable
        With the attributes of `equilibrium_variable`.
    tow_radius, force : float
        What lengths [m] and forces [N] are divided by, > 0.

    Returns
    -------
    xarray.Variable
    """
    words = known.attrs["long_name"]
    for over, unit, scale in ((" over tow radius", "m", tow_radius), (" over (mu + rho A) g R", "N", force)):
        if over in words:
            attributes = known.attrs | {"long_name": words.replace(over, ""), "units": unit}
            return xr.Variable(known.dims, known.values * scale, attributes)
    return known


def plain_table(
    *,
    n: NDArray[np.int64],
    lam: NDArray[np.float64],
    w_f: NDArray[np.float64],
    lambda_c: NDArray[np.float64],
    table: dict[str, NDArray[Any]],
) -> xr.Dataset:
    """The root of the file: every quantity on the grid (n, w_f, lam), each in its own variable.

    Parameters
    ----------
    n : ndarray of int, shape (n,)
    w_f, lam : ndarray, shape (w_f,), (lam,)
        The axes.
    lambda_c : ndarray, shape (n, w_f)
    table : dict of ndarray, shape (n, w_f, lam)
        The quantities; gamma and R_x0 are stored as gamma_c and R_x0_c.

    Returns
    -------
    xarray.Dataset
    """
    dims = ("n", "w_f", "lam")
    renamed = {"gamma": "gamma_c", "R_x0": "R_x0_c"}
    variables = {
        renamed.get(name, name): variable(dims, name, data)
        if name == "status"
        else variable(dims, name, data, ancillary_variables="error status" if name == "gamma" else "status")
        for name, data in table.items()
    }
    variables["lambda_c"] = variable(("n", "w_f"), "lambda_c", lambda_c)
    return xr.Dataset(
        variables,
        {
            "n": variable(("n",), "n", n),
            "w_f": variable(("w_f",), "w_f", w_f),
            "lam": variable(("lam",), "lam", lam),
        },
    )


def _attributes(title: str, source: str, comment: str, method: str, extra: dict[str, Any]) -> dict[str, Any]:
    return {
        "Conventions": "CF-1.11",
        "title": title,
        "institution": "towatlas",
        "source": source,
        "references": f"{REPORT}, On the Shape of a Cable Towed in a Circular Path",
        "comment": comment,
        "method": method,
        **extra,
    }


def root_attributes(method: str, extra: dict[str, Any]) -> dict[str, Any]:
    """Global attributes that say what the file is.

    Parameters
    ----------
    method : str
    extra : dict
        Others.

    Returns
    -------
    dict
    """
    return _attributes(
        "Critical speeds of a cable towed in a circle, in a vacuum",
        f"towatlas, method {method}",
        "gamma_c[n, w_f, lam] is the speed Omega sqrt(R/g) at which the n-th pair of equilibria appears; "
        "missing where lam <= lambda_c = 2 n - 1 + sqrt(1 + w_f^2) - w_f (status no_transition), and where another "
        "status says why. All quantities are dimensionless: lengths over the tow radius R, forces over "
        "(mu + rho A) g R, with mu the mass of the cable and rho A that of the fluid it displaces, per unit length, "
        "g gravity and Omega the rotation of the tow point. At the tow point x = 1, outwards positive; z is positive "
        "downwards from it. Between grid points interpolate logarithms in log(lam - lambda_c) and log(w_f).",
        method,
        extra,
    )


def equilibria_attributes(extra: dict[str, Any]) -> dict[str, Any]:
    """Global attributes of a table of equilibria.

    Parameters
    ----------
    extra : dict
        Others.

    Returns
    -------
    dict
    """
    return _attributes(
        "Equilibria of a cable towed in a circle, in a vacuum",
        "towatlas, equilibria by the count of zeros of the first variation",
        "Of the 2 k + 1 equilibria of a cable, k the number of its critical speeds below gamma, two are "
        "tabulated: the median one, with k nodes, that the report expects to be seen, and the one without nodes that "
        "swings outward. They are one until the first critical speed. The median branch jumps at every critical "
        "speed, where nodes changes: do not interpolate between points of different nodes. All quantities are "
        "dimensionless: lengths over the tow radius R, forces over (mu + rho A) g R.",
        EQUILIBRIA,
        extra,
    )


def shape_attributes(facts: dict[str, Any]) -> dict[str, Any]:
    """Global attributes of the shape of one equilibrium.

    Parameters
    ----------
    facts : dict
        Others.

    Returns
    -------
    dict
    """
    return _attributes(
        "Shape of a cable towed in a circle",
        "towatlas, shots from the fish up",
        "Dimensionless: lengths over the tow radius R, forces over (mu + rho A) g R. At the tow point "
        "s = 0, x = 1, y = 0, z = 0, which moves along y; the fish is at s = lam. s_node and z_node are where x "
        "changes sign. error is the estimated relative error of the distance of the fish from the axis.",
        "shape",
        facts,
    )


def scene_shape_attributes(facts: dict[str, Any]) -> dict[str, Any]:
    """Global attributes of the shape of one equilibrium of a scene; texts that are empty are left out.

    Parameters
    ----------
    facts : dict
        Others.

    Returns
    -------
    dict
    """
    return _attributes(
        "Shape of a cable towed in a circle, in SI",
        "towatlas, shots from the fish up",
        "At the tow point s = 0, x is the tow radius, y = 0, z = 0; x points away from the axis, z downwards; the tow "
        "point moves along y in a turn to starboard, against it in one to port. s_node and z_node are where x changes "
        "sign. Attributes that end in _m are in metres, _N in newtons, _m_s in metres a second; lam to b_s are the "
        "groups of the model, dimensionless. error is the estimated relative error of the distance of the fish from "
        "the axis.",
        "shape",
        {name: value for name, value in facts.items() if not isinstance(value, str) or value},
    )
