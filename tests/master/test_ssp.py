"""SSP files, by hand and our own: what is read, what comes out, and there and back."""

from __future__ import annotations

import numpy as np
import pytest

from railcosim.master.connections import Connection, CouplingError
from railcosim.master.cosimulation import cosimulate
from railcosim.master.fmu import FmuComponent
from railcosim.master.schemes.gauss_seidel import gauss_seidel
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.ssp import Part, initialise, open_ssp, write_ssp
from railcosim.master.system import System
from railcosim.master.units import Linear

from .plant import component, connection, make_fmu, pack, real, ssd, values

STEP, STEPS = 0.125, 8  # binary numbers, so that times add up without rounding
MILLIMETRES = Linear(1e3)


@pytest.fixture(scope="module")
def plant(tmp_path_factory):
    return make_fmu(tmp_path_factory.mktemp("plant") / "P.fmu")


@pytest.fixture
def package(tmp_path, plant):
    """Makes an SSP of a system's content, with P.fmu and more in its resources."""

    def make(system, after="", **files):
        return pack(tmp_path / "by hand.ssp", ssd(system, after), **({"P__fmu": plant} | files))

    return make


def run(loaded, scheme=None, start=0.0):
    """Outputs by name at every communication point."""
    system = System(loaded.components, loaded.connections)
    assert initialise(system, loaded.fmus, start)
    scheme = jacobi(degree=0) if scheme is None else scheme
    points = list(cosimulate(system, scheme, STEP, start + STEPS * STEP, start))
    return dict(zip(system.names, np.array([p.outputs for p in points]).T, strict=True))


LOOP = "<ssd:Elements>{a}{b}</ssd:Elements><ssd:Connections>{forward}{back}</ssd:Connections>"


def loop(a="", b="", inside="", more=""):
    """a integrates what b makes of it: x' = k (factor x + offset)."""
    return LOOP.format(
        a=component("a", more=a, u="input", x="output"),
        b=component("b", more=b, u="input", z="output"),
        forward=connection("a.x", "b.u", inside, more),
        back=connection("b.z", "a.u"),
    )


def growth(x0, rate, offset=0.0):
    """x' = rate (x + offset) by Euler's rule, which inputs held constant make of it."""
    n = np.arange(STEPS + 1)
    return (x0 + offset) * (1 + STEP * rate) ** n - offset


# Some ten operations, each rounded to 1e-16 of a number of the result's size.
ROUNDING = 1e-14


def test_two_fmus(package):
    path = package(loop(a=values(real("x0", 2.0)), b=values(real("k", -0.5))))
    with open_ssp(path) as loaded:
        assert [fmu.name for fmu in loaded.fmus] == ["a", "b"]
        assert loaded.notes == ()
        assert (loaded.start, loaded.stop, loaded.step) == (None, None, None)
        found = run(loaded)
    np.testing.assert_allclose(found["a.x"], growth(2.0, -0.5), rtol=ROUNDING)
    np.testing.assert_allclose(found["b.z"], -0.5 * growth(2.0, -0.5), rtol=ROUNDING)


def test_gauss_seidel(package):
    """The integrator first: the same equations as Jacobi. The gain first changes nothing."""
    path = package(loop(a=values(real("x0", 2.0)), b=values(real("k", -0.5))))
    for first in ("a", "b"):
        with open_ssp(path) as loaded:
            found = run(loaded, gauss_seidel(first=first, degree=0))
        np.testing.assert_allclose(found["a.x"], growth(2.0, -0.5), rtol=ROUNDING)


def test_connections_either_way_round(package):
    """Start and end do not say where values come from; the kinds of the connectors do."""
    system = LOOP.format(
        a=component("a", more=values(real("x0", 2.0)), u="input", x="output"),
        b=component("b", more=values(real("k", -0.5)), u="input", z="output"),
        forward=connection("b.u", "a.x"),
        back=connection("a.u", "b.z"),
    )
    with open_ssp(package(system)) as loaded:
        assert set(loaded.connections) == {
            Connection("a", "x", "b", "u"),
            Connection("b", "z", "a", "u"),
        }


