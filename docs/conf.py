"""Sphinx configuration: MyST pages, API pages from the docstrings; the build treats warnings as errors."""

import re
import sys
from pathlib import Path

from matplotlib.figure import Figure
from sphinx_gallery.scrapers import figure_rst, matplotlib_scraper

from circuittex import __version__

sys.path.insert(0, str(Path(__file__).parent))  # the gallery imports its scraper from here

project = "circuittex"
copyright = "the circuittex authors, GPL-3.0-or-later"  # noqa: A001 (the name Sphinx asks for)
author = "the circuittex authors"
release = __version__
version = __version__

extensions = ["myst_parser", "sphinx.ext.autodoc", "sphinx.ext.mathjax", "sphinx_gallery.gen_gallery"]
myst_enable_extensions = ["dollarmath", "amsmath"]
myst_heading_anchors = 3
exclude_patterns = ["_build", "gallery/GALLERY_HEADER.rst"]
default_role = "code"
html_theme = "alabaster"
html_theme_options = {"description": "From fibrils to SPICE netlists", "page_width": "70em"}

autodoc_default_options = {"members": True}
autodoc_member_order = "bysource"
autodoc_type_aliases = {"Floats": "Floats", "Ints": "Ints"}
add_module_names = False
smartquotes = False


def figures(block, block_vars, gallery_conf):
    """Pictures of a script: those of pyplot, and figures that circuittex's functions returned to a name."""
    shown = gallery_conf.setdefault("circuittex_shown", set())
    named = [each for each in block_vars["example_globals"].values() if isinstance(each, Figure)]
    new = [each for each in named if id(each) not in shown]
    shown.update(map(id, new))  # those of pyplot too: closed after their block, they look like the others
    saved = []
    for figure in new:
        if not hasattr(figure.canvas.manager, "num"):
            path = next(block_vars["image_path_iterator"])
            figure.savefig(path, dpi=100)
            saved.append(path)
    return figure_rst(saved, gallery_conf["src_dir"]) if saved else matplotlib_scraper(block, block_vars, gallery_conf)


sphinx_gallery_conf = {
    "examples_dirs": "../examples",
    "gallery_dirs": "gallery",
    "filename_pattern": r"\.py$",
    "image_scrapers": ("conf.figures",),
    "download_all_examples": False,
    "show_memory": False,
    "show_signature": False,
    "write_computation_times": False,
    "min_reported_time": 1e6,
    "capture_repr": (),  # numbers are printed; what a last line returns is none
    "abort_on_example_error": True,
}


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
