"""The viewer's server: one page, to browsers on this computer only."""

import http.client
import socket
import struct
import threading

import pytest

from cspm.view.view_server import LOOPBACK, ViewServer, listening
from cspm_msgs_py.errors import InputError


@pytest.fixture
def server():
    made = listening(LOOPBACK, 0, lambda *at: ViewServer("<p>here</p>", *at))
    thread = threading.Thread(target=made.serve_forever, daemon=True)
    thread.start()
    yield made
    made.shutdown()
    made.server_close()
    thread.join()


def ask(server, path="/", host=None, method="GET", **headers):
    link = http.client.HTTPConnection(LOOPBACK, server.server_port, timeout=30)
    given = {"Host": host or f"{LOOPBACK}:{server.server_port}", **headers}
    link.request(method, path, headers=given)
    answer = link.getresponse()
    body = answer.read()
    link.close()
    return answer.status, body


def test_the_page_is_served_on_loopback_under_its_names(server):
    assert server.server_address[0] == "127.0.0.1"
    for name in ("127.0.0.1", "localhost", "[::1]"):
        status, body = ask(server, host=f"{name}:{server.server_port}")
        assert (status, body) == (200, b"<p>here</p>")


@pytest.mark.parametrize("host", ["evil.example", "127.0.0.1.evil.example:80", "[bad", "192.0.2.1"])
def test_other_hosts_are_refused(server, host):
    status, body = ask(server, host=host)
    assert status == 403
    assert b"here" not in body


def test_other_origins_are_refused_and_its_own_is_not(server):
    own = f"http://{LOOPBACK}:{server.server_port}"
    assert ask(server, Origin=own)[0] == 200
    assert ask(server, Origin="http://evil.example")[0] == 403


@pytest.mark.parametrize("path", ["/etc/passwd", "/../pyproject.toml", "/index.html", "/?a=b"])
def test_nothing_else_is_served(server, path):
    assert ask(server, path)[0] == 404


def test_other_methods_are_not_understood(server):
    assert ask(server, method="DELETE")[0] == 501


def test_a_taken_port_is_one_line(server):
    with pytest.raises(InputError) as caught:
        listening(LOOPBACK, server.server_port, lambda *at: ViewServer("", *at))
    line = f"--host 127.0.0.1 --port {server.server_port}: Address already in use, allowed: an"
    assert str(caught.value).startswith(line)


@pytest.mark.parametrize("error", [BrokenPipeError, ConnectionResetError])
def test_a_browser_that_goes_too_early_is_no_news(server, capsys, error):
    try:
        raise error
    except error:
        server.handle_error(None, (LOOPBACK, 1))
    assert capsys.readouterr().err == ""


def test_any_other_error_is_told(server, capsys):
    try:
        raise KeyError("lost")
    except KeyError:
        server.handle_error(None, (LOOPBACK, 1))
    assert "KeyError: 'lost'" in capsys.readouterr().err


def test_a_connection_that_is_cut_says_nothing(server, capfd):
    """With a page larger than what the system keeps for a reader who does not read."""
    server.page = b"x" * 50_000_000
    ended = threading.Event()
    shut = server.shutdown_request
    server.shutdown_request = lambda request: (shut(request), ended.set())
    with socket.create_connection((LOOPBACK, server.server_port), timeout=30) as link:
        link.sendall(f"GET / HTTP/1.1\r\nHost: {LOOPBACK}:{server.server_port}\r\n\r\n".encode())
        assert link.recv(100)
        link.setsockopt(socket.SOL_SOCKET, socket.SO_LINGER, struct.pack("ii", 1, 0))
    assert ended.wait(60)
    assert capfd.readouterr().err == ""
