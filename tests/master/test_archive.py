"""FMU archives from strangers, and what a model description says. No code of an FMU is run."""

from __future__ import annotations

import shutil
import stat
import tempfile
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest

from railcosim.master.component import Hold, Type
from railcosim.master.fmi import archive, fmu
from railcosim.master.fmi.archive import FmuError, description_of, unpack
from railcosim.master.fmi.description import read_description
from railcosim.master.fmi.fmu import FmuComponent
from railcosim.master.fmi.fmu_parameters import setting_of

XML = """<?xml version="1.0" encoding="UTF-8"?>
<fmiModelDescription fmiVersion="2.0" modelName="Contact" guid="{{abc}}" generationTool="hand">
  <CoSimulation modelIdentifier="contact" canGetAndSetFMUstate="true"/>
  <UnitDefinitions><Unit name="N"/><Unit name="m"/></UnitDefinitions>
  <TypeDefinitions>
    <SimpleType name="Force"><Real unit="N" nominal="5e4"/></SimpleType>
  </TypeDefinitions>
  <ModelVariables>
    <ScalarVariable name="z" valueReference="10" causality="input">
      <Real unit="m" start="0.5"/></ScalarVariable>
    <ScalarVariable name="mode" valueReference="3" causality="input" variability="discrete">
      <Integer start="1"/></ScalarVariable>
    <ScalarVariable name="vz" valueReference="11" causality="input"><Real start="0"/>
      </ScalarVariable>
    <ScalarVariable name="force" valueReference="20" causality="output" description="of contact">
      <Real declaredType="Force"/></ScalarVariable>
    <ScalarVariable name="late" valueReference="21" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="any" valueReference="22" causality="output"><Real/></ScalarVariable>
    <ScalarVariable name="stiffness" valueReference="30" causality="parameter" variability="fixed">
      <Real start="1e9"/></ScalarVariable>
    <ScalarVariable name="input_hold" valueReference="31" causality="parameter"
      variability="tunable"><Integer start="0"/></ScalarVariable>
    <ScalarVariable name="linear" valueReference="32" causality="parameter" variability="tunable">
      <Boolean start="false"/></ScalarVariable>
    <ScalarVariable name="file" valueReference="33" causality="parameter" variability="fixed">
      <String start="x"/></ScalarVariable>
  </ModelVariables>
  <ModelStructure>
    <Outputs>
      <Unknown index="4" dependencies="1 2"/>
      <Unknown index="5" dependencies=""/>
      <Unknown index="6"/>
    </Outputs>
  </ModelStructure>
</fmiModelDescription>
"""


@pytest.fixture(autouse=True)
def own_tempdir(tmp_path, monkeypatch):
    folder = tmp_path / "tmp"
    folder.mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(folder))
    return folder


@pytest.fixture
def make(tmp_path):
    def make(*entries, xml=XML):
        path = tmp_path / "x.fmu"
        with zipfile.ZipFile(path, "w") as file:
            if xml is not None:
                file.writestr("modelDescription.xml", xml)
            for name, text in entries:
                file.writestr(name, text)
        return path

    return make


def describe(path):
    return read_description(path, unpack(path))


@pytest.mark.parametrize(
    "name", ["../x", "a/../../x", "/etc/x", "C:/x", "C:x", "..\\x", "\\x", "a\\..\\..\\x"]
)
def test_entries_that_leave_the_folder(make, own_tempdir, name):
    with pytest.raises(FmuError, match="leaves the archive's folder"):
        unpack(make((name, "bad")))
    assert list(own_tempdir.glob("railcosim_*/fmu_*")) == []


def test_symbolic_links(make, own_tempdir):
    link = zipfile.ZipInfo("resources/link")
    link.external_attr = (stat.S_IFLNK | 0o777) << 16
    with pytest.raises(FmuError, match="symbolic link"):
        unpack(make((link, "/etc")))
    assert list(own_tempdir.glob("railcosim_*/fmu_*")) == []


