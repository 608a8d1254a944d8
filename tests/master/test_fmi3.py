"""What an FMU of FMI 3.0 may do, and what becomes of it."""

from __future__ import annotations

import warnings
import zipfile

import numpy as np
import pytest

from railcosim.master.checkpoint import Checkpoints
from railcosim.master.component import Variable
from railcosim.master.connections import Connection, CouplingError
from railcosim.master.cosimulation import cosimulate
from railcosim.master.course import Keeping
from railcosim.master.fmi.description import describe_file
from railcosim.master.fmi.fmu import FmuComponent, FmuError
from railcosim.master.fmi.isolation import IsolatedComponent
from railcosim.master.fmi.layers import LayerWarning
from railcosim.master.fmi.loaded_fmu import FmuWarning
from railcosim.master.linear.model_exchange import adjoint, differences, exact, linear_model
from railcosim.master.recording import Recorder, record
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.schemes.picard import picard
from railcosim.master.signals import Signal
from railcosim.master.system import System
from railcosim.master.system_run import run_ssp

from .anybody3 import ABLE, WHOLE, description, make_fmu3
from .plant import pack, ssd, values
from .test_types import component, one

LOADS = [FmuComponent.load, IsolatedComponent.load]


def begun(path, load=FmuComponent.load, parameters=None, **options):
    """One of them, ready to be stepped."""
    fmu = load(path, **options)
    fmu.set_parameters(parameters or {})
    fmu.enter_initialization(0.0)
    fmu.exit_initialization()
    return fmu


def ran(system, scheme=None, step=0.25, stop=1.0):
    """Names to values at all points, what stopped the run, and the run."""
    run = cosimulate(system, jacobi(degree=0) if scheme is None else scheme, step, stop)
    recorder = Recorder(system)
    stopped = record(run, recorder)
    rows = recorder.rows()
    return dict(zip(("time", *system.names), rows.T.tolist(), strict=True)), stopped, run


def whole(letters="", end=""):
    return " ".join(f"{k.lower()}{end}" for k in WHOLE if letters in k)


@pytest.mark.parametrize("load", LOADS)
def test_all_types_pass_through(tmp_path, load):
    """Each whole number comes back plus one, here and there: b gets what a gives."""
    names = f"f f_out b not_b choice chosen {whole()} {whole(end='_out')}"
    path = make_fmu3(tmp_path / "A.fmu", variables=names)
    with begun(path, load, name="a") as a, begun(path, load, name="b") as b:
        wires = [(f"{k}_out", k) for k in ("f", *whole().split())]
        wires += [("not_b", "b"), ("chosen", "choice")]
        found, stopped, _ = ran(System([a, b], [Connection("a", y, "b", u) for y, u in wires]))
    assert stopped is None
    assert found["a.f_out"] + found["b.f_out"] == [0.5] * 5 + [1.0] * 5
    for k in whole().split():
        assert (set(found[f"a.{k}_out"]), set(found[f"b.{k}_out"])) == ({4.0}, {5.0})
    assert (set(found["a.not_b"]), set(found["b.not_b"])) == ({1.0}, {0.0})
    assert set(found["b.chosen"]) == {1.0}


@pytest.mark.parametrize(
    ("kind", "value", "words"),
    [
        ("int8", 128, "int8 = 128: is of type Integer, which holds whole numbers from -128 to 127"),
        ("uint16", -1, "from 0 to 65535"),
        ("int64", 2.0**54, "from -9.00719925e.15 to 9.00719925e.15"),
        ("f", 1e39, "f = 1e.39: is of type Real, which holds numbers from -3.4"),
    ],
)
def test_what_a_type_does_not_hold(tmp_path, kind, value, words):
    path = make_fmu3(tmp_path / "A.fmu", variables=f"{kind} {kind}_out")
    with begun(path) as fmu, pytest.raises(RuntimeError, match=words):
        fmu.set_inputs([value])


