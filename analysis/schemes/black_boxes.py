"""The largest stable step of any system of FMUs: from linear models of each, however had."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import xarray as xr

from railcosim.master.progress import Progress, Tell, foretold, unheard, unsaid

from .limits import LINEARISING, predictable
from .linear_system import linear_system
from .stability import FAILURES, Coupling, Limit
from .usual import PREDICTED


@dataclass(frozen=True, kw_only=True)
class SystemStability:
    """What was predicted of a system.

    Attributes
    ----------
    limits : dict of str to Limit
        By scheme.
    refused : dict of str to str
        Schemes that the system does not allow, and why.
    growth : float
        Rate (1/s) at which something grows if all is coupled exactly; 0 if nothing does.
    ways : dict of str to str
        How each component was linearised.
    doubts : dict of str to str
        Of those whose Co-Simulation does not step as their linear models move: by how much.
    longest : float
        Up to which steps were searched, s.
    """

    limits: dict[str, Limit]
    refused: dict[str, str]
    growth: float
    ways: dict[str, str]
    doubts: dict[str, str]
    longest: float

    def to_dataset(self) -> xr.Dataset:
        """Largest steps by scheme."""
        found = list(self.limits.values())
        table = {
            "step": ([limit.step for limit in found], "s", "largest stable step"),
            "fast": ([limit.fast for limit in found], "s", "largest step without fast growth"),
            "evaluations": ([limit.evaluations for limit in found], "1", "evaluations a step"),
        }
        return xr.Dataset(
            {
                name: ("scheme", np.array(values, dtype=float), {"units": unit, "long_name": text})
                for name, (values, unit, text) in table.items()
            },
            coords={"scheme": list(self.limits)},
            attrs={
                "title": "largest stable step", "growth": self.growth, "longest": self.longest,
                **{f"linearised {name}": way for name, way in self.ways.items()},
                **{f"doubt of {name}": doubt for name, doubt in self.doubts.items()},
            },
        )  # fmt: skip


def system_stability(
    path: str | Path,
    schemes: Sequence[str] = PREDICTED,
    *,
    progress: Progress = unheard,
    tell: Tell = unsaid,
    **found: Any,
) -> SystemStability:
    """Predict the largest stable step of schemes on a system of anybody's FMUs.

    Growth slower than 1e-4 of the rate of the slowest motion counts as none.

    Parameters
    ----------
    path : str or Path
        An SSP file. The code in it is run.
    schemes : sequence of str
        Names of the catalogue, with the system's components for vehicle and track, or how they
        begin.
    progress : callable
        Told what is done and the total.
    tell : callable, optional
        Told how much there is to be done, and how long the rest of it takes.
    **found
        ``law``, ``step``, ``amplitude`` and ``load`` of `linear_system`.

    Raises
    ------
    ArgumentError
        If no scheme is called so.
    FmuError, CouplingError, ComponentError
        If the file or the law is refused, or an FMU cannot be linearised.
    """
    system = linear_system(path, **found, progress=lambda a, b: progress(LINEARISING * a / b, 1.0))
    boxes, known = system.boxes, system.schemes
    limits, refused = dict[str, Limit](), dict[str, str]()
    names = predictable(schemes, known)
    tell(f"{len(names)} searches")
    update = foretold(lambda a, b: progress(LINEARISING + (1 - LINEARISING) * a / b, 1.0), tell)
    for k, name in enumerate(names):
        try:
            limits[name] = Coupling(boxes, known[name].scheme).limit(
                boxes.longest,
                lambda a, b, k=k: update(k + a / b, len(names)),  # type: ignore[misc]
            )
        except (ValueError, *FAILURES) as error:
            refused[name] = str(error)
        update(k + 1, len(names))
    return SystemStability(
        limits=limits, refused=refused, growth=boxes.exact, ways=system.ways,
        doubts=system.doubts, longest=boxes.longest,
    )  # fmt: skip
