"""Values that are no Reals: passed on, converted where nothing is lost, refused else."""

from __future__ import annotations

import ctypes

import numpy as np
import pytest
import xarray as xr

from railcosim.master.batch.call import Call
from railcosim.master.component import Type, Variable
from railcosim.master.connections import Connection, CouplingError
from railcosim.master.cosimulation import cosimulate
from railcosim.master.fmi.counted import Counted
from railcosim.master.fmi.fmu import FmuComponent, FmuError
from railcosim.master.fmi.isolation import IsolatedComponent
from railcosim.master.recording import Recorder, record
from railcosim.master.schemes.aitken import aitken
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.iqn_ils import iqn_ils
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.schemes.nepce import nepce
from railcosim.master.schemes.picard import picard
from railcosim.master.signals import Signal
from railcosim.master.ssp import Part, open_ssp, write_ssp
from railcosim.master.system import System
from railcosim.master.system_run import run_ssp

from .anybody import TYPES, make_fmu
from .plant import pack, ssd, values

STATES = (
    'canGetAndSetFMUstate="true" canSerializeFMUstate="true" '
    'canHandleVariableCommunicationStepSize="true"'
)


@pytest.fixture(scope="module")
def fmu(tmp_path_factory):
    folder = tmp_path_factory.mktemp("anybody")
    return make_fmu(folder / "A.fmu", able=STATES)


def signal(name, kind, function):
    return Signal("signal", [Variable(name=name, type=kind)], lambda t: [function(t)])


def steps(system, scheme=None):
    """Names to values at t = 0, 0.25, 0.5, 0.75, 1."""
    points = cosimulate(system, jacobi(degree=0) if scheme is None else scheme, 0.25, 1.0)
    return dict(zip(system.names, np.array([p.outputs for p in points]).T.tolist(), strict=True))


@pytest.mark.parametrize("load", [FmuComponent.load, IsolatedComponent.load])
def test_all_types_pass_through(fmu, load):
    """a's outputs feed b: each of every type that can hold them."""
    wires = [("twice", "n"), ("chosen", "choice"), ("not_b", "b"), ("twice", "u")]
    with load(fmu, name="a") as a, load(fmu, name="b") as b:
        source = signal("whole", Type.INTEGER, lambda t: round(8 * t) - 3)
        system = System(
            [source, a, b],
            [Connection("signal", "whole", "a", "n")]
            + [Connection("a", y, "b", u) for y, u in wires],
        )
        for one in (a, b):
            one.enter_initialization(0.0)
            one.exit_initialization()
        found = steps(system)
    assert found["signal.whole"] == [-3, -1, 1, 3, 5]
    assert found["a.twice"] == [-6, -2, 2, 6, 10]
    assert found["b.twice"] == [-12, -4, 4, 12, 20]
    assert found["b.z"] == found["a.twice"]
    assert found["b.chosen"] == [1] * 5
    assert (found["a.not_b"], found["b.not_b"]) == ([1] * 5, [0] * 5)


@pytest.mark.parametrize("c_type", [ctypes.c_int32, ctypes.c_bool], ids=["FMI 2", "FMI 3"])
def test_what_is_true_is_one(c_type):
    """FMI says 1, and C that all but 0 is true; a byte of 2 is what bad FMUs of FMI 3 give."""
    variables = [Variable(name=name, type=Type.BOOLEAN) for name in "abc"]
    found, size = np.empty(3), ctypes.sizeof(c_type)
    own = np.frombuffer(b"".join(v.to_bytes(size, "little") for v in (2, 0, 1)), np.dtype(c_type))
    Counted(variables, found, Call(int, ()), own).to_values()
    assert found.tolist() == [1, 0, 1]


SCHEMES = [
    jacobi(degree=2),
    gauss_seidel(first="signal", degree=1),
    picard(degree=1),
    nepce(),
]


@pytest.mark.parametrize("able", ["", ' canInterpolateInputs="true"'])
@pytest.mark.parametrize("scheme", SCHEMES, ids=str)
@pytest.mark.filterwarnings("ignore::railcosim.master.cosimulation.FallbackWarning")
def test_no_polynomial_through_whole_numbers(tmp_path, scheme, able):
    """0, then 1 at once: extrapolated it would be 2. The Real beside it goes along its line."""
    path = make_fmu(tmp_path / "A.fmu", able=STATES + able)
    names = [Variable(name="on", type=Type.BOOLEAN), Variable(name="t")]
    with FmuComponent.load(path, name="a") as a:
        source = Signal("signal", names, lambda t: [float(t >= 0.25), t])
        wires = [Connection("signal", "on", "a", name) for name in ("n", "b")]
        system = System([source, a], [*wires, Connection("signal", "t", "a", "u")])
        a.enter_initialization(0.0)
        a.exit_initialization()
        found = steps(system, scheme)
    assert found["a.twice"] == [0, 2, 2, 2, 2]
    assert found["a.not_b"] == [1, 0, 0, 0, 0]
    if able and scheme in SCHEMES[1:3]:  # whose first step knows no line yet
        assert found["a.x"] == [t * t / 2 for t in (0, 0.25, 0.5, 0.75, 1)]


