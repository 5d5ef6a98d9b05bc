"""Replays over Zenoh: whoever listens hears what the run told."""

import socket
from contextlib import closing

import pytest

from network.errors import NetworkError
from network.links import sessions
from network.wire import keys
from sim.replay.opening import open_recording
from sim.replay.playback import Playback
from sim.replay.player import Replay

pytestmark = pytest.mark.processes


@pytest.fixture
def endpoint():
    with socket.socket() as probe:
        probe.bind(("127.0.0.1", 0))
        return f"tcp/127.0.0.1:{probe.getsockname()[1]}"


@pytest.mark.parametrize("pictures", [True, False])
def test_listeners_hear_the_run_again(recorded, endpoint, wait_until, pictures):
    run = recorded(pictures=pictures)
    heard, tokens = [], []
    with closing(open_recording(run.folder)) as recording:
        playback = Playback(recording.frames, recording.scenario.rate_hz, speed=2.0)
        player = Replay(recording, endpoint, playback)
        listener = sessions.open_client(endpoint)
        listener.declare_subscriber("dcpf/small/**", heard.append)
        listener.liveliness().declare_subscriber(keys.alive("small"), tokens.append, history=True)
        done = []
        player.run(done.append)
        assert wait_until(lambda: sum("estimate" in str(each.key_expr) for each in heard) == 54, 5.0)
        assert done[-1] == 6
        player.close()
        sessions.close(listener)

    said = [(str(each.key_expr), each.payload.to_bytes()) for each in heard]
    assert sorted(data for key, data in said if key.endswith("estimate")) == sorted(run.lines("estimates"))
    assert [data for key, data in said if key.endswith("truth")] == run.lines("truth")
    assert {str(each.encoding) for each in heard if str(each.key_expr).endswith("truth")} == {
        "application/json;dcpf.truth.v1"
    }
    assert {str(each.encoding) for each in heard if str(each.key_expr).endswith("preview")} == {"image/jpeg"}
    assert len({key for key, _ in said if key.endswith("preview")}) == 4
    gone = [str(each.key_expr) for each in tokens if "DELETE" in str(each.kind)]
    assert gone[0] == "dcpf/small/B/alive"


def test_the_page_steers_it(recorded, endpoint):
    run = recorded()
    with (
        closing(open_recording(run.folder)) as recording,
        closing(Replay(recording, endpoint, Playback(recording.frames, 10.0, loop=True))) as player,
    ):
        assert player.steered({})["paused"]
        assert player.steered({"order": "seek", "value": 4})["frame"] == 4
        assert player.steered({"order": "speed", "value": 2})["speed"] == 2
        assert not player.steered({"order": "play"})["paused"]
        assert player.steered({"order": "pause"})["paused"]
        assert player.steered({"order": "dance", "value": []})["paused"]
        with pytest.raises(ValueError, match="above 0"):
            player.steered({"order": "speed", "value": -1})


def test_a_port_that_is_taken_is_named(recorded, endpoint):
    run = recorded()
    port = int(endpoint.rpartition(":")[2])
    with (
        closing(open_recording(run.folder)) as recording,
        socket.create_server(("127.0.0.1", port)),
        pytest.raises(NetworkError, match=endpoint),
    ):
        Replay(recording, endpoint, Playback(1, 1.0))
