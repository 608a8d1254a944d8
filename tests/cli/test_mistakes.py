"""Whatever is wrong: the exit status that fits, one line that helps, no traceback, in a moment."""

import shlex

import pytest

from railcosim.master.files import load

from ..master.plant import component, make_fmu, pack, ssd

V, VC, T, TC = "Vehicle.fmu", "VehicleWithContact.fmu", "Track.fmu", "TrackWithContact.fmu"
PAIR = f"--vehicle-fmu {V} --track-fmu {TC}"
PARTS = f"--vehicle-fmu {V} --track-fmu {T}"
RUN, FRF, SSP = "run --out r.nc", "frf --out f.nc", "run --out r.nc Pair.ssp"
ANY = f"receptance {V} --input wheelset[1].left.force_z --output carbody.z --out r.nc"

MISTAKES = {
    # Words on their way to the screen.
    "frf --out f.nc --frequencies 0:100:1": "--frequencies 0:100:1: ",
    "run --out [red]:100:/r.nc": "--out [red]:100:/r.nc: there is no folder [red]:100:",
    "export --out e --track escape.toml": r"unknown table or key [\x1b]0;pwn\x07]",
    "export --out e --track wordy.toml": "AAA': must be a table, [rail]",
    # Parameter files.
    "export --out e --track /dev/zero": "/dev/zero: is no file",
    "export --out e --vehicle .": ".: is no file",
    "export --out e --vehicle missing.toml": "missing.toml: cannot be read: No such file",
    "export --out e --vehicle binary.toml": "binary.toml: not a TOML file",
    "export --out e --track negative.toml": "[fastening] stiffness = -3e+07 N/m: must be > 0",
    "parameters": "parameters: give --vehicle or --track",
    # Options of one command.
    "run --fast --out r.nc": "No such option: --fast",
    f"{RUN} --scheme magic": "'magic' is not one of",
    f"{RUN[:-3]}.txt": "must end in .nc or .csv",
    f"{RUN} --step=-1": "--step -1: must be > 0 s",
    f"{FRF} --dimension spatial --contact-stiffness 1e9": "in space wheels roll",
    f"{FRF} --input alignment": "vehicle and track in space know more (--dimension spatial)",
    f"{FRF} --contact-stiffness hertz": "--contact-stiffness hertz: must be a number from 1000 to",
    "export --out e --fmi 4": "--fmi 4: must be 2 or 3",
    "export --out e --runtime python --fmi 3": "FMI 2 only",
    "export --out e --runtime python --platforms all": "leave out the rest",
    "export --out e --platforms linux63": "unknown platform 'linux63'; known are linux64",
    "export --out e --runtime rust": "--runtime",
    "export --out e --wheelsets 65": "--wheelsets 65: must be from 1 to 64",
    "export --out e --wheelsets 3 --positions 5,2": "are 2, but --wheelsets is 3",
    "export --out e --wheelsets 2 --positions 2,5": "--positions 2,5: must be from the front",
    "export --out e --wheelsets 2 --positions 5,nan": "must be from the front",
    "export --out e --wheelsets 2 --positions 5,b": "must be numbers in m, with commas",
    "export --out e --wheelsets 2 --separate": "--separate: is of vehicles",
    "export --out e --one-rail": "--positions and --one-rail: need --wheelsets",
    f"{RUN} --then ballasted@31": "must be a multiple of 5 m from 5 to 100 m, the ring of paper",
    f"{RUN} {PAIR} --then ballasted@30": "--then: is of parameters; --track-fmu has its own",
    "export --out e --then paper@30": "--then paper@30: is the same kind as before; leave it out",
    "export --out ''": "the argument behind --out is empty",
    "run '' --out r.nc": "the argument behind run is empty",
    "modes vehicle --speed 100": "--speed: wheels creep by both: give --conicity as well",
    "modes vehicle --speed 100 --conicity 0.1": "--wheels fixed: wheels that are held do not creep",
    "modes vehicle --conicity 2 --speed 9 --wheels contact": "--conicity 2: must be from 0 to 1",
    "modes vehicle --track t.toml": "--track: only with --wheels rails",
    "critical-speed --rigid-track --track t.toml": "--rigid-track, --track, --track-fmu:",
    "critical-speed --rigid-track --conicity 0": "--conicity 0: must be above 0, as cylinders do",
    "critical-speed --rigid-track --conicity x": "--conicity x: must be numbers, with commas",
    "critical-speed --rigid-track --conicity 0.2,0.1": "--conicity 0.2,0.1: must increase",
    "modes train": "'train' is not one of 'vehicle'",
    # Numbers that are none, or too large or small for anything.
    f"{RUN} --time 1e300": "--time 1e+300: must be from 1e-09 to 1e+09 s",
    f"{RUN} --time nan": "--time nan: must be > 0 s",
    f"{RUN} --time 0": "--time 0: must be > 0 s",
    f"{RUN} --time inf": "--time inf: must be > 0 s",
    f"{RUN} --speed 1e308": "--speed 1e+308: must be from 0.001 to 10000 km/h",
    f"{RUN} --speed 1e-308": "--speed 1e-308: must be from",
    f"{RUN} --tolerance 2": "--tolerance 2: must be between 0 and 1",
    f"{RUN} --contact-stiffness 1": "--contact-stiffness 1: must be a number from 1000 to 1e+15",
    f"{RUN} --contact-stiffness 1e300": "--contact-stiffness 1e300: must be",
    f"{RUN} --contact-stiffness nan": "--contact-stiffness nan: must be",
    f"{RUN} --contact-stiffness hertz:1": "--contact-stiffness hertz:1: must be",
    f"{RUN} --contact-stiffness hertz:1e300": "--contact-stiffness hertz:1e300: must",
    f"{FRF} --frequencies 1e-300:1e-300:1": "needs 0.001 <= start <= stop <= 1e+06 Hz",
    f"{FRF} --frequencies 1e300:1e300:1": "needs 0.001 <= start <= stop <= 1e+06 Hz",
    f"{FRF} --frequencies 1:2:nan": "a third number > 0",
    f"{ANY} --frequencies 1e-300:1e-300:1": "needs 1e-12 <= start",
    f"{ANY} --method pulses --step 1e-308": "--step 1e-308: must be from 1e-12",
    f"{ANY} --method pulses --amplitude 1e308": "--amplitude 1e+308: must be from",
    f"{ANY} --method pulses --steps 1000000000000": "Invalid value for '--steps'",
    "track-receptance --out t.nc --frequencies 1e300:1e300:1": "<= 1e+06 Hz",
    "track-receptance --out t.nc --at nan": "--position nan: must be railseat",
    "track-receptance --out t.nc --at 1e300": "--position 1e300: must be railseat, midspan, or",
    f"{FRF} {PARTS} --position 1e9": "--position 1e+09: must be from -1e+06 to 1e+06 m",
    f"{FRF} {PARTS} --position midspan": "--position midspan: must be m, with commas; railseat and",
    f"{FRF} --position attic": "--position attic: must be railseat, midspan, or from -1e+06",
    f"{RUN} {PAIR} --speed still.csv": "--speed: wheels stand still, and meet no irregularity of",
    f"{RUN} {PAIR} --position nan": "--position nan: must be from -1e+06 to 1e+06 m",
    "irregularity --out p.csv --length 1e15": "--length 1e+15: must be from 1 to 1e+06 m",
    "irregularity --out p.csv --shortest 1e-300": "--shortest 1e-300: must be from",
    "irregularity --out p.csv --longest nan": "must be",
    "map --out m.nc --wavelengths 1e-300:1e300:10@log": "--wavelengths 1e-300:1e300:10@log: needs",
    "map --out m.nc --wavelengths 1e5:1e6:10@log": "they must be from 0.001 to 1e+06 Hz",
    "stability --contact-stiffness 1e308": "--contact-stiffness 1e308: must be",
    "stability --contact-stiffness ,": "--contact-stiffness : must be",
    "advise --accuracy nan": "--accuracy nan: must be from 1e-12 to below 1",
    "paper --out p --figures 1-99999999999": "there are figures 3 to 23",
    "paper --out p --figures 5-3": "there are figures 3 to 23",
    # Too much at once.
    f"{RUN} --step 1e-12": "1e+12 steps of 1e-12 s; at most 1e+09 are run",
    f"{RUN} --step 1e-30": "--step 1e-30: must be from 1e-12",
    f"{RUN} --time 1e7": "1e+11 steps of 0.0001 s; at most 1e+09 are run",
    f"{RUN} --step 3": "a step of 3 s is longer than the run of 1 s",
    f"{RUN} {PAIR} --irregularity none --time 9e4": "900000000 steps of 69 numbers need",
    f"{SSP} --step 1e-3 --time 1e9": "1e+12 steps of 0.001 s",
    f"{SSP} --time 9e4": "900000000 steps of 61 numbers need",
    "compare --time 1e300": "--time 1e+300: must be",
    "compare --step 1 --time 0.1": "a step of 1 s is longer than the run of 0.1 s",
    "compare --step 1e-12 --time 0.1": "1e+11 steps",
    "study --time 1e300": "--time 1e+300: must be",
    "study --speed 1e308": "--speed 1e+308: must be",
    "study --steps 1e-30": "--steps 1e-30: must be from 1e-12",
    "study --steps 1e-12": "5e+10 steps",
    "study --steps 1e-8 --time 9": "900000000 steps need 450 GB of memory",
    f"{FRF} {PARTS} --frequencies 1:999999:1": "responses to 8 inputs at 999999 frequencies need",
    "map --out m.nc --wavelengths 0.1:60:0.0001 --speeds 10:400:0.001": "599001 wavelengths at",
    # Files of another kind.
    f"{RUN} --vehicle-fmu wordy.toml": "wordy.toml: is not an FMU but parameters; railcosim export",
    f"{RUN} --vehicle-fmu Pair.ssp": "Pair.ssp: is not an FMU but a whole system; railcosim run-",
    f"{RUN} --vehicle-fmu {V} --vehicle-fmu Pair.ssp": "Pair.ssp: is not an FMU but a whole system",
    f"{FRF} --track-fmu wordy.toml": "wordy.toml: is not an FMU but parameters; railcosim export",
    "receptance wordy.toml --input a --output b --out r.nc": "is not an FMU but parameters",
    "receptance Pair.ssp --input a --output b --out r.nc": "is not an FMU but a whole system",
    f"run-system {V} --out r.nc": f"{V}: is not an SSP but an FMU; railcosim run takes a pair",
    "run-system wordy.toml --out r.nc": "wordy.toml: is not an SSP but parameters",
    f"export --out e --vehicle {V}": f"{V}: is a zip archive, such as an FMU; give the parameters",
    f"modes vehicle --vehicle {V}": f"{V}: is a zip archive, such as an FMU; give the parameters",
    f"critical-speed --track {T}": f"{T}: is a zip archive, such as an FMU; give the parameters",
    f"{RUN} --vehicle-fmu .": ".: is a folder; give an FMU",
    f"{RUN} --track-fmu missing.fmu": "missing.fmu: no such file",
    f"{RUN} --track-fmu binary.fmu": "binary.fmu: not a readable zip archive",
    f"{RUN} --track-fmu empty.fmu": "empty.fmu: not a readable zip archive",
    f"{RUN} --vehicle-fmu {T}": f"{T}: cannot be the vehicle: it is a track",
    f"{RUN} --track-fmu {V}": f"{V}: cannot be the track: it is a vehicle",
    f"{RUN} --vehicle-fmu Plant.fmu": "Plant.fmu: cannot be the vehicle: it has no output wheelset",
    f"{FRF} --vehicle-fmu {T} --track-fmu {V}": f"{T}: cannot be the vehicle: it is a track",
    f"{FRF} --vehicle-fmu {VC}": f"{VC}: owns the contact springs; give one like {V}",
    f"stability --track-fmu {TC}": f"{TC}: owns the contact springs; give one like {T}",
    f"{RUN} .": ".: is a folder",
    f"{RUN} wordy.toml": "wordy.toml: is not an SSP but parameters",
    f"{RUN} {V}": f"{V}: is not an SSP but an FMU",
    "receptance . --input a --output b --out r.nc": ".: is a folder",
    # Options that exclude each other, or say nothing.
    f"{RUN} --vehicle-fmu {VC} --track-fmu {TC}": f"{VC} and {TC} both own the contact springs",
    f"{RUN} {PAIR} --contact vehicle": "--contact vehicle: with the FMUs given it must be track",
    f"{RUN} {PAIR} --scheme interface-jacobian": "--scheme interface-jacobian: the contact must be",
    f"{RUN} {PAIR} --scheme jacobi --first track": "--first track: jacobi has no first",
    f"{RUN} {PAIR} --scheme gauss-seidel --first me": "--first me: must be vehicle or track",
    f"{SSP} --first vehicle": "--first vehicle: jacobi has no first",
    f"{SSP} --scheme gauss-seidel --first me": "no component 'me'; there are vehicle, track",
    f"{SSP} --scheme interface-jacobian": "--scheme interface-jacobian: solves a law in the master",
    "run --out r.nc Plant.ssp --step 0.1 --time 1 --scheme picard": "a cannot go back",
    f"{FRF} --input wheelset[0].force_z": "excitation wheelset[0].force_z: must be irregularity_z",
    f"{FRF} --input wheelset[5].force_z": "or one of wheelset[1] to wheelset[4] with .force_z",
    f"{FRF} {PARTS} --input wheelset[5].force_z": "or one of wheelset[1] to wheelset[4] with",
    f"{FRF} --input wheelset[1].rail_force_z --rigid-track": "has no effect with --rigid-track",
    "map --out m.nc --input wheelset[4].force_z": "must be one of irregularity_z, vertical",
    "decay-rate --bands 100:inf": "--bands 100:inf: needs 10 <= lowest",
    f"critical-speed --vehicle-fmu {V} --set carbody.mass=2e4": "with --vehicle as well",
    f"{FRF} --input irregularity_z --uncoupled": "has no effect with --uncoupled",
    # Classes of track.
    "irregularity --class none --out p.csv": "'none': there are german-low",
    f"ride --class none --out r.nc {PARTS}": "'none': there are german-low",
    "advise --class x.csv": "'x.csv': there are german-low",
    f"{RUN} --irregularity foo": "--irregularity foo: must be none, german-low",
    f"{RUN} --irregularity ''": "the argument behind --irregularity is empty",
}


