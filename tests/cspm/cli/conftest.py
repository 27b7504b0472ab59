"""What tests of the command line share."""

import pytest
import typer
from typer.core import TyperGroup

from cspm.cli import main as cli
from cspm.cli.app import app


@pytest.fixture(scope="module")
def commands():
    """All commands by their words."""

    def below(command, words):
        if not isinstance(command, TyperGroup):
            return {words: command}
        return {k: v for n, c in command.commands.items() for k, v in below(c, (*words, n)).items()}

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("sys.argv", ["cspm", "--version"])
        with pytest.raises(SystemExit):
            cli.main()
    return below(typer.main.get_command(app), ())
