"""What the page and the server say to each other: JSON texts over one WebSocket, told apart by ``type``.

**The page says**

=============  ========================================================================================================
``hello``      First, once: ``token``, ``tab`` (random, of this tab), ``width, height`` (CSS pixels), ``touch``
``device``     On the device check: ``keyboard, pointer, width, height, round_trip`` (measured; ms)
``consent``    On the consent: ``agreed`` (the tick)
``next``       On a text or pause: go on. On a practice or round that has not begun: begin
``step``       Kitchens: ``n`` (steps taken so far), ``action`` 0..5, ``down`` and ``shown`` (``performance.now()``, ms)
``pointer``    Tables: ``n`` (as in the last state that the page had), ``samples`` ``[[t, x, y], ...]``: milliseconds
               since the round began, metres on the table
``answers``    On a questionnaire: ``values`` by name of item, ``seconds`` it took
``event``      ``kind`` (``focus, blur, visible, hidden, resize, fullscreen, active, error``), ``at``, ``detail`` (a
               text). ``focus``, ``visible`` and ``active`` say that somebody is there, for the idle clock; ``active``
               leaves no row: send it now and then while a questionnaire is filled in or a text is read
``ping``       ``at``; answered by ``pong`` with the same
``withdraw``   The participant does not want to go on
=============  ========================================================================================================

**The server says**

=============  ========================================================================================================
``screen``     What to show; see below. Sent after ``hello`` and whenever the participant gets on
``state``      A step (or batch of samples) is on disk: the game's ``state`` (``n`` in it), and at tables ``t``: up to
               which time of the pointer the table has been played
``refused``    ``reason``: the message did nothing. With ``state``, where a step did not follow on the present state;
               with ``fatal``, where the connection ends
``replaced``   Another tab of this participant is open: this one is closed
``warning``    Idle: ``seconds`` until the session ends, or None where it does not end by itself
``pong``       ``at``
=============  ========================================================================================================

A ``screen`` has ``name``, ``kind`` (of :mod:`benchmarks.study.timeline`, or ``end``), ``progress`` (0 to 1), ``html``
(the text, rendered from Markdown), and

- ``device``: ``needs`` (the settings of ``[device]``);
- ``practice`` and ``round``: ``begun``, ``scene``, ``state``, ``attempt``, ``attempts``, ``condition_number`` (from 1),
  ``conditions`` (how many), ``clock`` (tables: milliseconds that have been played), ``waiting``, ``keys``;
- ``questionnaire``: ``title``, ``items`` (of :class:`~benchmarks.study.design.questionnaires.Item`), ``errors``
  (by item, after answers that were refused);
- ``pause``: ``from`` and ``until`` (seconds since 1970, or None): when the next sitting can begin;
- ``end``: ``ending``, ``code``, ``url`` (or empty); after a device check that failed, ``failed`` (texts).

Whether a participant sees the predictor's belief is the study's decision: ``state`` has it only then.

**Closing codes**: 4401 unknown participant (do not come back), 4409 another tab has taken over (likewise), 4429 too
many messages, 4400 too many messages that were not understood, 1011 an error of the server, 1012 it stops or starts
again, 1013 it is full or cannot store anything now.
"""

from __future__ import annotations

from typing import Annotated, Any, Final, Literal

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError

__all__ = ["LONGEST_MESSAGE", "MOST_SAMPLES", "Message", "read_message"]

LONGEST_MESSAGE: Final = 65_536
"""Bytes of a message of the page."""
MOST_SAMPLES: Final = 600
"""Of the pointer in one message."""

Finite = Annotated[float, Field(allow_inf_nan=False, ge=-1e15, le=1e15)]
Short = Annotated[str, Field(max_length=200)]
Pixels = Annotated[float, Field(ge=0, le=100_000, allow_inf_nan=False)]


class _Message(BaseModel):
    model_config = ConfigDict(extra="forbid", frozen=True)


class Hello(_Message):
    """First, once."""

    type: Literal["hello"]
    token: Annotated[str, Field(min_length=1, max_length=200)]
    tab: Short
    width: Pixels = 0
    height: Pixels = 0
    touch: bool = False


class Device(_Message):
    """What the device check found."""

    type: Literal["device"]
    keyboard: bool
    pointer: Literal["none", "fine", "touch"]
    width: Pixels
    height: Pixels
    round_trip: Annotated[float, Field(ge=0, allow_inf_nan=False)]


class Consent(_Message):
    """The tick."""

    type: Literal["consent"]
    agreed: bool


class Next(_Message):
    """Go on."""

    type: Literal["next"]


class Step(_Message):
    """A key."""

    type: Literal["step"]
    n: Annotated[int, Field(ge=0, le=10_000_000, strict=True)]
    action: Any
    down: Finite | None = None
    shown: Finite | None = None


class Pointer(_Message):
    """Samples of the pointer."""

    type: Literal["pointer"]
    n: Annotated[int, Field(ge=0, le=10_000_000, strict=True)]
    samples: Annotated[list[tuple[Finite, Finite, Finite]], Field(min_length=1, max_length=MOST_SAMPLES)]
    shown: Finite | None = None


class Answers(_Message):
    """Of a questionnaire."""

    type: Literal["answers"]
    values: Annotated[dict[Short, Any], Field(max_length=1000)]
    seconds: Finite = 0


class Event(_Message):
    """What happened to the page."""

    type: Literal["event"]
    kind: Literal["focus", "blur", "visible", "hidden", "resize", "fullscreen", "active", "error"]
    at: Finite = 0
    detail: Annotated[str, Field(max_length=1000)] = ""


class Ping(_Message):
    """To measure the way to the server and back."""

    type: Literal["ping"]
    at: Finite


class Withdraw(_Message):
    """The participant does not want to go on."""

    type: Literal["withdraw"]


Message = Hello | Device | Consent | Next | Step | Pointer | Answers | Event | Ping | Withdraw
_ADAPTER: Final[TypeAdapter[Message]] = TypeAdapter(Annotated[Message, Field(discriminator="type")])


def read_message(text: str | bytes) -> Message:
    """A message of the page.

    Raises:
        ValueError: It is none. Says what is wrong with it, and nothing of what was in it: that may be a secret.
    """
    if len(text) > LONGEST_MESSAGE:
        raise ValueError(f"a message has at most {LONGEST_MESSAGE:,} bytes")
    try:
        return _ADAPTER.validate_json(text)
    except ValidationError as error:
        first = error.errors(include_url=False, include_input=False, include_context=False)[0]
        place = ".".join(str(part)[:40] for part in first["loc"][:4])
        raise ValueError(f"{place}: {first['msg'][:200]}" if place else first["msg"][:200]) from None
