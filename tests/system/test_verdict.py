"""True loss of contact is believed, that of an unstable coupling is not; a ring of six cells."""

import os
import subprocess
import sys

import numpy as np
import pytest

from railcosim.analysis.pair.owner import FMUS, Owner
from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.time_run import run_pair
from railcosim.analysis.pair.verdict import confirmed, signs_of
from railcosim.analysis.schemes.catalogue import members
from railcosim.master.course import Course
from railcosim.master.files import load
from railcosim.track.irregularity import Flat, flat, synthesise

pytestmark = pytest.mark.slow  # runs repeated with ever shorter steps

SPEED = 250 / 3.6  # m/s


def verdict(exported, owner, scheme, step, stop, **ride):
    """Of a run; None if it shows no sign."""
    vehicle, track = (exported.folder / f"{name}.fmu" for name in FMUS[owner])
    pair = vehicle, track, ride.pop("parameters"), Journey(speed=SPEED, held=False, **ride)
    course = Course(scheme=members()[scheme].scheme, step=step, stop=stop)

    def again(factor, until):
        return run_pair(*pair, course.again(factor, until), lambda done, total: None)

    run, stopped = again(1, stop)
    assert stopped is None
    signs = signs_of(run)
    if not signs.texts:
        return None
    return confirmed(run, signs, again)


@pytest.mark.parametrize(
    ("owner", "scheme", "step"),
    [(Owner.MASTER, "interface-jacobian", 1e-3), (Owner.TRACK, "jacobi-linear", 1e-4)],
)
def test_wheel_flats_that_lose_contact_are_believed(exported, owner, scheme, step) -> None:
    """150 mm on all wheels, 8 GN/m: contact is lost for some percent of the time, and truly."""
    flats = tuple(Flat(length=0.15, wheel=str(i)) for i in (1, 2, 3, 4))
    found = verdict(
        exported, owner, scheme, step, 0.06, profile=flat(), defects=flats,
        parameters={"contact.tangent": 8e9},
    )  # fmt: skip
    assert found is not None
    assert found.believed, str(found)


@pytest.mark.parametrize(
    ("owner", "step"), [(Owner.VEHICLE, 2e-4), (Owner.TRACK, 1e-3), (Owner.TRACK, 5e-3)]
)
def test_hammering_is_not_believed(exported, owner, step) -> None:
    """Too long steps on an irregularity that no wheel leaves."""
    profile = synthesise("german-low", SPEED * 0.2)
    found = verdict(exported, owner, "jacobi-linear", step, 0.2, profile=profile, parameters={})
    assert found is not None
    assert not found.believed, str(found)


def test_a_good_run_is_not_repeated(exported) -> None:
    profile = synthesise("german-low", SPEED * 0.1)
    assert (
        verdict(exported, Owner.TRACK, "jacobi-linear", 1e-4, 0.1, profile=profile, parameters={})
        is None
    )


@pytest.mark.parametrize(("options", "status"), [((), 1), (("--believe",), 0)])
def test_on_the_command_line(exported, tmp_path, options, status) -> None:
    """The result is kept whatever it is worth; file and exit status say what that is."""
    fmus = [exported.folder / f"{name}.fmu" for name in FMUS[Owner.TRACK]]
    done = subprocess.run(
        [sys.executable, "-c", "from railcosim.cli.main import run; run()", "run",
         "--vehicle-fmu", fmus[0], "--track-fmu", fmus[1], "--out", tmp_path / "run.nc",
         "--scheme", "jacobi", "--step", "5e-3", "--time", "0.1", *options],
        env={**os.environ, "COLUMNS": "200"}, capture_output=True, text=True, timeout=1800,
        check=False,
    )  # fmt: skip
    assert done.returncode == status, done.stderr
    kept = load(tmp_path / "run.nc")
    assert kept.sizes["time"] == 21
    assert kept.attrs["stopped"] == "no"
    assert "a wheel is off the rail" in kept.attrs["verdict"]
    assert kept.attrs["verdict"].startswith("not to be believed") == (status == 1)
    assert np.isfinite(kept["carbody.az"]).all()
    if status:
        assert "--believe" in done.stderr
