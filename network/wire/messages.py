"""Messages: everything that nodes say to each other and to the outside, as frozen values.

The first three travel as bytes between nodes, the others as JSON for anybody, a preview's in its JPEG;
``network.wire.codec`` turns both into bytes and back. ``kind`` is the last chunk of the key under which a
message is sent.
"""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Annotated, Any, ClassVar, Literal, NamedTuple

import numpy as np
from jaxtyping import Float, UInt8
from pydantic import ConfigDict, Field, GetPydanticSchema, PlainSerializer
from pydantic_core import CoreSchema, core_schema

from network.wire.keys import NAME_PATTERN
from network.wire.quantization import Encoding


def _json_array(nested: Any, empty: tuple[int, ...] = (0,)) -> GetPydanticSchema:
    """Reads an array from the nested lists of this type; an empty list tells no shape and is given one."""

    def to_array(rows: list[Any]) -> np.ndarray:
        """Raises ValueError where the rows differ in length."""
        return np.array(rows, dtype=float) if rows else np.empty(empty)

    def schema(_: Any, handler: Callable[[Any], CoreSchema]) -> CoreSchema:
        return core_schema.no_info_after_validator_function(to_array, handler(nested))

    return GetPydanticSchema(schema)


_AsLists = PlainSerializer(np.ndarray.tolist)
Vector = Annotated[Float[np.ndarray, " D"], _json_array(list[float]), _AsLists]
Matrix = Annotated[Float[np.ndarray, "D D"], _json_array(list[list[float]]), _AsLists]
Name = Annotated[str, Field(pattern=f"^{NAME_PATTERN}$")]
Frame = Annotated[int, Field(ge=0)]
Points = Annotated[Float[np.ndarray, "N A"], _json_array(list[list[float]], empty=(0, 2)), _AsLists]
Fraction = Annotated[float, Field(ge=0, le=1)]
Numbers = dict[str, int | float | dict[str, int | float]]

_STRICT = ConfigDict(strict=True, extra="forbid", allow_inf_nan=False)


def _require_covariance(mean: np.ndarray, covariance: np.ndarray) -> None:
    size = len(mean)
    if covariance.shape != (size, size):
        raise ValueError(f"covariance of shape {covariance.shape} does not fit a mean of {size} numbers")
    scale = np.abs(covariance).max(initial=0.0)
    if not np.allclose(covariance, covariance.T, rtol=0, atol=1e-9 * scale):
        raise ValueError("covariance is not symmetric")


class _OfARound(NamedTuple):
    sender: str
    frame: int
    round: int
    degree: int
    payload: tuple[float, ...]
    encoding: Encoding = "float64"
    down: tuple[tuple[int, int], ...] = ()


class ConsensusMessage(_OfARound):
    """A node's value in one round of consensus.

    A named tuple of plain numbers: of nothing else does a run make as many, and these are the fastest made.

    Attributes:
        sender: The node.
        frame: Frame of the run.
        round: Round within the frame, from 1.
        degree: How many neighbours the sender has in this round.
        payload: Its value after the rounds before this one, in the form that its algorithm gives it.
        encoding: How the payload's numbers are written; they are such as it holds exactly.
        down: Links that were down: their numbers, each with a frame (`network.rounds.membership`).
    """

    __slots__ = ()
    kind: ClassVar[str] = "consensus"


@dataclass(frozen=True, slots=True, eq=False)
class PixelsMessage:
    """A camera's picture, for the centralised filter.

    Attributes:
        sender: The camera.
        frame: Frame of the run.
        image: Its picture, BGR.
    """

    kind: ClassVar[str] = "pixels"
    sender: str
    frame: int
    image: UInt8[np.ndarray, "H W 3"]


@dataclass(frozen=True, slots=True)
class ConfirmMessage:
    """A sink of pictures has used a frame: the cameras may send the next one."""

    kind: ClassVar[str] = "confirm"
    sender: str
    frame: int


