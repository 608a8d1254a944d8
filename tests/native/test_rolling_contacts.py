"""Bodies that own contacts which roll, in the native runtime under sanitizers.

Against the numpy runtime, which is held elsewhere against energy, mirrors, orders of convergence
and the monolithic reference (`tests/mechanics/contact/test_owned.py`); and against itself.
"""

from pathlib import Path

import numpy as np
import pytest

from railcosim.fmus.content import contents
from railcosim.fmus.python_runtime.models import Model
from railcosim.mechanics.contact.creep import REFERENCE, Patch
from railcosim.vehicle.files import read_stock

from .fuzzing import on_profiles

pytestmark = pytest.mark.filterwarnings("ignore:a ring of")  # as short as it can be
NAMES = pytest.mark.parametrize("name", ["VehicleWithContact", "TrackWithContact"])
STEP, SPEED = 1e-4, 60.0  # s, m/s
# m, rad and their rates a second: inputs swing so far about where wheels are pressed.
SWINGS = {
    "wheel_z": 1e-4, "wheel_y": 3e-3, "wheel_roll": 1e-4, "wheel_x": 1e-4, "wheel_yaw": 2e-3,
    "wheel_vz": 0.03, "wheel_vy": 0.3, "wheel_vroll": 0.01, "wheel_vx": 0.05, "wheel_vyaw": 0.05,
    "rail_z": 5e-5, "rail_y": 3e-3, "rail_roll": 1e-4,
    "rail_vz": 0.02, "rail_vy": 0.2, "rail_vroll": 0.02,
    "irregularity_z": 2e-5, "irregularity_y": 2e-4, "speed": 30.0,
}  # fmt: skip
PRESSED = {"wheel_z": 1e-3, "rail_z": -6e-5}
LAWS = {
    "linear": {"contact.friction": 0.0, "contact.textbook": False},
    "flanges": {
        "contact.friction": 0.2, "contact.textbook": False, "contact.flange_clearance": 1e-3
    },
    "textbook": {"contact.conicity": 0.1, "contact.textbook": True},
    "FASTSIM": {"contact.friction": 0.2, "contact.fastsim": True},
}  # fmt: skip


@pytest.fixture
def fmi():
    return 2  # beneath it the runtime is the same


@pytest.fixture(scope="module")
def both(made, tiny_track, tmp_path_factory):
    """A vehicle and a track of two wheelsets, by name: content, and FMU taken apart."""
    return owners(read_stock(Path("wagon")), tiny_track, made, tmp_path_factory.mktemp("rolling"))


@pytest.fixture(scope="module")
def on_tables(made, tiny_track, tmp_path_factory):
    """The same, of wheels and rails with profiles."""
    wagon = on_profiles(read_stock(Path("wagon")))
    return owners(wagon, tiny_track, made, tmp_path_factory.mktemp("profiled"))


def owners(stock, track, made, folder):
    all_four = contents(stock, track, dimension="spatial")
    return {
        c.name: (c, made(folder / c.name, c.body, c.table, c.profiles))
        for c in all_four
        if c.has_contact
    }


def swung(table, t):
    """Inputs at a time: wheels roll, and each of the rest swings in its own way."""
    inputs = [v for v in table if v.causality == "input"]
    values = np.array([float(v.start or 0.0) for v in inputs])
    for k, v in enumerate(inputs):
        quantity = v.name.rpartition(".")[2]
        swing = SWINGS.get(quantity, 0.0) * np.sin(300.0 * t * np.sqrt(1 + k % 17) + k)
        values[k] += PRESSED.get(quantity, 0.0) + swing + SPEED * t * (quantity == "position")
    return values


class Native:
    """An instance, by inputs and outputs as vectors."""

    def __init__(self, instance, table):
        self.instance, self.table = instance, table
        self.inputs, self.outputs = (
            [k for k, v in enumerate(table) if v.causality == kind] for kind in ("input", "output")
        )

    def ask(self, *command):
        reply = self.instance(*command)
        assert reply.status == "OK", reply
        return reply

    def begin(self, parameters, values=None):
        for name, value in parameters.items():
            if isinstance(value, bool):
                self.ask("set_boolean", self.instance.ref(name), int(value))
            else:
                self.ask("set", 1, self.instance.ref(name), value)
        self.ask("enter", 0.0)
        self.set(swung(self.table, 0.0) if values is None else values)
        self.ask("exit")

    def set(self, values):
        self.ask("set", len(values), *self.inputs, *map(repr, values.tolist()))

    def step(self, k, values):
        self.set(values)
        self.ask("step", k * STEP, STEP)

    def get(self):
        return np.array(self.ask("get", len(self.outputs), *self.outputs).numbers)

    def along(self, direction):
        """Changes of all outputs by inputs over the last step."""
        self.ask("set_boolean", self.instance.ref("derivatives_of_step"), 1)
        known = len(self.inputs)
        reply = self.ask(
            "directional", len(self.outputs), *self.outputs, known, *self.inputs,
            known, *map(repr, direction.tolist()), len(self.outputs),
        )  # fmt: skip
        return np.array(reply.numbers)