def test_nepce_corrects_no_whole_numbers(tmp_path, monkeypatch):
    """What the last step missed is of Reals."""
    with FmuComponent.load(make_fmu(tmp_path / "A.fmu", able=STATES), name="a") as a:
        source = Signal("signal", [Variable(name="on", type=Type.INTEGER)], lambda t: [8 * t - 3])
        system = System([source, a], [Connection("signal", "on", "a", "n")])
        a.enter_initialization(0.0)
        a.exit_initialization()
        given, do_step, n = [], a.do_step, [v.name for v in a.inputs].index("n")
        monkeypatch.setattr(a, "do_step", lambda t, h: (given.append(float(a.u[n])), do_step(t, h)))
        steps(system, nepce())
    assert given == [-3, -1, 1, 3]


@pytest.mark.parametrize(
    ("output", "input_", "words"),
    [
        ("x", "n", r"a\.x -> b\.n: Real values feed type Integer, which cannot hold them all"),
        ("x", "b", "Real values feed type Boolean"),
        (
            "twice",
            "b",
            "Integer values feed type Boolean.*; Integer outputs feed Real, Integer, En",
        ),
        ("not_b", "choice", "Boolean values feed type Enumeration"),
    ],
)
def test_what_loses_values_is_refused(fmu, output, input_, words):
    with (
        FmuComponent.load(fmu, name="a") as a,
        FmuComponent.load(fmu, name="b") as b,
        pytest.raises(CouplingError, match=words),
    ):
        System([a, b], [Connection("a", output, "b", input_)])


def test_enumerations_that_differ_are_refused(fmu, tmp_path):
    other = make_fmu(
        tmp_path / "B.fmu", types=TYPES.replace('name="mid" value="2"', 'name="mid" value="3"')
    )
    with (
        FmuComponent.load(fmu, name="a") as a,
        FmuComponent.load(other, name="b") as b,
        pytest.raises(CouplingError, match=r"item mid = 2 of the one .* low = 1, mid = 3"),
    ):
        System([a, b], [Connection("a", "chosen", "b", "choice")])


def test_a_number_that_is_too_large(fmu):
    with FmuComponent.load(fmu, name="a") as a:
        source = signal("big", Type.INTEGER, lambda t: 1e10)
        system = System([source, a], [Connection("signal", "big", "a", "n")])
        a.enter_initialization(0.0)
        a.exit_initialization()
        with pytest.raises(RuntimeError, match=r"n = 1e\+10: is of type Integer, which holds"):
            steps(system)


def test_parameters_of_all_types(fmu):
    with FmuComponent.load(fmu) as a:
        a.set_parameters({"k": 2.0, "label": "twelve signs", "x0": 4.0})
        a.enter_initialization(0.0)
        a.exit_initialization()
        told = dict(zip((v.name for v in a.outputs), a.get_outputs(), strict=True))
        assert (told["x"], told["z"], told["length"]) == (4.0, 1.0, 12)
    with FmuComponent.load(fmu) as a:
        for bad in ({"label": 3}, {"k": "much"}, {"k": float("inf")}):
            with pytest.raises(FmuError, match="does not fit"):
                a.set_parameters(bad)
        with pytest.raises(FmuError, match="x is of causality output"):
            a.set_parameters({"x": 1.0})


def component(extra="", kinds="x=output u=input"):
    ends = "".join(
        f'<ssd:Connector name="{name}" kind="{kind}"/>'
        for name, kind in (pair.split("=") for pair in kinds.split())
    )
    return (
        '<ssd:Component name="a" type="application/x-fmu-sharedlibrary" source="resources/A.fmu">'
        f"<ssd:Connectors>{ends}</ssd:Connectors>{extra}</ssd:Component>"
    )


def package(tmp_path, fmu, entries, after=""):
    system = f"<ssd:Elements>{component(values(entries))}</ssd:Elements>"
    return pack(tmp_path / "s.ssp", ssd(system, after), A__fmu=fmu)


def one(name, kind, value):
    return f'<ssv:Parameter name="{name}"><ssv:{kind} value="{value}"/></ssv:Parameter>'


def test_values_of_all_types_in_an_ssp(tmp_path, fmu):
    """Text, an item by its name, an input that is Boolean, the start value of a local."""
    entries = [
        one("label", "String", "four"), one("choice", "Enumeration", "top"),
        one("b", "Boolean", "true"), one("x0", "Real", "4"), one("n", "Integer", "5"),
    ]  # fmt: skip
    path = package(tmp_path, fmu, "".join(entries))
    dataset, stopped = run_ssp(
        path, lambda usual: jacobi(degree=0), lambda t, end: None, step=0.25, time=0.5
    )
    assert stopped is None
    assert dataset["x"].values.tolist() == [4.0, 4.125, 4.25]
    ends = {name: dataset[name].values[-1] for name in ("length", "chosen", "not_b", "twice")}
    assert ends == {"length": 4, "chosen": 7, "not_b": 0, "twice": 10}
    assert dataset.attrs["start a.label"] == "four"
    assert dataset["twice"].dtype == np.int32
    assert dataset["chosen"].attrs["flag_meanings"] == "low mid top"
    assert dataset["chosen"].attrs["flag_values"].tolist() == [1, 2, 7]
    dataset.to_netcdf(tmp_path / "r.nc", engine="h5netcdf")
    with xr.open_dataset(tmp_path / "r.nc", engine="h5netcdf", decode_times=False) as again:
        assert again["chosen"].values.tolist() == [7, 7, 7]


