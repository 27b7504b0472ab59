"""What `cspm diagnose --explain` prints; no diagnosis needs loading for it."""

from __future__ import annotations

from rich.markdown import Markdown

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed_keys.near_name import allowed_names
from cspm_run.output.console import make_console
from cspm_sim.effects import catalogue
from cspm_sim.effects.document import effect_section


def explain_command(name: str) -> None:
    """Print an effect's description, its signature and the effects it is confounded with.

    Raises:
        InputError: there is no such effect.
    """
    effects = catalogue()
    if name not in effects:
        raise InputError(f"--explain {name}: {allowed_names(name, effects)}")
    make_console().print(Markdown(effect_section(effects[name])))
