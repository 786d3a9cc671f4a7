"""FMUs of decks, run by the importer beside this file: numbers of `mbcosim run` bit for bit, states, misuse."""
import ctypes
import functools
import math
import os
import random
import re
import shutil
import subprocess
import threading
import zipfile
from xml.etree import ElementTree

import pytest

from importer import DISCARD, ERROR, OK, Archive, Failed, instance_of

BIN = os.environ["MBCOSIM_BIN"]
MODELS = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "client_examples", "models")
TUTORIALS = ["rigid_body", "pendulum", "three_pendulums", "chain", "cantilever_dead_load", "cantilever_follower_load",
             "cantilever_varying_load", "cantilever_five", "cantilever_piezo_shorted", "cantilever_piezo_shunt", "actuated_beam",
             "actuated_beam_inline", "actuated_beam_servo", "modal_body"]
STANDARDS = ["2", "3"]
# A port, a stream drive, a parameter node and a drive that fails below x = -0.4.
PORTS = """begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.; time step: 1e-2; tolerance: 1e-9; max iterations: 20; end: initial value;
begin: control data; structural nodes: 1; parameter nodes: 1; rigid bodies: 1; forces: 3; file drivers: 1; end: control data;
begin: nodes; structural: 1, dynamic, 0.,0.,0., eye, null, 0.,0.,1.; parameter: 7, value, 2.; end: nodes;
begin: drivers; file: 1, stream, stream drive name, "push", create, no, path, "nobody", 2; end: drivers;
begin: elements; body: 1, 1, 2., null, diag, 1.,2.,3.;
force: 1, external structural, grpc, port, "wing", coupling, loose, 2, 1, offset, 0.,.5,0., 1;
force: 2, absolute, 1, position, null, 1.,0.,0., file, 1, 2;
force: 3, absolute, 1, position, null, 0.,0.,1., string, "sqrt(model::node::structural(1, \\"X[1]\\") + .4)";
end: elements;
"""


@pytest.fixture(scope="module")
def exported(tmp_path_factory):
    """exported(deck, standard, *options): the unpacked FMU; each is made once."""
    folder, done = tmp_path_factory.mktemp("fmu"), {}

    def make(deck, standard="3", *options):
        key = (deck, standard, options)
        if key not in done:
            path = str(folder / f"{os.path.splitext(os.path.basename(deck))[0]}{len(done)}.fmu")
            deck_path = deck if os.path.isabs(deck) else os.path.join(MODELS, deck + ".mbd")
            made = subprocess.run([os.path.join(BIN, "mbcosim"), "fmu", deck_path, "-o", path, "--fmi", standard, *options],
                                  capture_output=True, text=True, timeout=300)
            assert made.returncode == 0, made.stderr
            done[key] = Archive(path)
        return done[key]

    return make


@pytest.fixture(scope="module")
def long_chain(exported, tmp_path_factory):
    """long_chain(standard): the tutorial's chain, which goes on for so long that other threads have their turn during a call."""
    path = tmp_path_factory.mktemp("deck") / "long_chain.mbd"
    with open(os.path.join(MODELS, "chain.mbd")) as file:
        text = file.read()
    assert text.count("final time: 3.;") == 1
    path.write_text(text.replace("final time: 3.;", "final time: 30.;"))
    return lambda standard="3": exported(str(path), standard)


@pytest.fixture(scope="module")
def ports(exported, tmp_path_factory):
    path = tmp_path_factory.mktemp("deck") / "ports.mbd"
    path.write_text(PORTS)
    return lambda standard, *options: exported(str(path), standard, *options)


FINAL_TIMES = {"actuated_beam_inline": "5."}  # of 50 s, which take minutes; other decks run to their ends


def run_exactly(deck, folder):
    """Positions, orientations by rows, velocities and angular velocities of all nodes and steps as `mbcosim run` has them, all digits."""
    for name in os.listdir(MODELS):
        path = os.path.join(folder, name)
        shutil.copy(os.path.join(MODELS, name), path)
        if name.endswith((".mbd", ".inc")):
            with open(path) as file:
                text = re.sub(r"(begin\s*:\s*control data\s*;)", r"\1 output precision: 16; default orientation: orientation matrix;", file.read())
            if name == deck + ".mbd" and deck in FINAL_TIMES:
                text, found = re.subn(r"final time: [^;]*;", f"final time: {FINAL_TIMES[deck]};", text)
                assert found == 1
            with open(path, "w") as file:
                file.write(text)
    path = os.path.join(folder, deck + ".mbd")
    subprocess.run([os.path.join(BIN, "mbcosim"), "run", path, "-o", os.path.join(folder, "out"), "-q"], check=True, timeout=300,
                   capture_output=True)
    rows = {}
    with open(os.path.join(folder, "out.mov")) as file:
        for line in file:
            words = line.split()
            rows.setdefault(words[0], []).append([float(x) for x in words[1:]])
    return rows


@pytest.fixture(scope="module")
def run_of(tmp_path_factory):
    """run_of(deck): what run_exactly gives; each deck is run once."""
    return functools.cache(lambda deck: run_exactly(deck, str(tmp_path_factory.mktemp(deck))))


def names_of(fmu, variable):
    """A variable of FMI 3 as FMI 2 has it, too: one for each number."""
    return [variable] if variable in fmu.variables else [name for name in fmu.variables if name.startswith(variable + "[")]


@pytest.mark.parametrize("standard", STANDARDS)
@pytest.mark.parametrize("deck", TUTORIALS)
def test_tutorials_have_the_bits_of_the_command_line(exported, run_of, deck, standard):
    """All records, of each node all 18 numbers."""
    rows, fmu = run_of(deck), exported(deck, standard)
    start, _, step = fmu.experiment()
    labels = [label for label in rows if names_of(fmu, f"node.structural.{label}.R")]
    outputs = [name for label in labels for what in ("X", "R", "XP", "Omega") for name in names_of(fmu, f"node.structural.{label}.{what}")]
    references, size = [fmu.reference(name) for name in outputs], 18 * len(labels)
    assert labels and sum(fmu.sizes[name] for name in outputs) == size
    with instance_of(fmu) as instance:
        instance.initialize()
        for k in range(len(rows[labels[0]])):
            if k > 0:
                assert instance.do_step(start + (k - 1) * step, step) == OK
            assert instance._get(references, size) == [number for label in labels for number in rows[label][k]], f"record {k}"


@pytest.mark.parametrize("standard", STANDARDS)
def test_several_steps_of_the_deck_at_once_change_no_bit(exported, standard):
    fmu = exported("pendulum", standard)
    start, _, step = fmu.experiment()
    outputs = fmu.names("output")
    with instance_of(fmu) as one, instance_of(fmu) as other:
        one.initialize(), other.initialize()
        time, dice = start, random.Random(5)
        for _ in range(20):
            count = dice.randint(1, 7)
            for k in range(count):
                assert one.do_step(time + k * step, step) == OK
            assert other.do_step(time, count * step) == OK
            time += count * step
            assert one[outputs] == other[outputs]


