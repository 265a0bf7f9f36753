"""Digests of values: equal ones have one digest, others another, and none of them fails."""

import functools
import sys
import threading
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import pytest
from pydrake.common.cpp_template import TemplateClass
from pydrake.systems.framework import DiagramBuilder
from scipy.stats import norm

from affordance.runs.reached_values import read_reached


def is_foreign(module):
    return module is not None and not module.__name__.endswith("test_reached_values")


def digest(*values):
    return read_reached(values, is_foreign)[0]


@dataclass
class Rod:
    length: float

    @property
    def half(self):
        return 0.5 * self.length


class Twin(Rod):
    pass


class Cached:
    def __init__(self, factor):
        self.factor = factor

    @functools.cached_property
    def value(self):
        return 1.0 * self.factor

    @classmethod
    def make(cls):
        return cls(1.0)

    @staticmethod
    def name():
        return "cached"


@functools.lru_cache
def remember(value):
    return 2.0 * value


def call():
    return Cached.make().value + remember(Rod(1.0).half)


DIFFERENT = [
    *(0, 0.0, False, None, "", b"", (), [], {}, set(), frozenset(), np.float64(0.0), np.zeros(0), np.zeros((0, 1))),
    *(np.zeros(1), np.zeros(1, dtype=int), np.zeros(1, dtype=complex), np.array(0.0), np.array(["a"]), 1e-300, -0.0),
    *({"a": 1}, {"b": 1}, {"a": 2}, {"a": 1, "b": 2}, {"b": 2, "a": 1}, [("a", 1)], {1}, {1, 2}, frozenset({1})),
    *(Rod(1.0), Rod(2.0), Twin(1.0), Rod, Twin, Cached(1.0), Cached(2.0), functools.partial(Cached, 1.0)),
    *(functools.partial(Cached, 2.0), Cached(1.0).__init__, Path("a"), Path("b"), sys, threading, norm),
    *(np.random.default_rng(1), np.random.default_rng(2), np.array([None]), np.array([{}]), np.timedelta64(1, "s")),
    *(lambda: 1, lambda: 2, lambda x=1: x, lambda x=2: x, lambda *, x=2: x),
]


def test_different_values_have_different_digests():
    digests = [digest(value) for value in DIFFERENT]
    assert [digest(value) for value in DIFFERENT] == digests
    assert len(set(digests)) == len(digests)


def test_equal_values_have_one_digest_however_they_are_shared():
    shared = [1.0]
    assert digest([shared, shared]) == digest([[1.0], [1.0]])
    assert digest({"a", "bc", "d"}) == digest({"d", "bc", "a"})
    assert digest(Rod(1.0)) == digest(Rod(1.0))
    assert digest(np.arange(4.0)) == digest(np.arange(8.0)[:4]) == digest(np.arange(8.0).reshape(4, 2)[:, 0] / 2)


def test_values_that_hold_themselves_end():
    one, other = [1.0], [1.0]
    one.append(one)
    other.append(other)
    assert digest(one) == digest(other) != digest([1.0, [1.0]])

    def again():
        return again

    assert digest(again) == digest(again)


def test_what_cannot_be_taken_apart_counts_by_its_type():
    assert digest(threading.Lock()) == digest(threading.Lock()) != digest(DiagramBuilder())
    assert digest(DiagramBuilder()) == digest(DiagramBuilder())


def test_random_state_of_a_library_does_not_count():
    before = digest(norm)
    norm.rvs(size=3)
    assert digest(norm) == before


def test_template_of_pydrake_is_the_same_whatever_types_it_holds():
    class Own:
        pass

    template = TemplateClass("Value")
    before = digest(template)
    template.add_instantiation((int,), Own)
    assert digest(template) == before != digest(TemplateClass("Other"))


def test_cell_that_is_still_empty_is_none():
    def outer():
        def inner():
            return later

        found = digest(inner)
        later = 1.0
        return found, digest(inner)

    before, after = outer()
    assert before != after


@pytest.mark.parametrize(
    ("owner", "name", "value"),
    [
        (Rod, "half", property(lambda self: self.length)),
        (Cached, "value", functools.cached_property(lambda self: 2.0)),
        (Cached, "make", classmethod(lambda cls: cls(2.0))),
        (sys.modules[__name__], "remember", lambda value: value),
        (Cached, "name", staticmethod(lambda: "other")),
        (Cached, "MOST", 3.0),
    ],
)
def test_members_of_classes_and_cached_functions_that_code_reaches_count(monkeypatch, owner, name, value):
    before = digest(call)
    assert digest(call) == before
    monkeypatch.setattr(owner, name, value, raising=False)
    assert digest(call) != before


def test_instances_do_not_count_what_they_have_cached():
    first = Rod(1.0)
    vars(first)["note"] = "written by a cached property"
    assert digest(first) == digest(Rod(1.0))


def test_modules_are_those_of_what_is_reached():
    assert [module.__name__ for module in read_reached((call,), is_foreign)[1]] == [__name__]
    assert read_reached((np.linalg.norm, norm, sys), is_foreign)[1] == []
