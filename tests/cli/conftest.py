"""The command line in this process: a new one takes seconds to begin."""

import warnings
from contextlib import ExitStack
from typing import NamedTuple

import pytest

from railcosim.cli import results
from railcosim.cli.main import run


class Said(NamedTuple):
    """What a command left behind."""

    status: int
    out: str
    err: str


@pytest.fixture
def railcosim(tmp_path, monkeypatch, capfd):
    """Call ``railcosim`` in an empty folder, with arguments of any type."""
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setattr("warnings.showwarning", warnings.showwarning)  # `run` sets its own

    def call(*arguments):
        monkeypatch.setattr("sys.argv", ["railcosim", *(str(a) for a in arguments)])
        capfd.readouterr()
        with ExitStack() as claimed:  # files are a command's until its process ends
            monkeypatch.setattr(results, "_claimed", claimed)
            try:
                run()
                status = 0
            except SystemExit as stop:
                status = stop.code or 0
        return Said(status, *capfd.readouterr())

    return call
