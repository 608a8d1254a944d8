"""Nothing that was computed is lost: full disks, signals, bad targets, two commands at once."""

from __future__ import annotations

import os
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path

import pytest

from railcosim.cli import results
from railcosim.cli.main import app
from railcosim.cli.options import UsageError
from railcosim.master.files import load
from railcosim.storage.lock import held

COMMAND = [sys.executable, "-c", "from railcosim.cli.main import run; run()"]
JOB = Path(__file__).with_name("interrupted_job.py")


@pytest.fixture
def pair(exported):
    """Options of a run that takes about a second."""
    return ["--vehicle-fmu", exported["Vehicle"], "--track-fmu", exported["TrackWithContact"],
            "--time", "0.03", "--irregularity", "none"]  # fmt: skip


MOMENTS = ["SIGINT@saving", "SIGTERM@saving", "SIGTERM@0.5"]
WORDS = {"SIGINT": "interrupted", "SIGTERM": "terminated"}


@pytest.mark.slow  # a process for each moment: only whole commands have handlers and exits
def test_interrupted_at_any_moment(pair, tmp_path) -> None:
    """There is a file with all points until then, or the run had not begun."""
    job = [sys.executable, JOB, tmp_path, ",".join(MOMENTS), "run", *map(str, pair)]
    environment = {**os.environ, "COLUMNS": "200", "TMPDIR": str(tmp_path)}
    job += ["--checkpoint", "c", "--every", "0.01"]
    subprocess.run([*job, "--out", "run.nc"], check=True, timeout=1800, env=environment)
    assert not list(tmp_path.glob("railcosim_*/*_*"))  # no FMU is left unpacked
    whole = load(tmp_path / "whole" / "run.nc")
    kept = []
    hint = "railcosim run --resume c goes on from the last checkpoint"
    for k, moment in enumerate(MOMENTS):
        folder, word = tmp_path / str(k), WORDS[moment.partition("@")[0]]
        said = (folder / "said").read_text()
        assert ((folder / "status").read_text(), said.splitlines()[-1]) == ("1", f"error: {word}")
        assert "Traceback" not in said
        assert not list(folder.glob(".*"))
        assert (hint in said) == (folder / "c").exists()
        if (folder / "run.nc").exists():
            run = load(folder / "run.nc")
            n = run.sizes["time"]
            kept.append(n)
            assert run.time.values.tobytes() == whole.time.values[:n].tobytes()
            # A signal that comes after the last point changes nothing of the result.
            assert run.attrs["stopped"] == (word if n < whole.sizes["time"] else "no")
    assert kept[:2] == [whole.sizes["time"]] * 2


def test_no_room(pair, tmp_path) -> None:
    """The result goes elsewhere, the command says where, and fails."""
    home = tmp_path / "home"
    home.mkdir()
    full = tmp_path / "full"
    full.mkdir()
    limited = (
        "from railcosim.master import files; really = files.save\n"
        "def save(dataset, path):\n"
        "    if 'run.nc' in str(path) or 'full' in str(path): raise OSError(28, 'No space left')\n"
        "    really(dataset, path)\n"
        "files.save = save\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", limited + COMMAND[2], "run", *map(str, pair), "--out", "run.nc",
         "--plot", "run.png"],
        cwd=full, env={**os.environ, "COLUMNS": "200", "HOME": str(home)},
        capture_output=True, text=True, timeout=1800, check=False,
    )  # fmt: skip
    assert done.returncode == 1
    (there,) = home.glob("railcosim-*")
    assert f"run.nc: cannot be written (No space left); the result is in {there}" in done.stderr
    assert done.stderr.splitlines()[-1] == "error: run.nc: not written"
    assert load(there).sizes["time"] == 301
    assert [p.name for p in full.iterdir()] == ["run.png"]


@pytest.mark.parametrize(
    ("command", "option", "words"),
    [
        (["run", "--out", "none/x.nc"], "--out", "there is no folder none"),
        (["run", "--out", "x.nc", "--checkpoint", "held.nc"], "--checkpoint",
         "another run is writing it"),
        (["run", "--out", "x.nc", "--checkpoint", "device.nc"], "--checkpoint", "is a device"),
        (["run", "--out", "x.nc", "--checkpoint", "file"], "--checkpoint", "it is not replaced"),
        (["frf", "--out", "/proc/x.nc"], "--out", "cannot be written"),
        (["map", "--out", "pipe.nc"], "--out", "is a pipe"),
        (["ride", "--out", "x.nc", "--plot", "folder.png"], "--plot", "is a folder"),
        (["advise", "--out", "device.nc"], "--out", "is a device"),
        (["receptance", "x.fmu", "--input", "a", "--output", "b", "--out", "held.nc"], "--out",
         "another run is writing it"),
        (["export", "--out", "/proc/x"], "--out", "cannot be written"),
        (["study", "--out", "file/x"], "--out", "cannot be written"),
        (["paper", "--out", "file"], "--out", "cannot be written"),
        (["demo", "--out", "file"], "--out", "cannot be written"),
        (["compare", "--uncoupled", "--out", "file"], "--out", "cannot be written"),
        (["stability", "--plot", "none/x.svg"], "--plot", "there is no folder none"),
        (["irregularity", "--out", "none/x.csv"], "--out", "there is no folder none"),
    ],
)  # fmt: skip
def test_targets_are_tried_first(tmp_path, monkeypatch, command, option, words) -> None:
    """Before anything is exported, computed or asked of a compiler."""
    os.mkfifo(tmp_path / "pipe.nc")
    (tmp_path / "folder.png").mkdir()
    (tmp_path / "file").write_text("mine")
    (tmp_path / "device.nc").symlink_to("/dev/null")
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr("railcosim.cli.export.exported", None)
    with ExitStack() as claimed, held(tmp_path / "held.nc"):
        monkeypatch.setattr(results, "_claimed", claimed)
        with pytest.raises(UsageError, match=f"^{option} .*{words}"):
            app(command, standalone_mode=False)
    assert not list(tmp_path.glob(".*"))
