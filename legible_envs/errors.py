"""Errors that say what was expected, what came, and where."""

from __future__ import annotations

from legible_envs.support.contracts import ContractError

__all__ = ["LayoutError", "TaskError", "WorkspaceError"]


class LayoutError(ValueError):
    """A layout breaks a rule.

    Attributes:
        rule: Short machine-readable name of the broken rule, such as ``"reachable"``; empty where it got lost, as in an
            ``AsyncVectorEnv``, which makes errors of its workers anew from their messages.
        cell: The ``(row, col)`` it is broken at, or None where the rule has no single cell.
    """

    def __init__(self, message: str, *, rule: str = "", cell: tuple[int, int] | None = None) -> None:
        super().__init__(message)
        self.rule = rule
        self.cell = cell

    def __reduce__(self) -> tuple[object, ...]:
        return _rebuild_layout_error, (str(self), self.rule, self.cell)


def _rebuild_layout_error(message: str, rule: str, cell: tuple[int, int] | None) -> LayoutError:
    return LayoutError(message, rule=rule, cell=cell)


class TaskError(ValueError):
    """A task graph is malformed: a cycle, an unknown name, or no valid sequence."""


class WorkspaceError(ContractError):
    """A workspace breaks the contract of :class:`~legible_envs.workspace.Workspace`.

    Attributes:
        problems: One sentence for each problem.
    """
