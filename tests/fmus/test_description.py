"""What FMUs say of themselves: valid for FMI 2.0 and 3.0, and true of the models."""

import ctypes
import re
import shutil
import zipfile
from dataclasses import dataclass, replace
from itertools import product
from pathlib import Path

import fmpy
import numpy as np
import pytest
from fmpy.fmi2 import FMU2Model
from fmpy.fmi3 import FMU3Model
from lxml import etree

from railcosim.fmus.description import fmi2, fmi3
from railcosim.fmus.description.about import NATIVE, PYTHON, Description
from railcosim.fmus.description.build import build_description
from railcosim.fmus.description.kind import KINDS
from railcosim.fmus.description.structure import states_of
from railcosim.fmus.description.terminals import terminals, terminals_and_icons
from railcosim.fmus.description.units import DISPLAY_UNITS
from railcosim.fmus.export import NativeRuntime
from railcosim.fmus.interface import Start, interface
from railcosim.fmus.python_runtime.models import Model
from railcosim.fmus.start import contact_defaults
from railcosim.mechanics.modal import ModalBody
from railcosim.mechanics.ports import FORCE, Layout
from railcosim.mechanics.stepping import State
from railcosim.vehicle.files import read_stock
from railcosim.vehicle.modal import vehicle_body
from railcosim.vehicle.multibody import SPATIAL, VERTICAL, build_multibody
from railcosim.vehicle.parameters import Vehicle

from ..fmpy_problems import problems_of

SCHEMAS = Path(fmpy.__file__).parent / "schema"
LOAD = Vehicle().wheel_load
OURS = ["Vehicle", "Track"]
# Three wheelsets hold a bogie of it, so at rest its loads depend on their heights.
LOCOMOTIVE = read_stock(Path(__file__).parents[2] / "examples" / "locomotive.toml")
SPRUNG = [*OURS, "Locomotive"]
STATEFUL = [*SPRUNG, "Spatial"]
NAMES = [*STATEFUL, *(f"{name}WithContact" for name in SPRUNG)]
SOURCES = ["fmi2.c", "motion.c"]
POSITIONS = [18.5125, 16.0125, 2.8125, 0.3125]
BLOCKS = ["mode.re", "mode.im", "rigid.z", "rigid.v"]


@dataclass
class Subject:
    """One FMU's description, and the Python model it must be true of."""

    name: str
    body: ModalBody

    @property
    def kind(self):
        return KINDS["track" if self.name.startswith("Track") else "vehicle"]

    @property
    def table(self):
        body, n = self.body, self.body.layout.wheelsets
        down = body.preload.reshape(body.layout.contacts, -1)[:, 0]
        loads = down.tolist() if body.coordinates else [LOAD] * 8
        start = Start(
            loads=loads,
            positions=POSITIONS if n == 4 else list(range(5 * n, 0, -5)),
            contact=contact_defaults(Vehicle()),
        )
        return interface(self.body, start, with_contact=self.name.endswith("Contact"))

    @property
    def states(self):
        return states_of(self.body) if self.name in STATEFUL else None

    @property
    def about(self):
        return Description(
            name=self.name, guid="{1}", version="1", text="A model.", capabilities=NATIVE
        )

    def xml(self, fmi):
        if fmi == 2:
            return fmi2.model_description(self.about, self.table, self.states, SOURCES)
        return fmi3.model_description(self.about, self.table, self.states)

    def write(self, folder, fmi):
        """An FMU without binaries."""
        path = folder / f"{self.name}.fmu"
        with zipfile.ZipFile(path, "w") as archive:
            archive.writestr("modelDescription.xml", self.xml(fmi))
            archive.writestr("sources/buildDescription.xml", build_description("M", SOURCES))
        return str(path)


@pytest.fixture(scope="module")
def few_modes(short_reduced):
    """The track with its first even and odd modes only: enough for what does not depend on n."""
    body = short_reduced.under(Layout())
    kept = np.r_[:14, body.even : body.even + 12]
    shapes = replace(
        body.shapes, table=body.shapes.table[..., kept], mu=body.shapes.mu[kept],
        # Partners that were left out: each mode its own, which is a model all the same.
        partner=np.arange(kept.size),
    )  # fmt: skip
    poles = np.concatenate([body.poles[kept], body.poles[-8:]])
    return replace(body, poles=poles, even=14, shapes=shapes)


