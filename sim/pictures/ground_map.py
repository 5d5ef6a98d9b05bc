"""The ground seen from above: cameras, what they see, who talks to whom, and where the target is."""

from collections.abc import Iterable

import cv2
import numpy as np
from jaxtyping import Float

from sim.assembly import Assembly
from sim.pictures.canvas import (
    Image,
    blank,
    dashes,
    draw_dots,
    draw_lines,
    draw_text,
    fill,
    text_width,
)
from sim.pictures.chart import Chart, Line, mean_known, round_numbers
from sim.pictures.ground import area_of, coverage, ellipse, heading, height_of_target
from sim.pictures.overlay import text_size
from sim.pictures.theme import COLORS, INK, LABELS, MUTED, PAPER, SEEN
from sim.results.results import Results, Track
from sim.world.colors import bgr

_HEIGHT_SHARE = 0.24  # of the picture, for the strip that shows the height in a volume
_ABOVE = ("single", "cpf", "dcpf")  # estimators from below to above, where they agree one around the other


class GroundMap:
    """Draws the ground of one run, frame by frame."""

    def __init__(self, results: Results, assembly: Assembly, width_px: int, height_px: int) -> None:
        """Draws what stays the same in all frames.

        Args:
            results: The run.
            assembly: Its scenario, put together.
            width_px: Width of the pictures.
            height_px: Height of the pictures.
        """
        self._results = results
        self._text_px = text_size(width_px)
        self._strip = (
            self._height_strip(width_px, round(_HEIGHT_SHARE * height_px)) if _is_volume(results) else None
        )
        self._legend_px = 2 * self._text_px
        map_height = height_px - self._legend_px - (self._strip.height_px if self._strip else 0)
        self._area = area_of(results, assembly).widened(width_px / map_height)
        self._pixels_per_metre = width_px / self._area.size[0]
        self._means = {track: results.means(track)[:, :2] for track in results.tracks}
        self._covariances = {track: results.covariances(track)[:, :2, :2] for track in results.tracks}
        self._truth = results.true_states()
        self._ground = self._draw_ground(assembly, width_px, map_height)

    def draw(self, frame: int) -> Image:
        """The ground at a frame: the truth's path so far, the estimates with their 2σ ellipses.

        Args:
            frame: Frame of the run.

        Returns:
            A picture of the size that the map was made for.
        """
        image = self._ground.copy()
        if self._truth is not None:
            path = self.to_pixels(self._truth[: frame + 1, :2])
            draw_lines(image, path, COLORS["truth"], 1)
        for estimator in _ABOVE:
            for track in self._results.of(estimator).values():
                self._draw_estimate(image, track, frame)
        if self._truth is not None:
            here = self.to_pixels(self._truth[frame : frame + 1, :2])
            draw_dots(image, here, COLORS["truth"], 1.5)
        below = [self._draw_legend(image.shape[1])]
        if self._strip is not None:
            below.append(self._strip.draw(frame))
        return np.concatenate([image, *below])

    def to_pixels(self, points: Float[np.ndarray, "N 2"]) -> Float[np.ndarray, "N 2"]:
        """Where points of the ground, in metres, are drawn."""
        x = points[:, 0] - self._area.low[0]
        y = self._area.high[1] - points[:, 1]
        return np.stack([x, y], axis=1) * self._pixels_per_metre - 0.5

    def _draw_ground(self, assembly: Assembly, width_px: int, height_px: int) -> Image:
        """What stays: who sees what, occluders, the network and the scale."""
        image = self._shade(assembly, width_px, height_px)
        for occluder in assembly.world.occluders if assembly.world else ():
            fill(image, self.to_pixels(occluder.footprint), MUTED)
        centers = {
            name: self.to_pixels(camera.center[None, :2])[0] for name, camera in assembly.cameras.items()
        }
        for a, b in sorted(assembly.graph.edges):
            draw_lines(image, dashes(np.stack([centers[a], centers[b]]), 3.0), MUTED, 1)
        for name, camera in assembly.cameras.items():
            ahead = heading(camera) * [1, -1]
            self._draw_camera(image, centers[name], ahead)
            behind = np.array([0.0, -np.copysign(1.1 * self._text_px, ahead[1])])
            self._draw_name(image, name, centers[name] + behind)
        self._draw_scale(image)
        return image

    def _shade(self, assembly: Assembly, width_px: int, height_px: int) -> Image:
        """The darker, the more cameras see the target there; each step has a rim."""
        x = self._area.low[0] + (np.arange(width_px) + 0.5) / self._pixels_per_metre
        y = self._area.high[1] - (np.arange(height_px) + 0.5) / self._pixels_per_metre
        seen = coverage(assembly.cameras.values(), x, y, height_of_target(self._results, assembly))
        shades = np.array([bgr(shade) for shade in SEEN], dtype=np.uint8)
        image = shades[np.minimum(seen, len(SEEN) - 1)]
        return np.asarray(cv2.GaussianBlur(image, (3, 3), 0), dtype=np.uint8)

    def _draw_camera(
        self, image: Image, center: Float[np.ndarray, " 2"], ahead: Float[np.ndarray, " 2"]
    ) -> None:
        """A triangle that opens in the direction of sight."""
        aside, size = np.array([-ahead[1], ahead[0]]), 0.7 * self._text_px
        corners = [center, center + size * (ahead + 0.6 * aside), center + size * (ahead - 0.6 * aside)]
        fill(image, np.array(corners), INK)

    def _draw_name(self, image: Image, name: str, middle: Float[np.ndarray, " 2"]) -> None:
        """A camera's name, moved into the picture where it would stick out."""
        half = np.array([text_width(name, self._text_px, bold=True) / 2 + 2, 0.6 * self._text_px])
        x, y = np.clip(middle, half, np.array(image.shape[1::-1]) - half)
        draw_text(image, name, (x, y + 0.35 * self._text_px), INK, self._text_px, align="middle", bold=True)

    def _draw_scale(self, image: Image) -> None:
        """A bar of a round length in the lower left corner."""
        length = float(round_numbers(0.0, 0.3 * self._area.size[0])[-1])
        left, bottom = 0.8 * self._text_px, image.shape[0] - 0.8 * self._text_px
        right = left + length * self._pixels_per_metre
        draw_lines(image, np.array([[left, bottom], [right, bottom]]), INK, 2)
        draw_text(image, f"{length:g} m", (left, bottom - 0.5 * self._text_px), INK, self._text_px)

    def _draw_estimate(self, image: Image, track: Track, frame: int) -> None:
        mean, covariance = self._means[track][frame], self._covariances[track][frame]
        if np.isnan(mean[0]):
            return
        color, place = COLORS[track[0]], self.to_pixels(mean[None])
        if track[0] == "single":
            draw_dots(image, place, color, 2.5)
            return
        draw_lines(image, self.to_pixels(ellipse(mean, covariance)), color, 1, closed=True)
        draw_dots(image, place, color, 4.0 if track[0] == "dcpf" else 5.5)

    def _draw_legend(self, width_px: int) -> Image:
        """One row: a dot of each colour and what it means."""
        image = blank(width_px, self._legend_px, PAPER)
        shown = [kind for kind in ("dcpf", "cpf", "single") if self._results.of(kind)]
        x, y = 0.8 * self._text_px, self._legend_px / 2
        for kind in [*shown, *(["truth"] if self._truth is not None else [])]:
            draw_dots(image, np.array([[x, y]]), COLORS[kind], 0.3 * self._text_px)
            words = LABELS[kind] + (", 2σ" if kind == "dcpf" else "")
            draw_text(image, words, (x + 0.6 * self._text_px, y + 0.35 * self._text_px), INK, self._text_px)
            x += text_width(words, self._text_px) + 1.6 * self._text_px
        return image

    def _height_strip(self, width_px: int, height_px: int) -> Chart:
        """The height over the frames."""
        lines = [Line(LABELS[kind], values, COLORS[kind], width) for kind, values, width in self._heights()]
        known = np.concatenate([line.values for line in lines])
        low, high = float(np.nanmin(known)), float(np.nanmax(known))
        margin = max(0.1 * (high - low), 0.05)
        return Chart("height / m", lines, low - margin, high + margin, width_px, height_px, self._text_px)

    def _heights(self) -> Iterable[tuple[str, Float[np.ndarray, " T"], int]]:
        truth = self._results.true_states()
        if truth is not None:
            yield "truth", truth[:, 2], 1
        for kind in ("cpf", "dcpf"):
            heights = [self._results.means(track)[:, 2] for track in self._results.of(kind).values()]
            if heights:
                yield kind, mean_known(np.array(heights)), 2


def _is_volume(results: Results) -> bool:
    return results.scenario.target.space == "volume"
