"""leaks.c uses FMUs again and again: no memory is lost, in sanitized builds none is misused either; and a root with nothing but the C library will do."""
import os
import shutil
import subprocess
import sys

import pytest

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path.insert(0, HERE)
from test_fmu import BIN, C_LIBRARY, STANDARDS, exported, ports  # noqa: E402,F401

SANITIZED = bool(os.environ.get("MBCOSIM_SANITIZED"))
PROGRAM = os.path.join(BIN, "fmi_leaks")


def run(fmu, standard, cycles, program=PROGRAM, folder=None, **options):
    """`folder`: where the program sees the unpacked FMU."""
    folder = folder or fmu.folder
    library = os.path.join(folder, os.path.relpath(fmu.library_path, fmu.folder))
    resources = folder + "/resources" if standard == "3" else f"file://{folder}/resources"
    reference = fmu.reference("stream.push" + ("[2]" if standard == "2" else ""))
    done = subprocess.run([program, library, resources, fmu.token, standard, str(reference), str(cycles)], capture_output=True, text=True,
                          timeout=600, **options)
    assert (done.returncode, done.stderr) == (0, ""), done.stdout + done.stderr
    assert len(done.stdout.splitlines()) == 3


@pytest.mark.parametrize("standard", STANDARDS)
def test_use_again_and_again_loses_no_memory(ports, standard):  # noqa: F811
    run(ports(standard), standard, 20)


def needed(path):
    """Files of the C library, its loader included, that a program or library needs."""
    listed = subprocess.run(["/lib64/ld-linux-x86-64.so.2", "--list", path], capture_output=True, text=True, check=True).stdout
    found = [line.split("=>")[-1].split(" (")[0].strip() for line in listed.splitlines()]
    return {path for path in found if C_LIBRARY.fullmatch(os.path.basename(path)) and os.path.exists(path)}


@pytest.mark.skipif(SANITIZED, reason="sanitized FMUs take their libraries from this machine")
@pytest.mark.skipif(os.geteuid() != 0, reason="only root may change the root folder")
@pytest.mark.parametrize("standard", STANDARDS)
def test_it_runs_in_a_root_with_nothing_but_the_c_library(ports, tmp_path, standard):  # noqa: F811
    """No other file, no environment, neither /proc nor /tmp."""
    fmu, root = ports(standard), tmp_path / "root"
    shutil.copytree(fmu.folder, root / "fmu")
    shutil.copy(PROGRAM, root)
    files = needed(PROGRAM).union(*[needed(os.path.join(fmu.binaries, name)) for name in os.listdir(fmu.binaries)])
    for path in files | {"/lib64/ld-linux-x86-64.so.2"}:
        (root / path[1:]).parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(path, root / path[1:])
    run(fmu, standard, 1, program="/fmi_leaks", folder="/fmu", env={}, preexec_fn=lambda: (os.chroot(root), os.chdir("/")))
