"""The contact of wheel and rail: its numbers, made once for a pair, and its law in the master.

Whoever owns the contact, FMU, master or reference, is given the same complete parameters:
``contact.nonlinear``, and ``contact.hertz_coefficient`` or ``contact.stiffness`` of all wheels, or
the same of every wheelset, ``wheelset[i].contact.stiffness``. What is not given is the vehicle's,
whose wheels they are.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection, Iterable, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

import numpy as np

from railcosim.fmus.roles import Role
from railcosim.fmus.rolling_variables import ROWS
from railcosim.master.component import FloatArray, Variable
from railcosim.master.connections import CouplingError
from railcosim.master.fmi.loaded_fmu import LoadedFmu
from railcosim.master.fmi.variables import Parameter
from railcosim.master.law import ForceLaw, Law
from railcosim.master.suggest import suggest
from railcosim.mechanics.law import (
    HertzContact,
    LinearContact,
    coefficient_for,
    tangent_stiffness,
)
from railcosim.mechanics.ports import FORCE, IRREGULARITY, MOST_WHEELSETS, SIDES, Layout

Parameters = Mapping[str, float | bool]
"""Of FMUs, by name; of the contact, also `TANGENT`."""
Stiffness: TypeAlias = float | FloatArray
"""Of all contacts, or one a wheelset from the front, N/m."""

CONTACT = ".contact."
NONLINEAR, STIFFNESS = "contact.nonlinear", "contact.stiffness"
HERTZ = "contact.hertz_coefficient"
AT_REST = 1e-6
"""Of a static load: how well it is found, see `STILL` of a pair."""
ROLLING = {role: f"contact.{row['name']}" for role, row in ROWS.items()} | {
    Role.HERTZ: HERTZ,
    Role.TEXTBOOK: "contact.textbook",
    Role.FASTSIM: "contact.fastsim",
}
"""Numbers of wheels that roll, by what they are to a model."""
NUMBERS = (STIFFNESS, *ROLLING.values())
"""Of all contact laws: parameters of all wheels, or of those of each wheelset."""
TANGENT = "contact.tangent"
"""Asks for Hertz's law whose tangent at every wheelset's static load is this, N/m; `at_load`
answers."""


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
        if other.rails != layout.rails:
            raise CouplingError(
                f"{under}: is made for {_counted(other)}, and {file} has {_counted(layout)}: "
                "export the track for that vehicle"
            )
    return layout


def standing_in(gaps: Collection[str]) -> Layout:
    """The wheels of a coupled response, by its inputs ``wheelset[i].left.irregularity_z``."""
    known = set(gaps)
    names = Layout(MOST_WHEELSETS, SIDES[:1]).names(IRREGULARITY)
    there = [name in known for name in names]
    return Layout(sum(there))


def _counted(layout: Layout) -> str:
    rails = "" if len(layout.sides) > 1 else ", on one rail"
    along = "" if layout == Layout(layout.wheelsets, layout.sides) else f", {layout.dimension}"
    return f"{layout.wheelsets} wheelset{'s' if layout.wheelsets > 1 else ''}{rails}{along}"


def contact_of(contact: float | Parameters) -> Parameters:
    """Parameters of a contact, of a linear one of that stiffness (N/m)."""
    if isinstance(contact, float | int):
        return {NONLINEAR: False, STIFFNESS: float(contact)}
    return contact


def completed(
    parameters: Parameters, fmus: Sequence[LoadedFmu], layout: Layout, needed: Sequence[str]
) -> dict[str, float | bool]:
    """With the numbers that the contact law needs and that are not given, if an FMU tells them.

    Parameters
    ----------
    parameters : mapping
        Of the contact, as far as they are given, and others.
    fmus : sequence of LoadedFmu
        Those that may tell, by the start values of parameters of these names. The first one counts:
        the vehicle, whose wheels they are. If another tells something else, a warning says so.
    layout : Layout
        Of the wheels.
    needed : sequence of str
        Names of the numbers.

    Raises
    ------
    CouplingError
        If a number is given for all wheels, and one for some of them, or one that nobody knows.
    """
    _check_names(parameters, fmus, layout, needed)
    known = dict(parameters)
    for name in needed:
        known |= _completed(name, known, fmus, layout)
    return known


def _completed(
    needed: str, known: Parameters, fmus: Sequence[LoadedFmu], layout: Layout
) -> dict[str, float | bool]:
    """One of the numbers, of all wheels or of each wheelset, as far as it is told."""
    each = layout.of_axles(needed)
    if needed in known and (own := [name for name in each if name in known]):
        raise CouplingError(
            f"{needed} = {known[needed]:g} is given for all wheels, and {own[0]} = "
            f"{known[own[0]]:g} as well: give one for all, or those of wheelsets"
        )
    by_tangent = needed == HERTZ and TANGENT in known
    if needed in known or by_tangent or known.keys() >= set(each):
        return {}
    numbers_of = {
        fmu.description.path.name: told(fmu.description.parameters, needed, each) for fmu in fmus
    }
    numbers_of = {path: numbers for path, numbers in numbers_of.items() if numbers}
    first = next(iter(numbers_of), None)
    if first is None:
        return {}
    for path, numbers in numbers_of.items():
        ours, theirs = (
            np.resize(list(of.values()), len(each)) for of in (numbers_of[first], numbers)
        )
        if (ours != theirs).any():
            i = int(np.argmax(ours != theirs))
            warnings.warn(
                f"{needed} is {ours[i]:.6g} in {first} and {theirs[i]:.6g} in {path} "
                f"({layout.axles[i]}): that of the vehicle is taken; --contact-stiffness hertz:N/m "
                "or N/m sets another",
                stacklevel=4,
            )
    given = known.keys() & set(each)
    if given:  # some are given: the others are those of the FMU
        those = np.resize(list(numbers_of[first].values()), len(each))
        return dict(zip(each, those, strict=True)) | {name: known[name] for name in given}
    return dict(numbers_of[first])


def _check_names(
    parameters: Parameters, fmus: Sequence[LoadedFmu], layout: Layout, needed: Sequence[str]
) -> None:
    """Raise CouplingError if a parameter of a contact is none: the vehicle's would be taken."""
    known = {NONLINEAR, TANGENT, STIFFNESS, HERTZ, *needed}
    known = known.union(*(layout.of_axles(name) for name in (STIFFNESS, HERTZ, *needed)))
    known = known.union(*(fmu.description.parameters for fmu in fmus))
    for name in parameters:
        if CONTACT in f".{name}" and name not in known:
            raise CouplingError(
                f"{name}: no contact has such a parameter{suggest(name, sorted(known))}"
            )


