"""Bodies in modal form as linear models, without an FMU."""

from __future__ import annotations

import numpy as np
from scipy.sparse import csc_array

from railcosim.master.component import FloatArray, Variable
from railcosim.master.linear.realisation import ComplexArray
from railcosim.master.linear.state_space import StateSpace
from railcosim.mechanics.modal import Met
from railcosim.mechanics.ports import FORCE
from railcosim.vehicle.bodies import MOVES

FALLING = ((0.0, 1.0), (0.0, 0.0))
"""A rigid-body coordinate and its rate."""


def linear_of(met: Met, name: str) -> StateSpace:
    """A track or a vehicle where it is met: from forces at its ports to their motions.

    Parameters
    ----------
    met : Met
        The body, with wheelsets at places.
    name : str
        What responds.

    Returns
    -------
    StateSpace
        Outputs are the coordinates of a vehicle, then the motions at the ports.
    """
    body, layout = met.body, met.body.layout
    unit = [met.drive(force) for force in np.eye(body.ports)]
    into, rigid_into = np.array([one.s for one in unit]).T, np.array([one.r for one in unit]).T
    out, rigid_out = seen_at_ports(met)
    names = list(layout.names(body.face.motion))
    units = [port.direction.motion for port in layout.ports]
    if (known := body.coordinates) is not None:
        out, rigid_out = np.vstack([known.modes, out]), np.vstack([known.rigid, rigid_out])
        units = [*("m" if n.rpartition(".")[2] in MOVES else "rad" for n in known.names), *units]
        names = [*known.names, *names]
    p = body.poles
    turning = np.array([[p.real, -p.imag], [p.imag, p.real]]).transpose(2, 0, 1)
    return StateSpace(
        name=name,
        A=_blocks(np.concatenate([turning, np.tile(FALLING, (len(rigid_into), 1, 1))])),
        B=np.vstack([_pairs(into.real, into.imag), _pairs(0.0 * rigid_into, rigid_into)]),
        C=np.vstack([_pairs(out.real.T, -out.imag.T), _pairs(rigid_out.T, 0.0 * rigid_out.T)]).T,
        D=np.zeros((len(names), body.ports)),
        inputs=tuple(
            Variable(name=port.name(FORCE), unit=port.direction.force) for port in layout.ports
        ),
        outputs=tuple(Variable(name=n, unit=u) for n, u in zip(names, units, strict=True)),
    )


def seen_at_ports(met: Met) -> tuple[ComplexArray, FloatArray]:
    """Motions at all ports by modes, and by rigid-body coordinates."""
    body = met.body
    even, odd = np.split(met.out.T, [body.even])
    shared = np.concatenate([body.joined(even, 0.0 * even), body.joined(0.0 * odd, odd)]).T
    if met.local.size:
        own = np.zeros((body.ports, body.ports), complex)
        k = met.local.shape[1]
        for i, shapes in enumerate(met.local):
            own[i * k : (i + 1) * k, i * k : (i + 1) * k] = shapes
        # What else there is of oscillators, of what is seen elsewhere, moves no port.
        beyond = np.zeros((body.ports, body.poles.size - body.shared - body.ports))
        shared = np.hstack([shared, own, beyond])
    even_, odd_ = np.split(body.rigid_out.T, [body.even_rigid])
    rigid = np.concatenate([body.joined(even_, 0.0 * even_), body.joined(0.0 * odd_, odd_)]).T
    return shared, rigid


def _pairs(one: FloatArray, other: FloatArray) -> FloatArray:
    """Rows of two arrays in turn."""
    return np.stack([one, other], axis=1).reshape(2 * len(one), one.shape[1])


def _blocks(blocks: FloatArray) -> csc_array:
    """Blocks of two along the diagonal."""
    at = 2 * np.arange(len(blocks))[:, None] + np.arange(2)
    row, column = np.broadcast_arrays(at[:, :, None], at[:, None, :])
    size = 2 * len(blocks)
    return csc_array((blocks.ravel(), (row.ravel(), column.ravel())), shape=(size, size))
