"""Connecting by name, the checks, and the order of the exchange."""

from __future__ import annotations

import re
import warnings

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from railcosim.master.component import Component, Variable
from railcosim.master.connections import (
    Connection,
    CouplingError,
    connect_by_name,
)
from railcosim.master.cosimulation import cosimulate
from railcosim.master.fmi.description import describe_file
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.signals import Signal
from railcosim.master.system import System

from .oscillator import LinearComponent, make_left, make_right
from .plant import make_fmu


class Spy(LinearComponent):
    """Remembers what it was asked."""

    def __init__(self, *arguments, **options):
        super().__init__(*arguments, **options)
        self.calls = []

    def write_inputs(self):
        self.calls.append("write")
        super().write_inputs()

    def read_outputs(self):
        self.calls.append("read")
        super().read_outputs()


def algebra(name, D, inputs, outputs, offset=None):
    """y = offset + D u: no dynamics, all feedthrough."""
    D = np.atleast_2d(np.array(D, float))
    n = len(outputs)
    return Spy(
        name,
        A=np.zeros((n, n)),
        B=np.zeros((n, len(inputs))),
        C=np.eye(n),
        D=D,
        x0=np.zeros(n) if offset is None else offset,
        inputs=[Variable(name=v) if isinstance(v, str) else v for v in inputs],
        outputs=[Variable(name=v) if isinstance(v, str) else v for v in outputs],
    )


def test_connects_equal_names():
    assert [str(c) for c in connect_by_name([make_left(), make_right()])] == [
        "right.force -> left.force",
        "left.z -> right.z",
        "left.vz -> right.vz",
    ]


def test_one_output_can_feed_several():
    source = Signal("source", [Variable(name="z")], lambda t: [t])
    sinks = [algebra(name, [[1.0]], ["z"], [f"{name}_y"]) for name in "ab"]
    assert [c.target for c in connect_by_name([source, *sinks])] == ["a", "b"]


def test_units_must_agree_if_both_are_stated():
    def pair(unit):
        source = Signal("source", [Variable(name="z", unit=unit)], lambda t: [t])
        return [source, algebra("sink", [[1.0]], [Variable(name="z", unit="m")], ["y"])]

    assert len(connect_by_name(pair("m"))) == len(connect_by_name(pair(""))) == 1
    with pytest.raises(CouplingError, match=r"source\.z -> sink\.z: unit mm feeds unit m"):
        connect_by_name(pair("mm"))


def test_two_sources_for_one_input():
    sources = [Signal(name, [Variable(name="z")], lambda t: [t]) for name in ("one", "two")]
    with pytest.raises(CouplingError, match=r"two sources .* one\.z -> sink\.z and two\.z"):
        connect_by_name([*sources, algebra("sink", [[1.0]], ["z"], ["y"])])


@pytest.mark.parametrize("required", [["gap"], ["right.gap"]])
def test_required_inputs(required):
    right = algebra("right", [[1.0]], ["gap"], ["y"])
    assert connect_by_name([right]) == ()
    with pytest.raises(CouplingError, match=r"required inputs right\.gap"):
        connect_by_name([right], required=required)


def test_required_inputs_must_exist():
    with pytest.raises(CouplingError, match="did you mean"):
        connect_by_name([make_left(), make_right()], required=["forze"])
    connect_by_name([make_left(), make_right()], required=["force", "right.vz"])


@pytest.mark.parametrize(
    ("connection", "message"),
    [
        (Connection("lefd", "z", "right", "z"), "no component 'lefd'; did you mean left"),
        (Connection("left", "vvz", "right", "vz"), "left has no output 'vvz'; did you mean vz"),
        (Connection("left", "z", "right", "force"), "right has no input 'force'"),
    ],
)
def test_connections_made_by_hand_are_checked(connection, message):
    with pytest.raises(CouplingError, match=message):
        System([make_left(), make_right()], [connection])


