"""Our pair as FMI 3.0 under the master: the bits of FMI 2.0 where inputs are held."""

from __future__ import annotations

import warnings

import numpy as np
import pytest

from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.time_run import run_pair
from railcosim.analysis.schemes.catalogue import members
from railcosim.fmus.export import NativeRuntime, packed
from railcosim.master.course import Course
from railcosim.master.linear.model_exchange import linear_model
from railcosim.track.irregularity import synthesise

THIRD = NativeRuntime(fmi=3, documented=False)
SPEED = 250 / 3.6
LINEAR = {"contact.nonlinear": False, "contact.stiffness": 1e9}
PAIRS = {"track": ("Vehicle", "TrackWithContact"), "master": ("Vehicle", "Track")}
HELD = (
    ("jacobi-constant", "track"),
    ("gauss-seidel-constant-vehicle-first", "track"),
    ("picard-constant", "master"),
    ("iqn-ils-constant", "track"),
    ("interface-jacobian", "master"),
)
pytestmark = pytest.mark.slow  # four FMUs more are packed, and pairs of both versions opened: 20 s


@pytest.fixture(scope="module")
def versions(short_contents, packed_by, tmp_path_factory):
    """The four FMUs of one content by FMI 2.0, and by FMI 3.0."""
    folder = tmp_path_factory.mktemp("second")
    with packed(short_contents.values(), folder, runtime=NativeRuntime(documented=False)) as second:
        return second, packed_by(THIRD)


def forces(files, name, owner):
    """All that a short run gives, and what was said."""
    journey = Journey(speed=SPEED, held=True, profile=synthesise("german-low", SPEED * 0.02))
    course = Course(scheme=members()[name].scheme, step=2e-5, stop=4e-4)
    pair = [files[fmu] for fmu in PAIRS[owner]]
    with warnings.catch_warnings(record=True) as said:
        warnings.simplefilter("always")
        dataset, stopped = run_pair(*pair, LINEAR, journey, course, lambda done, total: None)
    assert stopped is None
    words = " ".join(str(w.message) for w in said)
    return np.stack(
        [dataset[v].values for v in dataset.data_vars if "time" in dataset[v].dims]
    ), words


@pytest.mark.parametrize(("name", "owner"), HELD)
def test_held_inputs_give_the_same_bits(versions, name, owner):
    second, third = (forces(files, name, owner)[0] for files in versions)
    np.testing.assert_array_equal(third, second)


def test_a_line_is_their_own_and_a_parabola_is_lost(versions):
    """By `input_hold` the rounding of derivatives alone differs; that an order is lost is said."""
    second, third = (forces(files, "jacobi-linear", "track")[0] for files in versions)
    # Of the largest number, a force. Measured 1e-14: derivatives are rounded, over twenty steps.
    assert np.abs(third - second).max() <= 1e-12 * np.abs(second).max()
    _, said = forces(versions[1], "jacobi-quadratic", "track")
    assert "cannot extrapolate its inputs by a quadratic polynomial; they are linear" in said


def test_linear_models_are_the_same(versions):
    """Found by columns of arrays, and by groups of scalars: the same bits."""
    second, third = (linear_model(files["Vehicle"]) for files in versions)
    assert abs(second.A - third.A).max() == 0.0
    for part in "BCD":
        np.testing.assert_array_equal(getattr(third, part), getattr(second, part))
