"""Motions of the rail's head in modes of a ring, as a table along a cell."""

from __future__ import annotations

import numpy as np

from railcosim.mechanics.arrays import ComplexArray, FloatArray

from .along import along_cell, by_bay, rows_along, smoothed
from .cell import Cell
from .left_out import Directions
from .ring import RingModes
from .section import Bar


def head_shapes(cell: Cell, ring: RingModes, directions: Directions) -> ComplexArray:
    """Motion and slope of the modes at the head of the left rail, (n_rows, 2 k, n).

    Direction by direction, on rows along the cell, of which a railseat has two. The slope is the
    rotation and the shear angle, which is one in each element: at a node the mean of both sides,
    but beside a railseat, which it steps at, as the two elements of that side continue it. With the
    elements' own interpolation a rolling wheel would feel a kink at every node, of up to half the
    largest slope, and between nodes the receptance would be wrong by 2.5 % at 1 kHz; with the kink
    at railseats rounded off, by 0.8 %.
    """
    section, rows = cell.section, rows_along(cell.track)
    at = np.abs(cell.nodes - rows.nodes[:, None]).argmin(axis=1)[rows.node]
    nodal = ring.shapes[: cell.rail_size].reshape(-1, section.size, ring.poles.size)
    L, turn = np.diff(cell.nodes)[:, None], np.exp(1j * ring.mu)  # the cell before, the cell behind
    long = np.concatenate([L[-1:], L, L[:1]])
    out = np.zeros((rows.node.size, len(directions), 2, ring.poles.size), dtype=complex)
    parts = [section.deflections(n, 0.0, -cell.track.rail.head_height) for n in directions]
    for i, member in enumerate(section.members):
        first = section.element_unknowns(i)[0]
        w = nodal[:, first]
        if isinstance(member, Bar):
            constant, turned = np.diff(w, axis=0) / L, np.zeros_like(w)
        else:
            theta, phi = nodal[:, first + 1], member.softness(L)
            mean = (theta[:-1] + theta[1:]) / 2
            constant, turned = phi / (1 + phi) * (np.diff(w, axis=0) / L - mean), theta
        around = np.concatenate([constant[-1:] / turn, constant, constant[:1] * turn])
        shear = ((around[:-1] + around[1:]) / 2)[at]
        for row in np.flatnonzero(np.diff(rows.node) == 0):
            before, behind = at[row] + np.array([[0, -1], [1, 2]])
            shear[row] = _continued(around[before], long[before])
            shear[row + 1] = _continued(around[behind], long[behind])
        for k, direction in enumerate(directions):
            if parts[k][i]:
                part = direction.mirror * parts[k][i]
                out[:, k] += part * np.stack([w[at], turned[at] + shear], axis=1)
    return out.reshape(rows.node.size, -1, ring.poles.size)


def _continued(values: ComplexArray, lengths: FloatArray) -> ComplexArray:
    """At the end of the first of two elements, the line through their values in the middle."""
    end: ComplexArray = values[0] + lengths[0] / lengths.sum() * (values[0] - values[1])
    return end


def kinked_shapes(cell: Cell, ring: RingModes, directions: Directions) -> ComplexArray:
    """Motion and slope of the modes at the head of the left rail, (n_rows, 2 k, n).

    Direction by direction, on rows along the cell. Elements are short, and shapes as short at a
    railseat: from one to the next a spline knows their slopes better than the elements' own do.
    """
    track, section, turn = cell.track, cell.section, np.exp(1j * ring.mu)
    first = [section.element_unknowns(i)[0] for i in range(len(section.members))]
    height = -track.rail.head_height
    parts = [d.mirror * section.deflections(d, 0.0, height) for d in directions]
    nodal = ring.shapes[: cell.rail_size].reshape(-1, section.size, ring.poles.size)[:, first]
    bays = by_bay(np.einsum("km,xmn->xkn", parts, nodal), track.bays, turn)
    steps, step = bays.shape[1] - 1, cell.nodes[1] - cell.nodes[0]
    at = np.linspace(0, steps, track.mesh.elements_per_bay + 1)
    along = np.stack([smoothed(steps, at), smoothed(steps, at, 1) / step])
    rows: ComplexArray = along_cell(np.einsum("vex,bxkn->bekvn", along, bays), turn)
    return rows.reshape(len(rows), -1, ring.poles.size)
