"""What the inside of a room looks like."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from jaxtyping import Float

from sim.world.floor import FloorOptions, draw_ceiling, draw_floor, shade_floor
from sim.world.room import RoomOptions
from sim.world.texture import Texture
from sim.world.walls import WallsOptions, draw_walls


@dataclass(frozen=True, slots=True, eq=False)
class Interior:
    """What floor, walls and ceiling look like.

    Attributes:
        floor: Rows along y, columns along x, from the room's lowest corner.
        walls: Rows from the floor up, columns along the perimeter.
        ceiling: As the floor.
    """

    floor: Texture
    walls: Texture
    ceiling: Texture


def draw_interior(
    room: RoomOptions,
    floor: FloorOptions,
    walls: WallsOptions,
    footprints: Sequence[Float[np.ndarray, "4 2"]],
    rng: np.random.Generator,
) -> Interior:
    """Draws the inside of a room.

    Args:
        room: Its extent.
        floor: Its floor.
        walls: Its walls.
        footprints: Corners of what stands on the floor and shades it, metres.
        rng: Where everything is.
    """
    tiles = draw_floor(room, floor, walls.poster_colors, rng)
    return Interior(
        floor=shade_floor(tiles, room, footprints),
        walls=draw_walls(room, walls, rng),
        ceiling=draw_ceiling(room),
    )
