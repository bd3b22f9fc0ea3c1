"""Results in one HDF5 file: written state by state, complete at any moment, reloaded bit for bit."""

from circuittex.results.store.file import append_examination, append_record, load_study, write_study_start

__all__ = ["append_examination", "append_record", "load_study", "write_study_start"]