@dataclass(frozen=True, slots=True, eq=False)
class EstimateMessage:
    """Where a filter believes the target to be: the public result of a run.

    Attributes:
        run: Name of the run.
        node: The node that estimates.
        estimator: Which filter.
        frame: Frame of the run.
        time_s: Its time, seconds from frame 0.
        mean: State [x, y, vx, vy], or [x, y, z, vx, vy, vz] in a volume; metres and metres a second. Of one
            camera that tracks in its image plane, pixels and pixels a second, (0, 0) being the middle of the
            top left one. Under autoregressive dynamics the position of the frame before stands in the
            velocity's place.
        covariance: Of the state.
        visible: Whether somebody sees the target.
        lost: Whether the filter takes the target for lost.
        ess: Effective sample size, in particles.
        iterations: Consensus rounds done for this frame.
        members: The nodes whose information is in the estimate.

    Raises:
        ValueError: The shapes do not fit, or the covariance is not symmetric.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT
    kind: ClassVar[str] = "estimate"
    run: Name
    node: Name
    estimator: Literal["dcpf", "cpf", "single"]
    frame: Frame
    time_s: float
    mean: Vector
    covariance: Matrix
    visible: bool
    lost: bool
    ess: float
    iterations: Annotated[int, Field(ge=0)]
    members: tuple[Name, ...]

    def __post_init__(self) -> None:
        _require_covariance(self.mean, self.covariance)


@dataclass(frozen=True, slots=True, eq=False)
class StateMessage:
    """What a node knows of the target after a frame: an answer for a neighbour that was away.

    Attributes:
        node: The node.
        frame: Frame of the run.
        mean: State as in its estimates.
        covariance: Of the state.
        looks: What the target looks like to it, as the cameras exchange it in frame 0.

    Raises:
        ValueError: The shapes do not fit, or the covariance is not symmetric.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT
    kind: ClassVar[str] = "state"
    node: Name
    frame: Frame
    mean: Vector
    covariance: Matrix
    looks: Annotated[Float[np.ndarray, " K"], _json_array(list[float]), _AsLists]

    def __post_init__(self) -> None:
        _require_covariance(self.mean, self.covariance)


@dataclass(frozen=True, slots=True)
class ControlMessage:
    """Starts or stops a run.

    Attributes:
        action: What to do.
        start_time_s: Wall-clock time of frame 0, seconds since 1970, for runs in real time.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT
    kind: ClassVar[str] = "control"
    action: Literal["start", "stop"]
    start_time_s: float | None = None


@dataclass(frozen=True, slots=True, eq=False)
class StatusMessage:
    """How a node is.

    Attributes:
        node: The node.
        state: Where it is in its life.
        frame: The last frame that it has finished, -1 before the first.
        counters: What it has counted, such as messages by kind.
        timing: What it has timed, such as percentiles; units in the names.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT
    kind: ClassVar[str] = "status"
    node: Name
    state: Literal["ready", "running", "done", "failed"]
    frame: Annotated[int, Field(ge=-1)]
    counters: Numbers
    timing: Numbers


@dataclass(frozen=True, slots=True, eq=False)
class PreviewMessage:
    """A camera's picture for people, as a JPEG, and where its filter believes the target to be.

    Attributes:
        run: Name of the run.
        node: The camera.
        frame: Frame of the run.
        time_s: Its time, seconds from frame 0.
        particles: Positions of some particles of the fusion filter, all of the same weight; metres, or pixels
            of a camera that tracks in its image plane.
        jpeg: The picture, in the camera's own size.

    Raises:
        ValueError: The particles are not on a plane or in a volume.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT
    kind: ClassVar[str] = "preview"
    run: Name
    node: Name
    frame: Frame
    time_s: float
    particles: Points
    jpeg: Annotated[bytes, Field(exclude=True)] = b""

    def __post_init__(self) -> None:
        if self.particles.shape[1] not in (2, 3):
            raise ValueError(f"particles of {self.particles.shape[1]} numbers are no positions")


@dataclass(frozen=True, slots=True)
class Visibility:
    """How much of the target one camera sees.

    Attributes:
        in_view: Fraction of the target's outline that lies inside the picture.
        occluded: Fraction of that part which something hides.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT
    in_view: Fraction
    occluded: Fraction


@dataclass(frozen=True, slots=True, eq=False)
class TruthMessage:
    """The target's true state.

    Attributes:
        run: Name of the run.
        frame: Frame of the run.
        time_s: Its time, seconds from frame 0.
        mean: State as in the estimates.
        visibility: What each camera sees of the target.
    """

    __pydantic_config__: ClassVar[ConfigDict] = _STRICT
    kind: ClassVar[str] = "truth"
    run: Name
    frame: Frame
    time_s: float
    mean: Vector
    visibility: dict[Name, Visibility]


PeerMessage = ConsensusMessage | PixelsMessage | ConfirmMessage
"""What nodes say to each other, in bytes."""

PublicMessage = EstimateMessage | StateMessage | ControlMessage | StatusMessage | TruthMessage
"""What everybody may read, in JSON."""

Message = PeerMessage | PublicMessage | PreviewMessage
