"""Vehicle and track as linear components, with the contact springs on whichever side owns them.

The wheels are held where they are. Where left and right are alike, what both wheels of a wheelset
do alike and what they do against each other are two problems of half the size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from scipy.sparse import csc_array

from railcosim.analysis.pair.owner import Owner
from railcosim.master.component import Component, FloatArray, Variable
from railcosim.master.connections import CouplingError, connect_by_name
from railcosim.master.fmi.description import describe_file
from railcosim.master.law import Law
from railcosim.master.linear.modal import Modal, modes_of
from railcosim.master.linear.model_exchange import linear_model
from railcosim.master.linear.side_by_side import joined
from railcosim.master.linear.state_space import ComplexArray, StateSpace
from railcosim.master.progress import Progress
from railcosim.master.stability.open_component import Open
from railcosim.master.system import System
from railcosim.mechanics.law import LinearContact
from railcosim.mechanics.ports import FORCE, RAIL, WHEEL, Layout, Z

from .contact import Stiffness, layout_of
from .numbering import Vehicles, files_of, names_through, places_of
from .ring import check_ring_of
from .standing import Position, each_position, standing, track_at

CONDENSED = 1e-6
"""Of the largest Hankel singular value, where modes of the track are left out. With 1e-4 some
largest stable steps are 1 % too long; with this they agree with runs of 40,000 steps."""
MANY = 100
"""Modes that are not worth condensing."""
PROBES = 2 * np.pi * np.geomspace(1.0, 2000.0, 9)
"""rad/s, where models are held against each other."""
ALIKE = 1e-6
"""Of the largest receptance at a frequency: differences that are rounding of a modal model."""


@dataclass(frozen=True, kw_only=True)
class Part:
    """One of the problems that a pair falls apart into.

    Attributes
    ----------
    name : str
        Which wheels move together.
    wheels : tuple of str
        Those that stand for all of them.
    vehicle : StateSpace
        Contact forces to wheel motion, one each a wheel.
    track : Modal
        Contact forces to rail motion, likewise.
    mix : array, shape (n_contacts, n_wheels)
        What all contacts of the pair do, by those of `wheels`.
    """

    name: str
    wheels: tuple[str, ...]
    vehicle: StateSpace
    track: Modal
    mix: FloatArray

    def of_wheels(self, of_wheelsets: Stiffness) -> FloatArray:
        """At its wheels, what is given for all wheelsets or for each, from the front."""
        return np.resize(of_wheelsets, len(self.wheels))

    def compliance(self, omega: FloatArray) -> ComplexArray:
        """Of both sides of the contacts together, (n_omega, n_wheels, n_wheels), m/N."""
        wheel, rail = self.vehicle.frequency_response(omega), self.track.response(1j * omega)
        together: ComplexArray = rail - wheel  # the force pushes the wheel up, and z is down
        return together

    def growth(self, k: FloatArray) -> float:
        """Rate (1/s) at which the fastest motion grows with springs `k` (N/m), coupled exactly.

        Negative for passive sides. A reduced track need not be passive above its highest frequency.
        """
        A, B, C = self.track.real()
        v = self.vehicle
        both = np.block([[v.A.toarray(), np.zeros((len(v.B), len(B)))],
                         [np.zeros((len(B), len(v.B))), A]])  # fmt: skip
        compression = np.hstack([v.C, -C])
        pushed = np.concatenate([v.B, B])
        return float(np.linalg.eigvals(both + (pushed * k) @ compression).real.max())


def linear_parts(
    vehicle: Vehicles, track: Path, progress: Progress, position: Position = None
) -> tuple[Part, ...]:
    """Linearise a vehicle FMU and a track FMU that take contact forces, by Model Exchange.

    Parameters
    ----------
    vehicle : Path or sequence of Path
        FMU file, or those of several vehicles from the front.
    track : Path
        FMU file.
    progress : callable
        Told what is done and the total.
    position : float or sequence of float, optional
        Where the last wheelset (of each vehicle) stands, m; where it starts if not given.

    Returns
    -------
    tuple of Part
        Two where left and right are alike, else one.

    Raises
    ------
    FmuError, CouplingError
        If an FMU cannot be linearised, or is not what it should be.
    """
    whole, first = _vehicles(each_position(vehicle, position)), files_of(vehicle)[0]
    taken = describe_file(track).inputs
    layout = layout_of((first, whole.inputs), (track, taken))
    if layout.directions != (Z,):
        raise CouplingError(
            f"{first}: its wheels move aside, too; largest stable steps are predicted of vertical "
            "pairs: give FMUs made without --dimension spatial"
        )
    cars = _of_contacts(whole, first, layout, WHEEL.motion)
    places = places_of(first, whole.standing, layout)
    check_ring_of(track, places)
    under = linear_model(track, name="track", at=track_at(places, layout, taken))
    rails = _of_contacts(under, track, layout, RAIL.motion)
    progress(0.2, 1.0)
    one = np.eye(layout.wheelsets)
    ways = {"all wheels": np.eye(layout.contacts)}
    if len(layout.sides) > 1 and _alike(cars) and _alike(rails):
        ways = {
            "both wheels alike": np.concatenate([one, one]),
            "wheels against each other": np.concatenate([one, -one]),
        }
    parts = []
    for i, (name, mix) in enumerate(ways.items()):
        wheels = layout.wheels[: mix.shape[1]]
        parts.append(
            Part(
                name=name,
                wheels=wheels,
                vehicle=_acting(_mixed(cars, mix)),
                track=_condensed(_mixed(rails, mix), track),
                mix=mix,
            )
        )
        progress(0.2 + 0.8 * (i + 1) / len(ways), 1.0)
    return tuple(parts)


def _vehicles(each: Sequence[tuple[Path, float | None]]) -> StateSpace:
    """All vehicles, by their FMUs and where the last wheelset of each stands."""
    made = [
        linear_model(file, name="vehicle", parameters=standing(file, x).get("parameters"))
        for file, x in each
    ]
    if len(made) == 1:
        return made[0]
    named = [(file, model) for (file, _), model in zip(each, made, strict=True)]
    return joined("vehicle", made, names_through(named))


def coupled(part: Part, owner: Owner, k: FloatArray) -> System:
    """A part as a system at rest, with the irregularity as a signal left open.

    Parameters
    ----------
    part : Part
        Of the pair.
    owner : Owner
        Of the contact springs.
    k : array, shape (n_wheels,)
        Their stiffness, N/m.
    """
    wheel, rail, given, force = (
        _variables(part.wheels, name) for name in ("wheel_z", "rail_z", "irregularity_z", "force_z")
    )
    v, t = part.vehicle, part.track
    law: list[Component] = []
    if owner is Owner.VEHICLE:
        springs = -np.diag(k)
        v = replace(
            v, A=csc_array(v.A + (v.B * k) @ v.C), B=np.hstack([-v.B * k, -v.B * k]),
            C=k[:, None] * v.C, D=np.hstack([springs, springs]), inputs=(*rail, *given),
            outputs=force,
        )  # fmt: skip
    else:
        v = replace(v, inputs=force, outputs=wheel)
    if owner is Owner.TRACK:
        t = t.sprung(k, wheel, force)
        t = replace(t, B=np.hstack([t.B, -t.B]), D=np.hstack([t.D, -t.D]), inputs=(*wheel, *given))
    else:
        t = replace(t, inputs=force, outputs=rail)
    if owner is Owner.MASTER:
        one = np.eye(len(k))
        motions = (*wheel, *rail, *given)
        law = [Law("contact", LinearContact(k_H=k), motions, force, np.hstack([one, -one, -one]))]
    components = [
        Open("irregularity", (), given),
        Open("vehicle", v.inputs, v.outputs, v),
        *law,
        Open("track", t.inputs, t.outputs, t),
    ]
    return System(components, connect_by_name(components))


def _variables(wheels: Sequence[str], name: str) -> tuple[Variable, ...]:
    nominal = 1e5 if name == "force_z" else 1e-3
    unit = "N" if name == "force_z" else "m"
    return tuple(Variable(name=f"{w}.{name}", unit=unit, nominal=nominal) for w in wheels)


def _of_contacts(model: StateSpace, file: Path, layout: Layout, motion: str) -> StateSpace:
    """The same model, from the contact forces to the motions at the contacts."""
    inputs, outputs = ([v.name for v in side] for side in (model.inputs, model.outputs))
    forces, wanted = layout.names(FORCE), layout.names(motion)
    for kind, names, known in (("input", forces, inputs), ("output", wanted, outputs)):
        for name in names:
            if name not in known:
                raise CouplingError(
                    f"{file}: has no {kind} {name!r}; give an FMU that takes contact forces "
                    "(Vehicle.fmu, Track.fmu), not one that owns the contact"
                )
    j, i = [inputs.index(n) for n in forces], [outputs.index(n) for n in wanted]
    if model.D[np.ix_(i, j)].any():
        raise CouplingError(f"{file}: a force moves a contact at once, without any mass between")
    return replace(
        model, B=model.B[:, j], C=model.C[i], D=model.D[np.ix_(i, j)],
        inputs=tuple(model.inputs[k] for k in j), outputs=tuple(model.outputs[k] for k in i),
    )  # fmt: skip


def _alike(model: StateSpace) -> bool:
    """Whether nothing changes when left and right change places."""
    G = model.frequency_response(PROBES)
    n = G.shape[1] // 2
    turned = np.roll(G, (n, n), axis=(1, 2))
    size = np.abs(G).max(axis=(1, 2))
    return bool((np.abs(G - turned).max(axis=(1, 2)) <= ALIKE * size).all())


def _mixed(model: StateSpace, mix: FloatArray) -> StateSpace:
    """Forces on the first wheels, which stand for others by the columns of `mix`."""
    n = mix.shape[1]
    return replace(
        model, B=model.B @ mix, C=model.C[:n], D=(model.D @ mix)[:n],
        inputs=model.inputs[:n], outputs=model.outputs[:n],
    )  # fmt: skip


def _acting(model: StateSpace) -> StateSpace:
    """Only the states that forces reach and motions show; at least one, or nobody is there."""
    kept = [
        states[(np.abs(model.B[states]) > 0).any(axis=(1, 2))
               & (np.abs(model.C[:, states]) > 0).any(axis=(0, 2))]
        for states in model.blocks()
    ]  # fmt: skip
    chosen = np.concatenate([k.ravel() for k in kept])
    if not chosen.size:
        chosen = model.blocks()[0][0]
    return replace(
        model, A=model.A[chosen][:, chosen], B=model.B[chosen], C=model.C[:, chosen]
    )  # fmt: skip


def _condensed(model: StateSpace, file: Path) -> Modal:
    """As few modes as do, held against the model."""
    modes = modes_of(model)
    G = model.frequency_response(PROBES)
    error = np.abs(modes.response(1j * PROBES) - G).max(axis=(1, 2)) / np.abs(G).max(axis=(1, 2))
    if not error.max() <= ALIKE:
        raise CouplingError(
            f"{file}: its linear model does not fall apart into modes (relative error "
            f"{error.max():.1g}); a track that can move freely cannot be treated here"
        )
    return modes if len(modes.poles) <= MANY else modes.condensed(CONDENSED)
