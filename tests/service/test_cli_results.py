"""The command line around a run: decks to start from, curves, comparison, eigenvalues, what shells and `man` are told."""
import contextlib
import os
import pty
import re
import shutil
import subprocess

import numpy as np
import pytest

import decks
from conftest import BIN, MODELS
from test_analysis import OSCILLATOR

MBCOSIM = os.path.join(BIN, "mbcosim")


def mbcosim(*arguments, cwd, **environment):
    return subprocess.run([MBCOSIM, *map(str, arguments)], cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=120,
                          env={**os.environ, **environment}, check=False)


@pytest.fixture(scope="module")
def swing(tmp_path_factory):
    """Folder with the results `p.*` of the pendulum."""
    folder = tmp_path_factory.mktemp("swing")
    done = mbcosim("run", os.path.join(MODELS, "pendulum.mbd"), "-o", "p", cwd=folder)
    assert done.returncode == 0, done.stderr
    return folder


# ---------------------------------------------------------------- starters

@pytest.mark.parametrize("kind, label, column, value", [
    ("pendulum", 2, 3, None),
    ("beam", 9, 3, 100 / (3 * 7e10 * 0.02**4 / 12)),       # P L^3 / 3 E I
    ("hydraulic", 11, 3, 0.1 + (5e6 - 1e5) * 1e-3 / 2e4),  # pressure against spring
    ("coupled", 2, 3, None)])
