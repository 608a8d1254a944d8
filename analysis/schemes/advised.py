"""The longest step of a scheme that is exact and stable enough, and the cheapest of several."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
import xarray as xr

from railcosim.analysis.pair.owner import Owner
from railcosim.master.component import FloatArray
from railcosim.parameters import ArgumentError

from .stability import Coupling

FINEST = 1e-12  # accuracy: below it is rounding
ROUND = np.array([1.0, 1.2, 1.5, 2.0, 2.5, 3.0, 4.0, 5.0, 6.0, 8.0])
"""Steps of a decade that are tried."""
STEPS: FloatArray = np.sort(np.outer(10.0 ** np.arange(-5, -2), ROUND).ravel())
"""Steps that are tried of a pair, s: round numbers up to 8 ms."""
MARGIN, REACH = 1.1, 2.0
"""Parts of the step advised up to which nothing may grow, and up to which that is looked for."""


class SchemeError(Protocol):
    """How the error of a scheme is predicted: `ForceError` or `MotionError`."""

    def of(self, coupling: Coupling, h: float) -> float:
        """With steps of `h` (s), relative; infinite if the scheme cannot make such a step."""


@dataclass(frozen=True, kw_only=True)
class Option:
    """One way to couple that reaches the accuracy.

    Attributes
    ----------
    scheme : str
        Name in the catalogue.
    owner : Owner or None
        Of the contact springs; None of a system that says so itself.
    step : float
        The longest of the steps tried that does, `MARGIN` below the first unstable one, s.
    limit : float
        Largest stable step, s; infinite if nothing grows up to `REACH` times the step.
    evaluations : int
        How often each component is stepped in a step.
    error : float
        Predicted, relative: of a pair the RMS of the contact forces' over that of their dynamic
        part, of a system see `MotionError`.
    errors : array, shape (n_tried,)
        The same over all steps tried; NaN for the others.
    """

    scheme: str
    owner: Owner | None
    step: float
    limit: float
    evaluations: int
    error: float
    errors: FloatArray

    @property
    def name(self) -> str:
        """Scheme and owner, in words."""
        return self.scheme if self.owner is None else f"{self.scheme}, contact in {self.owner}"

    @property
    def cost(self) -> float:
        """Evaluations of each component a second of time simulated."""
        return self.evaluations / self.step


@dataclass(frozen=True, kw_only=True)
class Advice:
    """What reaches an accuracy.

    Attributes
    ----------
    options : list of Option
        Cheapest first; at least one.
    tried : array, shape (n_tried,)
        Steps, s.
    growth : float
        Rate (1/s) at which something grows if all is coupled exactly; negative or zero if nothing
        does.
    about : mapping of str to float or str
        What was asked for: ``accuracy``, and of what; and doubts.
    """

    options: list[Option]
    tried: FloatArray
    growth: float
    about: Mapping[str, Any]

    def to_dataset(self) -> xr.Dataset:
        """Columns over the options, cheapest first."""
        return _dataset(self)


def cheapest_first(
    options: Sequence[Option], tried: FloatArray, growth: float, about: Mapping[str, Any]
) -> Advice:
    """Put options in order; ArgumentError if there are none."""
    if not options:
        raise ArgumentError(
            "accuracy", about["accuracy"],
            f"no scheme reaches it with steps of {tried[0]:.3g} s or more; ask for less, or for "
            "other --schemes",
        )  # fmt: skip
    found = sorted(options, key=lambda option: option.cost)
    return Advice(options=found, tried=tried, growth=growth, about=about)


def check_accuracy(accuracy: float) -> None:
    """Raise ArgumentError if no scheme could have it."""
    if not FINEST <= accuracy < 1.0:
        must = f"must be from {FINEST:g} to below 1, such as 1e-3"
        raise ArgumentError("accuracy", accuracy, must)


def longest_step(
    name: str,
    owner: Owner | None,
    coupling: Coupling,
    accuracy: float,
    error: SchemeError,
    steps: FloatArray = STEPS,
) -> Option | None:
    """Find the longest of some steps that is exact and stable enough, or None.

    Parameters
    ----------
    name : str
        Of the scheme.
    owner : Owner or None
        Of the contact springs.
    coupling : Coupling
        The scheme at the contact.
    accuracy : float
        Largest error allowed.
    error : SchemeError
        Of the same.
    steps : array, optional
        That are tried, s, increasing.
    """
    errors, limit = np.full(len(steps), np.nan), math.inf
    for j in range(len(steps))[::-1]:
        h = float(steps[j])
        if MARGIN * h > limit:
            continue
        errors[j] = error.of(coupling, h)
        if errors[j] > accuracy or not coupling.is_stable(h):
            continue
        # Stable between unstable steps is no advice, nor is a step just below one: another FMU
        # may shift it.
        limit = coupling.limit(REACH * h).step
        if MARGIN * h <= limit:
            return Option(
                scheme=name, owner=owner, step=h, limit=limit, error=float(errors[j]),
                errors=errors, evaluations=coupling.evaluations,
            )  # fmt: skip
    return None


def _dataset(advice: Advice) -> xr.Dataset:
    found = advice.options
    columns = {
        "step": ([o.step for o in found], "s", "longest step that reaches the accuracy"),
        "evaluations": ([o.evaluations for o in found], "1", "evaluations a step"),
        "cost": ([o.cost for o in found], "1/s", "evaluations a second of time simulated"),
        "error": ([o.error for o in found], "1", "predicted relative error"),
        "stable_to": (
            [o.limit for o in found],
            "s",
            "largest stable step; infinite beyond twice the step",
        ),
    }
    variables: dict[str, Any] = {
        name: ("option", np.array(values, dtype=float), {"units": unit, "long_name": text})
        for name, (values, unit, text) in columns.items()
    }
    variables["errors"] = (
        ("option", "tried"),
        np.array([o.errors for o in found]),
        {"units": "1", "long_name": "predicted relative error at the steps tried"},
    )
    return xr.Dataset(
        variables,
        coords={
            "option": [o.name for o in found],
            "tried": ("tried", advice.tried, {"units": "s", "long_name": "step"}),
        },
        attrs=dict(advice.about),
    )
