"""Linear equations of motion of bodies and springs, and the vertical ones among them.

Displacements are measured from the statically loaded vehicle whose wheels just touch the unloaded
track.
"""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from railcosim.parameters import ParameterError

from .bodies import WHEELSET, Body, Parts, Spring, names_of
from .parameters import Vehicle
from .train import Train, train_of

FloatArray = NDArray[np.float64]

VERTICAL = ("z", "pitch")
"""Coordinates of the vertical model. An axle's turning about y is a spin, not a pitch."""
LOOSE = 1e-12  # of the stiffest motion of what is above held wheelsets: four digits above rounding


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
        Stretch of every spring per coordinate.
    wheelset_x : array, shape (n_wheelsets,)
        Wheelsets from the front, forward of the first vehicle's middle, m.
    wheel_load : array, shape (n_wheelsets,)
        Static load of one wheel of each, N.
    """

    names: tuple[str, ...]
    coordinates: tuple[str, ...]
    M: FloatArray
    C: FloatArray
    K: FloatArray
    stretch: FloatArray
    wheelset_x: FloatArray
    wheel_load: FloatArray

    def at(self, body: str, direction: str) -> int:
        """Place of a body's coordinate among all."""
        return self.coordinates.index(f"{body}.{direction}")

    @property
    def wheelsets(self) -> slice:
        """The vertical coordinates of the wheelsets, the last ones."""
        return slice(len(self.coordinates) - self.wheelset_x.size, len(self.coordinates))

    @property
    def above(self) -> slice:
        """All others."""
        return slice(0, self.wheelsets.start)

    @property
    def following(self) -> FloatArray:
        """Where everything rests on wheelsets held at unit heights, shape (n, n_wheelsets)."""
        follow = np.zeros((len(self.coordinates), self.wheelset_x.size))
        follow[self.wheelsets] = np.eye(self.wheelset_x.size)
        K = self.K[self.above, self.above]
        follow[self.above] = -np.linalg.solve(K, self.K[self.above, self.wheelsets])
        return follow


def assemble(
    bodies: Sequence[Body],
    springs: Sequence[Spring],
    directions: Collection[str] | None = None,
) -> tuple[tuple[str, ...], FloatArray, FloatArray, FloatArray, FloatArray]:
    """Assemble bodies and springs.

    Parameters
    ----------
    bodies : sequence of Body
        In order.
    springs : sequence of Spring
        Between them.
    directions : collection of str, optional
        Coordinates that are kept; all if not given.

    Returns
    -------
    tuple
        Names of the coordinates, M, C, K and the stretch of the springs, of those that no kept
        coordinate tells apart as one.
    """
    kept = [
        (name, body, direction, inertia)
        for name, body in zip(names_of(bodies), bodies, strict=True)
        for direction, inertia in zip(body.directions, body.inertias, strict=True)
        if directions is None or direction in directions
    ]
    places: dict[Body, list[int]] = {body: [] for body in bodies}
    if len(places) < len(bodies):
        raise ParameterError("two bodies of one kind are the same and at one place: x must differ")
    for j, (_, body, _, _) in enumerate(kept):
        places[body].append(j)
    S = np.zeros((len(springs), len(kept)))
    for i, spring in enumerate(springs):
        for body, sign in ((spring.a, 1.0), (spring.b, -1.0)):
            for j in places[body]:
                S[i, j] = sign * spring.felt(body, kept[j][2])
    S, k, c = _side_by_side(S, springs)
    M = np.diag([inertia for *_, inertia in kept])
    coordinates = tuple(f"{name}.{direction}" for name, _, direction, _ in kept)
    return coordinates, M, S.T @ (c[:, None] * S), S.T @ (k[:, None] * S), S


def _side_by_side(
    S: FloatArray, springs: Sequence[Spring]
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Springs that the kept coordinates cannot tell apart as one: stretch, k, c."""
    rows: dict[tuple[float, ...], list[float]] = {}
    for row, spring in zip(S.tolist(), springs, strict=True):
        sums = rows.setdefault(tuple(row), [0.0, 0.0])
        sums[0] += spring.k
        sums[1] += spring.c
    k, c = np.array(list(rows.values())).reshape(-1, 2).T
    return np.array(list(rows)).reshape(-1, S.shape[1]), k, c


def build_multibody(stock: Vehicle | Train) -> Multibody:
    """Assemble the vertical model of a vehicle or a train.

    What acts along the track or across acts on pitch through its height only. The vertical model
    leaves that out: it knows the springs that act downwards.

    Raises
    ------
    ParameterError
        If a body is not held by the wheelsets, or a wheelset hangs.
    """
    train = train_of(stock)
    parts = train.parts()
    springs = [s for s in parts.springs if _acts_down(s)]
    coordinates, M, C, K, S = assemble(parts.bodies, springs, VERTICAL)
    wheelsets = [body.place[0] for body in parts.bodies if body.kind == WHEELSET]
    return Multibody(
        names=names_of(parts.bodies),
        coordinates=coordinates,
        M=M,
        C=C,
        K=K,
        stretch=S,
        wheelset_x=np.array(wheelsets),
        wheel_load=_wheel_loads(parts, train.gravity),
    )


def _acts_down(spring: Spring) -> bool:
    return spring.point is not None and spring.axis[2] != 0.0 and spring.acts


def _wheel_loads(parts: Parts, gravity: float) -> FloatArray:
    """Static load of a wheel of each wheelset, N: where all stand at one height.

    Raises
    ------
    ParameterError
        If something is not held, or a wheelset hangs.
    """
    springs = [s for s in parts.suspension if _acts_down(s)]
    coordinates, M, _, K, _ = assemble(parts.bodies, springs, VERTICAL)
    up = len(coordinates) - sum(body.kind == WHEELSET for body in parts.bodies)
    mass = np.array([name.endswith(".z") for name in coordinates]) * np.diag(M)
    size = np.sqrt(np.diag(M)[:up])
    omega2, modes = np.linalg.eigh(K[:up, :up] / np.outer(size, size))
    if omega2[0] <= LOOSE * omega2[-1]:
        name = coordinates[int(np.argmax(np.abs(modes[:, 0])))]
        raise ParameterError(
            f"{name} is free: every car body and bogie must be held in two places by suspensions "
            "that stand on wheelsets"
        )
    sunk = np.linalg.solve(K[:up, :up], mass[:up])
    load: FloatArray = (mass[up:] - K[up:, :up] @ sunk) * gravity / 2
    if load.min() <= 0:
        i = int(np.argmin(load)) + 1
        raise ParameterError(
            f"wheelset {i} would hang: at rest a wheel of it carries {load.min():g} N; must be > 0 "
            "(where the car body's middle is, and what stands on what, decide it)"
        )
    return load


__all__ = ["VERTICAL", "Multibody", "assemble", "build_multibody"]
