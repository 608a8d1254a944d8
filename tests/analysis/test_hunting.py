"""Critical speeds on a track that gives way."""

from pathlib import Path

import numpy as np
import pytest

from railcosim.analysis.response.bodies import linear_of
from railcosim.analysis.response.choices import Gravity, Wheels
from railcosim.analysis.response.hunting import critical_speed, way_of
from railcosim.analysis.response.rolling import ON_RAIL
from railcosim.analysis.response.rolling_pair import compliance_of, rails_of
from railcosim.analysis.response.vehicle_modes import vehicle_modes
from railcosim.mechanics.ports import Layout
from railcosim.parameters import ArgumentError, UnusualWarning
from railcosim.track.parameters import Mesh, Slab, Track
from railcosim.track.receptance import Point, direct_receptance
from railcosim.track.reduced import reduce_track
from railcosim.vehicle.eigenmodes import poles_of
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.hunting import critical_speed as first_growth
from railcosim.vehicle.multibody import SPATIAL, build_multibody
from railcosim.vehicle.on_rails import OF_RAILS, cones_of, rolling
from railcosim.vehicle.parameters import Vehicle
from railcosim.vehicle.properties import Rolling

BODY = build_multibody(Vehicle(), SPATIAL)
RAILS = [
    (port.wheelset, f"{port.side}.rail_{port.direction.name}")
    for port in Layout(4, directions=ON_RAIL).ports
]


def as_of_contacts(compliance):
    """Of ports, in the order of the coordinates of wheelset after wheelset."""
    order = [RAILS.index((i, name)) for i in (1, 2, 3, 4) for name in OF_RAILS]
    return compliance[np.ix_(order, order)]


def of_matrices(compliance=None, conicity=0.1):
    """Poles by the speed from M, C and K: rails without mass but what their compliance knows of."""
    contacts = rolling(BODY, cones_of(BODY, conicity))
    n, m = len(BODY.coordinates), len(OF_RAILS) * 4
    M, C_v = np.zeros((2, n + m, n + m))
    M[:n, :n], C_v[:n, :n] = BODY.M, BODY.C
    K_both = np.zeros((n + m, n + m), complex)
    K_both[:n, :n] = BODY.K

    def at(speed):
        K, C = contacts(speed).with_rails(BODY)
        if compliance is None:
            return poles_of(*(A[:n, :n].real for A in (M, C_v + C, K_both + K)))[0]
        K_both[n:, n:] = np.linalg.inv(as_of_contacts(compliance))
        return poles_of(M, C_v + C, K_both + K)[0]

    return at


@pytest.fixture(scope="module")
def found():
    """The paper's pair at conicity 0.1, on rigid rails and on its track."""
    rigid = way_of(None, Gravity.NORMALS, None, rigid_track=True).on(0.1).critical()
    return rigid, way_of(None, Gravity.NORMALS, Track(), rigid_track=False).on(0.1).critical()


# 5 s of waves at many frequencies.
@pytest.mark.slow
def test_a_track_that_hardly_gives_way_is_rigid(found):
    """And the change goes with its compliance, as of the whole track (an eighth) at first."""
    compliance = rails_of(Track(), BODY.wheelset_x, 3.0)
    change = []
    for part in (1e-3, 2e-3):
        stiff = first_growth(of_matrices(part * compliance), np.array([20.0, 40.0]))
        change.append(1 - stiff.speed / found[0].speed)
    assert 1.36e-4 < change[0] < 1.7e-4  # the first of it counts most
    assert change[1] == pytest.approx(2 * change[0], rel=1e-2)


def test_a_flexible_track_lowers_it(found):
    """By an eighth: rails that roll move the contact round their heads. An independent model, of
    another fastening's roll and without gyroscopes, has 12 %."""
    rigid, flexible = found
    assert 0.85 < flexible.speed / rigid.speed < 0.89


def test_vehicle_and_track_swing_freely_there(found):
    """The dynamic stiffness is singular at that speed and frequency, rails eliminated by hand."""
    flexible = found[1]
    s, n = 2j * np.pi * flexible.frequency, len(BODY.coordinates)

    def singular(speed, s):
        contacts = rolling(BODY, cones_of(BODY, 0.1))(speed)
        Z = np.linalg.inv(as_of_contacts(rails_of(Track(), BODY.wheelset_x, s.imag / (2 * np.pi))))
        D = np.zeros((n + len(Z),) * 2, complex)
        D[:n, :n] = s * s * BODY.M + s * BODY.C + BODY.K
        D[n:, n:] = Z
        axles = [f"wheelset[{i}]" for i in (1, 2, 3, 4)]
        for i, axle in enumerate(axles):
            own = [BODY.at(axle, d) for d in ("y", "z", "roll", "spin", "yaw")]
            at = np.array([*own, *range(n + 6 * i, n + 6 * i + 6)])
            D[np.ix_(at, at)] += contacts.K[i] + s * contacts.C[i]
        whole = D[:n, :n] - D[:n, n:] @ np.linalg.solve(D[n:, n:], D[n:, :n])
        size = np.sqrt(np.abs(np.diag(whole)))
        return np.linalg.svd(whole / np.outer(size, size), compute_uv=False)[-1]

    there = singular(flexible.speed, s)
    # The track is taken at the frequency of the round before, a thousandth away at most.
    assert there < 1e-3 * singular(1.1 * flexible.speed, s)
    assert there < 1e-3 * singular(flexible.speed, 1.1 * s)


