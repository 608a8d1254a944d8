"""Single defects: how deep, which wheel, which side, when; and how a wheel's centre goes over them.

Against closed forms by hand.
"""

import math

import numpy as np
import pytest

from railcosim.mechanics.ports import Y, Z
from railcosim.parameters import ArgumentError, UnusualWarning
from railcosim.track.irregularity import (
    Corrugation,
    Dip,
    Flat,
    FreshFlat,
    Joint,
    Weld,
    defect,
)
from railcosim.track.irregularity.met import Wheels, centre_path, depths, meetings
from railcosim.track.irregularity.named_defects import KINDS
from railcosim.track.irregularity.usual import DEFECTS

R = 0.46
START = np.array([20.0, 17.5, 2.5, 0.0])
WHEELS = Wheels(START, np.full(4, R))


def surface(*defects, directions=(Z,)):
    """Depths (way, side, wheelset, direction) after ways gone."""
    lies = depths(meetings(defects, WHEELS), 4, directions)
    return lambda *gone: lies(np.array(gone)).reshape(len(gone), 2, 4, len(directions))


def at(one, s, radius=R):
    return np.interp(s, *centre_path(one, radius))


def test_a_long_dip_is_what_it_says():
    """Where the surface bends less than the wheel, z = f - R f'^2 / 2 to second order."""
    one = Dip(depth=1e-3, length=1.0, at=0.0)
    s = np.array([-0.5, -0.25, 0.0, 0.1, 0.5, 0.6])
    f = 0.5e-3 * (1 + np.cos(2 * np.pi * s)) * (np.abs(s) <= 0.5)
    slope = -np.pi * 1e-3 * np.sin(2 * np.pi * s) * (np.abs(s) <= 0.5)
    # Of third order, f'' R times the second: 1 % of 2 um; and the grid of the minimum, 2e-8 m.
    assert at(one, s) == pytest.approx(f - R * slope**2 / 2, abs=5e-8)


def test_a_kink_is_bridged_and_an_edge_is_rolled_over():
    """Between straight sides of slope a the centre stays R a^2 / 2 above; over an edge it turns."""
    a = 0.01
    low = Joint(depth=2.5e-3, length=1.0, at=0.0)  # slopes 4 depth / length = a at the kink
    assert low.angle == pytest.approx(2 * a)
    # The sides bend up away from the kink by f'' = 8 depth / length^2: R is felt as less.
    bridged = 2.5e-3 - a**2 / 2 / (1 / R + 8 * 2.5e-3)
    # Samples are 0.25 mm apart, so a minimum is known to 0.25^2 / (8 R) mm^2 / m = 2e-8 m.
    assert at(low, 0.0) == pytest.approx(bridged, abs=2e-8)
    high = Joint(depth=-2.5e-3, length=1.0, at=0.0)
    s = np.array([-0.5, 0.0, 0.8]) * R * a  # within R a the wheel turns about the edge
    assert at(high, s) == pytest.approx(-2.5e-3 + s**2 / (2 * R), abs=2e-8)
    assert at(high, R * a + 0.1) == pytest.approx(-2.5e-3 * 0.8**2, rel=0.02)


def test_a_short_wave_is_not_met_to_its_bottom():
    """Waves of 10 mm and 50 um bend 10 / m, a wheel 2.2 / m: it goes from crest to crest."""
    one = Corrugation(depth=50e-6, length=0.01, at=0.0, waves=30)
    half = one.extent / 2
    crest, trough = at(one, one.length * np.array([0.0, 0.5]))  # from the middle, a crest
    assert crest == pytest.approx(0.0, abs=1e-9)
    # Between two crests lambda apart the centre falls by (lambda/2)^2 / (2 R) at most.
    assert 0.5 < trough / (0.005**2 / (2 * R)) <= 1.0
    long = Corrugation(depth=50e-6, length=0.3, at=0.0, waves=3)
    assert at(long, 0.0) == pytest.approx(50e-6, rel=1e-6)
    assert at(one, half + 0.1) == at(long, 1.0) == 0.0


def test_a_fresh_flat_rolls_about_its_edges():
    """The centre falls by R (1 - cos(phi0 - |phi|)), phi0 = l / (2 R), and meets a kink."""
    one = FreshFlat(length=0.06)
    s = np.linspace(-0.04, 0.04, 81)
    exact = R * (1 - np.cos(np.clip(0.03 - np.abs(s), 0, 1) / R))
    # A wheel is a parabola here: to (l / 4 R)^2 = 1e-3 of it.
    assert at(one, s) == pytest.approx(exact, abs=1e-3 * exact.max())
    assert at(one, 0.0) == pytest.approx(0.06**2 / (8 * R), rel=1e-3)


