"""The device check: what a participant's device lacks, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from benchmarks.study.design.study import Study

__all__ = ["failures"]


def failures(study: Study, found: Mapping[str, Any]) -> list[str]:
    """What is missing, a sentence each; none where the device will do.

    Args:
        study: Says what is needed, and the sentences.
        found: ``keyboard, pointer, width, height, round_trip`` as the page measured them.
    """
    needs, words = study.content.device, study.words
    checks = {
        "device_keyboard": needs.keyboard and not found["keyboard"],
        "device_pointer_fine": needs.pointer == "fine" and found["pointer"] != "fine",
        "device_pointer_touch": needs.pointer == "touch" and found["pointer"] != "touch",
        "device_size": found["width"] < needs.min_width or found["height"] < needs.min_height,
        "device_connection": 0 < needs.max_round_trip < found["round_trip"],
    }
    return [_filled(words[key], needs, found) for key, is_missing in checks.items() if is_missing]


def _filled(text: str, needs: Any, found: Mapping[str, Any]) -> str:
    numbers = {
        "min_width": needs.min_width,
        "min_height": needs.min_height,
        "max_round_trip": round(needs.max_round_trip),
        "width": round(found["width"]),
        "height": round(found["height"]),
        "round_trip": round(found["round_trip"]),
    }
    for key, value in numbers.items():
        text = text.replace(f"{{{key}}}", str(value))
    return text
