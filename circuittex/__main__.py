"""``python -m circuittex`` is the command ``circuittex``."""

from __future__ import annotations

import sys

from circuittex.command.cli import main

if __name__ == "__main__":
    sys.exit(main())
