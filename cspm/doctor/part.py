"""One thing that commands may need, as found on this computer."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Part:
    """Something that commands may need.

    Attributes:
        name: what it is.
        found: what there is of it, or what is missing.
        remedy: what adds what is missing; empty where nothing is.
        serves: what does not work without it.
    """

    name: str
    found: str
    remedy: str = ""
    serves: str = ""

    @property
    def there(self) -> bool:
        """Whether nothing is missing."""
        return not self.remedy
