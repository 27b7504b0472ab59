"""Which modules a file imports."""

import ast

# Rooms inside a package that share nothing with the rest of it.
APART = ("cspm_sim.mujoco", "bench.blind.reality")


def room(module):
    """Return the room apart that a module lies in, or its package."""
    inside = [name for name in APART if f"{module}.".startswith(f"{name}.")]
    return inside[0] if inside else module.split(".")[0]


def imported(text):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            yield from (room(alias.name) for alias in node.names)
        elif isinstance(node, ast.ImportFrom):
            yield room(node.module or "") if node.level == 0 else "."
