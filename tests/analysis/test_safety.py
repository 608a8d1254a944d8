"""Running safety: filters and means against closed forms, percentiles, sides and signs by hand."""

import numpy as np
import pytest
import xarray as xr

from railcosim.analysis.response.safety import (
    guiding_force_limit,
    low_pass,
    percentiles,
    running_safety,
    sliding_mean,
)
from railcosim.mechanics.ports import FORCE, Layout, Port, Y, Z
from railcosim.parameters import ParameterError

SPEED, STEP = 50.0, 1e-3


def run_of(across, down, time=None, speed=SPEED):
    """A run of one wheelset: forces to the right and down of the left and the right wheel, N."""
    time = STEP * np.arange(2001) if time is None else time
    forces = {}
    for direction, given in ((Y, across), (Z, down)):
        for side, force in zip(("left", "right"), given or (), strict=bool(given)):
            values = force(time) if callable(force) else np.full(time.size, float(force))
            forces[Port(1, side, direction).name(FORCE)] = ("time", values)
    return xr.Dataset(forces, {"time": time}, {"speed": speed})


# --- filter and mean --------------------------------------------------------------------


@pytest.mark.parametrize("frequency", [2.0, 10.0, 20.0, 40.0, 100.0])
def test_a_sine_through_the_filter(frequency):
    """Butterworth's 1/sqrt(1 + (f/20)^8), frequencies as the bilinear transform bends them."""
    t = STEP * np.arange(4000)
    passed = low_pass(np.stack([np.sin(2 * np.pi * frequency * t)] * 2, axis=1), STEP)[2000:]
    bent = np.tan(np.pi * frequency * STEP) / np.tan(np.pi * 20 * STEP)
    gain = 1 / np.sqrt(1 + bent**8)  # at 20 Hz: 3 dB less
    # Whole periods in 2 s; what is of the start is gone with exp(-48/s): 1e-40.
    assert np.sqrt(2 * np.mean(passed**2, axis=0)) == pytest.approx(gain, rel=1e-9)


def test_the_filter_begins_at_rest():
    """As if the first value had always been."""
    assert low_pass(np.full((50, 3), 7.0), STEP) == pytest.approx(7.0, rel=1e-12)


@pytest.mark.parametrize("step", [0.0, 6e-3, np.nan])
def test_steps_that_are_too_long(step):
    with pytest.raises(ParameterError, match=r"step.*0\.005 s"):
        low_pass(np.zeros(50), step)


@pytest.mark.parametrize("wavelength", [1.5, 2.0, 7.0])
def test_mean_of_a_sine_over_two_metres(wavelength):
    """sin(pi w / l) / (pi w / l) of it, in the middle of the window."""
    x = np.sort(np.random.default_rng(1).uniform(0, 30, 30_000))  # wherever it is sampled
    places, means = sliding_mean(np.sin(2 * np.pi * x / wavelength), x)
    assert np.diff(places) == pytest.approx(0.5)
    assert places[0] == pytest.approx(x[0] + 1)
    assert places[-1] <= x[-1] - 1 + 1e-9
    assert places[-1] > x[-1] - 1.5
    gain = np.sinc(2 / wavelength)
    # Lines between samples 1 mm apart, at most a few mm: (pi h / l)^2 / 3 of the amplitude.
    expected = gain * np.sin(2 * np.pi * places / wavelength)
    assert means == pytest.approx(expected, abs=1e-5)


def test_mean_of_lines_is_exact():
    """Also where windows end between samples, and with columns."""
    x = np.array([0.0, 0.3, 1.1, 1.7, 2.9, 4.0, 5.3])
    values = np.stack([2 * x - 1, np.maximum(x - 2.9, 0)], axis=1)
    places, means = sliding_mean(values, x)
    assert means[:, 0] == pytest.approx(2 * places - 1, rel=1e-12)
    # By hand: the integral of (x - 2.9)+ to the window's end, over 2 m.
    assert means[:, 1] == pytest.approx(
        (np.maximum(places + 1 - 2.9, 0) ** 2 - np.maximum(places - 1 - 2.9, 0) ** 2) / 4, abs=1e-12
    )


# --- percentiles ------------------------------------------------------------------------------


