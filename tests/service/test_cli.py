"""The command line: exit codes, output, and the same numbers as the service."""
import contextlib
import json
import os
import re
import resource
import signal
import subprocess
import time

import numpy as np
import pytest

import decks
from conftest import BIN, TIME_FACTOR, wait_for

MBCOSIM = os.path.join(BIN, "mbcosim")


def mbcosim(*arguments, cwd=None):
    return subprocess.run([MBCOSIM, *arguments], cwd=cwd, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, timeout=60)


@pytest.fixture
def deck(tmp_path):
    path = tmp_path / "deck"
    path.write_text(decks.body())
    return path


def test_run_writes_what_the_service_gives(server, deck, tmp_path):
    run = mbcosim("run", str(deck), "-o", str(tmp_path / "out"))
    assert (run.returncode, run.stdout, run.stderr) == (0, "", "")
    rows = np.loadtxt(tmp_path / "out.mov")
    with server.load(str(deck)) as simulation:
        simulation.step(1000)
        assert rows[-1, 1:4] == pytest.approx(simulation["node.structural.1.X"], rel=1e-5, abs=1e-6)
    assert {p.suffix for p in tmp_path.iterdir()} <= {"", ".mov", ".out", ".log", ".ine"}


def test_default_prefix_is_the_decks_name(deck, tmp_path):
    assert mbcosim("run", "deck", cwd=tmp_path).returncode == 0
    assert (tmp_path / "deck.mov").exists()
    os.rename(deck, tmp_path / "wing.v2.mbd")
    assert mbcosim("run", "wing.v2.mbd", cwd=tmp_path).returncode == 0
    assert (tmp_path / "wing.v2.mov").exists()


@pytest.mark.parametrize("folder", ["results", "results/"])
def test_a_folder_takes_files_of_the_decks_name(deck, tmp_path, folder):
    (tmp_path / "results").mkdir()
    assert mbcosim("run", str(deck), "-o", folder, cwd=tmp_path).returncode == 0
    assert {"deck.mov", "deck.out", "deck.log"} <= {path.name for path in (tmp_path / "results").iterdir()}


def test_a_deck_comes_from_a_pipe(deck, tmp_path):
    (tmp_path / "part").write_text(PART)

    def run(*arguments, text=f'include: "part";\n{deck.read_text()}'):
        return subprocess.run([MBCOSIM, "run", "/dev/stdin", *arguments], cwd=tmp_path, input=text, capture_output=True, text=True, timeout=60)
    assert mbcosim("run", str(deck)).returncode == 0
    piped = run("-o", "out")
    assert (piped.returncode, piped.stderr) == (0, "")
    assert (tmp_path / "out.mov").read_bytes() == (tmp_path / "deck.mov").read_bytes()
    wrong = run("-o", "out", text='include: "nowhere";')
    assert wrong.returncode == 2 and wrong.stderr.startswith('stdin:1:10: error: cannot open "nowhere"')
    for nameless in ([], ["-o", "./"]):
        refused = run(*nameless)
        assert refused.returncode == 4 and "a deck from a pipe has no name for its results" in refused.stderr
        assert "give them one with `-o PREFIX`" in refused.stderr


@contextlib.contextmanager
def endless_run(deck):
    """A run that has written results; it is interrupted at the end."""
    deck.write_text(decks.endless())
    process = subprocess.Popen([MBCOSIM, "run", str(deck)], stderr=subprocess.DEVNULL)
    output = deck.with_suffix(".mov")
    try:
        wait_for(lambda: output.exists() and output.stat().st_size > 0)
        yield
    finally:
        process.send_signal(signal.SIGINT)
        assert process.wait(60 * TIME_FACTOR) == 130


