"""The browsers that look on: each is told everything in turn, but of each camera only the newest picture."""

import asyncio
import json
import struct
from dataclasses import dataclass, field
from typing import Any

from websockets.asyncio.server import ServerConnection
from websockets.exceptions import ConnectionClosed

MOST_WAITING = 20_000
"""Events that wait for a browser; whoever has not taken so many is not there, as the pings will find."""
_LENGTH = struct.Struct("<I")


@dataclass(eq=False)
class Viewer:
    """One browser.

    Attributes:
        connection: Its WebSocket.
        looking: Whether its page is in front of somebody.
    """

    connection: ServerConnection
    looking: bool = True
    _waiting: list[str] = field(default_factory=list)
    _pictures: dict[str, bytes] = field(default_factory=dict)
    _something: asyncio.Event = field(default_factory=asyncio.Event)

    def tell(self, text: str) -> None:
        """Events, as one JSON array, to be sent in turn."""
        if len(self._waiting) < MOST_WAITING:
            self._waiting.append(text)
        self._something.set()

    def show(self, node: str, data: bytes) -> None:
        """A camera's picture; an earlier one that still waits is left out."""
        self._pictures[node] = data
        self._something.set()

    async def serve(self) -> None:
        """Sends what waits, until the browser goes."""
        try:
            while True:
                await self._something.wait()
                self._something.clear()
                waiting, self._waiting = self._waiting, []
                pictures, self._pictures = self._pictures, {}
                for text in waiting:
                    await self.connection.send(text)
                for data in pictures.values():
                    await self.connection.send(data)
        except ConnectionClosed:
            return


def as_text(events: list[dict[str, Any]]) -> str:
    """Events for the page."""
    return json.dumps(events, separators=(",", ":"), allow_nan=False)


def as_picture(event: dict[str, Any], jpeg: bytes) -> bytes:
    """A picture for the page: the length of its event, the event, the JPEG."""
    head = as_text([event]).encode()
    return b"".join((_LENGTH.pack(len(head)), head, jpeg))
