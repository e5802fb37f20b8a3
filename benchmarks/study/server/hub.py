"""All participants of a server: joining, finding a session by its token, and which browser tab is the newest."""

from __future__ import annotations

import asyncio
import contextlib
import json
from collections import Counter
from collections.abc import Awaitable, Callable, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Final

import numpy as np

from benchmarks.study.orders import next_order
from benchmarks.study.server.rates import Bucket
from benchmarks.study.server.recruitment import is_open, worker_of
from benchmarks.study.server.refusal import Gone
from benchmarks.study.server.secrets import fingerprint
from benchmarks.study.server.session import Session
from benchmarks.study.store import rows

if TYPE_CHECKING:
    from benchmarks.study.server.context import Context
    from benchmarks.study.server.recruitment import Worker

__all__ = ["Connection", "Hub", "NotAdmitted"]

_LETTER: Final = {"live": "P", "debug": "D"}
_MINUTE: Final = 60.0
_PATIENCE: Final = 2.0
"""Seconds that a new page waits for the older one to be told."""


class NotAdmitted(Exception):
    """Nobody joins; ``text`` names the study's text that says why."""

    def __init__(self, text: str) -> None:
        super().__init__(text)
        self.text = text


@dataclass(eq=False)
class Connection:
    """A page that is connected.

    Attributes:
        send: Sends it a message.
        close: Ends the connection, with a code.
        since: Seconds since 1970.
        heard: When it last said something that is a sign of life.
    """

    send: Callable[[Mapping[str, Any]], Awaitable[None]]
    close: Callable[[int], Awaitable[None]]
    since: float
    heard: float


class Hub:
    """The participants of one database.

    Args:
        context: What sessions share.

    Attributes:
        sessions: Of participants who were here since the server started.
        connections: The newest page of each participant who is connected.
        watchers: Called with ``(participant, message)`` for whatever a participant's page is told.
    """

    def __init__(self, context: Context) -> None:
        self.context = context
        self.sessions: dict[str, Session] = {}
        self.connections: dict[str, Connection] = {}
        self.watchers: set[Callable[[str, Mapping[str, Any]], None]] = set()
        self._pages: Counter[str] = Counter()
        self._connects: dict[str, Bucket] = {}
        self._joining = asyncio.Lock()

    # -- joining ------------------------------------------------------------------------------------------------------

    async def join(self, query: Mapping[str, Any]) -> str:
        """Take part, or take up an earlier participation of the same worker.

        Args:
            query: Parameters of the participant's link.

        Returns:
            The participant's token.

        Raises:
            NotAdmitted: They may not.
        """
        context = self.context
        worker = worker_of(context.study, query)
        if worker.is_preview and context.store.mode == "live":
            raise NotAdmitted("preview")
        async with self._joining:
            known = self._known(worker)
            if known is not None:
                return context.secrets.token(known)
            if not is_open(context.study, context.store):
                raise NotAdmitted("closed")
            participant = await self._add(worker)
        return context.secrets.token(participant)

    def _known(self, worker: Worker) -> str | None:
        """The participant that a worker is already; one who has ended only where nobody may take part twice."""
        if not worker.worker:
            return None
        found = self.context.store.read(
            "SELECT participant, state, design FROM workers JOIN participants USING (participant) "
            "WHERE source = ? AND worker = ? ORDER BY workers.joined DESC LIMIT 1",
            (worker.source, worker.worker),
        )
        if not found:
            return None
        once = self.context.study.content.recruitment.one_per_worker
        goes_on = found[0]["state"] == "active" and found[0]["design"] == self.context.study.design_hash
        return str(found[0]["participant"]) if once or goes_on else None

    async def _add(self, worker: Worker) -> str:
        context, now = self.context, self.context.now()
        store, content = context.store, context.study.content
        last = store.read("SELECT value FROM study WHERE key = 'participants'")
        number = int(last[0][0]) + 1 if last else 1
        participant = f"{_LETTER[store.mode]}{number:03d}"
        seed = int(np.random.SeedSequence().generate_state(1, np.uint64)[0] >> 16)
        rng = np.random.default_rng(seed)
        order_number, order = next_order(content.orders.policy, context.study.conditions, self._filled(), rng)
        row = {
            "participant": participant,
            "design": context.study.design_hash,
            "token_sha256": fingerprint(context.secrets.token(participant)),
            "order_number": order_number,
            "conditions": json.dumps(list(order)),
            "seed": seed,
            "joined": now,
            "seen": now,
            "screen": 0,
            "state": "active",
            "ended": None,
            "language": content.language,
        }
        statements = [rows.participant_row(row), rows.study_value("participants", str(number))]
        if worker.worker:
            statements.append(
                rows.worker_row(participant, worker.source, worker.worker, worker.study, worker.session, now)
            )
        await store.write(*statements, rows.event_row(participant, context.study.design_hash, now, "joined"))
        return participant

    def _filled(self) -> dict[int, int]:
        """Participants by row of the order policy: those who are complete, and those who were active recently."""
        recent = self.context.now() - self.context.study.content.orders.recent_minutes * _MINUTE
        found = self.context.store.read(
            "SELECT order_number, COUNT(*) AS n FROM participants "
            "WHERE design = ? AND (state = 'complete' OR (state = 'active' AND seen >= ?)) GROUP BY order_number",
            (self.context.study.design_hash, recent),
        )
        return {int(row["order_number"]): int(row["n"]) for row in found}

    # -- sessions and pages -------------------------------------------------------------------------------------------

    def enter(self, token: str) -> Session | None:
        """The session that a token opens, kept until :meth:`leave`; None where it opens none."""
        found = self.context.store.read(
            "SELECT participant FROM participants WHERE token_sha256 = ?", (fingerprint(token),)
        )
        if not found:
            return None
        participant = str(found[0]["participant"])
        if participant not in self.sessions:
            self.sessions[participant] = Session(self.context, participant)
        self._pages[participant] += 1
        return self.sessions[participant]

    def leave(self, session: Session) -> None:
        """A connection is done with a session; after its last one it is forgotten until somebody comes back."""
        self._pages[session.participant] -= 1
        if not self._pages[session.participant]:
            del self._pages[session.participant]
            del self.sessions[session.participant]

    def may_connect(self, participant: str) -> bool:
        """Whether a participant does not connect all the time."""
        if participant not in self._connects:
            self._connects[participant] = Bucket(self.context.pace.connects, 20)
        return self._connects[participant].take()

    async def attach(self, session: Session, connection: Connection) -> None:
        """Make a page the one of its participant; an older one is told and closed."""
        older = self.connections.get(session.participant)
        self.connections[session.participant] = connection
        if older is not None:
            # Its socket may be one that nobody reads.
            with contextlib.suppress(TimeoutError, Gone):
                async with asyncio.timeout(_PATIENCE):
                    await older.send({"type": "replaced"})
                    await older.close(4409)

    def is_newest(self, session: Session, connection: Connection) -> bool:
        """Whether a page is the one that its participant has now."""
        return self.connections.get(session.participant) is connection

    def detach(self, session: Session, connection: Connection) -> None:
        """The page is gone."""
        if self.is_newest(session, connection):
            del self.connections[session.participant]

    def told(self, participant: str, message: Mapping[str, Any]) -> None:
        """Let those who watch know what a page was told."""
        for watcher in tuple(self.watchers):
            watcher(participant, message)