def test_two_runs_do_not_write_the_same_files(tmp_path):
    deck = tmp_path / "deck"
    with endless_run(deck):
        second = mbcosim("run", str(deck))
        assert second.returncode == 4 and "another run is writing it; give each a prefix of its own" in second.stderr
    assert np.isfinite(np.loadtxt(tmp_path / "deck.mov")).all()  # whole lines, in order
    deck.write_text(decks.body())
    assert mbcosim("run", str(deck)).returncode == 0  # what is left of a run that has ended is in nobody's way


def test_deck_errors_exit_with_2(tmp_path):
    bad = tmp_path / "bad"
    bad.write_text(decks.body().replace("body: 1, 1", "boddy: 1, 1"))
    run = mbcosim("run", str(bad))
    assert run.returncode == 2 and "bad:9:" in run.stderr and "^" in run.stderr
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bad"]
    assert mbcosim("run", str(tmp_path / "nothing")).returncode == 2
    assert mbcosim("run", str(tmp_path)).returncode == 2


def test_numerical_failure_exits_with_3(tmp_path):
    deck = tmp_path / "deck"
    deck.write_text(decks.impossible())
    run = mbcosim("run", str(deck))
    assert run.returncode == 3 and "residual" in run.stderr


def test_a_drive_without_a_value_exits_with_3(tmp_path):
    deck = tmp_path / "deck"
    for card in ("end: initial value;", "end: control data;"):
        drive = 'string, "sqrt(0.25 - Time)"'
        extra = f"strategy: change, {drive}; min time step: 1e-6; " if "initial" in card else f"output meter: {drive}; "
        deck.write_text(decks.body().replace(card, extra + card))
        run = mbcosim("run", str(deck))
        assert run.returncode == 3 and "sqrt: argument" in run.stderr


def test_options_of_a_run_mean_the_same_wherever_they_stand(deck, tmp_path):
    """Plain command lines are read by hand, before all that reads the others is set up."""
    plain = [["-q", "--threads", "1"], ["--quiet", "--threads", "2"], []]
    others = [["-q", "-q"], ["--threads=1"], ["--peer-timeout", "5"], ["--no-deck-sockets"]]
    for number, options in enumerate(plain + others):
        prefix = tmp_path / f"out{number}"
        for name in [["-o", str(prefix)], ["--output", str(prefix)], [f"--output={prefix}"], [f"-o{prefix}"]]:
            for words in (["run", str(deck), *name, *options], ["run", *options, *name, str(deck)]):
                run = mbcosim(*words)
                assert (run.returncode, run.stdout, run.stderr) == (0, "", ""), words
                assert prefix.with_suffix(".mov").read_bytes() == (tmp_path / "out0.mov").read_bytes()
                if number:
                    prefix.with_suffix(".mov").unlink()  # each writes its own


@pytest.mark.parametrize("words, told", [
    (["-o"], "-o"), (["--threads", "0"], "--threads"), (["--threads", "1025"], "--threads"),
    (["--threads", "2x"], "--threads"), (["--threads"], "--threads"), (["-x"], "-x"), (["another"], "another"), ([""], "")])
def test_options_of_a_run_that_make_no_sense_are_refused(deck, words, told):
    run = mbcosim("run", str(deck), *words)
    assert run.returncode == 4 and told in run.stderr and not run.stdout
    assert not deck.with_suffix(".mov").exists()


def test_wrong_usage_exits_with_4(deck):
    assert mbcosim().returncode == 4
    assert mbcosim("run").returncode == 4
    assert mbcosim("run", str(deck), "-o", "/nonexistent/folder/x").returncode == 4


def test_results_that_cannot_be_written_fail_before_the_first_step(tmp_path):
    deck = tmp_path / "deck"
    deck.write_text(decks.body(final_time=1e9))
    run = mbcosim("run", str(deck), "-o", str(tmp_path / "no" / "x"))
    assert run.returncode == 4
    assert f'cannot write "{tmp_path}/no/x.out": No such file or directory' in run.stderr


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no full device")
def test_a_full_device_ends_the_run_at_the_step(tmp_path):
    deck = tmp_path / "deck"
    deck.write_text(decks.body(final_time=1e9))
    (tmp_path / "x.mov").symlink_to("/dev/full")
    run = mbcosim("run", str(deck), "-o", str(tmp_path / "x"))
    assert run.returncode == 4 and 'x.mov": No space left on device' in run.stderr


