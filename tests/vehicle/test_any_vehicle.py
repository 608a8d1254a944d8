"""Wagons, locomotives, articulated sets and trains against mechanics by hand."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy.linalg import eigh, null_space

from railcosim.vehicle.assembly import assemble
from railcosim.vehicle.bodies import WHEELSET, names_of
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.modal import modal_form
from railcosim.vehicle.multibody import build_multibody
from railcosim.vehicle.names import BUILT_IN
from railcosim.vehicle.parameters import (
    AxlePlace,
    CarBodyPlace,
    Coupler,
    Vehicle,
)
from railcosim.vehicle.train import Train, TrainVehicle, train_of

EXAMPLES = Path(__file__).parents[2] / "examples"
WAGON = read_stock(Path("wagon"))
LOCOMOTIVE = read_stock(EXAMPLES / "locomotive.toml")
ARTICULATED = read_stock(EXAMPLES / "articulated.toml")
# One contact law is for all wheels of a train.
SMALL_WHEELS = replace(LOCOMOTIVE, wheelset=replace(LOCOMOTIVE.wheelset, radius=0.46))
# Everything about it is other in front than behind.
LOPSIDED = replace(
    WAGON,
    carbodies=(CarBodyPlace(x=0.8),),
    axles=(
        AxlePlace(x=5.0, wheelset=replace(WAGON.wheelset, mass=1300.0)),
        AxlePlace(x=-4.0, primary_suspension=replace(WAGON.primary_suspension, stiffness=1.4e6)),
    ),
)
ALL = {
    **{name: read_stock(Path(name)) for name in BUILT_IN},
    "locomotive": LOCOMOTIVE,
    "articulated": ARTICULATED,
    "lopsided": LOPSIDED,
    "train": read_stock(EXAMPLES / "train.toml"),
    "mixed": Train(
        vehicles=(TrainVehicle(vehicle=WAGON), TrainVehicle(vehicle=LOPSIDED, reversed=True)),
        coupler=Coupler(stiffness=2e5, damping=1e4),
    ),
}


def held(body):
    """Frequencies (Hz) with the wheelsets held."""
    above = body.above, body.above
    return np.sqrt(eigh(body.K[above], body.M[above], eigvals_only=True)) / (2 * np.pi)


@pytest.mark.parametrize("name", ALL)
def test_wheels_carry_what_is_weighed(name):
    body, stock = build_multibody(ALL[name]), train_of(ALL[name])
    down = np.array([c.endswith(".z") for c in body.coordinates], dtype=float)
    weight = stock.gravity * down @ body.M @ down
    by_hand = sum(
        2 * one.vehicle.wheel_load * sum(b.kind == WHEELSET for b in one.parts().bodies)
        for one in stock.vehicles
    )
    assert 2 * body.wheel_load.sum() == pytest.approx(weight, rel=1e-12)  # rounding
    assert weight == pytest.approx(by_hand, rel=1e-12)
    # No moment either: about x = 0 and in what is above the wheelsets.
    x = np.array([b.place[0] for b in stock.parts().bodies])
    mass = np.array([b.mass for b in stock.parts().bodies])
    moment = stock.gravity * mass @ x
    assert 2 * body.wheel_load @ body.wheelset_x == pytest.approx(moment, abs=1e-9 * weight)


def test_loads_by_levers():
    """A car body ahead of the axles' middle: by moments about the other axle."""
    body, g = build_multibody(LOPSIDED), 9.81
    front, rear = 42000 * 4.8 / 9, 42000 * 4.2 / 9
    assert body.wheel_load == pytest.approx(
        np.array([front + 1300, rear + 1500]) * g / 2, rel=1e-12
    )


def test_three_wheelsets_of_a_bogie_carry_alike_if_it_is_symmetric():
    body = build_multibody(LOCOMOTIVE)
    assert body.wheel_load == pytest.approx(np.full(6, 126e3 * 9.81 / 12), rel=1e-12)


def test_a_shared_bogie_carries_half_of_each():
    """End cars' centres are not above the middle of their supports, the middle one's is."""
    body = build_multibody(ARTICULATED)
    alone = replace(ARTICULATED, couplers=())  # couplers carry a share: more than by levers
    load = build_multibody(alone).wheel_load * 2
    own = (4420 + 2 * 1680) * 9.81
    # End car: supports at 24.5 and 8.8, centre at 17.0; middle car: half of it at 8.2.
    at_end = 29e3 * 9.81 * (17.0 - 8.8) / (24.5 - 8.8)
    assert load[:2].sum() == pytest.approx(own + at_end, rel=1e-12)
    assert load[2:4].sum() == pytest.approx(own + (29 + 13) * 9.81e3 - at_end, rel=1e-12)
    assert load == pytest.approx(load[::-1], rel=1e-12)
    assert body.wheel_load.sum() == pytest.approx(load.sum() / 2, rel=1e-12)


