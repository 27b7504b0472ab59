"""Names of channels as people say them: "torque of winch surge 2"."""

from __future__ import annotations

_PARTS = {"winches": "winch", "cables": "cable", "winch_frame": "winch frame"}
_QUANTITIES = {"torque_command": "commanded torque"}


def channel_words(channel: str) -> str:
    """Return `winches/torque/surge_2` as `torque of winch surge 2`, and other names likewise.

    Args:
        channel: public name: part and quantity, then the element or the degree of freedom.
    """
    part, _, rest = channel.partition("/")
    quantity, _, element = rest.partition("/")
    if not rest:
        return channel.replace("_", " ")
    what = _QUANTITIES.get(quantity, quantity.replace("_", " "))
    body = _PARTS.get(part, part.replace("_", " "))
    if part in ("winches", "cables"):
        return f"{what} of {body} {element.replace('_', ' ')}".rstrip()
    return f"{element.replace('_', ' ')} {what} of the {body}".strip()
