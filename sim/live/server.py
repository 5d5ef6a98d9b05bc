"""Serves the live page: hears a run over Zenoh and passes it on to browsers; pictures while one looks."""

import asyncio
import json
import os
import socket
import threading
import time
from collections.abc import Callable
from contextlib import suppress
from functools import partial
from typing import Any

from websockets.asyncio.server import ServerConnection, serve
from websockets.exceptions import ConnectionClosed
from websockets.http11 import Request, Response

from network.errors import NetworkError, RefusedMessage
from network.wire import codec, keys
from network.wire.messages import EstimateMessage, PreviewMessage, StatusMessage, TruthMessage
from sim.live.feed import Feed
from sim.live.pages import answer
from sim.live.story import Event, Story
from sim.live.viewers import Viewer, as_picture, as_text

LEAVE_S = 2.0
_KINDS: dict[str, type[EstimateMessage | StatusMessage | TruthMessage]] = {
    kind.kind: kind for kind in (EstimateMessage, StatusMessage, TruthMessage)
}
_STEER_PERIOD_S = 0.1

Steer = Callable[[dict[str, Any]], Event]
"""Told an order of the page, or an empty one; returns how the playback is."""


class LiveServer:
    """The page of one run, served from a thread of its own."""

    def __init__(self, story: Story, address: tuple[str, int], steer: Steer | None = None) -> None:
        """Takes the port; nothing is heard yet.

        Args:
            story: The run.
            address: Host and port; port 0 takes any.
            steer: Turns a recording's playback, where it is one.

        Raises:
            NetworkError: The port cannot be had.
        """
        self._story, self._host, self._steer = story, address[0], steer
        try:
            self._socket = socket.create_server(address, family=_family(address[0]))
        except OSError as error:
            raise NetworkError(
                f"cannot serve the page on {address[0]} port {address[1]}: {os.strerror(error.errno or 0)}:"
                " end what uses it, or choose another: --port 0 takes a free one"
            ) from error
        self._viewers: set[Viewer] = set()
        self._pictures: dict[str, bytes] = {}
        self._audience = threading.Event()
        self._ended = asyncio.Event()
        self._feed: Feed | None = None
        self._loop = asyncio.new_event_loop()
        self._thread = threading.Thread(target=self._run, name="live", daemon=True)

    @property
    def url(self) -> str:
        """Where the page is."""
        host = f"[{self._host}]" if ":" in self._host else self._host
        return f"http://{host}:{self._socket.getsockname()[1]}/"

    def start(self, endpoint: str, run: str) -> None:
        """Serves the page and listens to the run, as soon as there is a router.

        Args:
            endpoint: Of the router.
            run: Name of the run.
        """
        self._thread.start()
        self._feed = Feed(endpoint, run, self._hear)

    def wait_for_audience(self, timeout_s: float) -> bool:
        """Waits until a browser has opened the page, and hears; False when time is up."""
        limit = time.monotonic() + timeout_s
        return self._audience.wait(timeout_s) and (
            self._feed is None or self._feed.listening.wait(max(0.0, limit - time.monotonic()))
        )

    def close(self) -> None:
        """Says goodbye to the browsers and gives the port back."""
        if self._feed is not None:
            self._feed.close()
        if self._thread.is_alive():
            self._call(self._ended.set)
            self._thread.join(LEAVE_S)
        self._socket.close()

    def _run(self) -> None:
        asyncio.set_event_loop(self._loop)
        self._loop.run_until_complete(self._serve())
        self._loop.close()

    async def _serve(self) -> None:
        def check(_: ServerConnection, request: Request) -> Response | None:
            return answer(request, self._host)

        async with serve(self._welcome, sock=self._socket, process_request=check, compression=None):
            steering = asyncio.create_task(self._tell_playback())
            await self._ended.wait()
            steering.cancel()

    async def _welcome(self, connection: ServerConnection) -> None:
        """A browser's visit."""
        viewer = Viewer(connection)
        playback = [self._steer({})] if self._steer is not None else []
        viewer.tell(as_text([*self._story.so_far(), *playback]))
        for node, picture in self._pictures.items():
            viewer.show(node, picture)
        self._viewers.add(viewer)
        self._look()
        serving = asyncio.create_task(viewer.serve())
        serving.add_done_callback(lambda _: asyncio.ensure_future(connection.close()))
        self._audience.set()
        try:
            with suppress(ConnectionClosed):
                async for words in connection:
                    self._obey(viewer, words)
        finally:
            self._viewers.discard(viewer)
            self._look()
            serving.cancel()

    def _obey(self, viewer: Viewer, words: str | bytes) -> None:
        """What the page asks for; anything else is left."""
        with suppress(ValueError, OverflowError, RecursionError):
            order = json.loads(words)
            match order:
                case {"order": "look", "value": bool(looking)}:
                    viewer.looking = looking
                    self._look()
                case {"order": str()} if self._steer is not None:
                    self._tell([self._steer(order)])

    def _look(self) -> None:
        if self._feed is not None:
            self._feed.look(wanted=any(viewer.looking for viewer in self._viewers))

    def _hear(self, key: str, data: bytes, here: bool) -> None:  # noqa: FBT001 - as the feed calls it
        self._call(partial(self._take, key, data, here=here))

    def _take(self, key: str, data: bytes, *, here: bool) -> None:
        """Something has been told over the network."""
        kind = key.rpartition("/")[2]
        with suppress(RefusedMessage, ValueError):
            if kind == "alive":
                self._tell(self._story.see(keys.node_of(key), here=here))
            elif kind == "preview":
                self._show(codec.decode_preview(data))
            else:
                message = codec.decode_public(_KINDS[kind], data)
                if isinstance(message, TruthMessage) or message.node == keys.node_of(key):
                    self._tell(self._story.take(message, time.monotonic()))

    def _show(self, message: PreviewMessage) -> None:
        event = self._story.picture(message)
        if event is not None:
            data = self._pictures[message.node] = as_picture(event, message.jpeg)
            for viewer in self._viewers:
                if viewer.looking:
                    viewer.show(message.node, data)

    def _tell(self, events: list[Event]) -> None:
        if events and self._viewers:
            text = as_text(events)
            for viewer in self._viewers:
                viewer.tell(text)

    async def _tell_playback(self) -> None:
        """Says where a recording's playback is."""
        told: Event = {}
        while self._steer is not None:
            now = self._steer({})
            if now != told:
                self._tell([now])
            told = now
            await asyncio.sleep(_STEER_PERIOD_S)

    def _call(self, action: Callable[[], None]) -> None:
        with suppress(RuntimeError):  # the loop has ended: nobody looks any more
            self._loop.call_soon_threadsafe(action)


def _family(host: str) -> socket.AddressFamily:
    return socket.AF_INET6 if ":" in host else socket.AF_INET
