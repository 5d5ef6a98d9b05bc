"""The command reference, from the command line itself."""

from typing import Any

import typer

from sim.commands.app import app


def commands() -> dict[str, Any]:
    """The commands by name, those of groups with the group's, as the parser of the command line has them."""
    root: Any = typer.main.get_command(app)
    found = {}
    for name, command in root.commands.items():
        members = getattr(command, "commands", {})
        found |= {f"{name} {each}": member for each, member in members.items()} or {name: command}
    return found


def command_reference() -> str:
    """Every command with its usage, arguments and options."""
    return "\n".join(line for name, command in commands().items() for line in _command(name, command))


def _command(name: str, command: Any) -> list[str]:
    context = typer.Context(command, info_name=f"dcpf {name}")
    parameters = [(each, *each.get_help_record(context)) for each in command.params]
    usage = [
        each.metavar if each.required else f"[{each.metavar}]"
        for each in command.params
        if each.param_type_name == "argument"
    ]
    lines = [
        f"(dcpf-{name.replace(' ', '-')})=",
        f"## dcpf {name}",
        "",
        command.help,
        "",
        "```text",
        " ".join([f"dcpf {name}", *usage, "[OPTION ...]"]),
        "```",
        "",
        f":::{{program}} dcpf {name}",
        ":::",
        "",
    ]
    for parameter, signature, text in parameters:
        lines += [f":::{{option}} {_plain(signature)}", _escaped(text.replace("[required]", ""))]
        if parameter.param_type_name == "option" and parameter.multiple:
            lines += ["May be repeated."]
        lines += [":::", ""]
    return lines


def _plain(signature: str) -> str:
    """`--seed <int range>` as `--seed INT`, in the manner of the others."""
    name, _, kind = signature.partition(" ")
    if not kind.startswith("<"):
        return signature
    kind = kind.strip("<>")
    return f"{name} {kind}" if "|" in kind else f"{name} {kind.partition(' ')[0].upper()}"


def _escaped(text: str) -> str:
    """Help as Markdown, which takes less-than signs and stars for its own."""
    return text.replace("<", "\\<").replace("*", "\\*")
