"""The native runtime against the Python one: one model, one interface, one answer."""

import numpy as np
import pytest

from railcosim.fmus.export import PythonRuntime
from railcosim.master.component import Hold
from railcosim.master.fmi.fmu import FmuComponent

STEP, STEPS, SPEED = 1e-4, 80, 70.0  # s, -, m/s
# A static compression of the contacts to start from, m: down for the wheel, up for the rail.
PRESSED = {"TrackWithContact": ("wheel_z", 1.3e-3), "VehicleWithContact": ("rail_z", -88e-6)}


@pytest.fixture(scope="module")
def python(packed_by):
    return packed_by(PythonRuntime(documented=False))


def start_values(component, name):
    quantity, value = PRESSED.get(name, ("none", 0.0))
    return np.array([value if v.name.endswith(quantity) else v.start for v in component.inputs])


def run(path, name, hold, contact):
    """Outputs of a run with wheels that roll and steps of two lengths, (STEPS, n_outputs)."""
    with FmuComponent.load(path) as fmu:
        if "contact.nonlinear" in fmu.description.parameters:
            fmu.set_parameters({"contact.nonlinear": contact == "hertz"})
        fmu.enter_initialization(0.0)
        start = start_values(fmu, name)
        fmu.set_inputs(start)
        fmu.exit_initialization()
        fmu.set_hold(hold)
        rolls = np.array([v.name.endswith("position") for v in fmu.inputs])
        size = 0.02 * np.array([v.nominal for v in fmu.inputs]) * ~rolls
        phase, t, rows = np.arange(start.size), 0.0, []
        for k in range(STEPS):
            h = STEP if k % 7 else 0.7 * STEP
            ahead = t + (h if hold is Hold.INTERPOLATE else 0.0)
            wave = np.sin(2 * np.pi * 20 * (phase + 3) * ahead)
            fmu.set_inputs(start + size * wave + SPEED * ahead * rolls)
            fmu.do_step(t, h)
            t += h
            rows.append(fmu.get_outputs())
        return np.array(rows), [v.name for v in fmu.outputs]


@pytest.mark.parametrize("contact", ["hertz", "linear"])
@pytest.mark.parametrize("hold", list(Hold), ids=lambda hold: hold.name.lower())
@pytest.mark.parametrize("name", ["Vehicle", "Track", "VehicleWithContact", "TrackWithContact"])
def test_both_runtimes_agree(exported, python, name, hold, contact):
    if contact == "linear" and name not in PRESSED:
        pytest.skip("has no contact")
    native, names = run(exported[name], name, hold, contact)
    other, _ = run(python[name], name, hold, contact)
    moved = np.ptp(other, axis=0)
    assert moved.min() > 0  # every output took part
    error = np.abs(native - other).max(axis=0) / np.abs(other).max(axis=0)
    # Different order of the sums over modes: measured 1e-10 at most, of the car body's pitch of
    # 1e-11 rad, which is a difference of larger numbers.
    assert error.max() < 1e-9, names[int(np.argmax(error))]
