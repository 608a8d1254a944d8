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

from ..content import Arrays
from ..interface import SIDES, WHEELSETS, wheels
from ..python_runtime.models import BODIES

FloatArray = NDArray[np.float64]
ComplexArray = NDArray[np.complex128]
Elements = Mapping[str, NDArray[np.intp]]  # by name of a block: which of its elements, from 0
Names = tuple[str, ...]

RE, IM, Z, V = "mode.re", "mode.im", "rigid.z", "rigid.v"
POSITIONS = tuple(f"wheelset[{i}].position" for i in WHEELSETS)
FORCES = tuple(f"wheelset[{i}].{side}.force_z" for i, side in wheels())
HEIGHTS = tuple(f"wheelset[{i}].start_z" for i in WHEELSETS)
PARTS = {RE: "real", IM: "imaginary"}
FORCE, HEIGHT, VELOCITY = 1e5, 1e-3, 0.1  # nominal values of force_z, wheel_z and wheel_vz


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


def track_states(arrays: Arrays) -> States:
    """Modes of the ring, moved by all forces at all places, and one local mode under each wheel.

    Parameters
    ----------
    arrays : dict of array
        `content.track_arrays`.
    """
    ring = arrays["poles"].size
    all_ring = np.arange(ring)
    drivers: list[Names] = [POSITIONS + FORCES] * ring
    drivers += [
        (f"wheelset[{i}].position", f"wheelset[{i}].{side}.force_z") for i, side in wheels()
    ]
    outputs = {}
    for k, (i, side) in enumerate(wheels()):
        seen = np.append(all_ring, ring + k)
        for quantity in ("rail_z", "rail_vz"):
            outputs[f"wheelset[{i}].{side}.{quantity}"] = {RE: seen, IM: seen}
    poles = np.append(arrays["poles"], np.full(len(FORCES), arrays["residual_pole"]))
    largest = FORCE * np.abs(arrays["table"][:, 0] / arrays["poles"]).max()
    return States(
        blocks=[
            Block(
                name=name,
                description=f"{part} parts of the ring's modes, then of those under the wheels",
                nominal=_rounded(largest),
                derivatives=_oscillations(name, poles, drivers),
                at_rest=drivers,
                derivatives_at_rest=[()] * len(drivers),
            )
            for name, part in PARTS.items()
        ],
        outputs=outputs,
    )


def vehicle_states(arrays: Arrays) -> States:
    """Modes, of which the overdamped ones are real, and rigid-body coordinates.

    Parameters
    ----------
    arrays : dict of array
        `content.vehicle_arrays`.
    """
    return States(
        blocks=[
            *(_vehicle_modes(arrays, name) for name in (RE, IM)),
            _rigid_positions(arrays),
            _rigid_velocities(arrays),
        ],
        outputs=_vehicle_outputs(arrays),
    )


def _vehicle_outputs(arrays: Arrays) -> dict[str, Elements]:
    poles, modes, rigid = arrays["poles"], arrays["modes"], arrays["rigid"]

    def moved(k: int) -> Elements:
        return {**_seen(modes[k]), Z: np.flatnonzero(rigid[k])}

    def moving(k: int) -> Elements:
        return {**_seen(modes[k] * poles), V: np.flatnonzero(rigid[k])}

    outputs: dict[str, Elements] = {}
    for body, (z, pitch) in BODIES.items():
        outputs |= {f"{body}.z": moved(z), f"{body}.vz": moving(z), f"{body}.pitch": moved(pitch)}
        outputs[f"{body}.az"] = _seen(modes[z] * poles**2)
    first = len(modes) - len(WHEELSETS)  # the wheelsets are the last coordinates
    for k, i in enumerate(WHEELSETS, start=first):
        outputs[f"wheelset[{i}].az"] = _seen(modes[k] * poles**2)
        for side in SIDES:
            outputs[f"wheelset[{i}].{side}.wheel_z"] = moved(k)
            outputs[f"wheelset[{i}].{side}.wheel_vz"] = moving(k)
    return outputs


def _seen(shape: ComplexArray) -> Elements:
    """Modal states that Re(shape s) depends on; an overdamped mode has a real part only."""
    return {RE: np.flatnonzero(shape.real), IM: np.flatnonzero(shape.imag)}


def _vehicle_modes(arrays: Arrays, name: str) -> Block:
    poles: ComplexArray = arrays["poles"]
    into: ComplexArray = arrays["left"][:, -len(WHEELSETS) :]
    driven = [_forces(row) for row in (into.real if name == RE else into.imag)]
    return Block(
        name=name,
        description=f"{PARTS[name]} parts of the modes",
        nominal=_rounded(FORCE * np.abs(into / poles[:, None]).max()),
        derivatives=_oscillations(name, poles, driven),
        # As many suspensions as bodies above the wheelsets can move: at rest none is stretched.
        at_rest=[()] * len(poles),
        derivatives_at_rest=driven,
    )


def _oscillations(name: str, poles: ComplexArray, drivers: Sequence[Names]) -> list[Depends]:
    """Of the part `name` of lambda s: lambda.re times it, +- lambda.im times the other part."""
    other = IM if name == RE else RE
    return [
        Depends(driven, {name: np.array([k]), other: k + np.flatnonzero([pole.imag])})
        for k, (pole, driven) in enumerate(zip(poles, drivers, strict=True))
    ]


def _rigid_positions(arrays: Arrays) -> Block:
    start = arrays["start_r"]  # (n, 4), from the heights
    n = len(start)
    return Block(
        name=Z,
        description="rigid-body coordinates, normalised to a mass of 1",
        nominal=_rounded(HEIGHT * np.abs(start).max()),
        derivatives=[Depends((), {V: np.array([k])}) for k in range(n)],
        at_rest=[tuple(HEIGHTS[j] for j in np.flatnonzero(row)) for row in start],
        derivatives_at_rest=[()] * n,
    )


def _rigid_velocities(arrays: Arrays) -> Block:
    rigid = arrays["rigid"][-len(WHEELSETS) :]
    driven = [_forces(column) for column in rigid.T]
    return Block(
        name=V,
        description="velocities of the rigid-body coordinates",
        nominal=_rounded(VELOCITY * np.abs(arrays["start_r"]).max()),
        derivatives=[Depends(names) for names in driven],
        at_rest=[()] * len(driven),
        derivatives_at_rest=driven,
    )


def _forces(per_wheelset: FloatArray) -> Names:
    """Forces of both wheels of the wheelsets that count."""
    counts = np.tile(per_wheelset != 0, 2)
    return tuple(name for name, there in zip(FORCES, counts, strict=True) if there)


def _rounded(value: float) -> float:
    """One digit: it is only a magnitude."""
    return float(f"{value:.0e}")
