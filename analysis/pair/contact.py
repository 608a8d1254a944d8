"""The contact of wheel and rail: its numbers, made once for a pair, and its law in the master.

Whoever owns the contact, FMU, master or reference, is given the same complete parameters:
``contact.nonlinear``, and ``contact.hertz_coefficient`` or ``contact.stiffness``. What is not given
is the vehicle's, whose wheels they are.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path

from railcosim.master.component import Variable
from railcosim.master.connections import CouplingError
from railcosim.master.fmi.loaded_fmu import LoadedFmu
from railcosim.master.law import Law
from railcosim.mechanics.law import (
    HertzContact,
    LinearContact,
    NormalLaw,
    coefficient_for,
    tangent_stiffness,
)
from railcosim.mechanics.ports import FORCE, MOST_WHEELSETS, Layout

LAYOUT = Layout()
WHEELSETS, WHEELS, FORCES = LAYOUT.axles, LAYOUT.wheels, LAYOUT.names(FORCE)
"""Of the paper's vehicle. What takes any vehicle asks `layout_of`."""

Parameters = Mapping[str, float | bool]
"""Of FMUs, by name; of the contact, also `TANGENT`."""

NONLINEAR, STIFFNESS = "contact.nonlinear", "contact.stiffness"
HERTZ = "contact.hertz_coefficient"
TANGENT = "contact.tangent"
"""Asks for Hertz's law whose tangent at the static load is this, N/m; `at_load` answers."""


def layout_of(
    vehicle: tuple[Path, Iterable[Variable]], *tracks: tuple[Path, Iterable[Variable]]
) -> Layout:
    """The wheels of a vehicle, which are those of the track under it.

    Parameters
    ----------
    vehicle, *tracks : tuple
        File and variables of an FMU.

    Raises
    ------
    CouplingError
        If there are none, or a track is made for others.
    """
    file, variables = vehicle
    layout = Layout.among([v.name for v in variables])
    if layout is None:
        raise CouplingError(f"{file}: has no wheel; a vehicle needs wheelset[1].left.force_z")
    for under, given in tracks:
        other = Layout.among([v.name for v in given])
        if other is None:
            raise CouplingError(f"{under}: has no wheel; a track needs wheelset[1].left.force_z")
        if other != layout:
            raise CouplingError(
                f"{under}: is made for {_counted(other)}, and {file} has {_counted(layout)}: "
                "export the track for that vehicle"
            )
    return layout


def standing_in(gaps: Collection[str]) -> Layout:
    """The wheels of a coupled response, by its inputs ``wheelset[i].side.gap`` among others."""
    known = set(gaps)
    there = [f"{wheel}.gap" in known for wheel in Layout(MOST_WHEELSETS).wheels[:MOST_WHEELSETS]]
    return Layout(sum(there))


def _counted(layout: Layout) -> str:
    rails = "" if len(layout.sides) > 1 else ", on one rail"
    return f"{layout.wheelsets} wheelset{'s' if layout.wheelsets > 1 else ''}{rails}"


def completed(parameters: Parameters, fmus: Sequence[LoadedFmu]) -> dict[str, float | bool]:
    """With the number that the contact law needs and that is not given, if an FMU tells it.

    Parameters
    ----------
    parameters : mapping
        Of the contact, as far as they are given, and others.
    fmus : sequence of LoadedFmu
        Those that may tell, by the start value of a parameter of this name. The first one counts:
        the vehicle, whose wheels they are. If another tells something else, a warning says so.
    """
    known = {NONLINEAR: True, **parameters}
    needed = HERTZ if known[NONLINEAR] else STIFFNESS
    if needed in known or TANGENT in known:
        return known
    told = {
        fmu.description.path.name: float(fmu.description.parameters[needed].start)
        for fmu in fmus
        if needed in fmu.description.parameters and fmu.description.parameters[needed].start
    }
    for path, value in told.items():
        known.setdefault(needed, value)
        if value != known[needed]:
            first = next(iter(told))
            warnings.warn(
                f"{needed} is {known[needed]:.6g} in {first} and {value:.6g} in {path}: that of "
                "the vehicle is taken; --contact-stiffness hertz:N/m or N/m sets another",
                stacklevel=2,
            )
    return known


def at_load(parameters: Parameters, load: float) -> dict[str, float | bool]:
    """With Hertz's coefficient for the tangent that is asked for at a static load (N)."""
    others = {name: value for name, value in parameters.items() if name != TANGENT}
    return {**others, NONLINEAR: True, HERTZ: coefficient_for(float(parameters[TANGENT]), load)}


def law_of(parameters: Parameters) -> HertzContact | LinearContact:
    """The law that complete parameters describe.

    Raises
    ------
    CouplingError
        If a number is missing.
    """
    needed = HERTZ if parameters[NONLINEAR] else STIFFNESS
    if needed not in parameters:
        raise CouplingError(
            f"neither FMU tells {needed}, and it is not given: the vehicle should have it as a "
            "parameter, or give --contact-stiffness hertz:N/m or N/m"
        )
    number = float(parameters[needed])
    return HertzContact(C=number) if needed == HERTZ else LinearContact(k_H=number)


def stiffness_at(parameters: Parameters, load: float) -> float:
    """The tangent of the law of complete parameters at a load (N), N/m."""
    law = law_of(parameters)
    return tangent_stiffness(law.C, load) if isinstance(law, HertzContact) else law.k_H


def contact_law(law: NormalLaw, layout: Layout, nominal: Mapping[str, float]) -> Law:
    """All contacts as a component named ``contact``: motions of wheel and rail to forces.

    Parameters
    ----------
    law : NormalLaw
        Of every contact.
    layout : Layout
        Of the contacts.
    nominal : mapping
        Nominal values of the forces, N, by name.
    """
    motions = [Variable(name=name, unit="m", nominal=1e-3) for name in layout.motions]
    forces = [
        Variable(
            name=name, unit="N", description="contact force, compression positive",
            nominal=nominal.get(name, 1e5),
        )
        for name in layout.names(FORCE)
    ]  # fmt: skip
    return Law("contact", law, motions, forces, layout.compression)
