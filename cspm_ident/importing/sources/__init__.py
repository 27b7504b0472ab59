"""Files that numbers come from: text tables, MATLAB files, bags."""
