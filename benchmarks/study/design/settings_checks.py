"""Whether the settings of a study fit together: names, sittings, orders, keys, colours, recruitment."""

from __future__ import annotations

import re
from collections.abc import Iterable
from typing import Final
from urllib.parse import urlsplit

from benchmarks.study.design.draft import Draft
from benchmarks.study.design.endings import ENDINGS
from benchmarks.study.errors import StudyError
from benchmarks.study.orders import make_policy

__all__ = ["check_settings", "contrast"]

_CODE: Final = re.compile(
    r"Key[A-Z]|Digit[0-9]|F([1-9]|1[0-9]|2[0-4])|Numpad([0-9]|Add|Subtract|Multiply|Divide|Decimal|Enter|Equal|Comma)"
    r"|Arrow(Up|Down|Left|Right)|Space|Enter|Backspace|Tab|Period|Comma|Slash|Backslash|Semicolon|Quote|Backquote|Minus"
    r"|Equal|BracketLeft|BracketRight|Intl(Backslash|Ro|Yen)|(Shift|Control|Alt|Meta)(Left|Right)|CapsLock|Home|End"
    r"|PageUp|PageDown|Insert|Delete|Escape|ContextMenu|Convert|NonConvert|KanaMode|Lang[12]"
)
"""Values of ``KeyboardEvent.code`` (UI Events KeyboardEvent code Values, W3C)."""
_TAKEN: Final = ("Tab", "Escape", "Enter", "F5", "MetaLeft", "MetaRight", "AltLeft", "AltRight")
"""Keys with which people reach buttons, leave full screen, or use their browser."""
_LANGUAGE: Final = re.compile(r"[a-z]{2,3}(-[A-Za-z0-9]{1,8})*")
_COLOUR: Final = re.compile(r"#[0-9A-Fa-f]{6}")
_PLACEHOLDERS: Final = ("code", "ending", "participant")
_READABLE: Final = 4.5
"""Contrast of text that people can read (WCAG 2.2, AA)."""
_ONE_SQUARE: Final = 12
"""Conditions from which on a balanced square has more rows than most studies have participants."""


def check_settings(draft: Draft) -> None:
    """Note everything in the settings that does not fit together."""
    for check in (
        _check_names,
        _check_domain,
        _check_sittings,
        _check_orders,
        _check_questionnaires,
        _check_recruitment,
        _check_limits,
        _check_look,
    ):
        check(draft)


def _repeated(draft: Draft, names: Iterable[str], table: str, what: str) -> None:
    seen: dict[str, str] = {}
    for number, name in enumerate(names):
        # Names become files: on some systems A and a are the same one.
        if (before := seen.get(name.casefold())) is not None:
            draft.refuse(
                f"{what} need names that are unique, whatever their case; {name!r} comes after {before!r}",
                table,
                number,
                "name",
            )
        seen.setdefault(name.casefold(), name)


def _check_names(draft: Draft) -> None:
    content = draft.content
    _repeated(draft, (entry.name for entry in content.conditions), "conditions", "conditions")
    _repeated(draft, (entry.name for entry in content.sittings), "sittings", "sittings")
    if not _LANGUAGE.fullmatch(content.language):
        draft.refuse(
            f"`language` must be a tag such as 'en', 'de' or 'pt-BR' (BCP 47), got {content.language!r}", "language"
        )


def _check_domain(draft: Draft) -> None:
    content, given = draft.content, draft.content.model_fields_set
    is_kitchen = content.domain == "overcooked"
    other, about = ("table", "tables") if is_kitchen else ("kitchen", "kitchens")
    if other in given:
        draft.refuse(
            f"`{other}` says how {about} are played, and this study has none: it does nothing", other, warn=True
        )
    if is_kitchen and content.partner is not None:
        draft.refuse("`partner` is the robot at a table; in kitchens there is none", "partner")
    if is_kitchen and content.rounds.reaches:
        draft.refuse("`rounds.reaches` is about tables: it does nothing here", "rounds", "reaches", warn=True)
    practice = content.practice
    if practice is not None:
        key = "reaches" if is_kitchen else "soups"
        if key in practice.model_fields_set:
            draft.refuse(f"`practice.{key}` is about {about}: it does nothing here", "practice", key, warn=True)
    if not is_kitchen and "keys" in content.look.model_fields_set:
        draft.refuse("`look.keys` is about kitchens: it does nothing here", "look", "keys", warn=True)
    if is_kitchen and content.look.show_belief:
        draft.refuse(
            "`look.show_belief` is about tables: kitchens show no belief to participants",
            "look",
            "show_belief",
            warn=True,
        )