def test_starters_run_without_a_warning_and_end_where_they_should(tmp_path, kind, label, column, value):
    written = mbcosim("init", kind, cwd=tmp_path)
    assert written.returncode == 0 and f"mbcosim run {kind}.mbd -o results" in written.stdout
    checked = mbcosim("validate", f"{kind}.mbd", cwd=tmp_path)
    assert (checked.returncode, checked.stderr) == (0, "")
    done = mbcosim("run", f"{kind}.mbd", "-o", "results", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    rows = np.loadtxt(tmp_path / "results.mov", usecols=range(13))
    last = rows[rows[:, 0] == label][-1, column]
    if value is None:  # energy of 2 kg at 1 m with 0.02 kg m^2, from rest at the hinge's height
        end = rows[rows[:, 0] == label][-1]
        turning = np.linalg.norm(end[10:13])
        assert 0.5 * (2 + 0.02) * turning**2 == pytest.approx(-2 * 9.81 * end[3], rel=2e-3)
    else:
        assert last == pytest.approx(value, rel=3e-3)


# ---------------------------------------------------------------- formats

@pytest.mark.parametrize("options, endings", [
    ([], {".mov", ".nc"}), (["--format", "netcdf"], {".nc"}), (["--format", "text"], {".mov"}),
    (["--format", "text", "--format", "netcdf"], {".mov", ".nc"})])
def test_the_command_line_chooses_the_format_of_the_results(tmp_path, options, endings):
    with open(os.path.join(MODELS, "pendulum.mbd")) as file:
        text = file.read().replace("end: control data;", "output results: netcdf, no text; end: control data;", 1)
    (tmp_path / "deck").write_text(text)
    done = mbcosim("run", *options, "deck", "-o", "p", cwd=tmp_path)
    assert done.returncode == 0, done.stderr
    assert "hint: `mbcosim run --format netcdf` writes the NetCDF file alone" in done.stderr
    assert {ending for ending in (".mov", ".nc") if (tmp_path / f"p{ending}").exists()} == endings
    assert endings != {".nc"} or {file.name for file in tmp_path.iterdir()} == {"deck", "p.nc"}


def test_a_format_that_is_none_is_refused(tmp_path):
    done = mbcosim("run", "deck", "--format", "excel", cwd=tmp_path)
    assert done.returncode == 4 and "--format: excel not in {text,netcdf}" in done.stderr


def test_a_starter_overwrites_nothing(tmp_path):
    (tmp_path / "beam.mbd").write_text("mine")
    again = mbcosim("init", "beam", cwd=tmp_path)
    assert again.returncode == 4 and 'cannot write "beam.mbd": File exists' in again.stderr
    assert (tmp_path / "beam.mbd").read_text() == "mine"
    assert "there are pendulum, beam, hydraulic, coupled" in mbcosim("init", "bean", cwd=tmp_path).stderr


# ---------------------------------------------------------------- plot

def test_plot_draws_on_the_terminal(swing):
    drawn = mbcosim("plot", "p", "--node", 2, "z", cwd=swing)
    lines = drawn.stdout.splitlines()
    assert drawn.returncode == 0 and len(lines) == 23
    assert lines[0].split("|")[0].strip() == "0" and lines[19].split("|")[0].strip() == "-1"
    assert lines[-1].split() == ["*", "node", "2", "z"] and lines[-2].split() == ["0", "5.005", "time", "[s]"]
    first = [line.split("|")[1].find("*") for line in lines[:20]]
    assert first[0] == 0 and first[19] > 3  # from the top, and later at the bottom


@pytest.mark.parametrize("path", [None, "python"])
def test_plot_writes_pictures_by_gnuplot_or_by_python(swing, tmp_path, path):
    """Without gnuplot on the path Python does it."""
    folder = tmp_path / "bin"
    folder.mkdir()
    (folder / "python3").symlink_to("/usr/bin/python3")
    environment = {"PATH": str(folder)} if path == "python" else {}
    if path is None and not shutil.which("gnuplot"):
        pytest.skip("there is no gnuplot")
    picture = tmp_path / "it's\\ours.png"
    drawn = mbcosim("plot", "p", "--node", 2, "z", "--joint", 2, "F", "--png", picture, cwd=swing, **environment)
    assert drawn.returncode == 0, drawn.stderr
    assert picture.read_bytes().startswith(b"\x89PNG") and picture.stat().st_size > 8000


def test_plot_of_a_run_without_text_says_what_is_missing(tmp_path):
    (tmp_path / "o").write_text(OSCILLATOR)
    assert mbcosim("run", "o", "-o", "p", "--format", "netcdf", cwd=tmp_path).returncode == 0
    drawn = mbcosim("plot", "p", "--node", 1, "z", cwd=tmp_path)
    compared = mbcosim("diff", "p", "p", cwd=tmp_path)
    assert compared.returncode == 4 and 'there are no results "p.*", but "p.nc": text is read here' in compared.stderr
    assert drawn.returncode == 4 and '"p.nc": text is read here, which `mbcosim run DECK -o p` writes without `--format netcdf`' in drawn.stderr


def test_plot_knows_how_orientations_are_written(swing, tmp_path):
    """A matrix has nine numbers, between which no angle is."""
    deck = open(os.path.join(MODELS, "pendulum.mbd")).read()
    (tmp_path / "deck").write_text(deck.replace("begin: control data;", "begin: control data; default orientation: orientation matrix;"))
    assert mbcosim("run", "deck", "-o", "m", cwd=tmp_path).returncode == 0
    for quantity in ("x", "vz", "wy", "V"):
        angles = mbcosim("plot", "p", "--node", 2, quantity, cwd=swing)
        matrix = mbcosim("plot", "m", "--node", 2, quantity, cwd=tmp_path)
        assert (matrix.returncode, matrix.stdout) == (0, angles.stdout) and "node 2 " in angles.stdout
    assert mbcosim("plot", "m", "--node", 2, "4", cwd=tmp_path).returncode == 0
    drawn = mbcosim("plot", "m", "--node", 2, "e1", cwd=tmp_path)
    assert drawn.returncode == 4 and '"e1" is no quantity; there are V W X' in drawn.stderr


def test_plot_of_nothing_is_refused(tmp_path):
    (tmp_path / "o").write_text(OSCILLATOR.replace("begin: initial value;", "begin: initial value; output: none;"))
    assert mbcosim("run", "o", "-o", "p", cwd=tmp_path).returncode == 0
    for options in ((), ("--png", "p.svg")):
        drawn = mbcosim("plot", "p", "--node", 1, "z", *options, cwd=tmp_path)
        assert drawn.returncode == 4 and '"p.out" has no line of a step' in drawn.stderr and not drawn.stdout
    assert not (tmp_path / "p.svg").exists()


def test_plot_names_what_lacks(swing, tmp_path):
    for arguments, text in ((("q", "--node", 2, "z"), 'cannot read "q.out": No such file or directory; `mbcosim run DECK -o q`'),
                            (("p", "--node", 7, "z"), "p.mov has no label 7; there are 1 2"),
                            (("p", "--node", 2, "zz"), '"zz" is no quantity; there are'),
                            (("p", "--node", 2, "99"), "the rows of label 2 have 12 columns, not 99"),
                            (("p",), "say what to draw: --node 3 z")):
        drawn = mbcosim("plot", *arguments, cwd=swing)
        assert drawn.returncode == 4 and text in drawn.stderr
    for picture, text in ((tmp_path / "none" / "x.png", f'there is no folder "{tmp_path}/none"; make it with `mkdir -p`'),
                          (tmp_path / "x.jpg", "the name of a picture ends in .png, .svg or .pdf")):
        drawn = mbcosim("plot", "p", "--node", 2, "z", "--png", picture, cwd=swing)
        assert drawn.returncode == 4 and text in drawn.stderr
    nothing = mbcosim("plot", "p", "--node", 2, "z", "--png", tmp_path / "x.png", cwd=swing, PATH=str(tmp_path))
    assert nothing.returncode == 4 and "gnuplot-nox or python3-matplotlib" in nothing.stderr


# ---------------------------------------------------------------- diff

def test_diff_tells_same_results_and_the_largest_difference(swing, tmp_path):
    for path in swing.glob("p.*"):
        shutil.copy(path, tmp_path / path.name.replace("p.", "q."))
    same = mbcosim("diff", swing / "p", "q", cwd=tmp_path)
    assert same.returncode == 0 and same.stdout.splitlines() == ["ine  same", "jnt  same", "mov  same"]
    rows = (tmp_path / "q.mov").read_text().splitlines()
    fields = rows[11].split()
    fields[3] = repr(float(fields[3]) + 0.01)
    rows[11] = " ".join(fields)
    (tmp_path / "q.mov").write_text("\n".join(rows) + "\n")
    other = mbcosim("diff", swing / "p", "q", cwd=tmp_path)
    assert other.returncode == 1 and "mov  differs: 0.01 in label 2, column 3, record 5; 0.01 of the column's size" in other.stdout
    assert mbcosim("diff", swing / "p", "q", "--relative", 0.02, cwd=tmp_path).returncode == 0
    assert mbcosim("diff", swing / "p", "q", "--absolute", 0.02, cwd=tmp_path).returncode == 0
    (tmp_path / "q.jnt").unlink()
    assert "jnt  is missing in the second" in mbcosim("diff", swing / "p", "q", cwd=tmp_path).stdout
    nothing = mbcosim("diff", swing / "p", "nothing", cwd=tmp_path)
    assert nothing.returncode == 4 and 'there are no results "nothing.*"' in nothing.stderr


def test_diff_of_angles_does_not_count_whole_turns(swing, tmp_path):
    """An angle about 180 degrees is written with either sign."""
    for path in swing.glob("p.*"):
        shutil.copy(path, tmp_path / path.name.replace("p.", "q."))
    rows = [line.split() for line in (swing / "p.mov").read_text().splitlines()]
    for column, answer in ((4, "mov  same"), (7, "mov  differs: 360 in label")):
        turned = [[*row[:column], repr(float(row[column]) + 360), *row[column + 1:]] for row in rows]
        (tmp_path / "q.mov").write_text("\n".join(map(" ".join, turned)) + "\n")
        assert answer in mbcosim("diff", swing / "p", "q", cwd=tmp_path).stdout


def test_diff_tells_runs_of_another_length(swing, tmp_path):
    deck = tmp_path / "short"
    deck.write_text(open(os.path.join(MODELS, "pendulum.mbd")).read().replace("final time: 5.", "final time: 4."))
    assert mbcosim("run", deck, "-o", "s", cwd=tmp_path).returncode == 0
    other = mbcosim("diff", swing / "p", "s", cwd=tmp_path)
    assert other.returncode == 1 and "mov  label 2 differs in the number of records" in other.stdout


# ---------------------------------------------------------------- eig

def test_eig_prints_frequency_and_damping(tmp_path):
    (tmp_path / "o").write_text(OSCILLATOR)
    shown = mbcosim("eig", "o", cwd=tmp_path)
    (real, imaginary, frequency, damping), = [list(map(float, line.split())) for line in shown.stdout.splitlines()[2:]]
    assert real == pytest.approx(-2, rel=1e-6) and imaginary == pytest.approx(396**0.5, rel=1e-6)  # 2 kg, 8 N s/m, 800 N/m
    assert frequency == pytest.approx(396**0.5 / (2 * np.pi), rel=1e-6) and damping == pytest.approx(10, rel=1e-4)


def test_eig_of_a_later_state_and_of_few(tmp_path):
    wing = os.path.join(MODELS, "wing.mbd")
    shown = mbcosim("eig", wing, "-n", 4, "--near", 5, "--time", 0.01, cwd=tmp_path)
    assert shown.returncode == 0 and shown.stdout.startswith("eigenvalues at t = 0.01 s")
    assert 1 <= len(shown.stdout.splitlines()) - 2 <= 4
    assert mbcosim("eig", "nothing", cwd=tmp_path).returncode == 2


def test_eig_at_a_time_that_the_deck_does_not_reach(tmp_path):
    """Before its start, after its end, after a drive has ended it."""
    (tmp_path / "o").write_text(OSCILLATOR)

    def told(*arguments):
        done = mbcosim("eig", "o", *arguments, cwd=tmp_path)
        assert done.returncode == 4 and done.stdout == ""
        return done.stderr

    for time in ("-0.01", "10.5"):
        assert told("--time", time) == f"error: the deck runs from 0 to 10: --time {time} is not in between\n"
    assert 'expected a number that is finite, got "nan"' in told("--time", "nan")
    assert 'expected a number of at least 0, got "inf"' in told("--near", "inf")
    assert 'expected a number of at least 0, got "-5"' in told("--near", "-5")  # no line would be left
    assert mbcosim("eig", "o", "--time", 10, cwd=tmp_path).stdout.startswith("eigenvalues at t = 10 s")
    driver = 'begin: drivers; file: 7, fixed step, 4, 1, initial time, 0., time step, 1., bailout, upper, "samples"; end: drivers;\n'
    (tmp_path / "samples").write_text("0.\n0.\n0.\n0.\n")
    (tmp_path / "o").write_text(OSCILLATOR.replace("end: control data;", "file drivers: 1; end: control data;").replace("begin: elements;", driver + "begin: elements;"))
    assert told("--time", "8") == "error: the deck runs from 0 to 3: --time 8 is not in between\n"


def test_eig_shows_no_minus_before_a_zero(tmp_path):
    (tmp_path / "free").write_text(decks.body(spin="0., 0., 0."))
    shown = mbcosim("eig", "free", cwd=tmp_path)
    assert shown.returncode == 0 and len(shown.stdout.splitlines()) > 2 and "-0 " not in shown.stdout


def test_eig_tells_units_that_the_deck_declares(tmp_path):
    (tmp_path / "o").write_text(OSCILLATOR.replace("end: control data", 'units: length, "mm", mass, "t", time, "ms"; end: control data'))
    shown = mbcosim("eig", "o", cwd=tmp_path)
    assert shown.returncode == 0, shown.stderr
    first, heading = shown.stdout.splitlines()[:2]
    assert first == "eigenvalues at t = 0 ms"
    assert "time 0 to 10 ms, step 0.01 ms" in mbcosim("describe", "o", cwd=tmp_path).stdout
    assert all(unit in heading for unit in ("real [1/ms]", "imaginary [rad/ms]", "frequency [Hz]"))
    frequency = float(shown.stdout.splitlines()[2].split()[2])
    assert frequency == pytest.approx(1000 * 396**0.5 / (2 * np.pi), rel=1e-6)
    assert len(mbcosim("eig", "o", "-n", 2, "--near", 3000, cwd=tmp_path).stdout.splitlines()) == 3


# ---------------------------------------------------------------- shells

def test_completion_knows_commands_and_options(tmp_path):
    script = mbcosim("completion", "bash", cwd=tmp_path).stdout
    (tmp_path / "c").write_text(script)

    def complete(line):
        words = line.split(" ")
        ask = f"source c; COMP_WORDS=({' '.join(words)}); COMP_CWORD={len(words) - 1}; _mbcosim; echo ${{COMPREPLY[@]}}"
        return subprocess.run(["bash", "-c", ask], cwd=tmp_path, stdout=subprocess.PIPE, text=True, check=True).stdout.split()

    assert complete("mbcosim pl") == ["plot"] and set(complete("mbcosim plot --")) == {"--help", "--node", "--joint", "--column", "--png"}
    for shell in ("zsh", "fish"):
        assert "describe" in mbcosim("completion", shell, cwd=tmp_path).stdout
        if shutil.which(shell):
            (tmp_path / shell).write_text(mbcosim("completion", shell, cwd=tmp_path).stdout)
            assert subprocess.run([shell, "-n", shell], cwd=tmp_path, check=False).returncode == 0
    assert mbcosim("completion", "tcsh", cwd=tmp_path).returncode == 4


def test_the_manual_page_is_clean_roff_and_has_every_command(tmp_path):
    page = mbcosim("man", cwd=tmp_path).stdout
    commands = re.findall(r"^  (\w[\w-]*)  ", mbcosim("--help", cwd=tmp_path).stdout.partition("Subcommands:")[2], re.M)
    assert {"run", "plot", "diff", "eig", "init"} <= set(commands)
    assert [name.replace("\\", "") for name in re.findall(r"^\.SS (\S+)", page, re.M)] == commands
    assert set(re.findall(r"^\.(\S+)", page, re.M)) <= {"TH", "SH", "SS", "TP", "B", "I", "BR"}


def test_diagnostics_have_colours_on_a_terminal_only(tmp_path):
    (tmp_path / "bad").write_text("begin: dat;")

    def on_a_terminal(**environment):
        ours, theirs = pty.openpty()
        subprocess.run([MBCOSIM, "validate", "bad"], cwd=tmp_path, stderr=theirs, stdout=theirs, check=False,
                       env={**os.environ, "TERM": "xterm", **environment})
        os.close(theirs)
        text = b""
        with contextlib.suppress(OSError):  # what Linux answers at a terminal's end
            while more := os.read(ours, 10000):
                text += more
        os.close(ours)
        return text.decode()

    plain = mbcosim("validate", "bad", cwd=tmp_path).stdout
    coloured = on_a_terminal()
    assert "\x1b[1;31merror:\x1b[0m" in coloured and "\x1b[1;32m^" in coloured and "\x1b" not in plain
    assert re.sub(r"\x1b\[[\d;]*m", "", coloured).replace("\r\n", "\n") == plain == on_a_terminal(NO_COLOR="1").replace("\r\n", "\n")