def subject_of(name, few_modes):
    if name.startswith("Track"):
        return Subject(name, few_modes)
    stock = LOCOMOTIVE if name.startswith("Locomotive") else Vehicle()
    model = SPATIAL if name == "Spatial" else VERTICAL
    return Subject(name, vehicle_body(build_multibody(stock, model)))


@pytest.fixture
def subject(request, few_modes):
    return subject_of(request.param, few_modes)


each = pytest.mark.parametrize("subject", NAMES, indirect=True)
stateful = pytest.mark.parametrize("subject", STATEFUL, indirect=True)
versions = pytest.mark.parametrize("fmi", [2, 3])


def assert_valid(xml, schema):
    etree.XMLSchema(etree.parse(SCHEMAS / schema)).assertValid(etree.fromstring(xml))


# --- form -------------------------------------------------------------------------------------


@each
@versions
def test_the_description_follows_the_schema(subject, fmi):
    assert_valid(subject.xml(fmi), f"fmi{fmi}/fmi{fmi}ModelDescription.xsd")


@each
@versions
def test_fmpy_finds_no_problem_in_the_description(subject, fmi, tmp_path):
    assert problems_of(subject.write(tmp_path, fmi)) == []


@each
def test_terminals_follow_the_schema(subject):
    xml = terminals_and_icons(subject.table, below=subject.kind.terminals_below)
    assert_valid(xml, "fmi3/fmi3TerminalsAndIcons.xsd")


def test_the_build_description_follows_the_schema(tmp_path):
    assert_valid(build_description("Track", SOURCES), "fmi3/fmi3BuildDescription.xsd")


@each
def test_the_build_description_is_what_fmpy_reads(subject, tmp_path):
    read = fmpy.read_model_description(subject.write(tmp_path, 3)).buildConfigurations
    assert read[0].modelIdentifier == "M"
    assert read[0].sourceFileSets[0].sourceFiles == SOURCES


@each
@versions
def test_variables_are_those_of_the_table(subject, fmi, tmp_path):
    read = fmpy.read_model_description(subject.write(tmp_path, fmi)).modelVariables
    first = int(fmi == 3)  # where OMSimulator takes references for numbers from 1 on
    for reference, (v, there) in enumerate(zip(subject.table, read, strict=False), start=first):
        assert (there.name, there.valueReference) == (v.name, reference)
        assert (there.causality, there.variability) == (v.causality, v.variability)
        assert (there.unit or "") == v.unit
        assert (there.displayUnit or "") == v.display_unit
        if v.start is not None and v.type != "Boolean":
            assert float(there.start) == v.start
        assert there.type == (fmi3.TYPES[v.type] if fmi == 3 else v.type)


@each
def test_starts_lie_within_ranges_and_nominal_values_are_positive(subject):
    for v in subject.table:
        if v.start is not None:
            assert v.minimum is None or v.minimum <= v.start, v.name
            assert v.maximum is None or v.start <= v.maximum, v.name
        assert v.nominal > 0, v.name


def test_display_units_are_right():
    """Held against their names: a prefix and the unit (Pa for N/m2), or km/h."""
    prefixes = {"m": 1e-3, "k": 1e3, "M": 1e6, "G": 1e9}
    for unit, shown in DISPLAY_UNITS.items():
        for name, factor in shown.items():
            size = (
                1 / 3.6 if name == "km/h" else prefixes[name.removesuffix(unit).removesuffix("Pa")]
            )
            assert factor == pytest.approx(1 / size, rel=1e-15)  # one rounding


@pytest.mark.parametrize("subject", ["Track"], indirect=True)
def test_capabilities_are_said(subject, tmp_path):
    native = fmpy.read_model_description(subject.write(tmp_path, 2))
    assert native.coSimulation.providesDirectionalDerivative
    assert native.coSimulation.canInterpolateInputs
    assert native.coSimulation.maxOutputDerivativeOrder == 1
    assert native.modelExchange.providesDirectionalDerivative
    assert not native.coSimulation.needsExecutionTool
    about = replace(subject.about, capabilities=PYTHON)
    read = etree.fromstring(fmi2.model_description(about, subject.table))
    assert read.find("ModelExchange") is None
    assert read.find("CoSimulation").get("needsExecutionTool") == "true"
    assert read.find("CoSimulation").get("providesDirectionalDerivative") == "false"


