"""The native runtime with any number of wheelsets, under sanitizers, against itself with few.

With two and four wheelsets it is held elsewhere: against the numpy runtime, exponentials, energy.
More of them add up (forces from outside), or are lifted one by one (contacts inside).
"""

import struct
import zlib
from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import block_diag

from railcosim.fmus.interface import Start, interface
from railcosim.fmus.start import contact_defaults
from railcosim.mechanics.ports import FORCE, Layout
from railcosim.mechanics.shapes import Everywhere
from railcosim.track.reduced import reduce_track
from railcosim.vehicle.modal import vehicle_body
from railcosim.vehicle.multibody import build_multibody
from railcosim.vehicle.parameters import Vehicle

STEP, SPEED = 1e-3, 70.0  # s, m/s
LAW = contact_defaults(Vehicle())
LIFTED = -0.01  # m, of a wheel


@pytest.fixture(scope="module")
def reduced(tiny_track):
    return reduce_track(tiny_track)


@pytest.fixture
def track(made, reduced, tmp_path):
    """Function that makes a track under a layout."""
    known = {}

    def make(layout, *, with_contact=False):
        if layout not in known:
            body = reduced.under(layout)
            start = Start(loads=[0.0] * body.ports, positions=[0.0] * layout.wheelsets, contact=LAW)
            table = interface(body, start, with_contact=with_contact)
            folder = tmp_path / f"{layout.wheelsets}-{len(layout.sides)}"
            known[layout] = made(folder, body, table)
        return known[layout]

    return make


@pytest.fixture
def fmi():
    return 3  # beneath it the runtime is the same


def begin(one, positions, loads, quantity, layout):
    """Initialised with wheelsets there, under loads at the ports."""
    one("enter", 0.0)
    place(one, positions, loads, quantity, layout)
    reply = one("exit")
    assert reply.status == "OK", reply


def place(one, positions, loads, quantity, layout):
    values = dict(zip(layout.of_axles("position"), map(float, positions), strict=True))
    values |= dict(zip(layout.names(quantity), map(float, loads), strict=True))
    reply = one.set(values)
    assert reply.status == "OK", reply


def read(one, names):
    reply = one("get", len(names), *(one.ref(n) for n in names))
    assert reply.status == "OK", reply
    return np.array(reply.numbers)


def roll(one, positions, loads, quantity, layout, names, steps=3):
    """Outputs after every step of wheels that roll under loads that change."""
    begin(one, positions, loads(0), quantity, layout)
    seen = []
    for k in range(steps):
        place(one, positions + SPEED * STEP * k, loads(k), quantity, layout)
        reply = one("step", k * STEP, STEP)
        assert reply.status == "OK", reply
        seen.append(read(one, names))
    one.driver("free", one.place)
    return np.array(seen)


def spread(wheelsets):
    """Positions all around a ring of 20 m, none where another is."""
    return 0.3 + 19.0 * np.arange(wheelsets)[::-1] / wheelsets


@pytest.mark.parametrize("sides", [("left", "right"), ("left",)], ids=["rails", "rail"])
@pytest.mark.parametrize("wheelsets", [1, 2, 5, 8, 16, 32, 64])
def test_forces_add_up(driver, use, track, wheelsets, sides):
    """Motions at one wheelset under all forces: the sum of those under the forces of each."""
    layout, two = Layout(wheelsets, sides), Layout(2, sides)
    x, chance = spread(wheelsets), np.random.default_rng(wheelsets)
    force = 1e4 * chance.normal(size=(3, len(sides), wheelsets))
    asked = wheelsets - 1  # the last: of the last block of rows
    outputs = ("rail_{}", "rail_v{}")
    names = [p.name(q) for q in outputs for p in layout.ports_of(wheelsets)]
    whole = roll(use(driver, track(layout), 3), x, lambda k: force[k].ravel(), FORCE, layout, names)
    names, parts = [p.name(q) for q in outputs for p in two.ports_of(1)], np.zeros_like(whole)
    for k in range(wheelsets):
        other = (k if k != asked else asked - 1) % wheelsets
        own = k == asked

        def loads(step, k=k, own=own):
            alone = np.zeros((len(sides), 2))
            alone[:, 0 if own else 1] = force[step][:, k]
            return alone.ravel()

        pair = x[[asked, other]]
        parts += roll(use(driver, track(two), 3), pair, loads, FORCE, two, names)
    # Rounding of as many sums as there are wheelsets.
    assert whole == pytest.approx(parts, abs=1e-12 * np.abs(parts).max())
    assert np.abs(whole).min() > 0


