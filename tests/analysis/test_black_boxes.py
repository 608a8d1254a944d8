"""Stability of any two FMUs: predicted from outside, held against runs of them."""

import subprocess
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest

from railcosim.analysis.schemes.black_boxes import Boxes, system_stability
from railcosim.analysis.schemes.catalogue import members
from railcosim.master.connections import CouplingError
from railcosim.master.law_file import read_law
from railcosim.master.ssp import initialise, open_ssp
from railcosim.master.system import System

from ..c_compiler import c_compiler
from ..master.oscillator import C_C, K_C, C, K
from ..master.plant import connection, pack, ssd

SOURCE = Path(__file__).parents[1] / "master" / "mass.c"
ENDS = {"alone": (("f",), ("z", "vz")), "owner": (("z", "vz"), ("f", "own_z"))}
EXCHANGE = """  <ModelExchange modelIdentifier="mass"/>\n"""


def description(guid, *, exchange):
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
{EXCHANGE if exchange else ""}  <CoSimulation modelIdentifier="mass" canGetAndSetFMUstate="true"
    canHandleVariableCommunicationStepSize="true"/>
  <ModelVariables>{variables}</ModelVariables>
  <ModelStructure><Outputs>{outputs}</Outputs>
    {f"<Derivatives>{rates}</Derivatives>" if exchange else ""}
    <InitialUnknowns>{outputs}</InitialUnknowns></ModelStructure>
</fmiModelDescription>"""


@pytest.fixture(scope="module")
def library(tmp_path_factory):
    out = tmp_path_factory.mktemp("mass") / f"mass{fmpy.sharedLibraryExtension}"
    subprocess.run([*c_compiler(), "-O2", "-shared", "-fPIC", "-o", out, SOURCE], check=True)
    return out


def fmu(library, path, guid, *, exchange=True):
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("modelDescription.xml", description(guid, exchange=exchange))
        archive.write(library, f"binaries/{fmpy.platform}/{library.name}")
    return path


def part(name, guid):
    ins, outs = ENDS[guid]
    ends = "".join(
        f'<ssd:Connector name="{n}" kind="{kind}"><ssc:Real/></ssd:Connector>'
        for kind, known in (("input", ins), ("output", outs)) for n in known
    )  # fmt: skip
    return (
        f'<ssd:Component name="{name}" source="resources/{guid}.fmu">'
        f"<ssd:Connectors>{ends}</ssd:Connectors></ssd:Component>"
    )


def system(library, folder, kinds, wires, *, exchange=True):
    """An SSP of two masses, ``left`` and ``right``."""
    parts = "".join(part(n, kind) for n, kind in zip(("left", "right"), kinds, strict=True))
    links = "".join(connection(a, b) for a, b in wires)
    links = f"<ssd:Connections>{links}</ssd:Connections>" if links else ""
    files = {
        f"{kind}__fmu": fmu(library, folder / f"{kind}.fmu", kind, exchange=exchange)
        for kind in set(kinds)
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


@pytest.fixture
def made(library, tmp_path):
    """Function: SSP and law, where one of the masses owns the spring or the master does."""

    def make(owner, *, exchange=True):
        if owner == "right":
            return system(library, tmp_path, ("alone", "owner"), WIRES, exchange=exchange), None
        (tmp_path / "law.toml").write_text(LAW)
        path = system(library, tmp_path, ("alone", "alone"), [], exchange=exchange)
        return path, tmp_path / "law.toml"

    return make


def growth(path, law, scheme, h, steps=3000):
    """Rate at which a run of the FMUs grows: of its largest swing in the last quarter, 1/s."""
    with open_ssp(path) as loaded:
        found, more = read_law(law, loaded.components) if law else (None, ())
        parts = [*loaded.components, *([found] if found else [])]
        running = System(parts, [*loaded.connections, *more])
        loaded.fmus[0].set_parameters({"x": 1.0})
        initialise(running, loaded.fmus, 0.0)
        stepper = scheme.start(running)
        running.begin(0.0)
        size = np.empty(steps)
        for n in range(steps):
            stepper.step(n * h, h)
            size[n] = np.abs(running.outputs).max()
    ends = size[steps // 2 : 3 * steps // 4].max(), size[3 * steps // 4 :].max()
    return np.log(ends[1] / ends[0]) / (steps / 4 * h)


@pytest.mark.parametrize("owner", ["right", "master"])
@pytest.mark.parametrize("name", ["jacobi-constant", "gauss-seidel-constant-left-first", "nepce"])
def test_limits_are_those_of_runs(made, owner, name) -> None:
    path, law = made(owner)
    found = system_stability(path, [name], law=law)
    assert set(found.ways.values()) == {"Model Exchange, finite differences"}
    step = found.limits[name].step
    assert 0.0 < step < 1.0, found
    scheme = members(("left", "right"))[name].scheme
    assert growth(path, law, scheme, 0.99 * step) < 0.0
    assert growth(path, law, scheme, 1.01 * step) > 0.0


@pytest.mark.slow  # records of pulses: 5 s
def test_pulses_predict_what_model_exchange_does(made, tmp_path) -> None:
    """From outside: the same limits, to the 0.05 % that edges are known to."""
    path, _ = made("right")
    inside = system_stability(path, ["jacobi", "gauss-seidel"])
    path, _ = made("right", exchange=False)
    outside = system_stability(path, ["jacobi", "gauss-seidel"], step=2e-2)
    assert set(outside.ways.values()) == {"Co-Simulation, pulses"}
    assert list(outside.limits) == list(inside.limits)
    for name, limit in inside.limits.items():
        assert outside.limits[name].step == pytest.approx(limit.step, rel=1e-3), name


def test_growth_if_coupled_exactly_is_that_of_both_masses_together(made) -> None:
    """Poles of the uncut oscillator, M x'' = ..., however it is cut."""
    together = np.array(
        [[0, 1, 0, 0], [-K - K_C, -C - C_C, K_C, C_C], [0, 0, 0, 1], [K_C, C_C, -K - K_C, -C - C_C]]
    )
    slowest = np.abs(np.linalg.eigvals(together)).min()
    for owner in ("right", "master"):
        path, law = made(owner)
        found = system_stability(path, ["nepce"], law=law)
        assert found.growth == 0.0
        assert found.longest == pytest.approx(2 * np.pi / slowest, rel=1e-6)


@pytest.mark.parametrize(
    ("change", "told"),
    [
        (("stiffness = 50.0", "stiffness = inf"), "contact 1: stiffness = inf: must be a finite"),
        (('"left.z"', '"left.y"'), "no Real output 'left.y'"),
        (('"left.f" = -1, ', '"left.f" = -1, "left.z" = 1, '), "no Real input 'left.z'"),
        (("[[contact]]", "[contact]"), "must hold tables"),
        (("rate =", "rates ="), "no key 'rates'; did you mean rate?"),
        (("motion = {", "motion = 3 #"), "motion must be a table of factors"),
    ],
)
def test_a_wrong_law_is_refused(made, change, told) -> None:
    path, law = made("master")
    law.write_text(LAW.replace(*change))
    with open_ssp(path) as loaded, pytest.raises(CouplingError, match=told):
        read_law(law, loaded.components)


def test_boxes_without_motion_are_refused() -> None:
    with pytest.raises((CouplingError, ValueError)):
        Boxes([], [], [])