def test_a_file_beyond_its_limit_is_an_error_and_ends_with_a_whole_line(tmp_path):
    deck = tmp_path / "deck"
    deck.write_text(decks.body(final_time=1e9))
    limit = 100000

    def small_files():
        resource.setrlimit(resource.RLIMIT_FSIZE, (limit, limit))

    run = subprocess.run([MBCOSIM, "run", str(deck), "-o", str(tmp_path / "x")], stderr=subprocess.PIPE, text=True, timeout=60,
                         preexec_fn=small_files)
    assert run.returncode == 4 and "File too large" in run.stderr
    sizes = [(tmp_path / f"x.{end}").stat().st_size for end in ("mov", "out")]
    assert max(sizes) > limit - 500
    for end in ("mov", "out", "ine"):
        assert (tmp_path / f"x.{end}").read_bytes().endswith(b"\n")


def test_results_never_overwrite_the_deck(tmp_path):
    (tmp_path / "x.log").write_text(decks.body())
    (tmp_path / "main").write_text('include: "x.log";\n')
    for deck in ("x.log", "main"):
        run = mbcosim("run", deck, "-o", "x", cwd=tmp_path)
        assert run.returncode == 4 and 'would overwrite "x.log"' in run.stderr
    assert (tmp_path / "x.log").read_text() == decks.body()
    os.link(tmp_path / "x.log", tmp_path / "y.mov")
    assert mbcosim("run", "x.log", "-o", "y", cwd=tmp_path).returncode == 4
    # An eigenanalysis writes PREFIX_0.m.
    (tmp_path / "eig_0.m").write_text(PART)
    modes = decks.body().replace("end: initial value;", "eigenanalysis: 0., parameter, .1, output full matrices; end: initial value;")
    (tmp_path / "modes").write_text('include: "eig_0.m";\n' + modes)
    run = mbcosim("run", "modes", "-o", "eig", cwd=tmp_path)
    assert run.returncode == 4 and 'would overwrite "eig_0.m"' in run.stderr
    assert (tmp_path / "eig_0.m").read_text() == PART


PART = "set: const real unused = 1.;\n"


@pytest.mark.parametrize("part, address", [
    ("a.mbd", '"in.dat", "a.mbd"'), ("a.tmp", '"in.dat", "a"'), ("a.mbd", '"a.mbd", unlink, "out.dat"'),
    ("a.mbd", '"in.dat", "out.dat", sleep time, .01, 1, 1, echo, "a.mbd"')])
def test_files_for_external_codes_never_take_the_place_of_the_deck(tmp_path, part, address):
    (tmp_path / part).write_text(PART)
    (tmp_path / "in.dat").write_text("1. 0. 0. 0. 0. 0.\n")
    card = f"force: 5, external structural, {address}" + ("" if "echo" in address else ", sleep time, .01, 1, 1")
    deck = decks.body().replace("rigid bodies: 1;", "rigid bodies: 1; forces: 1;").replace("end: elements;", card + "; end: elements;")
    (tmp_path / "main").write_text(f'include: "{part}";\n' + deck)
    run = mbcosim("run", "main", "-o", "out", "--peer-timeout", "1", cwd=tmp_path)
    assert run.returncode == 4 and f'force 5 would overwrite or remove "{part}"' in run.stderr, run.stderr
    assert "hint: give the files that this card names other names" in run.stderr
    assert (tmp_path / part).read_text() == PART
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted([part, "in.dat", "main"])
    assert mbcosim("run", "main", "-o", "out", "--no-deck-sockets", cwd=tmp_path).returncode == 0