def test_names_of_components_differ():
    with pytest.raises(CouplingError, match="names must differ"):
        System([make_left(), make_left()], [])


def test_unconnected_input_keeps_its_start_value():
    component = algebra("a", [[2.0]], [Variable(name="u", start=3.0)], ["y"])
    system = System([component], [])
    system.exchange()
    assert system.outputs == [6.0]


@pytest.mark.parametrize("order", [(0, 1, 2), (2, 1, 0), (1, 2, 0)])
def test_exchange_follows_the_dependence_not_the_list(order):
    """Irregularity and motion into the contact, its force back to a vehicle without feedthrough."""
    vehicle = Spy(
        "vehicle", A=[[0.0]], B=[[1.0]], C=[[1.0]], D=[[0.0]], x0=[5.0],
        inputs=[Variable(name="force")], outputs=[Variable(name="z")],
    )  # fmt: skip
    track = algebra("track", [[10.0, -10.0]], ["z", "irregularity"], ["force"])
    signal = Signal("signal", [Variable(name="irregularity")], lambda t: [1.0])
    components = [vehicle, track, signal]
    components = [components[i] for i in order]
    system = System(components, connect_by_name(components))
    system.exchange()
    values = dict(zip(system.names, system.outputs, strict=True))
    assert values == {"vehicle.z": 5.0, "track.force": 40.0, "signal.irregularity": 1.0}
    assert vehicle.u == [40.0]
    # One reading each; and no other one as long as nothing can have changed.
    assert (vehicle.calls, track.calls) == (["read", "write"], ["write", "read"])
    system.exchange()
    assert (vehicle.calls, track.calls) == (["read", "write", "write"], ["write", "read"] * 2)


def test_two_components_that_need_each_other_twice():
    """Loops between components are fine as long as no variable depends on itself."""
    a = algebra("a", [[0.0, 0.0], [2.0, 0.0]], ["y1", "unused"], ["x1", "x2"], [1.0, 0.0])
    b = algebra("b", [[3.0, 0.0], [0.0, 5.0]], ["x1", "x2"], ["y1", "y2"])
    system = System([a, b], connect_by_name([a, b]))
    system.exchange()
    np.testing.assert_array_equal(system.outputs, [1.0, 6.0, 3.0, 30.0])


def test_algebraic_loop_is_named():
    a = algebra("a", [[1.0]], ["y"], ["x"])
    b = algebra("b", [[1.0], [0.0]], ["x"], ["y", "other"])
    with pytest.raises(CouplingError, match=r"loop: (a\.x -> b\.y -> a\.x|b\.y -> a\.x -> b\.y);"):
        System([a, b], connect_by_name([a, b]))


class Silent(LinearComponent):
    """Does not say what its outputs depend on at once."""

    feedthrough = Component.feedthrough  # it may be everything

    @property
    def states_dependence(self):
        return np.zeros(len(self.outputs), dtype=bool)


def lag(name, kind, output, input_):
    """x' = -x + u, and its output is x."""
    return kind(
        name, A=[[-1.0]], B=[[1.0]], C=[[1.0]], D=[[0.0]], x0=[1.0],
        inputs=[Variable(name=input_)], outputs=[Variable(name=output)],
    )  # fmt: skip


def test_what_is_not_stated_is_no_loop():
    """Two lags that feed each other and say nothing: run as if they had said so, with a word."""
    runs = []
    for kind in (Silent, LinearComponent):
        pair = [lag("a", kind, "x", "y"), lag("b", kind, "y", "x")]
        with warnings.catch_warnings(record=True) as told:
            warnings.simplefilter("always")
            system = System(pair, connect_by_name(pair))
        words = [str(w.message) for w in told]
        assert len(words) == (kind is Silent)
        assert not words or re.search(r"a\.x -> b\.y -> a\.x|b\.y -> a\.x -> b\.y", words[0])
        points = list(cosimulate(system, jacobi(degree=1), 0.1, 1.0))
        runs.append(np.array([p.outputs.copy() for p in points]))
    np.testing.assert_array_equal(*runs)


