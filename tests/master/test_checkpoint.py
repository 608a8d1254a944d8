"""Runs that are written and go on: the same bits, whatever happens in between."""

from __future__ import annotations

import io
import os
import pickle
import random
import re
import subprocess
import sys
import time
import zipfile
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from railcosim.master import journal, plain
from railcosim.master.checkpoint import (
    CheckpointError,
    Checkpoints,
    CheckpointWarning,
    results_of,
    resume,
)
from railcosim.master.component import Component, ComponentError
from railcosim.master.cosimulation import cosimulate
from railcosim.master.files import load
from railcosim.master.pace import FixedStep
from railcosim.master.recording import Recorder, record
from railcosim.master.schemes.aitken import aitken
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.iqn_ils import iqn_ils
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.schemes.nepce import nepce
from railcosim.master.step_control import StepControl

from .oscillator import make_system

ABOUT = {"speed": 250 / 3.6, "irregularity": "none"}
STEP, STOP = 0.01, 1.0
SCHEMES = [jacobi(degree=2), gauss_seidel(first="left"), aitken(), iqn_ils(), nepce()]
PACES = [
    FixedStep(STEP),
    StepControl(order=2, relative=1e-3, absolute=1e-3, largest=0.05, smallest=1e-6),
]


def make_run(scheme=SCHEMES[0], pace=PACES[0], stop=STOP, **options):
    system = make_system()
    return cosimulate(system, scheme, pace, stop), Recorder(system, **options)


def finish(run, recorder):
    stopped = record(run, recorder)
    assert stopped is None
    return recorder.rows().tobytes()


def write(path, stop_after=0.5, every=0.1, **options):
    """Run, writing, until a time; the checkpoint is before it."""
    run, recorder = make_run(**options)
    for point in Checkpoints(path, every).watch(run, recorder, ABOUT):
        recorder.add(point)
        if point.time >= stop_after:
            return recorder


def go_on(path, about=ABOUT, **options):
    run, recorder = make_run(**options)
    resume(path, run, recorder, about)
    return run, recorder


@pytest.mark.parametrize("pace", PACES, ids=str)
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
def test_same_bits(tmp_path, scheme, pace):
    options = {"scheme": scheme, "pace": pace}
    whole = finish(*make_run(**options))
    write(tmp_path / "run", **options)
    run, recorder = go_on(tmp_path / "run", **options)
    assert 0.3 < run.time <= 0.5
    assert finish(run, recorder) == whole


def test_a_memory_left_out_would_show(tmp_path):
    """What `test_same_bits` shows is not that memories do not matter."""
    for scheme, pace in [(nepce(), PACES[0]), (jacobi(), PACES[1])]:
        options = {"scheme": scheme, "pace": pace}
        whole = finish(*make_run(**options))
        write(tmp_path / "run", **options)
        run, recorder = go_on(tmp_path / "run", **options)
        fresh, _ = make_run(**options)
        run.stepper.memory, run.walk.memory = fresh.stepper.memory, fresh.walk.memory
        if pace is PACES[0]:
            run.walk.memory = len(recorder) - 1
        assert finish(run, recorder) != whole


def test_thinned_recording_and_another_end(tmp_path):
    whole = finish(*make_run(every=7, stop=2.0, pace=FixedStep(0.03)))
    write(tmp_path / "run", every=0.1, stop=0.5, pace=FixedStep(0.03))
    write(tmp_path / "run", every=0.1, stop=0.5, stop_after=0.51, pace=FixedStep(0.03))
    run, recorder = make_run(every=7, stop=0.5, pace=FixedStep(0.03))
    finish(Checkpoints(tmp_path / "run", 0.01).watch(run, recorder, ABOUT), recorder)
    assert finish(*go_on(tmp_path / "run", every=7, stop=2.0, pace=FixedStep(0.03))) == whole


