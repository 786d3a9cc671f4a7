"""The types of the Python client: clean under `mypy --strict`, and of use to those who call it."""
import os
import subprocess
import sys

import pytest

ROOT = os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..")
CONFIGURATION = os.path.join(ROOT, "client_examples", "python", "pyproject.toml")
BUILT = os.environ["PYTHONPATH"].split(os.pathsep)[0]
SECONDS = 240 * float(os.environ.get("MBCOSIM_TIME_FACTOR", 1))


@pytest.fixture(scope="module")
def mypy(tmp_path_factory):
    """Function that checks files or packages; its findings. Results of the package are kept between the tests."""
    cache = tmp_path_factory.mktemp("cache")

    def check(*what):
        done = subprocess.run([sys.executable, "-m", "mypy", "--strict", "--config-file", CONFIGURATION, "--cache-dir", cache, *what],
                              cwd=cache, env={**os.environ, "MYPYPATH": BUILT}, stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True,
                              timeout=SECONDS, check=False)
        return done.stdout

    return check


def test_the_package_is_clean(mypy):
    assert mypy("-p", "mbcosim").startswith("Success: no issues found")


def test_the_examples_are_clean(mypy):
    folder = os.path.join(ROOT, "client_examples", "python")
    scripts = sorted(os.path.join(folder, name) for name in os.listdir(folder) if name.endswith(".py") and name != "build_backend.py")
    assert len(scripts) > 8
    assert mypy("--exclude", "client_examples/python/mbcosim", *scripts).startswith("Success: no issues found")


def test_both_clients_tell_what_their_calls_give(mypy, tmp_path):
    (tmp_path / "user.py").write_text("""
import mbcosim, mbcosim.aio
async def main() -> None:
    async with mbcosim.aio.connect() as server, await server.load("deck") as simulation:
        reveal_type(simulation)
        reveal_type(await simulation.step(3))
with mbcosim.local() as server:
    simulation = server.load("deck", name="pendulum")
    reveal_type(simulation)
    reveal_type(simulation.step(1))
    reveal_type(server.info().version)
    simulation.step("many")
""")
    found = [line.partition(": ")[2] for line in mypy(tmp_path / "user.py").splitlines()[:-1]]
    assert found == [
        'note: Revealed type is "mbcosim.aio.Simulation"', 'note: Revealed type is "mbcosim.calls.StepResult"',
        'note: Revealed type is "mbcosim.simulation.Simulation"', 'note: Revealed type is "mbcosim.calls.StepResult"',
        'note: Revealed type is "builtins.str"', 'error: Argument 1 to "step" of "Simulation" has incompatible type "str"; expected "int"  [arg-type]']
