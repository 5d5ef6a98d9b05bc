"""Who may import whom: sim -> nodes -> network, never back; no clock, network or luck in the mathematics."""

import ast
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[1]
LAYERS = {"network": {"nodes", "sim"}, "nodes": {"sim"}, "sim": set()}
"""Each package with those that it must not know."""

OUTSIDE_WORLD = {
    *("zenoh", "time", "datetime", "logging", "random", "secrets", "os", "sys", "signal"),
    *("subprocess", "multiprocessing", "threading", "asyncio", "concurrent", "queue", "socket", "selectors"),
}
"""What would make the same arguments give another result, or has a life of its own."""

PURE = (
    *sorted((ROOT / "nodes/filtering").rglob("*.py")),
    *sorted((ROOT / "nodes/vision").glob("*.py")),
    *sorted(path for path in (ROOT / "nodes/counting").glob("*.py") if path.name != "build.py"),
    *sorted((ROOT / "sim/metrics").glob("*.py")),
    *(ROOT / "sim/simulation" / name for name in ("gaussians.py", "sensor.py", "simulation.py")),
    ROOT / "sim/scenario/cameras.py",
    *sorted((ROOT / "nodes/simd").rglob("*.py")),
    *sorted((ROOT / "nodes/estimators").glob("*.py")),
    *(ROOT / "nodes" / name for name in ("central.py", "frame.py", "rounds.py", "setup.py")),
    *(ROOT / "nodes" / name for name in ("smart_camera.py", "imaging/camera.py")),
    *(ROOT / "nodes/shell" / name for name in ("pace.py", "preview.py")),
    *(
        ROOT / "sim" / name
        for name in (
            *("live/nodes.py", "live/setting.py", "live/story.py", "replay/playback.py"),
            *("report/elements.py", "report/figures.py", "report/run_tables.py", "report/stills.py"),
            "report/svg.py",
            *("recording/foxglove.py", "recording/scene.py", "recording/schemas.py"),
            *("faults/options.py", "faults/pictures.py", "faults/schedule.py"),
        )
    ),
    *(
        path
        for folder in ("averaging", "graphs", "rounds", "wire")
        for path in sorted((ROOT / "network" / folder).glob("*.py"))
    ),
    *(ROOT / "network" / name for name in ("errors.py", "options.py", "streams.py")),
    *(ROOT / "network/links" / name for name in ("conditions.py", "memory.py")),
)
"""Mathematics and state machines: the same arguments give the same results, always."""

SOURCES = sorted(path for layer in LAYERS for path in (ROOT / layer).rglob("*.py"))


def tree(path):
    return ast.parse(path.read_text(encoding="utf-8"))


def imported(path):
    """The top-level packages that a file imports, wherever in it."""
    for node in ast.walk(tree(path)):
        if isinstance(node, ast.Import):
            yield from (alias.name.split(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            assert node.level == 0, f"{path}: imports are absolute"
            yield (node.module or "").split(".")[0]


def relative(path):
    return path.relative_to(ROOT).as_posix()


@pytest.mark.parametrize("path", SOURCES, ids=relative)
def test_imports_go_down_only(path):
    layer = path.relative_to(ROOT).parts[0]
    assert not LAYERS[layer] & set(imported(path))


@pytest.mark.parametrize("path", PURE, ids=relative)
def test_the_mathematics_knows_no_outside_world(path):
    assert not OUTSIDE_WORLD & set(imported(path))


@pytest.mark.parametrize("path", SOURCES, ids=relative)
def test_random_numbers_come_from_the_scenarios_streams_only(path):
    used = {
        node.attr
        for node in ast.walk(tree(path))
        if isinstance(node, ast.Attribute) and ast.unparse(node.value) in ("np.random", "numpy.random")
    }
    assert used <= ({"Generator", "default_rng"} if relative(path) == "network/streams.py" else {"Generator"})
