"""FMUs in processes of their own: the same bits, and what they do to those processes."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import textwrap
import time
from pathlib import Path

import numpy as np
import pytest

from railcosim.master.component import ComponentError
from railcosim.master.cosimulation import cosimulate
from railcosim.master.fmi.fmu import FmuComponent, FmuError
from railcosim.master.fmi.isolation import IsolatedComponent
from railcosim.master.recording import Recorder, record
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.schemes.picard import picard

from .trouble import make_fmu, make_system

SOON = 60.0  # s, in which what happens at once has happened, on a machine that is busy by far
LIMIT = 2.0  # s, in which a step of a microsecond is answered there


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    """Makes FMUs, each once."""
    folder = tmp_path_factory.mktemp("trouble")

    def find(trouble="NONE"):
        path = folder / f"{trouble}.fmu"
        return path if path.exists() else make_fmu(folder, trouble)

    return find


def is_alive(pid):
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    # A zombie answers too: nobody may have waited for an orphan in a container.
    return Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()[0] != "Z"


def wait_for_end(pid):
    end = time.monotonic() + SOON
    while is_alive(pid) and time.monotonic() < end:
        time.sleep(0.01)
    return not is_alive(pid)


@pytest.mark.parametrize(
    "scheme", [jacobi(degree=1), gauss_seidel(first="second"), picard(degree=0)], ids=str
)
@pytest.mark.filterwarnings("ignore::railcosim.master.cosimulation.FallbackWarning")
def test_same_bits(fmu, scheme):
    runs = []
    for load in (FmuComponent.load, IsolatedComponent.load):
        with load(fmu(), name="first") as first, load(fmu(), name="second") as second:
            system = make_system(first, second)
            runs.append([p.outputs.tobytes() for p in cosimulate(system, scheme, 0.03, 1.0)])
    assert runs[0] == runs[1]
    assert len(set(runs[0])) == len(runs[0])  # something happens in every step


@pytest.mark.parametrize(
    ("trouble", "words"),
    [
        ("EXITS", "ended itself with exit status 3"),
        ("ABORTS", "was ended by SIGABRT"),
        ("SEGFAULTS", "was ended by SIGSEGV"),
    ],
)
def test_end_of_the_process_is_an_error(fmu, trouble, words):
    """What was recorded is kept; the other FMU, of the same identifier, is none the worse."""
    with (
        IsolatedComponent.load(fmu(), name="first") as first,
        IsolatedComponent.load(fmu(trouble), name="second") as second,
    ):
        system = make_system(first, second)
        recorder = Recorder(system)
        begun = time.monotonic()
        stopped = record(cosimulate(system, jacobi(degree=0), 0.125, 1.0), recorder)
        assert time.monotonic() - begun < SOON
        assert isinstance(stopped, ComponentError)
        assert str(stopped).startswith(
            f"second: its process {words} in do_step from t = 0.5 s. It printed: last words (step "
        )
        assert recorder.to_dataset().time.values.tolist() == [0.0, 0.125, 0.25, 0.375, 0.5]
        with pytest.raises(FmuError, match="second: closed, or its process has ended"):
            second.get_outputs()
        assert np.isfinite(first.get_outputs()).all()
        assert second.messages == ()


def test_hang_is_an_error(fmu):
    with IsolatedComponent.load(fmu("HANGS"), name="mass", limit=LIMIT) as mass:
        mass.enter_initialization(0.0)
        mass.exit_initialization()
        pid = mass._process._child.pid
        mass.do_step(0.0, 0.5)
        mass.get_outputs()
        begun = time.monotonic()
        mass.do_step(0.5, 0.5)
        with pytest.raises(ComponentError) as caught:
            mass.get_outputs()
        # The limit, and no more than a moment beyond it.
        assert LIMIT <= time.monotonic() - begun < LIMIT + SOON
    assert str(caught.value) == (
        "mass: its process did not answer within 2 s to do_step from t = 0.5 s; it was stopped"
    )
    assert not is_alive(pid)


def test_hang_at_the_end_is_stopped(fmu):
    mass = IsolatedComponent.load(fmu("LINGERS"), limit=0.5)
    pid = mass._process._child.pid
    mass.close()
    mass.close()
    assert not is_alive(pid)


def test_refusals_are_those_of_an_fmu_in_this_process(fmu):
    texts = []
    for load in (FmuComponent.load, IsolatedComponent.load):
        said = []
        with load(fmu("FAILS"), name="mass") as mass, load(fmu(), name="other") as other:
            calls = [
                lambda: (mass.do_step(0.0, 0.1), mass.get_outputs()),
                lambda: mass.set_parameters({"gian": 1.0}),
                lambda: mass.set_parameters({"s": True}),
                mass.exit_initialization,
                lambda: mass.set_inputs(np.zeros(2)),
                lambda: mass.restore_state(other.save_state()),
            ]
            for call in calls:
                with pytest.raises((FmuError, ValueError)) as caught:
                    call()
                said.append((type(caught.value), str(caught.value)))
            mass.enter_initialization(0.0)
            mass.exit_initialization()
            mass.do_step(0.25, 0.25)
            with pytest.raises(ComponentError) as caught:
                (mass.do_step(0.5, 0.25), mass.get_outputs())
            said.append((type(caught.value), str(caught.value)))
        texts.append(said)
    assert texts[0] == texts[1]
    assert "gave status error" in texts[0][-1][1]


def test_snapshots_are_dropped(fmu):
    with IsolatedComponent.load(fmu()) as mass:
        mass.enter_initialization(0.0)
        mass.exit_initialization()
        for _ in range(100):
            mass.save_state()
        state = mass.save_state()
        y = mass.get_outputs()
        assert not mass._process.dropped
        mass.set_inputs(np.array([3.0]))
        mass.do_step(0.0, 1.0)
        assert mass.get_outputs()[0] != y[0]
        mass.restore_state(mass.deserialize_state(mass.serialize_state(state)))
        assert mass.get_outputs().tobytes() == y.tobytes()


def test_bad_files_start_no_process(tmp_path):
    path = tmp_path / "no.fmu"
    path.write_bytes(b"no zip")
    with pytest.raises(FmuError, match="not a readable zip archive"):
        IsolatedComponent.load(path)


def start(script, *arguments, **options):
    """A script in a process of its own; its first line of output, as JSON, and the process."""
    process = subprocess.Popen(
        [sys.executable, "-c", textwrap.dedent(script), *map(str, arguments)],
        stdout=subprocess.PIPE,
        text=True,
        **options,
    )
    return json.loads(process.stdout.readline()), process


STEPPING = """
    import json, sys
    from railcosim.master.fmi.isolation import IsolatedComponent
    with IsolatedComponent.load(sys.argv[1], name="mass") as mass:
        mass.enter_initialization(0.0)
        mass.exit_initialization()
        folder = mass._process._finish.peek()[2][2]
        try:
            print(json.dumps([mass._process._child.pid, str(folder)]), flush=True)
            mass.do_step(0.5, 0.1)
            while True:
                mass.get_outputs()
        except KeyboardInterrupt:
            print("interrupted")
    """


@pytest.mark.parametrize("trouble", ["NONE", "HANGS"])
def test_no_orphans(fmu, trouble):
    """A master killed by -9 leaves no process and no folder, also if the FMU never returns."""
    (pid, folder), process = start(STEPPING, fmu(trouble))
    with process:
        assert is_alive(pid)
        assert Path(folder).is_dir()
        process.kill()
    assert wait_for_end(pid)
    assert not Path(folder).exists()


def test_interrupt_is_for_the_master(fmu):
    (pid, folder), process = start(STEPPING, fmu("HANGS"), start_new_session=True)
    with process:
        time.sleep(0.2)  # into the question that is never answered
        os.killpg(process.pid, signal.SIGINT)  # as a terminal does
        assert process.stdout.read() == "interrupted\n"
        assert process.wait(SOON) == 0
    assert wait_for_end(pid)
    assert not Path(folder).exists()


def test_steps_of_jacobi_overlap(fmu):
    """A step is begun when it is told, and waited for when its outputs are asked for."""
    with IsolatedComponent.load(fmu("HANGS")) as mass:
        mass.enter_initialization(0.0)
        mass.exit_initialization()
        begun = time.monotonic()
        mass.do_step(0.5, 0.1)  # never ends
        assert time.monotonic() - begun < SOON
        mass._process.end()
