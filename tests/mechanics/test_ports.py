"""Directions, sides, order, names: by hand, for one and for three directions."""

import numpy as np
import pytest

from railcosim.mechanics.ports import (
    DIRECTIONS,
    FORCE,
    IRREGULARITY,
    MOST_WHEELSETS,
    RAIL,
    WHEEL,
    Layout,
    Port,
    X,
    Y,
    Z,
)


def test_left_wheels_come_first() -> None:
    """The order and the names that users have known from the first FMU."""
    assert Layout().names(FORCE) == (
        "wheelset[1].left.force_z",
        "wheelset[2].left.force_z",
        "wheelset[3].left.force_z",
        "wheelset[4].left.force_z",
        "wheelset[1].right.force_z",
        "wheelset[2].right.force_z",
        "wheelset[3].right.force_z",
        "wheelset[4].right.force_z",
    )
    assert Layout(2).of_axles("position") == ("wheelset[1].position", "wheelset[2].position")


def test_quantities_of_faces() -> None:
    port = Port(10, "right")
    assert port.name(RAIL.rate) == "wheelset[10].right.rail_vz"
    assert port.name(WHEEL.motion) == "wheelset[10].right.wheel_z"
    assert port.name(IRREGULARITY) == "wheelset[10].right.irregularity_z"
    assert (WHEEL.other, RAIL.other) == (RAIL, WHEEL)


def test_directions_of_a_contact_stand_together() -> None:
    layout = Layout(2, directions=(Z, Y, X))
    assert layout.names(FORCE)[2:5] == (
        "wheelset[1].left.force_x",
        "wheelset[2].left.force_z",
        "wheelset[2].left.force_y",
    )
    assert len(layout.ports) == 12
    assert layout.contacts == 4


@pytest.mark.parametrize("count", [1, 4, 11, MOST_WHEELSETS])
@pytest.mark.parametrize("directions", [(Z,), (Z, Y), DIRECTIONS])
@pytest.mark.parametrize("sides", [("left", "right"), ("left",)])
def test_a_layout_is_found_among_its_own_names(count, directions, sides) -> None:
    """Wheelset 10 is not wheelset 1."""
    layout = Layout(count, sides, directions)
    names = {*layout.names(RAIL.motion), *layout.of_axles("position"), "time", "carbody.z"}
    assert Layout.among(names) == layout
    assert Layout.among({"time", "wheelset[1].az"}) is None


def test_compression_is_wheel_less_rail_less_irregularity() -> None:
    layout = Layout(1)
    assert layout.motions[3:] == (
        "wheelset[1].right.wheel_z",
        "wheelset[1].right.rail_z",
        "wheelset[1].right.irregularity_z",
    )
    values = [0.0, 0.0, 0.0, 5.0, 3.0, 0.5]
    assert (layout.compression @ values).tolist() == [0.0, 1.5]


def test_mirror() -> None:
    """Both rails down is even; both to the right is odd, for the mirror image goes to the left."""
    layout = Layout(1, directions=(Z, Y))
    down, right = np.array([1.0, 0.0, 1.0, 0.0]), np.array([0.0, 1.0, 0.0, 1.0])
    even, odd = layout.halves(down)
    assert even.tolist() == [2.0, 0.0]
    assert odd.tolist() == [0.0, 0.0]
    even, odd = layout.halves(right)
    assert even.tolist() == [0.0, 0.0]
    assert odd.tolist() == [0.0, 2.0]


@pytest.mark.parametrize("directions", [(Z,), (Z, Y, X)])
def test_halves_are_joined_again(directions) -> None:
    """Twice the whole: either rail takes half of what both do."""
    layout = Layout(3, directions=directions)
    values = np.arange(1.0, 1 + len(layout.ports))
    np.testing.assert_array_equal(layout.joined(*layout.halves(values)), 2 * values)


def test_power_is_the_same_in_halves() -> None:
    """Force times motion, over all ports, is that of even and odd parts: no sign is lost."""
    layout = Layout(3, directions=(Z, Y))
    rng = np.random.default_rng(1)
    force = rng.normal(size=len(layout.ports))
    even, odd = rng.normal(size=(2, len(layout.ports) // 2))
    f_even, f_odd = layout.halves(force)
    assert force @ layout.joined(even, odd) == pytest.approx(f_even @ even + f_odd @ odd)


def test_values_of_wheelsets_at_their_ports() -> None:
    layout = Layout(2, directions=(Z, Y))
    assert layout.at_wheelsets([3.0, 4.0]).tolist() == [3, 3, 4, 4, 3, 3, 4, 4]


@pytest.mark.parametrize("wrong", [{"wheelsets": 0}, {"wheelsets": 65}, {"sides": ("right",)}])
def test_no_such_layout(wrong) -> None:
    with pytest.raises(ValueError, match="must be"):
        Layout(**wrong)
