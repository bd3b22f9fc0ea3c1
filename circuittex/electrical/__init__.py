"""From a contact state to voltages, currents and circuits."""
