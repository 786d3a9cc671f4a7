"""The Python package as people install it: from a clone and from a source archive, without a network, without build tools but protoc."""
import os
import pathlib
import subprocess
import sys
import tarfile

import pytest

ROOT = pathlib.Path(__file__).resolve().parents[2]
SOURCE = ROOT / "client_examples" / "python"
SECONDS = 120 * float(os.environ.get("MBCOSIM_TIME_FACTOR", 1))
# What a stranger's shell knows.
PLAIN = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "MBCOSIM"))}
USE = """
import mbcosim, os
with mbcosim.local() as server, server.load(os.environ["DECK"]) as pendulum:
    history = pendulum.simulate(until=0.1)
print(mbcosim.__version__, len(history.time), history["node.structural.2.X"].shape, os.path.dirname(mbcosim.__file__))
"""


def run(*command, **options):
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=SECONDS,
                          **{"env": PLAIN, **options})
    assert done.returncode == 0, done.stdout
    return done.stdout


def built(function, folder):
    """Path of what the backend makes."""
    name = run(sys.executable, "-c", f"import build_backend; print(build_backend.{function}({str(folder)!r}))", cwd=SOURCE,
               env={**PLAIN, "PYTHONDONTWRITEBYTECODE": "1"})
    return folder / name.strip()


@pytest.fixture
def venv(tmp_path):
    """Function that installs something into a new virtual environment on Debian's packages and tells its interpreter."""
    def install(what, **options):
        folder = tmp_path / "venv"
        run(sys.executable, "-m", "venv", "--system-site-packages", "--without-pip", folder)
        run(sys.executable, "-m", "pip", "--python", folder / "bin" / "python", "install", "--no-index", "--no-cache-dir", what, **options)
        return folder / "bin" / "python"

    return install


def files_of(folder):
    """All but what interpreters of other tests keep of modules."""
    return sorted(path for path in folder.rglob("*") if "__pycache__" not in path.parts)


def use(python, tmp_path):
    environment = {**PLAIN, "MBCOSIM_BIN": os.environ["MBCOSIM_BIN"], "DECK": str(ROOT / "client_examples/models/pendulum.mbd")}
    return run(python, "-c", USE, cwd=tmp_path, env=environment)


def test_pip_installs_the_package_from_a_clone(venv, tmp_path):
    before = files_of(SOURCE)
    printed = use(venv(SOURCE), tmp_path)
    assert printed.startswith("0.1.0 21 (21, 3) ") and str(tmp_path / "venv") in printed
    assert files_of(SOURCE) == before  # nothing is left beside the sources


def test_a_source_archive_carries_the_stubs(venv, tmp_path):
    archive = built("build_sdist", tmp_path)
    with tarfile.open(archive) as file:
        names = {name.partition("/")[2] for name in file.getnames()}
    assert {"mbcosim/v1/simulations_pb2.py", "mbcosim/v1/simulations_pb2.pyi", "mbcosim/v1/simulations_pb2_grpc.py", "mbcosim/py.typed",
            "pyproject.toml", "README.md", "PKG-INFO"} <= names
    nothing = tmp_path / "empty"
    nothing.mkdir()
    assert use(venv(archive, env={**PLAIN, "PATH": str(nothing)}), tmp_path).startswith("0.1.0 21")


def test_a_clone_without_protoc_names_the_packages(tmp_path):
    done = subprocess.run([sys.executable, "-c", f"import build_backend; build_backend.build_wheel({str(tmp_path)!r})"], cwd=SOURCE,
                          env={**PLAIN, "PATH": str(tmp_path), "PYTHONDONTWRITEBYTECODE": "1"}, stderr=subprocess.PIPE, text=True, check=False)
    assert done.returncode != 0
    assert "apt-get install protobuf-compiler protobuf-compiler-grpc libprotobuf-dev    or    pip install grpcio-tools\n" in done.stderr


def test_the_version_is_that_of_the_project():
    project = (ROOT / "CMakeLists.txt").read_text().partition("project(mbcosim VERSION ")[2].split()[0]
    version = (SOURCE / "mbcosim" / "_version.py").read_text()
    assert f'__version__ = "{project}"' in version
