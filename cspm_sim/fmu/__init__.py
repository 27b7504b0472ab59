"""Plants as units of FMI 2 for co-simulation: their variables, and a foreign one as a plant."""
