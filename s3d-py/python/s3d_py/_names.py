"""Names of instances. Numbers count by room in annotated points, and by area in data sets."""

from __future__ import annotations


class _Name(str):
    """A name that differs from every name of the other kind, though both may be spelled alike."""

    __slots__ = ()

    def __eq__(self, other: object) -> bool:
        if isinstance(other, _Name) and type(other) is not type(self):
            return False
        return str.__eq__(self, other)

    def __ne__(self, other: object) -> bool:
        return not self == other

    __hash__ = str.__hash__


class NameInRoom(_Name):
    """A name whose number counts the instances of a class in a room: "chair_1_office_2"."""

    __slots__ = ()


class NameInArea(_Name):
    """A name whose number counts the instances of a class in an area: "chair_7_office_2_1"."""

    __slots__ = ()
