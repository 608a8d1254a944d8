"""Tracks of two kinds in time: against the line without end, and a long finite one marched."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from scipy.sparse import lil_array
from scipy.sparse.linalg import splu

from railcosim.parameters import ParameterError
from railcosim.track.cell import EVEN, build_cell
from railcosim.track.closed_line import ClosedLine, check_places
from railcosim.track.layers import Layer
from railcosim.track.parameters import Fastening, Mesh, Rail, Sensor, Slab, Track
from railcosim.track.receptance import Point
from railcosim.track.reduced_line import reduce_line
from railcosim.track.transition import Line, line_receptance

from .reduced_body import check_draws_no_power, deflection, driven_and_seen, receptance

BLOCKS = Track(
    rail=Rail(loss_factor=0.01), slab=Slab(present=False),
    layers=(Layer(name="block", mass=150.0, stiffness=6e7, damping=8e4),),
    fastening=Fastening(spacing=0.6, damping=6e4),
    mesh=Mesh(cells=40, elements_per_bay=6, highest_frequency=3000),
)  # fmt: skip
SLABS = Track(
    rail=Rail(loss_factor=0.01), fastening=Fastening(stiffness=1.2e7, damping=6e4),
    mesh=Mesh(cells=6, elements_per_bay=6, highest_slab_frequency=600, highest_frequency=2000),
)  # fmt: skip
JOINT = 13.2  # m: 18 of 40 cells are behind 0
PLACES = [JOINT + x for x in (-5.1, -0.6, -0.3, -0.05, 0.0, 0.05, 0.3125, 1.25, 2.5, 5.9)]
OMEGA = 2 * np.pi * np.array([3.0, 40.0, 150.0, 420.0, 900.0])


def closed(*tracks, joints=(JOINT,)):
    return ClosedLine(line=Line(tracks=tracks, joints=joints))


LINE = closed(BLOCKS, SLABS)


@pytest.fixture(scope="module")
def reduced():
    return reduce_line(LINE)


@pytest.mark.parametrize("x", PLACES)
def test_receptance_on_either_side_of_the_joint(reduced, x):
    """The line without end is solved by other means: no modes, no ring, no end sent round."""
    here = [Point(x=x)]
    exact = line_receptance(LINE.line, OMEGA, here, here, viscous=True)[:, 0, 0]
    error = np.abs(receptance(reduced, OMEGA, x)[:, 0] / exact - 1)
    # Modes fade from 1.8 kHz on. Measured 1e-5 at 3 Hz, 6e-4 at 420 Hz, 6e-3 at 900 Hz: as with
    # one kind. A joint that is not there, or at another place, is felt by 10 % and more.
    assert (error < [3e-5, 5e-5, 2e-4, 1.5e-3, 1.2e-2]).all()


def test_one_place_to_another_through_the_joint(reduced):
    a, b = JOINT + 1.2, JOINT - 1.3
    p, B, C = driven_and_seen(reduced, np.array([a, b]))
    points = [Point(x=a), Point(x=b)]
    exact = line_receptance(LINE.line, OMEGA, points, points, viscous=True)
    for w, G in zip(OMEGA, exact, strict=True):
        s = 1j * w
        H = 0.5 * ((C / (s - p)) @ B + (C / (-s - p)).conj() @ B.conj())
        assert np.abs(H[:2, :2] - G).max() < 1e-2 * np.abs(G).max()


@pytest.mark.parametrize("x", [JOINT - 1.0, JOINT - 0.02, JOINT, JOINT + 0.03, JOINT + 1.3])
def test_wheels_draw_no_power(reduced, x):
    """As with one kind."""
    check_draws_no_power(reduced, x)
    assert reduced.poles.real.max() < 0


def test_a_wheel_feels_no_joint(reduced):
    """Shapes and their slopes go through it, and round the ring at 0 m, as rails do."""
    shapes = reduced.shapes
    for x in (JOINT, 0.0, LINE.length):
        at = [shapes.at(np.array([x + d]), 1) for d in (-2e-6, -1e-6, 1e-6, 2e-6)]
        size = np.abs(shapes.table[:, 0]).max()
        out = np.array([out[0] for out, _, _ in at]) / size
        assert np.abs(out[2] - out[1]).max() < 1e-4  # 2 um of a wave of 0.3 m or longer: 4e-5
        before, behind = out[1] - out[0], out[3] - out[2]
        # In single precision; both rails have one section, so no kink of shear.
        assert np.abs(behind - before).max() < 1e-6
        local = np.array([own[0, 0, 0] for _, _, own in at])
        assert np.abs(local[2] / local[1] - 1) < 1e-4


def chained(track_cells):
    """M, C, K of even loads of cells behind each other, free at both ends; and their places."""
    cells = [(build_cell(t, EVEN), n) for t, n in track_cells]
    size = sum(n * (c.K.shape[0] - 2) for c, n in cells) + 2
    M, C, K = (lil_array((size, size)) for _ in range(3))
    first, places, begin = 0, [], 0.0
    for cell, n in cells:
        rail = cell.rail_size
        inner = [*range(rail - 2), *range(rail, cell.K.shape[0])]
        for _ in range(n):
            at = np.empty(cell.K.shape[0], int)
            at[inner] = first + np.arange(len(inner))
            first += len(inner)
            at[rail - 2 : rail] = first, first + 1
            for whole, own in ((M, cell.M), (C, cell.viscous_damping()), (K, cell.K)):
                whole[np.ix_(at, at)] += own
            places.append((begin, cell, at))
            begin += cell.track.cell_length
    return M.tocsc(), C.tocsc(), K.tocsc(), places


@pytest.mark.slow  # 300 steps of a model in Python, and 90 m of finite elements: 8 s
def test_a_load_that_moves_over_the_joint(reduced):
    """70 m/s, from 10 m before to 10 m behind: Newmark on a finite line."""
    step, speed, load = 1e-3, 70.0, 8e4
    position = JOINT - 10.5 + speed * step * np.arange(301)
    before = 70
    M, C, K, places = chained([(BLOCKS, before), (SLABS, 9)])
    begins = np.array([x for x, _, _ in places])

    def row(x):
        x += before * BLOCKS.cell_length - JOINT
        k = int(np.searchsorted(begins, x, side="right")) - 1
        found = np.zeros(K.shape[0])
        begin, cell, at = places[k]
        found[at] = cell.rail_row(x - begin)
        return found

    fine = 5  # steps of Newmark's in one of ours
    h = step / fine
    solve = splu((M + h / 2 * C + h**2 / 4 * K).tocsc()).solve
    u = splu(K).solve(load * row(position[0]))
    v, a = np.zeros_like(u), np.zeros_like(u)
    exact = [row(position[0]) @ u]
    for begin, end in pairwise(position):
        for k in range(1, fine + 1):
            u_half, v_half = u + h * v + h**2 / 4 * a, v + h / 2 * a
            force = load * row(begin + (end - begin) * k / fine)
            a = solve(force - C @ v_half - K @ u_half)
            u, v = u_half + h**2 / 4 * a, v_half + h / 2 * a
        exact.append(row(end) @ u)
    found = deflection(reduced, position, np.array([load, load]), step, 2e-4)
    exact = np.array(exact)
    behind, ahead = exact[80:110].mean(), exact[220:].mean()
    assert abs(ahead / behind - 1) > 0.3  # the kinds differ
    # Measured 2.8e-3: between its nodes a beam of elements is that much too stiff.
    assert np.abs(found - exact).max() < 5e-3 * exact.max()


@pytest.mark.slow  # modes of a ring of 83 bays, alone: 4 s
def test_three_soft_bays_between():
    """Two joints, and an odd number of cells between; the first kind goes on behind them."""
    soft = replace(BLOCKS, fastening=replace(BLOCKS.fastening, spacing=0.5, stiffness=1.5e7))
    three = closed(BLOCKS, soft, BLOCKS, joints=(JOINT, JOINT + 1.5))
    body = reduce_line(three)
    for x in (JOINT - 0.3, JOINT, JOINT + 0.75, JOINT + 1.25, JOINT + 1.5, JOINT + 2.1):
        here = [Point(x=x)]
        exact = line_receptance(three.line, OMEGA, here, here, viscous=True)[:, 0, 0]
        error = np.abs(receptance(body, OMEGA, x)[:, 0] / exact - 1)
        assert (error < [3e-5, 5e-5, 2e-4, 1.5e-3, 1.2e-2]).all(), x
        one = line_receptance(LINE.line, OMEGA, here, here, viscous=True)[:, 0, 0]
        assert np.abs(one / exact - 1).max() > 0.02


def test_what_a_ring_cannot_be_is_refused():
    for joint, told in ((13.0, "such as 13.2"), (24.6, "such as 24"), (0.0, "such as 0.6")):
        with pytest.raises(ParameterError, match=f"multiple of 0.6 m from 0.6 to 24 m.*{told}"):
            closed(BLOCKS, SLABS, joints=(joint,))
    with pytest.raises(ParameterError, match="is the same kind as before; leave it out"):
        closed(BLOCKS, BLOCKS)
    seen = replace(BLOCKS, sensor=(Sensor(of="rail", side="left", at=3.0),))
    with pytest.raises(ParameterError, match="have no sensors"):
        closed(seen, SLABS)
    short = replace(BLOCKS, mesh=replace(BLOCKS.mesh, cells=4))
    with pytest.raises(ParameterError, match="too short, waves sent back"):
        closed(short, replace(SLABS, mesh=replace(SLABS.mesh, cells=4)), joints=(1.2,))
    begin, end = LINE.clear
    check_places(LINE, [begin, end])
    with pytest.raises(ParameterError, match=f"must be from {begin:.1f} to {end:.1f} m"):
        check_places(LINE, [begin - 0.1, end])
