"""Symbols of the sub-circuits of a library, for programs in which circuits are drawn."""
