"""SSP files that are wrong, that ask for what is not supported, or that mean harm.

Each message names the file, and what in it is wrong. No FMU's code is run for any of them but
where the FMU itself has to be asked.
"""

from __future__ import annotations

import stat
import struct
import tempfile
import zipfile

import pytest

from railcosim.master.connections import CouplingError
from railcosim.master.fmi import archive
from railcosim.master.fmi.archive import FmuError
from railcosim.master.ssp import load, open_ssp
from railcosim.master.system import System

from .plant import component, connection, description, pack, real, ssd, values


@pytest.fixture(autouse=True)
def own_tempdir(tmp_path, monkeypatch):
    folder = tmp_path / "temporary"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture
def refused(tmp_path, plant, own_tempdir):
    """Checks that an SSP is refused with a message in one line, and that nothing stays behind."""

    def check(message, text, **files):
        path = pack(tmp_path / "bad.ssp", text, **({"P__fmu": plant} | files))
        refused_file(message, path)

    def refused_file(message, path):
        with pytest.raises(FmuError, match=message) as caught, open_ssp(path):
            pass
        assert str(caught.value).startswith(f"{path}")
        assert "\n" not in str(caught.value)
        assert str(own_tempdir) not in str(caught.value)
        assert list(own_tempdir.glob("railcosim_*/fmu_*")) == []

    check.file = refused_file
    return check


A = component("a", u="input", x="output")
B = component("b", u="input", z="output")


def system(*connections, elements=A + B, before=""):
    wires = f"<ssd:Connections>{''.join(connections)}</ssd:Connections>" if connections else ""
    return ssd(f"{before}<ssd:Elements>{elements}</ssd:Elements>{wires}")


SETS = "application/x-ssp-parameter-set"
INNER = (
    '<ssd:System name="s"><ssd:Connectors><ssd:Connector name="in" kind="input"/>'
    '<ssd:Connector name="out" kind="output"/></ssd:Connectors><ssd:Connections>'
    '<ssd:Connection startConnector="in" endConnector="out"/></ssd:Connections></ssd:System>'
)
DICTIONARY = '<ssd:SignalDictionaryReference name="bus" dictionary="d"/>'
BOOLEAN = (
    '<ssc:BooleanMappingTransformation><ssc:MapEntry source="true" target="false"/>'
    "</ssc:BooleanMappingTransformation>"
)
BAD_UNIT = '<ssd:Units><ssc:Unit name="m"><ssc:BaseUnit m="one"/></ssc:Unit></ssd:Units>'
DEEP = '<ssd:Elements><ssd:System name="s">' * 60 + "</ssd:System></ssd:Elements>" * 60


