"""Results in one HDF5 file: written state by state, complete at any moment, reloaded bit for bit."""

from circuittex.results.store.file import (
    RESULTS,
    append_examination,
    append_record,
    complete_change,
    load_study,
    write_study_start,
)

__all__ = ["RESULTS", "append_examination", "append_record", "complete_change", "load_study", "write_study_start"]
