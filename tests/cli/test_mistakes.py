"""Whatever is wrong: the exit status that fits, one line that helps, no traceback, in a moment."""

import pytest

MISTAKES = {
    # Words on their way to the screen.
    "frf --out f.nc --frequencies 0:100:1": "--frequencies 0:100:1: ",
    "run --out [red]:100:/r.nc": "--out [red]:100:/r.nc: there is no folder [red]:100:",
    "export --out e --track escape.toml": r"unknown table or key [\x1b]0;pwn\x07]",
    "export --out e --track wordy.toml": "AAA': must be a table, [rail]",
    # Parameter files.
    "export --out e --track /dev/zero": "/dev/zero: is no file",
    "export --out e --vehicle .": ".: is no file",
    "export --out e --vehicle missing.toml": "missing.toml: cannot be read: No such file",
    "export --out e --vehicle binary.toml": "binary.toml: not a TOML file",
}


@pytest.fixture
def files(tmp_path):
    (tmp_path / "escape.toml").write_text('["\\u001b]0;pwn\\u0007"]\n')
    (tmp_path / "wordy.toml").write_text(f'rail = "{"A" * 900_000}"\n')
    (tmp_path / "binary.toml").write_bytes(bytes(range(256)))


@pytest.mark.usefixtures("files")
@pytest.mark.parametrize("command", MISTAKES)
def test_a_mistake_is_one_line_and_status_2(railcosim, command):
    status, out, err = railcosim(*command.split())
    assert (status, out) == (2, "")
    assert err.startswith("error: ")
    assert MISTAKES[command] in err
    assert err.count("\n") == 1
    assert len(err) < 2100
    assert err.strip().isprintable()


def test_exhausted_memory_is_one_line_and_status_1(railcosim, monkeypatch):
    def exhausted(*arguments):
        raise MemoryError("Unable to allocate 3 PiB")

    monkeypatch.setattr("railcosim.cli.receptance.direct_receptance", exhausted)
    status, _, err = railcosim("track-receptance", "--out", "r.nc")
    assert status == 1
    assert err == "error: out of memory: ask for less at once (Unable to allocate 3 PiB)\n"
