"""Linear equations of motion of bodies and springs, in space or the vertical ones among them.

Displacements are measured from the statically loaded vehicle whose wheels just touch the unloaded
track.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railcosim.mechanics.arrays import FloatArray
from railcosim.mechanics.contact.geometry import Cone
from railcosim.mechanics.ports import OF_WHEELS, Direction

from .assembly import assemble
from .bodies import DOWN, MOVES, ODD, SPIN, TURNS, WHEELSET, Body, Spring, Vector, names_of
from .parameters import Vehicle
from .statics import at_rest
from .train import Train, train_of


@dataclass(frozen=True)
class Dimension:
    """Which coordinates and which springs a model has.

    Attributes
    ----------
    name : str
        What users call it.
    directions : tuple of str
        Of the coordinates of every body.
    axes : tuple of vector, or None
        Of the springs that act at a point; None: of any spring.
    """

    name: str
    directions: tuple[str, ...]
    axes: tuple[Vector, ...] | None = None

    def has(self, spring: Spring) -> bool:
        """Whether a spring belongs to the model; a stop with a gap to no linear one."""
        if not spring.acts or spring.gap > 0.0:
            return False
        return self.axes is None or (spring.point is not None and spring.axis in self.axes)


# An axle's turning about y is a spin, not a pitch.
VERTICAL = Dimension("vertical", ("z", "pitch"), (DOWN,))
SPATIAL = Dimension("spatial", (*MOVES, *TURNS, SPIN))
MODELS = {model.name: model for model in (VERTICAL, SPATIAL)}
"""By what users call them."""


@dataclass(frozen=True, kw_only=True)
class Multibody:
    """Free bodies on springs; coordinates body by body, those of the wheelsets last.

    Attributes
    ----------
    names : tuple of str
        Of the bodies.
    coordinates : tuple of str
        Of each, the body's name and its direction: ``carbody.z``.
    M, C, K : array, shape (n, n)
        Mass, damping, stiffness.
    stretch : array, shape (n_springs, n)
        Stretch of every spring per coordinate; where weights topple, of what they add as well.
    wheelset_x : array, shape (n_wheelsets,)
        Wheelsets from the front, forward of the first vehicle's middle, m.
    wheel_load : array, shape (n_wheelsets,)
        Static load of one wheel of each, N.
    hertz_coefficient : array, shape (n_wheelsets,)
        C of F = C delta^1.5 of each of its wheels, N/m^1.5.
    wheels : tuple of Cone
        Wheels of each on their rails, as cylinders.
    directions : tuple of Direction
        In which the model's wheels are met.
    """

    names: tuple[str, ...]
    coordinates: tuple[str, ...]
    M: FloatArray
    C: FloatArray
    K: FloatArray
    stretch: FloatArray
    wheelset_x: FloatArray
    wheel_load: FloatArray
    hertz_coefficient: FloatArray
    wheels: tuple[Cone, ...]
    directions: tuple[Direction, ...]

    def at(self, body: str, direction: str) -> int:
        """Place of a body's coordinate among all."""
        return self.coordinates.index(f"{body}.{direction}")

    @property
    def axles(self) -> tuple[str, ...]:
        """Names of the wheelsets."""
        return self.names[len(self.names) - self.wheelset_x.size :]

    @property
    def wheelsets(self) -> NDArray[np.intp]:
        """Places of the wheelsets' vertical coordinates."""
        return np.array([self.at(name, "z") for name in self.axles])

    @property
    def above(self) -> slice:
        """All coordinates but the wheelsets'."""
        first = f"{self.axles[0]}."
        return slice(0, [name.startswith(first) for name in self.coordinates].index(True))

    @property
    def even(self) -> NDArray[np.bool_]:
        """Which coordinates move a body as its own mirror image between the rails."""
        return np.array([name.rpartition(".")[2] not in ODD for name in self.coordinates])

    @property
    def following(self) -> FloatArray:
        """Where everything rests on wheelsets held, each at unit height, (n, n_wheelsets)."""
        follow = np.zeros((len(self.coordinates), self.wheelset_x.size))
        follow[self.wheelsets] = np.eye(self.wheelset_x.size)
        above = np.flatnonzero(self.even[self.above])  # the mirror image of this stands as it does
        K, by_wheelsets = (self.K[np.ix_(above, of)] for of in (above, self.wheelsets))
        follow[above] = -np.linalg.solve(K, by_wheelsets)
        return follow


def build_multibody(stock: Vehicle | Train, dimension: Dimension = VERTICAL) -> Multibody:
    """Assemble a vehicle or a train.

    What acts along the track or across acts on pitch through its height only. The vertical model
    leaves that out: it knows the springs that act downwards.

    Parameters
    ----------
    stock : Vehicle or Train
        Parameters.
    dimension : Dimension
        VERTICAL, or SPATIAL: y, z, roll, pitch and yaw of every body, of a wheelset its spin
        instead of pitch.

    Raises
    ------
    ParameterError
        If a body is not held by the wheelsets, or a wheelset hangs.
    """
    train = train_of(stock)
    parts = train.parts()
    springs = [s for s in parts.springs if dimension.has(s)]
    coordinates, M, C, K, S = assemble(parts.bodies, springs, dimension.directions)
    rest = at_rest(parts, train.gravity)
    if train.toppling:
        T, k = _toppling(parts.bodies, rest.toppling, coordinates)
        K, S = K + T.T @ (k[:, None] * T), np.vstack([S, T])
    wheelsets = [body for body in parts.bodies if body.kind == WHEELSET]
    return Multibody(
        names=names_of(parts.bodies),
        coordinates=coordinates,
        M=M,
        C=C,
        K=K,
        stretch=S,
        wheelset_x=np.array([axle.place[0] for axle in wheelsets]),
        wheel_load=rest.wheel_load,
        hertz_coefficient=np.array([axle.hertz_coefficient for axle in wheelsets]),
        wheels=tuple(axle.wheels for axle in wheelsets if axle.wheels),
        directions=OF_WHEELS[dimension.name],
    )


def _toppling(
    bodies: Sequence[Body], moment: FloatArray, coordinates: tuple[str, ...]
) -> tuple[FloatArray, FloatArray]:
    """Coordinates that a body's forces at rest topple, one a row, and stiffness about them."""
    rows = [
        (coordinates.index(f"{name}.{turn}"), k)
        for name, k in zip(names_of(bodies), moment.tolist(), strict=True)
        for turn in ("roll", "pitch")
        if k != 0.0 and f"{name}.{turn}" in coordinates
    ]
    return np.eye(len(coordinates))[[j for j, _ in rows]], np.array([k for _, k in rows])


__all__ = ["MODELS", "SPATIAL", "VERTICAL", "Dimension", "Multibody", "build_multibody"]