def test_linear_transformation(package):
    inside = '<ssc:LinearTransformation factor="-0.25" offset="0.75"/>'
    path = package(loop(a=values(real("x0", 2.0)), inside=inside))
    with open_ssp(path) as loaded:
        assert loaded.maps == {Connection("a", "x", "b", "u"): Linear(-0.25, 0.75)}
        found = run(loaded)
    # x' = 0.75 - 0.25 x = -0.25 (x - 3)
    np.testing.assert_allclose(found["a.x"], growth(2.0, -0.25, offset=-3.0), rtol=ROUNDING)


def test_linear_inputs_through_a_transformation(package):
    """A linear input stays linear: the second component sees the line that the first one left."""
    inside = '<ssc:LinearTransformation factor="2" offset="1"/>'
    chain = (
        f"<ssd:Elements>{component('a', u='input', x='output')}"
        f"{component('b', u='input', x='output')}</ssd:Elements>"
        f"<ssd:Connections>{connection('a.x', 'b.u', inside)}</ssd:Connections>"
    )
    with open_ssp(package(chain)) as loaded:
        held = run(loaded)
    # a.x = t / 2 (u starts at 0.5); b.x sums h (2 t/2 + 1) over the steps before.
    t = STEP * np.arange(STEPS + 1)
    n = np.arange(STEPS + 1)
    np.testing.assert_allclose(held["a.x"], t / 2, rtol=ROUNDING)
    np.testing.assert_allclose(held["b.x"], STEP * (n + STEP * n * (n - 1) / 2), rtol=ROUNDING)


@pytest.fixture
def two_units(tmp_path):
    """An FMU whose x is in m, and one whose u is in mm."""
    return {
        "M__fmu": make_fmu(tmp_path / "M.fmu", x="m", x0="m"),
        "MM__fmu": make_fmu(tmp_path / "MM.fmu", u="mm"),
    }


def unit_loop(more="", inside="", a="", u="input", x="output"):
    return LOOP.format(
        a=component("a", "resources/M.fmu", a, u="input", x=x),
        b=component("b", "resources/MM.fmu", values(real("k", -0.5e-3)), u=u, z="output"),
        forward=connection("a.x", "b.u", inside, more),
        back=connection("b.z", "a.u"),
    )


def test_units_are_converted(package, two_units):
    path = package(unit_loop(a=values(real("x0", 2000.0, "mm"))), **two_units)
    # The unit of the value is defined by nobody in this file:
    with (
        pytest.raises(ValueError, match=r"a\.x0: mm is not m, and mm is not defined"),
        open_ssp(path),
    ):
        pass
    units = (
        '<ssd:Units><ssc:Unit name="mm"><ssc:BaseUnit m="1" factor="1e-3"/></ssc:Unit></ssd:Units>'
    )
    path = package(unit_loop(a=values(real("x0", 2000.0, "mm"))), units, **two_units)
    with open_ssp(path) as loaded:
        assert loaded.maps == {Connection("a", "x", "b", "u"): MILLIMETRES}
        assert loaded.starts["a"] == {"x0": 2.0}
        found = run(loaded)
    np.testing.assert_allclose(found["a.x"], growth(2.0, -0.5), rtol=ROUNDING)


def test_conversion_comes_before_the_transformation(package, two_units):
    inside = '<ssc:LinearTransformation factor="2" offset="1"/>'
    c = Connection("a", "x", "b", "u")
    with open_ssp(package(unit_loop(inside=inside), **two_units)) as loaded:
        assert loaded.maps == {c: Linear(2e3, 1.0)}
    suppressed = 'suppressUnitConversion="true"'
    with open_ssp(package(unit_loop(suppressed, inside), **two_units)) as loaded:
        assert loaded.maps == {c: Linear(2.0, 1.0)}
        run(loaded)  # m may feed mm then
    with open_ssp(package(unit_loop(suppressed), **two_units)) as loaded:
        assert loaded.maps == {}
        run(loaded)


def test_units_that_do_not_fit(package, tmp_path):
    files = {
        "M__fmu": make_fmu(tmp_path / "M.fmu", x="m"),
        "MM__fmu": make_fmu(tmp_path / "K.fmu", u="K"),
    }
    with (
        pytest.raises(ValueError, match="m and K are of different dimensions"),
        open_ssp(package(unit_loop(), **files)),
    ):
        pass


def test_offsets_of_units(package, tmp_path):
    files = {
        "M__fmu": make_fmu(tmp_path / "M.fmu", x="degC"),
        "MM__fmu": make_fmu(tmp_path / "K.fmu", u="K"),
    }
    with open_ssp(package(unit_loop(), **files)) as loaded:
        assert loaded.maps == {Connection("a", "x", "b", "u"): Linear(1.0, 273.15)}


