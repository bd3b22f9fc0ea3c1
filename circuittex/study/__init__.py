"""From a design to a finished folder: the states of its loadings, checked, recorded and written."""
