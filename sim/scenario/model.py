"""The scenario: what a file can say. It composes the options that stand beside the things they configure."""

from collections import Counter
from collections.abc import Mapping
from typing import Literal

from pydantic import Field, model_validator

from network.averaging.weights import ConsensusOptions
from network.graphs.graph import Edge, Graph, complete, grid, path, ring, star
from network.links.conditions import ConditionsOptions
from network.options import Options
from network.wire.quantization import PayloadOptions
from nodes.filtering.fusion import FusionOptions
from nodes.setup import FilterOptions
from nodes.shell.pace import lag_for
from nodes.vision.target import TargetOptions
from sim.faults.options import FaultOptions, require_possible
from sim.scenario.cameras import Cameras, Name
from sim.scenario.graphs import DescribedGraph
from sim.scenario.presets import PresetName
from sim.scenario.sensor import SensorOptions
from sim.world.world import WorldOptions


class FootageOptions(Options):
    """Recorded videos in place of a rendered world."""

    name: str | None = None
    """Footage that `dcpf footage` fetches."""
    folder: str | None = None
    """A folder of one's own, relative to the scenario file, instead."""
    calibration: str | None = None
    """Calibration file of all cameras, relative to the footage's folder."""
    ground_truth: str | None = None
    """CSV with columns frame, x_m, y_m, z_m, relative to the scenario file."""
    scale: float = Field(default=1.0, gt=0, le=1)
    """Size at which the pictures are used, as a fraction of the videos'."""
    first_frame: int = Field(default=0, ge=0)
    """Frame of the videos, and of the ground truth, with which the run begins."""

    @model_validator(mode="after")
    def _one_place(self) -> "FootageOptions":
        if (self.name is None) == (self.folder is None):
            raise ValueError("footage needs name or folder: what `dcpf footage` fetches, or your own")
        return self


class NetworkOptions(Options):
    """Who talks to whom, and how they agree."""

    graph: Literal["ring", "path", "star", "complete", "grid"] | tuple[Edge, ...] | DescribedGraph = "ring"
    """The communication graph: a shape over the cameras in their order, a list of pairs of their names, or
    a graph by its `kind`: `geometric`, `watts_strogatz`, `overlap` or `file`."""
    consensus: ConsensusOptions
    """The averaging."""
    iterations: int = Field(default=12, ge=0, le=1000)
    """Rounds of consensus in a frame, t."""
    lag_frames: int | None = Field(default=None, ge=0, le=100)
    """In real time, how many frames longer than one the rounds of a frame may take: so much later comes its
    estimate, while the next frames have begun. null: as many as the conditions' delays ask for."""
    payload: PayloadOptions = PayloadOptions()
    """How many bits a number of the rounds has."""
    conditions: ConditionsOptions = ConditionsOptions()
    """What the links do to messages."""
    deadline_s: float = Field(default=5.0, gt=0)
    """In lockstep, the time that a frame waits for messages before it goes on without them, in s."""
    router: str = "tcp/127.0.0.1:7447"
    """Zenoh endpoint at which the run's router serves the outside."""
    endpoints: Mapping[Name, str] = Field(default={})
    """Zenoh endpoints at which nodes listen when they are started by hand; the others take loopback ports."""

    @model_validator(mode="after")
    def _weights_fit_the_payload(self) -> "NetworkOptions":
        if self.consensus.algorithm == "ratio" and self.payload.encoding == "float16":
            raise ValueError(
                "network.payload.encoding is float16, in which ratio consensus' weights vanish beside large"
                " numbers: take float32"
            )
        return self


class CentralOptions(Options):
    """The central node."""

    name: Name = "central"
    """Its name."""


class BaselineOptions(Options):
    """What DCPF is compared with."""

    cpf: bool = True
    """The centralised particle filter, at the central node, on every camera's pixels."""
    single: bool = True
    """Each camera's filter on its own."""


