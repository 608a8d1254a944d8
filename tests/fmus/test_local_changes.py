"""FMUs of a track with a hanging fastening: the compiled runtime against the model it carries."""

from dataclasses import replace

import numpy as np
import pytest

from railcosim.analysis.pair.pair import Journey
from railcosim.analysis.pair.time_run import run_pair
from railcosim.analysis.response.bodies import seen_at_ports
from railcosim.fmus.content import contents, track_contents
from railcosim.fmus.export import BARE, NativeRuntime, PythonRuntime, packed
from railcosim.fmus.interface import Start
from railcosim.master.component import Hold
from railcosim.master.course import Course
from railcosim.master.fmi.archive import read_annotations
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.linear.model_exchange import linear_model
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.mechanics.motion import FromOutside, Inputs, Mover
from railcosim.mechanics.ports import FORCE, RAIL
from railcosim.track.irregularity import flat
from railcosim.track.local import LocalChange
from railcosim.track.parameters import Mesh, Sensor, Track
from railcosim.vehicle.parameters import Vehicle

HANGING = [LocalChange(what="fastening", x=20.3125, value=0.0)]  # 1.8 m ahead of the vehicle
TRACK = Track(
    mesh=Mesh(cells=6, elements_per_bay=4, highest_slab_frequency=500, highest_frequency=1500)
)


ONE_SIDED = [
    LocalChange(what="fastening", x=20.3125, value=0.0, sides=(-1,)),
    LocalChange(what="mass", x=20.7, value=15.0, sides=(1,)),
]


SEEN = replace(TRACK, sensor=(
    Sensor(of="fastening", side="left", at=19.6875, quantities=("force_z",)),
    Sensor(of="fastening", side="right", at=19.6875, quantities=("force_z",)),
    Sensor(of="rail", side="left", at=20.3125, quantities=("z", "vz", "bending_moment")),
))  # fmt: skip


@pytest.mark.slow  # modes of two rings together, FMUs packed: 6 s
@pytest.mark.parametrize("sides", [("left", "right"), ("left",)])
def test_rails_that_are_no_mirror_images(tmp_path, sides):
    loads = (5e4, 6e4) * len(sides)
    start = Start(positions=(21.2, 18.7), loads=loads, contact=None)
    (made,) = track_contents(TRACK, start, sides=sides, changes=ONE_SIDED)
    with packed([made], tmp_path, runtime=BARE) as files:
        _moves_as(files["Track"], made.body, ahead=-1.0)
        model = linear_model(files["Track"])
    # The exact linear model, from directional derivatives, is that of the modes where wheels stand.
    omega, met = 2 * np.pi * np.array([10.0, 200.0, 800.0]), made.body.at(np.array([21.2, 18.7]))
    B = np.stack([met.drive(force).s for force in np.eye(made.body.ports)], axis=1)
    C, _ = seen_at_ports(met)
    inputs, outputs = ([v.name for v in side] for side in (model.inputs, model.outputs))
    layout = made.body.layout
    j, i = (
        [inputs.index(n) for n in layout.names(FORCE)],
        [outputs.index(n) for n in layout.names(RAIL.motion)],
    )
    found = model.frequency_response(omega)[:, i][:, :, j]
    for w, G in zip(omega, found, strict=True):
        p, s = made.body.poles, 1j * w
        assert pytest.approx(G, rel=1e-6, abs=1e-14) == 0.5 * (
            (C / (s - p)) @ B + (C / (-s - p)).conj() @ B.conj()
        )


