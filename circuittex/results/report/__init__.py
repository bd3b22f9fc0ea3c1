"""One self-contained page with the figures and numbers of a study."""

from circuittex.results.report.page import page, write_report

__all__ = ["page", "write_report"]