def test_resumed_twice_in_the_same_file(tmp_path):
    whole = finish(*make_run())
    write(tmp_path / "run", stop_after=0.35)
    run, recorder = go_on(tmp_path / "run")
    for point in Checkpoints(tmp_path / "run", 0.1).watch(run, recorder, ABOUT):
        recorder.add(point)
        if point.time > 0.75:
            break
    run, recorder = go_on(tmp_path / "run")
    assert run.time == pytest.approx(0.7)
    assert finish(run, recorder) == whole


def test_results_so_far(tmp_path):
    recorder = write(tmp_path / "run.checkpoint", stop_after=0.55, every=0.2)
    path = results_of(tmp_path / "run.checkpoint")
    assert path.name == "run.checkpoint.nc"
    found, all_of_it = load(path), recorder.to_dataset(ABOUT)
    assert found.time.values.tolist() == all_of_it.time.values[:41].tolist()
    assert found.time[-1] == pytest.approx(0.4)
    for name, variable in all_of_it.data_vars.items():
        assert found[name].values.tobytes() == variable.values[:41].tobytes()
        assert found[name].attrs == variable.attrs
    assert found.attrs["irregularity"] == "none"


def test_rows_are_written_once(tmp_path):
    """A checkpoint adds what is new, however much there is already."""
    run, recorder = make_run()
    sizes = []
    for point in Checkpoints(tmp_path / "run", STEP).watch(run, recorder, ABOUT):
        recorder.add(point)
        if results_of(tmp_path / "run").exists():
            sizes.append(results_of(tmp_path / "run").stat().st_size)
    assert set(np.diff(sizes)) == {8 * 5}  # time and 4 outputs


# --- refusals ------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("options", "about", "words"),
    [
        ({"scheme": jacobi(degree=1)}, ABOUT, "Jacobi, quadratic inputs.*there and.*linear"),
        ({"pace": FixedStep(0.010000001)}, ABOUT, r"step 0\.01 s' there and.*0\.010000001 s' here"),
        ({}, ABOUT | {"speed": 70.0}, r"speed is '69\.4.*' there and '70\.0' here"),
        ({}, ABOUT | {"new": "x"}, "new is 'not given' there and 'x' here"),
        ({"stop": 0.3}, ABOUT, r"written at t = 0\.5 s, but the run ends at 0\.3 s"),
        ({"variables": ["z"]}, ABOUT, None),
    ],
)
def test_another_run_is_refused(tmp_path, options, about, words):
    path = tmp_path / "run"
    write(path, stop_after=0.51)
    if words is None:  # fewer columns are in the results: no harm
        _, recorder = go_on(path, about, **options)
        assert recorder.rows().shape == (51, 2)
        return
    with pytest.raises(CheckpointError, match=words) as caught:
        go_on(path, about, **options)
    assert "\n" not in str(caught.value)
    assert str(caught.value).startswith(str(path))


def test_other_components_are_refused(tmp_path):
    write(tmp_path / "run")
    run, recorder = make_run()
    left = run.system.components[0]

    class Description:
        sha256 = "f00"

    left.description = Description()
    with pytest.raises(CheckpointError, match="component left is 'LinearComponent' there and 'sha"):
        resume(tmp_path / "run", run, recorder, ABOUT)


def pickled():
    return pickle.dumps(print)


def zipped(**members):
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, data in members.items():
            archive.writestr(f"{name}.npy", data)
    return file.getvalue()


def object_array():
    file = io.BytesIO()
    np.savez(file, tree=np.array([print]))
    return file.getvalue()


def huge_array():
    """A header that asks for 8 TB."""
    header = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        header, {"descr": "<f8", "fortran_order": False, "shape": (10**12,)}
    )
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as archive:
        archive.writestr("tree.npy", header.getvalue())
    return file.getvalue()


@pytest.mark.parametrize(
    "data",
    [
        b"", b"no zip", pickled(), zipped(tree=b"0" * 10**6), object_array(), huge_array(),
        plain.dumps(None), plain.dumps((1, 2, 3)), plain.dumps(tuple("abcdefgh")),
    ],
)  # fmt: skip
def test_foreign_files_are_refused(tmp_path, data):
    path = tmp_path / "run"
    write(path)
    path.write_bytes(data)
    with pytest.raises(CheckpointError, match=r"not a (railcosim )?checkpoint") as caught:
        go_on(path)
    assert "\n" not in str(caught.value)