def test_rails_are_those_of_the_contact():
    """Their order; a force to the right at the head of the left rail moves and rolls it."""
    assert OF_RAILS[:3] == ("left.rail_y", "left.rail_z", "left.rail_roll")
    G = as_of_contacts(rails_of(Track(), BODY.wheelset_x, 1.0))
    assert G.shape == (24, 24)
    assert G[0, 0].real == pytest.approx(1 / 8.7e6, rel=0.05)  # published reading of the fastening
    assert G[1, 1].real == pytest.approx(1 / 57e6, rel=0.05)
    # Above the foot: the head goes to the right as the rail turns, about x pointing forward, to the
    # right side down.
    assert G[2, 0].real > 0
    assert np.abs(G[1, 0]) < 1e-6 * np.abs(G[0, 0])
    assert np.abs(G - G.T).max() < 1e-9 * np.abs(G).max()  # reciprocity


def test_a_rigid_track_is_none():
    with pytest.raises(ArgumentError, match="rails that do not move have no track"):
        critical_speed(track=Track(), rigid_track=True)


def test_on_rigid_rails_by_either_door(found):
    result = critical_speed(conicity=[0.1], rigid_track=True)
    assert float(result["critical_speed"][0]) == pytest.approx(3.6 * found[0].speed, rel=1e-12)
    again = first_growth(of_matrices(), np.array([20.0, 40.0]))
    assert again.speed == pytest.approx(found[0].speed, rel=1e-8)


def test_what_a_vehicle_says_of_rolling_is_not_passed_over():
    """A file with profiles of its own would get a cone's speed without a word."""
    vehicle = Vehicle(rolling=Rolling(conicity=0.2))
    with pytest.raises(ArgumentError, match=r"\[rolling\]"):
        critical_speed(vehicle, [0.1], rigid_track=True)
    with pytest.raises(ArgumentError, match=r"\[rolling\]"):
        vehicle_modes(vehicle, wheels=Wheels.CONTACT, speed=20.0, conicity=0.1)
    with pytest.warns(UnusualWarning, match=r"\[rolling\] is left out"):
        held = vehicle_modes(vehicle)
    assert held.sizes["name"] == 15  # held wheels do not roll: 35 less 4 x 5


def test_one_conicity_that_no_speed_is_slow_enough_for_does_not_cost_the_others():
    found = critical_speed(read_stock(Path("wagon")), [0.05, 1.0], rigid_track=True)
    first, last = found["critical_speed"].values
    assert 10.0 < first < 25.0  # km/h: undamped across
    assert last == 0.0
    assert np.isnan(found["frequency"].values[1])


def test_sides_of_the_rails_are_those_of_the_contact():
    """On railseats that tilt, what presses a head down moves it outwards: the left one to the left.

    On upright ones left and right would answer alike.
    """
    track = Track(slab=Slab(tilts_rails=True), mesh=Mesh(highest_slab_frequency=600))
    G = rails_of(track, BODY.wheelset_x[:1], 1.0).real
    down, aside = ([3 * side + k for side in (0, 1)] for k in (0, 1))  # ports: down, aside, roll
    left, right = G[aside, down]
    assert left < -1e-2 * G[down[0], down[0]]
    assert right == pytest.approx(-left, rel=1e-9)


@pytest.mark.parametrize("speed", [12.0, 27.0, 60.0])
def test_poles_of_the_linear_model_are_those_of_the_matrices(speed):
    """M, C and K with rails as massless coordinates, against modes and a pencil of first order."""
    rigid = way_of(None, Gravity.NORMALS, None, rigid_track=True)
    flexible = way_of(None, Gravity.NORMALS, Track(), rigid_track=False)
    compliance = rails_of(Track(), BODY.wheelset_x, 2.65)
    for way, frequency, matrices in (
        (rigid, None, of_matrices()),
        (flexible, 2.65, of_matrices(compliance)),
    ):
        ours, theirs = (
            np.sort_complex(p[(np.abs(p) < 400) & (p.imag > 1e-3)])
            for p in (way.on(0.1).poles(frequency)(speed), matrices(speed))
        )
        # Double poles are split by the root of rounding; the largest is 400.
        np.testing.assert_allclose(ours, theirs, atol=1e-6)


# 4 s: a track is linearised.
@pytest.mark.slow
def test_a_linear_model_of_the_track_has_the_compliance_of_its_elements():
    """As of an FMU: from modes of a ring, reduced, by the names of the ports."""
    track = Track(mesh=Mesh(cells=4, highest_frequency=200, highest_slab_frequency=200))
    x = BODY.wheelset_x - BODY.wheelset_x[-1] + track.fastening.spacing / 2
    layout = Layout(4, directions=ON_RAIL)
    met = reduce_track(track, ON_RAIL).under(layout).at(x)
    ours = compliance_of(linear_of(met, "track"), 2.65)
    size = np.sqrt(np.abs(np.outer(np.diag(ours), np.diag(ours))))
    s = 2j * np.pi * 2.65
    both = 1 / (s - met.body.poles), (1 / (s - met.body.poles.conj())).conj()
    real, turned = (both[0] + both[1]) / 2, (both[0] - both[1]) / 2j
    summed = met.compliance(real, 0.0) + 1j * met.compliance(turned, 0.0)
    assert np.abs((ours - summed) / size).max() < 1e-12
    points = [
        Point(x=x[p.wheelset - 1], side={"left": -1, "right": 1}[p.side], direction=p.direction)
        for p in layout.ports
    ]
    ring = direct_receptance(track, np.array([s.imag]), points, points, viscous=True)[0]
    near = [k + np.array([0, 1, 2])[:, None] for k in range(0, 24, 3)]
    for at in near:  # between wheels so few modes are not enough
        assert np.abs((ours - ring)[at, at.T] / size[at, at.T]).max() < 5e-3
