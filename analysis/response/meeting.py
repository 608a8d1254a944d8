"""How the wheels of vehicle FMUs meet rails in the frequency domain: on springs, or rolling."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property, partial
from pathlib import Path
from typing import ClassVar, Protocol, TypeAlias

import numpy as np

from railcosim.analysis.pair.contact import Stiffness
from railcosim.analysis.pair.numbering import layouts_of
from railcosim.master.fmi.description import describe_file
from railcosim.mechanics.ports import Layout
from railcosim.parameters import ArgumentError
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.train import Train

from .frequency import Contact
from .models import Models
from .rolling import ON_WHEEL, LinearContacts
from .rolling_pair import compliance_of, matrices_of, rolling_of
from .running import SPEEDS, OnRails, Rolling

STIFFNESS = 1e9  # N/m
Stock: TypeAlias = Vehicle | Train | None


class Meeting(Protocol):
    """What is between wheels and rails, at any speed."""

    @property
    def of_speed(self) -> bool:
        """Whether it depends on the speed."""

    @property
    def about(self) -> dict[str, object]:
        """For the results."""

    def at(self, speed: float) -> Contact:
        """At a speed, m/s."""

    def check(self, speed: float, *, believe: bool) -> bool:
        """Refuse a speed in m/s at which the vehicle hunts; return whether it does.

        Raises
        ------
        ArithmeticError
            If it does: no lateral motion stays small, the message has its critical speed.

        Warns
        -----
        RuntimeWarning
            Instead, if it is to be believed.
        """


@dataclass(frozen=True)
class Pressed:
    """On springs down alone, of one stiffness or of one a wheelset, N/m."""

    stiffness: Stiffness
    of_speed: ClassVar[bool] = False

    @property
    def about(self) -> dict[str, object]:
        """See `Meeting`."""
        return {"contact_stiffness": self.stiffness}

    def at(self, speed: float) -> Contact:
        """See `Meeting`."""
        del speed
        return self.stiffness

    def check(self, speed: float, *, believe: bool) -> bool:
        """See `Meeting`: nothing goes aside."""
        del speed, believe
        return False


@dataclass(frozen=True)
class Rolled:
    """On wheels that roll.

    Attributes
    ----------
    contacts : LinearContacts
        Of all wheels.
    models : Models
        Vehicle and track, which hunt together; on rails that do not move without a track.
    """

    contacts: LinearContacts
    models: Models
    of_speed: ClassVar[bool] = True

    @property
    def about(self) -> dict[str, object]:
        """See `Meeting`."""
        return {"creep": "Kalker, linear; spins as gyroscopes"}

    def at(self, speed: float) -> Contact:
        """See `Meeting`."""
        return self.contacts.at(speed)

    @cached_property
    def pair(self) -> OnRails:
        """What hunts."""
        vehicle, track = self.models.vehicle, self.models.track
        return OnRails(
            Rolling(matrices_of(Path(vehicle.name), vehicle), self.contacts),
            None if track is None else partial(compliance_of, track),
        )

    def check(self, speed: float, *, believe: bool) -> bool:
        """See `Meeting`."""
        pole = self.pair.growing(speed)
        if pole is None:
            return False
        critical = self.pair.critical()
        if np.isnan(critical.speed):  # faster than where it is looked for
            found = f", and not up to {3.6 * SPEEDS[-1]:.0f} km/h"
        elif critical.speed > 0:
            found = f"; it does from {3.6 * critical.speed:.1f} km/h on"
        else:
            found = f"; it does at {3.6 * SPEEDS[0]:g} km/h already"
        text = (
            f"at {3.6 * speed:g} km/h the vehicle hunts, by {pole.real:.3g} 1/s at "
            f"{abs(pole.imag) / (2 * np.pi):.3g} Hz{found}"
        )
        if not believe:
            raise ArithmeticError(
                f"{text}. No lateral motion stays small there, so a response to it means nothing; "
                "take a lower --speed, other parameters, or --believe"
            )
        warnings.warn(
            f"{text}; only motions that nothing moves aside are to be believed", stacklevel=3
        )
        return True


def wheels_of(files: Sequence[Path], contact_stiffness: float | None = None) -> list[Layout]:
    """Wheels of vehicle FMUs, from the front; see `meeting_of`.

    Raises
    ------
    ArgumentError
        If a contact stiffness is given of wheels that roll.
    CouplingError
        If there are none, or they do not fit on one track.
    """
    described = [(file, describe_file(file)) for file in files]
    wheels = layouts_of([(file, [*one.inputs, *one.outputs]) for file, one in described])
    if contact_stiffness is not None and in_space(wheels):
        raise ArgumentError(
            "contact_stiffness", contact_stiffness,
            "is of wheels that meet rails downwards only; these are in space, and roll",
        )  # fmt: skip
    return wheels


def in_space(wheels: Sequence[Layout]) -> bool:
    """Whether wheels meet rails in all directions, so that they roll."""
    return wheels[0].directions == ON_WHEEL


def meeting_of(
    models: Models, files: Sequence[Path], contact_stiffness: float | None, stock: Stock
) -> Meeting:
    """What is between the wheels of vehicle FMUs and rails.

    Parameters
    ----------
    models : Models
        The FMUs, linear.
    files : sequence of Path
        Those of vehicles, from the front.
    contact_stiffness : float, optional
        k_H, N/m, of FMUs that meet downwards only; `STIFFNESS` if not given. Those in space roll.
    stock : Vehicle or Train, optional
        In space: whose wheels roll, as its ``[rolling]`` says, and whose axles turn; as the vehicle
        FMUs tell if not given. The static loads are always those that they tell.

    Raises
    ------
    ArgumentError, CouplingError
        See `wheels_of`, `rolling_of`.
    """
    if in_space(wheels_of(files, contact_stiffness)):
        return Rolled(rolling_of(stock, files, models.vehicle), models)
    return Pressed(STIFFNESS if contact_stiffness is None else contact_stiffness)