def test_damage_is_found(tmp_path):
    """Any byte: the sums of the parts, or the structure around them, do not fit."""
    path = tmp_path / "run"
    write(path)
    data = path.read_bytes()
    whole = finish(*make_run())
    rng = random.Random(1)
    refused = 0
    for _ in range(200):
        place = rng.randrange(len(data))
        bad = bytearray(data)
        bad[place] ^= 1 << rng.randrange(8)
        path.write_bytes(bad)
        try:
            run, recorder = go_on(path)
        except CheckpointError:
            refused += 1
        else:
            # Bytes that zip does not use, such as dates.
            assert finish(run, recorder) == whole
    assert refused > 100
    for length in rng.sample(range(len(data)), 20):
        path.write_bytes(data[:length])
        with pytest.raises(CheckpointError):
            go_on(path)


def test_damage_in_the_rows_is_found(tmp_path):
    """Any bit that counts, with the file's name and the place."""
    path = tmp_path / "run"
    write(path, stop_after=0.95)
    results = results_of(path)
    data = results.read_bytes()
    rng = random.Random(3)
    for place in [*range(4, 8), *(rng.randrange(len(data)) for _ in range(100))]:
        bad = bytearray(data)
        bad[place] ^= 1 << rng.randrange(8)
        results.write_bytes(bad)
        with pytest.raises(CheckpointError) as caught:
            go_on(path)
        assert str(caught.value).startswith(f"{results}: ")
        if 4 <= place < 8:  # how many rows there are
            continue
        begin, end = map(int, re.search(r"bytes (\d+) to (\d+)", str(caught.value)).groups())
        assert begin <= place < end
        points = re.search(r"between points (\d+) and (\d+)", str(caught.value))
        if points is not None:
            first, last = map(int, points.groups())
            assert 40 * (last - first + 1) == end - begin  # five columns
            assert last - first <= 10  # a checkpoint every 0.1 s


def test_seals_stay_few(tmp_path, monkeypatch):
    """However many checkpoints there were, and all is still sealed."""
    monkeypatch.setattr(journal, "_MOST_SEALS", 10)
    path = tmp_path / "run"
    write(path, stop_after=0.5, every=STEP)
    n_rows = len(go_on(path)[1])
    assert n_rows > 45
    assert len(plain.loads(path.read_bytes())[-1]) <= 11
    data = results_of(path).read_bytes()
    for row in range(n_rows):
        bad = bytearray(data)
        bad[-40 * n_rows + 40 * row] ^= 1  # five columns
        results_of(path).write_bytes(bad)
        with pytest.raises(CheckpointError, match="it is damaged between points"):
            go_on(path)


# --- one run a file ------------------------------------------------------------------------------


def test_a_second_run_is_refused(tmp_path):
    path = tmp_path / "run"
    run, recorder = make_run()
    points = Checkpoints(path, 0.1).watch(run, recorder, ABOUT)
    recorder.add(next(points))
    second = Checkpoints(path, 0.1).watch(*make_run(), ABOUT)
    with pytest.raises(CheckpointError, match="run: another run is writing it"):
        next(second)
    whole = finish(*make_run())
    assert finish(points, recorder) == whole
    assert finish(*go_on(path)) == whole
    write(path)  # free again
    assert sorted(p.name for p in tmp_path.iterdir()) == ["run", "run.nc"]


@pytest.mark.parametrize(
    ("name", "other", "words"),
    [
        ("run", "notes", "run: damaged, or not a checkpoint .*; it is not replaced"),
        ("run.nc", "CDF results", "run.nc: not rows of a checkpoint; it is not replaced"),
    ],
)
def test_what_is_something_else_stays(tmp_path, name, other, words):
    (tmp_path / name).write_text(other)
    with pytest.raises(CheckpointError, match=words):
        write(tmp_path / "run")
    assert (tmp_path / name).read_text() == other


