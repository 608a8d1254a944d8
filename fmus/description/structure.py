"""The continuous states of Model Exchange, and what depends on what.

The table of the interface says what depends on inputs and parameters; here is what depends on the
states, and what the states' derivatives and the states at rest depend on. It is exact: what is not
listed has a derivative of zero, whatever the state.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import ComplexArray, FloatArray
from railcosim.mechanics.coordinates import Coordinates
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import FORCE
from railcosim.mechanics.shapes import AlongRing

Elements = Mapping[str, NDArray[np.intp]]  # by name of a block: which of its elements, from 0
Names = tuple[str, ...]

RE, IM, Z, V = "mode.re", "mode.im", "rigid.z", "rigid.v"
PARTS = {RE: "real", IM: "imaginary"}
FORCE_SIZE, HEIGHT, VELOCITY = 1e5, 1e-3, 0.1  # nominal values of force_z, wheel_z and wheel_vz


@dataclass(frozen=True)
class Depends:
    """What an unknown depends on: variables of the table, and elements of the states' blocks."""

    names: Names = ()
    elements: Elements = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Block:
    """States of one kind.

    Attributes
    ----------
    name, description : str
        Of the array in FMI 3.0; in FMI 2.0 its elements are ``name[1]``, ``name[2]``, ...
    nominal : float
        A typical magnitude.
    derivatives : sequence of Depends
        What the derivative of each element depends on.
    at_rest : sequence of names
        What each element depends on in initialisation: inputs and parameters.
    derivatives_at_rest : sequence of names
        Likewise its derivative.
    """

    name: str
    description: str
    nominal: float
    derivatives: Sequence[Depends]
    at_rest: Sequence[Names]
    derivatives_at_rest: Sequence[Names]

    @property
    def size(self) -> int:
        """How many states."""
        return len(self.derivatives)


@dataclass(frozen=True, kw_only=True)
class States:
    """The vector of states as blocks, one after the other.

    Attributes
    ----------
    blocks : sequence of Block
        ``mode.re``, ``mode.im`` and, for the vehicle, ``rigid.z`` and ``rigid.v``.
    outputs : mapping
        Which elements each output depends on.
    """

    blocks: Sequence[Block]
    outputs: Mapping[str, Elements]

    @property
    def size(self) -> int:
        """Number of states."""
        return sum(block.size for block in self.blocks)


def states_of(body: ModalBody, told: Sequence[str] = ()) -> States:
    """The states of a body: modes, and a vehicle's rigid-body coordinates.

    Parameters
    ----------
    body : ModalBody
        The model.
    told : sequence of str
        Names of the outputs of a track's observation, in their order; none where nobody asks.
    """
    if body.coordinates is None:
        return _track_states(body, told)
    return _vehicle_states(body, body.coordinates)


def _track_states(body: ModalBody, told: Sequence[str]) -> States:
    """Modes of the ring, moved by all forces at all places, and local ones under each wheel."""
    layout, ring = body.layout, body.shared
    positions, forces = layout.of_axles("position"), layout.names(FORCE)
    all_ring = np.arange(ring)
    everybody: Names = positions + forces
    drivers = [everybody] * ring
    shapes, size = body.shapes, len(layout.directions)
    coupled = np.eye(size, dtype=bool)  # motion in a direction, oscillator of a direction
    if isinstance(shapes, AlongRing):
        coupled |= np.any(shapes.local_table.reshape(-1, size, size), axis=0)
    outputs = {}
    for k, port in enumerate(layout.ports):
        own, first = k % size, k - k % size
        pushing = [layout.ports[first + d].name(FORCE) for d in np.flatnonzero(coupled[:, own])]
        drivers.append((positions[port.wheelset - 1], *pushing))
        seen = np.append(all_ring, ring + first + np.flatnonzero(coupled[own]))
        for quantity in (body.face.motion, body.face.rate):
            outputs[port.name(quantity)] = {RE: seen, IM: seen}
    if body.observation is not None:
        drivers += [everybody] * body.observation.poles.size
        each = np.arange(ring + body.ports, body.poles.size).reshape(
            len(body.observation.shown), -1
        )
        for name, row in zip(told, body.observation.row.tolist(), strict=False):
            seen = np.append(all_ring, each[row])
            outputs[name] = {RE: seen, IM: seen}
    shape = shapes.table[:, 0] if isinstance(shapes, AlongRing) else shapes.into
    largest = FORCE_SIZE * np.abs(shape / body.poles[:ring]).max()
    return States(
        blocks=[
            Block(
                name=name,
                description=f"{part} parts of the ring's modes, then of those under the wheels"
                + (", then of those of sensors" if body.observation else ""),
                nominal=_rounded(largest),
                derivatives=_oscillations(name, body.poles, drivers),
                at_rest=drivers,
                derivatives_at_rest=[()] * len(drivers),
            )
            for name, part in PARTS.items()
        ],
        outputs=outputs,
    )