@pytest.mark.parametrize(
    ("message", "text"),
    [
        # Not this kind of file
        ("SSP version 3.0; export it as SSP 1.0", ssd("", version="3.0")),
        ("begins with {urn:x}y, which is no SSP", '<y xmlns="urn:x"/>'),
        (r"ssd is not well-formed XML \(mismatched tag", "<a><b></a>"),
        ("has no system in it", ssd("").replace('<ssd:System name="root"></ssd:System>', "")),
        # Components
        (
            r"a: no file 'resources/Q\.fmu' in the package; did you mean resources/P\.fmu",
            system(elements=component("a", "resources/Q.fmu")),
        ),
        (
            "component a: source '../P.fmu' is not in the package",
            system(elements=component("a", "../P.fmu")),
        ),
        (
            "source '/etc/passwd' is not in the package",
            system(elements=component("a", "/etc/passwd")),
        ),
        ("source '%2e%2e/x' is not in the package", system(elements=component("a", "%2e%2e/x"))),
        ("source 'file:///x.fmu' is not in the", system(elements=component("a", "file:///x.fmu"))),
        (
            "source 'http://x/y.fmu' is not in the",
            system(elements=component("a", "http://x/y.fmu")),
        ),
        ("a: source 'x%00y' is no path", system(elements=component("a", "x%00y"))),
        (r"a: source '//\[x' is no path", system(elements=component("a", "//[x"))),
        (
            "a is of type application/x-ssp-package; only FMUs",
            system(
                elements=A.replace(
                    "<ssd:Component", '<ssd:Component type="application/x-ssp-package"'
                )
            ),
        ),
        (
            "a asks for ModelExchange; only CoSimulation",
            system(
                elements=A.replace(
                    "<ssd:Component", '<ssd:Component implementation="ModelExchange"'
                )
            ),
        ),
        ("two elements are called a", system(elements=A + A)),
        ("element Component has no attribute name", system(elements=A.replace('name="a"', ""))),
        (
            "bus refers to the signal dictionary .*, which is not there",
            system(elements=A + DICTIONARY),
        ),
        ("x is of kind inout; supported are", system(elements=component("a", x="inout"))),
        # Connections
        ("names the element 'c', not there", system(connection("a.x", "c.u"))),
        ("b has no connector 'uu'; did you mean u", system(connection("a.x", "b.uu"))),
        ("the system has no connector 'y'", system(connection("y", "b.u"))),
        (r"a\.x -> b\.z: both give values", system(connection("a.x", "b.z"))),
        (r"a\.u -> b\.u: both take values", system(connection("a.u", "b.u"))),
        (
            r"two sources for one input: a\.x -> b\.u and b\.z -> b\.u",
            system(connection("a.x", "b.u"), connection("b.z", "b.u")),
        ),
        (
            "the connections run in a circle",
            system(connection("s.out", "s.in"), connection("s.out", "b.u"), elements=B + INNER),
        ),
        (
            "a mapping of Boolean values, and x is Real",
            system(connection("a.x", "b.u", BOOLEAN)),
        ),
        (
            "factor must be a number, got 'two'",
            system(connection("a.x", "b.u", '<ssc:LinearTransformation factor="two"/>')),
        ),
        (
            r"a\.k -> b\.k: calculated parameters are not passed on",
            system(
                connection("a.k", "b.k"),
                elements=component("a", k="calculatedParameter") + component("b", k="parameter"),
            ),
        ),
        # Variables, which only the FMU knows
        (
            r"a\.v -> b\.u: the FMU of a has no output 'v'",
            system(connection("a.v", "b.u"), elements=component("a", v="output") + B),
        ),
        (
            r"a\.w -> b\.u: in the FMU of a, w is of causality local, not an output",
            system(connection("a.w", "b.u"), elements=component("a", w="output") + B),
        ),
        # Values
        (
            r"parameter a.k has no value",
            system(elements=A, before=values('<ssv:Parameter name="a.k"/>')),
        ),
        (
            "Real: value must be a number, got 'many'",
            system(elements=A, before=values(real("a.k", 1.0).replace("1.0", "many"))),
        ),
        (
            "parameter n is a Integer; 0.5 does not fit",
            system(elements=A, before=values(real("a.n", 0.5))),
        ),
        (
            "parameter x0 is a Real; nan does not fit",
            system(elements=A, before=values(real("a.x0", float("nan")))),
        ),
        ("parameters of type x/csv; only", system(elements=A, before=values("", 'type="x/csv"'))),
        (
            "no file 'resources/p.ssv' in the package",
            system(elements=A, before=values("", 'source="resources/p.ssv"')),
        ),
        (
            "is inside a component; put it beside",
            system(elements=A, before=values("", 'source="p.ssv" sourceBase="component"')),
        ),
        ("a unit is not defined by numbers", ssd("", BAD_UNIT)),
        ("startTime must be a number", ssd("", '<ssd:DefaultExperiment startTime="now"/>')),
        ("nested more than 50 deep", ssd(DEEP)),
    ],
)
def test_wrong_structures(refused, message, text):
    refused(message, text)


DOCTYPE = '<!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]>'


def test_document_types(refused):
    """In the structure, in a parameter set, in a mapping, and in an FMU inside."""
    text = system(elements=A).replace("<ssd:SystemS", DOCTYPE + "<ssd:SystemS", 1)
    refused("SystemStructure.ssd has a DOCTYPE", text)
    text = system(elements=A, before=values("", 'source="resources/p.ssv"'))
    refused(r"resources/p\.ssv has a DOCTYPE", text, p__ssv=f"{DOCTYPE}<x>&e;</x>")
    mapping = '<ssd:ParameterMapping source="resources/p.ssm"/>'
    text = system(elements=A, before=values(real("k", 1.0), mapping=mapping))
    refused(r"resources/p\.ssm has a DOCTYPE", text, p__ssm=f"{DOCTYPE}<x>&e;</x>")


