"""The native runtime under AddressSanitizer and UndefinedBehaviorSanitizer: used as it should not.

Each time the right status, a sentence in the log, and nothing lost: a twin that never saw the bad
call goes on with the same bits. A leak or a crash fails the test by the process's exit.
"""

import subprocess

import pytest

STEP = 1e-3
ROLLING = ["SpatialVehicleWithContact", "SpatialTrackWithContact"]
NAMES = ["Vehicle", "Track", "VehicleWithContact", "TrackWithContact", *ROLLING]
NO_SUCH = 4_000_000_000  # a reference
FIRST_STATE, FIRST_DERIVATIVE = 2**16, 2**24


def ok(reply):
    assert reply.status == "OK", reply
    return reply


def refused(reply, *parts):
    """An error, and a sentence that holds these parts."""
    assert reply.status == "Error", reply
    assert len(reply.log) == 1, reply
    assert reply.log[0].startswith("Error "), reply
    for part in parts:
        assert str(part) in reply.log[0]


refused_saying = refused


@pytest.fixture
def victim(driver, tiny, fmi, use):
    """Makes an instance after one step, to be maltreated; at the end it and a twin go on alike."""
    made = []

    def make(name, hold=0):
        pair = [use(driver, tiny[name], fmi) for _ in range(2)]
        for one in pair:
            ok(one("set_integer", one.ref("input_hold"), hold))
            one.initialise()
            one.move(1)
            ok(one("step", 0.0, STEP))
        made.append(pair)
        return pair[0]

    yield make
    for one, twin in made:
        for k in (2, 3):
            for each in (one, twin):
                each.move(k)
                # From another time, if the test has made steps: a warning, no more.
                assert each("step", k * STEP, STEP).status != "Error"
            assert one.outputs() == twin.outputs()


@pytest.mark.slow  # programs that err on purpose are compiled, one by one
def test_the_sanitizers_see(sanitized, tiny, use):
    """The tests of this file can fail: FMI 2 does not say how many values there is room for."""
    fmu = tiny["Track"]
    commands = f"new 0 cs {fmu.guid} {fmu.where(2)} 0\nenter 0 0\nexit 0\nget 0 0 1 2 3 4\n"
    told = subprocess.run(sanitized(2), input=commands, capture_output=True, text=True, check=False)
    assert told.returncode != 0
    assert "heap-buffer-overflow" in told.stderr
    leaking = f"new 0 cs {fmu.guid} {fmu.where(2)} 0\n" * 2  # the first is forgotten
    told = subprocess.run(sanitized(2), input=leaking, capture_output=True, text=True, check=False)
    assert told.returncode != 0
    assert "LeakSanitizer" in told.stderr


# --- calls out of order -----------------------------------------------------------------------

CO_SIMULATION = {
    "new": ["exit", "step 0 1e-3", "terminate", "output_derivatives 1 20", "directional 0 0 0 0"],
    "entered": ["enter 0", "step 0 1e-3", "terminate", "output_derivatives 1 20"],
    "running": ["enter 0", "exit"],
    "terminated": ["enter 0", "exit", "step 0 1e-3", "terminate", "set 1 1 5"],
}
EXCHANGE = ["time 0", "event", "discrete", "continuous", "completed", "get_states 4", "rates 4"]


def bring(one, phase):
    if phase != "new":
        ok(one("enter", 0.0))
    if phase in {"running", "terminated"}:
        ok(one("exit"))
    if phase == "terminated":
        ok(one("terminate"))


@pytest.mark.parametrize("phase", CO_SIMULATION)
def test_calls_out_of_order(driver, tiny, fmi, use, phase):
    one = use(driver, tiny["Track"], fmi)
    bring(one, phase)
    for command in CO_SIMULATION[phase] + EXCHANGE + ["set_states 1 2"]:
        refused(one(*command.split()))
    ok(one("reset"))
    one.initialise()
    ok(one("step", 0, STEP))


