"""`railcosim run --resume F`: the checkpoint knows the rest."""

from __future__ import annotations

import shutil
from contextlib import ExitStack, contextmanager

import numpy as np
import pytest

from railcosim.cli import parameter_options, results
from railcosim.cli.main import app
from railcosim.master.checkpoint import CheckpointError, CheckpointWarning, options_of
from railcosim.master.files import load
from railcosim.track.irregularity import synthesise, write_profile

pytestmark = pytest.mark.slow  # each a command that is killed and resumed

CHECKPOINT = ["--checkpoint", "c", "--every", "0.005"]


@pytest.fixture
def railcosim(tmp_path, monkeypatch, exported):
    """A command in a folder of its own; FMUs that are not given are the short track's."""

    @contextmanager
    def fmus_of(vehicles, track, *names, fresh, **others):
        yield tuple(vehicles or [exported[names[0]]]), track or exported[names[1]]

    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(parameter_options, "fmus_of", fmus_of)

    def call(*arguments):
        with ExitStack() as claimed:
            monkeypatch.setattr(results, "_claimed", claimed)
            app([str(a) for a in arguments], standalone_mode=False)

    return call


def same(a, b):
    one, other = load(a), load(b)
    assert one.sizes == other.sizes
    for name, variable in one.variables.items():
        assert variable.values.tobytes() == other[name].values.tobytes(), name


def test_alone_and_longer(railcosim, tmp_path) -> None:
    """The bits of a run that was never interrupted, wherever the files have been moved."""
    options = ["--scheme", "gauss-seidel", "--inputs", "linear", "--contact-stiffness", "2e9",
               "--seed", "4", "--first", "track", "--speed", "200"]  # fmt: skip
    railcosim("run", "--out", "whole.nc", *options, "--time", "0.04")
    railcosim("run", "--out", "run.nc", *options, "--time", "0.02", *CHECKPOINT)
    (tmp_path / "run.nc").unlink()
    railcosim("run", "--resume", "c")
    assert load("run.nc").time[-1] == 0.02
    (tmp_path / "moved").mkdir()
    for path in tmp_path.glob("c*"):
        path.rename(tmp_path / "moved" / path.name)
    railcosim("run", "--resume", "moved/c", "--time", "0.04", "--seed", "4", "--out", "longer.nc")
    same("longer.nc", "whole.nc")
    # It went on writing checkpoints, where it was resumed from, with the options of before.
    options = options_of(tmp_path / "moved" / "c")
    assert options["time"] == 0.04
    assert options["seed"] == 4
    assert options["vehicle_fmu"] == ["c.Vehicle.fmu"]
    assert sorted(p.name for p in (tmp_path / "moved").iterdir()) == [
        "c", "c.TrackWithContact.fmu", "c.Vehicle.fmu", "c.nc",
    ]  # fmt: skip


def test_what_is_given_again_must_agree(railcosim, tmp_path) -> None:
    railcosim("run", "--out", "run.nc", "--time", "0.01", *CHECKPOINT)
    before = (tmp_path / "c").read_bytes()
    for given, words in (
        (["--seed", "4"], "--seed 4: the run in c was begun without it"),
        (["--scheme", "picard"], "--scheme picard: the run in c was begun without it"),
        (["--speed", "100"], "--speed 100: the run in c was begun with 250;"),
        (["--held"], "--held True: the run in c was begun with False"),
        (["--time", "0.004"], r"c: written at t = 0\.005 s, but the run ends at 0\.004 s"),
    ):
        with pytest.raises(CheckpointError, match=words):
            railcosim("run", "--resume", "c", *given)
    shutil.copy("c.Vehicle.fmu", "other.fmu")
    with pytest.raises(CheckpointError, match=r"file is .*c\.Vehicle\.fmu' there and 'other"):
        railcosim("run", "--resume", "c", "--vehicle-fmu", "other.fmu")
    (tmp_path / "elsewhere").mkdir()
    shutil.copy("c.Vehicle.fmu", "elsewhere/c.Vehicle.fmu")
    railcosim("run", "--resume", "c", "--vehicle-fmu", "elsewhere/c.Vehicle.fmu")
    (tmp_path / "c").write_bytes(before)
    (tmp_path / "c.Vehicle.fmu").unlink()
    with pytest.raises(Exception, match=r"c\.Vehicle\.fmu"):
        railcosim("run", "--resume", "c")


def test_a_file_that_was_changed(railcosim, tmp_path) -> None:
    """Of an irregularity, also where the run has not been yet."""
    write_profile(synthesise("german-low", 20.0), tmp_path / "x.csv")
    railcosim("run", "--out", "run.nc", "--irregularity", "x.csv", "--time", "0.01", *CHECKPOINT)
    lines = (tmp_path / "x.csv").read_text().splitlines()
    lines[-1] = lines[-1].rpartition(",")[0] + ",0.001"
    (tmp_path / "x.csv").write_text("\n".join(lines))
    with pytest.raises(CheckpointError, match="irregularity sha256 is"):
        railcosim("run", "--resume", "c")


def test_another_number_of_threads(railcosim, monkeypatch) -> None:
    """No reason to refuse; but the bits are not promised."""
    railcosim("run", "--out", "run.nc", "--time", "0.01", *CHECKPOINT)
    monkeypatch.setenv("OPENBLAS_NUM_THREADS", "3")
    with pytest.warns(CheckpointWarning, match="BLAS threads: 1; here: 3"):
        railcosim("run", "--resume", "c", "--out", "again.nc")
    one, other = load("run.nc"), load("again.nc")
    force = "wheelset[1].left.force_z"
    assert np.allclose(one[force], other[force], rtol=1e-9)
