"""GNU Octave drives the pendulum over HTTP, by the example's lines, and gets what Python gets over gRPC."""
import os
import shutil
import subprocess

import numpy as np
import pytest

import mbcosim

ROOT = os.path.join(os.path.dirname(__file__), "..", "..")
BIN = os.environ.get("MBCOSIM_BIN", os.path.join(ROOT, "build", "bin"))
DECK = os.path.join(ROOT, "client_examples", "models", "pendulum.mbd")
SECONDS = 60 * float(os.environ.get("MBCOSIM_TIME_FACTOR", "1"))


@pytest.mark.skipif(not shutil.which("octave-cli"), reason="no GNU Octave here")
def test_octave_steps_the_pendulum_as_python_does(tmp_path):
    address = f"unix:{tmp_path}/s"
    daemon = subprocess.Popen([os.path.join(BIN, "mbcosimd"), "--listen", address, "--http", "127.0.0.1:0"], stdout=subprocess.PIPE, text=True)
    try:
        page = daemon.stdout.readline().split()[1]
        with mbcosim.connect(address, timeout=SECONDS) as server, server.load(DECK) as theirs, server.load(DECK) as ours:
            done = subprocess.run(["octave-cli", "--no-gui", "pendulum.m", f"{page}#simulation={theirs.name}"], capture_output=True, text=True,
                                  timeout=SECONDS, cwd=os.path.join(ROOT, "client_examples", "octave"))
            assert done.returncode == 0, done.stderr
            printed = [[float(word) for word in line.replace(" s", "").split()] for line in done.stdout.splitlines()]
            ours["node.structural.2.load"] = [0, 5, 0, 0, 0, 0]
            expected = []
            for _ in range(5):
                result = ours.step(20, outputs=["node.structural.2.X"])
                expected.append([result.time, *result.values["node.structural.2.X"]])
            np.testing.assert_allclose(printed, expected, rtol=0, atol=6e-7)
    finally:
        daemon.terminate()
        daemon.wait(SECONDS)
