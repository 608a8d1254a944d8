"""A second direction by data alone: a rail that also moves to the right, a mass on a spring.

Nothing of mechanics, FMUs or master knows of it: the body has more columns and modes, the layout a
direction more, and names, both runtimes and linear models follow. Closed forms: a rail that
moves as a whole under the sum of all lateral forces on it.
"""

from dataclasses import replace

import numpy as np
import pytest

from railcosim.fmus.content import Content
from railcosim.fmus.export import WITH_STATES
from railcosim.fmus.interface import Start, interface
from railcosim.fmus.start import contact_defaults
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.linear.model_exchange import linear_model
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import FORCE, RAIL, Layout, Y, Z
from railcosim.mechanics.stepping import State
from railcosim.track.parameters import Mesh, Track
from railcosim.track.reduced import reduce_track
from railcosim.vehicle.parameters import Vehicle

MASS, STIFFNESS, DAMPING = 500.0, 2e7, 1.2e4  # of a rail: kg, N/m, N s/m
TOGETHER = 0.3  # of the receptance: how far one rail moves if the other is pushed
POSITIONS = np.array([12.3, 4.5])
LAYOUT = Layout(2, directions=(Z, Y))


def with_lateral(body: ModalBody) -> ModalBody:
    """With one even and one odd mode more, of constant shape across and none downwards.

    h(t) = exp(-d t) sin(w t) / (m w) = Re(exp(pole t) / (i m w)); a force on one rail is half an
    even and half an odd one, so each has half of it, more or less by what the rails do together.
    """
    d = DAMPING / (2 * MASS)
    w = np.sqrt(STIFFNESS / MASS - d**2)
    residue = 1 / (2j * MASS * w) * np.array([1 - TOGETHER, 1 + TOGETHER])  # even, odd
    shapes, even, n = body.shapes, body.even, body.shared
    # An even mode moves the left rail to the right and the right one to the left.
    order = np.r_[:even, n, even:n, n + 1]
    back = np.argsort(order)

    def grown(array, two):
        return np.concatenate([array, two], axis=-1)[..., order]

    down = grown(shapes.table, np.zeros((*shapes.table.shape[:2], 2)))
    across = np.zeros_like(down)
    across[:, 0, [even, n + 1]] = np.sqrt(residue)
    partner = np.concatenate([shapes.partner, [n, n + 1]])[order]
    pole = complex(-d, w)
    shared = grown(body.poles[:n], [pole, pole])
    quiet = np.zeros((len(shapes.local_table), 2, 2, 2), complex)
    quiet[:, :, :1, :1] = shapes.local_table
    return replace(
        body, layout=LAYOUT, even=even + 1,
        poles=np.concatenate([shared, np.full(8, body.poles[-1])]),
        shapes=replace(
            shapes, table=np.concatenate([down, across], axis=1).astype(np.complex64),
            mu=grown(shapes.mu, [0.0, 0.0]), partner=back[partner],
            local_table=quiet,
        ),
        rigid_out=np.zeros((4, 0)), rigid_into=np.zeros((4, 0)), preload=np.zeros(8),
    )  # fmt: skip


@pytest.fixture(scope="module")
def plain():
    mesh = Mesh(cells=6, elements_per_bay=2, highest_slab_frequency=200, highest_frequency=400)
    return reduce_track(Track(mesh=mesh)).under(Layout(2))


@pytest.fixture(scope="module")
def body(plain):
    return with_lateral(plain)


@pytest.fixture(scope="module")
def coupled(body):
    """With local oscillators of both directions, each of which moves the rail both ways."""
    own = body.shapes.local_table[:, :, :1, :1]
    table = own * np.array([[1.0, 0.3 + 0.2j], [-0.4 + 0.1j, 0.7]])
    table = table * np.random.default_rng(3).uniform(0.5, 1.5, (len(table), 1, 1, 1))
    poles = body.poles.copy()
    poles[body.shared + 1 :: 2] *= 0.8
    return replace(body, poles=poles, shapes=replace(body.shapes, local_table=table))


def native(body, folder):
    """The native FMU of a body."""
    loads = [7e4] * 4
    start = Start(loads=loads, positions=POSITIONS.tolist(), contact=contact_defaults(Vehicle()))
    content = Content(
        name="Track", model="track", text="Moves across too.", parameters="", annotations={},
        table=interface(body, start, with_contact=False), body=body,
    )  # fmt: skip
    path = folder / "Track.fmu"
    WITH_STATES.pack(content, path, lambda text: None)
    return path


@pytest.fixture(scope="module")
def fmu(body, tmp_path_factory):
    """The native FMU of it."""
    return native(body, tmp_path_factory.mktemp("lateral"))


def across(values):
    """Lateral numbers of all ports, (sides, wheelsets)."""
    return np.asarray(values).reshape(2, 2, 2)[..., 1]