def _vehicle_states(body: ModalBody, known: Coordinates) -> States:
    """Modes, of which the overdamped ones are real, and rigid-body coordinates."""
    return States(
        blocks=[
            *(_vehicle_modes(body, known, name) for name in (RE, IM)),
            _rigid_positions(body, known),
            _rigid_velocities(body, known),
        ],
        outputs=_vehicle_outputs(body, known),
    )


def _vehicle_outputs(body: ModalBody, known: Coordinates) -> dict[str, Elements]:
    poles, modes = body.poles, known.modes

    def moved(shape: ComplexArray, rigid: FloatArray) -> Elements:
        return {**_seen(shape), Z: np.flatnonzero(rigid)}

    def moving(shape: ComplexArray, rigid: FloatArray) -> Elements:
        return {**_seen(shape * poles), V: np.flatnonzero(rigid)}

    outputs: dict[str, Elements] = {}
    for k, name in enumerate(known.names):
        whose, _, direction = name.rpartition(".")
        outputs[name] = moved(modes[k], known.rigid[k])
        outputs[f"{whose}.v{direction}"] = moving(modes[k], known.rigid[k])
        outputs[f"{whose}.a{direction}"] = _seen(modes[k] * poles**2)
    out, _, _ = body.shapes.at(known.wheelset_x, len(body.rigid_out))
    for k, port in enumerate(body.layout.ports):
        row = k % len(out)  # right wheels as left ones
        outputs[port.name(body.face.motion)] = moved(out[row], body.rigid_out[row])
        outputs[port.name(body.face.rate)] = moving(out[row], body.rigid_out[row])
    return outputs


def _seen(shape: ComplexArray) -> Elements:
    """Modal states that Re(shape s) depends on; an overdamped mode has a real part only."""
    return {RE: np.flatnonzero(shape.real), IM: np.flatnonzero(shape.imag)}


def _vehicle_modes(body: ModalBody, known: Coordinates, name: str) -> Block:
    poles = body.poles
    into = body.at(known.wheelset_x).into.T

    def part(values: ComplexArray) -> FloatArray:
        return values.real if name == RE else values.imag

    driven = [_forces(body, row) for row in part(into)]
    # Where bodies above can follow any heights no suspension is stretched at rest.
    rest = _heights(body, known.strained & (part(known.start_s) != 0))
    rates = _heights(body, known.strained & (part(poles[:, None] * known.start_s) != 0))
    return Block(
        name=name,
        description=f"{PARTS[name]} parts of the modes",
        nominal=_rounded(FORCE_SIZE * np.abs(into / poles[:, None]).max()),
        derivatives=_oscillations(name, poles, driven),
        at_rest=rest,
        derivatives_at_rest=[
            by_force + by_height for by_force, by_height in zip(driven, rates, strict=True)
        ],
    )


def _heights(body: ModalBody, felt: NDArray[np.bool_]) -> list[Names]:
    """Start heights that count, for each row."""
    heights = body.layout.of_axles("start_z")
    return [tuple(heights[i] for i in np.flatnonzero(row)) for row in felt]


def _oscillations(name: str, poles: ComplexArray, drivers: Sequence[Names]) -> list[Depends]:
    """Of the part `name` of lambda s: lambda.re times it, +- lambda.im times the other part."""
    other = IM if name == RE else RE
    return [
        Depends(driven, {name: np.array([k]), other: k + np.flatnonzero([pole.imag])})
        for k, (pole, driven) in enumerate(zip(poles, drivers, strict=True))
    ]


def _rigid_positions(body: ModalBody, known: Coordinates) -> Block:
    start = known.start_r
    n = len(start)
    return Block(
        name=Z,
        description="rigid-body coordinates, normalised to a mass of 1",
        nominal=_rounded(HEIGHT * np.abs(start).max()),
        derivatives=[Depends((), {V: np.array([k])}) for k in range(n)],
        at_rest=_heights(body, start != 0),
        derivatives_at_rest=[()] * n,
    )


def _rigid_velocities(body: ModalBody, known: Coordinates) -> Block:
    driven = [_forces(body, column) for column in body.rigid_into.T]
    return Block(
        name=V,
        description="velocities of the rigid-body coordinates",
        nominal=_rounded(VELOCITY * np.abs(known.start_r).max()),
        derivatives=[Depends(names) for names in driven],
        at_rest=[()] * len(driven),
        derivatives_at_rest=driven,
    )


def _forces(body: ModalBody, per_wheelset: FloatArray) -> Names:
    """Forces at all ports of the wheelsets that count."""
    counts = np.tile(per_wheelset != 0, len(body.layout.sides))
    forces = zip(body.layout.names(FORCE), counts, strict=True)
    return tuple(name for name, there in forces if there)


def _rounded(value: float) -> float:
    """One digit: it is only a magnitude."""
    return float(f"{value:.0e}")
