"""Frozen dataclasses whose methods are compiled late, class by class as those of the standard library."""

import copy
import dataclasses
import inspect
import pickle
import sys
import weakref
from concurrent.futures import ThreadPoolExecutor
from dataclasses import FrozenInstanceError, field
from functools import cached_property

import pytest

from kinetostat import frozen


def plain(decorator):
    @decorator(frozen=True)
    class Shape:
        """A class with fields that must be given, defaults and a property that is kept."""

        a: float
        b: "tuple[int, ...]"
        c: int = 3
        d: str = ""

        @cached_property
        def double(self):
            return 2 * self.a

    return Shape


def single(decorator):
    @decorator(frozen=True)
    class Shape:
        a: float

    return Shape


def empty(decorator):
    @decorator(frozen=True)
    class Shape:
        """Without fields."""

    return Shape


def made(decorator):
    @decorator(frozen=True)
    class Shape:
        """Fields with all that `field` can say."""

        a: float
        entries: list = field(default_factory=list)
        quiet: int = field(default=1, repr=False, compare=False)
        apart: int = field(default=5, hash=False)
        named: int = field(kw_only=True)
        usual: dict = field(kw_only=True, default_factory=dict, hash=False)
        after: list = field(init=False, default_factory=lambda: [1])
        fixed: int = field(init=False, default=7)

    return Shape


def checked(decorator):
    @decorator(frozen=True)
    class Shape:
        """Fields that are called as the machinery calls its own, and a check of them."""

        self: float
        cls: float = 0.0

        def __post_init__(this):  # noqa: N805 - `self` is a field
            object.__setattr__(this, "sum", this.self + this.cls)

    return Shape


def inherited(decorator):
    @decorator(frozen=True)
    class Base:
        """A base with a default."""

        a: float
        b: int = 2

        def total(self):
            return self.a + self.b

    @decorator(frozen=True)
    class Shape(Base):
        """The default of the base is another one here."""

        b: int = 5
        c: int = 9

    return Shape


def undecorated(decorator):
    class Shape(plain(decorator)):
        """A class below one with fields, itself without the decorator."""

    return Shape


def by_identity(decorator):
    @decorator(frozen=True, eq=False)
    class Shape:
        """Compared by identity."""

        a: float
        b: int = 2

    return Shape


def by_own_rules(decorator):
    @decorator(frozen=True)
    class Shape:
        """Methods of its own are kept."""

        a: float
        b: int = 2

        def __eq__(self, other):
            return True

        def __hash__(self):
            return 1

        def __repr__(self):
            return "a shape"

    return Shape


def by_own_equality(decorator):
    @decorator(frozen=True)
    class Shape:
        """Equality of its own, the hash of its fields."""

        a: float
        b: int = 2

        def __eq__(self, other):
            return True

    return Shape


SHAPES = {
    plain: [((1.5, (1, 2)), {}), ((1.5, (1, 2), 4), {"d": "x"}), ((float("inf"), ()), {})],
    single: [((1.0,), {}), ((), {"a": 2.0})],
    empty: [((), {})],
    made: [((1.0,), {"named": 2}), ((1.0, [], 9), {"named": 2}), ((1.0, (), 1, 6), {"named": 3, "usual": {1: 2}})],
    checked: [((1.0,), {}), ((1.0, 4.0), {})],
    inherited: [((1.0,), {}), ((1.0, 1, 1), {}), ((2.0,), {"c": 1})],
    undecorated: [((1.0, ()), {}), ((1.0, (), 7), {})],
    by_identity: [((1.0,), {}), ((1.0, 3), {})],
    by_own_rules: [((1.0,), {}), ((2.0, 3), {})],
    by_own_equality: [((1.0,), {}), ((1.0, 3), {})],
}
WRONG = [((), {"unknown": 1}), ((1.0,) * 12, {}), ((1.0, 2.0), {"a": 1.0, "self": 1.0})]


def outcome(function, *given, **named):
    """What a function returns, or the error that it raises, in words."""
    try:
        return function(*given, **named)
    except Exception as error:
        return type(error), str(error)


@pytest.fixture(params=list(SHAPES), ids=lambda shape: shape.__name__)
def pair(request):
    """Two classes of one shape, ours and the standard library's, and arguments of instances."""
    shape = request.param
    ours, theirs = shape(frozen.dataclass), shape(dataclasses.dataclass)
    return ours, theirs, SHAPES[shape]


