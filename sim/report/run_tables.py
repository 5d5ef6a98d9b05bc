"""The tables of a run's report."""

from collections.abc import Mapping
from typing import Any

from sim.assembly import Assembly
from sim.metrics.consistency import anees_band
from sim.report.elements import Table
from sim.results.results import Results, length

ABSENT = "–"


def figures_table(results: Results, summary: Mapping[str, Any]) -> Table:
    """How exact each estimator is, whether it knows, and whether it lost the target."""
    unit = results.scenario.target.unit
    rmse, lost = length(summary, "rmse"), summary["lost"]
    rows = []
    for label, kind in (("DCPF, all nodes", "dcpf"), ("CPF", "cpf")):
        if not results.of(kind):
            continue
        tracking = summary["tracking"][kind] or {}
        rows.append(
            [
                label,
                number(rmse[kind], unit),
                number(tracking.get(f"ospa_{unit}"), unit),
                number(tracking.get(f"gospa_{unit}"), unit),
                ABSENT if summary["anees"][kind] is None else f"{summary['anees'][kind]:.2f}",
                _in_words(lost[kind]),
                ABSENT if not tracking else f"{tracking['losses_per_node']:.3g}",
                ABSENT if not tracking else seconds(tracking["reacquired_after_s"]),
            ]
        )
    rows += [
        [f"{node} alone", number(value, unit), *[ABSENT] * 3, _in_words(lost["single"][node]), *[ABSENT] * 2]
        for node, value in rmse["single"].items()
    ]
    low, high = anees_band(1, results.scenario.target.n_axes)
    headings = (
        "estimator",
        f"RMSE / {unit}",
        f"OSPA / {unit}",
        f"GOSPA / {unit}",
        "ANEES",
        "lost at the end",
        "losses a node",
        "found again after",
    )
    note = (
        "ANEES: 1 if a filter's covariance says how wrong it is; with one run as one independent error, a"
        f" consistent filter's lies between {low:.2f} and {high:.2f} in 95% of the runs. Intervals of the"
        " RMSE need several runs: dcpf compare gives them."
    )
    return Table("Errors over frames 1 to the last", headings, rows, note)


def links_table(results: Results, assembly: Assembly, summary: Mapping[str, Any]) -> Table | None:
    """What each link carries in a frame, in each direction; None where nobody has counted.

    A node's rounds go to all its neighbours alike, so that each of its links carries an equal part.
    """
    sent = summary.get("sent_per_frame")
    if not sent:
        return None
    neighbors = {name: assembly.graph.neighbors(name) for name in assembly.graph.names}
    rows = [
        [f"{sender} → {receiver}", "rounds", *_share(sent[sender], "consensus", len(receivers))]
        for sender, receivers in neighbors.items()
        for receiver in receivers
        if sender in sent
    ]
    if results.scenario.baselines.cpf:
        central = results.scenario.central.name
        rows += [
            [f"{sender} → {central}", "pictures", *_share(sent[sender], "pixels", 1)]
            for sender in neighbors
            if sender in sent
        ]
    if not rows:
        return None
    octets = summary["network"]["bytes_per_frame"]
    note = (
        f"All links together, a frame: {octets['dcpf']:,.0f} B for DCPF, {octets['cpf']:,.0f} B for CPF."
        " Payloads as sent, in the mean of the frames after the first."
    )
    return Table("What each link carries in a frame", ("link", "what", "messages", "bytes"), rows, note)


def messages_table(results: Results, summary: Mapping[str, Any]) -> Table | None:
    """What became of the rounds' messages; None where there are none, or nobody has counted."""
    if not (results.scenario.graph.edges and summary.get("sent_per_frame")):
        return None
    network = summary["network"]
    fates = {
        "lost": "lost: never arrived",
        "late_messages": "late: arrived after their round",
        "duplicated": "duplicated: arrived again",
        "dropped": "dropped: arrived, and were of no use",
        "refused": "refused: were not valid",
    }
    rows = [[words, f"{network[key]:,}"] for key, words in fates.items()]
    note = (
        f"Of {network['messages_per_frame']:,.4g} a frame, over all links and in both directions. Nodes that"
        " died on the way have not told theirs."
    )
    return Table("What became of the messages of the rounds", ("messages", "how many"), rows, note)


def events_table(summary: Mapping[str, Any]) -> Table | None:
    """Who was lost, came back, or no longer looked where it should; None where nobody was."""
    rows = [
        [
            event["node"],
            f"knocked, for {event['frames']} frames" if event["event"] == "knocked" else event["event"],
            str(event["frame"]),
        ]
        for event in summary["members"]["events"]
    ]
    note = (
        "Lost: no other camera counts it any more; back: all do again; knocked: it looks elsewhere than in"
        " the beginning."
    )
    return Table("Lost and back", ("camera", "what", "frame"), rows, note) if rows else None


def timing_table(summary: Mapping[str, Any]) -> Table | None:
    """How long a run's steps took; None where nobody has timed them."""
    timing = summary.get("timing", {})
    names = {
        "first_estimate_s": ("first fused estimate after the command", "s"),
        "frames_per_s": ("frames a second", ""),
    }
    rows = [
        [words, f"{timing[key]:.3g} {unit}".strip(), ABSENT]
        for key, (words, unit) in names.items()
        if key in timing
    ]
    steps = {
        "local_filter_ms": "a camera's own filter, a frame",
        "consensus_round_ms": "a round of consensus",
    }
    rows += [
        [words, f"{timing[key]['p50']:.3g} ms", f"{timing[key]['p99']:.3g} ms"]
        for key, words in steps.items()
        if key in timing
    ]
    late = summary.get("network", {}).get("late")
    if late is not None and rows:
        rows.append(["frames cut for want of time", str(late), ABSENT])
    headings = ("step", "value or median", "99th percentile")
    return (
        Table("Median and 99th percentile over the frames; of the slowest camera", headings, rows)
        if rows
        else None
    )


def array_table(results: Results, summary: Mapping[str, Any]) -> Table | None:
    """What a frame costs on a camera's emulated array; None where no camera runs on one."""
    cost = summary.get("simd")
    if cost is None:
        return None
    rows = [
        ["cycles", f"{cost['cycles']:,}"],
        [f"time at {cost['clock_mhz']:g} MHz", f"{1e-3 * cost['frame_us']:.3g} ms"],
        ["share of the frame", f"{cost['share_of_frame']:.1%}"],
        ["line memory", f"{cost['line_memory_words']} of {results.scenario.filter.simd.words} words"],
        ["frames a second that it holds", f"{cost['rate_hz']:.3g}"],
    ]
    return Table(
        "On a camera's processor array, which is emulated: the most of all cameras",
        ("of a frame", "value"),
        rows,
    )


def number(value: float | None, unit: str) -> str:
    """A length: to a millimetre, or to a tenth of a pixel."""
    return ABSENT if value is None else f"{value:.{1 if unit == 'px' else 3}f}"


def seconds(value: float | None) -> str:
    """A duration."""
    return ABSENT if value is None else f"{value:.2g} s"


def _share(sent: Mapping[str, Mapping[str, float]], kind: str, links: int) -> list[str]:
    messages, octets = (sent.get(group, {}).get(kind, 0.0) / links for group in ("messages", "bytes"))
    return [f"{messages:.4g}", f"{octets:,.0f}"]


def _in_words(fact: object) -> str:
    return ABSENT if fact is None else "yes" if fact else "no"