@pytest.mark.parametrize("phase", ["new", "entered", "event", "continuous", "terminated"])
def test_calls_of_model_exchange_out_of_order(driver, tiny, fmi, use, phase):
    fmu = tiny["Vehicle"]
    n, x = fmu.states, ["0"] * fmu.states
    one = use(driver, fmu, fmi, "me")
    if phase in {"event", "continuous"}:
        one.initialise()
        ok(one("discrete"))
    else:
        bring(one, phase)
    if phase == "continuous":
        ok(one("continuous"))
    allowed = {
        "new": [], "entered": [], "terminated": [],
        "event": ["time", "event", "continuous", "discrete"],
        "continuous": ["time", "event", "completed", "set_states"],
    }[phase]  # fmt: skip
    calls = [("time", 0.5), ("event",), ("continuous",), ("discrete",), ("completed",),
             ("set_states", *x)]  # fmt: skip
    for call in calls:
        if call[0] not in allowed:
            refused(one(*call))
    refused(one("step", 0.0, STEP))
    ok(one("reset"))
    one.initialise()
    ok(one("get_states", n))


def test_model_exchange_needs_forces_from_outside(driver, tiny, fmi):
    fmu = tiny["TrackWithContact"]
    reply = driver("new", 0, "me", fmu.guid, fmu.where(fmi), 0)
    assert reply.status == "NULL"
    assert "co-simulation only" in reply.log[0]


# --- who, and where ---------------------------------------------------------------------------


@pytest.mark.parametrize("guid", ["{0}", "-"])
def test_a_wrong_guid(driver, tiny, fmi, guid):
    fmu = tiny["Track"]
    reply = driver("new", 0, "cs", guid, fmu.where(fmi), 0)
    assert reply.status == "NULL"
    assert fmu.guid in reply.log[0]


@pytest.mark.parametrize(
    "where", ["-", "", "elsewhere", "file://", "file:relative%2", "http://x/y"]
)
def test_resources_that_are_not_there(driver, tiny, fmi, where, tmp_path):
    where = where.replace("elsewhere", tmp_path.as_uri() if fmi == 2 else f"{tmp_path}/")
    reply = driver("new", 0, "cs", tiny["Track"].guid, where or "%", 0)
    assert reply.status == "NULL"
    (sentence,) = reply.log
    assert "resource" in sentence or "model.bin" in sentence


def test_a_place_with_signs_in_its_name(driver, tiny, fmi, tmp_path):
    """Blanks, percent and other signs, umlauts: in a URI they are coded."""
    fmu = tiny["Track"]
    folder = tmp_path / "100%_ä#(+)é"
    folder.mkdir()
    (folder / "model.bin").write_bytes((fmu.resources / "model.bin").read_bytes())
    where = folder.as_uri() if fmi == 2 else f"{folder}/"
    ok(driver("new", 0, "cs", fmu.guid, where, 0))
    ok(driver("free", 0))


# --- values -----------------------------------------------------------------------------------


@pytest.mark.parametrize("bad", ["nan", "inf", "-inf"])
@pytest.mark.parametrize("name", NAMES)
def test_inputs_that_are_no_numbers(victim, name, bad):
    one = victim(name)
    for k, variable in enumerate(one.fmu.names("input")):
        one.move(k)
        one("set", 1, one.ref(variable), bad)
        refused(one("step", STEP, STEP), variable, bad)
        refused(one("get", 1, one.ref(one.fmu.names("output")[0])), variable, bad)


@pytest.mark.parametrize("name", NAMES)
def test_inputs_that_are_no_numbers_at_the_start(driver, tiny, fmi, use, name):
    one, twin = (use(driver, tiny[name], fmi) for _ in range(2))
    variable = one.fmu.names("input")[0]
    ok(one("enter", 0.0))
    one("set", 1, one.ref(variable), "nan")
    refused(one("exit"), variable, "nan")
    one.move(0)
    ok(one("exit"))
    twin.initialise()
    assert one.outputs() == twin.outputs()


@pytest.mark.parametrize("hold", [0, 1, 2])
@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("step", ["0", "-1e-3", "nan", "inf", "-inf"])
def test_steps_that_cannot_be(victim, name, hold, step):
    one = victim(name, hold)
    one.move(2)
    refused(one("step", STEP, step), "step size")


@pytest.mark.parametrize("name", ["Track", "VehicleWithContact", "TrackWithContact", *ROLLING])
def test_a_step_of_too_many_internal_steps(victim, name):
    """Rolling wheels or contacts inside; a Vehicle takes any step as one."""
    one = victim(name, hold=2)
    one.move(2)
    refused(one("step", STEP, 1e5), "step of 100000 s", "internal steps")


