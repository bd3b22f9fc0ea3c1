"""SPICE words, the reader of netlists, PySpice objects, and ngspice."""