def hashed(item):
    return outcome(hash, item) if type(item).__hash__ is not object.__hash__ else "by identity"


def test_instances_are_those_of_the_standard_library(pair):
    ours, theirs, given = pair
    for places, names in given:
        mine, other = ours(*places, **names), theirs(*places, **names)
        assert vars(mine) == vars(other)
        assert dataclasses.asdict(mine) == dataclasses.asdict(other)
        assert hashed(mine) == hashed(other)
        assert repr(mine) == repr(other)
        for twin in (copy.copy(mine), copy.deepcopy(mine), dataclasses.replace(mine)):
            assert type(twin) is ours
            assert vars(twin) == vars(mine)
        assert weakref.ref(mine)() is mine


def test_equality_is_that_of_the_standard_library(pair):
    ours, theirs, given = pair
    mine = [ours(*places, **names) for places, names in given * 2]
    other = [theirs(*places, **names) for places, names in given * 2]
    assert [[a == b for a in mine] for b in mine] == [[a == b for a in other] for b in other]
    assert (mine[0] == 1) == (other[0] == 1)


def test_wrong_arguments_are_refused_alike(pair):
    ours, theirs, _ = pair
    for places, names in WRONG:
        assert outcome(ours, *places, **names) == outcome(theirs, *places, **names)


def test_classes_say_the_same_of_themselves(pair):
    ours, theirs, _ = pair
    assert str(inspect.signature(ours)) == str(inspect.signature(theirs))
    assert ours.__init__.__qualname__ == theirs.__init__.__qualname__
    assert ours.__init__.__module__ == theirs.__init__.__module__
    assert ours.__match_args__ == theirs.__match_args__
    described = [[(f.name, f.type, f.init, f.repr, f.compare) for f in dataclasses.fields(c)] for c in (ours, theirs)]
    assert described[0] == described[1]
    for name in ("eq", "frozen", "init", "repr", "order", "unsafe_hash"):
        assert getattr(ours.__dataclass_params__, name) == getattr(theirs.__dataclass_params__, name)


def test_changes_are_refused_alike(pair):
    ours, theirs, given = pair
    mine, other = ours(*given[0][0], **given[0][1]), theirs(*given[0][0], **given[0][1])
    for name in ("a", "new"):
        assert outcome(setattr, mine, name, 1) == outcome(setattr, other, name, 1)
        assert outcome(delattr, mine, name) == outcome(delattr, other, name)
    assert vars(mine) == vars(other)


@frozen.dataclass(frozen=True)
class Whole:
    """A class that can be found by its name, as pickles need."""

    a: float
    b: tuple = ()


def test_pickles_and_patterns_and_kept_properties():
    item = Whole(1.0, (2,))
    assert pickle.loads(pickle.dumps(item)) == item
    match item:
        case Whole(a, b):
            assert (a, b) == (1.0, (2,))
    shape = plain(frozen.dataclass)(2.0, ())
    assert shape.double == 4.0
    assert vars(shape)["double"] == 4.0


def test_nothing_is_compiled_before_it_is_used():
    shape = plain(frozen.dataclass)
    late = {name for name, value in vars(shape).items() if type(value).__name__ == "_Late"}
    assert late == {"__init__", "__eq__", "__hash__"}
    first = shape(1.0, ())
    assert first == shape(1.0, ())
    assert {name for name, value in vars(shape).items() if type(value).__name__ == "_Late"} == {"__hash__"}


def test_threads_may_make_the_first_instance_together():
    interval = sys.getswitchinterval()
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(8) as threads:
            for _ in range(20):
                shape = made(frozen.dataclass)
                assert len({repr(item) for item in threads.map(lambda _, s=shape: s(1.0, named=2), range(16))}) == 1
    finally:
        sys.setswitchinterval(interval)


def test_fields_out_of_order_and_classes_that_change_are_refused():
    with pytest.raises(TypeError, match="'b' has no default"):

        @frozen.dataclass(frozen=True)
        class Wrong:
            a: int = 1
            b: int

    with pytest.raises(TypeError, match="frozen"):
        frozen.dataclass(frozen=False)


def test_a_class_below_stays_frozen():
    shape = inherited(frozen.dataclass)(1.0)
    assert shape.total() == 6.0
    with pytest.raises(FrozenInstanceError):
        shape.b = 1
