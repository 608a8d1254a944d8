"""SSP files with systems in systems, parameter files, and FMUs that initialise each other."""

from __future__ import annotations

import numpy as np
import pytest

from railcosim.master.connections import Connection
from railcosim.master.ssp import initialise, open_ssp
from railcosim.master.system import System
from railcosim.master.units import Linear

from .plant import (
    ROUNDING,
    STEP,
    STEPS,
    component,
    connection,
    growth,
    loop,
    pack,
    real,
    run,
    values,
)
from .ssp_systems import nested


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
            "a.colour is not set: its FMU has no such variable",
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
        assert loaded.notes == ()
        found = run(loaded, start=1.0)
    assert set(found["system1.Integrator.count"]) == {3.0 + 3.0}  # its n, and the other's count
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


def circle(package, gain):
    """x(0) = u and u = gain (x + 1): whether it settles, and x(0)."""
    follow = '<ssv:Parameter name="follow"><ssv:Boolean value="true"/></ssv:Parameter>'
    inside = '<ssc:LinearTransformation offset="1"/>'
    path = package(loop(a=values(follow), b=values(real("k", gain)), inside=inside))
    with open_ssp(path) as loaded:
        system = System(loaded.components, loaded.connections)
        settled = initialise(system, loaded.fmus, 0.0)
        return settled, dict(zip(system.names, system.outputs, strict=True))["a.x"]


def test_initial_values_in_a_circle(package):
    """Where each exchange halves the error, 100 leave none: x = (x + 1) / 2 at 1."""
    assert circle(package, 0.5) == (True, 1.0)
    settled, x = circle(package, 2.0)
    assert not settled
    assert abs(x) > 1e9
