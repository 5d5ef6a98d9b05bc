"""What stands in the way: panels, partitions, pillars and boxes, all of them upright boxes."""

from dataclasses import dataclass
from typing import Annotated

import numpy as np
from jaxtyping import Float
from pydantic import Field, model_validator

from network.options import Options
from sim.world.colors import Color, bgr
from sim.world.mesh import Solids

_CELL_M = 0.25  # faces are divided this finely: a lens bends them, and they may pass beside a camera

Coordinate = Annotated[float, Field(allow_inf_nan=False)]


class OccluderOptions(Options):
    """An upright box over a line on the floor: a panel if thin, a pillar if short, a wall if long."""

    start: tuple[Coordinate, Coordinate]
    """Where the line on the floor starts: x and y, metres."""
    end: tuple[Coordinate, Coordinate]
    """Where it ends: x and y, metres."""
    thickness: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 0.05
    """Width of the box across the line, metres."""
    bottom: Annotated[float, Field(ge=0, allow_inf_nan=False)] = 0.0
    """Height of its lower side, metres; above 0 it hangs."""
    top: Annotated[float, Field(gt=0, allow_inf_nan=False)] = 2.0
    """Height of its upper side, metres."""
    color: Color = "#7a6f60"
    """Its colour."""

    @model_validator(mode="after")
    def _has_volume(self) -> "OccluderOptions":
        if self.start == self.end:
            raise ValueError(f"start and end are both {list(self.start)}: an occluder needs some length")
        if self.top <= self.bottom:
            raise ValueError(f"top {self.top} is not above bottom {self.bottom}")
        return self


@dataclass(frozen=True, slots=True, eq=False)
class Occluder:
    """An upright box.

    Attributes:
        footprint: Its corners on the floor, metres, counterclockwise from above.
        outward: The directions of its sides, from the first two corners on.
        reach: How far its sides are from the origin along them, metres.
        on_floor: Whether it stands on the floor.
        solid: Its surface.
    """

    footprint: Float[np.ndarray, "4 2"]
    outward: Float[np.ndarray, "4 2"]
    reach: Float[np.ndarray, " 4"]
    on_floor: bool
    solid: Solids

    @property
    def center(self) -> Float[np.ndarray, " 2"]:
        """Middle of the footprint, metres."""
        return self.footprint.mean(axis=0)

    def may_hide(self, point: Float[np.ndarray, " 2"], viewer: Float[np.ndarray, " 2"]) -> bool:
        """Whether it is in front of a point rather than behind it.

        If some side has both the point and the viewer on its outer hand, the box lies behind that side and
        hides nothing; otherwise it is the box that may hide.

        Args:
            point: A point on the floor, metres.
            viewer: The floor below the viewer, metres.
        """
        point_outside = self.outward @ point > self.reach
        viewer_outside = self.outward @ viewer > self.reach
        return not (point_outside & viewer_outside).any()


def build_occluder(options: OccluderOptions) -> Occluder:
    """An occluder as the options describe it."""
    start, end = np.array(options.start), np.array(options.end)
    along = (end - start) / np.linalg.norm(end - start)
    across = np.array([-along[1], along[0]])
    half = across * options.thickness / 2
    footprint = np.stack([start - half, end - half, end + half, start + half])
    outward = np.stack([-across, along, across, -along])
    base = np.column_stack([footprint, np.full(4, options.bottom)])
    up = np.array([0.0, 0.0, options.top - options.bottom])
    sides = [(base[i], base[(i + 1) % 4] - base[i], up) for i in range(4)]
    lid = (base[0] + up, base[1] - base[0], base[3] - base[0])
    underside = (base[0], base[3] - base[0], base[1] - base[0])
    return Occluder(
        footprint=footprint,
        outward=outward,
        reach=(outward * footprint).sum(axis=1),
        on_floor=options.bottom == 0,
        solid=_solid([*sides, lid, underside], bgr(options.color)),
    )


def _solid(
    rectangles: list[tuple[np.ndarray, np.ndarray, np.ndarray]], color: Float[np.ndarray, " 3"]
) -> Solids:
    """A solid of rectangles, each a corner and two edges: right and up when seen from outside."""
    vertices, faces, normals = [], [], []
    n_vertices = 0
    for corner, right, up in rectangles:
        n, m = (int(np.ceil(np.linalg.norm(edge) / _CELL_M)) for edge in (right, up))
        i, j = np.meshgrid(np.arange(n + 1), np.arange(m + 1), indexing="ij")
        vertices.append((corner + i[..., None] / n * right + j[..., None] / m * up).reshape(-1, 3))
        number = n_vertices + i * (m + 1) + j
        clockwise = [number[:-1, :-1], number[:-1, 1:], number[1:, 1:], number[1:, :-1]]
        faces.append(np.stack(clockwise, axis=-1).reshape(-1, 4))
        outward = np.cross(right, up)
        normals.append(np.tile(outward / np.linalg.norm(outward), (n * m, 1)))
        n_vertices += (n + 1) * (m + 1)
    joined, corners = np.concatenate(vertices), np.concatenate(faces)
    # less light reaches the lowest half metre
    shade = 0.85 + 0.15 * np.clip(joined[corners, 2].mean(axis=1) / 0.5, 0, 1)
    colors = color * shade[:, None]
    return Solids(joined[None], corners, np.concatenate(normals)[None], colors[None])
