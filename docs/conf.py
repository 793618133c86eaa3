"""The documentation site: Sphinx with MyST pages, the reference from docstrings and commands."""

import sys
from importlib.metadata import version as installed
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parent / "_extensions"))

project = "zerorate"
author = "the developers of zerorate"
project_copyright = "the developers of zerorate"
version = release = installed("zerorate")

extensions = [
    "commands",
    "gallery",
    "myst_parser",
    "notebooks",
    "numpydoc",
    "reference",
    "sphinx.ext.autodoc",
    "sphinx_copybutton",
]
exclude_patterns = ["_build", "_extensions"]
myst_enable_extensions = ["colon_fence", "deflist", "dollarmath"]
myst_heading_anchors = 3
# Doctests of the pages end with an empty line, which shows.
trim_doctest_flags = True

autodoc_member_order = "groupwise"
autodoc_typehints = "none"
numpydoc_show_class_members = False
add_module_names = False

# Two hyphens before an option stay two hyphens, which can be copied.
smartquotes = False

html_theme = "furo"
html_static_path = ["_static"]
html_css_files = ["site.css"]
html_search_scorer = str(Path(__file__).parent / "_static/scorer.js")
html_title = f"zerorate {version}"
html_show_sourcelink = False
copybutton_prompt_text = r">>> |\.\.\. |\$ "
copybutton_prompt_is_regexp = True
