"""`mbcosim view`: a daemon of one's own, with the page on a deck."""
import os
import re
import select
import signal
import subprocess
import time
import urllib.error
import urllib.request

import pytest
from conftest import BIN, TIME_FACTOR, wait_for

MBCOSIM = os.path.join(BIN, "mbcosim")


class View:
    def __init__(self, temporary, *arguments):
        self.process = subprocess.Popen([MBCOSIM, "view", *arguments], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True,
                                        env={**os.environ, "TMPDIR": str(temporary)})

    def address(self):
        text, end = "", time.monotonic() + 30 * TIME_FACTOR
        while time.monotonic() < end:
            if select.select([self.process.stdout], [], [], 0.1)[0]:
                line = self.process.stdout.readline()
                text += line
                found = re.match(r"(http://\S+)$", line)
                if found:
                    return found.group(1)
        raise AssertionError(f"no address within the time:\n{text}")

    def daemon(self):
        """Process identifier of the daemon."""
        with open(f"/proc/{self.process.pid}/task/{self.process.pid}/children") as children:
            return int(children.read().split()[0])


@pytest.fixture
def view(tmp_path, request):
    views = []

    def start(*arguments):
        views.append(View(tmp_path, *arguments))
        return views[-1]

    yield start
    for started in views:
        started.process.kill()
        started.process.communicate(timeout=30 * TIME_FACTOR)


def read_page(opener, address):
    """Text of the page; skips where the daemon was built without it."""
    try:
        with opener.open(address.split("#")[0], timeout=30 * TIME_FACTOR) as answer:
            return answer.read().decode()
    except urllib.error.HTTPError as error:
        if error.code == 404 and b"built without its page" in error.read():
            pytest.skip("the daemon is built without its page")
        raise


def gone(pid):
    try:
        with open(f"/proc/{pid}/stat") as stat:
            return stat.read().split()[2] == "Z"
    except FileNotFoundError:
        return True


def test_the_address_leads_to_the_page_with_the_deck(view, pendulum):
    address = view(pendulum).address()
    page, simulation = address.split("#simulation=")
    assert simulation.startswith("simulations/")
    opener = urllib.request.build_opener(urllib.request.HTTPCookieProcessor())
    assert "<title>mbcosim</title>" in read_page(opener, page)
    request = urllib.request.Request(page.split("?")[0] + "mbcosim.v1.Simulations/GetSimulation", b'{"simulation": "%s"}' % simulation.encode(),
                                     {"Content-Type": "application/json"})
    with opener.open(request, timeout=30 * TIME_FACTOR) as answer:  # the cookie lets it in
        assert b'"displayName":"pendulum.mbd"' in answer.read()


def test_the_page_needs_nothing_from_elsewhere(view, pendulum):
    address = view(pendulum).address()
    text = read_page(urllib.request.build_opener(urllib.request.HTTPCookieProcessor()), address)
    assert "default-src 'none'" in text and "connect-src 'self'" in text
    assert not re.search(r"<(?:script|link|img|iframe)[^>]+(?:src|href)=[\"'](?!data:)", text)


@pytest.mark.parametrize("how", [signal.SIGTERM, signal.SIGINT])
def test_a_signal_ends_it_with_its_daemon_and_leaves_nothing(view, pendulum, tmp_path, how):
    shown = view(pendulum)
    shown.address()
    daemon = shown.daemon()
    shown.process.send_signal(how)
    assert shown.process.wait(30 * TIME_FACTOR) == 0
    assert gone(daemon) and not os.listdir(tmp_path)


def test_options_of_another_daemon_are_not_its_own(view, pendulum, tmp_path, monkeypatch):
    (tmp_path / "tokens").write_text("a-token control ann\n")
    monkeypatch.setenv("MBCOSIMD_TOKENS", str(tmp_path / "tokens"))
    monkeypatch.setenv("MBCOSIMD_NO_SUCH_OPTION", "1")
    assert "token=" in view(pendulum).address()


def test_a_long_name_of_the_temporary_folder_is_no_hindrance(pendulum, tmp_path):
    long = tmp_path / ("a" * 100)
    long.mkdir()
    shown = View(long, pendulum)
    try:
        assert "token=" in shown.address()
        with open(f"/proc/{shown.daemon()}/cmdline") as command:
            folder = os.path.dirname(re.search("unix:([^\0]+)", command.read()).group(1))
        assert os.path.dirname(folder) == "/tmp" and os.stat(folder).st_mode & 0o777 == 0o700
    finally:
        shown.process.terminate()
        shown.process.communicate(timeout=30 * TIME_FACTOR)
    assert not os.path.exists(folder) and not os.listdir(long)


def test_a_daemon_that_ends_is_told(view, pendulum):
    shown = view(pendulum)
    shown.address()
    os.kill(shown.daemon(), signal.SIGKILL)
    assert shown.process.wait(30 * TIME_FACTOR) == 5
    assert shown.process.stderr.read() == "mbcosim view: error: the daemon was ended by signal 9\n"


def test_a_kill_ends_the_daemon_too(view, pendulum):
    shown = view(pendulum)
    shown.address()
    daemon = shown.daemon()
    shown.process.kill()
    shown.process.wait(30 * TIME_FACTOR)
    wait_for(lambda: gone(daemon), 20)


def test_a_wrong_deck_is_refused_with_its_place(view, tmp_path):
    deck = tmp_path / "bad.mbd"
    deck.write_text("begin: data;\n  problem: nonsense;\nend: data;\n")
    process = view(str(deck)).process
    printed, complaint = process.communicate(timeout=30 * TIME_FACTOR)
    assert process.returncode == 2 and "bad.mbd:2:" in printed + complaint


@pytest.mark.parametrize("arguments", [[], ["missing.mbd"], ["--nonsense"]])
def test_wrong_arguments_are_refused(view, arguments):
    process = view(*arguments).process
    process.communicate(timeout=30 * TIME_FACTOR)
    assert process.returncode in (2, 4)