@pytest.fixture
def native(driver, both, use):
    """Function that begins an instance."""

    def make(name, parameters):
        content, fmu = both[name]
        one = Native(use(driver, fmu, 2), content.table)
        one.begin(parameters)
        return one

    return make


def twin(content, parameters, steps, ahead):
    """Outputs of the numpy runtime; inputs are held, or (`ahead` is 1) lines to the next values."""
    table = content.table
    made, given = Model(content.body, [v.slot for v in table], content.profiles), {}
    for v in table:
        if v.causality == "parameter":
            given[v.role, v.index] = float(parameters.get(v.name, v.start or 0))
    made.configure(given)
    before = swung(table, 0.0)
    now = made.read(before)
    y = np.empty((steps + 1, sum(v.causality == "output" for v in table)))
    state, behind = made.rest(now), 0.0
    made.write(state, now, 0.0, y[0])
    for k in range(steps):
        begin, after = (swung(table, (k + more) * STEP) for more in (0, ahead))
        now, end = made.read(begin), made.read(after)
        state = made.mover.step(state, now, end, STEP)
        behind += made.behind(k * STEP, STEP, before, begin, after)
        made.write(state, end, made.speed(after) * (k + 1) * STEP - behind, y[k + 1])
        before = after
    return y


@NAMES
@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("ahead", [0, 1], ids=["held", "rolling on"])
def test_against_the_numpy_runtime(both, native, name, law, ahead):
    """Inputs held, so that wheels jump from step to step; and lines, on which they roll on.

    The speed is one of them.
    """
    held_against_numpy(both[name][0], native(name, LAWS[law]), LAWS[law], ahead)


@NAMES
@pytest.mark.parametrize("fastsim", [False, True], ids=["Shen", "FASTSIM"])
def test_profiles_against_the_numpy_runtime(on_tables, driver, use, name, fastsim):
    content, fmu = on_tables[name]
    told = [v.name for v in content.table if v.name.startswith("contact.")]
    assert told == ["contact.friction", "contact.axle_inertia", "contact.fastsim"]
    law = {"contact.friction": 0.2, "contact.fastsim": fastsim}
    one = Native(use(driver, fmu, 2), content.table)
    one.begin(law)
    held_against_numpy(content, one, law, 1)


def test_a_wheel_beyond_its_table_ends_the_step(on_tables, driver, use):
    """And the next one, back on it, goes on."""
    content, fmu = on_tables["TrackWithContact"]
    one = Native(use(driver, fmu, 2), content.table)
    one.begin({})
    one.step(0, swung(content.table, 0.0))
    one.ask("save", 5)
    far = swung(content.table, STEP)
    inputs = [v.name for v in content.table if v.causality == "input"]
    far[inputs.index("wheelset[2].left.wheel_y")] = 0.02
    one.set(far)
    reply = one.instance("step", STEP, STEP)
    assert reply.status == "Error"
    assert "beyond the table of its profile" in reply.log[0]
    one.ask("restore", 5)
    one.step(1, swung(content.table, STEP))
    assert np.isfinite(one.get()).all()
    one.ask("free_state", 5)


def held_against_numpy(content, one, law, ahead):
    """An instance that has begun, over twelve steps."""
    expected, found = twin(content, law, 12, ahead), []
    one.ask("set_integer", one.instance.ref("input_hold"), 2 * ahead)
    found.append(one.get())
    for k in range(12):
        one.step(k, swung(content.table, (k + ahead) * STEP))
        found.append(one.get())
    outputs = [v for v in content.table if v.causality == "output"]
    aside = [k for k, v in enumerate(outputs) if v.name.endswith("force_y")]
    assert np.ptp(expected[:, aside], axis=0).min() > 1e3
    largest = np.abs(expected).max(axis=0)
    for k, v in enumerate(outputs):
        alike = max(largest[j] for j, other in enumerate(outputs) if other.unit == v.unit)
        off = np.abs(np.array(found)[:, k] - expected[:, k]).max()
        # A car body has hardly begun to yaw: it is what rounding leaves of others' motions.
        assert off < 1e-9 * largest[k] + 1e-14 * alike, v.name


@NAMES
def test_snapshots_have_the_same_bits(both, native, name):
    """Whether outputs were asked for on the way or not, and where it is reset in between."""
    table, one = both[name][0].table, native(name, LAWS["flanges"])
    for k in range(3):
        one.step(k, swung(table, k * STEP))
    one.ask("save", 5)
    runs = []
    for look in (True, False, True):
        one.ask("restore", 5)
        for k in range(3, 7):
            if look:
                one.get()
            one.step(k, swung(table, k * STEP))
        runs.append(one.get())
    one.ask("free_state", 5)
    assert runs[0].tobytes() == runs[1].tobytes() == runs[2].tobytes()
    assert np.isfinite(runs[0]).all()


