"""Pages, pictures, licences and reference data that travel in FMUs."""

import re
import shutil
import subprocess
import zipfile
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.util import read_csv
from lxml import etree, html

from railcosim.fmus.description.drawing import signs
from railcosim.fmus.export import WITH_STATES, NativeRuntime, PythonRuntime

from ..c_compiler import c_compiler
from ..fmpy_problems import problems_of

NAMES = ["Vehicle", "Track", "VehicleWithContact", "TrackWithContact"]
REPOSITORY = Path(__file__).parents[2]


RUNTIMES = {
    "native, FMI 2": WITH_STATES, "native, FMI 3": NativeRuntime(fmi=3), "python": PythonRuntime()
}  # fmt: skip


@pytest.fixture(scope="module")
def made(packed_by):
    """The four FMUs by runtime and name."""
    return {name: packed_by(runtime) for name, runtime in RUNTIMES.items()}


@pytest.fixture(params=RUNTIMES)
def runtime(request, made):
    return made[request.param]


@pytest.fixture
def unpacked(runtime, tmp_path):
    """Folder of an FMU's content, by name."""

    def unpack(name):
        folder = tmp_path / name
        with zipfile.ZipFile(runtime[name]) as archive:
            archive.extractall(folder)
        return folder

    return unpack


each = pytest.mark.parametrize("name", NAMES)


def page_of(folder):
    return html.parse(folder / "documentation" / "index.html").getroot()


# --- the page ---------------------------------------------------------------------------------


@each
def test_fmpy_finds_no_problem_in_the_whole(runtime, name):
    assert problems_of(runtime[name]) == []


@each
def test_links_and_pictures_of_the_page_are_there(unpacked, name):
    folder = unpacked(name)
    page = page_of(folder)
    targets = page.xpath("//@href | //@src")
    anchors = set(page.xpath("//@id"))
    assert len(targets) > 15
    for target in targets:
        if target.startswith("#"):
            assert target[1:] in anchors
        elif not target.startswith("https://doi.org/"):
            assert (folder / "documentation" / target).is_file(), target


@each
def test_the_page_names_all_variables_with_units_and_starts(unpacked, name):
    folder = unpacked(name)
    rows = {
        row[0].text_content(): [cell.text_content() for cell in row]
        for row in page_of(folder).xpath("//section[@id='variables']//tbody/tr")
    }
    read = fmpy.read_model_description(folder)
    shown = [v for v in read.modelVariables if v.causality not in {"local", "independent"}]
    assert set(rows) == {v.name for v in shown}
    for v in shown:
        cells = rows[v.name]
        assert cells[1] == (v.unit or "")
        assert cells[2] == v.description
        if v.causality == "output":
            depends = next(u.dependencies for u in read.outputs if u.variable is v)
            inputs = {d.name for d in depends if d.causality == "input"}
            assert cells[4].startswith("all inputs") or inputs <= set(cells[4].split(", "))
        elif v.type == "Real":
            assert float(cells[3]) == pytest.approx(float(v.start), rel=1e-5)  # six digits


def test_the_page_says_what_the_runtime_can_do(made):
    texts = {}
    for runtime, fmus in made.items():
        with zipfile.ZipFile(fmus["Track"]) as archive:
            texts[runtime] = archive.read("documentation/index.html").decode()
    native = {"native, FMI 2", "native, FMI 3"}
    said_by = {
        "Model Exchange": native,
        "Directional derivatives": native,
        "fmi2SetRealInputDerivatives": {"native, FMI 2"},
        "FMI 3.0": {"native, FMI 3"},
        "externalDependencies.txt": {"python"},
    }
    for words, runtimes in said_by.items():
        assert {runtime for runtime, text in texts.items() if words in text} == runtimes, words


# --- the reference run ------------------------------------------------------------------------


@each
def test_the_pages_example_gives_the_reference(unpacked, runtime, name, tmp_path, monkeypatch):
    """The code on the page, as it stands. Native runtimes share no code with the models that made
    the reference."""
    folder = unpacked(name) / "documentation"
    (example,) = page_of(folder.parent).xpath("//section[@id='result']//pre")
    shutil.copy(runtime[name], folder)
    monkeypatch.chdir(folder)
    space = {}
    exec(example.text_content(), space)
    reference = read_csv(f"{name}_ref.csv")
    assert len(reference) == len(space["result"]) == 201
    for column in reference.dtype.names:
        size = np.abs(reference[column]).max()
        # Rounding of sums over a thousand modes, carried through 200 steps and the stiff contact.
        assert space["result"][column] == pytest.approx(reference[column], rel=0, abs=1e-9 * size)
        assert np.ptp(reference[column]) > 0, column


