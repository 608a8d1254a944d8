"""FMUs of a track of two kinds: the compiled runtime against the Python one, and what they say."""

import numpy as np
import pytest

from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.ring import check_line_of
from railcosim.analysis.pair.time_run import run_pair
from railcosim.fmus.content import contents
from railcosim.fmus.export import NativeRuntime, PythonRuntime, packed
from railcosim.master.component import Hold
from railcosim.master.connections import CouplingError
from railcosim.master.course import Course
from railcosim.master.fmi.archive import read_annotations
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.parameters import ParameterError
from railcosim.track.closed_line import ClosedLine
from railcosim.track.irregularity import flat
from railcosim.track.layers import Layer
from railcosim.track.local import LocalChange
from railcosim.track.parameters import Fastening, Mesh, Slab, Track
from railcosim.track.transition import Line
from railcosim.vehicle.parameters import Vehicle

SLABS = Track(
    fastening=Fastening(damping=6e4),
    mesh=Mesh(cells=10, elements_per_bay=6, highest_slab_frequency=500, highest_frequency=1200),
)
BLOCKS = Track(
    slab=Slab(present=False), fastening=Fastening(spacing=0.6, damping=6e4),
    layers=(Layer(name="block", mass=150.0, stiffness=1.5e7, damping=8e4),),
    mesh=Mesh(cells=60, elements_per_bay=6),
)  # fmt: skip
JOINT = 20.0
RUNTIMES = {
    "native": NativeRuntime(documented=False), "python": PythonRuntime(documented=False)
}  # fmt: skip
LINE = ClosedLine(line=Line(tracks=(SLABS, BLOCKS), joints=(JOINT,), names=("slabs", "blocks")))


@pytest.fixture(scope="module")
def made():
    return {one.name: one for one in contents(Vehicle(), SLABS, line=LINE)}


def answers(content, folder, runtime):
    """Outputs as wheels go over the joint, 1.3 m a wheel, and there and back over it at once."""
    with (
        packed([content], folder, runtime=runtime) as files,
        FmuComponent.load(files[content.name]) as fmu,
    ):
        fmu.enter_initialization(0.0)
        names = [v.name for v in fmu.inputs]
        place = np.array([k for k, n in enumerate(names) if n.endswith("position")])
        other = np.array([k for k, n in enumerate(names) if n.endswith(("wheel_z", "force_z"))])
        u = np.array([v.start for v in fmu.inputs])
        u[place] += JOINT - u[place[0]] - 0.6
        size = 1e-5 if names[other[0]].endswith("wheel_z") else 1e3
        fmu.set_inputs(u)
        fmu.exit_initialization()
        fmu.set_hold(Hold.INTERPOLATE)
        rows = []
        for k in range(60):
            u[place] += -0.1 if k in {40, 41} else 60.0 * 4e-4
            u[other] += size * np.sin(k + np.arange(other.size))
            fmu.set_inputs(u)
            fmu.do_step(k * 4e-4, 4e-4)
            rows.append(fmu.get_outputs())
    return np.array(rows)


@pytest.mark.slow  # two FMUs in two runtimes: 8 s
@pytest.mark.parametrize("name", ["Track", "TrackWithContact"])
def test_compiled_and_in_python(made, tmp_path, name):
    native, other = (
        answers(made[name], tmp_path / kind, runtime) for kind, runtime in RUNTIMES.items()
    )
    assert (np.abs(native - other) / np.abs(other).max(axis=0)).max() < 1e-9


@pytest.mark.slow  # a run of 60 ms, FMUs packed: 6 s
def test_a_vehicle_runs_over_the_joint_and_not_where_the_ring_closes(made, tmp_path):
    pair = [made["Vehicle"], made["TrackWithContact"]]
    with packed(pair, tmp_path, runtime=NativeRuntime(documented=False)) as files:
        track = files["TrackWithContact"]
        told = read_annotations(track, "railcosim")["Ring"]
        assert told["kinds"] == "slabs, then blocks from 20 m"
        begin, end = float(told["from"]), float(told["to"])
        assert -30 < begin < 0
        assert JOINT + 5 < end < JOINT + 36
        with pytest.raises(
            CouplingError, match=r"must stay from .* start elsewhere \(--position\)"
        ):
            check_line_of(track, np.array([end + 0.1]))

        def run(stop):
            course = Course(scheme=gauss_seidel(first="vehicle"), step=1e-4, stop=stop)
            journey = Journey(speed=80.0, held=False, profile=flat(), position=-0.5)
            return run_pair(files["Vehicle"], track, {}, journey, course, lambda a, b: None)[0]

        with pytest.raises(CouplingError, match="run a shorter time"):
            run(2.0)
        found = run(0.06)
    place, force, rail = (
        found[f"wheelset[1]{name}"].to_numpy()
        for name in (".position", ".left.force_z", ".left.rail_z")
    )
    before, behind = place < JOINT - 1, place > JOINT + 1
    assert min(before.sum(), behind.sum()) > 50
    assert rail[behind].mean() > 1.3 * rail[before].mean()  # blocks give more than slabs
    assert 0.85 * force[0] < force.min() < force.max() < 1.15 * force[0]  # and no wheel is thrown


def test_what_does_not_go_together_is_refused():
    hanging = [LocalChange(what="fastening", x=20.3125, value=0.0)]
    with pytest.raises(ParameterError, match="on a track of one kind only"):
        contents(Vehicle(), SLABS, changes=hanging, line=LINE)
    with pytest.raises(ParameterError, match="dimension = spatial: tracks of several kinds"):
        contents(Vehicle(), SLABS, dimension="spatial", line=LINE)
