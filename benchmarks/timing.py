"""Clocks, the machine, and what an error column says."""

import importlib.metadata
import platform
import re
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

# An answer further off than this, over the local amplitude (shots) or relatively (folds, lookup), is no answer.
LOST = 1e-2
PACKAGES = ("numpy", "numba", "scipy", "heyoka", "CyRK", "moordyn", "xarray")


@dataclass(frozen=True)
class Row:
    """One method at one setting: its errors, its failures, its time."""

    method: str
    setting: str
    samples: int
    errors: dict[str, NDArray[np.float64]]
    microseconds: float
    failures: str = ""

    def columns(self, unit: float) -> dict[str, str]:
        """Cells of a CSV row; `unit` is the time that ratios are over."""
        cells = {"method": self.method, "setting": self.setting, "samples": str(self.samples)}
        for name, errors in self.errors.items():
            found = errors[np.isfinite(errors)]
            for label, share in (("median", 0.5), ("p99", 0.99), ("max", 1.0)):
                cells[f"{name}_{label}"] = f"{np.quantile(found, share):.2e}" if len(found) else "nan"
        cells |= {"failure_rate": f"{self.failure_rate:.3g}", "failures": self.failures}
        return cells | {"microseconds": f"{self.microseconds:.4g}", "ratio": f"{self.microseconds / unit:.4g}"}

    @property
    def failure_rate(self) -> float:
        """Share of the samples that got no answer, or a lost one."""
        return float(np.mean(~(next(iter(self.errors.values())) <= LOST)))

    def quantile(self, name: str, share: float) -> float:
        """Of the errors of the answers that there are."""
        found = self.errors[name][np.isfinite(self.errors[name])]
        return float(np.quantile(found, share)) if len(found) else float("nan")


def seconds(function: Callable[[], object], repeats: int = 5) -> float:
    """Median time of a call, after one that is not counted."""
    function()
    return float(np.median([once(function) for _ in range(repeats)]))


def once(function: Callable[[], object]) -> float:
    """Time of one call."""
    start = time.perf_counter()
    function()
    return time.perf_counter() - start


def processor() -> str:
    """Name of the processor, its family and model: the name alone may be that of many."""
    info = Path("/proc/cpuinfo")
    if not info.exists():
        return platform.processor() or platform.machine()
    text = info.read_text()
    name, family, model = (
        match[1] if (match := re.search(rf"^{key}\s*: (.*)", text, re.M)) else "?"
        for key in ("model name", "cpu family", "model")
    )
    return f"{name} (family {family}, model {model})"


def versions() -> str:
    """Python and the packages measured, those installed."""
    found = [f"Python {platform.python_version()}"]
    for name in PACKAGES:
        try:
            found.append(f"{name} {importlib.metadata.version(name)}")
        except importlib.metadata.PackageNotFoundError:
            found.append(f"{name} not installed")
    return ", ".join(found)


def readable(value: float) -> str:
    """A time in s, ms, us or ns."""
    unit, size = next((u for u in (("s", 1.0), ("ms", 1e-3), ("us", 1e-6)) if value >= u[1]), ("ns", 1e-9))
    return f"{value / size:.0f} {unit}" if value >= 10 * size else f"{value / size:.2g} {unit}"