def _check_sittings(draft: Draft) -> None:
    content = draft.content
    known = [entry.name for entry in content.conditions]
    used: set[str] = set()
    for number, sitting in enumerate(content.sittings):
        names = known if sitting.conditions is None else sitting.conditions
        used.update(names)
        for position, name in enumerate(names):
            place = ("sittings", number, "conditions", position)
            if name not in known:
                draft.refuse(
                    f"`sittings[{number}].conditions` names {name!r}; the conditions are {', '.join(known)}", *place
                )
            elif name in names[:position]:
                draft.refuse(f"`sittings[{number}].conditions` names {name!r} twice", *place)
        low, high = sitting.min_gap_hours, sitting.max_gap_hours
        if high and low > high:
            draft.refuse(
                f"`sittings[{number}].max_gap_hours` must be 0 (at any time) or at least `min_gap_hours`, {low:g}; "
                f"got {high:g}",
                *("sittings", number, "max_gap_hours"),
            )
        if not number and (low or high):
            draft.refuse("the gaps of the first sitting do nothing: none comes before it", "sittings", 0, warn=True)
    missing = [name for name in known if name not in used] if content.sittings else []
    if missing:
        draft.refuse(
            f"no sitting has the conditions {', '.join(missing)}: nobody would play them", "sittings", warn=True
        )


def _check_orders(draft: Draft) -> None:
    names = list(dict.fromkeys(entry.name for entry in draft.content.conditions))
    try:
        policy = make_policy(draft.content.orders.policy, names)
    except StudyError as error:
        draft.refuse(f"`orders.policy`: {error}", "orders", "policy")
        return
    number = policy.num_orders
    wanted = draft.content.recruitment.wanted
    if number and number > 1 and wanted and wanted % number:
        draft.refuse(
            f"{wanted} participants are no multiple of the {number} orders of {policy.name!r}: the orders would not be "
            "met equally often",
            *("recruitment", "wanted"),
            warn=True,
        )
    if number and number > _ONE_SQUARE * 2:
        draft.refuse(
            f"{policy.name!r} has {number} orders for {len(names)} conditions; fewer participants are not balanced",
            *("orders", "policy"),
            warn=True,
        )


def _check_questionnaires(draft: Draft) -> None:
    content = draft.content
    seen: set[tuple[str, str]] = set()
    for number, use in enumerate(content.questionnaires):
        place = ("questionnaires", number)
        if (use.name, use.after) in seen:
            draft.refuse(f"the questionnaire {use.name!r} is asked twice after each {use.after}", *place, "name")
        seen.add((use.name, use.after))
        if use.after == "practice" and content.practice is None:
            draft.refuse(
                f"the questionnaire {use.name!r} comes after the practice, and the study has no [practice]",
                *place,
                "after",
            )
    if content.partner is None:
        for number, use in enumerate(content.questionnaires):
            if use.name == "fluency":
                draft.refuse(
                    "the questionnaire 'fluency' asks about a robot, and the study has no [partner]",
                    *("questionnaires", number, "name"),
                    warn=True,
                )


def _check_recruitment(draft: Draft) -> None:
    recruitment = draft.content.recruitment
    for key in recruitment.codes:
        if key not in ENDINGS:
            draft.refuse(
                f"`recruitment.codes` has the unknown ending {key!r}; known: {', '.join(ENDINGS)}",
                *("recruitment", "codes", key),
            )
    codes = list(recruitment.codes.values())
    for key, code in recruitment.codes.items():
        if code.strip() != code or not code.isprintable():
            draft.refuse(
                f"the code of {key!r} must be printable and without blanks at its ends, got {code!r}",
                *("recruitment", "codes", key),
            )
    if len(set(codes)) < len(codes):
        draft.refuse(
            "two endings have the same code: the platform cannot tell them apart", "recruitment", "codes", warn=True
        )
    if recruitment.completion_url:
        for message in _url_problems(recruitment.completion_url):
            draft.refuse(f"`recruitment.completion_url` {message}", "recruitment", "completion_url")
    if recruitment.source != "none" and not recruitment.completion_url and "complete" not in recruitment.codes:
        takes = {
            "prolific": "https://app.prolific.com/submissions/complete?cc={code} as `completion_url`, or a code",
            "mturk": "a code",
        }[recruitment.source]
        draft.refuse(
            f"participants of {recruitment.source} take nothing back that the platform knows: give {takes} in "
            "`recruitment.codes`. Without, each has a code of their own, which `legible study code` verifies",
            *("recruitment", "source"),
            warn=True,
        )


