"""Single places that are different: against the whole ring in finite elements, changed there."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.sparse import csr_array
from scipy.sparse.linalg import splu

from railcosim.analysis.response.track_receptance import track_receptance
from railcosim.analysis.response.track_words import change_of
from railcosim.mechanics.ports import Z
from railcosim.parameters import ArgumentError, ParameterError
from railcosim.reference.ring import build_ring
from railcosim.track.layers import Layer
from railcosim.track.local import LocalChange
from railcosim.track.parameters import Fastening, Mesh, Rail, Slab, Track
from railcosim.track.receptance import Point, direct_receptance, infinite_receptance

D, THIRD = 0.6, 1.5  # m: spacing, and a railseat, the third
OMEGA = 2 * np.pi * np.array([10.0, 80.0, 300.0, 900.0])
X = np.array([0.3, THIRD, 1.95])  # nodes of the regular mesh: cells have those alone as well
POINTS = [Point(x=float(x), side=side) for side in (-1, 1) for x in X]


def bays(layer):
    return Track(
        rail=Rail(loss_factor=0.01), slab=Slab(present=False), layers=(layer,),
        mesh=Mesh(cells=12, elements_per_bay=4), fastening=Fastening(spacing=D, loss_factor=0.1),
    )  # fmt: skip


BLOCKS = bays(Layer(name="block", mass=100.0, stiffness=3e7, loss_factor=0.2))
SLEEPERS = bays(Layer(name="sleeper", kind="sleeper", unsupported=0.4))


def brute_force(track, change):
    """All points for a load at the first, with the ring's matrices changed by hand."""
    ring = build_ring(track, (Z,), X)
    heads = ring.heads(X).toarray()
    one = np.zeros((ring.K.shape[0], 2))  # the third railseat's blocks, or its sleeper's z and roll
    (rails,) = ring.chains
    one[2 * rails.section.size * rails.nodes.size + 2 * 2 + np.arange(2), np.arange(2)] = 1
    dK, dC, dM = change(track, heads, one)
    found = []
    for w in OMEGA:
        whole = ring.K + 1j * ring.K_loss + 1j * w * ring.C - w**2 * ring.M
        solved = splu((whole + dK + 1j * w * dC - w**2 * dM).tocsc()).solve(heads[0] + 0j)
        found.append(heads @ solved)
    return np.array(found)


def springs(stretch, k, c, loss):
    s = csr_array(np.atleast_2d(stretch))
    return k * (1 + 1j * loss) * (s.T @ s), c * (s.T @ s), 0 * (s.T @ s)


def soft_pad(track, heads, one):
    """Left, 0.3 of it left; heads[1] is the left rail at the third seat."""
    pad = track.fastening
    return springs(heads[1] - one[:, 0], -0.7 * pad.stiffness, -0.7 * pad.damping, 0.1)


def hanging_block(track, heads, one):
    layer = track.layers[0]
    return springs(one.T, -layer.stiffness, -layer.damping, layer.loss_factor)


def hanging_sleeper(track, heads, one):
    """Springs all along the two ends: of z and of roll, by the integrals of 1 and y^2."""
    layer = track.layers[0]
    a, b = layer.unsupported / 2, layer.length / 2
    around = np.sqrt((b**3 - a**3) / (3 * (b - a)))
    rows = np.stack([one[:, 0], around * one[:, 1]])
    return springs(rows, -2 * layer.stiffness, -2 * layer.damping, 0.0)


def masses(track, heads, one):
    s = csr_array(heads[[2, 5]])  # both rails, between railseats
    return 0 * (s.T @ s), 0 * (s.T @ s), 20.0 * (s.T @ s)


CHANGES = {
    "soft pad": (BLOCKS, soft_pad, LocalChange(what="fastening", x=THIRD, value=0.3, sides=(-1,))),
    "hanging block": (BLOCKS, hanging_block, LocalChange(what="block", x=THIRD, value=0.0)),
    "hanging sleeper": (SLEEPERS, hanging_sleeper, LocalChange(what="sleeper", x=THIRD, value=0.0)),
    "masses": (SLEEPERS, masses, LocalChange(what="mass", x=1.95, value=20.0)),
}


@pytest.mark.parametrize("kind", CHANGES)
def test_is_the_ring_changed_by_hand(kind):
    track, by_hand, change = CHANGES[kind]
    got = direct_receptance(track, OMEGA, POINTS[:1], POINTS, changes=[change])[:, :, 0]
    exact = brute_force(track, by_hand)
    equal = direct_receptance(track, OMEGA, POINTS[:1], POINTS)[:, :, 0]
    scale = np.abs(exact).max(axis=1, keepdims=True)
    assert (np.abs(got - exact) / scale).max() < 1e-9
    assert (np.abs(got - equal) / scale).max() > 1e-3  # it does something


def test_all_at_once_and_one_after_the_other():
    """Two halves of a change are the change; on slabs, without end, loss factors viscous too."""
    track = Track(fastening=Fastening(loss_factor=0.2), mesh=Mesh(elements_per_bay=4))
    seat = 0.3125
    here = [Point(x=seat)]

    def receptance(*parts, viscous=False):
        changes = [LocalChange(what="fastening", x=seat, value=part) for part in parts]
        return infinite_receptance(track, OMEGA, here, here, viscous=viscous, changes=changes)

    # Two springs changed at one place: their changes add.
    assert receptance(0.7, 0.8) == pytest.approx(receptance(0.5), rel=1e-9)
    assert receptance(1.0) == pytest.approx(receptance(), rel=1e-12)
    stiff = receptance(0.5) / receptance(0.5, viscous=True)
    assert np.abs(stiff - 1).max() > 1e-3


