"""What a vehicle's springs carry at rest, and how its weights topple it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from railcosim.mechanics.arrays import FloatArray
from railcosim.parameters import ParameterError

from .assembly import assemble
from .bodies import WHEELSET, Body, Parts, Spring, names_of

VERTICAL = ("z", "pitch")
"""Coordinates that weights move."""
LOOSE = 1e-12  # of the stiffest motion of what is above held wheelsets: four digits above rounding


@dataclass(frozen=True, kw_only=True)
class Rest:
    """A vehicle under its weight, all wheelsets at one height.

    Attributes
    ----------
    wheel_load : array, shape (n_wheelsets,)
        Static load of one wheel of each, N.
    toppling : array, shape (n_bodies,)
        Stiffness about x and y that the springs' forces on a body add, N m/rad: a load that stands
        above the centre of mass, or is held below it, topples the body, so less than 0.
    """

    wheel_load: FloatArray
    toppling: FloatArray


def at_rest(parts: Parts, gravity: float) -> Rest:
    """Forces of the suspension where all wheelsets stand at one height.

    Raises
    ------
    ParameterError
        If something is not held, or a wheelset hangs.
    """
    springs = [s for s in parts.suspension if acts_down(s)]
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
    place = dict(zip(coordinates, gravity * sunk, strict=False))
    return Rest(wheel_load=load, toppling=_toppling(parts.bodies, springs, place))


def _toppling(
    bodies: tuple[Body, ...], springs: list[Spring], place: dict[str, float]
) -> FloatArray:
    """See `Rest`. A point that turns with its body by a small angle rises by (z - z_0) angle^2 / 2.

    So a force F that pushes it down does the work -F (z - z_0) angle^2 / 2, about x as about y.
    """
    index = {body: i for i, body in enumerate(bodies)}
    names = names_of(bodies)
    moment = np.zeros(len(bodies))
    for spring in springs:
        ends = ((spring.a, 1.0), (spring.b, -1.0))
        stretch = sum(
            sign
            * spring.felt(body, direction)
            * place.get(f"{names[index[body]]}.{direction}", 0.0)
            for body, sign in ends
            for direction in VERTICAL
        )
        z = spring.point[2] if spring.point else 0.0  # those that act down have a point
        for body, sign in ends:
            force = -sign * spring.axis[2] * spring.k * stretch
            moment[index[body]] += force * (z - body.place[2])
    return moment


def acts_down(spring: Spring) -> bool:
    """Whether weights stretch it."""
    return spring.point is not None and spring.axis[2] != 0.0 and spring.acts
