"""Zenoh sessions: their configuration, how they open, and how they end, in one place.

Nodes are peers that talk directly along the graph's edges; everybody else is a client of the run's one
router. The README says which measurement stands behind which number.
"""

import json
import threading
from collections.abc import Sequence
from typing import Any

import zenoh

from network.errors import NetworkError

_LEASE_MS = 1000
_WAIT_BEFORE_CLOSE_US = 200_000  # shorter than the lease, or a stalled link stays dead after reconnection
_BATCHES = 16  # of 64 KB, the most: two of the largest messages of a round can wait to be sent
_CLOSE_S = 5.0
_FOREVER_MS = -1


def open_peer(listen: Sequence[str], connect: Sequence[str]) -> zenoh.Session:
    """Opens the session of a node.

    Args:
        listen: Endpoints where others find it, such as ``"tcp/10.0.0.3:7001"``.
        connect: Endpoints of neighbours and of the router. They are tried until they answer, again after a
            loss, and nobody waits for them here.

    Raises:
        NetworkError: An endpoint is malformed, or one to listen on cannot be had.
    """
    return _open("peer", listen, connect, wait_ms=_FOREVER_MS, scouting_delay_ms=100)


def open_router(listen: Sequence[str]) -> zenoh.Session:
    """Opens the router through which the outside hears a run.

    Args:
        listen: Endpoints where nodes and clients find it.

    Raises:
        NetworkError: An endpoint cannot be had.
    """
    return _open("router", listen, [], wait_ms=_FOREVER_MS, scouting_delay_ms=0)


def open_client(endpoint: str, timeout_s: float | None = 3.0) -> zenoh.Session:
    """Opens a session from the outside: a client of the run's router.

    Args:
        endpoint: Where the router listens.
        timeout_s: How long to try; None waits until there is one, and finds one again that went.

    Raises:
        NetworkError: Nobody answers there.
    """
    wait_ms = _FOREVER_MS if timeout_s is None else int(1000 * timeout_s)
    return _open("client", [], [endpoint], wait_ms=wait_ms, scouting_delay_ms=0)


def close(session: zenoh.Session) -> None:
    """Ends a session; one that hangs is left behind, it does not keep the process alive."""
    closing = threading.Thread(target=session.close, name="zenoh-close", daemon=True)
    closing.start()
    closing.join(_CLOSE_S)


def _open(
    mode: str, listen: Sequence[str], connect: Sequence[str], *, wait_ms: int, scouting_delay_ms: int
) -> zenoh.Session:
    config = _config(mode, listen, connect, wait_ms, scouting_delay_ms)
    try:
        return zenoh.open(zenoh.Config.from_json5(json.dumps(config)))
    except zenoh.ZError as error:
        cause = str(error).split(" at /")[0]  # what follows are places in Zenoh's sources
        if mode == "client":
            text = f"nothing answers at {connect[0]}: check the endpoint, and that the run is up"
        elif not listen:
            text = f"cannot connect to {', '.join(connect)}: check the endpoint"
        else:
            text = f"cannot listen on {', '.join(listen)}: end what uses it, or choose another endpoint"
        raise NetworkError(f"{text} ({cause})") from error


def _config(
    mode: str, listen: Sequence[str], connect: Sequence[str], wait_ms: int, scouting_delay_ms: int
) -> dict[str, Any]:
    return {
        "mode": mode,
        "listen": {"endpoints": list(listen)},
        "connect": {
            "endpoints": list(connect),
            "timeout_ms": wait_ms,
            "exit_on_failure": wait_ms != _FOREVER_MS,
            "retry": {"period_init_ms": 50, "period_max_ms": 200, "period_increase_factor": 1.5},
        },
        "scouting": {
            "delay": scouting_delay_ms,
            "multicast": {"enabled": False},
            # without gossip, two routers deliver everything twice; it must not make links of its own
            "gossip": {"enabled": True, "autoconnect": {"peer": [], "router": [], "client": []}},
        },
        "transport": {
            "shared_memory": {"enabled": False},  # senders hang when the receiver goes
            "link": {
                "tx": {
                    "lease": _LEASE_MS,
                    "keep_alive": 4,
                    "queue": {
                        "size": {"real_time": _BATCHES},
                        "congestion_control": {"block": {"wait_before_close": _WAIT_BEFORE_CLOSE_US}},
                    },
                }
            },
        },
    }
