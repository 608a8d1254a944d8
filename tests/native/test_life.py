"""The native runtime under AddressSanitizer and UndefinedBehaviorSanitizer: as it should be used.

Values are compared as printed in full: equal text is equal bits.
"""

import math
import uuid
from dataclasses import replace

import numpy as np
import pytest

from railcosim.fmus.content import contents
from railcosim.fmus.native_runtime.resource import resource
from railcosim.vehicle.parameters import Vehicle

STEP = 1e-3
ROLLING = ["SpatialVehicleWithContact", "SpatialTrackWithContact"]
NAMES = ["Vehicle", "Track", "VehicleWithContact", "TrackWithContact", *ROLLING]
FIRST_STATE, FIRST_DERIVATIVE = 2**16, 2**24


def ok(reply):
    assert reply.status == "OK", reply
    assert reply.log == []
    return reply.values


def test_a_co_simulation(driver, tiny, fmi, use):
    """Whole life, twice over: after a reset everything is as at first."""
    fmu = tiny["TrackWithContact"]
    one = use(driver, fmu, fmi)
    runs = []
    for _ in range(2):
        one.initialise()
        run = []
        for k in range(5):
            one.move(k)
            ok(one("step", k * STEP, STEP))
            run.append(one.outputs())
        runs.append(run)
        ok(one("terminate"))
        assert one.outputs() == run[-1]
        ok(one("reset"))
    assert runs[0] == runs[1]
    assert len({tuple(y) for y in runs[0]}) == 5  # something happened
    assert all(math.isfinite(float(v)) for y in runs[0] for v in y)
    ok(one("free"))


@pytest.mark.parametrize("name", NAMES)
def test_snapshots(driver, tiny, fmi, use, name):
    """Saved, restored, saved over, serialised, and read by another instance."""
    one, other = use(driver, tiny[name], fmi), use(driver, tiny[name], fmi)
    one.initialise()
    other.initialise()
    one.move(1)
    ok(one("step", 0.0, STEP))
    ok(one("save", 5))
    runs = []
    for _ in range(2):
        one.move(2)
        ok(one("step", STEP, STEP))
        runs.append(one.outputs())
        ok(one("restore", 5))
    assert runs[0] == runs[1]
    (size,) = ok(one("serialize", 5, 0))
    assert int(size) > 0
    ok(one("free_state", 5))
    ok(other("deserialize", 5, 0))
    ok(other("restore", 5))
    other.move(2)
    ok(other("step", STEP, STEP))
    assert other.outputs() == runs[0]
    ok(other("save", 5))  # over the state that is there
    assert ok(other("free_state", 5)) == ["null"]
    assert ok(other("free_state", 5)) == ["null"]  # freeing nothing


@pytest.mark.parametrize("fmi", [2])  # FMI 3 has no input derivatives
def test_wheels_that_go_out_and_back_within_a_step(driver, tiny, fmi, use):
    """Back to the bit, they move the track as those that come back to a nanometre do.

    Not as wheels at rest: their forces acted elsewhere in the middle of the internal step.
    """
    fmu, h, out = tiny["Track"], 2.0**-10, 0.25  # s, m: all sums of positions are exact
    positions = [name for name in fmu.names("input") if name.endswith(".position")]
    places = dict(zip(positions, [2.8125, 5.3125, 15.3125, 17.8125], strict=True))  # at railseats
    curve, found = -2 * (4 * out / h) / h, []
    for slope, bend in ((0.0, 0.0), (4 * out / h, curve), (4 * out / h * (1 + 1e-9), curve)):
        one = use(driver, fmu, fmi)
        ok(one.set({"internal_step": h}))
        ok(one("enter", 0.0))
        ok(one.set(places))
        ok(one("exit"))
        for name in positions:
            ok(one("input_derivatives", 1, one.ref(name), repr(slope)))
            ok(one("input_derivatives", 2, one.ref(name), repr(bend)))
        ok(one("step", 0.0, h))
        found.append([float(v) for v in one.outputs()])
    still, back, nearly = np.array(found)
    rates = np.array([name.endswith("rail_vz") for name in fmu.names("output")])
    for which in (rates, ~rates):
        moved = np.abs(back - still)[which].max()
        assert moved > 1e-4 * np.abs(back[which]).max()  # measured 2e-3, and all of the rates
        # A way that is longer by 1e-9 of itself: measured 7e-8, as shapes are steep.
        assert np.abs(nearly - back)[which].max() < 1e-6 * moved


@pytest.mark.parametrize("name", NAMES)
def test_derivatives_of_outputs(driver, tiny, fmi, use, name):
    one = use(driver, tiny[name], fmi)
    known, unknown = one.ref(tiny[name].names("input")[-1]), one.ref(tiny[name].names("output")[0])
    one.initialise()
    ok(one("directional", 1, unknown, 1, known, 1, 1.0, 1))
    for k in range(3):
        one.move(k)
        ok(one("step", k * STEP, STEP))
        ok(one("directional", 1, unknown, 1, known, 1, 1.0, 1))
        assert math.isfinite(float(ok(one("output_derivatives", 1, unknown))[0]))
    assert ok(one("directional", 0, 0, 0, 0)) == []  # nothing asked, nothing told