def test_size_limits(make, monkeypatch):
    path = make(("resources/big", b"\0" * 100_000))
    monkeypatch.setattr(archive, "MAX_TOTAL_SIZE", 100_000 + len(XML) - 1)
    with pytest.raises(FmuError, match="2 entries of 0 MB unpacked; refused"):
        unpack(path)
    monkeypatch.setattr(archive, "MAX_TOTAL_SIZE", 100_000 + len(XML))
    assert (unpack(path) / "resources" / "big").stat().st_size == 100_000
    monkeypatch.setattr(archive, "MAX_ENTRIES", 1)
    with pytest.raises(FmuError, match="refused, the limits are 1 entries"):
        unpack(path)


@pytest.mark.parametrize(
    ("first", "second", "message"),
    [
        ("resources/a", "resources/a", "'resources/a' is in it twice"),
        ("resources/a", "resources//./a", "'resources//./a' is in it twice"),
        ("resources/a", "resources\\a", "is in it twice"),
        ("resources/a", "resources/a/b", "'resources/a' is both a file and a folder"),
        ("resources/a/", "resources/a", "'resources/a' is both a file and a folder"),
    ],
)
@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_entries_that_collide(make, own_tempdir, first, second, message):
    for pair in ((first, second), (second, first)):
        with pytest.raises(FmuError, match=message.replace("'resources//./a' ", "")):
            unpack(make(*((name, f"{k}") for k, name in enumerate(pair))))
    assert list(own_tempdir.glob("railcosim_*/fmu_*")) == []


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_a_file_may_be_packed_twice(make):
    """As the build of a Reference FMU of FMI 3.0 does."""
    assert (unpack(make(("a/b", "x"), ("a/b", "x"))) / "a" / "b").read_text() == "x"


@pytest.mark.filterwarnings("ignore:Duplicate name")
def test_a_folder_may_be_named_twice(make):
    assert (unpack(make(("a/", ""), ("a/", ""), ("a/b", "x"))) / "a" / "b").read_text() == "x"


@pytest.mark.parametrize("method", [zipfile.ZIP_BZIP2, zipfile.ZIP_LZMA])
def test_other_compression_methods(tmp_path, method):
    """What FMI does not allow, and what is unpacked in pieces that nobody counts."""
    path = tmp_path / "x.fmu"
    with zipfile.ZipFile(path, "w", method) as file:
        file.writestr("modelDescription.xml", XML)
    with pytest.raises(FmuError, match=f"compressed by method {method}; export it with deflate"):
        unpack(path)


@pytest.mark.parametrize("places", [(22,), (24,), (22, 24)], ids=["local", "central", "both"])
def test_sizes_that_lie(tmp_path, own_tempdir, monkeypatch, places):
    """10 MB that say they are 10 bytes, in either of the two places, or both."""
    monkeypatch.setattr(archive, "MAX_TOTAL_SIZE", 1_000_000)
    path = tmp_path / "x.fmu"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr("big", bytes(10_000_000))
        file.writestr("modelDescription.xml", XML)
    raw = bytearray(path.read_bytes())
    for signature, place in ((b"PK\x03\x04", 22), (b"PK\x01\x02", 24)):
        at = raw.find(signature) + place  # of the first entry
        assert raw[at : at + 4] == (10_000_000).to_bytes(4, "little")
        if place in places:
            raw[at : at + 4] = (10).to_bytes(4, "little")
    path.write_bytes(raw)
    # Where the central directory tells the truth, the limit holds; else the checksum does.
    with pytest.raises(FmuError, match="refused" if 24 not in places else "CRC"):
        unpack(path)
    assert list(own_tempdir.glob("railcosim_*/fmu_*")) == []


def test_xml_too_long(make, monkeypatch):
    monkeypatch.setattr(archive, "MAX_XML_SIZE", len(XML) - 1)
    with pytest.raises(FmuError, match=r"modelDescription\.xml has 0 MB; refused, the limit"):
        unpack(make())


@pytest.mark.parametrize("encoding", ["utf-7", "no-such"])
def test_strange_encodings(make, encoding):
    """Ones in which a document type could hide."""
    with pytest.raises(FmuError, match="not well-formed"):
        unpack(make(xml=XML.replace("UTF-8", encoding)))


