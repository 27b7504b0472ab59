"""How a node is stepped: lockstep handshake, sample and hold, stages, latched safe states."""
