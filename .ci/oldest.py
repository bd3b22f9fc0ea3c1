"""Print the oldest admitted version of everything that pyproject.toml asks for, as constraints for pip."""

from __future__ import annotations

import re
import tomllib
from pathlib import Path

project = tomllib.loads((Path(__file__).parent.parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
# What a matplotlib of that time asks of pyparsing is deprecated in later ones.
print("pyparsing<3.3")
for requirement in [*project["dependencies"], *project["optional-dependencies"]["test"]]:
    name, version = re.match(r"([A-Za-z0-9_-]+)>=([0-9.]+)", requirement).groups()
    # Tools that judge the source are those of the day: an older one knows fewer rules.
    if name not in ("mypy", "ruff"):
        print(f"{name}=={version}")