def test_far_away_it_does_not_matter():
    track, here = Track(mesh=Mesh(elements_per_bay=4)), [Point(x=0.3125)]
    equal = infinite_receptance(track, OMEGA, here, here)
    errors = []
    for seats in (1, 16, 64):
        change = LocalChange(what="fastening", x=0.3125 + 0.625 * seats, value=0.0)
        found = infinite_receptance(track, OMEGA, here, here, changes=[change])
        errors.append(np.abs(found / equal - 1).max())
    assert errors[0] > 0.01
    assert errors[0] > 10 * errors[1] > 100 * errors[2]


@pytest.mark.parametrize(
    ("what", "x", "value", "said"),
    [("ballast", THIRD, 0.0, "must be one of mass, fastening, block"),
     ("fastening", 1.4, 0.0, "there is no railseat; the nearest is at 1.5 m, all 0.6 m apart"),
     ("block", THIRD, -1.0, "must be >= 0"),
     ("mass", 1.95, -5.0, "mass@1.95 = -5 kg: must be >= 0")],
)  # fmt: skip
def test_refuses(what, x, value, said):
    change = LocalChange(what=what, x=x, value=value)
    with pytest.raises(ParameterError, match=said):
        direct_receptance(BLOCKS, OMEGA, POINTS[:1], POINTS[:1], changes=[change])


@pytest.mark.parametrize("receptance", [direct_receptance, infinite_receptance])
def test_a_spacing_that_is_rounded_changes_far_seats_as_near_ones(receptance):
    """Seat 120 of 6 a cell is 4e-6 m from where it is counted to be; alone with the load there."""
    track = Track(
        slab=Slab(length=3.75, joint=0.05, young_modulus=1e11),
        fastening=Fastening(spacing=0.6333333), mesh=Mesh(cells=44, elements_per_bay=2),
    )  # fmt: skip
    found = []
    for cell in (0, 20):
        x = (6 * cell + 0.5) * track.fastening.spacing
        change = LocalChange(what="fastening", x=x, value=0.0)
        here = [Point(x=cell * track.cell_length + 0.5 * track.fastening.spacing)]
        found.append(receptance(track, OMEGA, here, here, changes=[change]))
    equal = receptance(track, OMEGA, here, here)
    assert np.abs(found[0] / equal - 1).max() > 0.01
    assert found[1] == pytest.approx(found[0], rel=1e-9)


def test_nothing_is_left_but_never_less():
    """Twice is once too often; on a ring once around is the same railseat."""
    once = LocalChange(what="fastening", x=THIRD, value=0.0)
    around = LocalChange(what="fastening", x=THIRD + BLOCKS.length, value=0.5, sides=(1,))
    other = LocalChange(what="fastening", x=THIRD + D, value=0.0)
    at = (BLOCKS, OMEGA, POINTS[:1], POINTS[:1])
    with pytest.raises(ParameterError, match="add up, and -1 of it would be left; must be >= 0"):
        infinite_receptance(*at, changes=[once, once])
    with pytest.raises(ParameterError, match=r"add up, and -0\.5 of it would be left"):
        direct_receptance(*at, changes=[once, around])
    infinite_receptance(*at, changes=[once, around, other])


def test_a_name_that_is_none_of_one_layer_is_refused():
    blocks = replace(BLOCKS, layers=(Layer(), Layer(mass=50.0)))
    change = LocalChange(what="block", x=THIRD, value=0.0)
    with pytest.raises(ParameterError, match="2 layers are called so; give it a name"):
        direct_receptance(blocks, OMEGA, POINTS[:1], POINTS[:1], changes=[change])


@pytest.mark.parametrize("ring", [False, True])
def test_places_of_load_and_change_are_counted_from_one_beginning(ring):
    """A cell farther both are what they are in the first."""
    track, f = Track(mesh=Mesh(elements_per_bay=2, highest_slab_frequency=500)), np.array([300.0])
    found = [
        track_receptance(
            track, f, position=str(x), ring=ring, changes=[change_of(track, f"mass@{x}=30")]
        )["receptance"].values
        for x in (2.3, 7.3)
    ]
    assert found[1] == pytest.approx(found[0], rel=1e-9)


def test_how_it_is_written():
    track = Track()
    assert change_of(track, "fastening.left@railseat+1=0") == LocalChange(
        what="fastening", x=2.8125 + 0.625, value=0.0, sides=(-1,)
    )
    assert change_of(track, "mass@-1.2=15") == LocalChange(what="mass", x=-1.2, value=15.0)
    assert str(change_of(track, "block.right@railseat-2=0.5")) == "block.right@1.5625=0.5"
    for text in ("fastening", "fastening@=0", "fastening@here=0", "mass@1=", "a@railseat+x=1"):
        with pytest.raises(ArgumentError, match="must be WHAT@PLACE=VALUE"):
            change_of(track, text)


def test_what_is_continuous_has_no_single_place():
    track = Track(
        slab=Slab(present=False), layers=(Layer(name="base", kind="continuous"),),
        fastening=Fastening(continuous=True),
    )  # fmt: skip
    with pytest.raises(ParameterError, match="is continuous"):
        infinite_receptance(
            track, OMEGA, POINTS[:1], POINTS[:1],
            changes=[LocalChange(what="base", x=0.3125, value=0.0)],
        )  # fmt: skip