@stateful
def test_states_are_counted_alike_in_both_versions(subject, tmp_path):
    scalars = fmpy.read_model_description(subject.write(tmp_path, 2))
    arrays = fmpy.read_model_description(subject.write(tmp_path, 3))
    sizes = [(v.variable.derivative.name, v.variable.dimensions) for v in arrays.derivatives]
    counted = [(name, k) for name, dims in sizes for k in range(1, int(dims[0].start) + 1)]
    names = [u.variable.derivative.name for u in scalars.derivatives]
    assert names == [f"{name}[{k}]" for name, k in counted]
    references = [u.variable.derivative.valueReference for u in scalars.derivatives]
    assert references == list(range(2**16, 2**16 + len(names)))
    assert [u.variable.valueReference - 2**24 for u in arrays.derivatives] == [
        u.variable.derivative.valueReference - 2**16 for u in arrays.derivatives
    ]


# --- truth of the dependencies ----------------------------------------------------------------


class Machine:
    """The Python model: values of inputs, parameters, time and states to unknowns."""

    def __init__(self, subject):
        self.table = subject.table
        self.inputs = [v.name for v in self.table if v.causality == "input"]
        self.outputs = [v.name for v in self.table if v.causality == "output"]
        self.model = Model(subject.body, [v.slot for v in self.table])
        self.shows_states = subject.states is not None

    def start(self):
        """Values of all knowns but states; wheels pressed by about 0.1 mm."""
        pressed = {"rail_z": -1e-4, "wheel_z": 1.5e-3}
        known = {v.name: v.start for v in self.table if v.start is not None}
        known |= {n: pressed[n.split(".")[-1]] for n in known if n.split(".")[-1] in pressed}
        if "wheelset[1].position" in self.inputs:  # unequal left and right: odd modes take part
            known |= {n: 1.1 * x for n, x in known.items() if n.endswith("left.force_z")}
        return known | {"time": 0.3}

    def prepare(self, known):
        self.model.configure(
            {
                (v.role, v.index): float(known[v.name])
                for v in self.table
                if v.causality == "parameter"
            }
        )
        return self.model.read(np.array([known[name] for name in self.inputs]))

    def unknowns(self, known, state):
        """Outputs and derivatives, of a State."""
        now = self.prepare(known)
        y = np.empty(len(self.outputs))
        gone = self.model.speed(np.array([known[name] for name in self.inputs])) * known["time"]
        self.model.write(state, now, gone, y)
        found = dict(zip(self.outputs, y, strict=True))
        if not self.shows_states:
            return found
        body, met = self.model.body, self.model.body.at(now.position)
        force = self.model.mover.forces.at(met, state, now.load)
        drive = met.drive(force - body.preload)
        rates = State(body.poles * state.s + drive.s, state.v, drive.r)
        return found | {f"der({name})": value for name, value in scalars(rates).items()}

    def at_rest(self, known):
        """The same and the states, in initialisation."""
        state = self.model.rest(self.prepare(known))
        found = scalars(state) if self.shows_states else {}
        return found | self.unknowns(known, state)


def scalars(state):
    parts = dict(zip(BLOCKS, (state.s.real, state.s.imag, state.r, state.v), strict=True))
    return {f"{name}[{k}]": x for name, part in parts.items() for k, x in enumerate(part, 1)}


def random_state(body, subject, seed=1):
    random = np.random.default_rng(seed)
    n, m = body.poles.size, subject.body.rigid_out.shape[1]
    s = random.normal(size=n) + 1j * random.normal(size=n)
    return State(1e-3 * s, 1e-3 * random.normal(size=m), 1e-3 * random.normal(size=m))


def unit_states(body, subject):
    """Each state alone; FMI's name of it."""
    zero = random_state(body, subject)
    zero = State(0 * zero.s, 0 * zero.r, 0 * zero.v)
    for k in range(zero.s.size):
        for name, value in (("mode.re", 1.0), ("mode.im", 1j)):
            state = zero.copy()
            state.s[k] = value
            yield f"{name}[{k + 1}]", state
    for k in range(zero.r.size):
        for name in ("z", "v"):
            state = zero.copy()
            (state.r if name == "z" else state.v)[k] = 1.0
            yield f"rigid.{name}[{k + 1}]", state


def changed(known, name):
    """All knowns, with one of them otherwise by a good part of its size."""
    value = known[name]
    other = (not value) if isinstance(value, bool) else 1.1 * value + 1e-5
    return known | {name: other + 0.13 if name.endswith("position") else other}


