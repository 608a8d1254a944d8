"""Several exports into one folder at the same time."""

import pickle
import subprocess
import sys

import pytest

from railcosim.fmus.export import MixedExport, NativeRuntime, packed

pytestmark = pytest.mark.slow  # four processes export everything at once

# Another process that exports, again and again, when it is told to.
EXPORTS = """import pickle, sys; from pathlib import Path
from railcosim.fmus.export import packed
made = pickle.loads(Path(sys.argv[1]).read_bytes())
print("ready", flush=True)
sys.stdin.readline()
for _ in range(3):
    with packed(made, Path(sys.argv[2])):
        pass
"""


@pytest.fixture(scope="module")
def made(short_contents):
    return [short_contents["Vehicle"]]


def test_four_processes_export_the_same(made, tmp_path):
    """All succeed, and what is there is what one alone writes."""
    (content := tmp_path / "content").write_bytes(pickle.dumps(made))
    with packed(made, tmp_path / "alone") as files:
        expected = {path.name: path.read_bytes() for path in files.values()}
    others = [
        subprocess.Popen(
            [sys.executable, "-c", EXPORTS, str(content), str(tmp_path / "together")],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True,
        )
        for _ in range(4)
    ]  # fmt: skip
    for other in others:
        assert other.stdout.readline() == "ready\n"
    for other in others:
        other.stdin.close()  # go
    assert [other.wait() for other in others] == [0] * 4
    for other in others:
        other.stdout.close()
    assert {p.name: p.read_bytes() for p in (tmp_path / "together").iterdir()} == expected


def test_another_export_meanwhile(made, tmp_path):
    """Two pairs of parameters in one folder are no pair: the last one to end sees it."""
    export = packed(made, tmp_path)
    NativeRuntime(fmi=3).pack(made[0], export.__enter__()["Vehicle"], lambda text: None)
    with pytest.raises(MixedExport, match=r"Vehicle\.fmu: another export.*not belong together"):
        export.__exit__(None, None, None)


def test_the_same_export_meanwhile(made, tmp_path):
    with packed(made, tmp_path) as files:
        NativeRuntime().pack(made[0], files["Vehicle"], lambda text: None)
