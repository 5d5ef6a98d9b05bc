"""What links do to messages: loss, delay, jitter, bandwidth, duplicates, partitions; a pure, seeded model.

Everything about bad links lives here. Each direction of a link is a channel with a stream of its own, by the
names of its ends, and takes the same number of draws for every message: another camera, another link or
another option changes no draw of this one.

A channel keeps the order of its messages, as Zenoh's links do. A message waits until the line is free, takes
its length over the bandwidth to be written, travels for the delay and a part of the jitter, and is lost,
arrives, or arrives twice.
"""

from collections import Counter
from collections.abc import Collection
from typing import Annotated

from pydantic import AfterValidator, Field, model_validator

from network.options import Options
from network.streams import stream
from network.wire.keys import check_name

Name = Annotated[str, AfterValidator(check_name)]
Probability = Annotated[float, Field(ge=0, le=1)]

QUEUE_S = 1.0
"""A line holds as much as it can write in this time, in s; what comes on top is lost."""
NS = 1_000_000_000
"""Nanoseconds in a second: virtual time is counted in whole ones, so that equal times are equal."""


class LinkOptions(Options):
    """What a link does to every message."""

    loss: Probability = 0.0
    """Probability with which a message is lost, each for itself."""
    delay_s: float = Field(default=0.0, ge=0, le=3600)
    """Time on the way, in s."""
    jitter_s: float = Field(default=0.0, ge=0, le=3600)
    """What comes on top of the delay, evenly distributed from 0 to this, in s; the order stays."""
    bytes_per_s: float | None = Field(default=None, gt=0)
    """Bandwidth, in bytes a second; null for as much as there is to send."""
    duplicates: Probability = 0.0
    """Probability with which a message that arrives does so twice."""

    @property
    def is_perfect(self) -> bool:
        """Whether messages arrive at once, all and once."""
        return self.bytes_per_s is None and not (self.loss or self.duplicates or self.latest_s)

    @property
    def latest_s(self) -> float:
        """How long a message is on the way at the most, where the line is free, in s."""
        return self.delay_s + self.jitter_s


class OneLinkOptions(LinkOptions):
    """A link with conditions of its own, in place of those of all others."""

    link: tuple[Name, Name]
    """The two cameras."""
    directed: bool = False
    """Whether only messages from the first to the second are meant; otherwise both directions."""


class PartitionOptions(Options):
    """For some frames, the network falls into parts that do not hear each other."""

    groups: tuple[Annotated[tuple[Name, ...], Field(min_length=1)], ...] = Field(min_length=1)
    """The parts; cameras that are in none of them are one more."""
    first_frame: int = Field(ge=0)
    """The frame whose messages are the first to be lost."""
    frames: int = Field(gt=0)
    """For how many frames; then it heals."""

    @model_validator(mode="after")
    def _in_one_group(self) -> "PartitionOptions":
        for name, times in Counter(name for group in self.groups for name in group).items():
            if times > 1:
                raise ValueError(f"groups has {name} twice: a camera is in one part")
        return self

    def parts(self, one: str, other: str, frame: int) -> bool:
        """Whether it stands between two nodes in a frame."""
        lasts = self.first_frame <= frame < self.first_frame + self.frames
        return lasts and self._side(one) != self._side(other)

    def _side(self, name: str) -> int:
        return next((i for i, group in enumerate(self.groups) if name in group), -1)


class ConditionsOptions(LinkOptions):
    """What the links between cameras do to the messages of the rounds; pixels always arrive."""

    links: tuple[OneLinkOptions, ...] = ()
    """Links that differ from the others, each with all that holds for it; the last that fits counts."""
    partitions: tuple[PartitionOptions, ...] = ()
    """When the network falls into parts."""

    @property
    def are_perfect(self) -> bool:
        """Whether they change nothing."""
        return not self.partitions and all(link.is_perfect for link in (self, *self.links))

    @property
    def lose(self) -> bool:
        """Whether some link loses messages at random."""
        return any(link.loss for link in (self, *self.links))

    @property
    def vary(self) -> bool:
        """Whether some link takes longer for one message than for another of the same length."""
        return any(link.jitter_s for link in (self, *self.links))

    @property
    def latest_round_s(self) -> float:
        """How long a message is on its way at the most, on the slowest link while its line is free, in s."""
        return max(link.latest_s for link in (self, *self.links))

    def of(self, source: str, target: str) -> LinkOptions:
        """What holds for the messages from one node to another."""
        found: LinkOptions = self
        for each in self.links:
            if each.link == (source, target) or (not each.directed and each.link == (target, source)):
                found = each
        return found

    def require_possible(
        self, edges: Collection[tuple[str, str]], names: Collection[str], frames: int
    ) -> None:
        """Checks that everybody and every link that is named is there, and that all partitions come about.

        Args:
            edges: The graph's links.
            names: The cameras.
            frames: Frames of the run.

        Raises:
            ValueError: One is not; the message names it.
        """
        there = {frozenset(edge) for edge in edges}
        for each in self.links:
            if frozenset(each.link) not in there:
                raise ValueError(
                    f"network.conditions.links names {each.link[0]} and {each.link[1]}, between which the"
                    " graph has no link: name the two ends of one"
                )
        for name in (name for each in self.partitions for group in each.groups for name in group):
            if name not in names:
                raise ValueError(
                    f"network.conditions.partitions names {name}, which is no camera: name some of"
                    f" {', '.join(names)}"
                )
        for partition in self.partitions:
            if partition.first_frame >= frames:
                raise ValueError(
                    f"network.conditions.partitions has one from frame {partition.first_frame} on: the run"
                    f" ends with frame {frames - 1}, take an earlier one"
                )


class Channel:
    """One direction of a link: says of each message when it arrives."""

    def __init__(self, conditions: ConditionsOptions, seed: int, source: str, target: str) -> None:
        """A channel on which nothing has been sent.

        Args:
            conditions: Of the whole network.
            seed: The scenario's.
            source: Who sends on it.
            target: Who receives.
        """
        self._link, self._partitions = conditions.of(source, target), conditions.partitions
        self._ends = source, target
        self._rng = stream(seed, "link", source, target)
        self._free_ns = 0
        self._last_ns = 0

    def carry(self, now_ns: int, size_bytes: int, frame: int) -> tuple[int, ...]:
        """When a message arrives: no time if it is lost, two if it is duplicated.

        Args:
            now_ns: When it is sent, in ns; not before the one sent before it.
            size_bytes: Its length.
            frame: Frame that it belongs to.
        """
        lost, jitter, jitter_of_copy, copied = self._rng.random(4)
        link = self._link
        if any(each.parts(*self._ends, frame) for each in self._partitions):
            return ()
        # wait for the line, and write
        begin_ns = max(now_ns, self._free_ns)
        if begin_ns - now_ns > QUEUE_S * NS:
            return ()
        if link.bytes_per_s is not None:
            begin_ns += round(NS * size_bytes / link.bytes_per_s)
        self._free_ns = begin_ns
        if lost < link.loss:
            return ()
        # travel
        copies = (jitter, jitter_of_copy) if copied < link.duplicates else (jitter,)
        return tuple(self._arrival_ns(begin_ns, part) for part in copies)

    def _arrival_ns(self, begin_ns: int, part: float) -> int:
        """The arrival of what was written at a time, not before what came last."""
        travelled_ns = round(NS * (self._link.delay_s + part * self._link.jitter_s))
        self._last_ns = max(self._last_ns, begin_ns + travelled_ns)
        return self._last_ns
