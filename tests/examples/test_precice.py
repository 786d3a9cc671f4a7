"""The participant of preCICE: a beam of a daemon in a fluid of another process moves as the beam and the fluid in one deck.

The fluid's law and the trapezoidal rule on both sides make the two the same equations, so that what is left is the tolerance of
preCICE's iteration: 1e-9 of the forces in a window. Differences of up to 4e-9 of the motion were seen after 200 windows.
"""
import os
import re
import shutil
import subprocess

import numpy as np
import pytest

import mbcosim

BIN = os.environ["MBCOSIM_BIN"]
FOLDER = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "client_examples", "precice")
SECONDS = 120 * float(os.environ.get("MBCOSIM_TIME_FACTOR", "1"))
PARTICIPANT, FLUID = os.path.join(BIN, "mbcosim_participant"), os.path.join(BIN, "added_mass")
STEP, MASS, DAMPING, STIFFNESS = 2e-3, 3.0, 4.0, 50.0
POINTS = [[0.5, 0, 0], [1.0, 0, 0]]
DATA = ["--force", "Force", "--displacement", "Displacement", "--velocity", "Velocity"]
IQN = re.compile(r"<acceleration:IQN-ILS>.*?</acceleration:IQN-ILS>", re.DOTALL)

pytestmark = pytest.mark.skipif(not os.path.exists(PARTICIPANT), reason="preCICE 3 was not found when this was built (precice_DIR for CMake)")


@pytest.fixture(scope="module")
def address(tmp_path_factory):
    folder = tmp_path_factory.mktemp("run")
    (folder / "results").mkdir()
    address = f"unix:{folder}/s"
    daemon = subprocess.Popen([os.path.join(BIN, "mbcosimd"), "--listen", address, "--results-root", str(folder / "results"), "--log-level", "warn"])
    with mbcosim.connect(address, timeout=SECONDS):
        yield address
    daemon.terminate()
    assert daemon.wait(SECONDS) == 0


def read(name):
    with open(os.path.join(FOLDER, name)) as file:
        return file.read()


def with_all_digits(deck):
    assert deck.count("begin: control data;") == 1
    return deck.replace("begin: control data;", "begin: control data; output precision: 16;")


def rows(mov):
    """Positions and velocities of nodes 2 and 3 (records x 2 x 6)."""
    table = np.array([[float(word) for word in line.split()] for line in mov.splitlines()]).reshape(-1, 3, 13)
    return table[:, 1:, [1, 2, 3, 7, 8, 9]]


def in_one_deck(deck, folder, wet=1):
    (folder / "whole.mbd").write_text(deck)
    subprocess.run([os.path.join(BIN, "mbcosim"), "run", "whole.mbd", "-D", f"wet={wet}", "-o", "whole", "-q"], cwd=folder, check=True, timeout=SECONDS)
    return rows((folder / "whole.mov").read_text())


class Coupled:
    """Both participants, started in a folder of their own."""

    def __init__(self, folder, address, configuration, model, points=POINTS, law=(MASS, DAMPING, STIFFNESS), data=DATA):
        (folder / "precice-config.xml").write_text(configuration)
        numbers = [repr(x) for x in (STEP, *law, *np.ravel(points))]
        self.texts, self.folder = [], folder
        self.processes = [self._start(folder, PARTICIPANT, address, "precice-config.xml", "Structure", "Structure-Mesh", *model, *data),
                          self._start(folder, FLUID, "precice-config.xml", *numbers)]

    @staticmethod
    def _start(folder, *command):
        with open(folder / (os.path.basename(command[0]) + ".txt"), "w") as file:
            return subprocess.Popen(command, cwd=folder, stdout=file, stderr=subprocess.STDOUT)

    def finish(self):
        """Exit codes of the participant and of the fluid; `texts` are what they printed."""
        codes = [process.wait(SECONDS) for process in self.processes]
        self.texts = [(self.folder / (os.path.basename(path) + ".txt")).read_text() for path in (PARTICIPANT, FLUID)]
        return codes

    def kill(self):
        for process in self.processes:
            if process.poll() is None:
                process.kill()
                process.wait()


