"""The processes of a run, one a node: forked from one host, signalled, and seen off."""