def test_devices(tmp_path):
    """Endless to read, and never to be replaced."""
    (tmp_path / "run").symlink_to("/dev/zero")
    with pytest.raises(CheckpointError, match="run: is a device"):
        go_on(tmp_path / "run")
    with pytest.raises(CheckpointError, match="run: is a device"):
        write(tmp_path / "run")
    write(tmp_path / "other")
    results_of(tmp_path / "other").unlink()
    results_of(tmp_path / "other").symlink_to("/dev/zero")
    with pytest.raises(CheckpointError, match=r"other\.nc: is a device"):
        go_on(tmp_path / "other")
    assert Path("/dev/zero").is_char_device()


def rewritten(path, change):
    """A checkpoint whose values were changed, its sums being right."""
    values = list(plain.loads(path.read_bytes()))
    change(values)
    path.write_bytes(plain.dumps(tuple(values)))


def set_output(value):
    def change(values):
        values[5][2][0] = value

    return change


def drop_output(values):
    values[5] = (*values[5][:2], values[5][2][:-1])


def drop_component(values):
    values[5] = (values[5][0][:-1], *values[5][1:])


def too_many_rows(values):
    values[2] = values[3] = 1000


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (set_output(np.nan), "does not fit the run: the outputs must be 4 finite numbers"),
        (set_output(np.inf), "does not fit the run: the outputs must be 4 finite numbers"),
        (drop_output, "does not fit the run: the outputs must be 4 finite numbers"),
        (drop_component, "does not fit the run"),
        (too_many_rows, "cannot be used: it has 51 points and not 1000"),
    ],
)
def test_values_are_checked(tmp_path, change, words):
    write(tmp_path / "run", stop_after=0.51)
    rewritten(tmp_path / "run", change)
    with pytest.raises(CheckpointError, match=words):
        go_on(tmp_path / "run")


def test_results_are_checked(tmp_path):
    path = tmp_path / "run"
    write(path)
    results = results_of(path)
    good = results.read_bytes()
    for data, words in [
        (None, "cannot be used"),
        (b"", "cannot be used"),
        (b"CDF\x02" + b"\xff" * 200, "cannot be used"),
        (good[:300], "cannot be used"),
    ]:
        results.unlink() if data is None else results.write_bytes(data)
        with pytest.raises(CheckpointError, match=words) as caught:
            go_on(path)
        assert "\n" not in str(caught.value)
    write(tmp_path / "other", scheme=jacobi(degree=1))
    results.write_bytes(results_of(tmp_path / "other").read_bytes())
    with pytest.raises(CheckpointError, match="in its head, or of another run"):
        go_on(path)


def test_missing_file(tmp_path):
    with pytest.raises(CheckpointError, match=r"none: cannot be read \(No such file"):
        go_on(tmp_path / "none")


@pytest.mark.parametrize("every", [0.0, -1.0, float("nan"), float("inf")])
def test_every_is_checked(every):
    with pytest.raises(ValueError, match="every must be positive and finite"):
        Checkpoints(Path("x"), every)


def test_component_that_cannot(tmp_path, monkeypatch):
    """Said at the first point, not after hours."""

    def refuse(self, state):
        raise ComponentError(f"{self.name}: cannot write its state to a file")

    monkeypatch.setattr(Component, "serialize_state", refuse)
    run, recorder = make_run()
    points = Checkpoints(tmp_path / "run", 0.1).watch(run, recorder, ABOUT)
    recorder.add(next(points))
    with pytest.raises(
        CheckpointError, match="no checkpoint of this run is possible: left: cannot"
    ):
        next(points)


