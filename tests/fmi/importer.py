"""An importer of co-simulation FMUs, written from the text of FMI 2.0.4 and 3.0.2 for the tests: `Fmu2`, `Fmu3`.

Both have the same methods. A call returns its status (OK ... FATAL) unless it hands out values; then anything but OK and
WARNING raises `Failed`. Nothing is checked before a call: tests make wrong ones on purpose.
"""
import ctypes as c
import functools
import os
import tempfile
import xml.etree.ElementTree
import zipfile

OK, WARNING, DISCARD, ERROR, FATAL = range(5)


class Failed(Exception):
    def __init__(self, function, status):
        super().__init__(f"{function}: status {status}")
        self.status = status


class Archive:
    """An unpacked FMU and its modelDescription.xml."""

    def __init__(self, path):
        self.path = path
        self._folder = tempfile.TemporaryDirectory()
        self.folder = self._folder.name
        with zipfile.ZipFile(path) as archive:
            archive.extractall(self.folder)
        self.description = xml.etree.ElementTree.parse(os.path.join(self.folder, "modelDescription.xml")).getroot()
        self.version = self.description.get("fmiVersion")
        kind = self.description.find("CoSimulation")
        self.identifier = kind.get("modelIdentifier")
        self.token = self.description.get("guid") or self.description.get("instantiationToken")
        self.variables = {v.get("name"): v for v in self.description.find("ModelVariables")}
        self.sizes = {name: self._size(v) for name, v in self.variables.items()}
        self.resources = os.path.join(self.folder, "resources")
        platform = "linux64" if self.version.startswith("2") else "x86_64-linux"
        self.binaries = os.path.join(self.folder, "binaries", platform)
        self.library_path = os.path.join(self.binaries, self.identifier + ".so")

    @functools.cached_property
    def library(self):
        return c.CDLL(self.library_path)

    @staticmethod
    def _size(variable):
        size = 1
        for dimension in variable.findall("Dimension"):
            size *= int(dimension.get("start"))
        return size

    def names(self, causality):
        return [name for name, v in self.variables.items() if v.get("causality") == causality]

    def reference(self, name):
        return int(self.variables[name].get("valueReference"))

    def start(self, name):
        """Numbers of a real variable; of another type the text that the description has."""
        variable = self.variables[name]
        typed = variable if self.version.startswith("3") else variable[0]
        if typed.tag == "String":
            return typed.get("start") if typed.find("Start") is None else typed.find("Start").get("value")
        if typed.tag not in ("Real", "Float64"):
            return typed.get("start")
        return [float(x) for x in typed.get("start").split()]

    def type(self, name):
        """The standard's name: "Real" or "Float64", "Integer" or "Int32", "Boolean", "String"."""
        return self.variables[name].tag if self.version.startswith("3") else self.variables[name][0].tag

    def experiment(self):
        node = self.description.find("DefaultExperiment")
        return [float(node.get(name)) for name in ("startTime", "stopTime", "stepSize")]