@pytest.mark.parametrize("standard", STANDARDS)
def test_random_step_lengths_keep_the_order_of_the_method(exported, standard):
    """Below the deck's step each length is one step: halves of all of them leave a quarter of the difference (second order)."""
    fmu = exported("pendulum", standard)
    start, _, step = fmu.experiment()
    x = ["node.structural.2.X"] if standard == "3" else [f"node.structural.2.X[{i}]" for i in (1, 2, 3)]
    dice = random.Random(7)
    lengths = [step * dice.uniform(0.3, 0.95) for _ in range(60)]

    def run(instance, parts):
        time = start
        for length in lengths:
            for _ in range(parts):
                assert instance.do_step(time, length / parts) == OK
                time += length / parts
        return time, instance[x]

    ends = []
    for parts in (1, 2, 4):
        with instance_of(fmu) as instance:
            instance.initialize()
            state = instance.get_state()
            end, position = run(instance, parts)
            instance.set_state(state)
            assert run(instance, parts) == (end, position)
            ends.append(position)
    coarse, fine = math.dist(ends[0], ends[1]), math.dist(ends[1], ends[2])
    assert 1e-9 < fine and 3.5 < coarse / fine < 4.5


@pytest.mark.parametrize("standard", STANDARDS)
def test_steps_longer_than_the_deck_s_end_where_they_should(exported, standard):
    fmu = exported("pendulum", standard)
    start, _, step = fmu.experiment()
    x = ["node.structural.2.X"] if standard == "3" else [f"node.structural.2.X[{i}]" for i in (1, 2, 3)]
    with instance_of(fmu) as instance, instance_of(fmu) as parts:
        instance.initialize(), parts.initialize()
        assert instance.do_step(start, 3.7 * step) == OK
        for k in range(3):
            assert parts.do_step(start + k * step, step) == OK
        assert parts.do_step(start + 3 * step, 0.7 * step) == OK
        assert instance[x] == pytest.approx(parts[x], abs=1e-12)
        assert instance.do_step(start + 3 * step, step) == ERROR  # it stands at 3.7 steps
        assert "stands at" in instance.log[-1][2]


@pytest.mark.parametrize("standard", STANDARDS)
def test_restored_states_go_on_as_the_original(ports, standard):
    fmu = ports(standard)
    outputs = fmu.names("output")
    force = "port.wing.loads.force"
    names = [force] if standard == "3" else [f"{force}[{k},{i}]" for k in (1, 2) for i in (1, 2, 3)]

    def steps(instance, first):
        values = []
        for k in range(first, first + 10):
            for n, name in enumerate(names):
                instance[name] = [0.1 * k + n] * fmu.sizes[name]
            assert instance.do_step(0.01 * k, 0.01) == OK
            values.append(instance[outputs])
        return values

    with instance_of(fmu) as instance:
        instance.initialize()
        steps(instance, 0)
        state = instance.get_state()
        data = instance.serialize(state)
        expected = steps(instance, 10)
        instance.set_state(state)
        assert steps(instance, 10) == expected
        again = instance.get_state(instance.get_state())
        instance.free_state(again)
        instance.free_state(state)
    with instance_of(fmu) as other:  # in another instance, which was not even initialized
        other.set_state(other.deserialize(data))
        assert steps(other, 10) == expected
        assert other.call("Terminate") == OK