@pytest.mark.parametrize("wheelsets", [1, 5, 8, 13])
def test_derivatives_by_forces_of_the_step(driver, use, track, wheelsets):
    """A linear track: what another force over the step changes is its derivative by it."""
    layout = Layout(wheelsets)
    one, x = use(driver, track(layout), 3), spread(wheelsets)
    loads = np.linspace(5e4, 1e5, 2 * wheelsets)
    outputs = [p.name("rail_{}") for p in layout.ports]
    begin(one, x, loads, FORCE, layout)
    one("set_boolean", one.ref("derivatives_of_step"), 1)
    place(one, x, loads, FORCE, layout)
    one("save", 0)
    one("step", 0.0, STEP)
    before = read(one, outputs)
    for k in {0, wheelsets - 1, 2 * wheelsets - 1}:
        known = one.ref(layout.ports[k].name(FORCE))
        unknown = [one.ref(n) for n in outputs]
        told = one("directional", len(unknown), *unknown, 1, known, 1, 1e3, len(unknown))
        assert told.status == "OK", told
        one("restore", 0)
        place(one, x, loads + 1e3 * (np.arange(loads.size) == k), FORCE, layout)
        one("step", 0.0, STEP)
        changed = read(one, outputs) - before
        # The difference of deflections of 1 mm, each rounded.
        assert told.numbers == pytest.approx(changed, abs=1e-15)
        assert np.abs(changed).max() > 1e-9
        one("restore", 0)
        place(one, x, loads, FORCE, layout)
        one("step", 0.0, STEP)


def test_rates_of_the_states_do_not_know_how_many_wheelsets_there_are(driver, use, track):
    """Those of the ring's modes, under forces at two wheelsets of five and at no others."""
    five, two, x = Layout(5), Layout(2), spread(5)
    names = ["left", "right"]
    rates = []
    for layout, chosen in ((five, [0, 4]), (two, [0, 1])):
        fmu = track(layout)
        one = use(driver, fmu, 3, "me")
        positions = x if layout is five else x[[0, 4]]
        force = np.zeros((2, layout.wheelsets))
        begin(one, positions, force.ravel(), FORCE, layout)
        force[:, chosen] = [[1e4, -2e4], [3e4, 5e3]]
        place(one, positions, force.ravel(), FORCE, layout)
        found = one("rates", fmu.states)
        assert found.status == "OK", found
        ring = fmu.states // 2 - len(names) * layout.wheelsets
        rates.append(np.array(found.numbers).reshape(2, -1)[:, :ring])
    assert rates[0] == pytest.approx(rates[1], abs=1e-14 * np.abs(rates[1]).max())  # rounding
    assert np.abs(rates[0]).max() > 1


@pytest.mark.parametrize(("wheelsets", "pressed"), [(5, [0, 1, 3, 4]), (16, [1, 6, 11, 14])])
def test_lifted_wheels_are_not_there(driver, use, track, wheelsets, pressed):
    """Contacts inside: four wheelsets among others in the air roll as the four alone."""
    x, height = spread(wheelsets), np.array([1.3e-3, 1.1e-3, 1.2e-3, 1.4e-3])
    runs = []
    for layout, where in ((Layout(wheelsets), pressed), (Layout(4), [0, 1, 2, 3])):
        positions = x if layout.wheelsets == wheelsets else x[pressed]

        def loads(k, layout=layout, where=where):
            z = np.full((2, layout.wheelsets), LIFTED)
            z[0, where] = height + 2e-5 * k
            z[1, where] = height[::-1] - 1e-5 * k
            return z.ravel()

        ports = np.array(layout.ports).reshape(2, -1)[:, where].ravel()
        names = [p.name(q) for q in ("rail_{}", "rail_v{}", FORCE) for p in ports]
        one = use(driver, track(layout, with_contact=True), 3)
        reply = one("set_boolean", one.ref("contact.nonlinear"), 1)
        assert reply.status == "OK", reply
        runs.append(roll(one, positions, loads, "wheel_{}", layout, names).reshape(3, 3, -1))
    many, alone = runs
    # Rounding, which 20 internal steps with a contact each make larger.
    assert np.abs(many - alone).max(axis=2).ravel() == pytest.approx(
        0, abs=1e-10 * np.abs(alone).max(axis=(0, 2)).max()
    )
    assert (np.abs(many - alone) <= 1e-10 * np.abs(alone).max(axis=(0, 2))[:, None]).all()
    assert alone[:, 2].min() > 1e3


