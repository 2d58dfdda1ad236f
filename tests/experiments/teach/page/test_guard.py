"""Who the page talks to: judged on the level of the protocol, for requests and websockets alike."""

import asyncio

import pytest

pytest.importorskip("nicegui")

from experiments.teach.page.guard import Guard, is_local

OWN = "127.0.0.1:8080"


class Asked:
    """One request to a guard, and what came of it."""

    def __init__(self, guard, kind="http", query=b"", **headers):
        self.sent, self.passed = [], False
        scope = {
            "type": kind,
            "query_string": query,
            "headers": [(k.replace("_", "-").encode(), v.encode()) for k, v in headers.items()],
        }
        guard.app = self._app
        asyncio.run(guard(scope, self._receive, self._send))

    async def _app(self, scope, receive, send):
        self.passed = True
        if scope["type"] == "http":
            await send({"type": "http.response.start", "status": 200, "headers": []})

    async def _receive(self):
        return {"type": "websocket.connect"}

    async def _send(self, message):
        self.sent.append(message)

    @property
    def headers(self):
        return dict(self.sent[0]["headers"])


def local():
    return Guard(None, port=8080)


def elsewhere():
    return Guard(None, port=8080, token="a-long-secret")


@pytest.mark.parametrize("host", [OWN, "localhost:8080", "[::1]:8080", "LOCALHOST:8080"])
def test_its_own_names_are_answered(host):
    assert Asked(local(), host=host).passed
    assert Asked(local(), host=host, origin=f"http://{host}").passed
    assert Asked(local(), "websocket", host=host, origin=f"http://{host}").passed


@pytest.mark.parametrize(
    "host",
    [
        "evil.example:8080",  # a name that was made to point here
        "127.0.0.1.evil.example:8080",
        "localhost.evil.example:8080",
        "127.0.0.1:8081",
        "127.0.0.1",
        "user@127.0.0.1:8080",
        "127.0.0.1:8080/",
        "0.0.0.0:8080",
        "192.168.1.7:8080",
        "[::1",
        "",
    ],
)
def test_other_names_are_refused(host):
    for kind in ("http", "websocket"):
        asked = Asked(local(), kind, host=host, origin=f"http://{host}")
        assert not asked.passed
        assert asked.sent[0].get("status", 1008) in (403, 1008)


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "http://evil.example:8080",
        "http://127.0.0.1:8081",
        "http://localhost:8080",  # another name is another origin
        "https://127.0.0.1:8080",
        "http://127.0.0.1:8080.evil.example",
        "null",
        "file://",
        "",
    ],
)
def test_other_sites_are_refused(origin):
    for kind in ("http", "websocket"):
        assert not Asked(local(), kind, host=OWN, origin=origin).passed


def test_a_websocket_without_an_origin_is_refused_and_a_page_is_not():
    assert not Asked(local(), "websocket", host=OWN).passed
    assert Asked(local(), host=OWN).passed
    assert not Asked(local()).passed


def test_nothing_is_fetched_from_elsewhere():
    policy = Asked(local(), host=OWN).headers[b"content-security-policy"].decode()
    assert "default-src 'self'" in policy
    assert "http" not in policy
    assert "*" not in policy


def test_elsewhere_a_browser_shows_the_token_once():
    host = "lab-machine:8080"
    assert not Asked(elsewhere(), host=host).passed
    assert not Asked(elsewhere(), host=host, query=b"token=wrong").passed
    assert not Asked(elsewhere(), host=host, query=b"token=a-long-secret&token=x").passed
    came = Asked(elsewhere(), host=host, query=b"token=a-long-secret")
    assert came.sent[0]["status"] == 303
    assert came.headers[b"location"] == b"/"
    cookie = came.headers[b"set-cookie"].decode()
    assert "HttpOnly" in cookie
    assert "SameSite=Strict" in cookie
    kept = cookie.split(";")[0]
    assert Asked(elsewhere(), host=host, cookie=f"other=1; {kept}").passed
    assert not Asked(elsewhere(), host=host, cookie="teach_token=wrong").passed


def test_elsewhere_websockets_show_the_token_too():
    host = "lab-machine:8080"
    origin = f"http://{host}"
    kept = "teach_token=a-long-secret"
    assert Asked(elsewhere(), "websocket", host=host, origin=origin, cookie=kept).passed
    assert not Asked(elsewhere(), "websocket", host=host, origin=origin).passed
    assert not Asked(
        elsewhere(), "websocket", b"token=a-long-secret", host=host, origin=origin
    ).passed
    assert not Asked(
        elsewhere(), "websocket", host=host, origin="http://evil.example", cookie=kept
    ).passed


def test_what_is_bound_to_this_machine_alone_is_known():
    assert all(is_local(host) for host in ("localhost", "127.0.0.1", "127.3.2.1", "::1", "[::1]"))
    assert not any(is_local(host) for host in ("0.0.0.0", "::", "192.168.0.2", "lab-machine", ""))