def test_whole_numbers_that_are_not_exact_are_not_given(tmp_path):
    path = make_fmu3(tmp_path / "A.fmu", variables="int64 int64_out")
    with begun(path) as fmu:
        fmu.set_inputs([2.0**53])
        with pytest.raises(RuntimeError, match="int64_out = 9007199254740993: is"):
            fmu.read_outputs()


def test_parameters_of_all_types_and_elements(tmp_path):
    names = "label length data sum v w n gain"
    given = {"label": "twelve signs", "data": "0102ff", "gain[2]": 10.0}
    with begun(make_fmu3(tmp_path / "A.fmu", variables=names), parameters=given) as fmu:
        told = dict(zip((v.name for v in fmu.outputs), fmu.get_outputs(), strict=True))
        with pytest.raises(FmuError, match=r"parameter gain\[1\] is fixed; set it before"):
            fmu.set_parameters({"gain[1]": 2.0})
    assert told == {"length": 12, "sum": 258, "w[1]": 1.0, "w[2]": 20.0, "w[3]": 9.0}


@pytest.mark.parametrize("load", LOADS)
def test_texts_and_bytes_are_passed_on(tmp_path, load):
    path = make_fmu3(tmp_path / "A.fmu", variables="text said bytes copied length sum x")
    given = {"text": "twelve signs", "bytes": "00ff02"}
    with begun(path, parameters=given, name="a") as a, begun(path, load, name="b") as b:
        wires = [Connection("a", "said", "b", "text"), Connection("a", "copied", "b", "bytes")]
        found, stopped, _ = ran(System([a, b], wires))
        assert stopped is None
        assert (found["b.length"][-1], found["b.sum"][-1]) == (12, 257)
        assert (b.get_text("said"), b.get_text("copied")) == (b"twelve signs", b"\0\xff\2")
        for y, u, words in (
            ("said", "bytes", "String feeds Binary"),
            ("x", "text", r"a\.x -> b\.text: what is no text feeds String"),
        ):
            with pytest.raises(CouplingError, match=words):
                System([a, b], [Connection("a", y, "b", u)])


@pytest.mark.parametrize("load", LOADS)
def test_structural_parameters_change_the_interface(tmp_path, load):
    path = make_fmu3(tmp_path / "A.fmu", variables="v w n gain")
    with load(path, name="a") as fmu:
        assert [v.name for v in fmu.inputs] == ["v[1]", "v[2]", "v[3]"]
        fmu.set_parameters({"gain[5]": 7.0, "n": 5})
        assert [v.name for v in fmu.outputs] == [f"w[{k}]" for k in range(1, 6)]
        assert fmu.feedthrough.shape == (5, 5)
        fmu.enter_initialization(0.0)
        fmu.set_inputs(np.ones(5))
        assert fmu.get_outputs().tolist() == [1, 2, 3, 4, 7]
        fmu.exit_initialization()
        with pytest.raises(FmuError, match="parameter n is fixed; set it before"):
            fmu.set_parameters({"n": 2})


def test_arrays_are_connected_whole_or_by_element(tmp_path):
    path = make_fmu3(tmp_path / "A.fmu", variables="v w n gain")
    with begun(path, name="a") as a, begun(path, name="b") as b:
        found, _, _ = ran(System([a, b], [Connection("a", "w", "b", "v")]))
        assert [found[f"b.w[{k}]"][-1] for k in (1, 2, 3)] == [1.0, 8.0, 27.0]
        found, _, _ = ran(System([a, b], [Connection("a", "w[3]", "b", "v[1]")]))
        assert [found[f"b.w[{k}]"][-1] for k in (1, 2, 3)] == [9.0, 4.0, 9.0]
        with pytest.raises(CouplingError, match=r"a\.w -> b\.v\[1\]: an array of 3 feeds one"):
            System([a, b], [Connection("a", "w", "b", "v[1]")])


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('valueReference="42"', 'start="99999999999"'), "v has 99999999999 elements; the limit"),
        (('start="1 2 3"', 'start="1 2"'), "v has 2 start values for 3 elements"),
        (('valueReference="42"', 'valueReference="7"'), "is not valid FMI 3.0"),
    ],
)
def test_arrays_that_cannot_be(tmp_path, change, words):
    path = make_fmu3(tmp_path / "A.fmu", variables="v w n gain", v=change)
    with pytest.raises(FmuError, match=words):
        describe_file(path)