def doubled(body):
    """Two vehicles beside each other; coordinates of the wheelsets last."""
    one = body.coordinates
    above = one.rigid.shape[0] - 4
    order = np.r_[:above, above + 4 : 2 * above + 4, above : above + 4, -4:0]

    def twice(array):
        return block_diag(array, array)

    rigid, zeros = twice(one.rigid)[order], np.zeros_like
    coordinates = replace(
        one,
        bodies=("one", "two"),
        names=tuple(map(str, order)),
        even=2 * one.even,
        wheelsets=np.arange(2 * above, 2 * above + 8),
        modes=twice(one.modes)[order],
        rigid=rigid,
        through=twice(one.through)[order],
        # Both start on wheels that just touch the rail.
        start_s=zeros(twice(one.start_s)),
        start_r=zeros(twice(one.start_r)),
        wheelset_x=np.concatenate([one.wheelset_x, one.wheelset_x - 25.0]),
    )
    shapes = Everywhere(out=twice(body.shapes.out), into=twice(body.shapes.into))
    return replace(
        body, layout=Layout(8), poles=np.tile(body.poles, 2), even=2 * body.even, shapes=shapes,
        rigid_out=twice(body.rigid_out), rigid_into=twice(body.rigid_into),
        even_rigid=2 * body.even_rigid,
        preload=np.tile(body.preload, 2), coordinates=coordinates,
    )  # fmt: skip


def test_a_vehicle_of_two(driver, use, made, tmp_path):
    """Eight wheelsets of two vehicles that are not coupled: each as it is alone."""
    body, eight, four = vehicle_body(build_multibody(Vehicle())), Layout(8), Layout(4)
    seen = []
    for layout, model in ((eight, doubled(body)), (four, body)):
        n = layout.wheelsets
        start = Start(loads=[0.0] * 2 * n, positions=[0.0] * n, contact=LAW)
        table = interface(model, start, with_contact=True)
        fmu = made(tmp_path / str(n), model, table)
        for vehicle in range(2):
            if layout is eight and vehicle:
                continue
            one = use(driver, fmu, 3)
            one("set_boolean", one.ref("contact.nonlinear"), 1)
            one("enter", 0.0)
            assert one("exit").status == "OK"
            rail = -1e-4 + 1e-5 * np.arange(16).reshape(2, 8)  # another under every wheel
            rail = rail if layout is eight else rail[:, 4 * vehicle : 4 * vehicle + 4]
            found = []
            for k in range(5):
                now = (rail * (1 + 0.1 * k)).ravel()
                values = dict(zip(layout.names("rail_{}"), now, strict=True))
                assert one.set(values).status == "OK"
                assert one("step", k * STEP, STEP).status == "OK"
                found.append(read(one, layout.names(FORCE)).reshape(2, -1))
            seen.append(np.array(found))
    both, first, second = seen
    alone = np.concatenate([first, second], axis=2)
    assert both == pytest.approx(alone, abs=1e-9 * np.abs(alone).max())  # rounding, Newton's 1e-12
    assert np.ptp(alone, axis=0).min() > 10


# --- files from strangers -------------------------------------------------------------------------

HEAD, ENTRY = struct.Struct("<8sQQII"), struct.Struct("<24sII3QQ")


def altered(whole, name, change):
    """The file with another content of one section of integers, and a checksum that is right."""
    data = bytearray(whole)
    (sections,) = struct.unpack_from("<I", data, 24)
    for k in range(sections):
        entry = ENTRY.unpack_from(data, HEAD.size + k * ENTRY.size)
        if entry[0].rstrip(b"\0").decode() == name:
            values = np.frombuffer(whole, "<i4", int(entry[3]), int(entry[6])).copy()
            change(values)
            data[entry[6] : entry[6] + values.nbytes] = values.tobytes()
    struct.pack_into("<Q", data, 16, zlib.crc32(bytes(data[HEAD.size :])))
    return bytes(data)


@pytest.mark.parametrize(("place", "value", "words"), [
    (0, 0, "number of wheelsets"), (0, -4, "number of wheelsets"),
    (0, 65, "number of wheelsets"), (0, 2**31 - 1, "number of wheelsets"),
    (0, 5, "preloads"), (1, 0, "number of sides"), (1, 3, "number of sides"),
    (1, 1, "preloads"), (2, 0, "number of directions"), (2, 7, "number of directions"),
    (2, 2, "mirror"),
])  # fmt: skip
def test_sizes_that_make_no_sense(driver, tiny, tmp_path, place, value, words):
    fmu = tiny["TrackWithContact"]

    def change(values):
        values[place] = value

    whole = (fmu.resources / "model.bin").read_bytes()
    (tmp_path / "model.bin").write_bytes(altered(whole, "layout", change))
    reply = driver("new", 0, "cs", fmu.guid, f"{tmp_path}/", 0)
    assert reply.status == "NULL"
    assert words in reply.log[0]


@pytest.mark.parametrize("moves", [0, 2, -1])
def test_directions_that_there_are_not(driver, tiny, tmp_path, moves):
    """Modes that move in no direction, or in a second one of a vertical track."""
    fmu = tiny["TrackWithContact"]

    def change(values):
        values[3] = moves

    whole = (fmu.resources / "model.bin").read_bytes()
    (tmp_path / "model.bin").write_bytes(altered(whole, "segments", change))
    reply = driver("new", 0, "cs", fmu.guid, f"{tmp_path}/", 0)
    assert reply.status == "NULL"
    assert "a segment of modes" in reply.log[0]