def test_full_disk_is_a_warning(tmp_path, monkeypatch):
    whole = finish(*make_run())
    fsync, calls = os.fsync, []

    def full(file):
        calls.append(file)
        if 10 < len(calls) < 20:
            raise OSError(28, "No space left on device")
        fsync(file)

    monkeypatch.setattr(os, "fsync", full)
    run, recorder = make_run()
    points = Checkpoints(tmp_path / "run", 0.1).watch(run, recorder, ABOUT)
    with pytest.warns(CheckpointWarning, match=r"no checkpoint at t = .* \(.*No space left"):
        rows = finish(points, recorder)
    assert rows == whole
    assert finish(*go_on(tmp_path / "run")) == whole
    assert sorted(p.name for p in tmp_path.iterdir()) == ["run", "run.nc"]


# --- plain values --------------------------------------------------------------------------------

ARRAYS = hnp.arrays(
    st.sampled_from([np.float64, np.int64, np.complex128, np.bool_, np.uint8]),
    hnp.array_shapes(min_dims=0, max_dims=3, min_side=0, max_side=4),
)
VALUES = st.recursive(
    st.none() | st.booleans() | st.integers() | st.floats() | st.text() | st.binary() | ARRAYS,
    lambda inner: st.lists(inner, max_size=4).map(tuple),
)


def same(a, b):
    if isinstance(a, np.ndarray):
        layout = ("C_CONTIGUOUS", "F_CONTIGUOUS")
        return (a.dtype, a.shape, a.tobytes()) == (b.dtype, b.shape, b.tobytes()) and [
            a.flags[f] for f in layout
        ] == [b.flags[f] for f in layout]
    if isinstance(a, tuple):
        return isinstance(b, tuple) and len(a) == len(b) and all(map(same, a, b))
    return type(a) is type(b) and repr(a) == repr(b)


@given(VALUES)
def test_plain_values_come_back(value):
    assert same(value, plain.loads(plain.dumps(value)))


def test_order_of_an_array_comes_back():
    """Sums over it round differently in another one."""
    matrix = np.arange(6.0).reshape(2, 3)
    assert same(matrix.T, plain.loads(plain.dumps(matrix.T)))


@pytest.mark.parametrize("value", [object(), {"a": 1}, np.array([object()]), print])
def test_other_values_are_refused(value):
    with pytest.raises(TypeError, match="no plain value"):
        plain.dumps(value)


# --- kill -9 -------------------------------------------------------------------------------------

JOB = Path(__file__).with_name("killed_job.py")


@pytest.mark.slow  # processes are killed and go on
def test_killed_at_each_stage_of_writing(tmp_path):
    """Before and after each call that makes something lasting, in the first two checkpoints."""
    whole = finish(*make_run())
    calls = 30  # trials make two calls, a checkpoint eight, the next five; before and after each
    with subprocess.Popen(
        [sys.executable, JOB, tmp_path, str(calls)], stdout=subprocess.DEVNULL
    ) as job:
        assert job.wait() == 0
    for call in range(calls):
        path = tmp_path / str(call)
        if call < 17:  # nothing has its name yet, or only the results
            assert not path.exists()
            continue
        run, recorder = go_on(path)
        assert len(load(results_of(path)).time) >= len(recorder)
        assert finish(run, recorder) == whole


@pytest.mark.slow  # processes are killed and go on
def test_killed_at_random(tmp_path):
    """Again and again, each time going on from the last checkpoint, until the end is reached."""
    whole = finish(*make_run())
    path, rng = tmp_path / "run", random.Random(2)
    killed = 0
    times = [0.0]
    while True:
        # A point is a page, and the pipe has one: the job is never far ahead of who kills it.
        with subprocess.Popen(
            [sys.executable, JOB, path], stdout=subprocess.PIPE, pipesize=4096
        ) as job:
            for _ in range(rng.randrange(5, 50)):
                job.stdout.readline()
            time.sleep(rng.uniform(0.0, 0.004))  # into what follows: 3 ms of writing, most of it
            job.kill()
        if job.returncode == 0:
            break
        killed += 1
        run, recorder = go_on(path)
        times.append(run.time)
        assert finish(run, recorder) == whole
    assert times == sorted(times)
    assert killed > 2
