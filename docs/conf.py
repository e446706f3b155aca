"""Sphinx: the site of ``make docs``. Works without a network: no font, script or style comes from elsewhere."""

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_ext"))

import tsm_fmu

project = "tsm-fmu"
author = "the tsm-fmu developers"
copyright = "MIT licence"
version = release = tsm_fmu.__version__
extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.napoleon", "sphinx.ext.viewcode", "catalogue_pages"]
myst_enable_extensions = ["colon_fence", "deflist"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "_ext"]
highlight_language = "text"  # a block without a language is a drawing or a command
html_theme = "furo"
html_title = "tsm-fmu"
html_static_path = ["_static"]
html_css_files = ["equations.css"]
html_show_sphinx = False
html_show_copyright = False
templates_path = []
autodoc_typehints = "none"  # the numpy docstrings say types in words
autodoc_member_order = "bysource"
napoleon_numpy_docstring = True
napoleon_google_docstring = False
nitpicky = False
default_role = "code"
suppress_warnings = ["myst.xref_missing"]
