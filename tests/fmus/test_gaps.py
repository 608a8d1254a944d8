"""FMUs of a track with gaps that close: the compiled runtime against the Python one."""

import fmpy
import numpy as np
import pytest

from railcosim.fmus.content import contents
from railcosim.fmus.export import BARE, NativeRuntime, PythonRuntime, packed
from railcosim.master.component import Hold
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.track.layers import Layer
from railcosim.track.local import LocalChange
from railcosim.track.parameters import Fastening, Mesh, Rail, Slab, Track
from railcosim.vehicle.parameters import Vehicle

TRACK = Track(
    rail=Rail(loss_factor=0.01), slab=Slab(present=False),
    layers=(Layer(name="block", mass=100.0, stiffness=3e7),),
    mesh=Mesh(cells=72, elements_per_bay=4, highest_frequency=1500),
    fastening=Fastening(spacing=0.6),
)  # fmt: skip
# Under the first wheelset at the beginning, and 0.6 m ahead of it; on one rail alone.
GAPS = {
    "both sides": [
        LocalChange(what="block", x=18.3, value=1.0, gap=3e-4),
        LocalChange(what="block", x=18.9, value=1.0, gap=8e-4),
    ],
    "one side": [LocalChange(what="block", x=18.3, value=1.0, gap=3e-4, sides=(-1,))],
}
COMPILED, PYTHON = NativeRuntime(documented=False), PythonRuntime(documented=False)
STEP, STEPS = 1e-4, 150
LONG = 3e-4  # s: several internal steps, so that a change of one's end is that of the next's begin


def run(path):
    """Outputs of 0.9 m at 60 m/s, and what they are at rest."""
    with FmuComponent.load(path) as fmu:
        fmu.enter_initialization(0.0)
        names = [v.name for v in fmu.inputs]
        place = np.array([n.endswith("position") for n in names])
        wheel = np.array([n.endswith("wheel_z") for n in names])
        u = np.array([v.start for v in fmu.inputs])
        u[wheel] += 1.6e-3
        fmu.set_inputs(u)
        fmu.exit_initialization()
        fmu.set_hold(Hold.INTERPOLATE)
        rows, load = [fmu.get_outputs()], ~place * ~wheel * u
        for k in range(STEPS):
            ahead = (k + 1) * STEP
            now = u + 60.0 * ahead * place + 0.2 * load * np.sin(400 * ahead)
            fmu.set_inputs(now + 2e-4 * wheel * np.sin(400 * ahead))
            fmu.do_step(k * STEP, STEP)
            rows.append(fmu.get_outputs())
        return np.array(rows), [v.name for v in fmu.outputs]


@pytest.mark.slow  # tracks are reduced, and packed twice: 10 s
@pytest.mark.parametrize("kind", GAPS)
def test_both_runtimes_agree(tmp_path, kind):
    vehicle = Vehicle()
    made = [one for one in contents(vehicle, TRACK, changes=GAPS[kind]) if one.model == "track"]
    hangs = [LocalChange(what=c.what, x=c.x, value=0.0, sides=c.sides) for c in GAPS[kind]]
    other = [one for one in contents(vehicle, TRACK, changes=hangs) if one.model == "track"]
    for one, opened in zip(made, other, strict=True):
        found = []
        for content, runtime in ((one, COMPILED), (one, PYTHON), (opened, COMPILED)):
            with packed([content], tmp_path, runtime=runtime) as files:
                rows, names = run(files[content.name])
                found.append(rows)
        native, python, hanging = found
        scale = np.abs(python).max(axis=0)
        off = np.abs(native - python).max(axis=0) / scale
        # Rounding; rates jump as a gap closes, at an instant that is known to rounding.
        assert off.max() < 1e-8, (one.name, names[int(np.argmax(off))])
        assert (np.abs(hanging - native)[0] / scale).max() > 1e-3  # at rest
        assert (np.abs(hanging - native).max(axis=0) / scale).max() > 1e-2


@pytest.mark.slow  # a track is reduced and packed: 4 s
@pytest.mark.parametrize("name", ["Track", "TrackWithContact"])
def test_derivatives_of_a_step(tmp_path, name):
    """What the FMU says of its outputs after a step, against steps with one input changed.

    And at rest, where a gap is closed, it stays.
    """
    made = contents(Vehicle(), TRACK, changes=GAPS["one side"])
    (track,) = (one for one in made if one.name == name)
    with (
        packed([track], tmp_path, runtime=BARE) as files,
        FmuComponent.load(files[name]) as fmu,
    ):
        assert fmpy.read_model_description(files[name]).modelExchange is None
        names = [v.name for v in fmu.inputs]
        u = np.array([v.start for v in fmu.inputs])
        u[[n.endswith("wheel_z") for n in names]] += 1.6e-3
        load = names.index(f"wheelset[1].left.{'force_z' if name == 'Track' else 'wheel_z'}")
        fmu.enter_initialization(0.0)
        fmu.set_inputs(u)
        fmu.exit_initialization()
        fmu.set_hold(Hold.CONSTANT)
        begin, rest = fmu.save_state(), fmu.get_outputs()
        for k in range(10):
            fmu.do_step(k * LONG, LONG)
        z = np.array([v.name.endswith("rail_z") for v in fmu.outputs])
        # A contact feels a gap's spring one internal step later: 1e-5.
        np.testing.assert_allclose(fmu.get_outputs()[z], rest[z], rtol=1e-4)
        fmu.restore_state(begin)
        told = []
        for k in range(60):  # it opens, and closes as the next wheel comes
            u[load] *= 0.97 if k < 30 else 1.04
            fmu.set_inputs(u)
            begin = fmu.save_state()
            answers = {}
            for change in (0.0, 1e-5, -1e-5):
                fmu.restore_state(begin)
                now = u.copy()
                now[load] *= 1 + change
                fmu.set_inputs(now)
                fmu.do_step(k * LONG, LONG)
                answers[change] = fmu.get_outputs()
            expected = (answers[1e-5] - answers[-1e-5]) / (2e-5 * u[load])
            fmu.restore_state(begin)
            fmu.set_inputs(u)
            fmu.do_step(k * LONG, LONG)
            found = fmu.step_derivative()[:, load]
            told.append(np.abs(found - expected).max() / np.abs(expected).max())
        # Differences of steps; one of them may have a corner of the law between its two ends.
        assert np.sort(told)[-2] < 1e-5
