"""What the public checks of plug-ins share: every check is made, and one error lists all problems in sentences."""

from __future__ import annotations

import pickle
from collections.abc import Callable, Iterable, Mapping

import numpy as np

__all__ = ["ContractError", "find_problems", "global_random_state", "refuse"]


class ContractError(ValueError):
    """A plug-in breaks the contract of what it wants to be.

    Attributes:
        problems: One sentence for each problem.
    """

    def __init__(self, message: str, problems: Iterable[str] = ()) -> None:
        super().__init__(message)
        self.problems = tuple(problems)

    def __reduce__(self) -> tuple[object, ...]:
        return type(self), (str(self), self.problems)


def find_problems(checks: Mapping[str, Callable[[], Iterable[str]]]) -> list[str]:
    """Make every check, and say what each finds.

    Args:
        checks: By what it looks at; each yields a sentence for each problem. One that raises is a problem itself, and
            the others are made all the same: a plug-in may raise anything.

    Returns:
        The sentences, and one more if numpy's global random state was touched meanwhile.
    """
    problems: list[str] = []
    before = global_random_state()
    for what, check in checks.items():
        try:
            problems += check()
        except Exception as error:
            problems.append(f"{what}: raised {type(error).__name__}: {error}")
    if global_random_state() != before:
        problems.append("it draws from numpy's global random state; use only the generator it is given")
    return problems


def refuse(plugin: object, kind: str, problems: Iterable[str], error: type[ContractError]) -> None:
    """Raise ``error`` with a list of the problems, if there are any."""
    if problems := tuple(problems):
        listed = "\n".join(f"- {problem}" for problem in problems)
        raise error(f"{type(plugin).__name__} breaks the {kind} contract:\n{listed}", problems)


def global_random_state() -> bytes:
    """The state of numpy's global generator, which no plug-in may touch, as bytes to compare."""
    return pickle.dumps(np.random.get_state())  # noqa: NPY002 - watched, not used