def test_a_wagon_is_one_body_on_two_springs():
    found = held(build_multibody(WAGON))
    k, m, J, lever = 2e6, 42e3, 700e3, 4.5
    assert found == pytest.approx(
        np.sort(np.sqrt([2 * k / m, 2 * k * lever**2 / J])) / (2 * np.pi), rel=1e-12
    )


def test_a_locomotive_on_held_wheelsets_by_symmetry():
    """Car body and bogies bounce; bogies pitch by themselves; car body and bogies pitch."""
    k_s, k_p, b, a, L = 2 * 0.9e6, 2 * 1.5e6, 0.6, 2.1, 5.5
    M, J, m, j = 75e3, 2.1e6, 18e3, 40e3
    own = 2 * k_s * b**2 + 2 * k_p * a**2  # of a bogie's pitch
    bounce = eigh(
        [[4 * k_s, -4 * k_s], [-4 * k_s, 4 * k_s + 6 * k_p]], np.diag([M, 2 * m]), eigvals_only=True
    )
    # Car body's pitch, both bogies' heave against each other and their pitch: V = 1/2 k s^2 of
    # the stretch s = -x theta - (z -+ b phi) at x = +-(L +- b); front and rear alike.
    K = np.zeros((3, 3))
    for ahead in (b, -b):
        s = np.array([-(L + ahead), -1.0, ahead])
        K += 2 * k_s * np.outer(s, s)
    for ahead in (a, 0.0, -a):
        s = np.array([0.0, 1.0, -ahead])
        K += 2 * k_p * np.outer(s, s)
    pitch = eigh(K, np.diag([J, 2 * m, 2 * j]), eigvals_only=True)
    expected = np.sort([own / j, *bounce, *pitch])
    assert held(build_multibody(LOCOMOTIVE)) == pytest.approx(
        np.sqrt(expected) / (2 * np.pi), rel=1e-10
    )


def test_manchester_vehicle_1():
    """Car body on springs in series; the bogies' mass lowers it a little."""
    found = held(build_multibody(read_stock(Path("manchester"))))
    K_s, K_p = 2 * 0.43e6, 2 * 1.22e6
    series = 1 / (1 / K_s + 1 / (2 * K_p))
    for inertia, lever in ((32000.0, 1.0), (1.97e6, 9.5)):
        by_hand = np.sqrt(2 * series * lever**2 / inertia) / (2 * np.pi)
        nearest = found[np.argmin(np.abs(found - by_hand))]
        assert by_hand * (1 - 4e-3) < nearest < by_hand
    bogie = np.sqrt(2 * K_p * 1.28**2 / 1476) / (2 * np.pi)
    assert np.abs(found / bogie - 1).min() < 1e-12


# Free motions: of the whole in two ways; of each bogie of two axles about its pivot. Three axles
# hold a bogie in its place. Shared bogies: whatever the three suspensions' hinges leave.
@pytest.mark.parametrize(
    ("name", "count"),
    [("paper", 4), ("manchester", 4), ("wagon", 2), ("locomotive", 2), ("lopsided", 2)],
)
def test_rigid_motions(name, count):
    body = build_multibody(ALL[name])
    rigid = modal_form(body).rigid
    assert rigid.shape[1] == count
    assert np.abs(body.K @ rigid).max() < 1e-9 * np.abs(body.K).max()
    # All rise by 1; all turn by 1 about x = 0, the front up.
    places = dict(
        zip(
            names_of(train_of(ALL[name]).parts().bodies),
            (b.place[0] for b in train_of(ALL[name]).parts().bodies),
            strict=True,
        )
    )
    split = [c.rpartition(".") for c in body.coordinates]
    rise = np.array([float(what == "z") for _, _, what in split])
    turn = np.array([-places[one] if what == "z" else 1.0 for one, _, what in split])
    for motion in (rise, turn):
        assert np.abs(body.stretch @ motion).max() < 1e-12


@pytest.mark.parametrize("name", ALL)
def test_rigid_motions_in_space_strain_nothing(name):
    """All five coordinates of every body, all springs: sideways, down, roll and yaw of the whole.

    Pitch strains springs along the track, for no body has a coordinate along it.
    """
    parts = train_of(ALL[name]).parts()
    coordinates, M, _, _, stretch = assemble(parts.bodies, parts.springs)
    assert len(coordinates) == 5 * len(parts.bodies)
    place = np.repeat([b.place for b in parts.bodies], 5, axis=0)
    what = np.array([c.rpartition(".")[2] for c in coordinates])
    x, z = place[:, 0], place[:, 2]
    motions = {
        "y": np.where(what == "y", 1.0, 0.0),
        "z": np.where(what == "z", 1.0, 0.0),
        "roll": np.select([what == "roll", what == "y"], [1.0, -z], 0.0),
        "yaw": np.select([what == "yaw", what == "y"], [1.0, x], 0.0),
    }
    for name_of, motion in motions.items():
        assert np.abs(stretch @ motion).max() < 1e-12, name_of  # rounding of levers up to 60 m
    assert np.trace(M) > 0