NESTED = """
<ssd:Connectors>
  <ssd:Connector name="gain" kind="parameter"><ssc:Real/></ssd:Connector>
  <ssd:Connector name="push" kind="input"><ssc:Real/></ssd:Connector>
  <ssd:Connector name="seen" kind="output"><ssc:Real/></ssd:Connector>
</ssd:Connectors>
{bindings}
<ssd:Elements>
  {a}
  <ssd:System name="inner">
    <ssd:Connectors>
      <ssd:Connector name="in" kind="input"><ssc:Real/></ssd:Connector>
      <ssd:Connector name="out" kind="output"><ssc:Real/></ssd:Connector>
      <ssd:Connector name="gain" kind="parameter"><ssc:Real/></ssd:Connector>
    </ssd:Connectors>
    <ssd:Elements>{b}</ssd:Elements>
    <ssd:Connections>
      <ssd:Connection startConnector="in" endElement="b" endConnector="u">
        <ssc:LinearTransformation factor="3"/></ssd:Connection>
      <ssd:Connection startElement="b" startConnector="z" endConnector="out"/>
      <ssd:Connection startConnector="gain" endElement="b" endConnector="k"/>
    </ssd:Connections>
  </ssd:System>
  {c}
</ssd:Elements>
<ssd:Connections>
  <ssd:Connection startElement="a" startConnector="x" endElement="inner" endConnector="in">
    <ssc:LinearTransformation offset="1"/></ssd:Connection>
  <ssd:Connection startElement="inner" startConnector="out" endElement="a" endConnector="u"/>
  <ssd:Connection startConnector="gain" endElement="inner" endConnector="gain"/>
  <ssd:Connection startConnector="push" endElement="c" endConnector="u"/>
  <ssd:Connection startElement="c" startConnector="x" endConnector="seen"/>
</ssd:Connections>
"""


def nested(bindings=""):
    return NESTED.format(
        bindings=bindings,
        a=component("a", u="input", x="output"),
        b=component("b", more=values(real("k", 9.0)), u="input", z="output", k="parameter"),
        c=component("c", u="input", x="output"),
    )


def test_nested_systems(package):
    """Connectors of systems pass on values and start values; outer values are the stronger."""
    entries = real("gain", -0.125) + real("a.x0", 2.0) + real("push", 4.0) + real("c.x0", 1.0)
    with open_ssp(package(nested(values(entries)))) as loaded:
        assert [fmu.name for fmu in loaded.fmus] == ["a", "inner.b", "c"]
        assert loaded.maps == {Connection("a", "x", "inner.b", "u"): Linear(3.0, 3.0)}
        assert loaded.starts == {
            "a": {"x0": 2.0},
            "inner.b": {"k": -0.125},
            "c": {"u": 4.0, "x0": 1.0},
        }
        found = run(loaded)
    # x' = -1/8 (3 x + 3)
    np.testing.assert_allclose(found["a.x"], growth(2.0, -0.375, 1.0), rtol=ROUNDING)
    t = STEP * np.arange(STEPS + 1)
    np.testing.assert_allclose(found["c.x"], 1.0 + 4.0 * t, rtol=ROUNDING)


def test_inner_values_without_outer_ones(package):
    with open_ssp(package(nested())) as loaded:
        assert loaded.starts == {"a": {}, "inner.b": {"k": 9.0}, "c": {}}


