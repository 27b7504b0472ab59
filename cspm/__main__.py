"""Run the command line: `python -m cspm`."""

from cspm.cli.main import main

main()