@pytest.mark.parametrize("standard", STANDARDS)
def test_damaged_and_foreign_states_are_refused(ports, exported, standard):
    fmu = ports(standard)
    with instance_of(fmu) as instance, instance_of(exported("pendulum", standard)) as other:
        instance.initialize(), other.initialize()
        data = bytearray(instance.serialize(instance.get_state()))
        assert "another FMU" in fails(other, lambda: other.deserialize(data))
        data[len(data) // 2] ^= 1
        assert "damaged" in fails(instance, lambda: instance.deserialize(data))
    with instance_of(fmu) as instance:
        assert "damaged" in fails(instance, lambda: instance.deserialize(b"short"))
    with instance_of(fmu) as instance, instance_of(exported("pendulum", standard)) as other:
        state = other.get_state()
        assert "another FMU" in fails(instance, lambda: instance.set_state(state))


def fails(instance, call):
    """The message of a call that ends with an error."""
    with pytest.raises(Failed) as failed:
        call()
    assert failed.value.status == ERROR
    return instance.log[-1][2]


def test_eight_instances_in_eight_threads_have_the_bits_of_one(exported):
    fmus = [exported("chain", standard) for standard in STANDARDS]
    start, _, step = fmus[0].experiment()
    results = [None] * 8

    def run(k):
        fmu = fmus[k % 2]
        with instance_of(fmu, name=f"chain {k}") as instance:
            instance.initialize()
            for n in range(100):
                assert instance.do_step(start + n * step, step) == OK
            results[k] = [x for name in fmu.names("output") for x in instance[name]]

    run(0), run(1)
    alone = results[:2]
    threads = [threading.Thread(target=run, args=(k,)) for k in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join(240)
    assert all(results[k] == alone[k % 2] for k in range(8))
    assert alone[0] == alone[1]


def long_step(instance, count):
    """Status of `count` steps of the deck; again when it was refused because another thread had the instance."""
    status = ERROR
    while status == ERROR:
        status = instance.do_step(0, count * instance.archive.experiment()[2])
    return status


def test_two_calls_at_once_on_one_instance_are_refused_without_harm(long_chain):
    fmu = long_chain()
    with instance_of(fmu) as instance, instance_of(fmu) as alone:
        instance.initialize(), alone.initialize()
        statuses = []
        thread = threading.Thread(target=lambda: statuses.append(long_step(instance, 20000)))
        thread.start()
        refused = 0
        while thread.is_alive():
            try:
                instance["node.structural.2.X"]
            except Failed as failed:
                refused += failed.status == ERROR
        thread.join()
        assert statuses == [OK] and refused > 0
        assert (ERROR, "logStatusError", "fmi3GetFloat64: another call runs on this instance") in instance.log
        assert long_step(alone, 20000) == OK
        assert instance["node.structural.2.X"] == alone["node.structural.2.X"]


@pytest.mark.parametrize("standard", STANDARDS)
def test_an_instance_that_is_freed_during_a_step_ends_with_the_step(long_chain, standard):
    instance = instance_of(long_chain(standard))
    instance.initialize()
    statuses = []
    thread = threading.Thread(target=lambda: statuses.append(long_step(instance, 20000)))
    thread.start()
    while instance.set_logging(True) == OK:
        assert thread.is_alive()
    assert instance.call("EnterEventMode") == ERROR  # never allowed; it does not end the step either
    instance.free()
    thread.join()
    assert statuses == [OK]
    assert [entry[2] for entry in instance.log[-2:]] == [
        f"fmi{standard}EnterEventMode: another call runs on this instance",
        f"fmi{standard}FreeInstance: another call runs on this instance, which is freed at its end"]


# ------------------------------------------------------------------ calls out of order

def to_instantiated(i):
    pass


def to_set_up(i):
    i.must("SetupExperiment", *ARGUMENTS["SetupExperiment"]())


def to_initialization(i):
    i.enter_initialization(0.0)


def to_step(i):
    i.initialize()


def to_terminated(i):
    i.initialize()
    assert i.call("Terminate") == OK


def to_error(i):
    i.initialize()
    assert i.do_step(0.0, -1.0) == ERROR


def push(i):
    """A force that leads to where the deck's drive fails within 0.1 s, not within 0.01 s."""
    if i.archive.version == "3.0":
        i["stream.push"] = [0.0, -1e4]
    else:
        i["stream.push[2]"] = [-1e4]


def to_failed(i):
    i.initialize()
    push(i)
    assert i.do_step(0.0, 0.1) == DISCARD


MODES = {"2": [to_instantiated, to_set_up, to_initialization, to_step, to_failed, to_terminated, to_error],
         "3": [to_instantiated, to_initialization, to_step, to_failed, to_terminated, to_error]}
TYPES3 = "Int8 UInt8 Int16 UInt16 UInt32 Int64 UInt64 Float32 Binary Clock".split()  # no variable of ours has them
MODEL_EXCHANGE = ["EnterEventMode", "EnterContinuousTimeMode", "CompletedIntegratorStep", "SetTime", "SetContinuousStates",
                  "GetEventIndicators", "GetContinuousStates", "GetNominalsOfContinuousStates"]


def rows(letters, *names):
    return dict.fromkeys(names, letters)


# Every function that takes an instance, without "fmi2" or "fmi3"; one letter a mode in the order of MODES. x: allowed; d: discarded, since
# there is no such status; dot: an error. A discarded step leaves FMI 3 in Step Mode. What modelDescription.xml rules out is never allowed.
FUNCTIONS = {
    "2": {**rows("xxxxxxx", "SetDebugLogging", "FreeInstance", "Reset", "GetFMUstate", "SetFMUstate", "FreeFMUstate",
                 "SerializedFMUstateSize", "SerializeFMUstate", "DeSerializeFMUstate"),
          **rows("xx.....", "SetupExperiment"),
          **rows(".x.....", "EnterInitializationMode"),
          **rows("..x....", "ExitInitializationMode"),
          **rows("...xx..", "Terminate"),
          **rows("..xxxxx", "GetReal", "GetInteger", "GetBoolean", "GetString", "GetDirectionalDerivative"),
          **rows("xxxx...", "SetReal"),
          **rows("xxx....", "SetInteger", "SetBoolean", "SetString"),  # fixed parameters
          **rows("...x...", "DoStep"),
          **rows("...xxx.", "GetRealStatus", "GetBooleanStatus"),
          **rows("...ddd.", "GetStatus", "GetIntegerStatus", "GetStringStatus"),
          **rows(".......", "CancelStep", "SetRealInputDerivatives", "GetRealOutputDerivatives", "NewDiscreteStates", "GetDerivatives",
                 *MODEL_EXCHANGE)},
    "3": {**rows("xxxxxx", "SetDebugLogging", "FreeInstance", "Reset", "GetFMUState", "SetFMUState", "FreeFMUState",
                 "SerializedFMUStateSize", "SerializeFMUState", "DeserializeFMUState", "GetFloat64", "GetInt32", "GetBoolean", "GetString",
                 *["Get" + name for name in TYPES3]),
          **rows("x.....", "EnterInitializationMode"),
          **rows(".x....", "ExitInitializationMode"),
          **rows("..xx..", "Terminate", "DoStep"),
          **rows("xxxx..", "SetFloat64", *["Set" + name for name in TYPES3]),
          **rows("xx....", "SetInt32", "SetBoolean", "SetString"),  # fixed parameters
          **rows(".xxxxx", "GetDirectionalDerivative", "GetAdjointDerivative"),
          **rows("......", "EnterStepMode", "EnterConfigurationMode", "ExitConfigurationMode", "EvaluateDiscreteStates",
                 "UpdateDiscreteStates", "GetContinuousStateDerivatives", "GetNumberOfEventIndicators", "GetNumberOfContinuousStates",
                 "GetNumberOfVariableDependencies", "GetVariableDependencies", "GetOutputDerivatives", "ActivateModelPartition",
                 "GetIntervalDecimal", "GetIntervalFraction", "GetShiftDecimal", "GetShiftFraction", "SetIntervalDecimal",
                 "SetIntervalFraction", "SetShiftDecimal", "SetShiftFraction", *MODEL_EXCHANGE)}}
WITHOUT_INSTANCE = {"2": {"GetTypesPlatform", "GetVersion", "Instantiate"},
                    "3": {"GetVersion", "InstantiateCoSimulation", "InstantiateModelExchange", "InstantiateScheduledExecution"}}


def test_every_function_is_in_the_table(ports):
    visible = visible_names(ports("3"))
    for standard in STANDARDS:
        assert {name[4:] for name in visible if name.startswith("fmi" + standard)} == {*FUNCTIONS[standard], *WITHOUT_INSTANCE[standard]}


def test_functions_without_an_instance_tell_the_version(ports):
    library = ports("3").library
    for name in ("fmi2GetVersion", "fmi3GetVersion", "fmi2GetTypesPlatform"):
        getattr(library, name).restype = ctypes.c_char_p
    assert (library.fmi2GetVersion(), library.fmi3GetVersion(), library.fmi2GetTypesPlatform()) == (b"2.0", b"3.0", b"default")


@pytest.fixture(scope="module")
def all_types(exported, tmp_path_factory):
    """A port, and a symbol of every type."""
    path = tmp_path_factory.mktemp("deck") / "types.mbd"
    path.write_text('set: const integer COUNT = 2; set: const bool HEAVY = TRUE; set: const string NOTE = "plain";' + PORTS)
    return lambda standard: exported(str(path), standard)


SIZE, REAL = ctypes.c_size_t, ctypes.c_double
SYMBOL_OF = {"Integer": "symbol.COUNT", "Int32": "symbol.COUNT", "Boolean": "symbol.HEAVY", "String": "symbol.NOTE"}
ARGUMENTS = {  # right ones of both standards; functions that are never allowed look at none
    "SetDebugLogging": lambda: (0, SIZE(0), None),
    "SetupExperiment": lambda: (0, REAL(0), REAL(0), 0, REAL(0)),
    "EnterInitializationMode": lambda: (0, REAL(0), REAL(0), 0, REAL(0)),
    "DoStep": lambda: (REAL(0), REAL(0.01), 0, None, None, None, None),
    "GetStatus": lambda: (0, ctypes.byref(ctypes.c_int())),
    "GetRealStatus": lambda: (2, ctypes.byref(REAL())),  # the last successful time
    "GetIntegerStatus": lambda: (0, ctypes.byref(ctypes.c_int())),
    "GetBooleanStatus": lambda: (3, ctypes.byref(ctypes.c_int())),  # terminated
    "GetStringStatus": lambda: (1, ctypes.byref(ctypes.c_char_p()))}


def perform_on_state(instance, function):
    """With a state of the instance in its present mode."""
    state = instance.get_state()
    data = instance.serialize(state)
    do = {"get": lambda: instance.get_state(state), "set": lambda: instance.set_state(state), "free": lambda: None,
          "serializedsize": lambda: instance.serialize(state), "serialize": lambda: instance.serialize(state),
          "deserialize": lambda: instance.free_state(instance.deserialize(data))}
    do[function.lower().replace("fmustate", "")]()
    instance.free_state(state)


def perform_typed(instance, function):
    """Status of getting or setting one variable of the type, none if there is no such variable."""
    name = "port.wing.loads.force" + ("[1,1]" if instance.archive.version == "2.0" else "")
    if function in ("GetReal", "GetFloat64"):
        instance[name]
    elif function in ("SetReal", "SetFloat64"):
        instance[name] = [1.0] * instance.archive.sizes[name]
    elif function[3:] not in SYMBOL_OF:
        instance.must(function, None, SIZE(0), None, None, SIZE(0))
    else:
        values = instance._array(SYMBOL_OF[function[3:]], *{"Integer": [2], "Int32": [2], "Boolean": [True], "String": [b"plain"]}[function[3:]])
        return instance._typed(function[:3], SYMBOL_OF[function[3:]], values)
    return OK


def perform(instance, function):
    """Status of a call with right arguments."""
    two = instance.archive.version == "2.0"
    try:
        if function == "FreeInstance":
            instance.free()
        elif "FMUstate" in function or "FMUState" in function:
            perform_on_state(instance, function)
        elif function.endswith("Derivative"):
            outputs, inputs = (["node.structural.1.X[1]"], ["port.wing.loads.force[1,1]"]) if two else (
                ["node.structural.1.X"], ["port.wing.loads.force"])
            if function == "GetAdjointDerivative":
                instance.derivative(outputs, inputs, [1.0] * 3, function, 6)
            else:
                instance.derivative(outputs, inputs, [1.0] * (1 if two else 6))
        elif re.fullmatch("[GS]et(Real|Integer|Boolean|String|Float64|Int32|" + "|".join(TYPES3) + ")", function):
            return perform_typed(instance, function)
        else:
            return instance.call(function, *ARGUMENTS.get(function, tuple)())
    except Failed as failed:
        return failed.status
    return OK


@pytest.mark.parametrize("standard, function", [(s, f) for s in STANDARDS for f in FUNCTIONS[s]])
def test_calls_are_allowed_in_the_states_that_the_standard_names(all_types, standard, function):
    fmu, letters = all_types(standard), FUNCTIONS[standard][function]
    assert len(letters) == len(MODES[standard])
    for mode, letter in zip(MODES[standard], letters):
        with instance_of(fmu) as instance:
            mode(instance)
            instance.log.clear()
            status = perform(instance, function)
            assert status == {"x": OK, "d": DISCARD, ".": ERROR}[letter], f"{function} in {mode.__name__}: {instance.log}"
            assert all(entry[0] == OK for entry in instance.log) == (letter == "x"), instance.log
            if letter == ".":
                assert instance.log[-1][:2] == (ERROR, "logStatusError")
                assert perform(instance, "DoStep") == ERROR  # the error ended the simulation
                assert instance.call("Reset") == OK
                instance.initialize()
                assert perform(instance, "DoStep") == OK


def test_the_initialization_begins_after_the_setup_of_the_experiment(ports):
    with instance_of(ports("2")) as instance:
        for _ in range(2):  # it is wanted again after a reset
            assert instance.call("EnterInitializationMode") == ERROR
            assert 'not allowed in the state "Instantiated, before fmi2SetupExperiment"' in instance.log[-1][2]
            assert instance.call("Reset") == OK
            instance.initialize()
            assert instance.call("Reset") == OK


# ------------------------------------------------------------------ bad input

@pytest.mark.parametrize("standard", STANDARDS)
def test_bad_steps(ports, standard):
    fmu = ports(standard)
    for time, length, message in [(0.0, -0.01, "must be positive"), (0.0, 0.0, "must be positive"), (0.0, float("nan"), "must be positive"),
                                  (0.5, 0.01, "stands at 0 s"), (float("nan"), 0.01, "stands at"), (0.0, 0.6, "after the stop time 0.5 s")]:
        with instance_of(fmu) as instance:
            instance.initialize(stop=0.5)
            assert instance.do_step(time, length) == ERROR
            assert message in instance.log[-1][2]


@pytest.mark.parametrize("standard", STANDARDS)
def test_bad_values(ports, standard):
    fmu = ports(standard)
    scalar = [name for name in fmu.names("input") if name.startswith("stream.push")][0]
    output = fmu.names("output")[0]
    with instance_of(fmu) as instance:
        instance.initialize()
        assert instance.set_reals([fmu.reference(scalar)], [float("nan")] * fmu.sizes[scalar]) == DISCARD
        instance[scalar] = [1.0] * fmu.sizes[scalar]
        assert instance.set_reals([99999], [1.0]) == ERROR
        assert "reference 99999" in instance.log[-1][2]
    with instance_of(fmu) as instance:
        assert instance.set_reals([fmu.reference(output)], [1.0] * fmu.sizes[output]) == ERROR
        assert "neither an input nor a parameter" in instance.log[-1][2]
    wrong_type = "SetInteger" if standard == "2" else "SetInt32"
    with instance_of(fmu) as instance:
        one = (ctypes.c_uint32 * 1)(fmu.reference(scalar))
        assert instance.call(wrong_type, one, ctypes.c_size_t(1), (ctypes.c_int32 * 1)(1), ctypes.c_size_t(1)) == ERROR
        assert "no integer variable has the reference" in instance.log[-1][2]
    if standard == "3":
        with instance_of(fmu) as instance:
            assert instance.set_reals([fmu.reference("port.wing.loads.force")], [1.0] * 5) == ERROR
            assert "more than 5 values" in instance.log[-1][2]


@pytest.mark.parametrize("standard", STANDARDS)
def test_inputs_that_nobody_sets_keep_their_start_values(ports, standard):
    """As the standards say; no status but OK, and nothing in the log."""
    fmu = ports(standard)
    outputs, inputs = fmu.names("output"), fmu.names("input")
    ends = []
    for sets in (False, True):
        with instance_of(fmu) as instance:
            for name in inputs if sets else []:
                instance[name] = fmu.start(name)
            instance.initialize()
            for k in range(10):
                assert instance.do_step(0.01 * k, 0.01) == OK
            ends.append(instance[outputs])
            assert [entry for entry in instance.log if entry[0] != OK] == []
    assert inputs and ends[0] == ends[1]


@pytest.mark.parametrize("standard", STANDARDS)
def test_values_that_are_missing_are_an_error_and_change_nothing(ports, standard):
    """Fewer values than the variables have (FMI 3), and none at all for references that are none."""
    fmu = ports(standard)
    name = "port.wing.loads.force" if standard == "3" else [n for n in fmu.names("input") if n.startswith("stream.push")][0]
    with instance_of(fmu) as instance:
        instance.initialize()
        before = instance[name]
        wrong = [([fmu.reference(name), 99999], [1.0] * (fmu.sizes[name] + 1))]
        if standard == "3":
            wrong += [([fmu.reference(name)], []), ([fmu.reference(name)], [1.0] * (fmu.sizes[name] - 1))]
        for references, values in wrong:
            assert instance.set_reals(references, values) == ERROR
            assert instance.log[-1][0] == ERROR and instance[name] == before


@pytest.mark.parametrize("standard", STANDARDS)
def test_instances_need_their_resources_and_token(ports, tmp_path, standard):
    fmu = ports(standard)
    for options, message in [({"resources": str(tmp_path)}, "cannot read"), ({"token": "{other}"}, "the token"),
                             ({"name": " "}, "name of the instance is empty")]:
        refused = instance_of(fmu, **options)
        assert not refused.handle and message in refused.log[-1][2]
    damaged = tmp_path / "a b%"
    shutil.copytree(fmu.resources, damaged)
    with instance_of(fmu, resources=str(damaged)) as moved:
        assert moved.handle
    (damaged / "mbcosim.json").write_text("{}")
    refused = instance_of(fmu, resources=str(damaged))
    assert not refused.handle and "damaged" in refused.log[-1][2]
    assert not instance_of(fmu, logging=False, token="{other}").log


@pytest.mark.parametrize("standard", STANDARDS)
def test_a_deck_that_is_missing_in_the_resources_is_named(ports, tmp_path, standard):
    fmu, resources = ports(standard), tmp_path / "resources"
    shutil.copytree(fmu.resources, resources)
    (resources / "files" / "1-ports.mbd").unlink()
    refused = instance_of(fmu, resources=str(resources))
    assert not refused.handle
    assert refused.log[-1][0] == ERROR and "cannot read" in refused.log[-1][2] and "files/1-ports.mbd" in refused.log[-1][2]


@pytest.mark.parametrize("standard", STANDARDS)
@pytest.mark.parametrize("uri", ["file:///tmp/%zz/resources", "file:///tmp/%+1", "file:///tmp/% 1/%2", "file:%"])
def test_a_damaged_uri_of_the_resources_is_refused(ports, standard, uri):
    refused = instance_of(ports(standard), resources=uri)
    assert not refused.handle
    assert refused.log[-1][0] == ERROR and f'is no URI: "{uri}' in refused.log[-1][2]


@pytest.mark.parametrize("standard", STANDARDS)
def test_instances_of_other_kinds_are_refused(ports, standard):
    with instance_of(ports(standard)) as instance:
        library = instance.archive.library
        if standard == "2":
            refused = [library.fmi2Instantiate(b"i", 0, instance.archive.token.encode(), b"", ctypes.byref(instance._callbacks), 0, 1)]
        else:
            names, flags = (b"i", instance.archive.token.encode(), b""), (False, True)
            library.fmi3InstantiateModelExchange.restype = library.fmi3InstantiateScheduledExecution.restype = ctypes.c_void_p
            refused = [library.fmi3InstantiateModelExchange(*names, *flags, None, instance._logger),
                       library.fmi3InstantiateScheduledExecution(*names, *flags, None, instance._logger, None, None, None)]
        assert not any(refused)
        assert [text for status, _, text in instance.log if status == ERROR] == ["this FMU is for co-simulation"] * len(refused)


@pytest.mark.parametrize("standard", STANDARDS)
def test_null_instances_are_refused(ports, standard):
    instance = instance_of(ports(standard), token="{other}")
    assert instance.call("Terminate") == ERROR and instance.do_step(0.0, 0.01) == ERROR
    instance.free()


@pytest.mark.parametrize("standard", STANDARDS)
def test_a_step_that_fails_is_discarded_and_changes_nothing(ports, standard):
    fmu = ports(standard)
    with instance_of(fmu) as instance, instance_of(fmu) as other:
        instance.initialize(), other.initialize()
        outputs = fmu.names("output")
        state = instance.get_state()
        push(instance)
        before = instance[outputs]  # loads are outputs, too: they follow the inputs at once
        assert instance.do_step(0.0, 0.1) == DISCARD
        assert any(status == DISCARD and category == "logStatusDiscard" for status, category, _ in instance.log)
        assert instance[outputs] == before
        instance.set_state(state)
        assert instance.do_step(0.0, 0.1) == OK and other.do_step(0.0, 0.1) == OK
        assert instance[outputs] == other[outputs]


# The last sample is 1 µs after 0.2 s: with steps of 0.04 s the last one that has a value ends at 0.2 s.
ENDING = """begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.; time step: .04; tolerance: 1e-9; max iterations: 20; end: initial value;
begin: control data; structural nodes: 1; rigid bodies: 1; forces: 1; file drivers: 1; end: control data;
begin: nodes; structural: 1, dynamic, 0.,0.,0., eye, null, 0.,0.,1.; end: nodes;
begin: drivers; file: 1, fixed step, count, 1, initial time, -1e-6, time step, .100001, bailout, upper, "ending.drv"; end: drivers;
begin: elements; body: 1, 1, 2., null, diag, 1.,2.,3.; force: 1, absolute, 1, position, null, 1.,0.,0., file, 1, 1; end: elements;
"""
ENDS = {"2": (DISCARD, "logStatusDiscard"), "3": (OK, "logEvents")}  # a discarded step of FMI 3 would have changed nothing


@pytest.fixture(scope="module")
def ending(exported, tmp_path_factory):
    folder = tmp_path_factory.mktemp("deck")
    (folder / "ending.mbd").write_text(ENDING)
    (folder / "ending.drv").write_text("0.\n1.\n3.\n")
    return lambda standard, *options: exported(str(folder / "ending.mbd"), standard, *options)


def run_past_the_end(fmu, length):
    """Values at the start, before the step in which the deck ends the run, and after it; the step is the first that does not reach its end."""
    standard, outputs, values = fmu.version[0], fmu.names("output"), []
    with instance_of(fmu) as instance:
        instance.initialize()
        values.append(instance[outputs])
        now = 0.0
        while now + length < 0.2 + 1e-9:
            assert instance.do_step(now, length) == OK
            if standard == "3":
                assert instance.flags == (False, False, False) and instance.last_time.value == now + length
            now += length
        values.append(instance[outputs])
        instance.log.clear()
        status, category = ENDS[standard]
        assert instance.do_step(now, length) == status
        assert instance.log == [(status, category, "instance: the deck ended the run at t = 0.2 s")]
        terminate, time = instance.end_of_step()
        assert terminate and time == pytest.approx(0.2, abs=1e-12) and instance["time"] == [time]
        values.append(instance[outputs])
        if standard == "3":  # an importer that goes on all the same
            assert instance.do_step(time, length) == OK and instance.end_of_step() == (True, time)
            assert instance.do_step(time + length, length) == ERROR and "stands at" in instance.log[-1][2]
        else:
            assert instance.call("Terminate") == OK
    return values


@pytest.mark.parametrize("standard", STANDARDS)
def test_a_deck_that_ends_the_run_asks_for_the_end_where_it_stands(ending, standard):
    _, before, after = run_past_the_end(ending(standard), 0.04)
    assert before == after  # no part of the step was possible
    start, before, after_two = run_past_the_end(ending(standard), 0.12)
    assert start != before != after_two and after_two == after  # two of its three steps were


@pytest.mark.parametrize("standard", STANDARDS)
def test_states_lead_back_from_the_end_of_the_run_and_to_it(ending, standard):
    fmu = ending(standard)
    outputs = fmu.names("output")
    with instance_of(fmu) as instance, instance_of(fmu) as other:
        instance.initialize()
        before = instance.get_state()
        instance.do_step(0.0, 0.24)
        reached, values = instance.end_of_step(), instance[outputs]
        at_end = instance.get_state()
        instance.set_state(before)
        assert instance.do_step(0.0, 0.12) == OK
        assert instance.do_step(0.12, 0.08) == OK and instance[outputs] == values
        assert instance.do_step(0.2, 0.04) == ENDS[standard][0]
        taken = other.deserialize(instance.serialize(at_end))
        other.set_state(taken)
        assert other[outputs] == values and reached[0]
        if standard == "2":
            assert other.end_of_step() == reached
        other.free_state(taken)
        for state in (before, at_end):
            instance.free_state(state)


@pytest.mark.parametrize("standard", STANDARDS)
def test_a_step_that_fails_asks_for_no_end(ports, standard):
    with instance_of(ports(standard)) as instance:
        instance.initialize()
        push(instance)
        assert instance.do_step(0.0, 0.1) == DISCARD
        assert instance.end_of_step() == (False, 0.0)


@pytest.mark.parametrize("standard", STANDARDS)
def test_log_categories_can_be_switched(ports, standard):
    with instance_of(ports(standard)) as instance:
        assert any(category == "logEvents" for _, category, _ in instance.log)
        assert instance.set_logging(False) == OK and instance.set_logging(True, ["logStatusDiscard"]) == OK
        instance.initialize()
        instance.log.clear()
        push(instance)
        assert instance.do_step(0.0, 0.1) == DISCARD and len(instance.log) == 1
        instance.log.clear()
        instance.set_logging(False, ["logStatusDiscard"])
        instance.set_logging(False, ["no such"])
        assert instance.log == []


# ------------------------------------------------------------------ values

@pytest.mark.parametrize("standard", STANDARDS)
def test_inputs_of_the_start_reach_the_first_accelerations(ports, standard):
    fmu = ports(standard)
    acceleration = "node.structural.1.XPP" + ("[2]" if standard == "2" else "")
    force = "port.wing.loads.force" + ("[1,2]" if standard == "2" else "")
    with instance_of(fmu) as instance:
        instance.enter_initialization(0.0)
        before = instance[acceleration]
        instance[force] = [3.0] if standard == "2" else [0.0, 3.0, 0.0, 0.0, 0.0, 0.0]
        after = instance[acceleration]
        component = 0 if standard == "2" else 1
        assert after[component] - before[component] == pytest.approx(1.5, rel=1e-6)


@pytest.mark.parametrize("standard", STANDARDS)
def test_derivatives_are_those_of_accelerations_by_forces(ports, standard):
    fmu = ports(standard)
    if standard == "2":
        outputs, inputs, seed = [f"node.structural.1.XPP[{i}]" for i in (1, 2, 3)], ["port.wing.loads.force[2,2]"], [4.0]
        expected = [0.0, 2.0, 0.0]
    else:
        outputs, inputs, seed = ["node.structural.1.XPP"], ["port.wing.loads.force"], [0, 0, 0, 1.0, 4.0, 0.0]
        expected = [0.5, 2.0, 0.0]
    with instance_of(fmu) as instance:
        instance.initialize()
        before = instance.serialize(instance.get_state())
        assert instance.derivative(outputs, inputs, seed) == pytest.approx(expected, rel=1e-6, abs=1e-9)
        assert instance.serialize(instance.get_state()) == before
        assert "is no input" in fails(instance, lambda: instance.derivative(outputs, outputs, [1.0] * 3))


def test_adjoint_derivatives_are_the_transpose(ports):
    fmu = ports("3")
    with instance_of(fmu) as instance:
        instance.initialize()
        seed = instance.derivative(["node.structural.1.XPP"], ["port.wing.loads.force"], [0.0, 1.0, 0.0], "GetAdjointDerivative", 6)
        assert seed == pytest.approx([0.0, 0.5, 0.0, 0.0, 0.5, 0.0], rel=1e-6, abs=1e-9)


# A node that gives way to its forces at once (no mass), turned, and one that turns; the points of the port have arms.
YIELDING = """begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.; time step: 1e-3; tolerance: 1e-10; max iterations: 30; end: initial value;
begin: control data; structural nodes: 3; rigid bodies: 1; joints: 2; forces: 1; end: control data;
begin: nodes; structural: 1, static, .1,.2,.3, euler, .3,.2,.1, null, null; structural: 2, dynamic, 1.,0.,0., euler, .2,-.4,.6, 1.,2.,3., .4,.5,.6;
structural: 3, static, 0.,0.,0., eye, null, null; end: nodes;
begin: elements; body: 1, 2, 2., null, diag, 1.,2.,3.;
joint: 1, clamp, 3, node, node;
joint: 2, deformable joint, 3, position, .1,.2,.3, orientation, euler, .3,.2,.1, 1, position, null,
linear elastic generic, diag, 100.,200.,300.,40.,50.,60.;
force: 1, external structural, grpc, port, "wing", coupling, loose, 2, 1, offset, .1,.5,-.2, 2, offset, .3,.2,.1; end: elements;
"""
MOTION = {"positions": 3, "orientations": 9, "velocities": 3, "angular_velocities": 3}  # numbers of a point


@pytest.fixture(scope="module")
def yielding(exported, tmp_path_factory):
    path = tmp_path_factory.mktemp("deck") / "yielding.mbd"
    path.write_text(YIELDING)
    return lambda standard: exported(str(path), standard)


def derivatives(instance, variable, force, seed):
    """Of a variable by a force of the port, by the names that FMI 3 has."""
    knowns = names_of(instance.archive, force)
    return instance.derivative(names_of(instance.archive, variable), knowns, seed)


@pytest.mark.parametrize("standard", STANDARDS)
def test_derivatives_of_motion_are_zero_where_those_of_the_node_are(ports, standard):
    """A free body: forces change accelerations alone."""
    with instance_of(ports(standard)) as instance:
        instance.initialize()
        assert instance.do_step(0.0, 0.01) == OK
        seed = [0.5, -1.0, 2.0, 1.0, 4.0, -3.0]
        for name, size in MOTION.items():
            found = derivatives(instance, "port.wing." + name, "port.wing.loads.force", seed)
            assert found == pytest.approx([0.0] * (2 * size), abs=1e-9), name
        for name in ("X", "R", "XP", "Omega"):
            found = derivatives(instance, "node.structural.1." + name, "port.wing.loads.force", seed)
            assert found == pytest.approx([0.0] * len(found), abs=1e-9), name
        assert max(map(abs, derivatives(instance, "node.structural.1.XPP", "port.wing.loads.force", seed))) > 0.1
        assert instance.do_step(0.01, 0.01) == OK  # the instance goes on


@pytest.mark.parametrize("standard", STANDARDS)
def test_derivatives_of_motion_are_those_of_the_nodes_and_their_arms(yielding, standard):
    """Not of velocities: those of a node without mass depend on the rates of forces."""
    offsets = [[.1, .5, -.2], [.3, .2, .1]]
    with instance_of(yielding(standard)) as instance:
        instance.initialize()
        seed = [5.0, -10.0, 20.0, 1.0, 4.0, -3.0]
        x, R = (derivatives(instance, "port.wing." + name, "port.wing.loads.force", seed) for name in ("positions", "orientations"))
        for k, f in enumerate(offsets):
            dX, dR = (derivatives(instance, f"node.structural.{k + 1}.{name}", "port.wing.loads.force", seed) for name in ("X", "R"))
            arm = [sum(dR[3 * i + j] * f[j] for j in range(3)) for i in range(3)]
            assert x[3 * k:3 * k + 3] == pytest.approx([a + b for a, b in zip(dX, arm)], rel=1e-9, abs=1e-12)
            assert R[9 * k:9 * k + 9] == pytest.approx(dR, rel=1e-9, abs=1e-12)
        assert max(map(abs, x[:3])) > 1e-3  # the massless node gives way at once


@pytest.mark.parametrize("standard", STANDARDS)
def test_derivatives_of_positions_are_those_of_steps_with_two_forces(yielding, standard):
    fmu, step, seed = yielding(standard), 1e-3, [5.0, -10.0, 20.0, 1.0, 4.0, -3.0]
    positions_of, forces = names_of(fmu, "port.wing.positions"), names_of(fmu, "port.wing.loads.force")

    def after(factor):
        """Where the massless node stands after a step with these forces; the step is so short that the other one hardly moves."""
        with instance_of(fmu) as instance:
            instance.initialize()
            numbers = [factor * x for x in seed]
            for name in forces:
                instance[name] = [numbers.pop(0) for _ in range(fmu.sizes[name])]
            assert instance.do_step(0.0, 1e-3) == OK, instance.log
            return instance[positions_of][:3]

    with instance_of(fmu) as instance:
        instance.initialize()
        expected = derivatives(instance, "port.wing.positions", "port.wing.loads.force", seed)[:3]
    found = [(a - b) / (2 * step) for a, b in zip(after(step), after(-step))]
    assert found == pytest.approx(expected, rel=1e-4, abs=1e-7) and max(map(abs, found)) > 1e-3


def test_adjoint_derivatives_of_motion_are_the_transpose(yielding):
    with instance_of(yielding("3")) as instance:
        instance.initialize()
        outputs, forces, unit = ["port.wing.positions"], ["port.wing.loads.force"], [[float(i == k) for i in range(6)] for k in range(6)]
        D = [instance.derivative(outputs, forces, column) for column in unit]
        transposed = [instance.derivative(outputs, forces, row, "GetAdjointDerivative", 6) for row in unit]
        assert D == [[row[k] for row in transposed] for k in range(6)] and max(map(abs, D[0])) > 1e-3


def test_points_of_a_port_move_with_their_node(ports):
    fmu = ports("3")
    with instance_of(fmu) as instance:
        instance.initialize()
        for k in range(20):
            assert instance.do_step(0.01 * k, 0.01) == OK
        x, R = instance["node.structural.1.X"], instance["node.structural.1.R"]
        v, w = instance["node.structural.1.XP"], instance["node.structural.1.Omega"]
        arm = [0.5 * R[3 * i + 1] for i in range(3)]
        turn = [w[1] * arm[2] - w[2] * arm[1], w[2] * arm[0] - w[0] * arm[2], w[0] * arm[1] - w[1] * arm[0]]
        assert instance["port.wing.positions"] == pytest.approx([a + b for a, b in zip(x, arm)] + x, abs=1e-14)
        assert instance["port.wing.velocities"] == pytest.approx([a + b for a, b in zip(v, turn)] + v, abs=1e-14)
        assert instance["port.wing.orientations"] == R + R


@pytest.mark.parametrize("standard", STANDARDS)
def test_variables_can_be_chosen(ports, standard):
    fmu = ports(standard, "--inputs", "node.structural.1.load,node.parameter.7.x", "--outputs", "node.*.X,node.*.XP")
    assert {name.split("[")[0] for name in fmu.names("input")} == {"node.structural.1.load.force", "node.structural.1.load.moment",
                                                                   "node.parameter.7.x"}
    assert {name.split("[")[0] for name in fmu.names("output")} == {"node.structural.1.X", "node.structural.1.XP"}
    default = ports(standard)
    assert default.names("parameter") == ["node.parameter.7.x"] and default.start("node.parameter.7.x") == [2.0]


# ------------------------------------------------------------------ symbols of the deck

SYMBOLS = """set: const real L = 1.; set: real M = 2.*L; set: const integer INPUTS = 2; set: const bool HEAVY = TRUE;
set: const string NOTE = "plain";
begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 1.; time step: 1e-2; tolerance: 1e-9; max iterations: 20; end: initial value;
begin: control data; structural nodes: 1; rigid bodies: 1; forces: 1; file drivers: 1; gravity; end: control data;
begin: nodes; structural: 1, dynamic, L,0.,0., eye, null, 0.,0.,1.; end: nodes;
begin: drivers; file: 1, stream, stream drive name, "push", create, no, path, "nobody", INPUTS; end: drivers;
begin: elements; body: 1, 1, M, null, diag, 1.,2.,3.; gravity: uniform, 0.,0.,-1., 9.81*(HEAVY == TRUE);
force: 1, absolute, 1, position, null, 1.,0.,0., const, L; end: elements;
"""


@pytest.fixture(scope="module")
def symbols(exported, tmp_path_factory):
    path = tmp_path_factory.mktemp("deck") / "symbols.mbd"
    path.write_text(SYMBOLS)
    return lambda standard, *options: exported(str(path), standard, *options)


def positions(instance, steps=20):
    """Positions after each step from where the instance stands."""
    names = [name for name in instance.archive.names("output") if re.fullmatch(r"node\.structural\.1\.X(\[\d\])?", name)]
    step, rows = instance.archive.experiment()[2], []
    start = instance["time"][0]
    for k in range(steps):
        assert instance.do_step(start + k * step, step) == OK
        rows.append(instance[names])
    return rows


@pytest.mark.parametrize("standard", STANDARDS)
def test_symbols_are_fixed_parameters_with_the_types_of_the_deck(symbols, standard):
    fmu = symbols(standard)
    real, integer = ("Real", "Integer") if standard == "2" else ("Float64", "Int32")
    assert {name: (fmu.type(name), fmu.start(name)) for name in fmu.names("parameter")} == {
        "symbol.HEAVY": ("Boolean", "true"), "symbol.INPUTS": (integer, "2"), "symbol.NOTE": ("String", "plain"),
        "symbol.L": (real, [1.0]), "symbol.M": (real, [2.0])}
    assert all(fmu.variables[name].get("variability") == "fixed" for name in fmu.names("parameter"))
    with instance_of(fmu) as instance:
        instance.enter_initialization(0.0)
        assert [instance.parameter(name) for name in sorted(fmu.names("parameter"))] == [True, 2, 1.0, 2.0, b"plain"]


@pytest.mark.parametrize("standard", STANDARDS)
def test_symbols_that_are_set_give_the_bits_of_an_fmu_exported_with_them(symbols, standard):
    values = {"L": 0.5, "HEAVY": False, "NOTE": b"other"}
    fmu = symbols(standard)
    with instance_of(symbols(standard, "-D", "L=0.5", "-D", "HEAVY=FALSE", "-D", "NOTE=other")) as with_values:
        with_values.initialize()
        expected = positions(with_values)
        assert with_values.archive.start("symbol.L") == [0.5] and with_values.archive.start("symbol.HEAVY") == "false"
    with instance_of(fmu) as instance:
        for name, value in values.items():
            assert instance.set_parameter("symbol." + name, value) == OK
        instance.initialize()
        assert instance.parameter("symbol.M") == 1.0  # the deck computes it from L
        assert positions(instance) == expected
        assert instance.call("Reset") == OK
        instance.initialize()
        assert instance.parameter("symbol.L") == 1.0 and instance.parameter("symbol.M") == 2.0
        assert positions(instance) != expected


@pytest.mark.parametrize("standard", STANDARDS)
def test_states_carry_the_symbols(symbols, standard):
    fmu = symbols(standard)
    with instance_of(fmu) as one, instance_of(fmu) as other:
        assert one.set_parameter("symbol.L", 0.25) == OK
        one.initialize()
        positions(one)
        state = one.get_state()
        data = one.serialize(state)
        expected = positions(one)
        other.initialize()
        taken = other.deserialize(data)
        other.set_state(taken)
        assert other.parameter("symbol.L") == 0.25 and other.parameter("symbol.M") == 0.5
        assert positions(other) == expected
        other.free_state(taken)
        one.free_state(state)


@pytest.mark.parametrize("standard", STANDARDS)
def test_bad_values_of_symbols(symbols, standard):
    fmu = symbols(standard)
    with instance_of(fmu) as instance:
        assert instance.set_parameter("symbol.L", float("nan")) == DISCARD
        instance.initialize()
        assert instance.set_parameter("symbol.L", 2.0) == ERROR
        assert '"symbol.L" is fixed: it is set before the first step' in instance.log[-1][2]
    with instance_of(fmu) as instance:  # the number of inputs depends on it
        assert instance.set_parameter("symbol.INPUTS", 3) == OK
        with pytest.raises(Failed):
            instance.initialize()
        assert "the model has other variables: export an FMU with -D" in instance.log[-1][2]
    with instance_of(fmu) as instance:  # the body has no mass
        assert instance.set_parameter("symbol.M", -1.0) == OK
        with pytest.raises(Failed):
            instance.initialize()
        assert any("mass" in text for _, _, text in instance.log), instance.log
        assert instance.call("Reset") == OK
        instance.initialize()
        positions(instance)
    with instance_of(fmu) as instance:
        wrong = (ctypes.c_uint32 * 1)(fmu.reference("symbol.L"))
        function = "SetInteger" if standard == "2" else "SetInt32"
        assert instance.call(function, wrong, ctypes.c_size_t(1), (ctypes.c_int32 * 1)(1), ctypes.c_size_t(1)) == ERROR
        assert "no integer variable has the reference" in instance.log[-1][2]


def test_wrong_selections_and_decks_are_refused(tmp_path):
    def export(*arguments):
        done = subprocess.run([os.path.join(BIN, "mbcosim"), "fmu", *arguments, "-o", str(tmp_path / "x.fmu")], capture_output=True,
                              text=True, timeout=60)
        assert not (tmp_path / "x.fmu").exists()
        return done.returncode, done.stderr

    pendulum = os.path.join(MODELS, "pendulum.mbd")
    assert export(pendulum, "--outputs", "nothing.*") == (
        4, 'mbcosim fmu: --outputs: no variable that can be read matches "nothing.*"; `mbcosim describe` lists them\n')
    assert export(pendulum, "--inputs", "node.structural.2.X")[0] == 4
    bad = tmp_path / "bad.mbd"
    bad.write_text("begin: nonsense;")
    assert export(str(bad))[0] == 2
    assert export(pendulum, "--fmi", "1")[0] == 4
    code, text = export(pendulum, "-D", "NOBODY=1")
    assert code == 2 and "NOBODY" in text
    assert export(pendulum, "-D", "L")[0] == 4
    for text in (b"a\x01b", b"caf\xe9"):
        with open(pendulum, "rb") as file:
            bad.write_bytes(b'set: string told = "' + text + b'";\n' + file.read())
        code, told = export(str(bad))
        assert code in (2, 4) and 'the value of the symbol "told" is not UTF-8, or has control characters' in told, told


def test_an_fmu_never_takes_the_place_of_its_deck(tmp_path):
    (tmp_path / "part.mbd").write_text("set: const real unused = 1.;\n")
    with open(os.path.join(MODELS, "pendulum.mbd")) as file:
        (tmp_path / "p.mbd").write_text('include: "part.mbd";\n' + file.read())
    before = {p.name: p.read_bytes() for p in tmp_path.iterdir()}
    for output in ("p.mbd", "part.mbd", f"../{tmp_path.name}/part.mbd"):
        done = subprocess.run([os.path.join(BIN, "mbcosim"), "fmu", "p.mbd", "-o", output], cwd=tmp_path, capture_output=True, text=True,
                              timeout=60)
        assert done.returncode == 4 and f'the FMU would overwrite "{os.path.basename(output)}"' in done.stderr, done.stderr
        assert "hint: choose another name with `-o`" in done.stderr
        assert {p.name: p.read_bytes() for p in tmp_path.iterdir()} == before


@pytest.mark.parametrize("standard", STANDARDS)
def test_declared_units_have_their_names_and_factors(tmp_path, standard):
    deck, fmu = tmp_path / "deck.mbd", tmp_path / "deck.fmu"
    deck.write_text(PORTS.replace("begin: control data;", 'begin: control data; units: length, "mm", mass, "t", time, "s";'))
    subprocess.run([os.path.join(BIN, "mbcosim"), "fmu", deck, "-o", fmu, "--fmi", standard], check=True, capture_output=True, timeout=300)
    description = ElementTree.fromstring(zipfile.ZipFile(fmu).read("modelDescription.xml"))
    units = {unit.get("name"): unit.find("BaseUnit").attrib for unit in description.iter("Unit")}
    assert {key: float(value) for key, value in units["mm/s"].items()} == pytest.approx({"m": 1, "s": -1, "factor": 1e-3})
    assert units["N"] == {"kg": "1", "m": "1", "s": "-2"}
    assert float(units["N mm"]["factor"]) == pytest.approx(1e-3) and "m" not in units


def visible_names(fmu):
    names = subprocess.run(["nm", "-D", "--defined-only", fmu.library_path], capture_output=True, text=True, check=True).stdout
    return {line.split()[-1] for line in names.splitlines()}


def test_only_functions_of_fmi_are_visible(ports):
    visible = visible_names(ports("3"))
    assert "fmi3DoStep" in visible and "fmi2DoStep" in visible
    assert all(name.startswith(("fmi2", "fmi3")) for name in visible)


C_LIBRARY = re.compile(r"lib(c|m|pthread|dl|rt|mvec)\.so\.\d+|ld-linux-x86-64\.so\.2|linux-vdso\.so\.1")


@pytest.mark.parametrize("standard", STANDARDS)
def test_all_libraries_but_those_of_the_c_library_travel_with_the_fmu(ports, standard):
    """As the system's loader finds them with an empty environment; nothing lies beside the engine that it does not need."""
    fmu = ports(standard)
    listed = subprocess.run(["/lib64/ld-linux-x86-64.so.2", "--list", fmu.library_path], capture_output=True, text=True, check=True, env={})
    paths = [line.split("=>")[-1].split(" (")[0].strip() for line in listed.stdout.splitlines()]
    others = [path for path in paths if not C_LIBRARY.fullmatch(os.path.basename(path))]
    assert {os.path.realpath(path) for path in others} | {os.path.realpath(fmu.library_path)} == {
        os.path.realpath(os.path.join(fmu.binaries, name)) for name in os.listdir(fmu.binaries)}


def test_equal_decks_make_equal_files(tmp_path):
    for name in ("a", "b"):
        (tmp_path / name).mkdir()
        subprocess.run([os.path.join(BIN, "mbcosim"), "fmu", os.path.join(MODELS, "pendulum.mbd"), "-o",
                        str(tmp_path / name / "p.fmu")], check=True, capture_output=True, timeout=60)
    assert (tmp_path / "a" / "p.fmu").read_bytes() == (tmp_path / "b" / "p.fmu").read_bytes()


@pytest.mark.parametrize("standard", STANDARDS)
def test_descriptions_meet_the_schema(exported, ports, symbols, standard):
    schema = os.environ.get("MBCOSIM_FMI_SCHEMA", "")  # folder with fmi2/ and fmi3/, the standard's own files
    if not schema or not shutil.which("xmllint"):
        pytest.skip("MBCOSIM_FMI_SCHEMA is not set, or there is no xmllint")

    def validate(name, *paths):
        command = ["xmllint", "--noout", "--schema", os.path.join(schema, f"fmi{standard}", name), *paths]
        checked = subprocess.run(command, capture_output=True, text=True, timeout=60)
        assert checked.returncode == 0, checked.stderr

    fmus = [ports(standard), symbols(standard)] + [exported(deck, standard) for deck in TUTORIALS]
    validate(f"fmi{standard}ModelDescription.xsd", *[os.path.join(fmu.folder, "modelDescription.xml") for fmu in fmus])
    if standard == "3":
        validate("fmi3TerminalsAndIcons.xsd", os.path.join(ports("3").folder, "terminalsAndIcons", "terminalsAndIcons.xml"))