def test_not_an_fmu(make, tmp_path):
    with pytest.raises(FmuError, match="no such file"):
        unpack(tmp_path / "none.fmu")
    (tmp_path / "text.fmu").write_text("hello")
    with pytest.raises(FmuError, match="not a readable zip"):
        unpack(tmp_path / "text.fmu")
    with pytest.raises(FmuError, match=r"no modelDescription\.xml"):
        unpack(make(xml=None))
    with pytest.raises(FmuError, match="not well-formed"):
        unpack(make(xml="<a><b></a>"))


def test_damaged_archive(make):
    path = make(("resources/data", b"0123456789" * 100))
    raw = bytearray(path.read_bytes())
    at = raw.find(b"0123456789" * 2)
    raw[at] ^= 1  # its checksum does not fit any more
    path.write_bytes(raw)
    with pytest.raises(FmuError, match="not a readable zip"):
        unpack(path)


def test_damaged_anywhere(make, own_tempdir):
    """Some bytes changed, most of them where the entries are listed: unpacked, or one sentence."""
    path = make(("resources/data", b"0123456789" * 100), ("binaries/", ""))
    raw = path.read_bytes()
    rng = np.random.default_rng(1)
    said = []
    for _ in range(400):
        damaged = np.frombuffer(raw, dtype=np.uint8).copy()
        where = rng.integers(rng.choice([0, len(raw) - 350]), len(raw), size=rng.integers(1, 6))
        damaged[where] = rng.integers(0, 256, size=len(where))
        path.write_bytes(damaged.tobytes())
        try:
            shutil.rmtree(unpack(path))
        except FmuError as error:
            said.append(str(error))
    assert len(said) > 200
    assert all(text.startswith(f"{path}: ") and "\n" not in text for text in said)
    assert list(own_tempdir.glob("railcosim_*/fmu_*")) == []


@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_document_types(make, encoding):
    entity = '<!DOCTYPE x [<!ENTITY e SYSTEM "file:///etc/passwd">]>\n<fmiModelDescription'
    xml = XML.replace("<fmiModelDescription", entity).replace("UTF-8", encoding)
    with pytest.raises(FmuError, match="DOCTYPE"):
        unpack(make(xml=xml.encode(encoding)))


@pytest.mark.parametrize("version", ["1.0", "3.1"])
def test_other_fmi_versions(make, version):
    xml = XML.replace('fmiVersion="2.0"', f'fmiVersion="{version}"')
    with pytest.raises(FmuError, match=f"FMI version {version}; export it as FMI 2.0"):
        unpack(make(xml=xml))


def test_temporary_folder_with_dangerous_name(make, tmp_path, monkeypatch):
    for name in ("a#b", "a%20b", "a+b", "a(b", "gleis-ö"):
        (tmp_path / name).mkdir()
        monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / name))
        with pytest.raises(FmuError, match="TMPDIR"):
            unpack(make())
        assert list((tmp_path / name).iterdir()) == []


def test_dangerous_name_of_the_fmu_does_not_matter(make, tmp_path):
    path = make().rename(tmp_path / "Gleis#1 (ö) 100%.fmu")
    assert describe(path).path == path


def test_no_co_simulation(make):
    xml = XML.replace("<CoSimulation", "<ModelExchange").replace('canGetAndSetFMUstate="true"', "")
    with pytest.raises(FmuError, match="no Co-Simulation"):
        describe(make(xml=xml))


@pytest.mark.parametrize(
    "change", [('guid="{{abc}}"', ""), ('index="6"', 'index="60"'), ('"Force">', '"Forze">')]
)
def test_invalid_descriptions(make, change):
    with pytest.raises(FmuError, match=r"not valid FMI 2\.0"):
        describe(make(xml=XML.replace(*change)))


def test_missing_binary_leaves_nothing_behind(make, own_tempdir):
    with pytest.raises(FmuError, match=r"no binary for .*, only for amiga;"):
        FmuComponent.load(make(("binaries/amiga/contact.so", "x")))
    assert list(own_tempdir.glob("railcosim_*/fmu_*")) == []


def test_who_cleans_the_temporary_folder_is_suspected(make, monkeypatch):
    """What was unpacked is gone before its library is loaded: nothing is wrong with the FMU."""
    monkeypatch.setattr(fmu, "tell_layers", lambda path, folder: shutil.rmtree(folder))
    with pytest.raises(FmuError, match=r"has been removed by something; set .* TMPDIR"):
        FmuComponent.load(make())


