"""Controller gains by the thesis's procedure, and the margins of their loops."""