@pytest.mark.slow  # as above, in both runtimes
def test_contacts_on_such_rails_in_both_runtimes(tmp_path):
    made = [
        one
        for one in contents(Vehicle(), SEEN, changes=ONE_SIDED)
        if one.name == "TrackWithContact"
    ]
    answers = []
    for runtime in (NativeRuntime(documented=False), PythonRuntime(documented=False)):
        with (
            packed(made, tmp_path, runtime=runtime) as files,
            FmuComponent.load(files[made[0].name]) as fmu,
        ):
            fmu.enter_initialization(0.0)
            names = [v.name for v in fmu.inputs]
            place = np.array([k for k, n in enumerate(names) if n.endswith("position")])
            wheel = np.array([k for k, n in enumerate(names) if n.endswith("wheel_z")])
            u = np.array([v.start for v in fmu.inputs])
            u[place] += 1.6
            u[wheel] += 1.3e-3
            fmu.set_inputs(u)
            fmu.exit_initialization()
            fmu.set_hold(Hold.INTERPOLATE)
            rows = []
            for k in range(40):
                u[place] += 60.0 * 1e-4
                u[wheel] += 1e-5 * np.sin(k + np.arange(wheel.size))
                fmu.set_inputs(u)
                fmu.do_step(k * 1e-4, 1e-4)
                rows.append(fmu.get_outputs())
            answers.append(np.array(rows))
    native, other = answers
    assert (np.abs(native - other) / np.abs(other).max(axis=0)).max() < 1e-9
    forces = native[0, :8]
    assert np.abs(forces / forces.mean() - 1).max() > 1e-2  # wheels are not all alike
    seen = dict(zip([v.name for v in fmu.outputs][8:], native[-1, 8:], strict=True))
    # Beside the fastening that hangs, on the left: its neighbours carry it, on the right they need
    # not; and the rail bends there.
    assert seen["sensor[1].force_z"] > 1.02 * seen["sensor[2].force_z"] > 0
    assert seen["sensor[3].bending_moment"] > 0


# Modes of two rings, four FMUs packed: 5 s.
@pytest.mark.slow
def test_the_compiled_track_is_its_model(tmp_path):
    made = {one.name: one for one in contents(Vehicle(), TRACK, changes=HANGING)}
    assert "with fastening@20.3125=0" in made["Track"].text
    with packed(made.values(), tmp_path) as files:
        _moves_as(files["Track"], made["Track"].body)
        told = read_annotations(files["TrackWithContact"], "railcosim")
        assert told["Ring"]["changes"] == "fastening@20.3125=0"
        forces = _felt(files)
    # The first wheel comes over it after 1.8 m at 60 m/s, 300 steps: the second is 2.5 m behind.
    swings = np.abs(forces / forces[0] - 1)
    assert swings[250:400, 0].max() > 2 * swings[160:230, 0].max()
    assert swings[250:400, 0].max() > 2 * swings[250:400, 2:].max()


def _felt(files):
    """Contact forces of the left wheels, at 60 m/s on a track that is level."""
    run, stopped = run_pair(
        files["Vehicle"], files["TrackWithContact"], {"contact.nonlinear": True},
        Journey(speed=60.0, held=False, profile=flat()),
        Course(scheme=gauss_seidel(first="vehicle"), step=1e-4, stop=0.06),
        lambda done, total: None,
    )  # fmt: skip
    assert stopped is None
    return np.stack([run[f"wheelset[{i}].left.force_z"].values for i in (1, 2, 3, 4)], axis=1)


def _moves_as(path, body, ahead=1.6):
    """The rail under wheels that roll over the place, under forces from outside."""
    mover, h = Mover(body, FromOutside(), 1e-4), 1e-4
    with FmuComponent.load(path) as fmu:
        fmu.enter_initialization(0.0)
        names = [v.name for v in fmu.inputs]
        place = np.array([k for k, n in enumerate(names) if n.endswith("position")])
        load = np.array([k for k, n in enumerate(names) if n.endswith("force_z")])
        u = np.array([v.start for v in fmu.inputs])
        u[place] += ahead
        u[load] *= np.linspace(0.5, 1.5, load.size)
        fmu.set_inputs(u)
        fmu.exit_initialization()
        state = body.at(u[place]).rest(u[load])
        out = [k for k, v in enumerate(fmu.outputs) if v.name.endswith("rail_z")]
        fmu.set_hold(Hold.INTERPOLATE)
        for k in range(40):
            begin = u.copy()
            u[place] += 60.0 * h
            u[load] *= 1 + 1e-3 * np.sin(k)
            fmu.set_inputs(u)
            fmu.do_step(k * h, h)
            state = mover.step(
                state, Inputs(begin[place], begin[load]), Inputs(u[place], u[load]), h
            )
            expected = body.at(u[place]).motion(state)
            assert fmu.get_outputs()[out] == pytest.approx(expected, rel=1e-8)