@pytest.fixture
def fmu_of(tmp_path):
    """An FMU inside, of these entries."""

    def make(*entries):
        path = tmp_path / "inner.fmu"
        with zipfile.ZipFile(path, "w") as file:
            for name, content in entries:
                file.writestr(name, content)
        return path

    return make


def test_bad_fmus_inside(refused, fmu_of):
    """The same checks as for an FMU by itself; the message says where it is."""
    text = description()
    refused(r"bad\.ssp/resources/P\.fmu: no modelDescription", system(elements=A), P__fmu=fmu_of())
    with_type = text.replace("<fmiModel", DOCTYPE + "<fmiModel")
    inner = fmu_of(("modelDescription.xml", with_type))
    refused(r"P\.fmu: modelDescription\.xml has a DOCTYPE", system(elements=A), P__fmu=inner)
    inner = fmu_of(("modelDescription.xml", text), ("../x", ""))
    refused(r"P\.fmu: entry '\.\./x' leaves", system(elements=A), P__fmu=inner)
    refused(r"P\.fmu: not a readable zip", system(elements=A), P__fmu=b"PK\x03\x04 and no more")
    other = text.replace('fmiVersion="2.0"', 'fmiVersion="1.0"')
    refused("FMI version 1.0", system(elements=A), P__fmu=fmu_of(("modelDescription.xml", other)))


def test_entries_that_leave_and_links(refused, tmp_path):
    link = zipfile.ZipInfo("resources/link")
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    for entry, message in (("../x.fmu", "leaves the archive"), (link, "is a symbolic link")):
        path = tmp_path / "bad.ssp"
        with zipfile.ZipFile(path, "w") as file:
            file.writestr("SystemStructure.ssd", system(elements=A))
            file.writestr(entry, "/etc")
        refused.file(message, path)


def test_not_a_package(refused, tmp_path, plant):
    path = tmp_path / "none.ssp"
    refused.file(r"no such file; give the path of a \.ssp file", path)
    path.write_text("hello")
    refused.file("not a readable zip", path)
    refused.file("is not an SSP but an FMU", plant)
    with zipfile.ZipFile(path, "w") as file:
        file.writestr("other.xml", "<a/>")
    refused.file(r"no SystemStructure\.ssd at its top level; not an SSP", path)


def test_many_components_of_one_big_fmu(refused, monkeypatch, plant):
    """Each unpacks it again: together they may not pass the limit of one archive."""
    limit = archive.unpacked_size(plant) * 3 // 2
    monkeypatch.setattr(load, "MAX_TOTAL_SIZE", limit)
    refused("its 2 FMUs have 0 MB unpacked; refused", system())


def test_size_that_is_a_lie(refused, tmp_path, fmu_of):
    """10 MB that say they are 10 bytes: ten bytes are unpacked, and their checksum is wrong."""
    inner = fmu_of(("modelDescription.xml", description()))
    with zipfile.ZipFile(inner, "a", zipfile.ZIP_DEFLATED) as file:
        file.writestr("big", bytes(10_000_000))
    raw = bytearray(inner.read_bytes())
    size = struct.pack("<I", 10_000_000)
    assert raw.count(size) == 2
    inner.write_bytes(raw.replace(size, struct.pack("<I", 10)))
    assert archive.unpacked_size(inner) < 10_000
    refused("not a readable zip archive .*CRC", system(elements=A), P__fmu=inner)


def test_algebraic_loop(tmp_path, plant):
    """z depends on u at once, twice around: the system says so."""
    c = component("c", u="input", z="output")
    text = system(connection("b.z", "c.u"), connection("c.z", "b.u"), elements=B + c)
    path = pack(tmp_path / "loop.ssp", text, P__fmu=plant)
    with open_ssp(path) as loaded, pytest.raises(CouplingError, match="loop"):
        System(loaded.components, loaded.connections)
