"""File driver `socket`: values that come as lines of text, from whoever connects. Codes of a force and of a stream hold the steps in the test's hand."""
import os
import threading
import time

import numpy as np
import pytest
from test_sockets import TIME_FACTOR, deck, drain, free_port, receive, run, shake  # noqa: F401

STEPS = 5
STAY = [[7, 8]] * (STEPS + 1)


def text_deck(address='local, "t"'):
    return deck('force: 5, external structural, socket, create, yes, path, "s", 1, 2;\n'
                'stream output: 9, stream name, "out", create, yes, path, "o", values, 2, drive, file, 1, 1, drive, file, 1, 2;',
                end=0.01 * STEPS, counts="forces: 1; file drivers: 1; output elements: 1;",
                drivers=f"begin: drivers; file: 1, socket, 2, initial values, 7., 8., {address}; end: drivers;")


def lines(*words, end="\n"):
    return "".join(word + end for word in words).encode()


def dial(done, text, to="t"):
    with done.connect(to) as connection:
        connection.sendall(text)


def values_of(done, says):
    """Values of both channels at the start and after each step; `says(k)` is called before step k."""
    code, sink = done.connect("s"), done.connect("o")
    shake(code, 0x202, 1)
    for k in range(1, STEPS + 2):
        receive(code, 1 + 144)
        says(k)
        code.sendall(b"\4")
    assert receive(code, 1) == b"\5"
    return np.frombuffer(drain(sink)).reshape(-1, 2).tolist()


def told(done, *texts, at=1, to="t"):
    """Values when all texts are said before one step."""
    def says(k):
        for text in texts if k == at else ():
            dial(done, text, to)

    return values_of(done, says)


def test_values_increments_and_impulses(run):  # noqa: F811
    done = run(text_deck())
    script = {1: ("label: 1", "value: 3.5", "."), 2: ("label: 2", "inc: yes", "value: 1.25", "."), 3: ("label: 2", "value: 1.", "."),
              4: ("label: 1", "imp: yes", "value: 9", ".")}
    assert values_of(done, lambda k: k in script and dial(done, lines(*script[k]))) == [
        [7, 8], [3.5, 8], [3.5, 9.25], [3.5, 10.25], [9, 10.25], [0, 10.25]]
    assert done.finish() == 0 and "warning" not in done.errors
    assert not os.path.exists(os.path.join(done.folder, "t"))


@pytest.mark.parametrize("script, expected", [
    (("label: 1", "value: 1", "inc: yes", "."), 2), (("label: 1", "inc: yes", "imp: yes", "inc: no", "value: 1", "."), 1),
    (("label: 1", "inc: yes", "value: 1", "value: 2", "."), 10), (("label: 1", "value: +2e1", "."), 20)])
def test_a_value_acts_with_each_line_after_it_and_no_ends_both_habits(run, script, expected):  # noqa: F811
    done = run(text_deck())
    assert told(done, lines(*script), at=2) == STAY[:2] + [[expected, 8]] * 4
    assert done.finish() == 0, done.errors


@pytest.mark.parametrize("text", [lines("LABEL :  1 ", "\tValue: 2", ".", end="\r\n"), lines("user: a", "password: b", "label: 1", "value: 2", ".")],
                         ids=["case, blanks, CRLF", "credentials that nobody asked for"])
def test_words_come_in_any_case_and_credentials_are_skipped_on_a_path(run, text):  # noqa: F811
    done = run(text_deck())
    assert told(done, text) == STAY[:1] + [[2, 8]] * 5
    assert done.finish() == 0 and "warning" not in done.errors


def test_connections_that_wait_are_served_one_after_the_other(run):  # noqa: F811
    done = run(text_deck())
    said = [lines("label: 1", f"value: {k}", ".") for k in range(30)] + [lines("label: 2", "inc: yes", "value: 1", ".")] * 30
    assert told(done, *said, at=3) == STAY[:3] + [[29, 38]] * 3
    assert done.finish() == 0, done.errors


SECRET = 'port, {}, password, user, "me", credentials, "word"'


@pytest.mark.parametrize("head, message", [
    (("user: me", "password: word"), ""), (("user: you", "password: word"), "wrong user or password"),
    (("user: me", "password: Word"), "wrong user or password"), ((), "missing user or password"), (("user: me",), "missing user or password"),
    (("password: word",), "`password:` is out of turn"), (("user: me", "user: me"), "`user:` is out of turn")])
def test_over_tcp_the_user_and_the_word_of_the_deck_are_asked_for(run, head, message):  # noqa: F811
    port = free_port()
    done = run(text_deck(SECRET.format(port)))
    assert told(done, lines(*head, "label: 1", "value: 2", "."), to=port) == STAY[:1] + [[7 if message else 2, 8]] * 5
    assert done.finish() == 0
    assert message in done.errors and ("warning" in done.errors) == bool(message) and "word" not in done.errors.replace("password", "")


NUMBER = "a value is a finite number, not "