@pytest.fixture
def couple(tmp_path, address):
    all_of_them = []

    def start(configuration, model, **options):
        all_of_them.append(Coupled(tmp_path, address, configuration, model, **options))
        return all_of_them[-1]

    yield start
    for each in all_of_them:
        each.kill()


def replaced(text, old, new, count=1):
    assert text.count(old) == count, (old, text.count(old))
    return text.replace(old, new)


def with_aitken(configuration):
    aitken = '<acceleration:aitken><data name="Force" mesh="Structure-Mesh" /><initial-relaxation value="0.2" /></acceleration:aitken>'
    return IQN.sub(aitken, configuration)


def in_parallel(configuration):
    configuration = configuration.replace("serial-implicit", "parallel-implicit")
    more = "".join(f'<data name="{name}" mesh="Structure-Mesh" />' for name in ("Force", "Displacement", "Velocity"))
    return replaced(configuration, '<acceleration:IQN-ILS>\n      <data name="Force" mesh="Structure-Mesh" />', f"<acceleration:IQN-ILS>{more}")


def with_windows_of_four_steps(configuration, end):
    """With all time steps of a window in the acceleration, not its end alone."""
    configuration = replaced(configuration, "<acceleration:IQN-ILS>", '<acceleration:IQN-ILS reduced-time-grid="false">')
    configuration = replaced(configuration, 'max-time value="0.4"', f'max-time value="{end}"')
    return replaced(configuration, 'time-window-size value="2e-3"', 'time-window-size value="8e-3"')


def fluid_first(configuration):
    """The participant is second, and what it writes is accelerated."""
    configuration = replaced(configuration, 'first="Structure" second="Fluid"', 'first="Fluid" second="Structure"')
    more = "".join(f'<data name="{name}" mesh="Structure-Mesh" />' for name in ("Displacement", "Velocity"))
    return replaced(configuration, '<acceleration:IQN-ILS>\n      <data name="Force" mesh="Structure-Mesh" />', f"<acceleration:IQN-ILS>{more}")


def coupled_rows(address, couple, deck, configuration, **options):
    """What the daemon wrote, and the last line of the participant."""
    with mbcosim.connect(address, timeout=SECONDS) as server, \
            server.load_text(deck, ports=[mbcosim.structural_port("wet", nodes=[2, 3])], results=["text"], summed_time=True) as beam:
        run = couple(configuration, ["--simulation", beam.name, "--port", "wet"], **options)
        assert run.finish() == [0, 0], run.texts
        assert beam.snapshots() == []
        name, = [name for name in beam.result_files() if name.endswith(".mov")]
        return rows(beam.result_file(name).decode()), [int(n) for n in re.findall(r"\d+", run.texts[0].splitlines()[-1])]


def largest_difference(found, expected):
    """Relative to the largest motion, and the largest velocity."""
    assert found.shape == expected.shape
    away = expected - expected[0]
    return max(np.abs(found - expected)[..., part].max() / np.abs(away[..., part]).max() for part in (slice(0, 3), slice(3, 6)))


@pytest.mark.parametrize("scheme", [str, with_aitken, in_parallel, fluid_first])
def test_the_beam_in_a_fluid_of_another_process_moves_as_in_one_deck(address, couple, tmp_path, scheme):
    deck = with_all_digits(read("wet_beam.mbd"))
    found, (windows, steps, returns) = coupled_rows(address, couple, deck, scheme(read("precice-config.xml")))
    assert windows == 200 and steps == windows + returns and returns > windows
    assert largest_difference(found, in_one_deck(deck, tmp_path)) < 1e-7


