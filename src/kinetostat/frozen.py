"""The decorator of frozen dataclasses, whose methods are compiled when they are first called.

The standard library writes six methods of such a class as text and compiles them where the class is defined, which
takes most of the time of importing a program of many classes; a run makes instances of few of them. Here the standard
library collects the fields, and each method that it would write waits as a descriptor until it is needed. What the
classes hold must not live here.
"""

import dataclasses
import sys
from collections.abc import Callable, Iterable, Mapping, Sequence
from reprlib import recursive_repr
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from dataclasses import dataclass as dataclass
else:

    def dataclass(*, frozen: bool, eq: bool = True) -> Callable[[type], type]:
        """Declare a frozen dataclass, as `dataclasses.dataclass` does, whose methods are compiled when first called.

        Args:
            frozen: True; a class that changes takes the decorator of the standard library.
            eq: whether instances are compared and hashed by their fields.

        Raises:
            TypeError: the class is not frozen, or its fields are not in the order that a constructor can have.
        """
        if not frozen:
            raise TypeError("this decorator is for frozen classes; take dataclasses.dataclass for others")
        return lambda cls: _frozen_class(cls, eq)


class _Factory:
    """Stands in signatures for a default that is made for each instance."""

    def __repr__(self) -> str:
        return "<factory>"


FACTORY = _Factory()


class _Late:
    """A method of a class until it is first asked for, when the compiled one takes its place."""

    def __init__(self, cls: type, name: str, make: Callable[[type], Callable[..., Any]]) -> None:
        self.cls, self.name, self.make = cls, name, make

    def __get__(self, instance: object, owner: type | None = None) -> Any:
        if vars(self.cls)[self.name] is self:  # another thread may have been first
            method = self.make(self.cls)
            method.__qualname__, method.__module__ = f"{self.cls.__qualname__}.{self.name}", self.cls.__module__
            setattr(self.cls, self.name, method)
        return vars(self.cls)[self.name].__get__(instance, owner)


def _frozen_class(cls: type, eq: bool) -> type:
    """Return a class with its fields, and with the methods of a frozen dataclass that it does not define itself."""
    content = dict(vars(cls))
    cls.__doc__ = cls.__doc__ or " "  # the standard library would ask for the signature, and so compile the constructor
    # A class below a frozen one must be declared frozen; others are spared the two methods that this compiles.
    below = any(dataclasses.is_dataclass(base) for base in cls.__mro__[1:])
    new_class: Any = dataclasses.dataclass(init=False, repr=False, eq=False, frozen=below)(cls)
    fields = dataclasses.fields(new_class)
    _check_order(new_class.__name__, _parameters(fields)[0])
    if not content["__doc__"]:
        new_class.__doc__ = f"{new_class.__name__}({', '.join(field.name for field in fields)})"
    for name in ("init", "repr", "frozen"):
        setattr(new_class.__dataclass_params__, name, True)
    new_class.__dataclass_params__.eq = eq
    names = tuple(field.name for field in fields)
    new_class.__setattr__, new_class.__delattr__ = _refusals(new_class, names)
    if "__repr__" not in content:
        new_class.__repr__ = _text
    if "__init__" not in content:
        new_class.__init__ = _Late(new_class, "__init__", _constructor)
    if eq and "__eq__" not in content:
        new_class.__eq__ = _Late(new_class, "__eq__", _equality)
    if eq and (content.get("__hash__") is None and ("__hash__" not in content or "__eq__" in content)):
        new_class.__hash__ = _Late(new_class, "__hash__", _hashing)
    return new_class


Fields = Sequence["dataclasses.Field[Any]"]


def _parameters(fields: Fields) -> tuple[Fields, Fields]:
    """Return the fields that the constructor takes: in their order, and by name alone."""
    arguments = [field for field in fields if field.init]
    return [field for field in arguments if not field.kw_only], [field for field in arguments if field.kw_only]


def _is_optional(field: "dataclasses.Field[Any]") -> bool:
    return field.default is not dataclasses.MISSING or field.default_factory is not dataclasses.MISSING