def test_static_deflection_across(body, plain):
    """The sum of all forces on a rail over its spring, and a part of those on the other."""
    force = np.array([7e4, 1e3, 6e4, 2e3, 5e4, -4e3, 8e4, 500.0])
    met = body.at(POSITIONS)
    z = met.motion(met.rest(force))
    left, right = across(force).sum(axis=1)
    expected = np.array([left + TOGETHER * right, right + TOGETHER * left]) / STIFFNESS
    own = plain.at(POSITIONS)
    # Single precision of the shapes; no force across moves the rail down, or the reverse.
    assert across(z) == pytest.approx(np.repeat(expected, 2).reshape(2, 2), rel=1e-6)
    down = own.motion(own.rest(force.reshape(-1, 2)[:, 0]))
    assert z.reshape(-1, 2)[:, 0] == pytest.approx(down, rel=1e-12)


def test_mirrored_forces_make_mirrored_motions(body):
    """Both rails pushed inwards alike: the right one to the left. Down: both down."""
    met = body.at(POSITIONS)
    inwards = np.array([7e4, 1e3, 0, 0, 7e4, -1e3, 0, 0])
    z = met.motion(met.rest(inwards)).reshape(2, 4)
    assert z[1] == pytest.approx(np.array([1, -1, 1, -1]) * z[0], rel=1e-12)
    assert np.abs(z).min() > 1e-6


def test_impulse_across(body):
    """The free decay of a mass on a spring."""
    met, t = body.at(POSITIONS), 3e-3
    pushed = met.drive(np.eye(8)[1])  # wheelset 1, left, to the right
    z = met.motion(State(np.exp(body.poles * t) * pushed.s, np.empty(0), np.empty(0)))
    d = DAMPING / (2 * MASS)
    w = np.sqrt(STIFFNESS / MASS - d**2)
    h = np.exp(-d * t) * np.sin(w * t) / (MASS * w)
    assert across(z)[:, 0] == pytest.approx([h, TOGETHER * h], rel=1e-6)


def moved_at_rest(fmu, force):
    """Motions of the rails at rest, from the FMU."""
    with FmuComponent.load(fmu) as one:
        one.enter_initialization(0.0)
        one.set_inputs(np.concatenate([POSITIONS, force]))
        one.exit_initialization()
        y = dict(zip((v.name for v in one.outputs), one.get_outputs(), strict=True))
    return np.array([y[name] for name in LAYOUT.names(RAIL.motion)])


def test_names_follow(fmu):
    with FmuComponent.load(fmu) as one:
        assert [v.name for v in one.inputs][2:] == list(LAYOUT.names(FORCE))
        assert set(LAYOUT.names(RAIL.rate)) < {v.name for v in one.outputs}
        assert "wheelset[2].right.rail_vy" in {v.name for v in one.outputs}
        units = {v.name: v.unit for v in one.outputs}
        assert units["wheelset[1].left.rail_vy"] == "m/s"


def test_native_runtime_against_numpy(fmu, body):
    """At rest, and the receptance that the master finds of it."""
    force = np.array([7e4, 1e3, 6e4, 2e3, 5e4, -4e3, 8e4, 500.0])
    met = body.at(POSITIONS)
    assert moved_at_rest(fmu, force) == pytest.approx(met.motion(met.rest(force)), rel=1e-11)
    model = linear_model(
        fmu, inputs=LAYOUT.names(FORCE), outputs=LAYOUT.names(RAIL.motion),
        at=dict(zip(LAYOUT.of_axles("position"), POSITIONS.tolist(), strict=True)),
    )  # fmt: skip
    omega = 2 * np.pi * np.array([5.0, 31.8, 90.0])
    H = model.frequency_response(omega)[:, 1, 1]
    expected = 1 / (STIFFNESS - MASS * omega**2 + 1j * omega * DAMPING)
    assert pytest.approx(expected, rel=1e-6) == H


def test_oscillators_that_couple_directions(coupled, tmp_path):
    """Rest, receptances and velocities of both runtimes; the right rail is the mirror image."""
    fmu, met = native(coupled, tmp_path), coupled.at(POSITIONS)
    force = np.array([7e4, 1e3, 6e4, 2e3, 5e4, -4e3, 8e4, 500.0])
    model = linear_model(
        fmu, inputs=LAYOUT.names(FORCE),
        outputs=[*LAYOUT.names(RAIL.motion), *LAYOUT.names(RAIL.rate)],
        at=dict(zip(LAYOUT.of_axles("position"), POSITIONS.tolist(), strict=True)),
    )  # fmt: skip
    omega = 2 * np.pi * np.array([0.0, 31.8, 90.0, 400.0])
    H = model.frequency_response(omega)
    static = met.compliance(-1 / coupled.poles, 0.0)
    assert H[0, :8] == pytest.approx(static, rel=1e-10, abs=1e-18)
    assert H[:, 8:] == pytest.approx(1j * omega[:, None, None] * H[:, :8], rel=1e-8, abs=1e-12)
    assert H[:, 0, 1] == pytest.approx(H[:, 1, 0], rel=1e-10)  # Maxwell and Betti
    assert np.abs(H[:, 0, 1]).min() > 1e-3 * np.abs(H[:, 0, 0]).min()
    mirrored = np.array([1, -1, 1, -1])
    assert H[:, 4:8, 4:] == pytest.approx(
        mirrored[:, None] * H[:, :4, :4] * mirrored, rel=1e-10, abs=1e-18
    )
    assert moved_at_rest(fmu, force) == pytest.approx(met.motion(met.rest(force)), rel=1e-11)
