"""A thousand random lives of the native FMUs: whatever is repeated after a restore gives the same
bits, in the same instance and in another one that read the state from bytes.
"""

from dataclasses import dataclass, field

import fmpy
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from railcosim.fmus.export import NativeRuntime

SEQUENCES = 125  # for each of four FMUs and two versions of FMI
# m: of inputs that start at 0, heights at which the contacts inside carry some load.
PRESSED = {"wheel_z": 1e-3, "rail_z": -1e-4}
SLOTS = st.integers(0, 1)
OPERATIONS = st.lists(
    st.one_of(
        st.tuples(st.just("set"), st.integers(0, 2**32 - 1)),
        st.tuples(st.just("step"), st.floats(1e-6, 2e-3)),
        st.tuples(st.just("hold"), st.integers(0, 2)),
        st.tuples(st.just("save"), SLOTS),
        st.tuples(st.just("repeat"), SLOTS),
        st.tuples(st.just("back"), SLOTS),
        st.tuples(st.just("move"), st.just(0)),
    ),
    min_size=10,
    max_size=30,
)


class Instance:
    """One instance through FMPy, the same calls for FMI 2 and 3."""

    def __init__(self, description, folder):
        self.fmu = fmpy.instantiate_fmu(folder, description, "CoSimulation")
        self.is_3 = description.fmiVersion.startswith("3")
        variables = description.modelVariables
        self.inputs = [v for v in variables if v.causality == "input"]
        self.around = np.array(
            [PRESSED.get(v.name.split(".")[-1], float(v.start)) for v in self.inputs]
        )
        # Wheels by up to a metre, loads by a few per cent of their nominal size.
        self.spread = np.array(
            [1.0 if v.name.endswith("position") else 0.03 * float(v.nominal) for v in self.inputs]
        )
        self.input_references = [v.valueReference for v in self.inputs]
        outputs = {u.variable.valueReference for u in description.outputs}
        self.outputs = sorted(outputs)
        (self.hold,) = [v.valueReference for v in variables if v.name == "input_hold"]
        self.time = 0.0

    def begin(self):
        self.fmu.reset()
        if not self.is_3:
            self.fmu.setupExperiment(startTime=0.0)
        self.fmu.enterInitializationMode()
        self.fmu.exitInitializationMode()
        self.time = 0.0

    def do(self, operation):
        """Carry it out; the bits of all outputs after it."""
        kind, value = operation
        if kind == "set":
            part = np.random.default_rng(value).uniform(-1, 1, self.around.size)
            u = list(self.around + part * self.spread)
            (self.fmu.setFloat64 if self.is_3 else self.fmu.setReal)(self.input_references, u)
        elif kind == "step":
            self.fmu.doStep(self.time, value)
            self.time += value
        else:
            (self.fmu.setInt32 if self.is_3 else self.fmu.setInteger)([self.hold], [value])
        get = self.fmu.getFloat64 if self.is_3 else self.fmu.getReal
        return np.array(get(self.outputs)).tobytes()


@dataclass
class Life:
    """What was done since the beginning, and snapshots with what was done until then."""

    here: Instance
    there: Instance
    done: list = field(default_factory=list)  # (operation, outputs after it)
    saved: dict = field(default_factory=dict)  # slot: (state as bytes, state, owner, time, done)
    repeated: int = 0  # operations

    def do(self, operation):
        kind, value = operation
        if kind in {"set", "step", "hold"}:
            self.done.append((operation, self.here.do(operation)))
        elif kind == "save":
            self._save(value)
        elif kind == "move":
            self._save("moving")
            self.here, self.there = self.there, self.here
            self._return("moving")
        elif value in self.saved:
            done = self._return(value)
            since = self.done[len(done) :] if self.done[: len(done)] == done else []
            self.done = done
            if kind == "repeat":
                for each, expected in since:
                    self.do(each)
                    assert self.done[-1][1] == expected
                    self.repeated += 1

    def _save(self, slot):
        self._drop(slot)
        state = self.here.fmu.getFMUState()
        data = self.here.fmu.serializeFMUState(state)
        self.saved[slot] = (data, state, self.here, self.here.time, list(self.done))

    def _return(self, slot):
        """Restore, in another instance by the bytes; what was done until then."""
        data, state, owner, self.here.time, done = self.saved[slot]
        fmu = self.here.fmu
        if owner is self.here:
            fmu.setFMUState(state)
        else:
            read = fmu.deserializeFMUState(data)
            fmu.setFMUState(read)
            fmu.freeFMUState(read)
        return list(done)

    def _drop(self, slot):
        if slot in self.saved:
            _, state, owner, _, _ = self.saved.pop(slot)
            owner.fmu.freeFMUState(state)

    def end(self):
        for slot in list(self.saved):
            self._drop(slot)


@pytest.fixture(scope="module", params=[2, 3])
def instances(request, tmp_path_factory, packed_by):
    """Two instances of every FMU, by name."""
    folder = tmp_path_factory.mktemp("random")
    made = {}
    for name, path in packed_by(NativeRuntime(fmi=request.param, documented=False)).items():
        description = fmpy.read_model_description(str(path))
        unpacked = fmpy.extract(str(path), unzipdir=str(folder / name))
        made[name] = [Instance(description, unpacked) for _ in range(2)]
    yield made
    for pair in made.values():
        for one in pair:
            one.fmu.terminate()
            one.fmu.freeInstance()


@pytest.mark.parametrize("name", ["Vehicle", "Track", "VehicleWithContact", "TrackWithContact"])
def test_repeats_give_the_same_bits(instances, name):
    seen = {"repeated": 0, "moved": 0, "distinct": set()}

    @settings(max_examples=SEQUENCES)
    @given(OPERATIONS)
    def run(operations):
        here, there = instances[name]
        here.begin()
        there.begin()
        life = Life(here, there)
        # Every life has something to go back to, and does so at its end.
        for operation in [("save", 0), *operations, ("repeat", 0), ("repeat", 1)]:
            life.do(operation)
            seen["moved"] += operation[0] == "move"
        seen["repeated"] += life.repeated
        seen["distinct"] |= {outputs for _, outputs in life.done}
        life.end()

    run()
    # It did what it is for, and not always the same.
    print(seen["repeated"], seen["moved"], len(seen["distinct"]))
    assert seen["repeated"] > SEQUENCES
    assert seen["moved"] > SEQUENCES / 4
    assert len(seen["distinct"]) > SEQUENCES / 4