def test_the_papers_vehicle_has_35_coordinates_of_which_ten_are_vertical():
    parts = train_of(Vehicle()).parts()
    coordinates, M, C, K, _ = assemble(parts.bodies, parts.springs)
    assert len(coordinates) == 35
    body = build_multibody(Vehicle())
    down = [s for s in parts.springs if s.axis == (0.0, 0.0, 1.0)]
    _, M, C, K, _ = assemble(parts.bodies, down)
    some = np.ix_(*2 * [[coordinates.index(c) for c in body.coordinates]])
    for whole, vertical in ((M, body.M), (C, body.C), (K, body.K)):
        # Left and right alike: nothing that is not vertical is moved.
        assert whole[some] == pytest.approx(vertical, rel=1e-12, abs=1e-9)
        others = [j for j, c in enumerate(coordinates) if c not in body.coordinates]
        assert np.abs(whole[np.ix_(others, some[1].ravel())]).max() < 1e-9


def test_lateral_springs_in_their_place():
    """By hand: what a car body's y and roll feel of the secondary springs at its feet."""
    parts = train_of(Vehicle()).parts()
    coordinates, _, _, K, _ = assemble(parts.bodies, parts.springs)
    y, roll, yaw = (coordinates.index(f"carbody.{what}") for what in ("y", "roll", "yaw"))
    k_x, k_y, k_z, h, b, L = 0.11e6, 0.11e6, 0.27e6, 1.415, 0.978, 7.85
    assert K[y, y] == pytest.approx(4 * k_y, rel=1e-12)
    # Roll to the right (about x forward) moves feet that are h below (z down) to the left.
    assert K[y, roll] == pytest.approx(-4 * k_y * h, rel=1e-12)
    assert K[roll, roll] == pytest.approx(4 * (k_y * h**2 + k_z * b**2), rel=1e-12)
    assert K[yaw, yaw] == pytest.approx(4 * (k_y * L**2 + k_x * b**2), rel=1e-12)


def receptance(stock):
    body, omega = build_multibody(stock), 2 * np.pi * np.array([0.4, 1.3, 7.0, 60.0])
    D = body.K + 1j * omega[:, None, None] * body.C - omega[:, None, None] ** 2 * body.M
    return body, np.linalg.inv(D)


@pytest.mark.parametrize(
    "stock", [LOPSIDED, ALL["mixed"], ARTICULATED], ids=["lopsided", "mixed", "articulated"]
)
def test_reversed_is_mirrored(stock):
    """The rear in front: wheelsets and bodies in the opposite order, pitch the other way."""
    vehicles = tuple(
        replace(one, reversed=not one.reversed) for one in reversed(train_of(stock).vehicles)
    )
    ahead, H = receptance(stock)
    behind, H_reversed = receptance(replace(train_of(stock), vehicles=vehicles))
    count = {kind: sum(n.startswith(kind) for n in ahead.names) for kind in ("carbody", "bogie")}
    count["wheelset"] = ahead.wheelset_x.size
    at, sign = [], []
    for coordinate in ahead.coordinates:
        name, _, what = coordinate.rpartition(".")
        kind, _, number = name.rstrip("]").partition("[")
        other = f"{kind}[{count[kind] + 1 - int(number)}]" if number else kind
        at.append(behind.at(other, what))
        sign.append(-1.0 if what == "pitch" else 1.0)
    mirrored = H_reversed[:, at][:, :, at] * np.outer(sign, sign)
    assert np.abs(H - mirrored).max() < 1e-12 * np.abs(H).max()
    assert np.diff(ahead.wheelset_x) == pytest.approx(np.diff(behind.wheelset_x)[::-1])
    assert ahead.wheel_load == pytest.approx(behind.wheel_load[::-1], rel=1e-12)


def test_it_matters_which_way_round():
    _, H = receptance(LOPSIDED)
    _, other = receptance(Train(vehicles=(TrainVehicle(vehicle=LOPSIDED, reversed=True),)))
    assert np.abs(H[:, -2, -2] / other[:, -2, -2] - 1).max() > 0.01


