"""The language server over its standard input and output, as an editor speaks to it."""
import json
import os
import pathlib
import re
import subprocess

import pytest

from conftest import BIN, MODELS, TIME_FACTOR

BAD = """begin: data;
    problem: initial value;
end: data;
set: const real mass = 2.;   # kg – not used
begin: initial vale;
"""
NEW_LINE = "\n"


class Editor:
    """Speaks the protocol with `mbcosim lsp`."""

    def __init__(self):
        self.process = subprocess.Popen([os.path.join(BIN, "mbcosim"), "lsp", "--stdio"], stdin=subprocess.PIPE, stdout=subprocess.PIPE)
        self.asked, self.diagnostics = 0, {}

    def send(self, **message):
        self.send_all([message])

    def send_all(self, messages):
        """Several messages in one write: the server has all of them before it answers the first."""
        bodies = [json.dumps({"jsonrpc": "2.0", **message}).encode() for message in messages]
        self.process.stdin.write(b"".join(b"Content-Length: %d\r\n\r\n" % len(body) + body for body in bodies))
        self.process.stdin.flush()

    def receive(self):
        length = 0
        while (line := self.process.stdout.readline().strip()):
            name, _, value = line.partition(b":")
            length = int(value) if name == b"Content-Length" else length
        return json.loads(self.process.stdout.read(length))

    def ask(self, method, **parameters):
        """Answer to a request; diagnostics that come before are kept."""
        self.asked += 1
        self.send(id=self.asked, method=method, params=parameters)
        while (message := self.receive()).get("id") != self.asked:
            self.keep(message)
        return message.get("result") if "error" not in message else message["error"]

    def keep(self, message):
        assert message["method"] == "textDocument/publishDiagnostics"
        self.diagnostics[message["params"]["uri"]] = message["params"]["diagnostics"]

    def open(self, uri, text):
        """Diagnostics of a document that is opened."""
        self.send(method="textDocument/didOpen", params={"textDocument": {"uri": uri, "languageId": "mbcosim", "version": 1, "text": text}})
        return self.next_diagnostics(uri)

    def change(self, uri, *texts):
        self.send_all([{"method": "textDocument/didChange",
                        "params": {"textDocument": {"uri": uri, "version": version}, "contentChanges": [{"text": text}]}}
                       for version, text in enumerate(texts, 2)])
        return self.next_diagnostics(uri)

    def next_diagnostics(self, uri):
        while True:
            message = self.receive()
            self.keep(message)
            if message["params"]["uri"] == uri:
                return self.diagnostics[uri]

    def at(self, method, uri, text, mark, shift=0):
        """A request about the place of `mark` in a text."""
        before = text[:text.index(mark) + shift]
        position = {"line": before.count(NEW_LINE), "character": len(before.rpartition(NEW_LINE)[2].encode("utf-16-le")) // 2}
        return self.ask(f"textDocument/{method}", textDocument={"uri": uri}, position=position)


@pytest.fixture
def editor():
    editor = Editor()
    capabilities = editor.ask("initialize", processId=None, rootUri=None, capabilities={})["capabilities"]
    assert capabilities["hoverProvider"] and capabilities["definitionProvider"] and capabilities["textDocumentSync"] == 1
    editor.send(method="initialized", params={})
    yield editor
    if editor.process.poll() is None:
        assert editor.ask("shutdown") is None
        editor.send(method="exit")
    assert editor.process.wait(20 * TIME_FACTOR) == 0


@pytest.fixture
def pendulum_text():
    return pathlib.Path(MODELS, "pendulum.mbd").read_text()


def raw(editor, body):
    editor.process.stdin.write(b"Content-Length: %d\r\n\r\n" % len(body) + body)
    editor.process.stdin.flush()


@pytest.mark.parametrize("body, code", [(b"{\"id\": 7, ", -32700), (b"[" * 100_000, -32700), (b'{"id": 7, "method": 5}', -32600),
                                        (b'{"id": 7, "method": null}', -32600)])
def test_a_bad_message_is_told_and_the_next_is_served(editor, pendulum_text, body, code):
    raw(editor, body)
    answer = editor.receive()
    assert answer["error"]["code"] == code and answer["id"] == (None if code == -32700 else 7)
    raw(editor, b'{"method": 5}')  # a notification has no answer
    assert editor.open("file:///a.mbd", pendulum_text) == []


def test_half_a_surrogate_pair_does_not_end_it(editor, pendulum_text):
    """Editors count in UTF-16 and may cut a pair; JSON has each half as an escape of its own."""
    for half in ("\\ud83d", "\\ude00", "\\ud83d x", "\\\\\\ud83d"):
        text = json.dumps("# ") [:-1] + half + json.dumps("\n" + pendulum_text)[1:]
        raw(editor, (f'{{"jsonrpc": "2.0", "method": "textDocument/didOpen", "params": {{"textDocument": {{"uri": "file:///{len(half)}.mbd", '
                     f'"languageId": "mbcosim", "version": 1, "text": {text}}}}}}}').encode())
        assert editor.next_diagnostics(f"file:///{len(half)}.mbd") == []
    assert editor.open("file:///whole.mbd", "# \U0001f600\n" + pendulum_text) == []


def test_requests_come_between_initialize_and_shutdown():
    editor = Editor()
    assert editor.ask("textDocument/hover", textDocument={"uri": "x"}, position={"line": 0, "character": 0})["code"] == -32002
    editor.ask("initialize", processId=None, rootUri=None, capabilities={})
    assert editor.ask("shutdown") is None
    assert editor.ask("textDocument/hover", textDocument={"uri": "x"}, position={"line": 0, "character": 0})["code"] == -32600
    editor.send(method="exit")
    assert editor.process.wait(20 * TIME_FACTOR) == 0


def test_diagnostics_come_as_one_types_and_go_when_it_is_mended(editor, pendulum_text):
    uri = "file:///work%20in%20progress/a.mbd"
    bad = pendulum_text.replace("spherical hinge", "sperical hinge")
    found, = editor.open(uri, bad)
    line = next(k for k, text in enumerate(bad.splitlines()) if "2, sperical" in text)
    assert found["range"] == {"start": {"line": line, "character": 14}, "end": {"line": line, "character": 28}}
    assert (found["severity"], found["source"]) == (1, "mbcosim")
    assert found["message"] == 'joint 2: unknown joint type "spericalhinge"\ndid you mean "spherical hinge"?'
    assert editor.change(uri, bad + "# more", pendulum_text) == []


def test_places_count_utf_16_units(editor):
    text = "set: const string s = \"\U0001F600\"; set: const real a = bb;\n"
    found = editor.open("file:///x.mbd", text + BAD)
    assert [d["range"]["start"]["character"] for d in found if d["range"]["start"]["line"] == 0] == [text.index("bb") + 1]


def test_an_included_file_gets_its_own_diagnostics_and_open_texts_count(editor, tmp_path):
    main, part = tmp_path / "main.mbd", tmp_path / "part.inc"
    part.write_text("set: const real a = 1.;\n")
    text = 'include: "part.inc";\nset: const real b = a;\n' + BAD.replace("begin: initial vale;\n", "")
    editor.open(main.as_uri(), text)
    inside = 'set: const real a = nothing;\n'
    editor.send(method="textDocument/didOpen", params={"textDocument": {"uri": part.as_uri(), "languageId": "m", "version": 1, "text": inside}})
    editor.ask("textDocument/hover", textDocument={"uri": part.as_uri()}, position={"line": 0, "character": 0})
    assert any("nothing" in d["message"] for d in editor.diagnostics.get(part.as_uri(), [])) or any(
        "nothing" in d["message"] for d in editor.next_diagnostics(part.as_uri()))


def test_completion_offers_what_fits_the_place(editor, pendulum_text):
    uri = "file:///p.mbd"
    editor.open(uri, pendulum_text)
    typed = pendulum_text.replace("joint: 2, spherical hinge", "joint: 2, sph")
    editor.change(uri, typed)
    items = editor.at("completion", uri, typed, "2, sph", 6)["items"]
    assert [item["label"] for item in items][:2] == ["spherical hinge", "spherical pin"]
    edit = items[0]["textEdit"]
    assert edit["newText"] == "spherical hinge" and edit["range"]["end"]["character"] - edit["range"]["start"]["character"] == 3
    labels = {item["label"] for item in editor.at("completion", uri, pendulum_text, "begin: data", 6)["items"]}
    assert {"control data", "elements"} <= labels and "joint" not in labels
    begun = pendulum_text.replace("problem: initial value;", "prob")
    editor.change(uri, begun)
    assert "problem" in {item["label"] for item in editor.at("completion", uri, begun, "prob", 4)["items"]}


def test_hover_tells_values_and_words(editor):
    text = pathlib.Path(MODELS, "robot_arm.mbd").read_text()
    uri = "file:///r.mbd"
    assert editor.open(uri, text) == []
    assert editor.at("hover", uri, text, "kp*goal2", 1)["contents"]["value"] == "**kp** = 400.0 (const)"
    hinge = editor.at("hover", uri, text, "revolute hinge", 10)["contents"]["value"]
    assert hinge.startswith("**revolute hinge** (Joints)")
    assert editor.at("hover", uri, text, "# torque kp", 10) is None  # a comment


def test_hover_tells_how_a_word_is_written_what_it_writes_and_how_far_it_is_served(editor):
    vocabulary = json.loads(subprocess.run([os.path.join(BIN, "mbcosim"), "keywords", "--json"], stdout=subprocess.PIPE, check=True).stdout)
    joints = next(group for group in vocabulary if group["name"] == "joint")
    clamp = next(word for word in joints["words"] if word["word"] == "clamp")
    text = pathlib.Path(MODELS, "pendulum.mbd").read_text()
    editor.open("file:///p.mbd", text)
    told = editor.at("hover", "file:///p.mbd", text, "clamp", 2)["contents"]["value"]
    assert f"joint : <label> , clamp , {clamp['grammar']}" in told
    assert f"Writes {clamp['output']}" in told
    assert "Genels" not in told  # the genel of this name cannot stand here
    solver = text.replace("begin: initial value;", "begin: initial value;\n    threads: 2;")
    editor.open("file:///s.mbd", solver)
    assert "Served: ignored; large models take all cores" in editor.at("hover", "file:///s.mbd", solver, "threads", 3)["contents"]["value"]


def test_definition_and_references_of_symbols_and_labels(editor):
    text = pathlib.Path(MODELS, "robot_arm.mbd").read_text()
    uri = "file:///r.mbd"
    editor.open(uri, text)
    lines = text.splitlines()
    found = editor.at("definition", uri, text, "body: UPPER, UPPER", 7)
    assert [lines[place["range"]["start"]["line"]].split(",")[0].strip() for place in found] == [
        "set: const integer UPPER = 2;", "structural: UPPER"]
    places = editor.at("references", uri, text, "kp*goal2", 1)
    code = NEW_LINE.join(line.partition("#")[0] for line in lines)
    assert len(places) == len(re.findall(r"\bkp\b", code)) == 5
    assert editor.at("definition", uri, text, "final time", 0) == []


def test_what_it_cannot_do_is_refused_and_nonsense_does_not_end_it(editor):
    assert editor.ask("textDocument/rename", textDocument={"uri": "file:///none"}, position={"line": 0, "character": 0}) is None
    assert editor.ask("workspace/symbol", query="x")["code"] == -32601
    assert editor.ask("textDocument/hover")["code"] == -32602
    editor.send(method="textDocument/didChange", params={})
    editor.send(method="textDocument/didOpen", params={"textDocument": 7})
    assert editor.open("file:///x.mbd", BAD)
    assert editor.ask("textDocument/hover", textDocument={"uri": "file:///x.mbd"}, position={"line": 999999, "character": -5}) is None


@pytest.mark.parametrize("bytes_sent", [b"Content-Length: 99999999999\r\n\r\n", b"x" * 5000])
def test_a_broken_stream_ends_it_with_a_word(bytes_sent):
    done = subprocess.run([os.path.join(BIN, "mbcosim"), "lsp"], input=bytes_sent, stdout=subprocess.PIPE, stderr=subprocess.PIPE, check=False,
                          timeout=60)
    assert done.returncode == 4 and done.stderr.startswith(b"mbcosim lsp: ")