def compare(table, before, after, states=None):
    """Unknowns that differ at all, and those that differ by more than rounding does."""
    nominal = {v.name: v.nominal for v in table}
    for block in states.blocks if states else ():
        size = {f"{block.name}[{k}]": block.nominal for k in range(1, block.size + 1)}
        # A mode changes with up to |lambda| = 4e4 rad/s.
        nominal |= size | {f"der({name})": 4e4 * value for name, value in size.items()}
    # Sums of 60 terms that cancel leave 1e-14 of the largest; 1e-12 is clear of it, and changes
    # of a tenth in a known are far above.
    differ = {n for n in before if after[n] != before[n]}
    clearly = {n for n in before if abs(after[n] - before[n]) > 1e-12 * nominal[n]}
    return differ, clearly


def declared(read, kind):
    """Unknown to the names of what it depends on; `kind` as FMPy names the lists."""
    return {u.variable.name: {d.name for d in u.dependencies} for u in getattr(read, kind)}


def as_pairs(dependencies, knowns):
    return {(u, d) for u, names in dependencies.items() for d in names if d in knowns}


def contact_laws(machine):
    """Starts with the nonlinear law and the linear one: each has its own parameter."""
    start = machine.start()
    if "contact.nonlinear" not in start:
        return [start]
    return [start | {"contact.nonlinear": nonlinear} for nonlinear in (True, False)]


@each
def test_outputs_and_derivatives_depend_on_knowns_as_declared(subject, tmp_path):
    """What changes clearly is declared; what is declared does change."""
    machine = Machine(subject)
    read = fmpy.read_model_description(subject.write(tmp_path, 3))
    outputs = declared(read, "outputs")
    if subject.states:
        scalar = fmpy.read_model_description(subject.write(tmp_path, 2))
        outputs |= declared(scalar, "derivatives")
    one = random_state(machine.model.body, subject)
    # Opposite motions: a wheel that leaves its rail in one, which no motion of the rail then
    # changes, is pressed on it in the other. (Which it is lies with the phases of modes, LAPACK's.)
    states = (one, State(-one.s, -one.r, -one.v))
    any_change, clear_change = set(), set()
    for start, state in product(contact_laws(machine), states):
        before = machine.unknowns(start, state)
        for name in start:
            after = machine.unknowns(changed(start, name), state)
            differ, clearly = compare(subject.table, before, after, subject.states)
            any_change |= {(u, name) for u in differ}
            clear_change |= {(u, name) for u in clearly}
    told = as_pairs(outputs, start)
    assert clear_change <= told, clear_change - told
    unnoticed = {pair for pair in told - any_change if not pair[0].startswith("der(")}
    assert not unnoticed
    # Of overdamped modes rounding leaves imaginary parts of 1e-18, and of a sway a yaw of axles,
    # lost in what is there already.
    body, forces = machine.model.body, subject.body.layout.names(FORCE)
    for unknown, name in told - any_change:
        k = int(re.findall(r"\d+", unknown)[0]) - 1
        into = body.at(np.array(POSITIONS)).into[:, k]
        driven = into[forces.index(name) % into.size]
        part = driven.real if ".re[" in unknown else driven.imag
        assert abs(part) < 1e-12 * np.abs(into).max(), (unknown, name)


@stateful
def test_outputs_and_derivatives_depend_on_states_as_declared(subject, tmp_path):
    """From rest without forces a single state shows what it reaches, exactly."""
    machine = Machine(subject)
    read = fmpy.read_model_description(subject.write(tmp_path, 2))
    told = declared(read, "outputs") | declared(read, "derivatives")
    still = dict(zip(subject.body.layout.names(FORCE), subject.body.preload, strict=True))
    start = machine.start() | still
    found, names = set(), set()
    for name, state in unit_states(machine.model.body, subject):
        unknowns = machine.unknowns(start, state)
        positions = {u for u in unknowns if u.endswith("position")}
        found |= {(u, name) for u in set(unknowns) - positions if unknowns[u] != 0}
        names.add(name)
    # What nothing damps decays by rounding, or not at all: that lies with a machine's eigenvalues.
    undamped = {
        (f"der({name})", name)
        for k, pole in enumerate(machine.model.body.poles, 1)
        for name in (f"mode.re[{k}]", f"mode.im[{k}]")
        if pole.real == 0
    }
    assert found == as_pairs(told, names) - undamped