def test_percentiles_of_known_distributions():
    n = 200_001
    even = np.linspace(-1.0, 3.0, n)  # one that is uniform
    normal = np.random.default_rng(2).normal(size=n)
    x = np.linspace(0.0, 100.0, n)
    found = percentiles(np.stack([np.roll(even, 77), normal], axis=1), x, section=1000.0)
    assert found.shape == (1, 2, 2)
    assert found[0, :, 0] == pytest.approx([-1 + 0.0015 * 4, 3 - 0.0015 * 4], rel=1e-12)
    # Of a normal one 2.9677; a quantile scatters by sqrt(p (1 - p) / n) / density(2.9677).
    scatter = np.sqrt(0.0015 / n) / (np.exp(-(2.9677**2) / 2) / np.sqrt(2 * np.pi))
    assert found[0, :, 1] == pytest.approx([-2.9677, 2.9677], abs=4 * scatter)


def test_sections_are_alike_and_nothing_is_left_out():
    """Two and a half lengths: two sections."""
    x = np.linspace(0.0, 25.0, 2501)
    found = percentiles(np.where(x < 12.5, 1.0, 2.0), x, section=10.0)
    assert found.tolist() == [[1.0, 1.0], [2.0, 2.0]]
    with pytest.raises(ParameterError, match="section"):
        percentiles(x, x, section=0.0)


# --- sides and signs ----------------------------------------------------------------------------


def test_forces_on_both_sides_by_hand():
    """Rails pushed apart, 20 and 30 kN over 80 and 60 kN: both Y/Q above 0, 10 kN to the right."""
    found = running_safety(run_of((-20e3, 30e3), (80e3, 60e3)))
    expected = {
        "wheelset[1].left.derailment_quotient": 0.25,
        "wheelset[1].right.derailment_quotient": 0.5,
        "wheelset[1].guiding_force_sum": 10e3,
        "wheelset[1].left.unloading": 0.0,
        "wheelset[1].right.unloading": 0.0,
    }
    assert set(found.data_vars) == set(expected)
    for name, value in expected.items():
        assert found[name].values == pytest.approx(value, abs=1e-9)
        assert found[name].attrs["lowest"] == pytest.approx(value, abs=1e-9)
        assert found[name].attrs["highest"] == pytest.approx(value, abs=1e-9)
    assert found["wheelset[1].guiding_force_sum"].attrs["limit"] == pytest.approx(10e3 + 140e3 / 3)
    assert found["wheelset[1].left.derailment_quotient"].attrs["limit"] == 0.8
    assert guiding_force_limit(225e3) == pytest.approx(85e3)  # of an axle load of 22.5 t, known
    # Both pushed to the left: the flange of the left wheel only.
    found = running_safety(run_of((-8e3, -8e3), (80e3, 80e3)))
    assert found["wheelset[1].left.derailment_quotient"].attrs["highest"] == pytest.approx(0.1)
    assert found["wheelset[1].right.derailment_quotient"].attrs["lowest"] == pytest.approx(-0.1)
    assert found["wheelset[1].guiding_force_sum"].attrs["lowest"] == pytest.approx(-16e3)


def test_the_quotient_is_averaged_not_the_forces():
    """Y and Q swing together at 5 Hz, so slowly for the filter: the mean of their quotient."""

    def swing(mean, of):
        return lambda t: mean * (1 + of * np.sin(2 * np.pi * 5 * t))

    found = running_safety(run_of((0.0, swing(10e3, 0.5)), (80e3, swing(80e3, 0.5))))
    highest = found["wheelset[1].right.derailment_quotient"]
    assert highest.values == pytest.approx(0.125, rel=1e-9)  # alike in both: always 1/8
    assert found["wheelset[1].guiding_force_sum"].attrs["highest"] > 12e3