def test_the_echo_of_a_stream_never_takes_the_place_of_the_deck(tmp_path):
    (tmp_path / "a.mbd").write_text(PART)
    driver = 'begin: drivers; file: 1, stream, stream drive name, "push", create, yes, path, "s", echo, "a.mbd", 1; end: drivers;'
    deck = decks.body().replace("rigid bodies: 1;", "rigid bodies: 1; file drivers: 1;")
    deck = deck.replace("begin: elements;", driver + " begin: elements;")
    (tmp_path / "main").write_text('include: "a.mbd";\n' + deck)
    run = mbcosim("run", "main", "-o", "out", "--peer-timeout", "1", cwd=tmp_path)
    assert run.returncode == 4 and 'would overwrite or remove "a.mbd"' in run.stderr, run.stderr
    assert (tmp_path / "a.mbd").read_text() == PART


def test_outputs_that_exist_and_cannot_be_written_are_found_before_anything_is_created(tmp_path):
    (tmp_path / "deck").write_text(decks.body(final_time=1e9))
    for folder, option in (("x.mov", "text"), ("x.ine", "text"), ("x.nc", "netcdf")):
        (tmp_path / folder).mkdir()
        run = mbcosim("run", "deck", "-o", "x", "--format", option, cwd=tmp_path)
        assert run.returncode == 4 and f'cannot write "{folder}": Is a directory' in run.stderr
        assert sorted(p.name for p in tmp_path.iterdir()) == sorted(["deck", folder])
        (tmp_path / folder).rmdir()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everything")
def test_outputs_without_permission_are_found_before_anything_is_created(tmp_path):
    (tmp_path / "deck").write_text(decks.body(final_time=1e9))
    (tmp_path / "x.mov").touch(mode=0o400)
    run = mbcosim("run", "deck", "-o", "x", cwd=tmp_path)
    assert run.returncode == 4 and 'cannot write "x.mov": Permission denied' in run.stderr
    assert sorted(p.name for p in tmp_path.iterdir()) == ["deck", "x.mov"]


def test_a_netcdf_file_without_its_header_is_removed(tmp_path):
    (tmp_path / "deck").write_text(decks.body())
    run = subprocess.run([MBCOSIM, "run", "deck", "-o", "x", "--format", "netcdf"], cwd=tmp_path, stderr=subprocess.PIPE, text=True,
                         timeout=60, preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, (512, 512)))
    assert run.returncode == 4 and "cannot write x.nc" in run.stderr
    assert sorted(p.name for p in tmp_path.iterdir()) == ["deck"]


@pytest.mark.skipif(not os.path.exists("/dev/full"), reason="no full device")
def test_a_full_standard_output_is_an_error(deck):
    for arguments in (["describe", str(deck)], ["describe", str(deck), "--json"], ["keywords"], ["--help"], ["--version"]):
        with open("/dev/full", "w", encoding="utf-8") as full:
            run = subprocess.run([MBCOSIM, *arguments], stdout=full, stderr=subprocess.PIPE, text=True, timeout=60)
        assert run.returncode == 4 and "cannot write to the standard output" in run.stderr


def test_a_reader_that_left_is_an_error_and_no_death(deck):
    run = subprocess.run(["sh", "-c", f"({MBCOSIM} keywords; echo $? >&2) | true"], stderr=subprocess.PIPE, text=True, timeout=60)
    assert run.stderr.strip().splitlines()[-1] in ("0", "4")  # 0: it was faster than the reader


def test_output_flags_of_a_motion_stream_come_once(tmp_path):
    (tmp_path / "deck").write_text(
        """begin: data; problem: initial value; end: data;
begin: initial value; initial time: 0.; final time: .1; time step: 1e-2; tolerance: 1e-6; max iterations: 10; end: initial value;
begin: control data; structural nodes: 1; rigid bodies: 1; output elements: 1; end: control data;
begin: nodes; structural: 1, dynamic, null, eye, null, null; end: nodes;
begin: elements; body: 1, 1, 1., null, eye;
stream motion output: 10, stream name, "m", grpc, output flags, position, velocity, position, 1;
end: elements;
""")
    run = mbcosim("validate", str(tmp_path / "deck"))
    assert run.returncode == 2 and "deck:6:85: error: output element 10: stream output: `output flags` has the same twice" in run.stdout + run.stderr


