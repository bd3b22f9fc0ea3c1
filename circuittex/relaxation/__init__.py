"""From a mesh and a design to equilibria of the whole fabric, and from one of them to the next."""