@each
@versions
def test_what_is_at_rest_depends_on_knowns_as_declared(subject, fmi, tmp_path):
    """What changes clearly is declared; what is declared does change."""
    machine = Machine(subject)
    read = fmpy.read_model_description(subject.write(tmp_path, fmi))
    any_change, clear_change = set(), set()
    for start in contact_laws(machine):
        before = machine.at_rest(start)
        for name in start:
            after = machine.at_rest(changed(start, name))
            differ, clearly = compare(subject.table, before, after, subject.states)
            any_change |= {(u, name) for u in differ}
            clear_change |= {(u, name) for u in clearly}
    told = as_pairs(declared(read, "initialUnknowns"), start)
    if fmi == 3:  # arrays as wholes
        any_change, clear_change = (
            {(re.sub(r"((mode|rigid)\.\w+)\[\d+\]", r"\1", u), n) for u, n in pairs}
            for pairs in (any_change, clear_change)
        )
    assert clear_change <= told, clear_change - told
    assert told <= any_change, told - any_change


@stateful
def test_arrays_depend_on_what_their_elements_depend_on(subject, tmp_path):
    scalar = fmpy.read_model_description(subject.write(tmp_path, 2))
    array = fmpy.read_model_description(subject.write(tmp_path, 3))

    def whole(name):
        return re.sub(r"((mode|rigid)\.\w+)\[\d+\]", r"\1", name)

    parameters = {v.name for v in subject.table if v.causality == "parameter"}
    for kind in ("outputs", "derivatives", "initialUnknowns"):
        merged = {}
        for unknown, names in declared(scalar, kind).items():
            merged.setdefault(whole(unknown), set()).update(map(whole, names))
        # FMI 2.0 does not count parameters among the knowns after initialisation.
        beyond = parameters if kind != "initialUnknowns" else set()
        assert {u: n - beyond for u, n in declared(array, kind).items()} == merged


@pytest.mark.parametrize("subject", ["Vehicle"], indirect=True)
def test_overdamped_modes_show_their_real_part_only(subject):
    real = {int(k) for k in np.flatnonzero(subject.body.poles.imag == 0)}
    assert real  # the bogies' pitch, by the paper's dampers
    for elements in subject.states.outputs.values():
        assert not real & {int(k) for k in elements["mode.im"]}


# --- terminals --------------------------------------------------------------------------------


@pytest.mark.parametrize(
    "names", [("Vehicle", "TrackWithContact"), ("VehicleWithContact", "Track")]
)
def test_terminals_of_vehicle_and_track_fit_together(few_modes, names):
    """Members of one name: one gives, one takes, in one unit; enough to couple the two."""
    both = []
    for name in names:
        table = {v.name: v for v in subject_of(name, few_modes).table}
        found = terminals(list(table.values()))
        both.append(
            {t: {m.name: table[m.variable] for m in members} for t, members in found.items()}
        )
    vehicle, track = both
    assert list(vehicle) == list(track)
    assert len(vehicle) == 8
    for terminal in vehicle:
        shared = set(vehicle[terminal]) & set(track[terminal])
        force = {"force_z", "wheel_z" if names[0] == "Vehicle" else "rail_z"}
        assert shared >= force | {"position"}
        for member in shared - {"rail_vz", "wheel_vz"}:
            ends = vehicle[terminal][member], track[terminal][member]
            assert {v.causality for v in ends} == {"input", "output"}, member
            assert ends[0].unit == ends[1].unit


@each
def test_a_wheels_variables_are_in_its_terminal(subject):
    members = {m.variable for t in terminals(subject.table).values() for m in t}
    of_wheels = {
        v.name for v in subject.table
        if re.search(r"left|right|position$", v.name) and v.causality != "parameter"
    }  # fmt: skip
    assert members == of_wheels


# --- truth of the native FMUs -----------------------------------------------------------------


@pytest.fixture
def exchanged(request, exported):
    """A native FMU for Model Exchange in initialisation mode, and its description."""
    path = str(exported[request.param])
    read = fmpy.read_model_description(path)
    folder = fmpy.extract(path)
    fmu = FMU2Model(
        guid=read.guid, unzipDirectory=folder, modelIdentifier=request.param, instanceName="it"
    )
    fmu.instantiate()
    fmu.setupExperiment(startTime=0.3)
    fmu.enterInitializationMode()
    for v in read.modelVariables:
        if v.causality == "input" and "left" in v.name:  # unequal: odd modes take part
            fmu.setReal([v.valueReference], [1.1 * float(v.start)])
    yield fmu, read
    fmu.freeInstance()
    shutil.rmtree(folder)


