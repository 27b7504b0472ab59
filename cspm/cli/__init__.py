"""The command line `cspm`: one file per command group, each thin over `cspm.commands`."""