@pytest.mark.parametrize("text, message", [
    (lines("label: 3", "value: 1", "."), 'illegal label "3": the channels are 1 to 2'), (lines("label: 0"), 'illegal label "0"'),
    (lines("label: 1x"), 'illegal label "1x"'), (lines("label: 99999999999999999999"), "illegal label"),
    (lines("value: 1", "label: 1", "."), "missing label"), (lines("."), "missing label"),
    (lines("label: 1", "label: 2", "value: 3", "."), "a connection sets one channel"),
    (lines("label: 1", "value: 1,5", "."), NUMBER + '"1,5"'), (lines("label: 1", "value: nan", "."), NUMBER + '"nan"'),
    (lines("label: 1", "value: 1e999", "."), NUMBER + '"1e999"'), (lines("label: 1", "value: -inf", "."), NUMBER + '"-inf"'),
    (lines("label: 1", "value:", "."), NUMBER + '""'), (lines("label: 1", "inc: perhaps"), '`inc:` takes yes or no, not "perhaps"'),
    (lines("label: 1", "add: 3"), 'unknown word "add"'), (lines("label: 1", "3"), 'no `word: text`, but "3"'),
    (b"label: 1" + b" " * 1100, "a line has more than 1023 bytes"), (bytes(range(128, 256)) + b"\n", 'no `word: text`, but "????'),
    (lines("label: 1", *["inc: yes"] * 1000, "imp: yes"), "more than 1000 lines"), (lines("label: 1"), "a connection was closed by the peer"),
    (b"", "a connection was closed by the peer")])
def test_what_a_connection_does_wrong_is_told_and_the_run_goes_on(run, text, message):  # noqa: F811
    done = run(text_deck())
    assert told(done, text, lines("label: 2", "value: 5", ".")) == STAY[:1] + [[7, 5]] * 5
    assert done.finish() == 0
    assert 'warning: socket drive "socket1" (t): ' + message in done.errors and "; the run goes on" in done.errors


def test_a_sum_that_is_not_finite_is_refused(run):  # noqa: F811
    done = run(text_deck())
    assert told(done, lines("label: 1", "inc: yes", "value: 1e308", "value: 1e308", "."))[-1] == [1e308, 8]
    assert done.finish() == 0 and "the sum of the increments is not finite" in done.errors


def test_a_value_before_the_line_that_is_wrong_has_acted(run):  # noqa: F811
    done = run(text_deck())
    assert told(done, lines("label: 1", "value: 2", "value: two", "."))[-1] == [2, 8]
    assert done.finish() == 0


def test_peers_that_stop_cost_a_step_no_more_than_the_time_out(run):  # noqa: F811
    done = run(text_deck(), "--peer-timeout", "1")
    silent, start = [], []

    def says(k):
        if k != 2:
            return
        for _ in range(3):
            silent.append(done.connect("t"))
            silent[-1].sendall(b"label: 1\nval")
        start.append(time.monotonic())

    code_values = []
    waiting = threading.Thread(target=lambda: code_values.append(values_of(done, says)))
    waiting.start()
    waiting.join(60 * TIME_FACTOR)
    assert done.finish() == 0, done.errors
    assert time.monotonic() - start[0] < 4 * TIME_FACTOR
    assert "a connection did not end its lines in time; the run goes on" in done.errors
    assert code_values == [STAY]
    for each in silent:
        each.close()


def test_mistakes_are_told_up_to_a_number(run):  # noqa: F811
    done = run(text_deck())
    assert told(done, *[b"nonsense\n"] * 40) == STAY
    assert done.finish() == 0
    assert done.errors.count("warning") == 20 and done.errors.count("further mistakes are not told") == 1


def test_nobody_is_waited_for(run):  # noqa: F811
    done = run(text_deck())
    assert told(done) == STAY
    assert done.finish() == 0 and "warning" not in done.errors


def alone(address):
    return deck("force: 5, absolute, 1, position, null, 1.,0.,0., file, 1, 1;", counts="forces: 1; file drivers: 1;",
                drivers=f"begin: drivers; file: 1, socket, 1, initial values, 3., {address}; end: drivers;")


def test_without_sockets_the_values_stay_as_they_start(run, tmp_path):  # noqa: F811
    done = run(alone('local, "t"'), "--no-deck-sockets")
    assert done.finish() == 0 and not (tmp_path / "t").exists()
    assert done.last(1)[2][0] == pytest.approx(0.1 + 3 * 0.02, abs=1e-6)


def test_a_path_that_is_taken_is_refused(run, tmp_path):  # noqa: F811
    (tmp_path / "t").write_text("")
    done = run(alone('local, "t"'))
    assert done.finish() == 5
    assert 'error: socket drive "socket1" (t): cannot listen: t exists and is not a socket' in done.errors


@pytest.mark.parametrize("address, message", [
    ('create, no, local, "t"', "the driver always listens"), ("port, 5555, socket type, udp", "input over UDP is not supported"),
    ("port, 5555, pam", "an authentication that is supported expected"), ("port, 70000", "a port is a number from 1 to 65535"),
    ('port, 5555, password, user, "me", credentials, prompt', "a run asks nobody for it"),
    ('port, 5555, password, user, "", credentials, "w"', "must not be empty")])
def test_what_is_not_served_is_refused_by_its_place(run, address, message):  # noqa: F811
    done = run(alone(address))
    assert done.finish() == 2
    assert "deck:" in done.errors and message in done.errors
