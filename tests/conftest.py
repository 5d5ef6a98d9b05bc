"""For all tests: how many examples hypothesis tries, and a small room for whole nodes."""

import time
from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import settings

from nodes.filtering.fusion import FusionOptions
from nodes.imaging.camera import look_at
from nodes.setup import FilterOptions, Start, TrackingSetup
from nodes.vision.color import ColorOptions
from nodes.vision.observation import ObservationModel
from nodes.vision.target import TargetOptions, project_boxes

# No verdict may depend on how busy the machine is.
settings.register_profile("dcpf", deadline=None, max_examples=40)
settings.load_profile("dcpf")

SIZE_PX = (96, 72)
CORNERS = {"C1": (-5.0, -5.0), "C2": (5.0, -5.0), "C3": (5.0, 5.0), "C4": (-5.0, 5.0)}


@dataclass
class Room:
    """Four cameras in the corners around a walking rectangle; those in `turned_away` look outwards."""

    turned_away: tuple[str, ...] = ()
    fusion: FusionOptions = field(default_factory=FusionOptions)
    setup: TrackingSetup = field(init=False)
    models: dict[str, ObservationModel] = field(init=False)

    def __post_init__(self):
        target = TargetOptions(height=1.7, width=0.5)
        filter_options = FilterOptions(n_particles=150, color=ColorOptions(bins_per_channel=4))
        start = Start(np.array([0.0, -0.5, 0.0, 1.0]), np.array([0.1, 0.1, 0.15, 0.15]))
        self.setup = TrackingSetup("room", 7, 10.0, target, start, filter_options, self.fusion)
        self.models = {
            name: ObservationModel(self._camera(name, *corner), target, filter_options)
            for name, corner in CORNERS.items()
        }

    def _camera(self, name, x, y):
        aim = np.array([2 * x, 2 * y, 1.0]) if name in self.turned_away else np.array([0.0, 0.0, 1.0])
        return look_at(name, np.array([x, y, 2.5]), aim, 80.0, SIZE_PX, np.zeros(5))

    def position(self, frame):
        """Where the target is: 1 m/s along y."""
        return np.array([0.0, -0.5 + 0.1 * frame])

    def image(self, name, frame):
        """A camera's picture, noise and all."""
        image = np.random.default_rng([frame, int(name[1:])]).integers(90, 160, (72, 96, 3), dtype=np.uint8)
        model = self.models[name]
        box = project_boxes(self.position(frame)[None], model.target, model.camera)[0]
        if np.isfinite(box).all():
            left, top, right, bottom = np.clip(np.rint(box), 0, 1000).astype(int)
            image[top:bottom, left:right] = (30, 40, 200)
        return image


@pytest.fixture
def room():
    """The class, to furnish one as the test needs it."""
    return Room


@pytest.fixture
def wait_until():
    """Waits until something holds, and tells whether it did in time."""

    def wait(condition, limit_s=30.0):
        limit = time.monotonic() + limit_s
        while not condition():
            if time.monotonic() > limit:
                return False
            time.sleep(0.02)
        return True

    return wait
