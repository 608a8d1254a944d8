"""The same input gives the same bits, whatever number of threads the environment asks for."""

import os
import subprocess
import sys
import textwrap

import pytest

SHORT = "[mesh]\ncells = 6\nhighest_slab_frequency = 800\nhighest_frequency = 1500\n"
THREADS = ("1", "2")
NAMES = ("Vehicle", "Track", "VehicleWithContact", "TrackWithContact")
COMMAND = "from railcosim.cli.main import run; run()"
REFERENCE = """
import railcosim.cli.main  # as every command begins
import sys
from pathlib import Path
from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.schemes.study_point import ContactCase, reference
from railcosim.track.irregularity import synthesise

ride = Journey(speed=70.0, held=True, profile=synthesise("german-low", 20.0)), 4e-3
stiff = {"contact.nonlinear": False, "contact.stiffness": 1e9}
contact = ContactCase(label="stiff", parameters=stiff)
bodies = [Path(path).read_bytes() for path in sys.argv[1:]]
for _ in range(2):
    print(reference(*ride, contact, *bodies).values.tobytes().hex())
"""


def output(script, *arguments, threads):
    """What a script prints in a process of its own."""
    return subprocess.run(
        [sys.executable, "-c", textwrap.dedent(script), *map(str, arguments)],
        env={**os.environ, "OPENBLAS_NUM_THREADS": threads, "OMP_NUM_THREADS": threads},
        capture_output=True, text=True, check=True, timeout=1800,
    ).stdout  # fmt: skip


@pytest.mark.slow  # two exports of everything, each in a process of its own
@pytest.mark.skipif(os.cpu_count() == 1, reason="one core has one thread")
def test_exported_files_do_not_know_the_threads(tmp_path):
    (tmp_path / "short.toml").write_text(SHORT)
    made = []
    for threads in THREADS:
        out = tmp_path / threads
        output(COMMAND, "export", "--track", tmp_path / "short.toml", "--out", out, threads=threads)
        made.append({path.name: path.read_bytes() for path in out.iterdir()})
    assert set(made[0]) == {*(f"{n}.fmu" for n in NAMES), "Pair.ssp"}
    for name, content in made[0].items():
        assert content == made[1][name], name


@pytest.mark.slow  # a reference in two processes
def test_the_reference_of_a_study_does_not_know_the_threads(exported):
    bodies = exported["Vehicle"], exported["Track"]
    values = [line for t in THREADS for line in output(REFERENCE, *bodies, threads=t).split()]
    assert len(values) == 4
    assert len(set(values)) == 1
