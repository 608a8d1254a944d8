"""FMUs from plant.c, and SSP files written by hand around them."""

from __future__ import annotations

import subprocess
import tempfile
import zipfile
from functools import cache
from pathlib import Path

import fmpy
import numpy as np

from railcosim.master.cosimulation import cosimulate
from railcosim.master.schemes.jacobi import jacobi
from railcosim.master.ssp import initialise
from railcosim.master.system import System

from ..c_compiler import c_compiler

NAMESPACES = (
    'xmlns:ssc="http://ssp-standard.org/SSP1/SystemStructureCommon" '
    'xmlns:ssd="http://ssp-standard.org/SSP1/SystemStructureDescription" '
    'xmlns:ssv="http://ssp-standard.org/SSP1/SystemStructureParameterValues" '
    'xmlns:ssm="http://ssp-standard.org/SSP1/SystemStructureParameterMapping"'
)
UNITS = """<Unit name="m"><BaseUnit m="1"/></Unit>
    <Unit name="mm"><BaseUnit m="1" factor="0.001"/></Unit>
    <Unit name="N"><BaseUnit kg="1" m="1" s="-2"/></Unit>
    <Unit name="m/s"><BaseUnit m="1" s="-1"/></Unit>
    <Unit name="m/ms"><BaseUnit m="1" s="-1" factor="1000"/></Unit>
    <Unit name="K"><BaseUnit K="1"/></Unit>
    <Unit name="degC"><BaseUnit K="1" offset="273.15"/></Unit>"""


@cache
def library() -> bytes:
    """The compiled plant.c."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "plant.so"
        source = Path(__file__).with_name("plant.c")
        subprocess.run([*c_compiler(), "-shared", "-fPIC", "-o", out, source], check=True)
        return out.read_bytes()


def description(
    *, u: str = "", x: str = "", z: str = "", x0: str = "", units: str = UNITS, stated: bool = True
) -> str:
    """Its model description, with these units; perhaps not stating what outputs depend on."""
    of_x, of_z = ('dependencies=""', 'dependencies="1"') if stated else ("", "")

    def real(name: str, reference: int, causality: str, unit: str, start: str = "") -> str:
        more = {"parameter": ' variability="fixed"'}.get(causality, "")
        unit = f' unit="{unit}"' if unit else ""
        start = f' start="{start}"' if start else ""
        return (
            f'<ScalarVariable name="{name}" valueReference="{reference}" causality="{causality}"'
            f"{more}><Real{unit}{start}/></ScalarVariable>"
        )

    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Plant" guid="plant">
  <CoSimulation modelIdentifier="plant"/>
  <UnitDefinitions>{units}</UnitDefinitions>
  <ModelVariables>
    {real("u", 0, "input", u, "0.5")}
    {real("x", 1, "output", x)}
    {real("z", 2, "output", z)}
    {real("k", 3, "parameter", "", "1")}
    {real("x0", 4, "parameter", x0, "0")}
    {real("w", 5, "local", "")}
    <ScalarVariable name="n" valueReference="10" causality="parameter" variability="fixed">
      <Integer start="3"/></ScalarVariable>
    <ScalarVariable name="count" valueReference="11" causality="output" variability="discrete">
      <Integer/></ScalarVariable>
    <ScalarVariable name="mode" valueReference="12" causality="input" variability="discrete">
      <Integer start="0"/></ScalarVariable>
    <ScalarVariable name="follow" valueReference="13" causality="parameter" variability="fixed">
      <Boolean start="false"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs>
      <Unknown index="2" {of_x}/>
      <Unknown index="3" {of_z}/>
      <Unknown index="8" dependencies=""/>
    </Outputs>
    <InitialUnknowns>
      <Unknown index="2"/>
      <Unknown index="3"/>
      <Unknown index="8"/>
    </InitialUnknowns>
  </ModelStructure>
</fmiModelDescription>"""


def make_fmu(path: Path, **about: str | bool) -> Path:
    """Write an FMU; what it says of itself as in `description`."""
    binary = f"binaries/{fmpy.platform}/plant{fmpy.sharedLibraryExtension}"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("modelDescription.xml", description(**about))
        archive.writestr(binary, library())
    return path


def ssd(system: str, after: str = "", version: str = "1.0") -> str:
    """A system structure around what is in its system and behind it."""
    return (
        f'<?xml version="1.0"?><ssd:SystemStructureDescription {NAMESPACES} name="by hand" '
        f'version="{version}"><ssd:System name="root">{system}</ssd:System>{after}'
        "</ssd:SystemStructureDescription>"
    )


def component(name: str, source: str = "resources/P.fmu", more: str = "", **connectors: str) -> str:
    """A component with connectors ``name=kind`` or ``name="kind unit"``."""
    ends = ""
    for connector, text in connectors.items():
        kind, _, unit = text.partition(" ")
        unit = f' unit="{unit}"' if unit else ""
        ends += f'<ssd:Connector name="{connector}" kind="{kind}"><ssc:Real{unit}/></ssd:Connector>'
    return (
        f'<ssd:Component name="{name}" source="{source}"><ssd:Connectors>{ends}</ssd:Connectors>'
        f"{more}</ssd:Component>"
    )


def connection(start: str, end: str, inside: str = "", more: str = "") -> str:
    """A connection from ``element.connector``, or a connector of the system, to another."""
    ends = ""
    for side, text in (("start", start), ("end", end)):
        element, _, connector = text.rpartition(".")
        if element:
            ends += f' {side}Element="{element}"'
        ends += f' {side}Connector="{connector}"'
    return f"<ssd:Connection{ends} {more}>{inside}</ssd:Connection>"


def values(text: str, attributes: str = "", mapping: str = "") -> str:
    """Bindings with an inline parameter set of these entries."""
    return (
        f"<ssd:ParameterBindings><ssd:ParameterBinding {attributes}><ssd:ParameterValues>"
        f'<ssv:ParameterSet version="1.0" name="s"><ssv:Parameters>{text}</ssv:Parameters>'
        f"</ssv:ParameterSet></ssd:ParameterValues>{mapping}</ssd:ParameterBinding>"
        "</ssd:ParameterBindings>"
    )


def real(name: str, value: float, unit: str = "") -> str:
    """An entry of a parameter set."""
    unit = f' unit="{unit}"' if unit else ""
    return f'<ssv:Parameter name="{name}"><ssv:Real value="{value!r}"{unit}/></ssv:Parameter>'


def pack(path: Path, text: str, **files: bytes | Path | str) -> Path:
    """An SSP file with these files in its resources; ``P__fmu`` is called P.fmu."""
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("SystemStructure.ssd", text)
        for name, content in files.items():
            data = content.read_bytes() if isinstance(content, Path) else content
            archive.writestr(f"resources/{name.replace('__', '.')}", data)
    return path


STEP, STEPS = 0.125, 8  # binary numbers, so that times add up without rounding


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
