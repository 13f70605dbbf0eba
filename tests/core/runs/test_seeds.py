"""Random numbers have keys, so they do not depend on order or processes."""

from __future__ import annotations

import dataclasses
import pickle

import numpy as np
import pytest

from isethdr_core import generator
from isethdr_core.errors import ConfigError
from isethdr_core.physics.detector.random_words import words


def test_streams_are_named_by_all_that_they_are_for():
    a = generator(seed=1, device="A", scene="s1")
    others = [
        generator(seed=2, device="A", scene="s1"),
        generator(seed=1, device="B", scene="s1"),
        a.child("s2"),
    ]
    assert len({g.stream("LPHG", "read") for g in [a, *others]}) == 4
    assert a.stream("LPHG", "read") != a.stream("LPHG", "shot") != a.stream("SPLG", "shot")
    assert a.stream("read") == generator(1, "A", "s1").stream("read")


def test_fixed_pattern_belongs_to_the_device_alone():
    a = generator(seed=1, device="A", scene="s1")
    assert a.device_stream("prnu") == generator(seed=9, device="A", scene="s7").device_stream(
        "prnu"
    )
    assert a.device_stream("prnu") != generator(seed=1, device="B", scene="s1").device_stream(
        "prnu"
    )
    assert a.device_stream("prnu") != a.stream("prnu")


def test_a_generator_is_an_immutable_key():
    a = generator(seed=1)
    with pytest.raises(dataclasses.FrozenInstanceError):
        a.seed = 2
    assert pickle.loads(pickle.dumps(a)) == a and hash(a) == hash(generator(seed=1))


def test_words_do_not_depend_on_what_was_drawn_before():
    stream = generator(seed=1).stream("read")
    whole = words(stream, 0, 8, 0, 16)
    assert (words(stream, 3, 5, 7, 12) == whole[3:5, 7:12]).all()


@pytest.mark.parametrize("seed", [-1, 1.7, True, "7", 2**63, float("nan"), None])
def test_a_seed_is_a_whole_number_of_64_bits(seed):
    with pytest.raises(
        ConfigError, match="seed is .*; expected a whole number from 0 to 2\\^63 - 1"
    ):
        generator(seed=seed)
    assert generator(seed=np.int64(7)).seed == 7
