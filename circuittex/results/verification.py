"""What the comparison of the three routes to the currents of a state found."""

from __future__ import annotations

from circuittex.base.frozen import frozen

AGREEMENT = 1e-9
"""Routes on the same discretisation that differ by more than this (relative current, V per V) do not agree."""


COARSEST = 1e-4
"""Where rounding alone explains a larger difference, a route checks nothing, and is not said to have."""


@frozen
class Verification:
    """Largest differences between the routes over all probes of one contact state."""

    routes: tuple[str, ...]
    """The routes that answered, of 'fields', 'nodal', 'ngspice'."""
    max_voltage_difference: float
    """Largest difference of two routes in one node voltage, V per volt of the probe."""
    max_current_difference: float
    """Largest difference of two routes in one terminal current, relative to the current of that probe."""
    native_difference: float
    """Largest difference between finite elements and nodal analysis alone, in voltage (V per V) or relative current."""
    ngspice_limit: float
    """Difference that ngspice's rounding explains, in voltage (V per V) or relative current; 0 where it did not
    check."""
    merge_error: float
    """Largest relative change of a probe current by the simplification of the contacts."""
    field_difference: float
    """Largest relative difference of a probe current between the mechanical mesh and the circuit, both at full
    resolution: the discretisation error of the former."""
    fields_seconds: float
    """Time spent in finite elements, s."""
    nodal_seconds: float
    """Time spent in nodal solutions, s."""
    ngspice_seconds: float
    """Time spent in ngspice, s; nan where it did not check."""
    ngspice_checked: bool
    """Whether ngspice answered every probe and its answers were compared."""
    note: str
    """What a reader must know, such as why ngspice did not check or that routes disagree; empty if all is well."""
    native_limit: float = 0.0
    """Difference between finite elements and nodal analysis that the rounding of either explains, where they differ by
    more than `AGREEMENT`: a yarn on contacts of little conductance floats on them. In voltage (V per V) or relative
    current."""
    simulator_failed: bool = False
    """Whether an ngspice that is there was asked and gave no answer; False where there is none."""

    @property
    def agrees(self) -> bool:
        """Whether all routes agree: to `AGREEMENT`, or to what rounding explains where that is coarser."""
        loosest = max(AGREEMENT, self.ngspice_limit, self.native_limit)
        differences = self.max_voltage_difference, self.max_current_difference
        if len(self.routes) < 2:
            return True  # nobody contradicts
        native = self.native_difference <= max(AGREEMENT, self.native_limit)
        return native and all(difference <= loosest for difference in differences)
