"""Sphinx configuration: MyST pages, API pages from the docstrings; the build treats warnings as errors."""

import re

from circuittex import __version__

project = "circuittex"
copyright = "the circuittex authors, GPL-3.0-or-later"  # noqa: A001 (the name Sphinx asks for)
author = "the circuittex authors"
release = __version__
version = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.mathjax"]
myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 3
exclude_patterns = ["_build"]
default_role = "code"
html_theme = "alabaster"
html_theme_options = {"description": "From fibrils to SPICE netlists", "page_width": "70em"}

autodoc_default_options = {"members": True}
autodoc_member_order = "bysource"
autodoc_type_aliases = {"Floats": "Floats", "Ints": "Ints"}
add_module_names = False
smartquotes = False


def plain_formulas(app, what, name, obj, options, lines):
    """Docstrings are read in editors: their formulas are plain text, so `|d|` and `P* o` must not become markup."""
    in_example = False
    for number, line in enumerate(lines):
        in_example = bool(line.strip()) and (in_example or line.lstrip().startswith(">>>"))
        if not in_example:
            pieces = re.split(r"(`+[^`]*`+)", line)
            texts = [re.sub(r"([|*_])", r"\\\1", piece) for piece in pieces[::2]]
            # The plural in `ForceTerm`s needs a separator that is not shown.
            texts[1:] = [f"\\ {text}" if text[:1].isalnum() else text for text in texts[1:]]
            pieces[::2] = texts
            lines[number] = "".join(pieces)


def setup(app):
    app.connect("autodoc-process-docstring", plain_formulas)
