"""The line that a command or a node says of an error."""

import re


def said(err):
    """Return a line without the command's name, which it has to begin with."""
    name = re.match(r"(cspm|python -m [a-z.]+)( [a-z_-]+)*: ", err)
    assert name is not None, err
    return err[name.end() :]