@pytest.mark.parametrize("time", ["nan", "inf"])
def test_times_that_cannot_be(victim, driver, tiny, fmi, use, time):
    refused(victim("Track")("step", time, STEP), "time", time)
    fresh = use(driver, tiny["Track"], fmi)
    assert fresh("enter", time).status == "Error"


@pytest.mark.parametrize("hold", [1, 2])
def test_positions_that_jump_beyond_numbers(victim, hold):
    one = victim("Track", hold)
    position = one.fmu.names("input")[0]
    for value in ("1.7e308", "-1.7e308"):
        one("set", 1, one.ref(position), value)
        refused(one("step", STEP, STEP))


@pytest.mark.parametrize("value", ["1e9", "-1e9", "1e18", "1e308", "-1e308", "5e-324"])
@pytest.mark.parametrize("name", ["Track", "TrackWithContact"])
def test_positions_anywhere(driver, tiny, fmi, use, name, value):
    one = use(driver, tiny[name], fmi)
    one.initialise()
    positions = [one.ref(n) for n in one.fmu.names("input") if n.endswith("position")]
    one.move(1)
    ok(one("set", 4, *positions, *[value] * 4))
    ok(one("step", 0, STEP))
    assert all(abs(float(v)) < 1 for v in one.outputs()[:8])


@pytest.mark.parametrize("name", NAMES)
def test_loads_of_any_size(driver, tiny, fmi, use, name):
    """Whatever a number can be: a state or a refusal, after which it goes on."""
    for value in ("1e100", "-1e100", "1.7e308", "-1.7e308", "1e-320"):
        one = use(driver, tiny[name], fmi)
        one.initialise()
        loads = [one.ref(n) for n in one.fmu.names("input") if not n.endswith("position")]
        one("set", len(loads), *loads, *[value] * len(loads))
        reply = one("step", 0, STEP)
        assert reply.status == ("Error" if reply.log else "OK")
        one("directional", 1, one.ref(one.fmu.names("output")[-1]), 1, loads[0], 1, 1.0, 1)
        one("get", 1, one.ref(one.fmu.names("output")[-1]))
        ok(one("reset"))
        one.initialise()
        ok(one("step", 0, STEP))
        ok(one("free"))


def test_parameters_out_of_range(driver, tiny, fmi, use):
    one, twin = (use(driver, tiny["TrackWithContact"], fmi) for _ in range(2))
    for value in ("0", "-1", "nan", "inf", "1e-9"):
        refused(one("set", 1, one.ref("internal_step"), value), "internal_step")
    for value in (-1, 3, 2147483647, -2147483648):
        refused(one("set_integer", one.ref("input_hold"), value), "input_hold")
    for each in (one, twin):
        each.initialise()
    refused(one("set", 1, one.ref("internal_step"), "1e-4"), "internal_step", "fixed")
    refused(one("set_boolean", one.ref("contact.nonlinear"), 0), "contact.nonlinear")
    ok(one("set_integer", one.ref("input_hold"), 0))  # tunable
    for each in (one, twin):
        each.move(1)
        ok(each("step", 0, STEP))
    assert one.outputs() == twin.outputs()


# --- references and pointers ------------------------------------------------------------------


def test_references_that_are_not_there(victim, fmi):
    one = victim("TrackWithContact")

    def refused(reply, *bad):
        """The sentence names references as the description does, from 1 on in FMI 3."""
        first = int(fmi == 3)
        refused_saying(reply, *(b + first * (b < FIRST_STATE) for b in bad))

    force, hold = one.ref(one.fmu.names("output")[0]), one.ref("input_hold")
    last = max(one.fmu.references.values())
    for bad in (last + 1, FIRST_STATE + one.fmu.states, NO_SUCH, hold):
        refused(one("get", 1, bad), bad)
    for bad in (last + 1, FIRST_STATE, FIRST_DERIVATIVE, NO_SUCH, hold):
        refused(one("set", 1, bad, 1.0), bad)
        refused(one("output_derivatives", 1, bad))
        refused(one("directional", 1, bad, 1, one.ref(one.fmu.names("input")[0]), 1, 1.0, 1))
        refused(one("directional", 1, force, 1, bad, 1, 1.0, 1))
    for bad in (last + 1, NO_SUCH, force):
        refused(one("set_integer", bad, 1), bad)
        refused(one("get_integer", bad), bad)
        refused(one("set_boolean", bad, 1), bad)
        refused(one("get_boolean", bad), bad)
    refused_saying(one("set", 1, force, 1.0), one.fmu.names("output")[0])
    refused_saying(one("set", 1, one.ref("time"), 1.0), "time")
    assert one("strings", force).status == "Error"