def test_what_is_not_stated_counts_where_it_closes_no_loop():
    """Behind a loop, an output that may depend on all its inputs is read after they were set."""
    pair = [lag("a", Silent, "x", "y"), lag("b", Silent, "y", "x")]
    behind = Silent(
        "c", A=np.zeros((1, 1)), B=np.zeros((1, 1)), C=[[0.0]], D=[[3.0]], x0=[0.0],
        inputs=[Variable(name="x")], outputs=[Variable(name="z")],
    )  # fmt: skip
    with pytest.warns(UserWarning, match="one step late"):
        system = System([behind, *pair], connect_by_name([behind, *pair]))
    system.begin(0.0)
    assert system.outputs[system.names.index("c.z")] == 3.0


def test_what_a_description_states(tmp_path):
    """A list that is empty says something, none says nothing."""
    known = describe_file(make_fmu(tmp_path / "a.fmu"))
    # Of x, z and count on u and mode: z on u alone.
    expected = [[False, False], [True, False], [False, False]]
    assert (known.feedthrough.tolist(), known.states_dependence.all()) == (expected, True)
    silent = describe_file(make_fmu(tmp_path / "b.fmu", stated=False))
    assert silent.feedthrough.tolist() == [[True, True], [True, True], [False, False]]
    assert silent.states_dependence.tolist() == [False, False, True]


def test_a_stated_dependence_in_a_loop_stays():
    """y = 2 x at once, stated; x is silent: the loop is cut where nothing is known."""
    gain = algebra("b", [[2.0]], ["x"], ["y"])
    silent = lag("a", Silent, "x", "y")
    with pytest.warns(UserWarning, match="one step late"):
        system = System([silent, gain], connect_by_name([silent, gain]))
    system.begin(0.0)
    assert system.outputs.tolist() == [1.0, 2.0]


@settings(max_examples=40)
@given(data=st.data(), n=st.integers(2, 7))
def test_exchange_solves_any_loop_free_system(data, n):
    """Outputs in a hidden order, dealt out to components at random: y = c + D y after exchange."""
    hidden = data.draw(st.permutations(range(n)))
    lower = np.array(
        [[data.draw(st.sampled_from([0, 0, 1, -2])) for _ in range(n)] for _ in hidden]
    )
    D = np.tril(lower, -1)[np.ix_(hidden, hidden)].astype(float)
    owner = np.array([data.draw(st.integers(0, 2)) for _ in range(n)])
    components, connections, where = [], [], []
    for k in sorted(set(owner)):
        own = np.flatnonzero(owner == k)
        where += list(own)
        inputs = [f"u{j}" for j in range(n)]
        components.append(algebra(f"c{k}", D[own], inputs, [f"y{i}" for i in own], own + 1.0))
        connections += [Connection(f"c{owner[j]}", f"y{j}", f"c{k}", f"u{j}") for j in range(n)]
    system = System(components, connections)
    system.exchange()
    expected = np.linalg.solve(np.eye(n) - D, np.arange(n) + 1.0)
    # Small whole numbers: only the reference's solve rounds.
    np.testing.assert_allclose(system.outputs, expected[where], rtol=1e-12, atol=1e-9)
    for k in range(len(components)):
        np.testing.assert_allclose(system.components[k].u, expected, rtol=1e-12, atol=1e-9)


def test_signal():
    signal = Signal("s", [Variable(name="a"), Variable(name="b")], lambda t: np.array([t, t**2]))
    state = signal.save_state()
    signal.do_step(0.0, 3.0)
    np.testing.assert_array_equal(signal.get_outputs(), [3.0, 9.0])
    signal.restore_state(state)
    np.testing.assert_array_equal(signal.get_outputs(), [0.0, 0.0])
    with pytest.raises(ValueError, match=r"shape \(\), it must be \(1,\)"):
        Signal("s", [Variable(name="a")], np.sin)
