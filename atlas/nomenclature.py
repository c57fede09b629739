"""The one table of symbols: what every quantity is called in files, axes and help, and where it is defined."""

from dataclasses import dataclass

REPORT = "NRL Report 7048 (Skop 1970)"


@dataclass(frozen=True)
class Symbol:
    """A quantity: its name in code and files, in words, in TeX, and its source. All are dimensionless (unit 1)."""

    name: str
    long_name: str
    tex: str
    source: str

    @property
    def axis(self) -> str:
        """Label for a plot axis: the words up to the formula, then the symbol."""
        return f"{self.long_name.split(', ')[0]}  {self.tex}"


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
        "radial position of the fish over tow radius, positive on the side of the tow point, at the critical speed",
        "$x_f$",
        f"{REPORT}, Eq. (32)",
    ),
    Symbol(
        "z_f",
        "depth of the fish below the tow point over tow radius, at the critical speed",
        "$z_f$",
        f"{REPORT}, Eq. (31)",
    ),
    Symbol(
        "tension",
        "cable tension T_0 at the tow point over (mu + rho A) g R, at the critical speed",
        "$T_0$",
        f"{REPORT}, Eqs. (20d), (28)",
    ),
    Symbol("error", "estimated relative error of the critical speed gamma", r"$\epsilon$", "towatlas"),
    Symbol("status", "outcome of the computation", "", "towatlas"),
)

SYMBOLS = {symbol.name: symbol for symbol in _TABLE}
