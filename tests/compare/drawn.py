"""What the cases of all service sets are drawn from: nodes, attributes, ranges; sound ones and others."""

from __future__ import annotations

from typing import Any, Final

from asyncua import ua
from hypothesis import strategies as st

from tests.compare import space
from tests.compare.asked import UNKNOWN

Case = list[Any]
Cases = st.SearchStrategy[Case]
Ids = ua.ObjectIds
Attributes = ua.AttributeIds

_MOST_STEPS: Final = 8


def node(where: str, namespace: int = 1) -> ua.NodeId:
    return ua.NodeId(where, namespace)


def standard(*numbers: int) -> list[ua.NodeId]:
    return [ua.NodeId(number) for number in numbers]


VARIABLES: Final = [node(one.id, one.namespace) for one in space.VARIABLES]
OBJECTS: Final = [node(one.id, one.namespace) for one in space.OBJECTS if one.namespace == 1]
METHODS: Final = [node(one.id, one.namespace) for one in space.METHODS if one.namespace == 1]
NOWHERE: Final = [ua.NodeId(), node("nowhere"), node("boolean", 77), ua.NodeId(UNKNOWN)]
nodes = st.one_of(st.sampled_from(VARIABLES), st.sampled_from([*VARIABLES, *OBJECTS, *METHODS, *NOWHERE]))
ranges = st.sampled_from(
    ["0", "1:2", "0:99", "7", "99:100", "2:2", "2:1", "x", "-1", "0,0", "1:", " 1", "1,2:3"]
)
maybe_range = st.one_of(st.none(), st.none(), ranges)
times = st.sampled_from(list(ua.TimestampsToReturn))


def lists(of: st.SearchStrategy[Any], most: int = 3) -> st.SearchStrategy[list[Any]]:
    """Seldom an empty one."""
    return st.one_of(st.lists(of, min_size=1, max_size=most), st.lists(of, max_size=1))


def cases(step: st.SearchStrategy[Any], *first: Any, most: int = _MOST_STEPS) -> Cases:
    return st.lists(step, min_size=1, max_size=most).map(lambda steps: [*first, *steps])


encodings = st.sampled_from(
    [ua.QualifiedName()] * 4
    + [ua.QualifiedName("Default Binary", 0), ua.QualifiedName("Default XML"), ua.QualifiedName("x", 1)]
)
attributes = st.one_of(st.just(int(Attributes.Value)), st.sampled_from([*range(1, 28), 0, 99]))