def test_vehicles_without_couplers_are_single_vehicles():
    train = Train(vehicles=(TrainVehicle(vehicle=WAGON), TrainVehicle(vehicle=SMALL_WHEELS)))
    one, H_1 = receptance(WAGON)
    two, H_2 = receptance(SMALL_WHEELS)
    both, H = receptance(train)
    first = [both.coordinates.index(n) for n in
             ("carbody[1].z", "carbody[1].pitch", "wheelset[1].z", "wheelset[2].z")]  # fmt: skip
    rest = [j for j in range(len(both.coordinates)) if j not in first]
    for own, alone in ((first, H_1), (rest, H_2)):  # to rounding of an inverse
        assert np.abs(H[:, own][:, :, own] - alone).max() < 1e-12 * np.abs(alone).max()
    assert not np.any(H[:, first][:, :, rest])
    assert both.wheel_load == pytest.approx(np.append(one.wheel_load, two.wheel_load), rel=1e-12)
    # Middle to middle: half of each length.
    assert both.wheelset_x == pytest.approx(
        np.append(one.wheelset_x, two.wheelset_x - (15.5 + 20.0) / 2)
    )
    poles = np.concatenate([modal_form(one).poles, modal_form(two).poles])
    assert np.sort_complex(modal_form(both).poles) == pytest.approx(np.sort_complex(poles))


def test_two_wagons_with_a_coupler_by_symmetry():
    """Moving alike they do not feel it; against each other each hangs on twice its stiffness."""
    k = 3e5
    body = build_multibody(
        Train(
            vehicles=(TrainVehicle(vehicle=WAGON), TrainVehicle(vehicle=WAGON, reversed=True)),
            coupler=Coupler(stiffness=k),
        )
    )
    K, end = np.diag([2 * 2e6, 2 * 2e6 * 4.5**2]), 15.5 / 2
    lever = np.array([1.0, end])  # of the first one's rear, which its pitch lowers
    against = K + 2 * k * np.outer(lever, lever)
    M = np.diag([42e3, 700e3])
    expected = [*eigh(K, M, eigvals_only=True), *eigh(against, M, eigvals_only=True)]
    assert held(body) == pytest.approx(np.sqrt(np.sort(expected)) / (2 * np.pi), rel=1e-10)
    # It is closed when both stand loaded, so at rest it carries nothing.
    assert body.wheel_load == pytest.approx(np.tile(build_multibody(WAGON).wheel_load, 2))


@pytest.mark.parametrize("name", ALL)
def test_modal_form_against_a_direct_solve(name):
    body = build_multibody(ALL[name])
    modal = modal_form(body)
    assert modal.poles.real.max() < 0
    for omega in 2 * np.pi * np.array([0.05, 0.7, 6.3, 30.0, 400.0]):
        direct = np.linalg.inv(body.K + 1j * omega * body.C - omega**2 * body.M)
        s = 1j * omega
        found = -modal.rigid @ modal.rigid.T / omega**2 + 0.5 * (
            modal.modes @ (modal.left / (s - modal.poles)[:, None])
            + modal.modes.conj() @ (modal.left.conj() / (s - modal.poles.conj())[:, None])
        )
        # Rounding, times the condition of a nearly critically damped pair.
        assert np.abs(found - direct).max() < 1e-9 * np.abs(direct).max()
    assert modal.rigid.shape[1] == null_space(body.stretch).shape[1]


@pytest.mark.parametrize("name", ALL)
def test_at_rest_on_wheelsets_at_some_heights(name):
    """What follows the wheelsets is in balance; a bogie on two of them leaves their loads."""
    body = build_multibody(ALL[name])
    height = 1e-3 * np.random.default_rng(4).normal(size=body.wheelset_x.size)
    force = body.K @ body.following @ height
    assert np.abs(force[body.above]).max() < 1e-9 * np.abs(body.K).max() * 1e-3
    if name in {"paper", "manchester", "wagon", "lopsided"}:
        assert np.abs(force).max() < 1e-9 * np.abs(body.K).max() * 1e-3
    if name == "locomotive":
        assert np.abs(force).max() > 1e2  # three wheelsets hold a bogie: heights change the loads


def test_what_springs_along_the_track_would_change():
    """Through heights they hold the car body's pitch: 0.946 Hz vertical, 0.953 Hz with them."""
    parts = train_of(Vehicle()).parts()
    found = []
    for springs in (
        parts.springs,
        [s for s in parts.springs if s.axis == (0.0, 0.0, 1.0)],
    ):
        coordinates, M, _, K, _ = assemble(parts.bodies, springs, ("z", "pitch"))
        above = np.ix_(range(6), range(6))
        omega2, modes = eigh(K[above], M[above])
        pitch = np.abs(modes[coordinates.index("carbody.pitch")])
        found.append(np.sqrt(omega2[np.argmax(pitch)]) / (2 * np.pi))
    assert found == pytest.approx([0.953, 0.946], abs=5e-4)  # an independent model's three digits