class Instance:
    """What both standards share. `log`: list of (status, category, message)."""

    def __init__(self, archive, name="instance", token=None, resources=None, logging=True):
        self.archive, self.log = archive, []
        self.handle = self._instantiate(name.encode(), (token or archive.token).encode(), resources or archive.resources, logging)

    def call(self, function, *arguments):
        return getattr(self.archive.library, self.PREFIX + function)(self.handle, *arguments)

    def must(self, function, *arguments):
        status = self.call(function, *arguments)
        if status not in (OK, WARNING):
            raise Failed(function, status)

    def free(self):
        if self.handle:
            getattr(self.archive.library, self.PREFIX + "FreeInstance")(self.handle)
            self.handle = None

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.free()

    def __getitem__(self, names):
        """Values of one variable, or of several as one list."""
        names = [names] if isinstance(names, str) else names
        values = self._get([self.archive.reference(n) for n in names], sum(self.archive.sizes[n] for n in names))
        return values

    def __setitem__(self, name, values):
        status = self.set_reals([self.archive.reference(name)], values)
        if status != OK:
            raise Failed("set", status)

    C_TYPES = {"Integer": c.c_int32, "Int32": c.c_int32, "String": c.c_char_p}

    def _typed(self, function, name, values):
        archive = self.archive
        size = (c.c_size_t(len(values)),) if archive.version.startswith("3") else ()
        return self.call(function + archive.type(name), (c.c_uint32 * 1)(archive.reference(name)), c.c_size_t(1), values, *size)

    def _array(self, name, *values):
        boolean = c.c_bool if self.archive.version.startswith("3") else c.c_int
        return (self.C_TYPES.get(self.archive.type(name), boolean) * 1)(*values)

    def set_parameter(self, name, value):
        """Status of setting one parameter of any type."""
        if self.archive.type(name) in ("Real", "Float64"):
            return self.set_reals([self.archive.reference(name)], [value])
        return self._typed("Set", name, self._array(name, value))

    def parameter(self, name):
        if self.archive.type(name) in ("Real", "Float64"):
            return self[name][0]
        values = self._array(name)
        status = self._typed("Get", name, values)
        if status != OK:
            raise Failed("Get" + self.archive.type(name), status)
        return values[0]

    def initialize(self, stop=None):
        start = self.archive.experiment()[0]
        self.enter_initialization(start, stop)
        self.must("ExitInitializationMode")

    def get_state(self, state=None):
        state = state or c.c_void_p()
        self.must(self.STATE.format("Get"), c.byref(state))
        return state

    def set_state(self, state):
        self.must(self.STATE.format("Set"), state)

    def free_state(self, state):
        self.must(self.STATE.format("Free"), c.byref(state))

    def serialize(self, state):
        size = c.c_size_t()
        self.must(self.SERIALIZED_SIZE, state, c.byref(size))
        data = (c.c_char * size.value)()
        self.must(self.SERIALIZE, state, data, size)
        return bytes(data)

    def deserialize(self, data):
        state = c.c_void_p()
        self.must(self.DESERIALIZE, bytes(data), c.c_size_t(len(data)), c.byref(state))
        return state


class Fmu3(Instance):
    PREFIX, STATE = "fmi3", "{}FMUState"
    SERIALIZED_SIZE, SERIALIZE, DESERIALIZE = "SerializedFMUStateSize", "SerializeFMUState", "DeserializeFMUState"
    LOG = c.CFUNCTYPE(None, c.c_void_p, c.c_int, c.c_char_p, c.c_char_p)

    def _instantiate(self, name, token, resources, logging, events=False, intermediate=0):
        self._logger = self.LOG(lambda _, status, category, text: self.log.append((status, category.decode(), text.decode())))
        create = self.archive.library.fmi3InstantiateCoSimulation
        create.restype = c.c_void_p
        create.argtypes = [c.c_char_p] * 3 + [c.c_bool] * 4 + [c.c_void_p, c.c_size_t, c.c_void_p, self.LOG, c.c_void_p]
        self.archive.library.fmi3FreeInstance.argtypes = [c.c_void_p]
        return c.c_void_p(create(name, token, (resources + "/").encode(), False, logging, events, False, None, intermediate, None,
                                 self._logger, None))

    def enter_initialization(self, start, stop=None):
        self.must("EnterInitializationMode", c.c_bool(False), c.c_double(0), c.c_double(start), c.c_bool(stop is not None),
                  c.c_double(stop or 0))

    def _get(self, references, size):
        values = (c.c_double * size)()
        self.must("GetFloat64", (c.c_uint32 * len(references))(*references), c.c_size_t(len(references)), values, c.c_size_t(size))
        return list(values)

    def set_reals(self, references, values):
        return self.call("SetFloat64", (c.c_uint32 * len(references))(*references), c.c_size_t(len(references)),
                         (c.c_double * len(values))(*values), c.c_size_t(len(values)))

    def do_step(self, time, length):
        event, terminate, early, self.last_time = c.c_bool(), c.c_bool(), c.c_bool(), c.c_double()
        status = self.call("DoStep", c.c_double(time), c.c_double(length), c.c_bool(False), c.byref(event), c.byref(terminate),
                           c.byref(early), c.byref(self.last_time))
        self.flags = event.value, terminate.value, early.value
        return status

    def end_of_step(self):
        """Does the FMU ask for the end of the simulation, and the time that the last step reached."""
        return self.flags[1], self.last_time.value

    def set_logging(self, on, categories=()):
        names = (c.c_char_p * max(1, len(categories)))(*[x.encode() for x in categories])
        return self.call("SetDebugLogging", c.c_bool(on), c.c_size_t(len(categories)), names)

    def derivative(self, unknowns, knowns, seed, function="GetDirectionalDerivative", size=None):
        outputs, inputs = [self.archive.reference(n) for n in unknowns], [self.archive.reference(n) for n in knowns]
        size = size or sum(self.archive.sizes[n] for n in unknowns)
        result = (c.c_double * size)()
        self.must(function, (c.c_uint32 * len(outputs))(*outputs), c.c_size_t(len(outputs)), (c.c_uint32 * len(inputs))(*inputs),
                  c.c_size_t(len(inputs)), (c.c_double * len(seed))(*seed), c.c_size_t(len(seed)), result, c.c_size_t(size))
        return list(result)