@pytest.mark.parametrize(
    ("mode", "times", "x", "ended"),
    [
        ("ends", [0, 0.25, 0.5], [0, 0.125, 0.25], "a ended the run after t = 0.5 s"),
        ("ends early", [0, 0.25], [0, 0.125], "a ended the run after t = 0.25 s"),
    ],
)
def test_ends_of_runs(tmp_path, mode, times, x, ended):
    """After a whole step its values are a result; in a step those before it."""
    with begun(make_fmu3(tmp_path / "A.fmu", mode), name="a") as fmu:
        found, stopped, run = ran(System([fmu], []))
    assert (found["time"], found["a.x"], stopped) == (times, x, None)
    assert run.ended.startswith(ended)


def test_what_fails(tmp_path):
    for mode, words in (
        ("errs", "a: fmi3DoStep at t = 0.25 s gave status error"),
        ("stuck", "a: fmi3DoStep from t = 0.25 s returned early"),
        ("stuck in events", "a: fmi3DoStep from t = 0.25 s returned early, at once, 10000 times"),
        ("nan", "diverged at t = 0.5 s: a.x = nan"),
    ):
        about = {"variables": "u x countdown", "able": EVENTS} if "events" in mode else {}
        with begun(make_fmu3(tmp_path / f"{mode}.fmu", mode, **about), name="a") as fmu:
            found, stopped, _ = ran(System([fmu], []))
        assert found["a.x"] == [0.0, 0.125]
        assert words in str(stopped)


def test_warnings_are_plain_text(tmp_path):
    with begun(make_fmu3(tmp_path / "A.fmu", "warns"), name="a") as fmu:
        ran(System([fmu], []))
        with pytest.warns(FmuWarning, match=r"^a warned 4 times: a step of 100%s \(4 times\)$"):
            fmu.close()


def test_early_returns_are_gone_on_from(tmp_path):
    path = make_fmu3(tmp_path / "A.fmu", "early", "u x steps")
    with begun(path, name="a") as fmu:
        found, stopped, _ = ran(System([fmu], []))
    assert stopped is None
    assert found["a.x"] == [0, 0.125, 0.25, 0.375, 0.5]
    assert found["a.steps"] == [0, 3, 6, 9, 12]  # halves, and the halves of the second ones


# --- inputs within a step ---

ASKS = f'{ABLE} providesIntermediateUpdate="true"'
BETWEEN = {"u": ("start=", 'intermediateUpdate="true" start=')}


def test_inputs_are_interpolated_where_they_are_asked_for(tmp_path):
    """x' = 3 t^2: exact with a parabola, as soon as there is one; also when steps are repeated."""
    path = make_fmu3(tmp_path / "A.fmu", "between", able=ASKS, **BETWEEN)
    for scheme in (picard(degree=2), gauss_seidel(first="signal", degree=2)):
        with begun(path, name="a") as fmu:
            source = Signal("signal", [Variable(name="f")], lambda t: [3 * t * t])
            system = System([source, fmu], [Connection("signal", "f", "a", "u")])
            found, stopped, _ = ran(system, scheme)
        assert stopped is None
        x = np.array(found["a.x"])
        np.testing.assert_allclose(np.diff(x[1:]), np.diff(np.arange(1, 5) ** 3 / 64), rtol=1e-14)