def test_parameter_files_prefixes_and_mappings(package):
    ssv = (
        '<ssv:ParameterSet xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" '
        'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" version="1.0" name="p">'
        f"<ssv:Parameters>{real('x0', 2.0)}{real('gone', 1.0)}"
        '<ssv:Parameter name="n"><ssv:Integer value="7"/></ssv:Parameter>'
        '<ssv:Parameter name="follow"><ssv:Boolean value="true"/></ssv:Parameter>'
        '<ssv:Parameter name="colour"><ssv:String value="red"/></ssv:Parameter>'
        "</ssv:Parameters></ssv:ParameterSet>"
    )
    ssm = (
        '<ssm:ParameterMapping xmlns:ssm="http://ssp-standard.org/SSP1/'
        'SystemStructureParameterMapping" xmlns:ssc="http://ssp-standard.org/SSP1/'
        'SystemStructureCommon" version="1.0"><ssm:MappingEntry source="double" target="b.k">'
        '<ssc:LinearTransformation factor="0.5" offset="1"/></ssm:MappingEntry>'
        "</ssm:ParameterMapping>"
    )
    bindings = (
        '<ssd:ParameterBindings><ssd:ParameterBinding prefix="a." source="resources/my%20set.ssv"/>'
        '<ssd:ParameterBinding><ssd:ParameterValues><ssv:ParameterSet version="1.0" name="q">'
        f"<ssv:Parameters>{real('double', 6.0)}{real('a.x0', 1.0)}</ssv:Parameters>"
        "</ssv:ParameterSet></ssd:ParameterValues>"
        '<ssd:ParameterMapping source="resources/m.ssm"/></ssd:ParameterBinding>'
        "</ssd:ParameterBindings>"
    )
    path = package(bindings + loop(), **{"my set__ssv": ssv, "m__ssm": ssm})
    with open_ssp(path) as loaded:
        # The mapping names only `double`, so `a.x0` of that set is not used.
        assert loaded.starts == {"a": {"x0": 2.0, "n": 7, "follow": True}, "b": {"k": 4.0}}
        assert loaded.starts["a"]["follow"] is True
        assert sorted(loaded.notes) == [
            "a.colour is not set: String values are not supported",
            "a.gone is not set: its FMU has no such variable",
        ]


def test_later_bindings_are_the_stronger(package):
    both = values(real("x0", 1.0) + real("k", 5.0)).replace("</ssd:ParameterBindings>", "") + (
        values(real("x0", 2.0)).replace("<ssd:ParameterBindings>", "")
    )
    with open_ssp(package(loop(a=both))) as loaded:
        assert loaded.starts["a"] == {"x0": 2.0, "k": 5.0}


OMSIMULATOR = """<?xml version="1.0" encoding="UTF-8"?>
<ssd:SystemStructureDescription xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon"
  xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription"
  xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues"
  xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping"
  xmlns:ssb="http://ssp-standard.org/SSP1/SystemStructureSignalDictionary"
  xmlns:oms="https://raw.githubusercontent.com/OpenModelica/OMSimulator/master/schema/oms.xsd"
  name="model" version="1.0">
  <ssd:System name="root">
    <ssd:Connectors>
      <ssd:Connector name="Input1" kind="input"><ssc:Real/>
        <ssd:ConnectorGeometry x="0.000000" y="0.500000"/></ssd:Connector>
    </ssd:Connectors>
    <ssd:ParameterBindings>
      <ssd:ParameterBinding source="resources/root.ssv"/>
    </ssd:ParameterBindings>
    <ssd:Elements>
      <ssd:System name="system1">
        <ssd:Elements>
          <ssd:Component name="Integrator" type="application/x-fmu-sharedlibrary"
            source="resources/P.fmu">
            <ssd:Connectors>
              <ssd:Connector name="u" kind="input"><ssc:Real/>
                <ssd:ConnectorGeometry x="0.000000" y="0.500000"/></ssd:Connector>
              <ssd:Connector name="mode" kind="input"><ssc:Integer/></ssd:Connector>
              <ssd:Connector name="x" kind="output"><ssc:Real/></ssd:Connector>
              <ssd:Connector name="x0" kind="parameter"><ssc:Real/></ssd:Connector>
            </ssd:Connectors>
            <ssd:ElementGeometry x1="-10" y1="-10" x2="10" y2="10" rotation="0.0"/>
          </ssd:Component>
          <ssd:Component name="Counter" type="application/x-fmu-sharedlibrary"
            source="resources/P.fmu">
            <ssd:Connectors>
              <ssd:Connector name="count" kind="output"><ssc:Integer/></ssd:Connector>
            </ssd:Connectors>
          </ssd:Component>
        </ssd:Elements>
        <ssd:Connectors>
          <ssd:Connector name="C1" kind="input"><ssc:Real/></ssd:Connector>
        </ssd:Connectors>
        <ssd:Connections>
          <ssd:Connection startElement="" startConnector="C1" endElement="Integrator"
            endConnector="u"/>
          <ssd:Connection startElement="Counter" startConnector="count" endElement="Integrator"
            endConnector="mode">
            <ssd:ConnectionGeometry pointsX="1.0 2.0" pointsY="0.0 0.0"/></ssd:Connection>
        </ssd:Connections>
        <ssd:Annotations>
          <ssc:Annotation type="org.openmodelica">
            <oms:Annotations><oms:SimulationInformation>
              <oms:FixedStepMaster description="oms-ma" stepSize="0.125000"
                absoluteTolerance="0.000100" relativeTolerance="0.000100"/>
            </oms:SimulationInformation></oms:Annotations>
          </ssc:Annotation>
        </ssd:Annotations>
      </ssd:System>
    </ssd:Elements>
    <ssd:Connections>
      <ssd:Connection startElement="" startConnector="Input1" endElement="system1"
        endConnector="C1"/>
    </ssd:Connections>
    <ssd:SystemGeometry x1="0" y1="0" x2="1" y2="1"/>
  </ssd:System>
  <ssd:Enumerations><ssc:Enumeration name="Mode"><ssc:Item name="off" value="0"/>
    </ssc:Enumeration></ssd:Enumerations>
  <ssd:DefaultExperiment startTime="1.000000" stopTime="2.000000">
    <ssd:Annotations>
      <ssc:Annotation type="org.openmodelica">
        <oms:Annotations><oms:SimulationInformation resultFile="model_res.mat"
          loggingInterval="0.000000" bufferSize="10" signalFilter="resources/signalFilter.xml"/>
        </oms:Annotations>
      </ssc:Annotation>
    </ssd:Annotations>
  </ssd:DefaultExperiment>
</ssd:SystemStructureDescription>
"""