@NAMES
@pytest.mark.parametrize(
    ("law", "ahead", "close"),
    # Differences err where creep begins to slide: FASTSIM's in one of 800 elements after the other.
    [("flanges", 0, 1e-5), ("flanges", 1, 1e-5), ("FASTSIM", 1, 1e-4)],
    ids=["held", "rolling on", "FASTSIM"],
)
def test_derivative_of_a_step(both, native, name, law, ahead, close):
    """By inputs over it, all of them at once, against a central difference."""
    table, one = both[name][0].table, native(name, LAWS[law])
    one.ask("set_integer", one.instance.ref("input_hold"), 2 * ahead)
    for k in range(3):
        one.step(k, swung(table, (k + ahead) * STEP))
    one.ask("save", 5)
    u, h = swung(table, (3 + ahead) * STEP), 1e-4
    inputs = [v.name.rpartition(".")[2] for v in table if v.causality == "input"]
    ways = np.random.default_rng(1).uniform(0.5, 1.0, (4, u.size))
    kinds = {
        "motions": [q in SWINGS and "_" in q and "_v" not in q for q in inputs],
        "rates": ["_v" in q for q in inputs],
        "places": [q == "position" for q in inputs],
        "speed": [q == "speed" for q in inputs],
    }

    def after(values):
        one.ask("restore", 5)
        one.step(3, values)
        return one.get()

    for way, (kind, chosen) in zip(ways, kinds.items(), strict=True):
        if not any(chosen):
            continue
        direction = way * np.array([SWINGS.get(q, 0.1) for q in inputs]) * chosen
        middle = after(u)
        exact = one.along(direction)
        ends = [after(u + sign * h * direction) for sign in (1, -1)]
        difference = (ends[0] - ends[1]) / (2 * h)
        for a, b, y in zip(exact, difference, middle, strict=True):
            # Differences err by the rounding of what they are of, too.
            assert abs(a - b) < close * abs(b) + 1e-11 * abs(y) / h + 1e-12, kind
    one.ask("free_state", 5)


# An example of CONTACT, pure creepage along: a/b 0.5, 106.7 kN, friction times that 35.21 kN.
# Forces of the full theory, and of a FASTSIM of 48 x 44 elements, N.
CURVATURES, LOAD, BOUND = (1.6, 0.562836), 106.7e3, 35.21e3
CURVE = {4e-4: (9112, 9075), 1.2e-3: (22820, 22110), 2e-3: (31040, 29690), 4e-3: (35180, 35130)}


@pytest.mark.parametrize("fastsim", [False, True], ids=["Shen", "FASTSIM"])
def test_published_creep_curve_through_an_fmu(both, driver, use, fastsim):
    """Wheels rest on a track, and one is pulled along it.

    By Hertz's law all patches are similar: creepages grow with the cube root of the load.
    """
    patch = Patch.of(*CURVATURES, shear_modulus=82e9, poisson_ratio=0.28)
    assert patch.ellipse.ratio == pytest.approx(0.5, rel=1e-3)
    f11, f22, f23, f33 = map(float, patch.creep_coefficients(np.array(REFERENCE)))
    a, b = map(float, patch.ellipse.semi_axes(np.array(REFERENCE)))
    C = float(patch.ellipse.C)
    law = {
        "contact.conicity": 0.0, "contact.friction": BOUND / LOAD, "contact.fastsim": fastsim,
        "contact.f11": f11, "contact.f22": f22, "contact.f23": f23, "contact.f33": f33,
        "contact.ellipse_along": a, "contact.ellipse_across": b,
        "contact.hertz_coefficient": C,
    }  # fmt: skip
    content, fmu = both["TrackWithContact"]
    inputs = [v for v in content.table if v.causality == "input"]
    outputs = [v.name for v in content.table if v.causality == "output"]
    values = np.array([float(v.start or 0.0) for v in inputs])
    values[[v.name.endswith("wheel_z") for v in inputs]] = 1.5e-3  # m
    one = Native(use(driver, fmu, 2), content.table)
    one.begin(law, values)
    wheel = "wheelset[1].left."
    z, x = (outputs.index(f"{wheel}force_{direction}") for direction in "zx")
    at, names = one.get(), [v.name for v in inputs]
    pressed, speed = at[z] / LOAD, values[names.index("speed")]
    assert 0.1 < pressed < 2
    assert abs(at[x]) < 1e-9 * LOAD
    for creepage, (full, theirs) in CURVE.items():
        values[names.index(f"{wheel}wheel_vx")] = creepage * pressed ** (1 / 3) * speed
        one.set(values)
        found = one.get()[x] / pressed
        # As in tests/mechanics: FASTSIM is 5.5 % below the full theory where half of a patch slips.
        assert found == pytest.approx(full, rel=0.06 if fastsim else 0.05)
        if fastsim:
            assert found == pytest.approx(theirs, rel=0.03)
