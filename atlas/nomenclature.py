"""The one table of symbols: what every quantity is called in files, axes and help, and where it is defined."""

from dataclasses import dataclass, replace

REPORT = "NRL Report 7048 (Skop 1970)"
# The method of a file that holds a table of equilibria.
EQUILIBRIA = "equilibria"


@dataclass(frozen=True)
class Symbol:
    """A quantity, dimensionless (unit 1).

    Attributes
    ----------
    name : str
        In code and files.
    long_name : str
        In words.
    tex : str
        The symbol.
    source : str
        Where it is defined.
    """

    name: str
    long_name: str
    tex: str
    source: str

    @property
    def axis(self) -> str:
        """Label for a plot axis: the words up to the formula, then the symbol."""
        words = self.long_name.split(", ")[0].replace("(mu + rho A) g R", r"$(\mu + \rho A)\, g R$")
        return f"{words}  {self.tex}"


_AT_FOLD = ", at the critical speed"

_TABLE = (
    Symbol("n", "number of the transition", "$n$", REPORT),
    Symbol("w_f", "fish weight over (mu + rho A) g R", "$w_f$", f"{REPORT}, Eq. (16a)"),
    Symbol("lam", "cable length over tow radius, lambda = L/R", r"$\lambda = L/R$", f"{REPORT}, Eq. (17)"),
    Symbol("excess", "cable length beyond the threshold", r"$\lambda - \lambda_{cn}$", f"{REPORT}, Eq. (36)"),
    Symbol(
        "lambda_c",
        "threshold length of the n-th transition",
        r"$\lambda_{cn}$",
        f"{REPORT}, Eq. (36) for n = 1; 2 (n - 1) longer for n",
    ),
    Symbol(
        "gamma",
        "critical speed, gamma = Omega sqrt(R/g)",
        r"$\gamma_{cn} = \Omega_{cn}\sqrt{R/g}$",
        f"{REPORT}, Eqs. (13b), (24)",
    ),
    Symbol(
        "R_x0",
        "radial force of the cable at the tow point over (mu + rho A) g R, positive where it leaves outwards, "
        "at the critical speed",
        "$R_{x0}^{cn}$",
        f"{REPORT}, Eq. (26)",
    ),
    Symbol(
        "x_f",
        "radial position of the fish over tow radius, positive on the side of the tow point" + _AT_FOLD,
        "$x_f$",
        f"{REPORT}, Eq. (32)",
    ),
    Symbol(
        "z_f",
        "depth of the fish below the tow point over tow radius" + _AT_FOLD,
        "$z_f$",
        f"{REPORT}, Eq. (31)",
    ),
    Symbol(
        "tension",
        "cable tension T_0 at the tow point over (mu + rho A) g R" + _AT_FOLD,
        "$T_0$",
        f"{REPORT}, Eqs. (20d), (28)",
    ),
    Symbol("error", "estimated relative error of the critical speed gamma", r"$\epsilon$", "towatlas"),
    Symbol("status", "outcome of the computation", "", "towatlas"),
)

SYMBOLS = {symbol.name: symbol for symbol in _TABLE}

_ONE_STATE = (
    Symbol("gamma", "speed, gamma = Omega sqrt(R/g)", r"$\gamma = \Omega\sqrt{R/g}$", f"{REPORT}, Eq. (13b)"),
    replace(SYMBOLS["R_x0"], long_name=SYMBOLS["R_x0"].long_name.removesuffix(_AT_FOLD), tex="$R_{x0}$"),
    Symbol(
        "boundary_error",
        "boundary error at the fish over (mu + rho A) g R, of a forward shot",
        r"$E(\lambda)$",
        f"{REPORT}, Eq. (33)",
    ),
    Symbol("nodes", "number of nodes, points of the cable on the axis", "", REPORT),
    Symbol("count", "number of equilibria", "", REPORT),
    Symbol("error", "estimated relative error of x_f", r"$\epsilon$", "towatlas"),
    Symbol("s", "arc length from the tow point over tow radius", "$s$", f"{REPORT}, nondimensional S"),
    Symbol(
        "x",
        "radial position over tow radius, positive on the side of the tow point",
        "$x$",
        f"{REPORT}, Eq. (32a)",
    ),
    Symbol(
        "y",
        "position along the way of the tow point over tow radius, positive ahead of it",
        "$y$",
        f"{REPORT}, Eq. (12)",
    ),
    Symbol("z", "depth below the tow point over tow radius", "$z$", f"{REPORT}, Eq. (31)"),
    Symbol("R_x", "radial force of the cable over (mu + rho A) g R", "$R_x$", f"{REPORT}, Eq. (32b)"),
    Symbol(
        "R_y", "force of the cable along the way of the tow point over (mu + rho A) g R", "$R_y$", f"{REPORT}, Eq. (20)"
    ),
    Symbol("R_z", "vertical force of the cable over (mu + rho A) g R", "$R_z$", f"{REPORT}, Eq. (28)"),
    Symbol("T", "cable tension over (mu + rho A) g R", "$T$", f"{REPORT}, Eq. (20d)"),
)

# The same quantities of any equilibrium, not of a critical state.
EQUILIBRIUM = {
    name: replace(symbol, long_name=symbol.long_name.removesuffix(_AT_FOLD)) for name, symbol in SYMBOLS.items()
} | {symbol.name: symbol for symbol in _ONE_STATE}

_FOLDS_WITH_DRAG = (
    Symbol("C", "drag constant of the cable, (1/2) rho C_D d R / (mu + rho A)", "$C$", f"{REPORT}, Eq. (13c)"),
    Symbol("C_cusp", "drag constant above which the n-th pair of equilibria never appears", "$C^*_n$", "towatlas"),
    Symbol("appears", "speed at which the n-th pair of equilibria appears", r"$\gamma_{cn}(C)$", "towatlas"),
    Symbol("ends", "speed at which the outer member of the n-th pair is gone", r"$\gamma_{en}(C)$", "towatlas"),
    Symbol("again", "speed at which the n-th pair, having ended, appears again", r"$\gamma_{an}(C)$", "towatlas"),
)
DRAG = SYMBOLS | {symbol.name: symbol for symbol in _FOLDS_WITH_DRAG}
