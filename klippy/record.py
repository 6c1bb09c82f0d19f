# SPDX-License-Identifier: GPL-3.0-or-later
"""Classes of a few named values: @record, as the standard dataclasses are.

Those compile text for each class and import the inspector of the language,
which was a tenth of a start.  Here one function serves all classes.  Fields are
the annotations of the class itself, in their order; there is no inheritance of
fields, no field() and no __post_init__.
"""


def record(cls=None, *, frozen=False):
    """Make a class of the annotated names: __init__, __repr__ and __eq__.

    frozen: its objects cannot be changed, and can be keys.
    """
    if cls is None:
        return lambda decorated: record(decorated, frozen=frozen)
    cls.record_fields = tuple(cls.__dict__.get("__annotations__", ()))
    cls.__init__, cls.__repr__, cls.__eq__ = _init, _repr, _eq
    cls.__hash__ = _hash if frozen else None
    if frozen:
        cls.__setattr__, cls.__delattr__ = _refuse, _refuse
    return cls


def replace(obj, **changes):
    """A copy of a record with other values.  Raises TypeError for no field."""
    values = {name: getattr(obj, name) for name in obj.record_fields}
    values.update(changes)
    return type(obj)(**values)


def _init(self, *args, **given):
    cls, values = type(self), self.__dict__
    if len(args) > len(cls.record_fields):
        raise TypeError("%s() takes %d values but %d were given" % (
            cls.__name__, len(cls.record_fields), len(args)))
    values.update(zip(cls.record_fields, args, strict=False))
    for name in cls.record_fields[len(args):]:
        if name in given:
            values[name] = given.pop(name)
        elif hasattr(cls, name):
            values[name] = getattr(cls, name)
        else:
            raise TypeError("%s() misses the value of '%s'" % (cls.__name__, name))
    if given:
        name = next(iter(given))
        raise TypeError("%s() got %s '%s'" % (
            cls.__name__, "two values of" if name in cls.record_fields
            else "an unknown", name))


def _get_values(self):
    return tuple(getattr(self, name) for name in self.record_fields)


def _repr(self):
    return "%s(%s)" % (type(self).__qualname__, ", ".join(
        "%s=%r" % item for item in zip(self.record_fields, _get_values(self),
                                       strict=True)))


def _eq(self, other):
    if type(other) is not type(self):
        return NotImplemented
    return _get_values(self) == _get_values(other)


def _hash(self):
    return hash(_get_values(self))


def _refuse(self, name, *value):
    raise AttributeError("'%s' of %s cannot be changed" % (name, type(self).__name__))
