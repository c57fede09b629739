"""What several tests use: shots with named results, random cables, small files, a wet scene, the shell, pages."""

import re
from dataclasses import dataclass
from html.parser import HTMLParser
from typing import Any

import numpy as np

from towatlas.builders.grids import Grid, ScanSettings
from towatlas.cli import main
from towatlas.kernels import steppers
from towatlas.kernels.calls import END_COLUMNS, FOLD_COLUMNS, forward_shots, march
from towatlas.kernels.compiling import opened
from towatlas.kernels.sweeps import march_parallel
from towatlas.limits import threshold_length


@dataclass
class Ends:
    tau: np.ndarray
    f: np.ndarray
    p: np.ndarray
    z: np.ndarray
    v: np.ndarray
    q: np.ndarray
    folds: np.ndarray
    count: np.ndarray
    status: np.ndarray


def shoot(a, mu, tau_end, first_fold=1, last_fold=0, *, max_steps=10**7, parallel=False) -> Ends:
    """March fish-up shots; folds has shape (shots, last_fold - first_fold + 1, 4)."""
    a, mu, tau_end = (np.array(x, float).ravel() for x in np.broadcast_arrays(a, mu, tau_end))
    rows = len(a)
    ends = np.full((rows, END_COLUMNS), np.nan)
    folds = np.full((rows, max(1, last_fold - first_fold + 1), FOLD_COLUMNS), np.nan)
    count = np.zeros(rows, np.int64)
    status = np.full(rows, -1, np.int64)
    orders = np.full(rows, first_fold), np.full(rows, last_fold)
    arguments: tuple[Any, ...] = (a, mu, tau_end, *orders, max_steps, ends, folds, count, status)
    if parallel:
        march_parallel(*arguments)
    else:
        march(*arguments, 0, rows)
    return Ends(*ends.T, folds=folds, count=count, status=status)


def boundary_error(w_f, lam, gamma, r_x0, segments=100) -> np.ndarray:
    """E of forward shots."""
    w_f, lam, gamma, r_x0 = (np.array(x, float).ravel() for x in np.broadcast_arrays(w_f, lam, gamma, r_x0))
    errors, x, force = (np.empty(len(w_f)) for _ in range(3))
    forward_shots(lam, w_f, gamma, r_x0, segments, errors, x, force, 0, len(w_f))
    return errors


def forward_step():
    """Compiled: x and R_x a Runge-Kutta step of `ds` further down, from where the weight below is `below`."""
    step = opened(steppers.rk4_forward)

    def further(x, force, below, gamma2, ds):
        work = np.zeros(steppers.FORWARD_WORK)
        given = {"X": x, "FORCE": force, "FISH": below - ds, "GAMMA2": gamma2, "DS": ds}
        for name, value in given.items():
            place = getattr(steppers, name)
            work[place : place + steppers.FORWARD_LANES] = value
        step(work, 1.0)
        return work[steppers.X], work[steppers.FORCE]

    return further


def random_cables(rows, seed, n_max=6, excess=(1e-3, 1e3), w_f_max=1e4):
    """Random n, w_f (a tenth of them zero), lam over the domain of the atlas, uniform in the logarithms."""
    rng = np.random.default_rng(seed)
    n = rng.integers(1, n_max + 1, rows)
    w_f = np.where(rng.random(rows) < 0.1, 0.0, 10.0 ** rng.uniform(-5, np.log10(w_f_max), rows))
    excess = 10.0 ** rng.uniform(*np.log10(excess), rows)
    return n, w_f, threshold_length(w_f, n) + excess


def root_near(w_f, lam, gamma, guess, segments=100):
    """Root of E(R_x0) near a guess, by secants."""
    low, high = guess * (1 - 1e-7), guess * (1 + 1e-7)
    e_low, e_high = boundary_error(w_f, lam, gamma, [low, high], segments)
    for _ in range(20):
        if e_high == e_low or abs(high - low) < 1e-15 * abs(high):
            break
        low, high = high, high - e_high * (high - low) / (e_high - e_low)
        e_low, e_high = e_high, boundary_error(w_f, lam, gamma, high, segments)[0]
    return high


# A file made in a second.
SMALL_GRID = Grid(
    n_max=2, series_w_f=6, series_excess=8, error_blocks=2, w_f=np.array([0.0, 1.0]), lam=np.array([3.0, 9.0])
)
SMALL_SCAN = ScanSettings(speeds=40, guesses=64, w_f=np.array([1.0]), lam=np.array([5.0]), n_max=2)


def run(capsys, *arguments):
    try:
        code = main([str(a) for a in arguments])
    except SystemExit as exit_:
        code = exit_.code
    captured = capsys.readouterr()
    return code, captured.out, captured.err


WET = {
    "cable": {"length": 150, "mass_per_length": 0.5, "diameter": 0.012, "drag_coefficient": 1.4},
    "fish": {"mass": 60, "volume": 0.02, "added_mass": 10, "drag_coefficient": 0.8, "frontal_area": 0.05},
    "tow": {"radius": 40, "speed": 2.0},
    "fluid": {"density": 1025},
}


def changed(**changes):
    """The wet scene with keys "section__key" set, or removed where None, or a whole section."""
    table = {section: dict(keys) for section, keys in WET.items()}
    for name, value in changes.items():
        section, _, key = name.partition("__")
        holder = table.setdefault(section, {}) if key else table
        if value is None:
            del holder[key or section]
        else:
            holder[key or section] = value
    return table


VOID = {"meta", "link", "br", "img", "hr", "input"}


class Page(HTMLParser):
    """Checks nesting; collects ids, references, and the text of every cell of every table and of every paragraph."""

    def __init__(self, text):
        super().__init__()
        self.open, self.ids, self.references, self.rows, self.text = [], [], [], [], []
        self.feed(text)
        assert self.open == []

    def handle_starttag(self, tag, attrs):
        if tag not in VOID:
            self.open.append(tag)
        if tag == "tr":
            self.rows.append([])
        if tag in ("td", "th"):
            self.rows[-1].append("")
        if tag == "sub" and {"td", "th"} & set(self.open):
            self.rows[-1][-1] += "_"
        for name, value in attrs:
            if name == "id":
                self.ids.append(value)
            elif name in ("href", "xlink:href", "src"):
                self.references.append(value)
            if "url(" in (value or ""):
                self.references.append(re.search(r"url\((.*?)\)", value)[1])

    def handle_startendtag(self, tag, attrs):
        self.handle_starttag(tag, attrs)
        if tag not in VOID:
            self.open.pop()

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text.append(data)
        if "td" in self.open or "th" in self.open:
            self.rows[-1][-1] += data


def check_stands_alone(page):
    """The page parsed: well nested, every reference within it, nothing from elsewhere, every symbol filled in."""
    parsed = Page(page)
    assert len(parsed.ids) == len(set(parsed.ids))
    assert {reference.removeprefix("#") for reference in parsed.references} <= set(parsed.ids)
    elsewhere = re.sub(r'xmlns(:\w+)?="[^"]*"', "", page)
    for word in ("http:", "https:", "file:", "data:", "src=", "<link", "<script", "@import", "$"):
        assert word not in elsewhere, word
    return parsed
