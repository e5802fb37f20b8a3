from .base import Design, Panel, Part, Presenter, ReportTexts
from .checks import PresenterError, check_presenter
from .registry import list_presenters, load_design, presenter_of, register_presenter

__all__ = [
    "Design",
    "Panel",
    "Part",
    "Presenter",
    "PresenterError",
    "ReportTexts",
    "check_presenter",
    "list_presenters",
    "load_design",
    "presenter_of",
    "register_presenter",
]