def test_in_the_style_of_omsimulator(tmp_path, plant):
    """Its namespaces, annotations, geometry, order of elements and empty element names."""
    ssv = (
        '<?xml version="1.0"?><ssv:ParameterSet '
        'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" '
        'xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" version="1.0" '
        'name="parameters"><ssv:Parameters>'
        '<ssv:Parameter name="Input1"><ssv:Real value="10"/></ssv:Parameter>'
        '<ssv:Parameter name="system1.Integrator.x0"><ssv:Real value="27" unit="1"/>'
        "</ssv:Parameter></ssv:Parameters><ssv:Units>"
        '<ssc:Unit name="1"><ssc:BaseUnit/></ssc:Unit></ssv:Units></ssv:ParameterSet>'
    )
    path = pack(tmp_path / "oms.ssp", OMSIMULATOR, P__fmu=plant, root__ssv=ssv)
    with open_ssp(path) as loaded:
        assert (loaded.start, loaded.stop, loaded.step) == (1.0, 2.0, 0.125)
        assert loaded.notes == (
            "system1.Counter.count -> system1.Integrator.mode is not connected: only Real values "
            "are passed on",
        )
        found = run(loaded, start=1.0)
    expected = 27.0 + 10.0 * STEP * np.arange(STEPS + 1)
    np.testing.assert_allclose(found["system1.Integrator.x"], expected, rtol=ROUNDING)


def chain_of_followers(order):
    """s.z = 0.5 k feeds p.u, p.x feeds q.u, q.x feeds r.u; p, q, r start where their inputs are."""
    follow = values('<ssv:Parameter name="follow"><ssv:Boolean value="true"/></ssv:Parameter>')
    made = {
        "s": component("s", more=values(real("k", 6.0)), z="output"),
        "p": component("p", more=follow, u="input", x="output"),
        "q": component("q", more=follow, u="input", x="output"),
        "r": component("r", more=follow, u="input", x="output"),
    }
    ends = [("s.z", "p.u"), ("p.x", "q.u"), ("q.x", "r.u")]
    connections = "".join(connection(*pair) for pair in ends)
    elements = "".join(made[name] for name in order)
    return (
        f"<ssd:Elements>{elements}</ssd:Elements><ssd:Connections>{connections}</ssd:Connections>"
    )


@pytest.mark.parametrize("order", ["spqr", "rqps"])
def test_initial_values_pass_through_all_components(package, order):
    """An output that depends on an input in initialisation only, three times in a row."""
    with open_ssp(package(chain_of_followers(order))) as loaded:
        found = run(loaded)
    assert [found[f"{name}.x"][0] for name in "pqr"] == [3.0, 3.0, 3.0]


