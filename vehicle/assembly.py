"""Bodies and springs as mass, damping and stiffness."""

from __future__ import annotations

from collections.abc import Collection, Sequence

import numpy as np

from railcosim.mechanics.arrays import FloatArray
from railcosim.parameters import ParameterError

from .bodies import Body, Spring, names_of


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
