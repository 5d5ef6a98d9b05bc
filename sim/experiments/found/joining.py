"""The summary of a run that was computed in parts."""

from collections.abc import Mapping
from typing import Any

from sim.results.results import length


def joined(summaries: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """The summary that the run would have written as a whole, without timings.

    Args:
        summaries: Of the cameras' part, of the central node's, or of both, by `cameras` and `central`.
    """
    central = summaries.get("central")
    whole = dict(summaries.get("cameras") or central or summaries["coded"])
    whole.pop("timing")
    if central is None or "cameras" not in summaries:
        return whole
    for key in (f"rmse_{whole['unit']}", "lost", "anees", "tracking"):
        whole[key] = {**whole[key], "cpf": central[key]["cpf"]}
    network = {**whole["network"]}
    for key in ("bytes_per_frame", "bytes_at_start"):
        network[key] = {**network[key], "cpf": central["network"][key]["cpf"]}
    ours, theirs = (length(whole, "rmse")[name] for name in ("dcpf", "cpf"))
    return {
        **whole,
        "network": network,
        "ratio_dcpf_cpf": ours / theirs if ours is not None and theirs else None,
    }
