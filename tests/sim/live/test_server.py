"""The page's server between a real network and real sockets: pictures are sent only while somebody looks."""

import contextlib
import json
import socket
import struct
import urllib.request
from contextlib import closing

import numpy as np
import pytest
from websockets.exceptions import ConnectionClosed, InvalidStatus
from websockets.sync.client import connect

from network.errors import NetworkError
from network.links import sessions
from network.links.publishers import publish
from network.links.transport import Links
from network.links.zenoh import ZenohTransport
from network.wire import codec, keys
from network.wire.messages import ControlMessage, PreviewMessage, StatusMessage, TruthMessage
from nodes.shell.preview import encode_jpeg
from sim.assembly import Assembly
from sim.live.server import LiveServer
from sim.live.story import Story
from sim.scenario.loading import load_scenario

pytestmark = pytest.mark.processes

LOOPBACK = ("127.0.0.1", 0)


@pytest.fixture
def endpoint(tmp_path):
    return f"unixsock-stream/{tmp_path}/r"


@pytest.fixture
def serve(small, endpoint):
    """Starts a server of the small run; all are closed in the end."""
    with contextlib.ExitStack() as stack:

        def start(steer=None):
            story = Story(Assembly(load_scenario(small)), recorded=steer is not None)
            server = stack.enter_context(closing(LiveServer(story, LOOPBACK, steer)))
            server.start(endpoint, "small")
            return server

        yield start


def feed(server, **options):
    return connect(server.url.replace("http", "ws") + "feed", compression=None, **options)


def events_until(browser, kind):
    """Everything that is told until something of a kind is."""
    events = []
    while kind not in {event["type"] for event in events}:
        data = browser.recv(timeout=10)
        if isinstance(data, bytes):
            (length,) = struct.unpack_from("<I", data)
            events += json.loads(data[4 : 4 + length])
        else:
            events += json.loads(data)
    return events


def test_the_run_is_passed_on_and_pictures_while_somebody_looks(serve, endpoint, tmp_path, wait_until):
    router = sessions.open_router([endpoint])
    camera = ZenohTransport(
        "small", "A", Links(), [f"unixsock-stream/{tmp_path}/a"], [endpoint], drop_late_pixels=False
    )
    server = serve()
    image = np.full((120, 160, 3), 127, np.uint8)
    shown = PreviewMessage("small", "A", 1, 0.1, np.array([[0.0, 2.0]]), encode_jpeg(image))
    try:
        camera.announce()
        assert not server.wait_for_audience(0.2)
        assert not camera.watched
        with feed(server) as browser:
            assert server.wait_for_audience(5.0)
            events = events_until(browser, "node")
            assert events[0]["run"] == "small"
            assert wait_until(lambda: camera.watched, 5.0)
            camera.send(shown)
            (preview,) = [e for e in events_until(browser, "preview") if e["type"] == "preview"]
            assert (preview["node"], preview["frame"], len(preview["particles"])) == ("A", 1, 1)
            # truth, and nonsense that is none of the run's
            router.put(keys.truth("small"), b"nonsense")
            router.put(keys.estimate("small", "B"), codec.encode("small", shown))
            status = StatusMessage("A", "running", 1, {"bytes": {"consensus": 1}}, {})
            router.put(keys.status("small", "B"), codec.encode_public(status))
            publish(router, "small", TruthMessage("small", 1, 0.1, np.array([0.0, 2.0, 0.0, 1.5]), {}))
            events = events_until(browser, "truth")
            assert {event["type"] for event in events} <= {"truth", "node"}
            # a page that nobody has in front of them needs no pictures
            browser.send(json.dumps({"order": "look", "value": False}))
            assert wait_until(lambda: not camera.watched, 5.0)
            browser.send("nonsense")
            browser.send(json.dumps({"order": "look", "value": True}))
            assert wait_until(lambda: camera.watched, 5.0)
        assert wait_until(lambda: not camera.watched, 5.0)
        # a late comer is told what has been; the death of a node as well
        with feed(server) as browser:
            assert "truth" in {event["type"] for event in events_until(browser, "truth")}
            camera.close()
            while True:
                nodes = [e for e in events_until(browser, "node") if e["type"] == "node" and e["node"] == "A"]
                if nodes[-1]["state"] == "lost":
                    break
            # and its return
            camera = ZenohTransport(
                "small", "A", Links(), [f"unixsock-stream/{tmp_path}/b"], [endpoint], drop_late_pixels=False
            )
            camera.announce()
            (back,) = [e for e in events_until(browser, "node") if e["type"] == "node"]
            assert (back["node"], back["state"], back["returned"]) == ("A", "alive", True)
    finally:
        camera.close()
        sessions.close(router)


def test_browsers_hear_goodbye_and_the_port_is_free_again(serve):
    server = serve()
    with urllib.request.urlopen(server.url, timeout=5) as page:
        assert "<canvas" in page.read().decode()
    port = int(server.url.rstrip("/").rpartition(":")[2])
    with feed(server) as browser:
        events_until(browser, "setting")
        server.close()
        with pytest.raises(ConnectionClosed) as closed:
            browser.recv(timeout=5)
        assert closed.value.rcvd.code == 1001
    socket.create_server(("127.0.0.1", port)).close()


def test_pages_of_others_may_not_listen(serve):
    with pytest.raises(InvalidStatus, match="403"):
        feed(serve(), origin="http://elsewhere.example")


def test_the_page_steers_a_recording(serve):
    orders = []

    def steer(order):
        if order:
            orders.append(order)
        return {"type": "playback", "frame": len(orders)}

    with feed(serve(steer)) as browser:
        assert events_until(browser, "playback")[0]["recorded"]
        browser.send(json.dumps({"order": "seek", "value": 3}))
        events = events_until(browser, "playback")
    assert orders == [{"order": "seek", "value": 3}]
    assert events[-1] == {"type": "playback", "frame": 1}


def test_a_port_that_is_taken_is_named(small):
    with socket.create_server(LOOPBACK) as other:
        port = other.getsockname()[1]
        story = Story(Assembly(load_scenario(small)), recorded=False)
        with pytest.raises(NetworkError, match=f"port {port}.*another: --port"):
            LiveServer(story, ("127.0.0.1", port))


def test_orders_of_a_run_are_not_taken_for_news(serve, endpoint):
    router = sessions.open_router([endpoint])
    try:
        with feed(serve()) as browser:
            events_until(browser, "node")
            publish(router, "small", ControlMessage("stop"))
            with pytest.raises(TimeoutError):
                browser.recv(timeout=0.3)
    finally:
        sessions.close(router)
