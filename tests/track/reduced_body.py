"""What is asked of a reduced track under wheels of one direction, whatever lies along its ring."""

from itertools import pairwise

import numpy as np

from railcosim.analysis.response.bodies import seen_at_ports
from railcosim.mechanics.motion import FromOutside, Inputs, Mover
from railcosim.mechanics.ports import Layout
from railcosim.mechanics.stepping import State


def receptance(reduced, omega, x):
    """Deflections of both rails at x for a force on the left one, (n_omega, 2)."""
    body = reduced.under(Layout(1))
    met, none = body.at(np.array([x])), np.empty(0)
    b = met.drive(np.array([1.0, 0.0])).s
    found = np.empty((omega.size, 2), complex)
    for k, w in enumerate(omega):
        plus, minus = b / (1j * w - body.poles), b / (-1j * w - body.poles)
        found[k] = met.motion(State((plus + minus) / 2, none, none))
        found[k] += 1j * met.motion(State(1j * (minus - plus) / 2, none, none))
    return found


def driven_and_seen(reduced, position):
    """Poles, B and C: s' = poles s + B f, motions Re(C s), at all ports of wheels there."""
    body = reduced.under(Layout(position.size))
    met = body.at(position)
    B = np.stack([met.drive(force).s for force in np.eye(body.ports)], axis=1)
    return body.poles, B, seen_at_ports(met)[0]


def check_draws_no_power(reduced, x):
    """Two wheels, one at x, at no frequency and not at once."""
    poles, B, C = driven_and_seen(reduced, np.array([x, x - 2.4]))
    for s in 2j * np.pi * np.geomspace(1, 30e3, 100):
        Y = 0.5 * s * ((C / (s - poles)) @ B + (C / (s.conj() - poles)).conj() @ B.conj())
        assert np.linalg.eigvalsh(Y + Y.conj().T)[0] > 0
    jump = (C @ B).real
    assert np.linalg.eigvalsh(jump + jump.T)[0] > 0


def deflection(reduced, position, force, step, internal):
    """Of the left rail under forces on both that move from one position to the next in a step."""
    body = reduced.under(Layout(1))
    mover = Mover(body, FromOutside(), internal)
    state = body.at(position[:1]).rest(force)
    found = [body.at(position[:1]).motion(state)[0]]
    for begin, end in pairwise(position):
        a, b = np.array([begin]), np.array([end])
        state = mover.step(state, Inputs(a, force), Inputs(b, force), step)
        found.append(body.at(b).motion(state)[0])
    return np.array(found)