def test_what_order_is_lost_is_said(tmp_path):
    with begun(make_fmu3(tmp_path / "A.fmu"), name="a") as fmu:
        source = Signal("signal", [Variable(name="f")], lambda t: [t])
        system = System([source, fmu], [Connection("signal", "f", "a", "u")])
        with pytest.warns(UserWarning, match=r"a cannot extrapolate .* they are constant, and the"):
            ran(system, jacobi(degree=1))


# --- clocks ---

EVENTS = f'{ABLE} hasEventMode="true"'
TICKS = "u x int8 level clock ticks held countdown rings"


@pytest.mark.parametrize("load", LOADS)
def test_clocks_tick_within_steps(tmp_path, load):
    """Every 0.2 s from the start on, and once 0.05 s behind the third tick."""
    path = make_fmu3(tmp_path / "A.fmu", "clocks", TICKS, able=EVENTS)
    with begun(path, load, name="a") as fmu:
        ramp = Signal("signal", [Variable(name="f")], lambda t: [t])
        found, stopped, _ = ran(System([ramp, fmu], [Connection("signal", "f", "a", "u")]))
    assert stopped is None
    assert found["a.ticks"] == [1, 2, 3, 4, 6]
    assert found["a.held"] == [0.5, 0.0, 0.25, 0.5, 0.75]
    assert found["a.rings"] == [0, 0, 1, 1, 1]
    assert found["a.x"] == pytest.approx([0, 0, 0.0625, 0.1875, 0.375], rel=1e-14)


def test_clocks_go_back_with_the_state(tmp_path):
    path = make_fmu3(tmp_path / "A.fmu", "clocks", TICKS, able=EVENTS)
    with begun(path) as fmu:
        assert fmu.rollback_fault is None
        fmu.do_step(0.0, 0.3)
        state, data = fmu.save_state(), fmu.serialize_state(fmu.save_state())
        seen = []
        for back in (lambda: state, lambda: fmu.deserialize_state(data), lambda: state):
            fmu.restore_state(back())
            fmu.do_step(0.3, 0.3)
            seen.append(fmu.get_outputs().tolist())
        assert seen[0] == seen[1] == seen[2]


def test_inputs_go_along_through_the_ticks_of_a_step(tmp_path):
    """x' = 3 t^2, its parabola counted from the beginning of the step, not from the last tick."""
    able = f'{EVENTS} providesIntermediateUpdate="true"'
    path = make_fmu3(tmp_path / "A.fmu", "clocks", "u x clock countdown", able=able, **BETWEEN)
    with begun(path, name="a") as fmu:
        source = Signal("signal", [Variable(name="f")], lambda t: [3 * t * t])
        system = System([source, fmu], [Connection("signal", "f", "a", "u")])
        found, stopped, _ = ran(system, picard(degree=2))
    assert stopped is None
    expected = np.diff(np.arange(1, 5) ** 3 / 64)
    np.testing.assert_allclose(np.diff(found["a.x"][1:]), expected, rtol=1e-14)


def test_a_countdown_begins_at_the_time_gone_back_to(tmp_path):
    """Set off at 0.25 s it rings at 0.3 s; the third tick's at 0.45 s."""
    path = make_fmu3(tmp_path / "A.fmu", "clocks", "level clock countdown rings", able=EVENTS)
    with begun(path) as fmu:
        fmu.do_step(0.0, 0.25)
        state = fmu.save_state()
        fmu.do_step(0.25, 0.25)
        fmu.restore_state(state)
        fmu.set_inputs([7.0])
        fmu.do_step(0.25, 0.25)
        assert fmu.get_outputs().tolist() == [2.0]


def test_texts_are_set_at_events(tmp_path):
    path = make_fmu3(tmp_path / "A.fmu", "clocks", "text clock countdown length", able=EVENTS)
    with begun(path) as fmu:
        fmu.do_step(0.0, 0.25)
        fmu.set_text("text", b"five5")
        fmu.do_step(0.25, 0.25)
        assert fmu.get_outputs().tolist() == [5.0]