def test_a_step_behind_the_stop(driver, tiny, fmi, use):
    """An error, and the state stays; by a rounding it is none."""
    one = use(driver, tiny["Vehicle"], fmi)
    ok(one("enter", 1.0, 1.3))
    ok(one("exit"))
    for k in range(2):
        ok(one("step", 1.0 + 0.1 * k, 0.1))
    refused(one("step", 1.2, 0.10001), "0.10001", "1.2", "behind the stop time, 1.3 s")
    ok(one("step", 1.2000000000000002, 0.1))
    refused(one("step", 1.3, 0.1), "behind the stop time")


def test_a_stop_before_the_start(driver, tiny, fmi, use):
    one = use(driver, tiny["Vehicle"], fmi)
    refused(one("enter", 1.0, 0.9), "0.9", "before the start")


def test_a_step_from_another_time(driver, tiny, fmi, use):
    """It is made, with a warning; the next one may go on from there."""
    one = use(driver, tiny["Vehicle"], fmi)
    one.initialise()
    ok(one("step", 0.0, 0.1))
    reply = one("step", 0.3, 0.1)
    assert (reply.status, len(reply.log)) == ("Warning", 1)
    assert "from t = 0.3 s, but the last one ended at 0.1 s" in reply.log[0]
    ok(one("step", 0.4, 0.1))


def test_a_set_with_one_bad_reference_sets_nothing(victim):
    one = victim("Track")
    before = one.outputs()
    refused(one("set", 2, one.ref(one.fmu.names("input")[0]), NO_SUCH, 5.0, 5.0))
    assert one.outputs() == before


def test_states_have_derivatives_in_model_exchange_only(driver, tiny, fmi, use):
    if fmi == 3:
        pytest.skip("in FMI 3 states are arrays")
    fmu = tiny["Vehicle"]
    one = use(driver, fmu, fmi, "me")
    one.initialise()
    n = fmu.states
    ok(one("directional", 1, FIRST_DERIVATIVE + n - 1, 1, FIRST_STATE + n - 1, 1, 1.0, 1))
    refused(one("directional", 1, FIRST_DERIVATIVE + n, 1, FIRST_STATE, 1, 1.0, 1))
    refused(one("directional", 1, FIRST_DERIVATIVE, 1, FIRST_STATE + n, 1, 1.0, 1))
    refused(one("get", 1, FIRST_STATE + n))
    for wrong in (0, n - 1, n + 1):
        refused(one("get_states", wrong))
        refused(one("rates", wrong))
    ok(one("discrete"))
    ok(one("continuous"))
    for wrong in (n - 1, n + 1):
        refused(one("set_states", *["0"] * wrong))
    refused(one("set_states", "nan", *["0"] * (n - 1)), "finite")
    refused(one("time", "nan"))
    assert one("indicators", 3).status == "Error"


def test_orders_of_derivatives(victim, fmi):
    one = victim("Track")
    output, force = (one.fmu.names(c)[-1] for c in ("output", "input"))
    for order in (-1, 0, 2, 100):
        refused(one("output_derivatives", order, one.ref(output)))
    if fmi == 2:
        for order in (-1, 0, 3):
            refused(one("input_derivatives", order, one.ref(force), 1.0), force)
        refused(one("input_derivatives", 1, one.ref(force), "nan"), force, "nan")
        refused(one("input_derivatives", 1, one.ref(output), 1.0))


def test_null_pointers(victim):
    one = victim("Track")
    assert one("null", 3).status == "Error"
    ok(one("null", 0))
    ok(one("debug", 1, "logStatusError"))
    ok(one("debug", 0))
    one("debug", 1, "noSuchCategory")


