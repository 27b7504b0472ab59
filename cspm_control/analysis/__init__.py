"""What a machine and its controllers can do: linear analysis, workspace, manipulability, loops."""