@pytest.mark.parametrize("names", ["u x level", "f f_out", "v w n gain"])
def test_what_cannot_be_interpolated(tmp_path, names):
    """Discrete inputs, and short floats: they are held. Arrays may have no elements."""
    text = description(variables=names, able=ASKS)
    for old, new in (
        ('causality="input"', 'causality="input" intermediateUpdate="true"'),
        ('fixed" start="3"', 'fixed" start="0"'),
        ('start="1 2 3"', 'start="1"'),
    ):
        text = text.replace(old, new)
    path = make_fmu3(tmp_path / "A.fmu", text=text)
    with begun(path) as fmu:
        assert fmu.max_input_derivative == 0
        fmu.do_step(0.0, 0.25)


def test_an_event_that_the_fmu_finds(tmp_path):
    path = make_fmu3(tmp_path / "A.fmu", "event", "u x events countdown", able=EVENTS)
    with begun(path, name="a") as fmu:
        found, _, _ = ran(System([fmu], []))
    assert found["a.events"] == [1, 1, 2, 2, 2]
    assert found["a.x"] == pytest.approx([0, 0.125, 0.25, 0.375, 0.5], rel=1e-15)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (('"constant"', '"triggered"'), "its clock clock is triggered: somebody else has to"),
        ((' intervalDecimal="0.2"', ""), "status error|has no interval"),
    ],
)
def test_clocks_that_cannot_be(tmp_path, change, words):
    path = make_fmu3(tmp_path / "A.fmu", "clocks", TICKS, able=EVENTS, clock=change)
    with pytest.raises((FmuError, RuntimeError), match=words):
        begun(path)


def test_ticks_within_steps_of_one_length(tmp_path):
    fixed = EVENTS.replace('canHandleVariableCommunicationStepSize="true"', "")
    path = make_fmu3(tmp_path / "A.fmu", "clocks", TICKS, able=fixed)
    with begun(path, name="a") as fmu:
        _, stopped, _ = ran(System([fmu], []))
    assert "a: has an event at t = 0.2 s, within a step, and takes steps of one" in str(stopped)


# --- linear models ---


@pytest.mark.parametrize("way", [exact, adjoint, differences])
def test_linear_models_of_arrays(tmp_path, way):
    able = 'providesDirectionalDerivatives="true" providesAdjointDerivatives="true"'
    names = "v w n gain s ds"
    path = make_fmu3(tmp_path / "A.fmu", variables=names, able=able, kind="ModelExchange")
    model = linear_model(path, slope=way, parameters={"n": 4, "gain[4]": 0.5})
    gain = np.diag([1.0, 2.0, 3.0, 0.5])
    assert [v.name for v in model.inputs] == [f"v[{k}]" for k in (1, 2, 3, 4)]
    for found, expected in zip(
        (model.A.toarray(), model.B, model.C, model.D),
        (-gain, np.eye(4), np.zeros((4, 4)), gain),
        strict=True,
    ):
        np.testing.assert_allclose(found, expected, rtol=1e-12, atol=1e-12)


def test_derivatives_of_a_step(tmp_path):
    path = make_fmu3(tmp_path / "A.fmu", variables="u x v w n gain derivatives_of_step")
    with begun(path) as fmu:
        fmu.do_step(0.0, 0.25)
        expected = np.zeros((4, 4))
        expected[0, 0], expected[1:, 1:] = 0.25, np.diag([1.0, 2.0, 3.0])
        np.testing.assert_array_equal(fmu.step_derivative(), expected)


