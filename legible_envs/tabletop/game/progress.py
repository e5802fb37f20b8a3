"""Progress of a task on the table: which goals are valid next, and where a taken object belongs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

from legible_envs.errors import TaskError
from legible_envs.subtasks import HUMAN, ROBOT
from legible_envs.tabletop.objects import Point
from legible_envs.tabletop.task import TabletopTask

__all__ = ["Delivery", "TaskProgress"]

ASSEMBLY: Final = "assembly"


@dataclass(frozen=True, slots=True)
class Delivery:
    """Where an object belongs after it was reached.

    Attributes:
        number: The kind of subtask this belongs to, an index into the task's ``states.classes``.
        goal: The object.
        kind: ``"touch"``: it is only reached; ``"slot"``: it is carried to a point; ``"zone"``: it is carried anywhere
            into the assembly zone; ``"goal"``: it is carried to the next goal that is reached, such as a bin.
        at: The point it is carried to, for ``"slot"``.
    """

    number: int
    goal: str
    kind: str
    at: Point | None = None


class TaskProgress:
    """Counts the subtasks done and begun, by one or several agents.

    A subtask is *begun* when its goal is taken, *done* when the goal is where it belongs. A subtask that
    waits for others may be begun when they are done, and only once. A subtask is begun only if the task can still be
    finished afterwards, and only by an agent who can perform it.

    Where an object that is taken belongs: to its place in the task's ``configuration``; else, if the subtask names
    places to go to afterwards, to the last of these (anywhere in the assembly zone if that is ``assembly``); else, if
    another subtask of its group waits for this one, to the goal that is reached next; else nowhere: the object is
    only touched.

    Args:
        task: The task.

    Raises:
        TaskError: An object is to be carried to a goal that is itself to be carried; or only a robot can perform a
            subtask that does not carry an object to a point, which is all that a robot does on a table.

    Attributes:
        task: The task.
        place: Name of where the person's reach begins.
        done: How many copies of each kind of subtask are done.
        begun: How many are done or begun.
    """

    def __init__(self, task: TabletopTask) -> None:
        self.task = task
        self._space = task.graph.states
        self._can_finish = {done: orders > 0 for done, orders in self._space.completions.items()}
        self._goals: dict[tuple[str, tuple[int, ...], tuple[int, ...]], dict[str, Delivery]] = {}
        self._deliveries = {
            (number, goal): self._delivery(number, goal)
            for number, cls in enumerate(self._space.classes)
            for goal in cls.goals
        }
        self._check_deliveries()
        self._stages = {(stage.start, stage.goals): number for number, stage in enumerate(task.graph.stages())}
        self.restart()

    def restart(self) -> None:
        """Begin again: no subtask is done."""
        self.done, self.place = self._space.initial
        self.begun = self.done

    @property
    def is_over(self) -> bool:
        """Whether all subtasks are done."""
        return sum(self.done) == self._space.length

    @property
    def num_done(self) -> int:
        """Number of subtasks done."""
        return sum(self.done)

    @property
    def goals(self) -> dict[str, Delivery]:
        """The person's valid goals now, sorted by name, each with where it belongs; not to be changed."""
        return self._goals_at(HUMAN, self.done, self.begun)

    @property
    def robot_goals(self) -> dict[str, Delivery]:
        """The same for the robot."""
        return self._goals_at(ROBOT, self.done, self.begun)

    @property
    def first_goals(self) -> tuple[str, ...]:
        """Goals that the person may reach for at the beginning."""
        nothing = self._space.initial[0]
        return tuple(self._goals_at(HUMAN, nothing, nothing))

    def _goals_at(self, agent: str, done: tuple[int, ...], begun: tuple[int, ...]) -> dict[str, Delivery]:
        key = agent, done, begun
        if key not in self._goals:
            found: dict[str, Delivery] = {}
            for number in sorted({*self._space.ready(done)} & {*self._space.ready(begun)}):
                cls = self._space.classes[number]
                if agent in cls.agents and self._can_finish.get(_one_more(begun, number), False):
                    for goal in cls.goals:
                        found.setdefault(goal, self._deliveries[number, goal])
            self._goals[key] = dict(sorted(found.items()))
        return self._goals[key]

    def stage(self, goals: tuple[str, ...]) -> int:
        """Index in the task graph's ``stages()`` of the present place with these valid goals; -1 if it is no stage."""
        return self._stages.get((self.place, goals), -1)

    def carries(self, goal: str) -> bool:
        """Whether any subtask has this object carried somewhere."""
        return any(name == goal and d.kind != "touch" for (_, name), d in self._deliveries.items())

    def begin(self, delivery: Delivery) -> None:
        """The goal was taken."""
        self.begun = _one_more(self.begun, delivery.number)

    def finish(self, delivery: Delivery) -> None:
        """A subtask that was begun is done."""
        self.done = _one_more(self.done, delivery.number)

    def give_up(self, delivery: Delivery) -> None:
        """A subtask that was begun is not done after all."""
        self.begun = _one_more(self.begun, delivery.number, -1)

    def go_on(self, delivery: Delivery) -> None:
        """The person's next reach begins where this subtask ends."""
        then = self._space.classes[delivery.number].then
        self.place = then[-1] if then else delivery.goal

    def _check_deliveries(self) -> None:
        for (number, goal), delivery in self._deliveries.items():
            for other, name in self._deliveries if delivery.kind == "goal" else ():
                kind = self._deliveries[other, name].kind
                if number in self._space.classes[other].predecessors and kind != "touch":
                    raise TaskError(
                        f"task {self.task.name!r}: {goal!r} is to be carried to {name!r}, which is carried itself; "
                        "a hand holds one object"
                    )
            if HUMAN not in self._space.classes[number].agents and delivery.kind != "slot":
                raise TaskError(
                    f"task {self.task.name!r}: only a robot can perform the subtask with the goal {goal!r}, and a "
                    f"robot carries objects to a point; give {goal!r} a place in the configuration, or let the "
                    "person perform it"
                )

    def _delivery(self, number: int, goal: str) -> Delivery:
        cls, table = self._space.classes[number], self.task.layout.table
        if goal in self.task.configuration:
            return Delivery(number, goal, "slot", self.task.configuration[goal])
        if cls.then:
            last = cls.then[-1]
            if last == ASSEMBLY:
                return Delivery(number, goal, "zone")
            return Delivery(number, goal, "slot", table.starts.get(last) or self.task.layout.place(last))
        followers = [other for other in self._space.classes if number in other.predecessors]
        if cls.group is not None and any(other.group == cls.group for other in followers):
            return Delivery(number, goal, "goal")
        return Delivery(number, goal, "touch")


def _one_more(counts: tuple[int, ...], number: int, change: int = 1) -> tuple[int, ...]:
    return (*counts[:number], counts[number] + change, *counts[number + 1 :])
