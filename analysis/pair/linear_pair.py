"""Vehicle and track as linear components, from the forces of their contacts to motions there.

The wheels are held where they are. Where left and right are alike, motions that are their own
mirror image and those that are its opposite are two problems of half the size.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from railcosim.master.component import FloatArray
from railcosim.master.connections import CouplingError
from railcosim.master.fmi.description import describe_file
from railcosim.master.linear.modal import Modal, modes_of
from railcosim.master.linear.model_exchange import linear_model
from railcosim.master.linear.side_by_side import joined
from railcosim.master.linear.state_space import ComplexArray, StateSpace
from railcosim.master.progress import Progress
from railcosim.mechanics.ports import FORCE, RAIL, WHEEL, Layout

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
    layout : Layout
        Of the wheels that stand for all of them.
    image : int
        1: the other side does as in the mirror between the rails; -1: the opposite; 0: there is
        no other, these are all wheels.
    vehicle : StateSpace
        Forces at the ports of the layout to motions of wheels there.
    track : Modal
        Forces at the rails' ports to motions of rails there.
    """

    name: str
    layout: Layout
    image: int
    vehicle: StateSpace
    track: Modal

    @property
    def wheels(self) -> tuple[str, ...]:
        """Those that stand for all of them."""
        return self.layout.wheels

    @property
    def mix(self) -> FloatArray:
        """What surfaces under all wheels do by those under `wheels`, (n_all, n_surfaces)."""
        return _mix(self.layout.surface, self.image)

    def tangents(self, contact: Stiffness) -> FloatArray:
        """Tangents of the laws of its contacts, shape (n_contacts, k, m).

        Parameters
        ----------
        contact : float or array
            Stiffness of pressed contacts, N/m: of all, or (n_wheelsets,) of each wheelset, from the
            front. Or tangents of all contacts of the pair.
        """
        if np.ndim(contact) == 3:
            return np.asarray(contact)[: self.layout.contacts]
        return np.resize(contact, (self.layout.contacts, 1, 1))

    def response(self, omega: FloatArray) -> tuple[ComplexArray, ComplexArray]:
        """Of vehicle and track, each of shape (n_omega, ports, ports), m/N and the like."""
        return self.vehicle.frequency_response(omega), self.track.response(1j * omega)


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
    cars = _of_contacts(whole, first, layout, WHEEL.motion)
    places = places_of(first, whole.standing, layout)
    check_ring_of(track, places)
    under = linear_model(track, name="track", at=track_at(places, layout, taken))
    rails = _of_contacts(under, track, layout.rails, RAIL.motion)
    progress(0.2, 1.0)
    ways = {"all wheels": 0}
    if len(layout.sides) > 1 and _alike(cars, layout) and _alike(rails, layout.rails):
        ways = {"both wheels alike": 1, "wheels against each other": -1}
    parts = []
    for i, (name, image) in enumerate(ways.items()):
        own = replace(layout, sides=layout.sides[:1]) if image else layout
        track_alone = _mixed(rails, _mix(own.rails, image))
        parts.append(
            Part(
                name=name,
                layout=own,
                image=image,
                vehicle=_acting(_mixed(cars, _mix(own, image))),
                track=_condensed(track_alone, own.rails, track),
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


def _alike(model: StateSpace, layout: Layout) -> bool:
    """Whether nothing changes in the mirror between the rails."""
    G = model.frequency_response(PROBES)
    n, signs = G.shape[1] // 2, np.tile(layout.mirror, 2)
    turned = signs[:, None] * np.roll(G, (n, n), axis=(1, 2)) * signs
    size = np.abs(G).max(axis=(1, 2))
    return bool((np.abs(G - turned).max(axis=(1, 2)) <= ALIKE * size).all())


def _mix(layout: Layout, image: int) -> FloatArray:
    """What all ports of a pair do by those of a part; see `Part`."""
    one = np.eye(len(layout.ports))
    return np.concatenate([one, image * np.diag(layout.mirror)]) if image else one


def _mixed(model: StateSpace, mix: FloatArray) -> StateSpace:
    """Forces at the first ports, which stand for others by the columns of `mix`."""
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


def _condensed(model: StateSpace, layout: Layout, file: Path) -> Modal:
    """As few modes as do, held against the model."""
    modes = modes_of(model)
    G = model.frequency_response(PROBES)
    error = np.abs(modes.response(1j * PROBES) - G).max(axis=(1, 2)) / np.abs(G).max(axis=(1, 2))
    if not error.max() <= ALIKE:
        raise CouplingError(
            f"{file}: its linear model does not fall apart into modes (relative error "
            f"{error.max():.1g}); a track that can move freely cannot be treated here"
        )
    if len(modes.poles) <= MANY:
        return modes
    # Metres and radians count as much as they move at rest; powers of two round nothing.
    own = np.abs(modes.response([0.0])[0].real.diagonal()).reshape(-1, len(layout.directions))
    unit = np.tile(2.0 ** np.round(np.log2(own.max(axis=0)) / 2), len(own))
    less = replace(modes, B=modes.B / unit, C=modes.C / unit[:, None]).condensed(CONDENSED)
    return replace(less, B=less.B * unit, C=less.C * unit[:, None])