def _url_problems(url: str) -> list[str]:
    """What is wrong with where participants are sent."""
    found = []
    names = re.findall(r"\{([^{}]*)\}", url)
    if unknown := [name for name in names if name not in _PLACEHOLDERS]:
        found.append(f"has the unknown placeholder {{{unknown[0]}}}; known: {{code}}, {{ending}}, {{participant}}")
    bare = re.sub(r"\{[^{}]*\}", "x", url)
    if "{" in bare or "}" in bare:
        found.append("has a brace without its other one")
    try:
        parts = urlsplit(bare)
        host = parts.hostname or ""
        parts.port  # noqa: B018  # raises where it is none
    except ValueError as error:
        return [*found, f"is no address: {error}"]
    is_local = host in ("localhost", "127.0.0.1", "::1")
    if not host or not (parts.scheme == "https" or (parts.scheme == "http" and is_local)):
        found.append(f"must be an address that begins with https:// (http:// for localhost only), got {url!r:.200}")
    elif not bare.isascii() or not bare.isprintable() or any(mark in bare for mark in " \"'<>\\^`|"):
        found.append(f"must hold no blanks, quotes or other characters that addresses encode, got {url!r:.200}")
    elif parts.username or parts.password:
        found.append("must hold no user and password: participants see it")
    elif "{" in url.split("://", 1)[-1].split("/", 1)[0]:
        found.append("must not have a placeholder in its host")
    return found


def _check_limits(draft: Draft) -> None:
    limits = draft.content.limits
    if limits.idle_timeout and limits.idle_warning >= limits.idle_timeout:
        draft.refuse(
            f"`limits.idle_warning` must be less than `idle_timeout`, {limits.idle_timeout:g} s; got "
            f"{limits.idle_warning:g}",
            *("limits", "idle_warning"),
        )
    elif limits.idle_timeout and not limits.idle_warning:
        draft.refuse(
            "sessions end after `limits.idle_timeout` without a warning before", "limits", "idle_warning", warn=True
        )
    if limits.idle_warning and not limits.idle_timeout:
        draft.refuse(
            "participants are warned, but no session ever ends: `limits.idle_timeout` is 0", "limits", "idle_timeout",
            warn=True,
        )  # fmt: skip


def _check_look(draft: Draft) -> None:
    look = draft.content.look
    actions = ("north", "south", "east", "west", "interact")
    if missing := [action for action in actions if action not in look.keys]:
        draft.refuse(f"`look.keys` has no key for {', '.join(missing)}: nobody could cook", "look", "keys")
    owner: dict[str, str] = {}
    for action, keys in look.keys.items():
        for number, key in enumerate(keys):
            place = ("look", "keys", action, number)
            if not _CODE.fullmatch(key):
                draft.refuse(
                    f"`look.keys.{action}` names {key!r}, which is no `KeyboardEvent.code`; such are KeyW, ArrowUp, "
                    "Space, Digit1, Period",
                    *place,
                )
            elif key in _TAKEN:
                draft.refuse(
                    f"`look.keys.{action}` takes {key}, which browsers and people without a mouse need",
                    *place,
                    warn=True,
                )
            if key in owner:
                draft.refuse(f"the key {key} is both {owner[key]} and {action}", *place)
            owner.setdefault(key, action)
    if not _COLOUR.fullmatch(look.accent):
        draft.refuse(f"`look.accent` must be a colour such as '#1f7a4d', got {look.accent!r}", "look", "accent")
    elif max(contrast(look.accent, "#ffffff"), contrast(look.accent, "#000000")) < _READABLE:
        draft.refuse("neither white nor black text can be read on `look.accent`", "look", "accent", warn=True)
    elif contrast(look.accent, "#ffffff") < _READABLE:
        draft.refuse(
            f"white text on `look.accent` has a contrast of {contrast(look.accent, '#ffffff'):.1f}; people need "
            f"{_READABLE} to read it",
            *("look", "accent"),
            warn=True,
        )


def contrast(a: str, b: str) -> float:
    """Contrast of two colours ``#rrggbb``, 1 to 21 (WCAG 2.2).

    Example:
        >>> contrast("#000000", "#ffffff"), round(contrast("#777777", "#ffffff"), 2)
        (21.0, 4.48)
    """
    light, dark = sorted((_luminance(a), _luminance(b)), reverse=True)
    return (light + 0.05) / (dark + 0.05)


def _luminance(colour: str) -> float:
    shares = [int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5)]
    red, green, blue = (c / 12.92 if c <= 0.04045 else ((c + 0.055) / 1.055) ** 2.4 for c in shares)
    return 0.2126 * red + 0.7152 * green + 0.0722 * blue