@each
def test_the_inputs_are_those_that_the_text_states(unpacked, name):
    folder = unpacked(name) / "documentation"
    u = read_csv(folder / f"{name}_in.csv")
    text = (folder / f"{name}_ref.txt").read_text()
    read = {v.name: v for v in fmpy.read_model_description(folder.parent).modelVariables}
    wheels = [f"wheelset[{i}].{side}" for side in ("left", "right") for i in (1, 2, 3, 4)]
    for column in u.dtype.names[1:]:
        owner, quantity = column.rsplit(".", 1)
        (formula,) = re.findall(rf"^  {quantity} = (.*)$", text, re.MULTILINE)
        if quantity == "position":
            speed = float(re.fullmatch(r"start value \+ (\S+) t", formula)[1])
            expected = float(read[column].start) + speed * u["time"]
        else:
            stated = r"(\S+) \(1 \+ (\S+) sin\(2 pi (\S+) t \+ k\)\) (\S+)"
            mean, depth, frequency, unit = re.fullmatch(stated, formula).groups()
            assert unit == read[column].unit
            phase = 2 * np.pi * float(frequency) * u["time"] + wheels.index(owner)
            expected = float(mean) * (1 + float(depth) * np.sin(phase))
        assert u[column] == pytest.approx(expected, rel=1e-12)  # rounding of the sine
        assert f"  {column}: {read[column].unit}" in text


# --- sources ----------------------------------------------------------------------------------


def test_the_sources_make_the_runtime_as_described(made, tmp_path):
    """What buildDescription.xml lists, compiled in its place, gives the reference run."""
    with zipfile.ZipFile(made["native, FMI 2"]["Track"]) as archive:
        archive.extractall(tmp_path)
    shutil.rmtree(tmp_path / "binaries")
    read = fmpy.read_model_description(tmp_path)
    (configuration,) = read.buildConfigurations
    assert configuration.modelIdentifier == read.coSimulation.modelIdentifier
    (files,) = configuration.sourceFileSets
    root = etree.parse(tmp_path / "modelDescription.xml")
    for interface in ("CoSimulation", "ModelExchange"):
        assert root.xpath(f"{interface}/SourceFiles/File/@name") == files.sourceFiles
    library = tmp_path / "binaries" / fmpy.platform / f"Track{fmpy.sharedLibraryExtension}"
    library.parent.mkdir(parents=True)
    flags = ["-std=c99", "-O1", "-shared", "-fPIC"]
    command = [*c_compiler(), *flags, *files.sourceFiles, "-o", str(library), "-lm"]
    subprocess.run(command, cwd=tmp_path / "sources", check=True, timeout=1800)
    documentation = tmp_path / "documentation"
    result = fmpy.simulate_fmu(
        tmp_path, fmi_type="CoSimulation", stop_time=0.02, step_size=1e-4,
        output_interval=1e-4, input=read_csv(documentation / "Track_in.csv"),
    )  # fmt: skip
    reference = read_csv(documentation / "Track_ref.csv")
    for column in reference.dtype.names:
        size = np.abs(reference[column]).max()
        assert result[column] == pytest.approx(reference[column], rel=0, abs=1e-9 * size)


# --- licences and pictures --------------------------------------------------------------------


def test_the_licence_is_the_projects(unpacked):
    licences = unpacked("Vehicle") / "documentation" / "licenses"
    assert (licences / "MIT.txt").read_text() == (REPOSITORY / "LICENSE").read_text()
    named = re.findall(r"[\w-]+\.txt", (licences / "license.txt").read_text())
    assert set(named) == {f.name for f in licences.iterdir()} - {"license.txt"}


def test_foreign_licences_travel_with_what_is_foreign(made):
    with zipfile.ZipFile(made["native, FMI 2"]["Vehicle"]) as archive:
        names = archive.namelist()
        assert any(n.startswith("sources/fmi2") for n in names)
        text = archive.read("documentation/licenses/BSD-2-Clause.txt").decode()
        assert "Modelica Association" in text
        assert "THIS SOFTWARE IS PROVIDED BY THE COPYRIGHT HOLDERS" in text
    with zipfile.ZipFile(made["python"]["Vehicle"]) as archive:
        assert any(n.startswith("resources/pythonfmu/") for n in archive.namelist())
        assert "MIT License" in archive.read("documentation/licenses/pythonfmu.txt").decode()


@each
def test_icons_are_there_in_both_forms(unpacked, name):
    folder = unpacked(name) / "terminalsAndIcons"
    described = etree.parse(folder / "terminalsAndIcons.xml")
    named = set(described.xpath("//@iconBaseName")) | {"icon"}
    for base in named:
        png = (folder / f"{base}.png").read_bytes()
        assert png.startswith(b"\x89PNG")
        width, height = (int.from_bytes(png[k : k + 4]) for k in (16, 20))
        assert width == height == 256
        assert etree.parse(folder / f"{base}.svg").getroot().tag.endswith("svg")
    if fmpy.read_model_description(folder.parent).fmiVersion == "2.0":
        assert (folder.parent / "model.png").read_bytes() == (folder / "icon.png").read_bytes()


def test_pictures_are_the_same_each_time():
    first = signs()
    signs.cache_clear()
    assert signs() == first
