"""Sphinx configuration; `make docs` builds the site with warnings as errors."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

from legible_envs import __version__

project = "legible-envs"
author = "The legible-envs developers"
copyright = author
release = __version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "sphinx.ext.napoleon",
    "sphinx.ext.viewcode",
    "environment_pages",
    "mathml",
]
exclude_patterns = ["_build", "examples", "_rooms.md"]
suppress_warnings = ["config.cache"]

myst_enable_extensions = ["dollarmath", "colon_fence", "deflist"]
myst_heading_anchors = 3

autodoc_typehints = "none"  # the signature shows them; docstrings give shapes and units
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True, "show-inheritance": True}
napoleon_google_docstring = True
napoleon_numpy_docstring = False
napoleon_use_rtype = False
napoleon_use_ivar = True
napoleon_attr_annotations = False

html_math_renderer = "mathml"
html_theme = "furo"
html_title = f"legible-envs {release}"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_show_sphinx = False


def skip_what_libraries_add(app, what, name, obj, skip, options):
    """Methods made for every subclass, with links into manuals of their own: of scikit-learn, and of matplotlib."""
    is_added = name.startswith("set_") and name.endswith("_request")
    return True if is_added or (name == "set" and str(obj.__module__).startswith("matplotlib")) else skip


def setup(app):
    """Register with Sphinx."""
    app.connect("autodoc-skip-member", skip_what_libraries_add)
