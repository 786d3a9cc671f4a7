"""The Debian packages: what they are called, need and hold, and that what is in them works where it is put."""
import os
import pathlib
import subprocess

import pytest

BUILD = pathlib.Path(os.environ["MBCOSIM_BUILD"])
ROOT = pathlib.Path(__file__).resolve().parents[2]
SECONDS = 240 * float(os.environ.get("MBCOSIM_TIME_FACTOR", 1))
PLAIN = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "MBCOSIM"))}
USE = """
import mbcosim, os
with mbcosim.local() as server, server.load(os.environ["DECK"]) as pendulum:
    print(mbcosim.__version__, mbcosim.__file__, pendulum.run_until(0.1).step)
"""


def run(*command, **options):
    done = subprocess.run([str(word) for word in command], stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, timeout=SECONDS,
                          check=False, **{"env": PLAIN, **options})
    assert done.returncode == 0, done.stdout
    return done.stdout


@pytest.fixture(scope="module")
def packages(tmp_path_factory):
    """Paths of the packages by name."""
    folder = tmp_path_factory.mktemp("packages")
    run("cpack", "--config", BUILD / "CPackConfig.cmake", "-B", folder, cwd=folder)
    return {path.name.split("_")[0]: path for path in folder.glob("*.deb")}


@pytest.fixture(scope="module")
def root(packages, tmp_path_factory):
    """A folder into which all packages are unpacked."""
    folder = tmp_path_factory.mktemp("root")
    for path in packages.values():
        run("dpkg-deb", "-x", path, folder)
    return folder


def field(path, name):
    return run("dpkg-deb", "-f", path, name).strip()


def test_there_are_three_and_they_name_what_they_need(packages):
    assert set(packages) == {"mbcosim", "libmbcosim-dev", "python3-mbcosim"}
    needs = field(packages["mbcosim"], "Depends")
    for library in ("libgrpc++1.51", "libprotobuf32", "libklu", "libspdlog1.10"):
        assert library in needs
    assert "libmbcosim" not in needs and "adduser" in needs
    assert "adduser --system" in run("dpkg-deb", "-I", packages["mbcosim"], "postinst")  # the user of the unit
    assert field(packages["libmbcosim-dev"], "Depends").startswith("mbcosim (= 0.1.0), libeigen3-dev")
    assert field(packages["python3-mbcosim"], "Architecture") == "all" and "python3-grpcio (>= 1.51)" in field(packages["python3-mbcosim"], "Depends")


def test_the_programs_find_each_other(root, tmp_path):
    program = root / "usr" / "bin" / "mbcosim"
    libraries = next((root / "usr/lib").rglob("libmbcosim_client.so.0")).parent
    environment = {**PLAIN, "LD_LIBRARY_PATH": str(libraries)}  # the dynamic linker looks in /usr/lib, not here
    run(program, "init", "pendulum", cwd=tmp_path)
    run(program, "run", "pendulum.mbd", "-o", "p", "-q", cwd=tmp_path)
    assert "node 2 z" in run(program, "plot", "p", "--node", 2, "z", cwd=tmp_path)
    assert "FMI 2.0" in run(program, "fmu", "pendulum.mbd", "-o", "p.fmu", "--fmi", 2, "--inputs", "node.structural.2.load", cwd=tmp_path,
                            env=environment)
    assert run(root / "usr" / "bin" / "mbcosimd", "--version") == "mbcosimd 0.1.0\n"
    for each in (root / "usr" / "bin").iterdir():
        assert "not found" not in run("ldd", each), each
    assert "ExecStart=mbcosimd\n" in (root / "usr/lib/systemd/system/mbcosimd.service").read_text()
    assert ".SS plot" in next(root.glob("usr/share/man/man1/mbcosim.1*")).read_text()
    script = (root / "usr/share/bash-completion/completions/mbcosim").read_text()
    assert "complete -o default" in script


def test_python_finds_client_and_daemon(root, tmp_path):
    environment = {**PLAIN, "PYTHONPATH": str(root / "usr/lib/python3/dist-packages"), "PATH": f"{root}/usr/bin:{PLAIN['PATH']}",
                   "DECK": str(ROOT / "client_examples/models/pendulum.mbd")}
    version, place, step = run("/usr/bin/python3", "-B", "-c", USE, cwd=tmp_path, env=environment).split()
    assert version == "0.1.0" and place.startswith(str(root)) and step == "20"


def test_builds_find_headers_and_libraries(root, tmp_path):
    run("cmake", "-S", ROOT / "client_examples/cpp", "-B", tmp_path / "build", f"-DCMAKE_PREFIX_PATH={root}/usr")
    made = run("cmake", "--build", tmp_path / "build", "--target", "help")
    assert "energy" in made and "spring_peer" in made
    (folder := tmp_path / "plain").mkdir()
    (folder / "a.cpp").write_text("#include <client/mbcosim_client.h>\nint main() {}\n")
    environment = {**PLAIN, "PKG_CONFIG_PATH": str(next((root / "usr/lib").rglob("pkgconfig")))}
    flags = run("pkg-config", "--cflags", "--libs", "mbcosim-client", env=environment).split()
    run("g++", "-std=c++20", "a.cpp", "-o", "a", *flags, "-Wl,--allow-shlib-undefined", cwd=folder)