def test_flawed_descriptions_are_one_line(tmp_path):
    """60 texts with a piece lost, doubled or replaced: read, or refused with a sentence."""
    random = np.random.default_rng(5)
    names = f"u x f f_out b not_b choice chosen label data v w n gain s ds {TICKS}"
    text = description(variables=" ".join(dict.fromkeys(names.split())))
    pieces = ["", '"', "<", ">", "0", "-1", "1e999", "nan", 'start=""', "Float64", "é", "999999999"]
    path, messages = tmp_path / "A.fmu", []
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        for _ in range(60):
            begin = random.integers(len(text))
            end = begin + random.integers(12)
            piece = pieces[random.integers(len(pieces))]
            make_fmu3(path, text=text[:begin] + piece + text[end:])
            try:
                describe_file(path)
            except FmuError as error:
                messages.append(str(error))
    assert len(messages) > 10
    assert not [m for m in messages if "\n" in m]


def test_layered_standards_are_said_once(tmp_path):
    path = make_fmu3(tmp_path / "A.fmu")
    namespace = 'xmlns:fmi-ls="http://fmi-standard.org/fmi-ls-manifest"'
    with zipfile.ZipFile(path, "a") as archive:
        for name in ("bus", "ref"):
            about = (
                f'fmi-ls:fmi-ls-name="org.fmi-standard.fmi-ls-{name}" fmi-ls:fmi-ls-version="1.0"'
            )
            where = f"extra/org.fmi-standard.fmi-ls-{name}/fmi-ls-manifest.xml"
            archive.writestr(where, f"<fmiLayeredStandardManifest {namespace} {about}/>")
    words = (
        r"A.fmu: uses the layered standards org.fmi-standard.fmi-ls-bus 1.0 \(network comm.*\), of"
    )
    with pytest.warns(LayerWarning, match=words):
        FmuComponent.load(path).close()
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        FmuComponent.load(path).close()


# --- systems ---


def package(tmp_path, sizes=""):
    """Two of them in an SSP: whole arrays, a length of them, texts."""
    names = "u x v w n gain label length"
    fmu = make_fmu3(tmp_path / "A.fmu", variables=names)
    kinds = "u=input x=output v=input w=output"
    text = component(values(sizes), kinds) + component("", kinds).replace('"a"', '"b"')
    wires = (
        '<ssd:Connections><ssd:Connection startElement="a" startConnector="w" endElement="b" '
        'endConnector="v"/><ssd:Connection startElement="a" startConnector="x" endElement="b" '
        'endConnector="u"/></ssd:Connections>'
    )
    return pack(tmp_path / "s.ssp", ssd(f"<ssd:Elements>{text}</ssd:Elements>{wires}"), A__fmu=fmu)


def outcome(path, load=FmuComponent.load, **how):
    dataset, stopped = run_ssp(
        path, lambda usual: jacobi(degree=0), lambda t, end: None, load=load, step=0.25,
        **({"time": 1.0} | how)
    )  # fmt: skip
    return dataset, stopped


def test_in_an_ssp(tmp_path):
    """Also from a checkpoint: the same numbers."""
    path = package(tmp_path, one("label", "String", "four") + one("gain[2]", "Real", "5"))
    dataset, stopped = outcome(path)
    assert stopped is None
    assert dataset["b.x"].values.tolist() == [0, 0, 0.03125, 0.09375, 0.1875]
    assert dataset["b.w[2]"].values.tolist() == [20.0] * 5
    assert dataset["a.length"].values[-1] == 4
    assert dataset.attrs["start a.gain[2]"] == 5
    kept = tmp_path / "c.chk"
    outcome(path, time=0.5, keeping=Keeping(checkpoints=Checkpoints(kept, 0.1, {})))
    resumed, stopped = outcome(path, keeping=Keeping(resume=kept))
    assert stopped is None
    assert resumed.equals(dataset)


def test_arrays_of_other_lengths_in_an_ssp(tmp_path):
    path = package(tmp_path, one("n", "Integer", "2"))
    with pytest.raises(FmuError, match=r"a\.w -> b\.v: an array of 2 feeds an array of 3"):
        outcome(path)
