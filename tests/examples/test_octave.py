"""GNU Octave drives the pendulum over HTTP, by the example's lines, and gets what Python gets over gRPC; what fails is told."""
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


pytestmark = pytest.mark.skipif(not shutil.which("octave-cli"), reason="no GNU Octave here")


@pytest.fixture
def daemon(tmp_path):
    """Its address, and that of its page."""
    address = f"unix:{tmp_path}/s"
    process = subprocess.Popen([os.path.join(BIN, "mbcosimd"), "--listen", address, "--http", "127.0.0.1:0"], stdout=subprocess.PIPE, text=True)
    yield address, process.stdout.readline().split()[1]
    process.terminate()
    process.wait(SECONDS)
    process.stdout.close()


def octave(*arguments, **environment):
    done = subprocess.run(["octave-cli", "--no-gui", *arguments], capture_output=True, text=True, timeout=SECONDS,
                          cwd=os.path.join(ROOT, "client_examples", "octave"), env={**os.environ, **environment})
    assert done.returncode == 0, done.stderr
    return done.stdout


def called(page, method, request):
    """What a call prints: its reply's number of steps, or its error."""
    return octave("--eval", f"try, disp(mbcosim_call(mbcosim_door('{page}'), '{method}', {request}).stepsDone); "
                            "catch e, disp([e.identifier, ' ', e.message(1:min(end, 100))]); end")


def test_octave_steps_the_pendulum_as_python_does(daemon):
    address, page = daemon
    with mbcosim.connect(address, timeout=SECONDS) as server, server.load(DECK) as theirs, server.load(DECK) as ours:
        text = octave("pendulum.m", f"{page}#simulation={theirs.name}")
        printed = [[float(word) for word in line.replace(" s", "").split()] for line in text.splitlines()]
        ours["node.structural.2.load"] = [0, 5, 0, 0, 0, 0]
        expected = []
        for _ in range(5):
            result = ours.step(20, outputs=["node.structural.2.X"])
            expected.append([result.time, *result.values["node.structural.2.X"]])
        np.testing.assert_allclose(printed, expected, rtol=0, atol=6e-7)


def test_what_fails_is_an_error_with_its_reason(daemon):
    _, page = daemon
    assert called(page, "Simulations/Step", "struct('simulation', '7 %d')").startswith('mbcosim:not_found no simulation is named "7 %d"')
    assert called("http://127.0.0.1:1/", "Simulations/Step", "struct()").startswith("mbcosim:connection curl: (7) Failed to connect")


def test_no_proxy_of_the_environment_is_asked_for_this_machine(daemon, monkeypatch):
    monkeypatch.setenv("http_proxy", "http://127.0.0.1:9")
    for name in ("no_proxy", "NO_PROXY"):
        monkeypatch.delenv(name, raising=False)
    assert called(daemon[1], "Simulations/Step", "struct('simulation', '7')").startswith("mbcosim:not_found")


def test_a_request_may_be_large_and_the_temporary_folder_have_blanks(daemon, tmp_path):
    folder = tmp_path / "with blanks"
    folder.mkdir()
    address, page = daemon
    with mbcosim.connect(address, timeout=SECONDS) as server, server.load(DECK) as pendulum:
        outputs = "{repmat({0}, 1, 100000)}"
        text = octave("--eval", f"reply = mbcosim_call(mbcosim_door('{page}'), 'Simulations/Step', struct('simulation', '{pendulum.name}', "
                                f"'steps', '1', 'outputs', {outputs})); disp([reply.stepsDone, ' ', num2str(numel(reply.outputs) >= 100000)])",
                      TMPDIR=str(folder))
    assert text == "1 1\n" and list(folder.iterdir()) == []
