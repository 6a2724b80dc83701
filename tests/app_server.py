"""The page of `iceslide app`, served by the command as a person starts it."""

import json
import subprocess
import sys
from http.client import HTTPConnection
from typing import NamedTuple
from urllib.parse import urlsplit

import pytest


class Served(NamedTuple):
    """A running page: its address, its process, the folder it was started in."""

    address: str
    process: subprocess.Popen
    folder: object

    def get(self, path, host=None, method="GET", body=None, kind="application/json"):
        """Status, headers and text of the answer; `path` as it is, below no token."""
        parts = urlsplit(self.address)
        connection = HTTPConnection(parts.hostname, parts.port, timeout=30)
        headers = {"Host": host or parts.netloc} | ({"Content-Type": kind} if body else {})
        connection.putrequest(method, path, skip_host=True)
        for name, value in headers.items():
            connection.putheader(name, value)
        connection.putheader("Content-Length", str(len(body or b"")))
        connection.endheaders(body)
        answer = connection.getresponse()
        text = answer.read().decode(errors="replace")
        connection.close()
        return answer.status, dict(answer.getheaders()), text

    @property
    def root(self):
        """The path with the token, without the slash behind it."""
        return urlsplit(self.address).path.rstrip("/")

    def ask(self, name, **asked):
        """Status and JSON of the answer of that name."""
        body = json.dumps(asked).encode()
        status, _, text = self.get(f"{self.root}/api/{name}", method="POST", body=body)
        return status, json.loads(text)


def start(folder, *words):
    """Start `iceslide app` in `folder`, and wait for its address."""
    pytest.importorskip("starlette", reason="no starlette here: scripts/setup --app")
    pytest.importorskip("uvicorn", reason="no uvicorn here: scripts/setup --app")
    command = [sys.executable, "-m", "iceslide_fem.cli", "app", "--no-browser", *map(str, words)]
    process = subprocess.Popen(
        command, cwd=folder, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True
    )
    line = process.stdout.readline().strip()
    assert line.startswith("http://"), process.stderr.read()
    return Served(line, process, folder)


def stop(served):
    """Ask it to end (SIGTERM), and wait."""
    served.process.terminate()
    code = served.process.wait(60)
    served.process.stdout.close()
    served.process.stderr.close()
    return code


def fixtures():
    """The fixtures `open_app` and `served`, for a module of tests."""

    @pytest.fixture
    def open_app(tmp_path):
        """A function that starts a page in the test's folder; it ends with the test."""
        pages = []

        def open_new(*words):
            pages.append(start(tmp_path, *words))
            return pages[-1]

        yield open_new
        for page in pages:
            stop(page)

    @pytest.fixture(scope="module")
    def served(tmp_path_factory):
        """One page for all tests of a module."""
        page = start(tmp_path_factory.mktemp("app"))
        yield page
        assert stop(page) == 0

    return open_app, served
