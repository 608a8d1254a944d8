"""Files held by one process at a time."""

from __future__ import annotations

import subprocess
import sys

import pytest

from railcosim.storage.lock import HeldError, held

HOLD = """
import sys, time
from pathlib import Path
from railcosim.storage.lock import held
with held(Path(sys.argv[1])):
    print("held", flush=True)
    time.sleep(60)
"""


def test_held_by_one(tmp_path):
    path = tmp_path / "run"
    with held(path):
        with pytest.raises(HeldError, match="run: another run is writing it"), held(path):
            pass
        with held(tmp_path / "other"):
            pass
    assert list(tmp_path.iterdir()) == []
    with held(path):  # free again
        pass


def test_by_another_name(tmp_path):
    (tmp_path / "link").symlink_to(tmp_path / "run")
    with held(tmp_path / "run"), pytest.raises(HeldError), held(tmp_path / "link"):
        pass


def test_free_when_the_process_is_killed(tmp_path):
    path = tmp_path / "run"
    with subprocess.Popen([sys.executable, "-c", HOLD, path], stdout=subprocess.PIPE) as job:
        job.stdout.readline()
        with pytest.raises(HeldError), held(path):
            pass
        job.kill()
    assert (tmp_path / ".run.lock").exists()
    with held(path):
        pass
    assert list(tmp_path.iterdir()) == []