@pytest.fixture(scope="module")
def files(exported, tmp_path_factory):
    """A folder with FMUs, a system that cannot go back, and what is none of either."""
    folder = tmp_path_factory.mktemp("files")
    for path in [*exported.values(), exported["Vehicle"].with_name("Pair.ssp")]:
        (folder / path.name).symlink_to(path)
    (folder / "escape.toml").write_text('["\\u001b]0;pwn\\u0007"]\n')
    (folder / "wordy.toml").write_text(f'rail = "{"A" * 900_000}"\n')
    (folder / "binary.toml").write_bytes(bytes(range(256)))
    (folder / "negative.toml").write_text("[fastening]\nstiffness = -3e7\n")
    (folder / "still.csv").write_text("time,speed\n0,0\n10,0\n")
    (folder / "binary.fmu").write_bytes(bytes(range(256)))
    (folder / "empty.fmu").touch()
    elements = component("a", u="input", x="output")
    make_fmu(folder / "Plant.fmu")
    system = ssd(f"<ssd:Elements>{elements}</ssd:Elements>")
    pack(folder / "Plant.ssp", system, P__fmu=folder / "Plant.fmu")
    return folder


@pytest.mark.parametrize("command", MISTAKES)
def test_a_mistake_is_one_line_and_status_2(railcosim, files, monkeypatch, command):
    monkeypatch.chdir(files)
    monkeypatch.setattr("railcosim.analysis.pair.export_pair.export_pair", None)  # not even begun
    monkeypatch.setattr("railcosim.master.memory.available", lambda: 8e9)
    status, out, err = railcosim(*shlex.split(command))
    assert (status, out) == (2, "")
    *notes, said = err.splitlines()
    assert all(note.startswith("note: ") for note in notes)  # such as that the ring is short
    assert said.startswith("error: ")
    assert MISTAKES[command] in said
    assert len(said) < 2100
    assert said.isprintable()
    assert not list(files.glob("[rfmtpe].*"))  # nothing is written


