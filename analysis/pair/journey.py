"""How a vehicle meets the track: speed, irregularity, defects, and where it begins."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass

from numpy.typing import ArrayLike

from railcosim.fmus.stepping_variables import LEAST_SPEED
from railcosim.master.component import FloatArray
from railcosim.mechanics.ports import Direction
from railcosim.parameters import ArgumentError, UnusualWarning
from railcosim.track.irregularity import Profile
from railcosim.track.irregularity.defects import Defect
from railcosim.track.irregularity.met import Wheels, depths, meetings
from railcosim.track.travel import Steady, Travel

from .standing import Position

STEPS = 10
"""Over a defect, at least: a wheel flat's force is then wrong by 3 %, with 36 steps by 0.2 %."""


@dataclass(frozen=True, kw_only=True)
class Journey:
    """How the vehicle meets the track.

    Attributes
    ----------
    speed : float
        m/s; at the beginning.
    held : bool
        True: wheels stay where they are and the irregularity moves; False: wheels roll.
    profile : Profile
        Irregularity.
    position : float or sequence of float, optional
        Where the last wheelset (of each vehicle) stands at first, m; as the FMU has it if None.
    defects : tuple of Defect
        Of single places of the rails, and of wheels.
    travel : Travel, optional
        How the speed changes; None: it does not.
    """

    speed: float
    held: bool
    profile: Profile
    position: Position = None
    defects: tuple[Defect, ...] = ()
    travel: Travel | None = None

    @property
    def way(self) -> Travel:
        """How far it comes."""
        return self.travel or Steady(self.speed)

    def under(
        self, wheels: Wheels, directions: Sequence[Direction]
    ) -> Callable[[ArrayLike], FloatArray]:
        """Surface under wheels, irregularity and defects; see `Profile.under`.

        Parameters
        ----------
        wheels : Wheels
            Where they are at first.
        directions : sequence of Direction
            In which the surface is asked for.

        Raises
        ------
        ArgumentError
            See `meetings`.
        """
        way = self.way
        lies = self.profile.under(wheels.start, way, directions)
        if not self.defects:
            return lies
        added = depths(meetings(self.defects, wheels), wheels.start.size, directions)
        return lambda t: lies(t) + added(way.gone(t))

    def check(self, stop: float) -> None:
        """Raise ParameterError if speed or irregularity ends before a run of that time (s) does."""
        self.way.check_covers(stop)
        self.profile.check_covers(float(self.way.gone(stop)))

    def check_dimension(self, *, aside: bool) -> None:
        """Raise ArgumentError for wheels that creep and stand, at any time."""
        way = self.way
        if aside and way.slowest < LEAST_SPEED:
            slowest = f", at the slowest {3.6 * way.slowest:g} km/h" if way.changes else ""
            raise ArgumentError(
                "speed", f"{way.name}{slowest}", f"must be at least {3.6 * LEAST_SPEED:g} km/h in "
                "space: standing wheels do not creep, they hold; end the run before they stand, or "
                "make it vertical",
            )  # fmt: skip

    def check_defects(self, wheels: Wheels, step: float, stop: float) -> None:
        """Raise ArgumentError if no wheel meets a defect; warn if steps (s) are too long for one.

        Warns
        -----
        UnusualWarning
            If less than `STEPS` of them fit on one.
        """
        gone = float(self.way.gone(stop))
        rear, front = float(wheels.start.min()), float(wheels.start.max())
        for defect in self.defects:
            if not any(one.met_within(gone) for one in meetings([defect], wheels)):
                raise ArgumentError(
                    "defect", defect, f"no wheel comes to it within {gone:g} m from where they "
                    f"stand at first, {rear:g} to {front:g} m",
                )  # fmt: skip
            longest = defect.shortest / STEPS
            if step * self.way.fastest > longest:
                warnings.warn(
                    f"--defect {defect}: a step of {step:g} s is {step * self.way.fastest:.3g} m, "
                    f"and the defect {defect.shortest:g} m; take --step "
                    f"{longest / self.way.fastest:.1g} or less",
                    UnusualWarning,
                    stacklevel=3,
                )
