"""A force that rolls along a rail: how far and how fast the rail's material gives way under it.

The finite elements of the whole ring, by Newmark's method, know nothing of modes and of what they
leave out. The force runs over their nodes, so they are fine; and inside an element, which a force
does not bend by itself, its own flexibility is added in closed form.
"""

from dataclasses import replace

import numpy as np
import pytest
from scipy import sparse
from scipy.sparse.linalg import splu

from railcosim.mechanics.ports import Layout, Y
from railcosim.mechanics.stepping import along, coefficients
from railcosim.reference.ring import build_ring
from railcosim.track.parameters import Mesh, Slab, Track
from railcosim.track.reduced import reduce_track
from railcosim.track.section import ASIDE, SPATIAL, VERTICAL

STEP, TOGETHER = 2e-5, 8  # s; steps an element of the finite elements
TRACK = Track(mesh=Mesh(cells=6), slab=Slab(length=1.2))  # a ring of 7.5 m
A_BAY = 64  # finite elements
ELEMENT = TRACK.fastening.spacing / A_BAY
SPEED = ELEMENT / (TOGETHER * STEP)  # 61 m/s
LOADS = {
    "constant": np.ones_like,
    "600 Hz": lambda t: 1.0 + 0.5 * np.sin(2 * np.pi * 600 * t),
}
# Of the swing, displacement and rate, aside: measured 0.6 and 10 %, 0.9 and 1.2 %. Under a constant
# force material hardly moves, by 1.5 mm/s for 1 kN: nodes that knock leave 0.1. Down: measured 0.04
# and 1.2 %, 0.5 and 0.9 %; shapes without a kink at railseats have 1.6 and 3 % of a constant force.
WITHIN = {
    ("aside", "constant"): (0.01, 0.12),
    ("aside", "600 Hz"): (0.012, 0.016),
    ("down", "constant"): (0.001, 0.018),
    ("down", "600 Hz"): (0.006, 0.012),
}


def journey(load):
    """Time, places and forces to the right: at rest first, then over two railseats."""
    t = STEP * np.arange(1100)
    starts = 1e-3  # s, smoothly
    s = np.minimum(t, starts)
    x = 0.7 + SPEED * (t - s + 0.5 * (s - starts / np.pi * np.sin(np.pi * s / starts)))
    return t, x, LOADS[load](t)


def by_finite_elements(t, x, force, directions):
    """Motions in all directions under a force in the first of them, and rates."""
    a_bay = A_BAY // (4 if Y in directions else 1)  # rails that twist have four times as many
    fine = replace(TRACK, mesh=replace(TRACK.mesh, elements_per_bay=a_bay))
    ring, count = build_ring(fine, directions, np.array([])), len(directions)
    M, C, K, h = ring.M, ring.C, ring.K, STEP
    heads, along_first = ring.heads(x)[: count * t.size], np.eye(count)[0]
    rows = [heads[count * i : count * (i + 1)] for i in range(t.size)]
    u = splu(sparse.csc_array(K)).solve(rows[0].T @ (force[0] * along_first))
    v, a = np.zeros_like(u), np.zeros_like(u)
    effective = splu(sparse.csc_array(M + h / 2 * C + h**2 / 4 * K))
    out = [(rows[0] @ u, rows[0] @ v)]
    for row, F in zip(rows[1:], force[1:], strict=True):
        u, v = u + h * v + h**2 / 4 * a, v + h / 2 * a
        a = effective.solve(row.T @ (F * along_first) - C @ v - K @ u)
        u, v = u + h**2 / 4 * a, v + h / 2 * a
        out.append((row @ u, row @ v))
    moved, rate = np.swapaxes(out, 0, 1)
    # A bar between its nodes: xi (1 - xi) L / GJ, and the same of shear. Its material goes with
    # half of what that changes by as the force rolls on.
    rail, xi = fine.rail, (x / ELEMENT) % 1
    if Y in directions:
        arm = rail.head_height
        shear = rail.shear_coefficient_lateral * rail.shear_modulus * rail.area
        own = np.array(
            [arm**2 / rail.torsional_rigidity + 1 / shear, arm / rail.torsional_rigidity]
        )
    else:
        own = np.array([1 / rail.shear_stiffness])
    gives = xi * (1 - xi) * ELEMENT
    speed = np.gradient(x, t)
    moved += np.outer(gives * force, own)
    rate += np.outer(0.5 * speed * (1 - 2 * xi) * force + gives * np.gradient(force, t), own)
    return moved, rate


def reduced(t, x, force, directions):
    of = SPATIAL if Y in directions else VERTICAL  # nothing goes aside by itself
    body = reduce_track(TRACK, of).under(Layout(1, directions=of))
    told = np.array([of.index(d) for d in directions])
    c, forces = coefficients(body.poles, STEP), np.zeros((t.size, body.ports))
    forces[:, told[0]] = force
    met, out = body.at(x[:1]), []
    state = met.rest(forces[0])
    for i in range(t.size):
        if i:
            middle, last = body.at((x[i - 1 : i] + x[i : i + 1]) / 2), body.at(x[i : i + 1])
            between = (forces[i - 1] + forces[i]) / 2
            drives = met.drive(forces[i - 1]), middle.drive(between), last.drive(forces[i])
            state, met = along(c, state, *drives), last
        out.append((met.motion(state)[told], met.velocity(state, forces[i])[told]))
    return np.swapaxes(out, 0, 1)


@pytest.mark.slow  # a thousand steps of a ring of finite elements
@pytest.mark.parametrize(("way", "load"), WITHIN)
def test_material_under_a_rolling_force(way, load):
    """Down, or sideways and in roll: displacement, and the material's rate, over railseats too.

    An oscillator under the wheel that takes a notch of flexibility with it, from railseat to
    railseat, has the displacement and errs in the rate by 0.9 of the swing.
    """
    case = (*journey(load), {"aside": ASIDE, "down": VERTICAL}[way])
    (moved, rate), (ours, our_rate) = by_finite_elements(*case), reduced(*case)

    def passing(values):  # over the passage of an element: nodes of the finite elements knock
        mean = np.full(TOGETHER, 1 / TOGETHER)
        return np.stack([np.convolve(v, mean, "valid") for v in values.T])

    both = ((moved, ours), (rate, our_rate))
    for (exact, found), within in zip(both, WITHIN[way, load], strict=True):
        truth, model = passing(exact)[:, 150:], passing(found)[:, 150:]
        assert (np.abs(model - truth).max(axis=1) < within * np.ptp(truth, axis=1)).all()
