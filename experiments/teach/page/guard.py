"""Who may talk to the page: its own browser window, whatever else is open in the browser.

A page that listens on this machine only can still be reached by every other site that is open in
a browser on it, websockets included, and by names that are made to point here. So each request
must name this server, and one that says where it comes from must come from the page itself.
"""

import hmac
from collections.abc import Awaitable, Callable, MutableMapping
from http.cookies import CookieError, SimpleCookie
from ipaddress import ip_address
from typing import Any
from urllib.parse import parse_qs, urlsplit

Scope = MutableMapping[str, Any]
Receive = Callable[[], Awaitable[MutableMapping[str, Any]]]
Send = Callable[[MutableMapping[str, Any]], Awaitable[None]]
App = Callable[[Scope, Receive, Send], Awaitable[None]]

COOKIE = "teach_token"
FORBIDDEN, SEE_OTHER = 403, 303
POLICY_VIOLATION = 1008  # closing code of a websocket
HEADERS = [
    # The framework compiles its templates in the browser. Nothing is fetched from elsewhere.
    (
        b"content-security-policy",
        b"default-src 'self' 'unsafe-inline' 'unsafe-eval' data: blob:; form-action 'self'; "
        b"base-uri 'self'; frame-ancestors 'self'; object-src 'none'",
    ),
    (b"x-content-type-options", b"nosniff"),
    (b"referrer-policy", b"same-origin"),
    (b"cross-origin-resource-policy", b"same-origin"),
]
HERE = [(b"cross-origin-opener-policy", b"same-origin")]
"""Besides, where browsers trust the connection: on this machine. Elsewhere they complain of it."""


def is_local(host: str) -> bool:
    """Whether an address that a server is bound to can be reached from this machine alone."""
    if host == "localhost":
        return True
    try:
        return ip_address(host.strip("[]")).is_loopback
    except ValueError:
        return False


class Guard:
    """Passes on what the page itself asks for; everything else is refused without a word more."""

    def __init__(self, app: App, *, port: int, token: str = "") -> None:
        """Stand before an application.

        Args:
            app: what is guarded.
            port: that it listens on.
            token: what a browser must show, once in the address and from then on as a cookie; empty
                where only this machine can connect.
        """
        self.app, self._port, self._token = app, port, token
        self._headers = HEADERS if token else [*HEADERS, *HERE]

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Judge one request."""
        if scope["type"] not in ("http", "websocket"):
            await self.app(scope, receive, send)
            return
        headers: dict[str, list[str]] = {}
        for name, value in scope["headers"]:
            headers.setdefault(name.decode("latin-1").lower(), []).append(value.decode("latin-1"))
        reason = self._objection(scope, headers)
        if reason:
            await self._refuse(scope, receive, send, reason)
        elif self._token and not self._is_known(headers):
            await self._admit(scope, receive, send)
        else:
            await self.app(scope, receive, self._with_headers(send))

    def _objection(self, scope: Scope, headers: dict[str, list[str]]) -> str:
        """Why a request is refused; empty if it is not."""
        hosts, origins = headers.get("host", []), headers.get("origin", [])
        if len(hosts) != 1 or not self._is_own(hosts[0]):
            return "this page answers to its own address only"
        websocket = scope["type"] == "websocket"
        if len(origins) > 1 or (websocket and not origins):
            return "a websocket says where it comes from, once"
        # "null" is what frames without an origin and files say.
        if origins and origins[0].lower() != f"http://{hosts[0].lower()}":
            return "another site may not talk to this page"
        return ""

    def _is_own(self, host: str) -> bool:
        """Whether the name that a request was sent to is this server's."""
        try:
            parts = urlsplit(f"//{host}")
            name, port = parts.hostname or "", parts.port or 80
        except ValueError:
            return False
        if parts.netloc != host or "@" in host or port != self._port:
            return False
        # Elsewhere names are not known; there the token, which no other site has, decides.
        return is_local(name) or bool(self._token)

    def _is_known(self, headers: dict[str, list[str]]) -> bool:
        """Whether the cookie holds the token."""
        try:
            cookies = SimpleCookie("; ".join(headers.get("cookie", [])))
        except CookieError:
            return False
        return COOKIE in cookies and self._is_token(cookies[COOKIE].value)

    def _is_token(self, text: str) -> bool:
        return hmac.compare_digest(text.encode(), self._token.encode())

    async def _admit(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Give a browser that brings the token a cookie, and take it off the address."""
        shown = parse_qs(scope.get("query_string", b"").decode("latin-1")).get("token", [])
        if scope["type"] != "http" or len(shown) != 1 or not self._is_token(shown[0]):
            await self._refuse(
                scope, receive, send, "the address with the token is in the terminal"
            )
            return
        cookie = f"{COOKIE}={self._token}; Path=/; HttpOnly; SameSite=Strict"
        fields = [(b"location", b"/"), (b"set-cookie", cookie.encode()), *self._headers]
        await send({"type": "http.response.start", "status": SEE_OTHER, "headers": fields})
        await send({"type": "http.response.body", "body": b""})

    async def _refuse(self, scope: Scope, receive: Receive, send: Send, reason: str) -> None:
        if scope["type"] == "websocket":
            await receive()  # the wish to connect; closing before it is accepted answers 403
            await send({"type": "websocket.close", "code": POLICY_VIOLATION, "reason": reason})
            return
        fields = [(b"content-type", b"text/plain; charset=utf-8"), *self._headers]
        await send({"type": "http.response.start", "status": FORBIDDEN, "headers": fields})
        await send({"type": "http.response.body", "body": f"{reason}\n".encode()})

    def _with_headers(self, send: Send) -> Send:
        """Answers with the headers that keep the browser to this machine."""

        async def send_with(message: MutableMapping[str, Any]) -> None:
            if message["type"] == "http.response.start":
                message["headers"] = [*message.get("headers", []), *self._headers]
            await send(message)

        return send_with