def told(rows: Mapping[str, Parameter], needed: str, each: Iterable[str]) -> dict[str, float]:
    """The number of all wheels, or those of each wheelset, that an FMU tells; else none."""
    names = [needed] if needed in rows else list(each)
    starts = {name: _number(rows[name].start) for name in names if name in rows}
    least = 0.0 if needed in {HERTZ, STIFFNESS} else -np.inf  # without any nothing is pressed
    return starts if len(starts) == len(names) and min(starts.values()) > least else {}


def _number(start: str | None) -> float:
    """A start value, also of a Boolean."""
    known = {"true": True, "false": False}
    return known[start] if start in known else float(start or 0.0)


def fitting(parameters: Parameters, fmu: LoadedFmu, layout: Layout) -> dict[str, float | bool]:
    """Those parameters that an FMU has; a number of all wheels where it has one a wheelset.

    Raises
    ------
    CouplingError
        If it owns the contact and has one law only, where wheelsets differ.
    """
    rows = fmu.description.parameters
    given = dict(parameters)
    for name in NUMBERS:
        each = layout.of_axles(name)
        if name in given:
            given |= dict.fromkeys(each, given[name])
            continue
        numbers = [given[at] for at in each if at in given]
        if len(set(numbers)) == 1 and len(numbers) == len(each):
            given[name] = numbers[0]
        elif numbers and NONLINEAR in rows and not rows.keys() >= set(each):
            raise CouplingError(
                f"{fmu.description.path}: has one contact law for all wheels, {name}, and those of "
                "the vehicle have different ones: export it for that vehicle, give an FMU without "
                "contact, or one number by --contact-stiffness"
            )
    return {name: value for name, value in given.items() if name in rows}


def at_load(parameters: Parameters, loads: FloatArray, layout: Layout) -> dict[str, float | bool]:
    """With Hertz's coefficients for the tangent asked for at static loads (n_wheelsets,), in N."""
    others = {name: value for name, value in parameters.items() if name != TANGENT}
    known = {**others, NONLINEAR: True}
    k_H = float(parameters[TANGENT])
    if np.ptp(loads) <= AT_REST * loads.max():
        return known | {HERTZ: coefficient_for(k_H, float(loads.mean()))}
    C = coefficient_for(np.full_like(loads, k_H), loads)
    return known | dict(zip(layout.of_axles(HERTZ), C.tolist(), strict=True))


def law_of(parameters: Parameters, layout: Layout) -> HertzContact | LinearContact:
    """The law that complete parameters describe: of all contacts, or of each.

    Raises
    ------
    CouplingError
        If a number is missing.
    """
    needed = HERTZ if parameters[NONLINEAR] else STIFFNESS
    numbers = numbers_of(needed, parameters, layout)
    number: Stiffness = numbers[0] if needed in parameters else layout.down.at_wheelsets(numbers)
    return HertzContact(C=number) if needed == HERTZ else LinearContact(k_H=number)


def numbers_of(needed: str, parameters: Parameters, layout: Layout) -> list[float]:
    """A number of all wheels, alone, or those of each wheelset.

    Raises
    ------
    CouplingError
        If it is missing.
    """
    each = layout.of_axles(needed)
    if needed in parameters:
        return [float(parameters[needed])]
    if parameters.keys() >= set(each):
        return [float(parameters[name]) for name in each]
    cure = ", or give --contact-stiffness hertz:N/m or N/m" if needed in {HERTZ, STIFFNESS} else ""
    raise CouplingError(
        f"neither FMU tells {needed}, and it is not given: the vehicle should have it as a "
        f"parameter{cure}"
    )


def stiffness_at(parameters: Parameters, loads: FloatArray, layout: Layout) -> FloatArray:
    """Tangents of the law of complete parameters at loads (n_wheelsets,) in N: N/m."""
    law = law_of(parameters, layout)
    at_ports = law.C if isinstance(law, HertzContact) else law.k_H
    numbers = np.resize(at_ports, len(loads))  # those of the left wheels
    return tangent_stiffness(numbers, loads) if isinstance(law, HertzContact) else numbers


def contact_law(law: ForceLaw, layout: Layout, nominal: Mapping[str, float]) -> Law:
    """All contacts as a component named ``contact``: motions of wheel and rail to forces.

    Parameters
    ----------
    law : ForceLaw
        Of the contacts.
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