def test_windows_of_several_steps_are_taken_back_whole(address, couple, tmp_path):
    deck = with_all_digits(read("wet_beam.mbd"))
    found, (windows, steps, returns) = coupled_rows(address, couple, deck, with_windows_of_four_steps(read("precice-config.xml"), end=0.08))
    assert windows == 10 and steps == 4 * (windows + returns) and returns > windows
    assert largest_difference(found, in_one_deck(deck, tmp_path)[:41]) < 1e-7


def test_the_fluid_matters(tmp_path):
    """Without it the beam moves elsewhere: what the other tests find is no accident."""
    deck = with_all_digits(read("wet_beam.mbd"))
    assert largest_difference(in_one_deck(deck, tmp_path, wet=0), in_one_deck(deck, tmp_path)) > 1


def test_a_mesh_of_two_dimensions_is_the_plane_of_x_and_y(address, couple, tmp_path):
    deck = replaced(with_all_digits(read("wet_beam.mbd")), "0., 0.6, 0.8, sine", "0., 1., 0., sine")
    configuration = replaced(read("precice-config.xml"), 'dimensions="3"', 'dimensions="2"', count=2)
    found, _ = coupled_rows(address, couple, deck, configuration, points=[point[:2] for point in POINTS])
    assert largest_difference(found, in_one_deck(deck, tmp_path)) < 1e-7


def test_an_explicit_scheme_takes_nothing_back(address, couple, tmp_path):
    """A spring and a damper, whose force is one window late: near the deck with both, and nearer with shorter windows."""
    text = with_all_digits(read("wet_beam.mbd"))
    configuration = read("precice-config.xml").replace("serial-implicit", "serial-explicit")
    configuration = re.sub(r".*(max-iterations|convergence-measure).*\n", "", IQN.sub("", configuration))
    errors = []
    for step in (2e-3, 1e-3):
        deck = replaced(text, "time step: 2.e-3;", f"time step: {step!r};")
        deck = replaced(deck, "added_mass = 3.", "added_mass = 1e-9")
        shorter = replaced(configuration, 'time-window-size value="2e-3"', f'time-window-size value="{step!r}"')
        found, (windows, steps, returns) = coupled_rows(address, couple, deck, shorter, law=(0.0, DAMPING, STIFFNESS))
        assert returns == 0 and steps == windows == round(0.4 / step)
        errors.append(largest_difference(found, in_one_deck(deck, tmp_path)))
    assert 1e-4 < errors[1] < 0.6 * errors[0] < 0.06


SPUN = """begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: 0.4; time step: 2e-3; method: crank nicolson; tolerance: 1e-9; max iterations: 20;
end: initial value;
begin: control data; structural nodes: 1; rigid bodies: 1; forces: 2; end: control data;
begin: nodes; structural: 1, dynamic, null, eye, null, null; end: nodes;
begin: elements; body: 1, 1, 2., null, diag, 1., 0.5, 3.; force: 1, absolute, 1, position, null, 0., 1., 0., const, 8.;
force: 2, external structural, grpc, port, "wing", coupling, tight, 1, 1, offset, 0., 0.1, 0.; end: elements;
"""


def test_moments_act_about_the_points_of_a_port_of_the_deck(address, couple):
    """A body that is pushed along y, y = F t² / 2 m, and gets the moment −K y about y: its speed there is −K F t³ / 6 m J."""
    with mbcosim.connect(address, timeout=SECONDS) as server, server.load_text(SPUN) as body:
        run = couple(read("precice-config.xml"), ["--simulation", body.name, "--port", "wing"], points=[[0, 0.1, 0]], law=(0.0, 0.0, STIFFNESS),
                     data=["--moment", "Force", *DATA[2:]])
        assert run.finish() == [0, 0], run.texts
        np.testing.assert_allclose(body["node.structural.1.X"], [0, 8 * 0.4**2 / 2 / 2, 0], rtol=1e-7, atol=1e-12)  # the start shifts speeds by 1e-8
        np.testing.assert_allclose(body["node.structural.1.Omega"], [0, -STIFFNESS * 8 * 0.4**3 / 6 / 2 / 0.5, 0], rtol=1e-4, atol=1e-9)