def test_broken_binary_leaves_the_working_directory(make):
    name = f"binaries/{fmpy.platform}/contact{fmpy.sharedLibraryExtension}"
    before = Path.cwd()
    with pytest.raises(FmuError, match="cannot be loaded"):
        FmuComponent.load(make((name, "not a library")))
    assert Path.cwd() == before


def test_interface(make):
    description = describe(make())
    z, vz, mode = description.inputs  # what is no Real comes last
    assert (z.name, z.unit, z.start, z.nominal) == ("z", "m", 0.5, 1.0)
    assert vz.name == "vz"
    assert (mode.name, mode.type, mode.start) == ("mode", Type.INTEGER, 1.0)
    force = description.outputs[0]
    assert (force.unit, force.nominal, force.description) == ("N", 5e4, "of contact")
    assert [p.references for p in description.passed_in] == [(10, 11), (3,)]
    assert [p.references for p in description.passed_out] == [(20, 21, 22)]
    assert description.can_get_and_set_state
    assert not description.can_serialize_state
    assert description.has_hold_parameter
    attributes = description.as_attributes()
    assert (attributes["guid"], attributes["file"]) == ("{{abc}}", "x.fmu")
    assert len(attributes["sha256"]) == 64


def test_feedthrough(make):
    # Listed, empty, and missing: everything.
    expected = [[True, False, True], [False, False, False], [True, True, True]]
    np.testing.assert_array_equal(describe(make()).feedthrough, expected)


def test_hold_parameter_must_be_an_integer(make):
    xml = XML.replace(
        'variability="tunable"><Integer start="0"/>', 'variability="tunable"><Real start="0"/>'
    )
    assert not describe(make(xml=xml)).has_hold_parameter
    assert Hold(0) is Hold.CONSTANT  # the numbers are FMU values and must not move
    assert (Hold(1), Hold(2)) == (Hold.EXTRAPOLATE, Hold.INTERPOLATE)


@pytest.mark.parametrize(
    ("name", "value", "message"),
    [
        ("stiffnes", 1.0, "no parameter 'stiffnes'; did you mean stiffness"),
        ("z", 1.0, "z is of causality input, not a parameter"),
        ("stiffness", True, "is a Real; True does not fit"),
        ("stiffness", float("nan"), "does not fit"),
        ("stiffness", "1e9", "is a Real; '1e9' does not fit"),
        ("input_hold", 1.5, "is a Integer; 1.5 does not fit"),
        ("linear", 1, "is a Boolean; 1 does not fit"),
        ("file", 1.0, "is a String; 1.0 does not fit"),
    ],
)
def test_parameters_are_checked(make, name, value, message):
    with pytest.raises(FmuError, match=message):
        setting_of(describe(make()), name, value, initialised=False)


def test_fixed_parameters_are_not_for_later(make):
    description = describe(make())
    setting = setting_of(description, "stiffness", 2, initialised=False)
    assert (setting.kind.function, setting.reference, setting.value) == ("Real", 30, 2.0)
    with pytest.raises(FmuError, match="stiffness is fixed; set it before"):
        setting_of(description, "stiffness", 2, initialised=True)
    assert setting_of(description, "linear", True, initialised=True).kind.function == "Boolean"


def test_a_description_is_read_without_the_rest(tmp_path):
    """Of an FMU whose other entries are damaged; and what is refused of FMUs is refused here."""
    path = tmp_path / "a.fmu"
    with zipfile.ZipFile(path, "w") as written:
        written.writestr("modelDescription.xml", "<fmiModelDescription fmiVersion='2.0'/>")
        written.writestr("resources/data.bin", b"x" * 1000)
    damaged = path.read_bytes().replace(b"x" * 1000, b"y" * 1000)
    path.write_bytes(damaged)
    with description_of(path) as folder:
        assert [p.name for p in folder.iterdir()] == ["modelDescription.xml"]
    assert not folder.exists()
    with pytest.raises(FmuError, match="not a readable zip archive"):
        unpack(path)