def directional(fmu, unknowns, knowns):
    """Pairs with a derivative that is not zero, and those where it is more than rounding."""
    some, clear = set(), set()
    for known in knowns:
        sizes = fmu.getDirectionalDerivative(
            [u.valueReference for u in unknowns], [known.valueReference], [1.0]
        )
        for unknown, value in zip(unknowns, sizes, strict=True):
            if value != 0:
                some.add((unknown.name, known.name))
                # Sums over up to 4000 terms that cancel: 1e-14 of the largest. See `compare`.
                rate = 4e4 if unknown.name.startswith("der(") else 1.0
                if abs(value) * size_of(known) > 1e-12 * size_of(unknown) * rate:
                    clear.add((unknown.name, known.name))
    return some, clear


def size_of(variable):
    return float((variable.derivative or variable).nominal or 1.0)


def told_of(unknowns, knowns):
    names = {v.name for v in knowns}
    return {(u.variable.name, d.name) for u in unknowns for d in u.dependencies if d.name in names}


native = pytest.mark.parametrize("exchanged", OURS, indirect=True)


@native
def test_directional_derivatives_are_zero_where_nothing_is_declared(exchanged):
    fmu, read = exchanged
    fmu.exitInitializationMode()
    fmu.enterContinuousTimeMode()
    states = [u.variable.derivative for u in read.derivatives]
    x = 1e-3 * np.random.default_rng(1).normal(size=len(states))
    fmu.setContinuousStates((ctypes.c_double * x.size)(*x), x.size)
    inputs = [v for v in read.modelVariables if v.causality == "input"]
    # Some hundred of the states, and the last ones, which are the wheels' own or rigid.
    knowns = inputs + states[:: 1 + len(states) // 200] + states[-20:]
    rows = read.outputs + read.derivatives
    some, clear = directional(fmu, [u.variable for u in rows], knowns)
    told = told_of(rows, knowns)
    assert clear <= told, clear - told
    assert told <= some, told - some


@native
def test_directional_derivatives_at_rest_are_zero_where_nothing_is_declared(exchanged):
    fmu, read = exchanged
    inputs = [v for v in read.modelVariables if v.causality == "input"]
    rows = read.initialUnknowns
    some, clear = directional(fmu, [u.variable for u in rows], inputs)
    told = told_of(rows, inputs)
    assert clear <= told, clear - told
    assert told <= some, told - some


@pytest.mark.parametrize("name", OURS)
def test_directional_derivatives_of_arrays_are_zero_where_nothing_is_declared(
    name, packed_by, tmp_path
):
    """FMI 3.0: whole variables, along random seeds."""
    path = packed_by(NativeRuntime(fmi=3, documented=False))[name]
    read = fmpy.read_model_description(path)
    fmpy.extract(path, tmp_path)
    fmu = FMU3Model(
        guid=read.guid, unzipDirectory=str(tmp_path), modelIdentifier=name, instanceName="it"
    )
    random = np.random.default_rng(1)
    fmu.instantiate()
    fmu.enterInitializationMode(startTime=0.3)
    inputs = [v for v in read.modelVariables if v.causality == "input"]
    for v in inputs:
        if "left" in v.name:  # unequal: odd modes take part
            fmu.setFloat64([v.valueReference], [1.1 * float(v.start)])

    def found(unknowns, knowns):
        some, clear = set(), set()
        for known in knowns:
            seed = random.normal(size=extent(known)) * size_of(known)
            for unknown in unknowns:
                d = fmu.getDirectionalDerivative(
                    [unknown.valueReference], [known.valueReference], seed, extent(unknown)
                )
                # As for FMI 2.0 above.
                rate = 4e4 if unknown.name.startswith("der(") else 1.0
                if np.any(d):
                    some.add((unknown.name, known.name))
                if np.abs(d).max() > 1e-12 * size_of(unknown) * rate:
                    clear.add((unknown.name, known.name))
        return some, clear

    def extent(variable):
        return int(variable.dimensions[0].start) if variable.dimensions else 1

    def check(rows, knowns):
        some, clear = found([u.variable for u in rows], knowns)
        told = told_of(rows, knowns)
        assert clear <= told, clear - told
        assert told <= some, told - some

    check(read.initialUnknowns, inputs)
    fmu.exitInitializationMode()
    fmu.enterContinuousTimeMode()
    states = [u.variable.derivative for u in read.derivatives]
    n = sum(map(extent, states))
    fmu.setContinuousStates((ctypes.c_double * n)(*(1e-3 * random.normal(size=n))), n)
    check(read.outputs + read.derivatives, inputs + states)
    fmu.freeInstance()
