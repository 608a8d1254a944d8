"""FMUs in space that own the contacts: names, exact dependencies, and vertical answers."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from railcosim.fmus.content import Content, contents
from railcosim.fmus.interface import Start, interface
from railcosim.fmus.law_variables import Contact
from railcosim.fmus.python_runtime.models import Model
from railcosim.fmus.roles import Role
from railcosim.fmus.rolling_variables import RollingWheels
from railcosim.fmus.start import start_of
from railcosim.fmus.track_under import track_under
from railcosim.parameters import ParameterError
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.parameters import Rolling
from railcosim.vehicle.train import train_of

from .test_any_wheelsets import TINY

pytestmark = pytest.mark.filterwarnings("ignore:a ring of")  # as short as it can be
WAGON, LOAD = read_stock(Path("wagon")), 110e3
OTHERS = {
    "TrackWithContact": [f"wheel_{m}" for m in ("z", "y", "roll", "x", "yaw")]
    + [f"wheel_v{m}" for m in ("z", "y", "roll", "x", "yaw")],
    "VehicleWithContact": [f"rail_{m}" for m in ("z", "y", "roll")]
    + [f"rail_v{m}" for m in ("z", "y", "roll")],
}
FORCES = {
    "TrackWithContact": ["force_z", "force_y", "moment_x", "force_x", "moment_z"],
    "VehicleWithContact": ["force_z", "force_y", "moment_x"],
}
OWNERS = pytest.mark.parametrize("owner", OTHERS)


@pytest.fixture(scope="module")
def spatial() -> dict[str, Content]:
    return {made.name: made for made in contents(WAGON, TINY, dimension="spatial")}


class Driven:
    """A model by names of variables."""

    def __init__(self, table, body, parameters=None):
        self.table = table
        self.model = Model(body, [v.slot for v in table])
        given = parameters or {}
        self.model.configure({
            (v.role, v.index): float(given.get(v.name, v.start or 0.0))
            for v in table if v.causality == "parameter"
        })  # fmt: skip
        self.inputs = {v.name: float(v.start or 0.0) for v in table if v.causality == "input"}
        self.outputs = [v.name for v in table if v.causality == "output"]

    def now(self):
        return self.model.read(np.array(list(self.inputs.values())))

    def rest(self):
        self.state = self.model.rest(self.now())

    def told(self):
        y = np.empty(len(self.outputs))
        self.model.write(self.state, self.now(), 0.0, y)
        return dict(zip(self.outputs, y.tolist(), strict=True))

    def step(self, h, **end):
        before = self.now()
        self.inputs |= end
        self.state = self.model.mover.step(self.state, before, self.now(), h)


def pressed(made: Content, depth=1.5e-3) -> Driven:
    """At rest with the wheels on the rails, all a little off."""
    sunk = {"TrackWithContact": "wheel_z", "VehicleWithContact": "start_z"}[made.name]
    parameters = {v.name: 1e-4 for v in made.table if v.quantity == sunk}
    driven = Driven(made.table, made.body, parameters)
    driven.inputs |= {name: depth for name in driven.inputs if name.endswith(sunk)}
    driven.rest()
    rng = np.random.default_rng(2)
    for name in driven.inputs:
        if "position" not in name:
            driven.inputs[name] += 1e-5 * rng.standard_normal()
    return driven


@OWNERS
def test_names(spatial, owner):
    table = spatial[owner].table
    inputs = [v.name for v in table if v.causality == "input"]
    outputs = [v.name for v in table if v.causality == "output"]
    wheel = "wheelset[2].right."
    ours = [name.removeprefix(wheel) for name in inputs if name.startswith(wheel)]
    assert ours == [*OTHERS[owner], "irregularity_z", "irregularity_y"]
    theirs = [name.removeprefix(wheel) for name in outputs if name.startswith(wheel)]
    assert [n for n in theirs if "force" in n or "moment" in n] == FORCES[owner]
    assert {v.unit for v in table if v.quantity == "moment_x"} == {"N.m"}
    (speed,) = [v for v in table if v.name == "speed"]
    assert speed.minimum == 0.1  # creepages are velocities over it


@OWNERS
def test_dependencies_are_exact(spatial, owner):
    """Whatever an output is said to depend on changes it, and nothing else does."""
    made = spatial[owner]
    driven = pressed(made)
    before = driven.told()
    rows = {v.name: v for v in made.table}
    found = {name: set() for name in driven.outputs}
    for name in driven.inputs:
        kept = driven.inputs[name]
        # Rails roll by no jump: a rate of roll acts at once by the cone's spin only.
        small = 1e-2 if name.endswith("wheel_vroll") else 1e-6
        driven.inputs[name] += 0.01 if name.endswith("position") else small
        after = driven.told()
        driven.inputs[name] = kept
        for output in driven.outputs:
            if after[output] != before[output]:
                found[output].add(name)
    for output, inputs in found.items():
        declared = {name for name in rows[output].depends_on if rows[name].causality == "input"}
        assert inputs <= declared, output
        missing = declared - inputs
        # What is metres away may change a number by less than its last digit.
        near = output.rpartition(".")[0]
        assert not [name for name in missing if name.startswith(near + ".")], (output, missing)


def test_cylinders_pressed_down_alike_answer_as_in_the_vertical_model():
    """Rails of one track, reduced once in each dimension; the coefficient of one is the other's."""
    places, spots = [6.0, 2.0], ("left", "right")
    flat = start_of(WAGON, places, dimension="spatial")
    assert isinstance(flat.contact, RollingWheels)
    one = Contact(k_H=(1e9,), C=flat.contact.numbers[Role.HERTZ])
    starts = {"vertical": Start(loads=flat.loads, positions=places, contact=one), "spatial": flat}
    found = {}
    for dimension, start in starts.items():
        rails = track_under(TINY, start, lambda text: None, dimension=dimension)
        table = interface(rails, start, with_contact=True)
        driven = Driven(table, rails, {"contact.conicity": 0.0})
        wheels = [f"wheelset[{i}].{side}." for i in (1, 2) for side in spots]
        driven.inputs |= {f"{wheel}wheel_z": 1.4e-3 for wheel in wheels}
        driven.rest()
        for k in range(1, 6):
            given = {f"{w}wheel_z": 1.4e-3 + 1e-4 * np.sin(k) for w in wheels}
            given |= {f"{w}irregularity_z": 2e-5 * np.cos(2 * k) for w in wheels}
            given |= {f"wheelset[{i}].position": x - 0.07 * k for i, x in ((1, 6.0), (2, 2.0))}
            driven.step(1e-3, **given)
        told = driven.told()
        asked = ("force_z", "rail_z", "rail_vz")
        found[dimension] = [told[f"{wheel}{q}"] for wheel in wheels for q in asked]
        if dimension == "spatial":
            aside = [told[f"{w}{q}"] for w in wheels for q in ("force_y", "force_x", "rail_y")]
            assert np.abs(aside).max() < 1e-9 * LOAD
    # Rounding, measured 8e-14: what goes down is reduced alike in both.
    assert found["spatial"] == pytest.approx(found["vertical"], rel=1e-9)