def test_initial_values_that_never_settle(package):
    """x(0) = u and u = 2 (x + 1): each exchange doubles what it is from -2, where it would rest."""
    follow = '<ssv:Parameter name="follow"><ssv:Boolean value="true"/></ssv:Parameter>'
    inside = '<ssc:LinearTransformation offset="1"/>'
    path = package(loop(a=values(follow), b=values(real("k", 2.0)), inside=inside))
    with open_ssp(path) as loaded:
        system = System(loaded.components, loaded.connections)
        assert not initialise(system, loaded.fmus, 0.0)


def exported(loaded, path):
    parts = [
        Part(name=f.name, description=f.description, starts=loaded.starts[f.name])
        for f in loaded.fmus
    ]
    return write_ssp(path, parts, loaded.connections, loaded.maps, start=1.0, stop=2.0, step=STEP)


def test_there_and_back(package, tmp_path, two_units):
    """Nested, with units, transformations and all kinds of values: the same bits."""
    files = two_units
    inside = '<ssc:LinearTransformation factor="-0.1" offset="0.7"/>'
    entries = real("x0", 1 / 3) + (
        '<ssv:Parameter name="n"><ssv:Integer value="7"/></ssv:Parameter>'
        '<ssv:Parameter name="follow"><ssv:Boolean value="false"/></ssv:Parameter>'
    )
    system = unit_loop(inside=inside, a=values(entries))
    with open_ssp(package(system, **files)) as loaded:
        first = run(loaded)
        path = exported(loaded, tmp_path / "again.ssp")
        known = (loaded.connections, loaded.maps, loaded.starts)
    with open_ssp(path) as loaded:
        assert (loaded.connections, loaded.maps, loaded.starts) == known
        assert (loaded.start, loaded.stop, loaded.step) == (1.0, 2.0, STEP)
        assert loaded.notes == ()
        second = run(loaded)
    assert list(first) == list(second)
    for name, column in first.items():
        assert column.tobytes() == second[name].tobytes()


def test_there_and_back_flat(package, tmp_path):
    """Systems in systems come back flat, and give the same."""
    entries = real("gain", -0.1) + real("a.x0", 2.0) + real("push", 4.0)
    with open_ssp(package(nested(values(entries)))) as loaded:
        first = run(loaded)
        path = exported(loaded, tmp_path / "again.ssp")
    with open_ssp(path) as loaded:
        second = run(loaded)
    assert {k: v.tobytes() for k, v in first.items()} == {k: v.tobytes() for k, v in second.items()}


def test_files_of_one_name(package, tmp_path):
    """Both are packed; one that is used twice is packed once."""
    paths = [tmp_path / folder / "P.fmu" for folder in "ab"]
    for path, unit in zip(paths, ("m", "mm"), strict=True):
        path.parent.mkdir()
        make_fmu(path, x=unit, u="m")
    loads = [paths[0], paths[1], paths[0]]
    fmus = [FmuComponent.load(p, name=n) for p, n in zip(loads, "pqr", strict=True)]
    parts = [Part(name=f.name, description=f.description) for f in fmus]
    path = write_ssp(tmp_path / "s.ssp", parts, [])
    for fmu in fmus:
        fmu.close()
    with open_ssp(path) as loaded:
        assert [f.outputs[0].unit for f in loaded.fmus] == ["m", "mm", "m"]
        assert loaded.fmus[0].description.path == loaded.fmus[2].description.path


def test_what_cannot_be_written(package, tmp_path):
    with open_ssp(package(loop())) as loaded:
        parts = [Part(name=f.name, description=f.description) for f in loaded.fmus]
        target = tmp_path / "s.ssp"
        target.write_bytes(b"an older one")
        with pytest.raises(CouplingError, match=r"signal is no FMU of this system"):
            write_ssp(target, parts, [Connection("signal", "y", "a", "u")])
        with pytest.raises(CouplingError, match=r"b has no input 'v'"):
            write_ssp(target, parts, [Connection("a", "x", "b", "v")])
        with pytest.raises(CouplingError, match="names must differ"):
            write_ssp(target, [parts[0], parts[0]], [])
        wrong = Part(name="a", description=parts[0].description, starts={"x9": 1.0})
        with pytest.raises(CouplingError, match=r"no parameter or Real input 'x9'"):
            write_ssp(target, [wrong], [])
    # The FMUs are gone with the folder they were unpacked to.
    with pytest.raises(FileNotFoundError):
        write_ssp(target, parts, [])
    assert target.read_bytes() == b"an older one"
    assert not list(tmp_path.glob("*.part"))