class Scenario(Options):
    """A camera network, what it looks at, and how it tracks."""

    name: Name
    """Name of the scenario, and of its runs unless they are given another."""
    preset: PresetName = "robust"
    """`paper`: the paper's features and rules; `robust`: the filter to use. Fills what the file leaves
    unsaid."""
    frames: int = Field(ge=2, le=1_000_000)
    """Frames of a run; frame 0 is the initialisation."""
    rate_hz: float = Field(gt=0)
    """Frames a second."""
    seed: int = Field(default=0, ge=0)
    """Everything random comes from it."""
    pace: Literal["lockstep", "realtime"] = "lockstep"
    """`lockstep`: a frame begins when the one before is done; `realtime`: at its time, whatever is done."""
    world: WorldOptions | None = None
    """The rendered world, or"""
    footage: FootageOptions | None = None
    """the recorded one."""
    target: TargetOptions
    """What is tracked."""
    cameras: Cameras
    """The smart cameras, in the order of the graph: a list, or a `layout` of as many as one likes."""
    network: NetworkOptions
    """Who talks to whom."""
    filter: FilterOptions = FilterOptions()
    """The particle filters."""
    fusion: FusionOptions = FusionOptions()
    """How the cameras' results become one."""
    central: CentralOptions = CentralOptions()
    """The central node."""
    baselines: BaselineOptions = BaselineOptions()
    """What DCPF is compared with."""
    faults: tuple[FaultOptions, ...] = ()
    """What goes wrong, each by its `kind`, `frame` and, but for the router, `node`."""
    sensor: SensorOptions = SensorOptions()
    """What `dcpf simulate` puts in the place of pictures."""

    @model_validator(mode="after")
    def _world_or_footage(self) -> "Scenario":
        if (self.world is None) == (self.footage is None):
            raise ValueError("a scenario needs world or footage, one of them: add or remove one")
        return self

    @model_validator(mode="after")
    def _names(self) -> "Scenario":
        names = [camera.name for camera in self.cameras]
        for name, count in Counter(names).items():
            if count > 1:
                raise ValueError(f"cameras has two named {name}: give each its own name")
        if self.central.name in names:
            raise ValueError(f"central.name is {self.central.name}, as is a camera: give it another name")
        return self

    @model_validator(mode="after")
    def _target(self) -> "Scenario":
        target = self.target
        if target.space == "image" and len(self.cameras) > 1:
            raise ValueError(
                f"target.space is image, the pixels of one camera, and there are {len(self.cameras)} cameras:"
                " keep one, or track on a plane or in a volume"
            )
        dynamics = self.filter.dynamics
        if target.n_axes != 2 and (isinstance(dynamics.A, tuple) or isinstance(dynamics.B, tuple)):
            raise ValueError("filter.dynamics.A or B is 2 x 2, and a volume has three axes: give a number")
        if self.world is not None:
            self._require_in_world(self.world)
        for key, vector in (("velocity", target.start.velocity), ("position", target.start.position)):
            if vector != "truth" and len(vector) != target.n_axes:
                raise ValueError(
                    f"target.start.{key} has {len(vector)} numbers: a target {SPACES[target.space]} needs"
                    f" {target.n_axes}"
                )
        return self

    def _require_in_world(self, world: WorldOptions) -> None:
        target = self.target
        if target.person is not None and target.object is not None:
            raise ValueError(
                f"target names the person {target.person} and the object {target.object}: set one to null"
            )
        if target.person is None and target.object is None:
            there = [person.name for person in world.people] + [each.name for each in world.objects]
            raise ValueError(
                f"target needs a person or an object of the world: name one of {', '.join(there)}"
            )
        if target.object is None:
            key, group, known = "person", "people", [person.name for person in world.people]
        else:
            key, group, known = "object", "objects", [each.name for each in world.objects]
        name = getattr(target, key)
        if name not in known:
            raise ValueError(
                f"target.{key} is {name}, who is not in world.{group}: name one of {', '.join(known)}"
            )
        if target.part != "body" and (target.object is not None or target.space == "plane"):
            of_what = "a target on a plane" if target.space == "plane" else "an object"
            raise ValueError(f"target.part is {target.part}: {of_what} has no parts, leave it out")

    @model_validator(mode="after")
    def _faults(self) -> "Scenario":
        names = [camera.name for camera in self.cameras]
        require_possible(self.faults, names, self.frames, rendered=self.world is not None)
        return self

    @model_validator(mode="after")
    def _network(self) -> "Scenario":
        if isinstance(self.network.graph, str | tuple):
            self.require_convergence()
        return self

    def require_convergence(self) -> None:
        """Checks that consensus converges on the graph, and that the conditions fit it.

        Raises:
            ValueError: The graph falls into parts, or the averaging or the conditions do not suit it.
        """
        graph, network = self.graph, self.network
        graph.require_connected()
        network.consensus.require_convergence(graph.max_degree)
        network.consensus.tuned(graph, network.iterations)
        network.conditions.require_possible(graph.edges, graph.names, self.frames)

    @property
    def graph(self) -> Graph:
        """The communication graph over the cameras.

        Raises:
            ValueError: It is described and not yet worked out, which reading the scenario does.
        """
        names, graph = [camera.name for camera in self.cameras], self.network.graph
        if isinstance(graph, str):
            return GRAPHS[graph](names)
        if isinstance(graph, tuple):
            return Graph.from_edges(names, graph)
        raise ValueError(f"the {graph.kind} graph of {self.name} is not worked out: load the scenario")

    @property
    def lag_frames(self) -> int:
        """How many frames more than one the rounds of a frame may take; none in lockstep, which waits."""
        if self.pace == "lockstep":
            return 0
        asked = self.network.lag_frames
        return self.needed_lag_frames if asked is None else asked

    @property
    def needed_lag_frames(self) -> int:
        """The lag that the conditions' delays ask for in real time."""
        network = self.network
        return lag_for(network.iterations, network.conditions.latest_round_s, self.rate_hz)

    @property
    def n_processes(self) -> int:
        """Processes of a run: cameras, the central node if there is one, and the router."""
        return len(self.cameras) + self.baselines.cpf + 1


SPACES = {"plane": "on a plane", "volume": "in a volume", "image": "in the image plane"}
"""Where a target is, in words."""

GRAPHS = {"ring": ring, "path": path, "star": star, "complete": complete, "grid": grid}
"""The graphs that a scenario can name."""