def test_no_instance(driver, fmi):
    """A null pointer for the instance: an error where a status is returned, without a log."""
    calls = [
        "enter - 0", "exit -", "terminate -", "reset -", "set - 1 1 5", "get - 1 1", "step - 0 1",
        "get_integer - 1", "set_integer - 1 1", "get_boolean - 1", "set_boolean - 1 1",
        "strings - 1", "null - 1", "output_derivatives - 1 1", "save - 1", "restore - 1",
        "free_state - 1", "serialize - 1 0", "deserialize - 1 0", "directional - 0 0 0 0",
        "time - 0", "event -", "discrete -", "continuous -", "completed -", "set_states - 1",
        "get_states - 1", "rates - 1", "nominals - 1", "indicators - 1", "debug - 1",
    ]  # fmt: skip
    for call in calls:
        assert driver(*call.split()).status == "Error", call
    assert driver("free", 9).status == "OK"


# --- snapshots --------------------------------------------------------------------------------


def test_snapshots_that_are_none(victim):
    one = victim("Track")
    refused(one("restore", 5))
    refused(one("serialize", 5, 0))
    refused(one("deserialize", 5, 0))
    ok(one("save", 5))
    refused(one("serialize", 5, -1))
    ok(one("serialize", 5, 0))
    ok(one("free_state", 5))
    for more in (-1, 1, 8, -8, -100):
        refused(one("deserialize", 5, more), "state")


def test_snapshots_of_others(driver, victim, tiny, fmi, use):
    one = victim("Track")
    for k, (name, kind) in enumerate(
        [("Vehicle", "cs"), ("TrackWithContact", "cs"), ("Track", "me")]
    ):
        other = use(driver, tiny[name], fmi, kind)
        other.initialise()
        ok(other("save", 10 + k))
        ok(other("serialize", 10 + k, 0))
        refused(one("restore", 10 + k), "state")
        refused(one("serialize", 10 + k, 0))
        refused(one("save", 10 + k))
        ok(other("free_state", 10 + k))
        refused(one("deserialize", 10 + k, 0))
        ok(other("free"))


def test_snapshots_damaged(victim):
    """One bit, anywhere."""
    one = victim("Vehicle")
    ok(one("save", 5))
    size = int(ok(one("serialize", 5, 0)).values[0])
    ok(one("free_state", 5))
    for at in range(0, size, 7):
        one.driver("damage", 5, at, 1 << at % 8)
        refused(one("deserialize", 5, 0))
        one.driver("damage", 5, at, 1 << at % 8)
    ok(one("deserialize", 5, 0))
    ok(one("free_state", 5))


# --- memory -----------------------------------------------------------------------------------


@pytest.mark.parametrize("name", ["Vehicle", "TrackWithContact", *ROLLING])
def test_no_memory_for_an_instance(driver, tiny, fmi, name):
    """Refused at the first request, at the second, and so on until it is enough."""
    fmu = tiny[name]
    for granted in range(100):
        driver("memory", granted)
        reply = driver("new", 0, "cs", fmu.guid, fmu.where(fmi), 0)
        if reply.status == "OK":
            break
        assert "memory" in reply.log[0]
    driver("memory", -1)
    assert granted > 5
    ok(driver("free", 0))


def test_no_memory_while_running(victim, fmi):
    """A step takes none; a snapshot does, and says so."""
    one = victim("Track")
    ok(one("save", 6))
    ok(one("serialize", 6, 0))
    one.driver("memory", 0)
    refused(one("save", 5), "memory")
    refused(one("deserialize", 6, 0), "memory")
    ok(one("save", 6))  # over the one that is there
    one.move(2)
    ok(one("step", STEP, STEP))
    requests = int(one.driver("memory", 0).values[0])
    assert requests == 2
    output, force = one.ref(one.fmu.names("output")[0]), one.ref(one.fmu.names("input")[0])
    reply = one("directional", 1, output, 1, force, 1, 1.0, 1)
    if fmi == 3:  # which resolves arrays
        assert reply.status == "Error"
        assert "memory" in reply.log[0]
    else:
        ok(reply)
    one.driver("memory", -1)
    ok(one("restore", 6))
    ok(one("free_state", 6))
