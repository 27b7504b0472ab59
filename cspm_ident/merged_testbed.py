"""A test-bed file with the content of another and its own comments, order and layout."""

from __future__ import annotations

import io
from collections import Counter
from collections.abc import Iterator, Mapping
from typing import Any, NamedTuple

from ruamel.yaml.comments import CommentedMap, CommentedSeq

from cspm_msgs_py.errors import InputError
from cspm_msgs_py.testbed import TestbedFile, parse_testbed
from cspm_msgs_py.yaml_file import round_trip

_SAMPLE = 40  # characters of a value in an error or a difference


class Difference(NamedTuple):
    """A place where two test-bed files differ; None: the file has nothing there."""

    where: str
    before: Any
    after: Any

    @property
    def words(self) -> str:
        """The difference in a line."""
        return f"{self.where}: {_shown(self.before)} → {_shown(self.after)}"


def merged_testbed(own: TestbedFile, improved: TestbedFile) -> TestbedFile:
    """Return a file that says what the improved one says, written as one's own is.

    What is equal in both keeps its text, comments and place. A block that several cables share
    by an alias is written out where it differs.

    Args:
        own: the file that somebody keeps.
        improved: what a diagnosis or an identification made of it.

    Raises:
        InputError: the cables are others, or the result is no test-bed file.
    """
    _check_same_cables(own, improved)
    yaml, text = round_trip(), own.text
    wanted = yaml.load(improved.text)
    # What a cable takes from another by `<<` is known when the other's change has been written.
    for _ in range(2):
        content = yaml.load(text)
        _take_over(content, wanted, _shared(content))
        stream = io.StringIO()
        yaml.dump(content, stream)
        text = stream.getvalue()
    return parse_testbed(text, own.source)


def differences(own: TestbedFile, other: TestbedFile) -> list[Difference]:
    """Return where two files differ in content, in the order of the first."""
    yaml = round_trip()
    return list(_between(yaml.load(own.text), yaml.load(other.text), ""))


def _check_same_cables(own: TestbedFile, improved: TestbedFile) -> None:
    names = [sorted(c.name for c in file.testbed.cables) for file in (own, improved)]
    if names[0] != names[1]:
        raise InputError(
            f"{improved.source}: cables {', '.join(names[1])}, allowed: those of {own.source}:"
            f" {', '.join(names[0])}"
        )


def _take_over(node: Any, wanted: Any, shared: set[int]) -> None:  # noqa: ANN401 - any YAML
    """Make a node say what another of the same kind does; `shared`: ids of what stays whole.

    Named entries of a list keep their place, and new ones follow.
    """
    if isinstance(node, CommentedSeq):
        places = _places(node, wanted)
        pairs = list(zip(places, wanted, strict=True))
        gone = [place for place in range(len(node)) if place not in places]
    else:
        pairs = [(key if key in node else None, value) for key, value in wanted.items()]
        gone = [key for key in node if key not in wanted]
        node.update({k: _fresh(value) for k, value in wanted.items() if k not in node})
    for place, value in pairs:
        if place is None or _equal(node[place], value):
            continue
        if _same_kind(node[place], value) and id(node[place]) not in shared:
            _take_over(node[place], value, shared)
        else:
            node[place] = _fresh(value)
    for place in reversed(gone):
        del node[place]
    if isinstance(node, CommentedSeq):
        node.extend(_fresh(value) for place, value in pairs if place is None)


def _shared(content: Any) -> set[int]:  # noqa: ANN401 - any YAML
    """Return the ids of mappings and lists that a file has in several places, by `*` or `<<`."""
    count: Counter[int] = Counter()

    def walk(node: Any) -> None:  # noqa: ANN401 - any YAML
        for each in node.values() if isinstance(node, Mapping) else node:
            if isinstance(each, CommentedMap | CommentedSeq):
                count[id(each)] += 1
                walk(each)

    walk(content)
    return {each for each, times in count.items() if times > 1}


def _fresh(value: Any) -> Any:  # noqa: ANN401 - any YAML
    """Return a copy without comments and anchors, which another file may have as well."""
    if not isinstance(value, CommentedMap | CommentedSeq):
        return value
    if isinstance(value, CommentedMap):
        copy: Any = CommentedMap({key: _fresh(each) for key, each in value.items()})
    else:
        copy = CommentedSeq([_fresh(each) for each in value])
    if value.fa.flow_style():
        copy.fa.set_flow_style()
    return copy


def _places(node: CommentedSeq, wanted: CommentedSeq) -> list[int | None]:
    """Return which entry of a list each entry of another is for; None: it is new."""
    free = dict(enumerate(map(_identity, node)))
    found: list[int | None] = []
    for at, value in enumerate(wanted):
        same = [place for place, identity in free.items() if identity == _identity(value)]
        place = at if _identity(value) is None and at in free else next(iter(same), None)
        if place is not None:
            del free[place]
        found.append(place)
    return found


def _identity(entry: Any) -> object:  # noqa: ANN401 - any YAML
    """Return what an entry of a list is known by: a cable's name, an effect with its elements."""
    if not isinstance(entry, Mapping):
        return None
    if "effect" in entry:
        return (entry["effect"], *(entry.get("elements") or ()))
    return entry.get("name")


def _same_kind(node: Any, wanted: Any) -> bool:  # noqa: ANN401 - any YAML
    """Return whether two nodes are both mappings or both lists, and one may become the other."""
    if isinstance(node, CommentedMap):
        # A number with its origin is one thing; half of each would be neither.
        return isinstance(wanted, CommentedMap) and "provenance" not in {*node, *wanted}
    return isinstance(node, CommentedSeq) and isinstance(wanted, CommentedSeq)


def _equal(node: Any, wanted: Any) -> bool:  # noqa: ANN401 - any YAML
    """Return whether two nodes say the same, whatever the order of named entries."""
    return next(_between(node, wanted, ""), None) is None


def _between(node: Any, other: Any, where: str) -> Iterator[Difference]:  # noqa: ANN401 - any YAML
    if isinstance(node, CommentedSeq) and _same_kind(node, other):
        places = _places(node, other)
        for i in range(len(node)):
            name = _identity(node[i]) or i
            below = f"{where}[{name if not isinstance(name, tuple) else '@'.join(name)}]"
            yield from _between(node[i], other[places.index(i)] if i in places else None, below)
        new = [value for place, value in zip(places, other, strict=True) if place is None]
        yield from (Difference(f"{where}[new]", None, value) for value in new)
    elif isinstance(node, CommentedMap) and _same_kind(node, other):
        for key in dict.fromkeys([*node, *other]):
            below = f"{where}.{key}" if where else str(key)
            yield from _between(node.get(key), other.get(key), below)
    elif node != other:
        yield Difference(where, node, other)


def _shown(value: Any) -> str:  # noqa: ANN401 - any YAML
    """Return a value in few characters."""
    if value is None:
        return "nothing"
    if isinstance(value, Mapping):
        number = value.get("value", None)
        if number is not None:
            return f"{number} ({value.get('provenance')})"
        if "effect" in value:
            inner = ", ".join(f"{k} {_shown(v)}" for k, v in value["parameters"].items())
            return f"{value['effect']} on {', '.join(value.get('elements') or ['all'])}: {inner}"
    text = str(value)
    return text if len(text) <= _SAMPLE else f"{text[:_SAMPLE]}…"
