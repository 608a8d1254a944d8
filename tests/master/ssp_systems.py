"""Systems for several tests of SSP files: two FMUs of different units, and a system in a system."""

from __future__ import annotations

from .plant import LOOP, component, connection, real, values


def unit_loop(more="", inside="", a="", u="input", x="output"):
    return LOOP.format(
        a=component("a", "resources/M.fmu", a, u="input", x=x),
        b=component("b", "resources/MM.fmu", values(real("k", -0.5e-3)), u=u, z="output"),
        forward=connection("a.x", "b.u", inside, more),
        back=connection("b.z", "a.u"),
    )


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