def test_a_port_of_the_deck_is_found_by_its_name(address, couple, tmp_path):
    (tmp_path / "spun.mbd").write_text(SPUN)
    run = couple(read("precice-config.xml"), ["--deck", "spun.mbd", "--port", "wing"], points=[[0, 0.1, 0]], law=(0.0, 0.0, STIFFNESS))
    assert run.finish() == [0, 0], run.texts


def test_a_deck_s_nodes_are_enough_for_a_port(address, couple, tmp_path):
    shutil.copy(os.path.join(FOLDER, "wet_beam.mbd"), tmp_path)
    run = couple(read("precice-config.xml"), ["--deck", "wet_beam.mbd", "--nodes", "2,3"])
    assert run.finish() == [0, 0], run.texts
    assert run.texts[0].splitlines()[-1].startswith("200 time windows, ")
    with mbcosim.connect(address, timeout=SECONDS) as server:
        assert server.list() == []


def test_a_deck_that_ends_too_early_ends_both_with_a_reason(address, couple, tmp_path):
    (tmp_path / "short.mbd").write_text(replaced(read("wet_beam.mbd"), "final time: 0.4;", "final time: 0.1;"))
    run = couple(read("precice-config.xml"), ["--deck", "short.mbd", "--nodes", "2,3"])
    assert run.finish() == [3, 3]
    assert "error: the deck ends at 0.1" in run.texts[0] and 'raise its "final time"' in run.texts[0]


def test_loads_that_are_not_finite_end_both_and_leave_the_simulation_usable(address, couple, tmp_path):
    with mbcosim.connect(address, timeout=SECONDS) as server, \
            server.load_text(read("wet_beam.mbd"), ports=[mbcosim.structural_port("wet", nodes=[2, 3])]) as beam:
        run = couple(read("precice-config.xml"), ["--simulation", beam.name, "--port", "wet"], law=(float("nan"), 0.0, 0.0))
        assert run.finish() == [3, 3]
        assert 'data "Force" is not finite at point 1 of the port' in run.texts[0]
        beam.refresh()
        assert beam.info.step == 0 and beam.snapshots() == []


@pytest.mark.parametrize("arguments,message", [
    ([], "too few arguments"), (["--deck", "d", "--nodes", "2,x", "--force", "F", "--velocity", "V"], 'got "2,x"'),
    (["--deck", "d", "--simulation", "s", "--nodes", "2"], "one of --deck and --simulation"), (["--deck", "d"], "one of --port and --nodes"),
    (["--simulation", "s", "--nodes", "2"], "--nodes belongs to --deck"), (["--deck", "d", "--nodes", "2", "--velocity", "V"], "nothing is read"),
    (["--deck", "d", "--nodes", "2", "--force", "F"], "nothing is written"), (["--depth", "2"], 'unknown option "--depth"'),
    (["--deck"], "--deck needs a value")])
def test_wrong_arguments_are_told_with_the_usage(arguments, message):
    done = subprocess.run([PARTICIPANT, *(["unix:s", "c.xml", "Structure", "Structure-Mesh", *arguments] if arguments else [])],
                          capture_output=True, text=True, timeout=SECONDS)
    assert done.returncode == 4 and message in done.stderr and "usage: mbcosim_participant" in done.stderr


@pytest.mark.parametrize("data,message", [(["--force", "Forse", "--velocity", "Velocity"], "Forse"),
                                          (["--force", "Force", "--velocity", "Rate"], "Rate")])
def test_names_that_the_configuration_lacks_are_told(address, tmp_path, data, message):
    (tmp_path / "c.xml").write_text(read("precice-config.xml"))
    done = subprocess.run([PARTICIPANT, address, "c.xml", "Structure", "Structure-Mesh", "--deck", os.path.join(FOLDER, "wet_beam.mbd"), "--nodes", "2,3", *data],
                          capture_output=True, text=True, timeout=SECONDS, cwd=tmp_path)
    assert done.returncode == 3 and message in done.stderr