def test_a_deck_of_nothing_is_refused(tmp_path):
    for text in ("", "# nothing\n"):
        (tmp_path / "empty").write_text(text)
        run = mbcosim("run", str(tmp_path / "empty"))
        assert run.returncode == 2 and "no nodes and no elements" in run.stderr


def test_a_run_without_a_final_time_tells_that_it_made_no_step(tmp_path):
    (tmp_path / "deck").write_text(re.sub(r"final time: *[^;]*;", "", decks.body()))
    run = mbcosim("run", str(tmp_path / "deck"))
    assert run.returncode == 0
    assert "note: no step was made: the final time, 0 s (0 without the card `final time`)" in run.stderr
    assert "hint: write a later `final time`" in run.stderr


def test_a_deck_that_asks_for_no_step_is_not_told_of_its_final_time(tmp_path):
    (tmp_path / "deck").write_text(decks.body().replace("end: initial value;", "abort after: derivatives; end: initial value;"))
    run = mbcosim("run", str(tmp_path / "deck"))
    assert (run.returncode, run.stderr) == (0, "")
    assert (tmp_path / "deck.out").read_text().endswith("End of derivatives; no simulation is required.\n")


def test_print_goes_to_standard_output_or_a_file(tmp_path):
    connections = "Element connections\nAutomatic Structural(1) connecting\n        Structural(1)\nRigid Body(1) connecting\n        Structural(1)\n"
    for options, text in (("", connections), (", to file", "")):
        (tmp_path / "deck").write_text(decks.body().replace("end: control data;", f"print: element connection{options}; end: control data;"))
        run = mbcosim("run", str(tmp_path / "deck"))
        assert (run.returncode, run.stdout) == (0, text)
    assert (tmp_path / "deck.dof").read_text() == connections


def test_a_deck_that_is_not_there_is_told_with_the_reason(tmp_path):
    run = mbcosim("run", "nothing.mbd", cwd=tmp_path)
    assert run.returncode == 2 and 'nothing.mbd: error: cannot open "nothing.mbd": No such file or directory' in run.stderr
    assert "hint: check the name of the deck's main file" in run.stderr


@pytest.mark.parametrize("content", [b"\x7fELF\x02\x01\x01\0\0\0", b"PK\x03\x04\x14\0\0\0", "begin: data;\n".encode("utf-16")])
def test_a_file_that_is_no_text_is_told_so(tmp_path, content):
    (tmp_path / "binary").write_bytes(content)
    run = mbcosim("run", "binary", cwd=tmp_path)
    assert run.returncode == 2 and run.stderr.count("error:") == 1
    assert "error: this file is no text: it has bytes that are zero" in run.stderr
    assert "hint: a deck is text in ASCII or UTF-8" in run.stderr


def test_a_run_in_real_time_lasts_as_long_as_the_model(tmp_path):
    deck = tmp_path / "deck"
    deck.write_text(decks.body(final_time=0.4))
    begun = time.monotonic()
    assert mbcosim("run", str(deck), "--real-time").returncode == 0
    assert time.monotonic() - begun > 0.38


def test_steps_that_cannot_keep_up_with_the_clock_are_counted(tmp_path):
    deck = tmp_path / "deck"
    deck.write_text(decks.body(step="1.e-9", final_time="9.95e-8"))
    run = mbcosim("run", str(deck), "--real-time")
    assert run.returncode == 0
    assert re.search(r"note: 1\d\d of 1\d\d steps ended late, the latest by \S+ s", run.stderr), run.stderr