def test_a_worn_flat_is_as_deep_as_published():
    """Deviation l^2 / (16 R); 2.8 % of it the wheel bridges, for it is hollow in the middle."""
    one = Flat(length=0.05)
    depth = 0.05**2 / (16 * R)
    assert one.depth_at(np.array([0.0]), R)[0] == pytest.approx(depth)
    assert 0.96 * depth < at(one, 0.0) < 0.98 * depth
    assert at(one, 0.06) == 0.0


def test_a_weld_is_two_waves():
    one = Weld(depth=-3e-4, short_depth=1e-4, at=0.0)
    s = np.array([0.0, 0.03, 0.25])
    long, short = (
        (1 + np.cos(2 * np.pi * s)) / 2,
        (1 + np.cos(20 * np.pi * np.minimum(s, 0.05))) / 2,
    )
    assert one.depth_at(s, R) == pytest.approx(-3e-4 * long + 1e-4 * short)


def test_a_rail_s_defect_is_met_by_each_wheel_when_it_comes():
    lies = surface(Dip(depth=1e-3, length=1.0, at=30.0, side="right"))
    middle = lies(*(30.0 - START))
    for k in range(4):
        assert middle[k, 1, k, 0] == pytest.approx(1e-3, rel=1e-6)
        others = np.delete(middle[k, 1, :, 0], k)
        assert not others.any()
    assert not middle[:, 0].any()
    before, behind = lies(9.75, 10.25)[:, 1, 0, 0]
    assert before == behind == pytest.approx(0.5e-3, rel=0.01)


def test_a_defect_goes_one_way():
    """What lies behind the first wheel at first is met by those that come behind it alone."""
    lies = surface(Joint(depth=1e-3, length=0.5, at=10.0))
    found = lies(*np.linspace(0.0, 12.0, 2401)).max(axis=0)[:, :, 0]
    assert (found[:, :2] == 0).all()
    assert (found[:, 2:] > 0.98e-3).all()


def test_a_flat_comes_round_with_its_wheel():
    turn = 2 * np.pi * R
    lies = surface(Flat(length=0.05, wheel="2.left", turn=0.25), directions=(Z, Y))
    met = lies(0.25 * turn, 1.25 * turn, 7.25 * turn)
    deepest = at(Flat(length=0.05), 0.0)
    assert met[:, 0, 1, 0] == pytest.approx(deepest, rel=1e-6)
    between = lies(*(turn * np.array([0.0, 0.75, 3.0])))
    assert not between.any()
    met[:, 0, 1, 0] = 0
    assert not met.any()  # no other wheel, and nothing aside
    both = surface(Flat(length=0.05, wheel="3"))(0.5 * turn)
    assert both[0, :, 2, 0] == pytest.approx(deepest, rel=1e-6)


def test_defects_add_up():
    one, other = Dip(depth=1e-3, length=1.0, at=30.0), Dip(depth=2e-3, length=0.5, at=30.2)
    ways = np.linspace(9.0, 12.0, 50)
    assert surface(one, other)(*ways) == pytest.approx(surface(one)(*ways) + surface(other)(*ways))


def test_wheels_of_other_radii():
    """A flat of a smaller wheel is deeper, and comes round sooner."""
    wheels = Wheels(np.array([10.0, 0.0]), np.array([0.4, 0.5]))
    flats = [Flat(length=0.05, wheel=w) for w in ("1", "2")]
    small, large = (meetings([flat], wheels)[0] for flat in flats)
    assert small.period == pytest.approx(2 * np.pi * 0.4)
    assert small.z.max() > 1.2 * large.z.max()


@pytest.mark.parametrize("gone", [0.0, 3.3, np.array([0.0, 10.0, 25.0])])
def test_one_time_or_many_are_the_same_bits(gone):
    lies = depths(meetings([Dip(depth=1e-3, length=3.0, at=30.0)], WHEELS), 4, (Z,))
    many = lies(np.array([0.0, 3.3, 10.0, 25.0]))
    picked = many[np.isin([0.0, 3.3, 10.0, 25.0], gone)]
    assert np.array_equal(np.atleast_2d(lies(np.asarray(gone))), picked)