def _check_order(name: str, fields: Fields) -> None:
    """Refuse a field that must be given behind one that may be left out.

    Raises:
        TypeError: there is one.
    """
    first = next((i for i, field in enumerate(fields) if _is_optional(field)), len(fields))
    for field in fields[first:]:
        if not _is_optional(field):
            raise TypeError(f"{name}: the field {field.name!r} has no default, but one before it has")


def _refusals(cls: Any, names: tuple[str, ...]) -> tuple[Callable[..., None], Callable[..., None]]:
    """Return `__setattr__` and `__delattr__`, which refuse every name in the class, and its fields in those below."""

    def set_attribute(self: Any, name: str, value: Any) -> None:
        if type(self) is cls or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot assign to field {name!r}")
        super(cls, self).__setattr__(name, value)

    def delete_attribute(self: Any, name: str) -> None:
        if type(self) is cls or name in names:
            raise dataclasses.FrozenInstanceError(f"cannot delete field {name!r}")
        super(cls, self).__delattr__(name)

    return set_attribute, delete_attribute


@recursive_repr()
def _text(self: Any) -> str:
    """Return an instance as it would be written in Python."""
    shown = (f"{field.name}={getattr(self, field.name)!r}" for field in dataclasses.fields(self) if field.repr)
    return f"{type(self).__qualname__}({', '.join(shown)})"


def _method(name: str, parameters: Iterable[str], body: Iterable[str], constants: Mapping[str, Any], cls: type) -> Any:
    """Compile a method that knows constants by their names, and finds all other names in the module of its class."""
    lines = "".join(f"  {line}\n" for line in body)
    text = f"def make({', '.join(constants)}):\n def {name}({', '.join(parameters)}):\n{lines} return {name}\n"
    scope: dict[str, Any] = {}
    exec(text, vars(sys.modules[cls.__module__]) if cls.__module__ in sys.modules else {}, scope)
    return scope["make"](**constants)


def _constructor(cls: type) -> Callable[..., None]:
    """Compile the `__init__` of a class: it sets each field, past the refusal of changes."""
    fields: Fields = dataclasses.fields(cls)
    ordered, by_name = _parameters(fields)
    constants: dict[str, Any] = {"_set": object.__setattr__, "_factory": FACTORY}
    body = []
    instance = "_self" if any(field.name == "self" for field in fields) else "self"
    for i, field in enumerate(fields):
        value = field.name if field.init else ""
        if field.default_factory is not dataclasses.MISSING:
            constants[f"_make_{i}"] = field.default_factory
            value = f"_make_{i}() if {value} is _factory else {value}" if value else f"_make_{i}()"
        if value:
            body.append(f"_set({instance}, {field.name!r}, {value})")
    if hasattr(cls, "__post_init__"):
        body.append(f"{instance}.__post_init__()")
    names = [
        instance,
        *(field.name for field in ordered),
        *(["*"] if by_name else []),
        *(field.name for field in by_name),
    ]
    method = _method("__init__", names, body or ["pass"], constants, cls)
    method.__defaults__ = tuple(_default(field) for field in ordered if _is_optional(field))
    method.__kwdefaults__ = {field.name: _default(field) for field in by_name if _is_optional(field)} or None
    method.__annotations__ = {field.name: field.type for field in [*ordered, *by_name]} | {"return": None}
    return method


def _default(field: "dataclasses.Field[Any]") -> object:
    return FACTORY if field.default is dataclasses.MISSING else field.default


def _equality(cls: type) -> Callable[..., bool]:
    """Compile the `__eq__` of a class: of one class, and equal field by field."""
    compared = [field.name for field in dataclasses.fields(cls) if field.compare]
    mine, others = _row("self", compared), _row("other", compared)
    body = ["if other.__class__ is self.__class__:", f" return {mine} == {others}", "return NotImplemented"]
    return _method("__eq__", ["self", "other"], body, {}, cls)


def _hashing(cls: type) -> Callable[..., int]:
    """Compile the `__hash__` of a class: that of the tuple of what is compared."""
    entering = [f.name for f in dataclasses.fields(cls) if (f.compare if f.hash is None else f.hash)]
    return _method("__hash__", ["self"], [f"return hash({_row('self', entering)})"], {}, cls)


def _row(instance: str, names: Sequence[str]) -> str:
    """Return the text of a tuple of attributes of an instance."""
    return "(" + "".join(f"{instance}.{name}, " for name in names) + ")"
