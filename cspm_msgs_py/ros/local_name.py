"""Topics of the contract as names that a node's namespace applies to."""

from cspm_msgs_py.topics import PARAMETER_EVENTS, ROSOUT

_OF_ALL = (ROSOUT.name, PARAMETER_EVENTS.name)


def local(name: str) -> str:
    """Return a contract's absolute name as a relative one: `-r __ns:=/robot1` moves it.

    Several machines share a domain by it, all of a run's topics and its domain's claim with them.
    The log and the changes of parameters are of all nodes, and stay where they are.
    """
    return name if name in _OF_ALL else name.removeprefix("/")