def test_unloading_is_of_the_force_at_first_and_is_no_mean():
    """Down to 60 % in 1 s, and at 15 Hz by as much as the filter leaves."""

    def down(t):
        return 80e3 * (1 - 0.4 * np.clip(t, 0, 1))

    t = STEP * np.arange(4001)
    found = running_safety(run_of(None, (down, 80e3), t))
    assert set(found.data_vars) == {"wheelset[1].left.unloading", "wheelset[1].right.unloading"}
    left = found["wheelset[1].left.unloading"]
    assert left.attrs["highest"] == pytest.approx(0.4, abs=1e-3)  # filtered, it swings there a bit
    shaken = running_safety(
        run_of(None, (lambda t: 80e3 * (1 - 0.3 * np.sin(2 * np.pi * 15 * t)), 80e3), t)
    )["wheelset[1].left.unloading"]
    gain = 1 / np.sqrt(1 + (np.tan(np.pi * 0.015) / np.tan(np.pi * 0.02)) ** 8)
    # The mean over 2 m, 0.6 periods, would leave half of it. Of a sine 0.15 % lie above 0.99999.
    assert shaken.attrs["highest"] == pytest.approx(0.3 * gain, rel=1e-3)


def test_a_wheel_off_the_rail_has_no_quotient():
    def gone(t):
        return np.where((t > 0.5) & (t < 0.8), 0.0, 80e3)

    found = running_safety(run_of((-8e3, -8e3), (gone, 80e3)))
    left = found["wheelset[1].left.derailment_quotient"]
    assert np.isnan(left.attrs["highest"])
    assert np.isfinite(found["wheelset[1].right.derailment_quotient"].attrs["lowest"])
    assert found["wheelset[1].left.unloading"].attrs["highest"] > 1  # the filter swings beyond 1


def test_uneven_times_make_no_difference():
    """Steps of 0.3 to 1 ms of what is slow."""
    rng = np.random.default_rng(3)
    time = np.concatenate([[0.0], np.cumsum(rng.uniform(3e-4, 1e-3, 3000))])

    def across(t):
        return -20e3 * np.sin(2 * np.pi * 1.5 * t)

    kinds = [run_of((across, 0.0), (80e3, 80e3), t) for t in (time, np.arange(0, time[-1], 3e-4))]
    one, other = (running_safety(kind)["wheelset[1].guiding_force_sum"] for kind in kinds)
    n = min(one.size, other.size)
    assert one.values[:n] == pytest.approx(other.values[:n], abs=2.0)  # lines: (pi h f)^2 / 2


def test_wheelsets_are_told_apart():
    layout = Layout(4)
    t = STEP * np.arange(200)
    forces = {
        port.name(FORCE): ("time", np.full(t.size, 1e4 * (k + 1)))
        for k, port in enumerate(layout.ports)
    }
    forces |= {
        Port(p.wheelset, p.side, Y).name(FORCE): ("time", np.full(t.size, 1e3 * (k + 1) ** 2))
        for k, p in enumerate(layout.ports)
    }
    found = running_safety(xr.Dataset(forces, {"time": t}, {"speed": SPEED}))
    for i in range(1, 5):
        left, right = i, i + 4  # by hand: 0.1 k of Y/Q, outward on the right
        for side, value in (("left", -0.1 * left), ("right", 0.1 * right)):
            quotient = found[f"wheelset[{i}].{side}.derailment_quotient"]
            assert quotient.values == pytest.approx(value)
        total = found[f"wheelset[{i}].guiding_force_sum"]
        assert total.values == pytest.approx(1e3 * (left**2 + right**2))
        assert total.attrs["limit"] == pytest.approx(10e3 + 1e4 * (left + right) / 3)


@pytest.mark.parametrize(
    ("run", "says"),
    [
        (run_of((0, 0), (80e3, 80e3), STEP * np.arange(30)), r"1\.45 m.*2 m"),
        (run_of((0, 0), (80e3, 80e3), 0.01 * np.arange(300)), r"step 0\.01.*0\.005"),
        (run_of((0, 0), (80e3, 80e3), speed=0.0), "speed 0"),
        (run_of((0, 0), (80e3, 0.0)), "carry nothing"),
        (run_of((0, 0), None), r"no wheelset\[1\]\.left\.force_z"),
        (run_of((0, 0), (80e3, 80e3)).drop_vars("wheelset[1].right.force_y"), "not all"),
        (run_of((0, 0), (80e3, 80e3), np.array([0.0, 1.0, 0.5])), "increase"),
    ],
)
def test_what_cannot_be_told(run, says):
    with pytest.raises(ParameterError, match=says):
        running_safety(run)