class Callbacks2(c.Structure):
    LOGGER = c.CFUNCTYPE(None, c.c_void_p, c.c_char_p, c.c_int, c.c_char_p, c.c_char_p, c.c_char_p)
    _fields_ = [("logger", LOGGER), ("allocate", c.c_void_p), ("free", c.c_void_p), ("finished", c.c_void_p), ("environment", c.c_void_p)]


class Fmu2(Instance):
    PREFIX, STATE = "fmi2", "{}FMUstate"
    SERIALIZED_SIZE, SERIALIZE, DESERIALIZE = "SerializedFMUstateSize", "SerializeFMUstate", "DeSerializeFMUstate"

    def _instantiate(self, name, token, resources, logging, kind=1):
        # our messages come through "%s" and one argument
        self._callbacks = Callbacks2(logger=Callbacks2.LOGGER(
            lambda _, who, status, category, text, first: self.log.append((status, category.decode(), (first or text).decode()))))
        create = self.archive.library.fmi2Instantiate
        create.restype = c.c_void_p
        create.argtypes = [c.c_char_p, c.c_int, c.c_char_p, c.c_char_p, c.c_void_p, c.c_int, c.c_int]
        self.archive.library.fmi2FreeInstance.argtypes = [c.c_void_p]
        is_uri = resources.startswith("file:")
        uri = resources if is_uri else "file://" + resources.replace("%", "%25").replace(" ", "%20")
        return c.c_void_p(create(name, kind, token, uri.encode(), c.byref(self._callbacks), 0, logging))

    def enter_initialization(self, start, stop=None):
        self.must("SetupExperiment", 0, c.c_double(0), c.c_double(start), int(stop is not None), c.c_double(stop or 0))
        self.must("EnterInitializationMode")

    def _get(self, references, size):
        values = (c.c_double * size)()
        self.must("GetReal", (c.c_uint * size)(*references), c.c_size_t(size), values)
        return list(values)

    def set_reals(self, references, values):
        return self.call("SetReal", (c.c_uint * len(references))(*references), c.c_size_t(len(references)),
                         (c.c_double * len(values))(*values))

    def do_step(self, time, length):
        return self.call("DoStep", c.c_double(time), c.c_double(length), 0)

    def end_of_step(self):
        """Does the FMU ask for the end of the simulation, and the time that the last step reached."""
        terminated, time = c.c_int(), c.c_double()
        self.must("GetBooleanStatus", 3, c.byref(terminated))
        self.must("GetRealStatus", 2, c.byref(time))
        return terminated.value != 0, time.value

    def set_logging(self, on, categories=()):
        names = (c.c_char_p * max(1, len(categories)))(*[x.encode() for x in categories])
        return self.call("SetDebugLogging", int(on), c.c_size_t(len(categories)), names)

    def derivative(self, unknowns, knowns, seed):
        outputs, inputs = [self.archive.reference(n) for n in unknowns], [self.archive.reference(n) for n in knowns]
        result = (c.c_double * len(outputs))()
        self.must("GetDirectionalDerivative", (c.c_uint * len(outputs))(*outputs), c.c_size_t(len(outputs)),
                  (c.c_uint * len(inputs))(*inputs), c.c_size_t(len(inputs)), (c.c_double * len(seed))(*seed), result)
        return list(result)


def instance_of(archive, **options):
    return (Fmu2 if archive.version.startswith("2") else Fmu3)(archive, **options)