def test_one_place_on_the_map_is_a_map(railcosim, files, tmp_path):
    parts = ["--vehicle-fmu", files / V, "--track-fmu", files / T]
    grid = ["--wavelengths", "10:10:1", "--speeds", "100:100:1"]
    status, out, err = railcosim("map", "--out", "m.nc", "--plot", "m.png", *parts, *grid)
    assert status == 0, err
    assert "m.nc: 1 wavelengths, 1 speeds" in out
    assert 0.0 < abs(load(tmp_path / "m.nc")["carbody.z"].values.item()) < 1.0  # above resonance


def test_a_response_that_is_not_known_is_refused(railcosim, files, tmp_path):
    """A step of 1 ps: nothing moves while 13,500 of them last."""
    pulses = ["--method", "pulses", "--step", 1e-12, "--frequencies", "1:9:1"]
    names = ["--input", "wheelset[4].left.force_z", "--output", "wheelset[4].left.wheel_z"]
    status, _, err = railcosim("receptance", files / V, "--out", "r.nc", *names, *pulses)
    assert status == 1
    assert "of itself only, so nothing is written; take another --method" in err
    assert not (tmp_path / "r.nc").exists()


def test_exhausted_memory_is_one_line_and_status_1(railcosim, monkeypatch):
    def exhausted(*_args, **_named):
        raise MemoryError("Unable to allocate 3 PiB")

    monkeypatch.setattr("railcosim.analysis.response.track_receptance.direct_receptance", exhausted)
    status, _, err = railcosim("track-receptance", "--out", "r.nc", "--frequencies", "1:1:1")
    assert status == 1
    assert err == "error: out of memory: ask for less at once (Unable to allocate 3 PiB)\n"
