"""Systems of two masses from mass.c, in SSP files, for the two-mass oscillator."""

from __future__ import annotations

import subprocess
import zipfile
from pathlib import Path

import fmpy
import numpy as np
from scipy.linalg import expm

from ..c_compiler import c_compiler
from .oscillator import C_C, K_C, C, K
from .plant import connection, pack, real, ssd, values

SOURCE = Path(__file__).with_suffix(".c")
ENDS = {"alone": (("f",), ("z", "vz")), "owner": (("z", "vz"), ("f", "own_z"))}
EXCHANGE = """  <ModelExchange modelIdentifier="mass"/>\n"""


def description(guid, *, exchange=True, back=True):
    ins, outs = ENDS[guid]
    names = [*ins, *outs, "x", "v", "dx", "dv", "k", "c"]
    lines = [
        *((n, k, 'causality="input"', 'start="0"') for k, n in enumerate(ins)),
        *((n, 2 + k, 'causality="output"', "") for k, n in enumerate(outs)),
        ("x", 4, 'causality="local" initial="exact"', 'start="0"'), ("v", 5, "", ""),
        ("dx", 6, "", f'derivative="{names.index("x") + 1}"'),
        ("dv", 7, "", f'derivative="{names.index("v") + 1}"'),
        ("k", 8, 'causality="parameter" variability="fixed"', 'start="20"'),
        ("c", 9, 'causality="parameter" variability="fixed"', 'start="0.3"'),
    ]  # fmt: skip
    variables = "".join(
        f'<ScalarVariable name="{n}" valueReference="{r}" {a}><Real {of}/></ScalarVariable>'
        for n, r, a, of in lines
    )
    at = {n: k for k, n in enumerate(names, start=1)}
    inside = f"{at['x']} {at['v']}"
    given = " ".join(str(at[n]) for n in ins)
    direct = given if guid == "owner" else ""
    outputs = f'<Unknown index="{at[outs[0]]}" dependencies="{direct} {inside}"/>' + (
        f'<Unknown index="{at[outs[1]]}" dependencies="{inside}"/>'
    )
    rates = f'<Unknown index="{at["dx"]}" dependencies="{at["v"]}"/>' + (
        f'<Unknown index="{at["dv"]}" dependencies="{given} {inside}"/>'
    )
    return f"""<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Mass" guid="{guid}">
{EXCHANGE if exchange else ""}  <CoSimulation modelIdentifier="mass"
    canGetAndSetFMUstate="{str(back).lower()}" canHandleVariableCommunicationStepSize="true"/>
  <ModelVariables>{variables}</ModelVariables>
  <ModelStructure><Outputs>{outputs}</Outputs>
    {f"<Derivatives>{rates}</Derivatives>" if exchange else ""}
    <InitialUnknowns>{outputs}</InitialUnknowns></ModelStructure>
</fmiModelDescription>"""


def compiled(folder, *options):
    """The library of all of them."""
    out = folder / f"mass{fmpy.sharedLibraryExtension}"
    subprocess.run(
        [*c_compiler(), "-O2", "-shared", "-fPIC", *options, "-o", out, SOURCE], check=True
    )
    return out


def fmu(library, path, guid, **able):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", description(guid, **able))
        archive.write(library, f"binaries/{fmpy.platform}/{library.name}")
    return path


def part(name, guid, **starts):
    """A component that starts as said, such as displaced by `x`, m."""
    ins, outs = ENDS[guid]
    ends = "".join(
        f'<ssd:Connector name="{n}" kind="{kind}"><ssc:Real/></ssd:Connector>'
        for kind, known in (("input", ins), ("output", outs)) for n in known
    )  # fmt: skip
    given = "".join(real(n, x) for n, x in starts.items())
    return (
        f'<ssd:Component name="{name}" source="resources/{guid}.fmu">'
        f"<ssd:Connectors>{ends}</ssd:Connectors>{values(given)}</ssd:Component>"
    )


def system(library, folder, kinds, wires, *, right=None, **able):
    """An SSP of two masses, ``left``, which is displaced by 1 m, and ``right`` (its starts)."""
    parts = part("left", kinds[0], x=1.0) + part("right", kinds[1], **(right or {"x": 0.0}))
    links = "".join(connection(a, b) for a, b in wires)
    links = f"<ssd:Connections>{links}</ssd:Connections>" if links else ""
    files = {
        f"{kind}__fmu": fmu(library, folder / f"{kind}.fmu", kind, **able) for kind in set(kinds)
    }
    return pack(folder / "S.ssp", ssd(f"<ssd:Elements>{parts}</ssd:Elements>{links}"), **files)


WIRES = [("left.z", "right.z"), ("left.vz", "right.vz"), ("right.f", "left.f")]
LAW = f"""
[[contact]]
stiffness = {K_C}
damping = {C_C}
motion = {{ "left.z" = 1, "right.z" = -1 }}
rate = {{ "left.vz" = 1, "right.vz" = -1 }}
force = {{ "left.f" = -1, "right.f" = 1 }}
"""


def made(library, folder, owner, *, exchange=True, back=True):
    """SSP and law, where the right mass owns the spring or the master does."""
    able = {"exchange": exchange, "back": back}
    if owner == "right":
        return system(library, folder, ("alone", "owner"), WIRES, **able), None
    (folder / "law.toml").write_text(LAW)
    path = system(library, folder, ("alone", "alone"), [], **able)
    return path, folder / "law.toml"


TOGETHER = np.array(
    [[0, 1, 0, 0], [-K - K_C, -C - C_C, K_C, C_C], [0, 0, 0, 1], [K_C, C_C, -K - K_C, -C - C_C]]
)
"""x' = A x of the uncut oscillator: place and speed of the left mass, and of the right one."""


def exact(times):
    """Its motion from where `system` starts, shape (n_times, 4)."""
    return np.array([expm(TOGETHER * t) @ [1.0, 0.0, 0.0, 0.0] for t in times])
