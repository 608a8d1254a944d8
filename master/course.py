"""How a run goes: its scheme, steps and span, and what is kept of it."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple

from railcosim.master.checkpoint import Checkpoints
from railcosim.master.cosimulation import LIMIT
from railcosim.master.memory import TooLargeError
from railcosim.master.pace import FixedStep, Pace
from railcosim.master.schemes import Scheme
from railcosim.master.step_control import StepControl


@dataclass(frozen=True, kw_only=True)
class Keeping:
    """What is kept of a run beyond its outputs.

    Attributes
    ----------
    checkpoints : Checkpoints or None
        Where and how often the run is written, so that it can be resumed.
    resume : Path or None
        The checkpoint that the run goes on from.
    energy : bool
        Whether the energy is recorded that the coupling creates at every interface.
    """

    checkpoints: Checkpoints | None = None
    resume: Path | None = None
    energy: bool = False

    def __post_init__(self) -> None:
        if self.energy and (self.checkpoints or self.resume):
            raise ValueError(
                "the energy of the interfaces is not kept in checkpoints: leave it out"
            )


OUTPUTS_ONLY = Keeping()
MOST_STEPS = 10**9  # a day and a night of computing where a step is 0.1 ms
SHORTEST = 1e-4  # of the longest step: below it, no coupling of ours has gained anything


def count_steps(start: float, stop: float, step: float) -> int:
    """How many communication steps of `step` (s) lead from `start` to `stop` (s).

    Raises
    ------
    TooLargeError
        If the time does not move on by a step, one step is longer than all, or they are more than
        `MOST_STEPS`.
    """
    span = stop - start
    if step > (1 + 1e-9) * span:  # a whole run of one step may be rounded
        raise TooLargeError(f"a step of {step:g} s is longer than the run of {span:g} s")
    if span / step > MOST_STEPS or stop - step == stop:
        raise TooLargeError(
            f"from {start:g} to {stop:g} s there are {span / step:.3g} steps of {step:g} s; at "
            f"most {MOST_STEPS:.0e} are run, and a step must move the time on: take a longer step "
            "or less time"
        )
    return math.ceil(span / step)


class Told(NamedTuple):
    """What FMUs are told of a run: see `LoadedFmu.enter_initialization`."""

    start: float = 0.0
    stop: float | None = None
    tolerance: float | None = None


ALL_TIME = Told()
"""From 0 s on, with no end."""


@dataclass(frozen=True, kw_only=True)
class Course:
    """How a system is taken through time.

    Attributes
    ----------
    scheme : Scheme
        How it is coupled.
    step : float
        Communication step, s; the longest one if there is a tolerance.
    start, stop : float
        s.
    tolerance : float or None
        Relative and absolute error (in nominal values) that steps are chosen for; None for
        steps of one length.
    tolerance_fmu : float or None
        Relative error that FMUs are asked to keep; None for that of their default experiments.
    limit : float
        Largest output, in its nominal values, that does not count as divergence.
    keeping : Keeping
        What is kept beyond outputs.
    repeats : bool
        Whether a part of another run is made once more.
    """

    scheme: Scheme
    step: float
    stop: float
    start: float = 0.0
    tolerance: float | None = None
    tolerance_fmu: float | None = None
    limit: float = LIMIT
    keeping: Keeping = OUTPUTS_ONLY
    repeats: bool = False

    def __post_init__(self) -> None:
        count_steps(self.start, self.stop, self.step)

    def again(self, factor: int, until: float) -> Course:
        """The same until another end (s), with steps that are so many times shorter.

        Steps that are chosen are so for a smaller tolerance. Nothing is kept but the outputs.
        """
        tolerance = None if self.tolerance is None else self.tolerance / factor
        return replace(
            self, step=self.step / factor, stop=until, tolerance=tolerance, keeping=OUTPUTS_ONLY,
            repeats=True,
        )  # fmt: skip

    @property
    def told(self) -> Told:
        """What FMUs are told of it."""
        return Told(self.start, self.pace.reach(self.start, self.stop), self.tolerance_fmu)

    @property
    def pace(self) -> Pace:
        """The rule for the steps."""
        if self.tolerance is None:
            return FixedStep(self.step)
        return StepControl(
            order=self.scheme.order,
            relative=self.tolerance,
            absolute=self.tolerance,
            largest=self.step,
            smallest=SHORTEST * self.step,
        )
