"""One page per environment, made from its docstring: the docstring is the documentation."""

from __future__ import annotations

import importlib
import inspect
import re
from pathlib import Path

import gymnasium as gym
from animations import write_episode
from sphinx.application import Sphinx

import legible_envs  # noqa: F401 - registers the environments

SHOWN = {
    "LegibleOvercooked-v0": "with a simulated person at work",
    "LegibleTabletop-v0": "with a simulated person at work",
    "LegibleDesign-v0": "with a designer who always makes the best edit",
}
SECTION = re.compile(r"^(Args|Raises|Returns|Attributes|Example):$", re.MULTILINE)
ENTRY = re.compile(r"^ {4}(\w+): ", re.MULTILINE)


def page(env_id: str, picture: str) -> str:
    """The page of one environment as Markdown."""
    spec = gym.spec(env_id)
    module, _, name = str(spec.entry_point).partition(":")
    text = inspect.cleandoc(getattr(importlib.import_module(module), name).__doc__)
    summary, _, body = text.partition("\n\n")
    env = gym.make(env_id)
    facts = [
        ("Create", f'`gymnasium.make("{env_id}")`'),
        ("Action space", describe(env.action_space)),
        ("Observation space", describe(env.observation_space)),
        ("Steps at most", str(spec.max_episode_steps)),
        (
            "Batched",
            "a vector environment of its own" if spec.vector_entry_point else "`gymnasium.make_vec` (sync, async)",
        ),
    ]
    env.close()
    table = "| | |\n| --- | --- |\n" + "\n".join(f"| {key} | {value} |" for key, value in facts)
    image = f"![{env_id} {SHOWN[env_id]}]({picture})"
    return f"# {env_id}\n\n{summary}\n\n{image}\n\n{table}\n\n{as_markdown(body)}\n"


def describe(space: gym.Space) -> str:
    """A space in a line; bounds that differ between entries are left to the page."""
    text = str(space)
    if isinstance(space, gym.spaces.Box) and "\n" in text:
        text = f"Box({space.shape}, {space.dtype})"
    return f"`{text}`"


def as_markdown(body: str) -> str:
    """Google-style sections inside a Markdown docstring as lists."""

    def entries(match: re.Match[str]) -> str:
        return f"- **{match[1]}**: "

    parts = SECTION.split(body)
    text = parts[0]
    for title, section in zip(parts[1::2], parts[2::2], strict=True):
        indented, rest = _split_indented(section)
        heading = "" if title == "Args" else f"**{title}**\n\n"
        text += heading + re.sub(r"\n {8}", "\n  ", ENTRY.sub(entries, indented)).strip() + "\n\n" + rest.lstrip()
    return text


def _split_indented(section: str) -> tuple[str, str]:
    lines = section.strip("\n").split("\n")
    end = next((i for i, line in enumerate(lines) if line and not line.startswith(" ")), len(lines))
    return "\n".join(lines[:end]), "\n".join(lines[end:])


def write_pages(app: Sphinx) -> None:
    """Write every page that has changed, and its picture."""
    folder = Path(app.srcdir) / "environments"
    folder.mkdir(exist_ok=True)
    for env_id in SHOWN:
        picture = f"{env_id}.gif"
        if not (folder / picture).exists():
            write_episode(env_id, folder / picture)
        target, text = folder / f"{env_id}.md", page(env_id, picture)
        if not target.exists() or target.read_text(encoding="utf-8") != text:
            target.write_text(text, encoding="utf-8")


def setup(app: Sphinx) -> dict[str, bool]:
    """Register with Sphinx."""
    app.connect("builder-inited", write_pages)
    return {"parallel_read_safe": True}
