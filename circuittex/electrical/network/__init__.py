"""The detailed circuit of a contact state, and its solution by nodal analysis."""