@pytest.mark.parametrize(
    ("entry", "words"),
    [
        (one("choice", "Enumeration", "up"), r"a\.choice: has no item 'up'; it has low, mid, top"),
        (one("n", "Real", "2.5"), r"a\.n: 2\.5 is no Integer"),
        (one("n", "Integer", str(2**32 + 5)), r"a\.n: 4294967301 is no Integer"),
        (one("b", "Integer", "2"), r"a\.b: 2 is no Boolean"),
        (one("choice", "Integer", "3"), r"a\.choice: 3 is no Enumeration; it has low = 1, mid"),
        (one("u", "Real", "INF"), r"a\.u: inf is no Real"),
        (one("n", "String", "5"), r"a\.n: '5' is no Integer"),
        (one("x", "Real", "1"), r"a\.x cannot be set: only parameters, inputs .* causality output"),
        (one("k", "String", "1"), "k is a Real; '1' does not fit"),
        (one("k", "Binary", "00"), r"a\.k: 00 is Binary, which only Binary takes as it is"),
    ],
)
def test_values_that_cannot_be_set_are_refused(tmp_path, fmu, entry, words):
    with pytest.raises(FmuError, match=words), open_ssp(package(tmp_path, fmu, entry)):
        pass


def test_what_is_written_is_read(tmp_path, fmu):
    """A system with connections and values of all types, there and back."""
    wires = [
        Connection("a", y, "b", u)
        for y, u in [("twice", "n"), ("chosen", "choice"), ("not_b", "b")]
    ]
    starts = {"label": "four", "choice": "top", "b": True, "x0": 4.0, "n": 5}
    with FmuComponent.load(fmu) as known:
        parts = [
            Part(name="a", description=known.description, starts=starts),
            Part(name="b", description=known.description),
        ]
        path = write_ssp(tmp_path / "w.ssp", parts, wires)
    with open_ssp(path) as loaded:
        assert set(loaded.connections) == set(wires)
        assert loaded.starts["a"] == starts


def test_no_text_for_a_real(tmp_path, fmu):
    with FmuComponent.load(fmu) as known:
        part = Part(name="a", description=known.description, starts={"k": "1"})
    with pytest.raises(CouplingError, match=r"a\.k is a Real; '1' is none"):
        write_ssp(tmp_path / "w.ssp", [part], [])


@pytest.mark.parametrize("scheme", [picard(degree=0), aitken(degree=0), iqn_ils(degree=0)], ids=str)
def test_guesses_are_values_there_are(tmp_path, monkeypatch, scheme):
    """An enumeration in a loop goes 1, 1, 7: neither the first guess nor a later one is between."""
    path = make_fmu(tmp_path / "A.fmu", able=STATES)
    with FmuComponent.load(path, name="a") as a, FmuComponent.load(path, name="b") as b:
        source = signal("gear", Type.INTEGER, lambda t: 7 if t >= 0.5 else 1)
        wires = [("a", "chosen", "b", "choice"), ("b", "x", "a", "u"), ("a", "x", "b", "u")]
        wires += [("b", "twice", "a", "n"), ("signal", "gear", "b", "n")]
        system = System([source, a, b], [Connection(*wire) for wire in wires])
        for one in (a, b):
            one.enter_initialization(0.0)
            one.exit_initialization()
        stepper = scheme.start(system)
        jumping = {system.names[i] for i in stepper._guessed[stepper._jumping]}
        given, written = [], a.write_inputs
        n = [v.name for v in a.inputs].index("n")
        monkeypatch.setattr(a, "write_inputs", lambda: (given.append(a.u[n]), written()))
        found = steps(system, scheme)
    assert jumping == {"b.twice"}
    assert set(given) <= {2.0, 14.0, 6.0}
    assert found["a.twice"][1:] == [4, 28, 28, 28]


def test_recorded_until_it_is_not_finite(tmp_path):
    path = make_fmu(tmp_path / "A.fmu", "nan")
    with FmuComponent.load(path, name="a") as a:
        a.enter_initialization(0.0)
        a.exit_initialization()
        system = System([a], [])
        recorder = Recorder(system)
        stopped = record(cosimulate(system, jacobi(degree=0), 0.25, 1.0), recorder)
    assert "diverged at t = 0.5 s: a.x = nan" in str(stopped)
    assert recorder.to_dataset()["x"].values.tolist() == [0.0, 0.125]
