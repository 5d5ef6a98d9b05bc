"""What the network has carried, as the transports and the nodes counted it."""

from collections import Counter
from collections.abc import Mapping
from typing import Any

from network.wire.messages import StatusMessage
from sim.scenario.model import Scenario


def network_figures(
    scenario: Scenario, first: Mapping[str, StatusMessage], last: Mapping[str, StatusMessage]
) -> dict[str, Any]:
    """Messages and bytes as the transports counted them, to each receiver.

    The figures a frame are means over the frames after frame 0, in which the cameras exchange what the target
    looks like: its bytes stand apart. Nodes that died on the way have told no total and are left out.

    Args:
        scenario: As run.
        first: The status of each node after frame 0.
        last: The last status of each node that could tell it.
    """
    frames = scenario.frames - 1
    first = {node: status for node, status in first.items() if node in last}
    sent = _total(last, "messages")["consensus"] - _total(first, "messages")["consensus"]
    at_start, octets = _total(first, "bytes"), _total(last, "bytes")
    return {
        "iterations": scenario.network.iterations,
        "messages_per_frame": round(sent / frames, 3),
        "bytes_per_frame": {
            "dcpf": round((octets["consensus"] - at_start["consensus"]) / frames, 1),
            "cpf": round((octets["pixels"] - at_start["pixels"]) / frames, 1),
        },
        "bytes_at_start": {"dcpf": at_start["consensus"], "cpf": at_start["pixels"]},
        "late": sum(int(_number(status.counters.get("late"))) for status in last.values()),
        "refused": int(_total(last, "refused").total()),
        **_troubles(last),
        "lag_s": scenario.lag_frames / scenario.rate_hz,
        "unused": dict(_total(last, "unused")),
    }


def _troubles(statuses: Mapping[str, StatusMessage]) -> dict[str, int]:
    """What became of the rounds' messages that were of no use, or of use only later.

    Returns:
        `lost`: never arrived, between nodes that both have told their totals; `late_messages`: came after
        their round; `duplicated`: came again; `dropped`: came, and could not be used for another reason.
    """
    unused = _total(statuses, "unused")
    duplicated, late = unused["duplicate"], unused["late"] + unused["old"]
    lost = sum(
        sent - _group(statuses[receiver], "received").get(sender, 0)
        for sender, status in statuses.items()
        for receiver, sent in _group(status, "sent").items()
        if receiver in statuses
    )
    return {
        "lost": int(lost) + duplicated,
        "late_messages": late,
        "duplicated": duplicated,
        "dropped": sum(unused[reason] for reason in ("stranger", "ahead", "absent", "shape")),
    }


def _group(status: StatusMessage, name: str) -> Mapping[str, int | float]:
    counted = status.counters.get(name)
    return counted if isinstance(counted, Mapping) else {}


def _total(statuses: Mapping[str, StatusMessage], group: str) -> Counter[str]:
    total: Counter[str] = Counter()
    for status in statuses.values():
        for kind, number in _group(status, group).items():
            total[kind] += int(number)
    return total


def _number(value: object) -> float:
    return float(value) if isinstance(value, int | float) else 0.0