def test_text():
    assert set(KINDS) == set(DEFECTS)
    one = defect("dip:depth=1e-3,length=1,at=30,side=left")
    assert one == Dip(depth=1e-3, length=1.0, at=30.0, side="left")
    assert defect(str(one)) == one
    assert defect(" flat: length=0.05, wheel=1.left ") == Flat(length=0.05, wheel="1.left")
    assert defect("corrugation:depth=5e-5,length=0.03,at=30,waves=7").extent == pytest.approx(0.21)


@pytest.mark.parametrize(
    ("text", "said"),
    [("dib:at=3", "must be dip, joint, weld, corrugation, flat, fresh-flat; did you mean dip?"),
     ("dip:depth=1e-3,at=30", r"a dip needs length \(m\)"),
     ("dip:depth=3,length=1,at=30", "depth = 3 m: must be >= -0.1 and <= 0.1"),
     ("dip:depth=1e-3,length=0,at=30", "length = 0 m: must be > 0"),
     ("dip:depth=nan,length=1,at=30", "depth = nan m: must be"),
     ("dip:depth=deep,length=1,at=30", "depth = deep: must be a number"),
     ("dip:depth=1e-3,depth=2e-3,length=1,at=30", "depth is given twice"),
     ("dip:deep=1e-3,length=1,at=30", "'deep=1e-3': wanted is some of radius=, at=, side=, depth="),
     ("joint:depth=1e-3,length=1,at=30,side=up", "side = up: must be left, right or both"),
     ("flat:length=0.05,wheel=0", "wheel = 0: must be the number of a wheelset"),
     ("weld:depth=1e-4,length=0.05,at=3", r"short_length = 0.1 m: must be <= length = 0.05"),
     ("corrugation:depth=5e-5,length=0.03,at=3,waves=1.5", "waves = 1.5: must be a whole number")],
)  # fmt: skip
def test_text_that_is_no_defect(text, said):
    with pytest.raises(ArgumentError, match=said):
        defect(text)


def test_millimetres_are_doubted():
    with pytest.warns(UnusualWarning, match="dip: length = 500 m is unusual.*Meant 500 mm"):
        defect("dip:depth=1e-3,length=500,at=300")


@pytest.mark.parametrize(
    ("one", "said"),
    [(Flat(length=0.05, wheel="5"), "wheel = 5: there are 4 wheelsets"),
     (Dip(depth=1e-3, length=1.0, at=17.9), "wheelset 2 stands on it at first, at 17.5 m"),
     (Flat(length=0.05, turn=0.0), "wheelset 1 stands on it at first")],
)  # fmt: skip
def test_what_no_wheel_can_meet(one, said):
    with pytest.raises(ArgumentError, match=said):
        meetings([one], WHEELS)


@pytest.mark.parametrize(
    ("one", "way"),
    [(Dip(depth=1e-3, length=1.0, at=-5.0), math.inf),  # behind the last
     (Dip(depth=1e-3, length=1.0, at=30.0), 30.0 - 20.0 - 0.5),
     (Flat(length=0.05, wheel="1", turn=0.5), np.pi * R - 0.025)],
)  # fmt: skip
def test_from_what_way_on_a_wheel_comes_to_it(one, way):
    met = meetings([one], WHEELS)
    beyond = met[0].s[-1] - one.extent / 2  # where the round of a wheel touches first
    ways = (0.999 * (min(way, 1e5) - beyond), 1.001 * min(way, 1e5))
    assert [any(m.met_within(w) for m in met) for w in ways] == [False, math.isfinite(way)]


@pytest.mark.parametrize("one", [Dip(depth=0.1, length=0.01, at=30.0), Corrugation(
    depth=1e-4, length=1e-6, at=30.0)])  # fmt: skip
def test_what_no_wheel_can_be_laid_on_is_refused_at_once(one):
    with pytest.raises(ArgumentError, match="too long, too fine or too steep"):
        centre_path(one, R)


def test_a_radius_that_nobody_tells():
    unknown = Wheels(START, np.full(4, np.nan))
    with pytest.raises(ArgumentError, match="does not say how large its wheels are"):
        meetings([Flat(length=0.05)], unknown)
    assert meetings([Flat(length=0.05, radius=0.4)], unknown)[0].period == pytest.approx(
        0.8 * np.pi
    )
