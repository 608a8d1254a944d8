"""Temporary folders of processes that ended, and how."""

from __future__ import annotations

import errno
import os
import subprocess
import sys
import tempfile

import pytest

from railcosim.storage import lock
from railcosim.storage.temporary import scratch

JOB = """
import sys, time
from railcosim.storage.temporary import scratch
(scratch() / "file").write_text("x")
print(scratch(), flush=True)
sys.stdin.read()
"""


def start(folder):
    job = subprocess.Popen(
        [sys.executable, "-c", JOB], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        env={**os.environ, "TMPDIR": str(folder)},
    )  # fmt: skip
    return job, job.stdout.readline().strip()


def end(job):
    with job:
        job.stdin.close()


def names(folder):
    return {str(path) for path in folder.iterdir()}


def test_gone_at_the_end(tmp_path):
    job, folder = start(tmp_path)
    assert names(tmp_path) == {folder}
    end(job)
    assert names(tmp_path) == set()


def test_swept_after_kill(tmp_path):
    """The next process removes what a dead one left; not what a living one has."""
    living, of_the_living = start(tmp_path)
    dead, of_the_dead = start(tmp_path)
    with dead:
        dead.kill()
    assert names(tmp_path) == {of_the_living, of_the_dead}
    third, of_the_third = start(tmp_path)
    assert names(tmp_path) == {of_the_living, of_the_third}
    end(living)
    end(third)
    assert names(tmp_path) == set()


def test_where_nothing_can_be_locked_nothing_is_swept(tmp_path, monkeypatch):
    """Some file systems have no locks: a living process's folder looks like a dead one's."""
    living, of_the_living = start(tmp_path)

    def refuse(descriptor):
        raise OSError(errno.ENOLCK, "no locks available")

    monkeypatch.setattr(lock, "_lock", refuse)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    ours = scratch()
    assert names(tmp_path) == {of_the_living, str(ours)}
    end(living)


def test_not_ours(tmp_path, monkeypatch):
    """Folders without our lock, links, and files stay."""
    (tmp_path / "railcosim_results").mkdir()
    (tmp_path / "railcosim_notes").write_text("x")
    (tmp_path / "theirs").mkdir()
    (tmp_path / "theirs" / "lock").write_text("")
    (tmp_path / "railcosim_link").symlink_to(tmp_path / "theirs")
    before = names(tmp_path)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    ours = scratch()
    assert names(tmp_path) == before | {str(ours)}
    assert scratch() == ours


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() != 0, reason="needs another user")
def test_another_users(tmp_path, monkeypatch):
    (tmp_path / "railcosim_a").mkdir()
    (tmp_path / "railcosim_a" / "lock").write_text("")
    os.chown(tmp_path / "railcosim_a", 12345, -1)
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    scratch()
    assert (tmp_path / "railcosim_a" / "lock").exists()
