"""Meshcat under the page's own address, so that what guards the page guards its 3D view as well.

Meshcat's own port accepts whoever knows it, from any site, and believes what it is sent. It is
bound to this machine, only shows, and nothing here reads from it: what a browser sends towards it
is dropped.
"""

import asyncio
import re
from contextlib import suppress

from aiohttp import ClientError, ClientSession, ClientTimeout, ClientWSTimeout, WSMsgType
from fastapi import FastAPI, Response, WebSocket, WebSocketDisconnect

ADDRESS = "/view/"
FILES = re.compile(r"(index\.html|meshcat\.(html|js|ico)|favicon\.ico|cas-v1/[0-9a-f]{64})?")
"""What a view consists of: its page, and what that and the scene name by their contents."""
_FAREWELL = ClientWSTimeout(ws_close=0.5)  # the view is of this process: nobody else waits
_LONGEST = 64 * 2**20  # of a message: the whole scene, when a browser connects [bytes]


class MeshcatProxy:
    """Passes a view's files and pictures on."""

    def __init__(self, web_url: str) -> None:
        """Pass on what the Meshcat at an address has."""
        self._url = web_url.rstrip("/")
        self._session: ClientSession | None = None

    def add_to(self, app: FastAPI) -> None:
        """Serve it under `ADDRESS`."""
        app.add_api_route(ADDRESS + "{name:path}", self._file, methods=["GET"])
        app.add_api_websocket_route(ADDRESS, self._pictures)

    async def close(self) -> None:
        """Let go of all connections."""
        if self._session is not None:
            await self._session.close()

    def _client(self) -> ClientSession:
        if self._session is None:
            self._session = ClientSession(timeout=ClientTimeout(total=30))
        return self._session

    async def _file(self, name: str) -> Response:
        if not FILES.fullmatch(name):
            return Response(status_code=404)
        try:
            async with self._client().get(f"{self._url}/{name}") as answer:
                body, kind = await answer.read(), answer.headers.get("content-type")
                # Of what has its contents for a name, Meshcat does not say what it is; scripts
                # alone have to.
                return Response(body, answer.status, media_type=kind or "text/javascript")
        except ClientError:
            return Response("the 3D view is not there", 502)

    async def _pictures(self, browser: WebSocket) -> None:
        """One browser's connection, until either side ends it."""
        await browser.accept()
        try:
            async with self._client().ws_connect(
                self._url.replace("http", "ws", 1), timeout=_FAREWELL, max_msg_size=_LONGEST
            ) as view:
                gone = asyncio.ensure_future(_until_gone(browser))
                try:
                    while True:
                        told = asyncio.ensure_future(view.receive())
                        await asyncio.wait({told, gone}, return_when=asyncio.FIRST_COMPLETED)
                        if not told.done() or told.result().type != WSMsgType.BINARY:
                            told.cancel()
                            break
                        await browser.send_bytes(told.result().data)
                finally:
                    gone.cancel()
        except (ClientError, WebSocketDisconnect, RuntimeError, OSError):
            pass
        with suppress(RuntimeError, WebSocketDisconnect):
            await browser.close()


async def _until_gone(browser: WebSocket) -> None:
    """Drop what a browser sends, until it is gone."""
    with suppress(WebSocketDisconnect, RuntimeError):
        while True:
            message = await browser.receive()
            if message["type"] == "websocket.disconnect":
                return
