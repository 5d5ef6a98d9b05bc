"""What the cameras saw and believed at some frames of a run: as recorded, or told again.

A run in lockstep is the same every time, so its particles need not be kept: it is run again in this process.
Where that gives other estimates than were recorded (in real time rounds are cut, nodes die), its particles
are not the run's and are left out; the pictures are the same.
"""

from collections.abc import Callable, Collection, Iterator, Mapping
from contextlib import closing
from dataclasses import replace
from pathlib import Path

import numpy as np

from network.errors import RefusedMessage
from network.wire import codec
from network.wire.messages import EstimateMessage, PreviewMessage
from sim.assembly import Assembly
from sim.recording.reader import McapRecording
from sim.results.results import Results
from sim.running.in_process import run_in_process

Previews = Mapping[int, Mapping[str, PreviewMessage]]
"""By frame and camera."""


def filmed(film: Path, frames: Collection[int]) -> Previews:
    """The previews of a recording.

    Raises:
        RecordingError: It cannot be read.
    """
    with closing(McapRecording(film)) as recording:
        return {frame: dict(_previews(recording, frame)) for frame in frames}


def told_again(
    results: Results, assembly: Assembly, frames: Collection[int], progress: Callable[[int], None]
) -> Previews:
    """The previews of a run that was recorded without pictures.

    Args:
        results: The run, as recorded.
        assembly: Its scenario, put together.
        frames: Which frames.
        progress: Told how many frames are done.

    Raises:
        SourceError: A video cannot be read.
    """
    scenario = assembly.scenario
    # The cameras know nothing of those whom they are compared with.
    alone = scenario.model_copy(
        update={"baselines": scenario.baselines.model_copy(update={"cpf": False, "single": False})}
    )
    found: dict[int, dict[str, PreviewMessage]] = {frame: {} for frame in frames}
    estimates: dict[tuple[str, int], EstimateMessage] = {}
    for message in run_in_process(Assembly(alone), watched=True, with_visibility=False):
        if isinstance(message, EstimateMessage):
            estimates[message.node, message.frame] = message
        if isinstance(message, PreviewMessage) and message.frame in found:
            recorded = results.tracks.get(("dcpf", message.node), {}).get(message.frame)
            same = recorded is not None and _equal(recorded, estimates[message.node, message.frame])
            found[message.frame][message.node] = message if same else _without_particles(message)
            progress(message.frame)
            if message.frame == max(found) and len(found[message.frame]) == len(assembly.cameras):
                break
    return found


def _equal(recorded: EstimateMessage, again: EstimateMessage) -> bool:
    # Not to the last bit: the page may be made on another machine than the run.
    return np.allclose(recorded.mean, again.mean, rtol=1e-6, atol=1e-9)


def _without_particles(message: PreviewMessage) -> PreviewMessage:
    return replace(message, particles=message.particles[:0])


def _previews(recording: McapRecording, frame: int) -> Iterator[tuple[str, PreviewMessage]]:
    for key, data in recording.at(frame, pictures=True):
        if key.endswith("/preview"):
            try:
                message = codec.decode_preview(data)
            except RefusedMessage:
                continue
            yield message.node, message