def test_numbers_are_those_of_the_file(spatial):
    starts = {v.name: v.start for v in spatial["TrackWithContact"].table}
    assert starts["contact.wheel_radius"] == 0.46
    assert starts["contact.conicity"] == Rolling().conicity
    assert starts["contact.friction"] == Rolling().friction
    linear = replace(WAGON, rolling=Rolling(creep="linear", gravity="textbook", conicity=0.2))
    contact = start_of(linear, [4.0, 0.0], dimension="spatial").contact
    assert isinstance(contact, RollingWheels)
    assert contact.numbers[Role.FRICTION] == (0.0,)  # without bound
    assert contact.textbook
    # Vehicles without the contact tell the same.
    told = {v.name: v.start for v in spatial["Vehicle"].table}
    assert {n: told[n] for n in starts if n.startswith("contact.")} == {
        n: x for n, x in starts.items() if n.startswith("contact.")
    }


def test_more_wheelsets_must_be_alike():
    assert start_of(WAGON, [8.0, 4.0, 0.0], dimension="spatial").contact is not None
    first, second = (replace(WAGON, rolling=Rolling(conicity=c)) for c in (0.1, 0.2))
    one = train_of(first)
    two = replace(one, vehicles=(*one.vehicles, *train_of(second).vehicles))
    contact = start_of(two, [30.0, 20.0, 10.0, 0.0], dimension="spatial").contact
    assert isinstance(contact, RollingWheels)
    assert contact.numbers[Role.CONICITY] == (0.1, 0.1, 0.2, 0.2)
    with pytest.raises(ParameterError, match=r"3 wheelsets.* roll differently \(conicity"):
        start_of(two, [30.0, 20.0, 10.0], dimension="spatial")
