"""The pages' templates: filled by jinja2, which escapes every text."""

from __future__ import annotations

from functools import cache
from typing import Any

from jinja2 import ChoiceLoader, Environment, PackageLoader, StrictUndefined
from markupsafe import Markup


@cache
def environment(*packages: str) -> Environment:
    """The templates of these packages, an earlier one's before a later one's of the same name."""
    return Environment(
        loader=ChoiceLoader([PackageLoader(package) for package in packages]),
        autoescape=True,
        undefined=StrictUndefined,  # a name that a template misspells is an error
        trim_blocks=True,
        lstrip_blocks=True,
    )


def render(name: str, package: str = "circuittex.results.report", **values: Any) -> Markup:
    """A template of `package` or of the report, filled with `values`: every text in them is escaped.

    >>> str(render("table.html", head=["a & b"], rows=[["<i>", "1"]])).count("&lt;i&gt;")
    1
    """
    packages = dict.fromkeys((package, "circuittex.results.report"))
    # What has been rendered is markup already and is not escaped again.
    return Markup(environment(*packages).get_template(name).render(values))


def table(head: Any, rows: Any) -> Markup:
    """An HTML table; the first column names the row."""
    return render("table.html", head=head, rows=rows)