@pytest.mark.parametrize("name", ["Vehicle", "Track"])
def test_a_model_exchange(driver, tiny, fmi, use, name):
    one = use(driver, tiny[name], fmi, "me")
    one.initialise()
    ok(one("discrete"))
    n = tiny[name].states
    ok(one("continuous"))
    x = ok(one("get_states", n))
    assert len(x) == n
    assert all(float(v) > 0 for v in ok(one("nominals", n)))
    ok(one("indicators", 0))
    for k in range(3):
        ok(one("time", k * STEP))
        one.move(k)
        rates = [float(v) for v in ok(one("rates", n))]
        x = [float(a) + 1e-6 * b for a, b in zip(x, rates, strict=True)]
        ok(one("set_states", *map(repr, x)))
        assert [float(v) for v in ok(one("get_states", n))] == x
        ok(one("completed"))
        assert all(math.isfinite(float(v)) for v in one.outputs())
    ok(one("event"))
    ok(one("terminate"))


def many_times(body, n):
    """A track with each of its modes n times, and so shapes of 1 / n: the same rails."""
    shapes = body.shapes
    even, odd = np.split(np.arange(body.shared), [body.even])
    modes = np.concatenate([np.tile(even, n), np.tile(odd, n)])
    place = np.empty((n, body.shared), int)  # of a mode's copies
    place[:, even] = np.arange(n * even.size).reshape(n, -1)
    place[:, odd] = n * even.size + np.arange(n * odd.size).reshape(n, -1)
    copy = np.concatenate([np.repeat(np.arange(n), even.size), np.repeat(np.arange(n), odd.size)])
    many = replace(
        shapes, table=(shapes.table[..., modes] / np.sqrt(n)).astype(np.complex64),
        mu=shapes.mu[modes], partner=place[copy, shapes.partner[modes]],
    )  # fmt: skip
    poles = np.concatenate([body.poles[modes], body.poles[body.shared :]])
    return replace(body, poles=poles, even=n * body.even, shapes=many)


def test_more_states_than_there_are_variables(driver, tiny, tiny_track, fmi, use, tmp_path):
    """A long ring has more than 2^16 states: none has a derivative's reference."""
    (content,) = [c for c in contents(Vehicle(), tiny_track) if c.name == "Track"]
    body = many_times(content.body, 2**15 // content.body.shared + 1)
    guid = f"{{{uuid.uuid4()}}}"
    (tmp_path / "model.bin").write_bytes(resource(body, content.table, guid))
    states = 2 * body.poles.size
    assert states > 2**16
    one = use(
        driver, replace(tiny["Track"], guid=guid, resources=tmp_path, states=states), fmi, "me"
    )
    usual = use(driver, tiny["Track"], fmi, "me")
    for each in (one, usual):
        each.initialise()
        each.move(1)
    x, rates = ok(one("get_states", states)), ok(one("rates", states))
    places = [0, states // 2, 2**16 - 1, 2**16, states - 1] if fmi == 2 else range(states)
    count, arrays_of = len(places), [0, 1]  # FMI 3 has an array of real and one of imaginary parts
    for first, expected in ((FIRST_STATE, x), (FIRST_DERIVATIVE, rates)):
        refs = [first + k for k in (places if fmi == 2 else arrays_of)]
        assert ok(one("get", count, *refs)) == [expected[k] for k in places]
    assert x[2**16] != rates[0]  # which had one reference when derivatives began at 2^17
    found, wanted = ([float(v) for v in each.outputs()] for each in (one, usual))
    # Shapes are in single precision.
    assert found == pytest.approx(wanted, rel=1e-5, abs=1e-6 * max(map(abs, wanted)))


@pytest.mark.parametrize("kind", ["cs", "me"])
def test_many_instances_do_not_meet(driver, tiny, fmi, use, kind):
    fmu = tiny["Track"]
    many = [use(driver, fmu, fmi, kind) for _ in range(20)]
    for one in many:
        one.initialise()
    found = []
    for round_ in range(2):
        for k, one in enumerate(many):
            one.move(k % 5)
            if kind == "cs":
                ok(one("step", round_ * STEP, STEP))
    found = [one.outputs() for one in many]
    for k in range(5):
        assert found[k] == found[k + 5] == found[k + 15]
    assert len({tuple(y) for y in found}) == 5


@pytest.mark.parametrize("away", [1e9, -1e9, 2.0**40])
def test_positions_far_outside_the_ring_wrap(driver, tiny, fmi, use, away):
    """Whole turns away, in numbers that a double holds exactly, the outputs have the same bits."""
    fmu = tiny["Track"]
    turn = 20.0  # m: four cells
    positions = [n for n in fmu.names("input") if n.endswith(".position")]
    near = [2.8125, 5.3125, 15.5, 18.0]
    found = []
    for shift in (0.0, turn * math.floor(away / turn)):
        one = use(driver, fmu, fmi)
        ok(one("enter", 0.0))
        one.set({name: x + shift for name, x in zip(positions, near, strict=True)})
        ok(one("exit"))
        start = one.outputs()
        ok(one("step", 0.0, STEP))
        found.append((start, one.outputs()))
    assert found[0] == found[1]


@pytest.mark.parametrize("fmi", [2])  # FMI 3 has none
def test_input_derivatives(driver, tiny, fmi, use):
    fmu = tiny["Track"]
    force = fmu.names("input")[-1]
    one = use(driver, fmu, fmi)
    one.initialise()
    before = one.outputs()
    ok(one("input_derivatives", 1, one.ref(force), 1e6))
    ok(one("input_derivatives", 2, one.ref(force), -1e8))
    ok(one("step", 0.0, STEP))
    assert one.outputs() != before
