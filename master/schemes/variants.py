"""Which polynomial of the force is held over a step by the interface-Jacobian scheme.

A variant is a few numbers. With tau = 0..1 over the step:

- the components are stopped at the `points` and their motion there is sampled;
- at the `nodes` the compression is interpolated from the samples, and the law gives the force;
  where it asks for rates, they are those of the polynomial between the samples, for then what the
  law takes from a motion it takes from the bodies, and a rate's jump under a force is no matter;
- the force held over the step is projected from those forces, in Legendre polynomials of
  x = 2 tau - 1.

The energy-conserving ones take s + 1 Lobatto points (with the beginning), the polynomial of degree
s through them, and the best approximation of degree s - 1 to the force along it. The work of that
force on both sides is then what the spring gives up, however stiff or nonlinear it is: so where the
components create no energy, neither does the coupling, at any step. (For s = 1 exactly; from s = 2
on as well as Lobatto's points, of degree 2 s - 1, see the motion.) It is Hairer's energy-preserving
collocation [1]_, of order 2 s, with the components in place of free masses.

References
----------
.. [1] E. Hairer, Energy-preserving variant of collocation methods, JNAIAM 5 (2010) 73-84.
.. [2] E. Hairer, G. Wanner, Solving Ordinary Differential Equations II, Springer, 1996, IV.5.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.polynomial import legendre

from railcosim.master.component import FloatArray
from railcosim.master.polynomials import best_fit, lagrange


@dataclass(frozen=True, eq=False)
class Variant:
    """See the module.

    Attributes
    ----------
    name : str
        For people and for results.
    order : int
        Of the error in the step.
    points : tuple of float
        Where the components are stopped, in steps from the beginning; the last is 1.
    rates : bool
        Whether also the rates of the motions at the beginning and at the end are asked for.
    nodes : array, shape (n_nodes,)
        Where the law is evaluated, in steps from the beginning.
    begin : array, shape (n_nodes, 1 or 2)
        Compressions at the nodes by what is known at the beginning: the compression there and,
        with `rates`, its rate times the step.
    answers : array, shape (n_nodes, n_points or 2)
        Compressions at the nodes by those at the points and, with `rates`, the rate at the end
        times the step.
    begin_slopes, answer_slopes : array
        Their rates times the step, likewise.
    project : array, shape (degree + 1, n_nodes)
        Legendre coefficients of the force held, by the forces at the nodes.
    """

    name: str
    order: int
    points: tuple[float, ...]
    rates: bool
    nodes: FloatArray
    begin: FloatArray
    answers: FloatArray
    begin_slopes: FloatArray
    answer_slopes: FloatArray
    project: FloatArray

    @property
    def degree(self) -> int:
        """Of the polynomial of the force."""
        return len(self.project) - 1


def _conserving(s: int, name: str) -> Variant:
    """Lobatto points, and the best polynomial of degree s - 1: order 2 s."""
    # Real, all of them; numpy 2.5 gives them as complex numbers.
    inner = np.sort(legendre.legroots(legendre.legder(np.eye(s + 1)[s])).real)
    points = np.concatenate([[0.0], (inner + 1) / 2, [1.0]])
    nodes, project = best_fit(s - 1)
    weights, slopes = (lagrange(points, nodes, derivative) for derivative in (0, 1))
    return Variant(
        name=name,
        order=2 * s,
        points=tuple(points[1:].tolist()),
        rates=False,
        nodes=nodes,
        begin=weights[:, :1],
        answers=weights[:, 1:],
        begin_slopes=slopes[:, :1],
        answer_slopes=slopes[:, 1:],
        project=project,
    )


def _radau() -> Variant:
    """The line through the forces at 1/3 and 1, the points of Radau IIA [2]_."""
    points = np.array([1 / 3, 1.0])
    slopes = lagrange(np.array([0.0, *points]), points, 1)
    return Variant(
        name="Radau-2",
        order=3,
        points=tuple(points.tolist()),
        rates=False,
        nodes=points,
        begin=np.zeros((2, 1)),
        answers=np.eye(2),
        begin_slopes=slopes[:, :1],
        answer_slopes=slopes[:, 1:],
        project=np.linalg.inv(legendre.legvander(2 * points - 1, 1)),
    )


def _hermite() -> Variant:
    """The cubic through values and rates at both ends, and the best parabola to the force along it.

    The parabola is no less accurate: what is left of a cubic is orthogonal to the motion's own
    parabola.
    """
    nodes, project = best_fit(2)
    t = nodes
    weights = np.stack(
        [
            (1 + 2 * t) * (1 - t) ** 2,
            t * (1 - t) ** 2,
            (3 - 2 * t) * t**2,
            (t - 1) * t**2,
        ],
        axis=1,
    )
    slopes = np.stack(
        [6 * t * (t - 1), (1 - t) * (1 - 3 * t), 6 * t * (1 - t), t * (3 * t - 2)], axis=1
    )
    return Variant(
        name="Hermite",
        order=4,
        points=(1.0,),
        rates=True,
        nodes=nodes,
        begin=weights[:, :2],
        answers=weights[:, 2:],
        begin_slopes=slopes[:, :2],
        answer_slopes=slopes[:, 2:],
        project=project,
    )


AVERAGE_HOLD = _conserving(1, "average hold")
"""The force averaged over the compressions between beginning and end, held: order 2, conserving."""
RADAU_2 = _radau()
"""Order 3; it damps what is too fast for the step."""
HERMITE = _hermite()
"""Order 4 from one sub-step; needs the rates of the motions, and has a largest stable step."""
CONSERVING_4 = _conserving(2, "conserving-4")
"""Order 4, conserving: two sub-steps."""
CONSERVING_6 = _conserving(3, "conserving-6")
"""Order 6, conserving: three sub-steps."""

VARIANTS = {
    "average-hold": AVERAGE_HOLD,
    "radau-2": RADAU_2,
    "hermite": HERMITE,
    "conserving-4": CONSERVING_4,
    "conserving-6": CONSERVING_6,
}
"""By the name on the command line."""