@pytest.mark.parametrize("arguments, told", [
    (("validte", "deck"), 'mbcosim: there is no command "validte"; did you mean "validate"?'),
    (("frobnicate",), 'mbcosim: there is no command "frobnicate"; `mbcosim --help` lists them'),
    (("diff", "a", "b", "--relative", "-1"), '--relative: expected a number of at least 0, got "-1"'),
    (("diff", "a", "b", "--absolute", "1e-3x"), '--absolute: expected a number of at least 0, got "1e-3x"'),
    (("run", "deck", "--threads", "0"), '--threads: expected a number from 1 to 1024, got "0"'),
    (("run", "deck", "--peer-timeout", "nan"), '--peer-timeout: expected a number from 0.001 to 1000000, got "nan"')])
def test_wrong_words_and_numbers_are_told_with_what_is_expected(arguments, told):
    run = mbcosim(*arguments)
    assert run.returncode == 4 and run.stderr.startswith(told), run.stderr


def test_messages_name_files_as_they_were_typed(deck, tmp_path):
    folder = tmp_path / "parts"
    folder.mkdir()
    (folder / "wrong.inc").write_text("set: real a = ;\n")
    (folder / "outer.mbd").write_text('include: "wrong.inc";\n' + deck.read_text())
    typed = str(folder / "outer.mbd")
    run = mbcosim("validate", typed)
    assert run.returncode == 2 and f"{folder}/wrong.inc:1:" in run.stdout and f"included from {typed}:1" in run.stdout
    run = mbcosim("run", str(folder))
    assert f"{folder}: error:" in run.stderr and "not a regular file" in run.stderr


def test_interrupt_exits_with_130(tmp_path):
    with endless_run(tmp_path / "deck"):
        pass


def test_validate_warns_of_a_deck_that_run_would_refuse(tmp_path):
    empty = tmp_path / "empty.mbd"
    empty.write_text("set: real m = 1.;\n")
    checked = mbcosim("validate", str(empty))
    assert checked.returncode == 0
    assert f"{empty}: warning: there is nothing to run" in checked.stdout
    assert mbcosim("run", str(empty), "-o", str(tmp_path / "out")).returncode == 2


def test_validate_and_describe_as_json(deck, tmp_path):
    good = mbcosim("validate", str(deck), "--json")
    assert good.returncode == 0 and json.loads(good.stdout) == {"ok": True, "diagnostics": []}
    description = json.loads(mbcosim("describe", str(deck), "--json").stdout)
    assert description["unknowns"] == 12
    assert "node.structural.1.X" in [v["name"] for v in description["variables"]]
    bad = tmp_path / "bad"
    bad.write_text("begin: nothing;")
    report = mbcosim("validate", str(bad), "--json")
    assert report.returncode == 2 and json.loads(report.stdout)["diagnostics"]


def test_symbols_are_given_on_the_command_line(tmp_path):
    deck = tmp_path / "deck"
    deck.write_text("set: const real h = 1.e-3; set: string s = \"x\";\n" + decks.body(step="h"))
    described = json.loads(mbcosim("describe", str(deck), "-D", "h=0.25", "-D", "s=5m", "--json").stdout)
    assert described["time_step"] == 0.25
    symbols = {s["name"]: s for s in described["symbols"]}
    assert (symbols["h"]["declared"], symbols["h"]["given"], symbols["s"]["value"]) == (0.25, True, "5m")
    assert mbcosim("run", str(deck), "-D", "h=0.25", "-o", str(tmp_path / "out"), "-q").returncode == 0
    assert len((tmp_path / "out.mov").read_text().splitlines()) == 5
    wrong = mbcosim("validate", str(deck), "-D", "H=1")
    assert wrong.returncode == 2 and 'did you mean "h"?' in wrong.stdout
    assert mbcosim("validate", str(deck), "-D", "h").returncode == 4
    assert mbcosim("validate", str(deck), "-D", "h=1", "-D", "h=2").returncode == 4


def test_help_and_version():
    assert mbcosim("--version").stdout.startswith("mbcosim ")
    assert "Exit codes" in mbcosim("--help").stdout
