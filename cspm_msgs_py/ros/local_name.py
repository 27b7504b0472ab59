"""Topics of the contract as names that a node's namespace applies to."""


def local(name: str) -> str:
    """Return a contract's absolute name as a relative one: `-r __ns:=/robot1` moves it.

    Several machines share a domain by it, all of a run's topics and its domain's claim with them.
    """
    return name.removeprefix("/")
