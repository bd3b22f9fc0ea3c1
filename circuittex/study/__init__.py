"""From a design to a finished folder: the states of its paths, checked, recorded and written."""
