"""Makes wheels and source archives of the package (PEP 517, PEP 660), with nothing but Python, protoc and gRPC's plugin.

From a clone the stubs of the protocol are generated; source archives carry them. What stubs ask of protobuf and grpcio depends on the
compiler that made them, so the requirements are read from them.
"""
import base64
import hashlib
import io
import os
import pathlib
import re
import shutil
import subprocess
import sys
import tarfile
import tempfile
import zipfile

HERE = pathlib.Path(__file__).resolve().parent
PROTO = HERE.parents[1] / "proto"
STUBS = "mbcosim/v1"
VERSION = re.search(r'"(.+)"', (HERE / "mbcosim" / "_version.py").read_text().partition("=")[2]).group(1)
# The oldest releases that the client works with; stubs of a newer compiler may ask for more.
OLDEST = {"grpcio": "1.51", "protobuf": "3.21", "numpy": "1.20"}
EXTRAS = {"plots": ["matplotlib>=3.6", "pillow", "tqdm"], "data": ["pandas", "xarray"], "control": ["scipy"]}
WHEEL = "Wheel-Version: 1.0\nGenerator: mbcosim\nRoot-Is-Purelib: true\nTag: py3-none-any\n"


class BuildError(Exception):
    """Why nothing was built."""


# ---------------------------------------------------------------- stubs

def _outside():
    """The environment without what pip hides packages with."""
    return {name: value for name, value in os.environ.items() if name != "PYTHONPATH"}


def _compiler():
    """Command that runs protoc with gRPC's plugin for Python."""
    plugin = shutil.which("grpc_python_plugin")
    if shutil.which("protoc") and plugin:
        return ["protoc", f"--plugin=protoc-gen-grpc_python={plugin}"]
    tools = [sys.executable, "-m", "grpc_tools.protoc"]
    if subprocess.run([*tools, "--version"], capture_output=True, env=_outside(), check=False).returncode == 0:
        return tools
    raise BuildError(
        "mbcosim: the stubs of the protocol are generated, and for that protoc and grpc_python_plugin are missing:\n"
        "  apt-get install protobuf-compiler protobuf-compiler-grpc libprotobuf-dev    or    pip install grpcio-tools\n"
        "A wheel made on another machine (pip wheel --no-deps client_examples/python) has them inside.")


def _generate(folder):
    files = sorted(str(path.relative_to(PROTO)) for path in (PROTO / STUBS).glob("*.proto"))
    command = [*_compiler(), f"-I{PROTO}", f"--python_out={folder}", f"--pyi_out={folder}", f"--grpc_python_out={folder}", *files]
    done = subprocess.run(command, capture_output=True, text=True, env=_outside(), check=False)
    if done.returncode:
        raise BuildError(f"mbcosim: protoc failed; releases from 3.21 on will do:\n{done.stderr}")


def _stubs():
    """The stubs by name: generated in a clone, else those beside this file."""
    if not (PROTO / STUBS).is_dir():
        if not (HERE / STUBS / "common_pb2.py").exists():
            raise BuildError(f"mbcosim: neither stubs in {HERE / STUBS} nor protocol files in {PROTO}: "
                             "build from a clone or from a source archive")
        return {path.name: path.read_bytes() for path in (HERE / STUBS).glob("*_pb2*")}
    with tempfile.TemporaryDirectory() as folder:
        _generate(folder)
        return {path.name: path.read_bytes() for path in (pathlib.Path(folder) / STUBS).glob("*_pb2*")}


def _requirements(stubs):
    """The oldest releases that will do."""
    oldest, text = dict(OLDEST), b"\n".join(stubs.values()).decode()
    runtime = re.search(r"ValidateProtobufRuntimeVersion\(\s*[\w.]+,\s*(\d+),\s*(\d+),\s*(\d+)", text)
    if runtime:
        oldest["protobuf"] = ".".join(runtime.groups())
    grpc = re.search(r"^GRPC_GENERATED_VERSION = '([\d.]+)'", text, re.M)
    if grpc:
        oldest["grpcio"] = grpc.group(1)
    return [f"{name}>={release}" for name, release in oldest.items()]


# ---------------------------------------------------------------- what is written

def _metadata(stubs):
    lines = ["Metadata-Version: 2.1", "Name: mbcosim", f"Version: {VERSION}", "Summary: Client of the mbcosim multibody co-simulation server",
             "License: Apache-2.0", "Classifier: Operating System :: POSIX :: Linux", "Classifier: Typing :: Typed",
             "Requires-Python: >=3.9", *(f"Requires-Dist: {requirement}" for requirement in _requirements(stubs))]
    for extra, requirements in EXTRAS.items():
        lines += [f"Provides-Extra: {extra}", *(f'Requires-Dist: {requirement}; extra == "{extra}"' for requirement in requirements)]
    return "\n".join([*lines, "Description-Content-Type: text/markdown", "", (HERE / "README.md").read_text()]).encode()


def _sources():
    """The package's own files by name."""
    return {f"mbcosim/{path.name}": path.read_bytes() for path in sorted((HERE / "mbcosim").glob("*")) if path.suffix in (".py", ".typed", ".pyi")}


def _write_wheel(folder, files, stubs):
    """A wheel of files by name."""
    info = f"mbcosim-{VERSION}.dist-info"
    files = {**files, f"{info}/METADATA": _metadata(stubs), f"{info}/WHEEL": WHEEL.encode()}
    record = []
    for name, data in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(data).digest()).rstrip(b"=").decode()
        record.append(f"{name},sha256={digest},{len(data)}\n")
    files[f"{info}/RECORD"] = "".join([*record, f"{info}/RECORD,,\n"]).encode()
    name = f"mbcosim-{VERSION}-py3-none-any.whl"
    with zipfile.ZipFile(os.path.join(folder, name), "w", zipfile.ZIP_DEFLATED) as archive:
        for path, data in files.items():
            archive.writestr(zipfile.ZipInfo(path, (2020, 1, 1, 0, 0, 0)), data, zipfile.ZIP_DEFLATED)
    return name


# ---------------------------------------------------------------- what pip calls

def get_requires_for_build_wheel(config_settings=None):
    return []


get_requires_for_build_sdist = get_requires_for_build_editable = get_requires_for_build_wheel


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    stubs = _stubs()
    return _write_wheel(wheel_directory, {**_sources(), **{f"{STUBS}/{name}": data for name, data in stubs.items()}}, stubs)


def build_editable(wheel_directory, config_settings=None, metadata_directory=None):
    """Stubs go beside the sources, which stay where they are."""
    stubs = _stubs()
    (HERE / STUBS).mkdir(exist_ok=True)
    for name, data in stubs.items():
        (HERE / STUBS / name).write_bytes(data)
    return _write_wheel(wheel_directory, {"mbcosim.pth": f"{HERE}\n".encode()}, stubs)


def build_sdist(sdist_directory, config_settings=None):
    stubs, root = _stubs(), f"mbcosim-{VERSION}"
    files = {**_sources(), **{f"{STUBS}/{name}": data for name, data in stubs.items()}, "PKG-INFO": _metadata(stubs)}
    for name in ("pyproject.toml", "build_backend.py", "README.md"):
        files[name] = (HERE / name).read_bytes()
    with tarfile.open(os.path.join(sdist_directory, f"{root}.tar.gz"), "w:gz", format=tarfile.PAX_FORMAT) as archive:
        for name, data in files.items():
            member = tarfile.TarInfo(f"{root}/{name}")
            member.size = len(data)
            archive.addfile(member, io.BytesIO(data))
    return f"{root}.tar.gz"
