"""The reduction over the wire gives the file that the command line writes."""
import subprocess

import pytest

import mbcosim
from test_reduce import BIN_DAEMON, folder, reduced  # noqa: F401 (a fixture)


@pytest.fixture
def server(tmp_path):
    address = f"unix:{tmp_path}/s"
    daemon = subprocess.Popen([BIN_DAEMON, "--listen", address, "--log-level", "warn", "--limit-unknowns", "1000"])
    with mbcosim.connect(address, timeout=30) as connection:
        yield connection
    daemon.terminate()
    assert daemon.wait(20) == 0


def test_same_file_as_the_command_line(server, folder):  # noqa: F811
    phases = []
    report, data = server.reduce(folder / "beam.job", basis="craig-bampton", interface=[1, 9], modes=4, diagonalize=False,
                                 progress=lambda phase, fraction: phases.append(phase))
    known, _ = reduced(folder, "--basis", "craig-bampton", "--interface", "1,9", "--modes", "4", "--diagonalize", "no")
    assert data == (folder / "beam.fem").read_bytes()
    assert list(report.frequencies) == known["frequencies_hz"]
    assert (report.modes, report.rigid_motions, report.removed_shapes) == (10, 6, 6)
    assert report.mass == pytest.approx(3) and report.static_error == pytest.approx(known["static_error"])
    assert len(report.effective_masses) == 60
    assert {"rigid motions", "static shapes", "normal modes"} <= set(phases)


@pytest.mark.parametrize("options, message", [({"basis": "fancy"}, "unknown basis"), ({"interface": "77"}, "no node 77"),
                                              ({"colour": "red"}, "unknown option"), ({"mass": "other.mtx"}, "other.mtx"),
                                              ({"basis": "free", "max_frequency": 1e-3}, "no normal mode below"),
                                              ({"modes": 2, "max_frequency": 10}, "both `modes` and `max-frequency`")])
def test_refusals(server, folder, options, message):  # noqa: F811
    with pytest.raises(mbcosim.Error, match=message) as refused:
        server.reduce(folder / "beam.job", **options)
    assert refused.value.reason == "BAD_ARGUMENT"
    report, _ = server.reduce(folder / "beam.job", basis="free", modes=2)  # the daemon lives on
    assert report.modes == 2


def test_limits(server, folder):  # noqa: F811
    nodes = "".join(f"{n},0,0,{n}\n" for n in range(400))
    (folder / "nodes.csv").write_text(nodes)
    empty = "%%MatrixMarket matrix coordinate real symmetric\n2400 2400 0\n"
    (folder / "K.mtx").write_text(empty)
    (folder / "M.mtx").write_text(empty)
    with pytest.raises(mbcosim.LimitExceeded, match="unknowns"):
        server.reduce(folder / "beam.job", basis="free")
