"""Random words belong to pixels: they do not depend on the division, order or size of an image."""

import numpy as np
from numpy.testing import assert_array_equal

from isethdr_core.physics.detector.random_words import tail, words
from isethdr_core.seeds import generator

STREAM = generator(7, "A", "s1").stream("LPHG", "read")


def test_any_rectangle_has_the_words_of_the_whole():
    whole = words(STREAM, 0, 40, 0, 61)
    for y0, y1, x0, x1 in ((0, 1, 0, 1), (3, 20, 5, 61), (39, 40, 58, 60), (10, 12, 4, 9)):
        assert_array_equal(words(STREAM, y0, y1, x0, x1), whole[y0:y1, x0:x1])


def test_words_agree_with_philox_computed_by_hand():
    # Philox4x64-10 as published (Salmon et al. 2011), written out with Python integers
    import hashlib

    key = int.from_bytes(hashlib.blake2b(repr(STREAM).encode(), digest_size=16).digest(), "little")
    mask = 2**64 - 1
    k = [key & mask, key >> 64]
    y = 123
    x = 4567
    c = [x // 4 + 1, y, 0, 0]
    for _ in range(10):
        p0 = 0xD2E7470EE14C6C93 * c[0]
        p1 = 0xCA5A826395121157 * c[2]
        c = [(p1 >> 64) ^ c[1] ^ k[0], p1 & mask, (p0 >> 64) ^ c[3] ^ k[1], p0 & mask]
        k = [(k[0] + 0x9E3779B97F4A7C15) & mask, (k[1] + 0xBB67AE8584CAA73B) & mask]
    assert words(STREAM, y, y + 1, x, x + 1).view(np.uint64)[0, 0] == c[x % 4]


def test_every_part_of_the_key_matters():
    g = generator(7, "A", "s1")
    streams = [
        g.stream("LPHG", "read"),
        g.stream("LPLG", "read"),
        g.stream("LPHG", "shot"),
        generator(8, "A", "s1").stream("LPHG", "read"),
        generator(7, "B", "s1").stream("LPHG", "read"),
        g.child("s2").stream("LPHG", "read"),
        g.device_stream("LPHG", "read"),
    ]
    assert len({words(s, 0, 1, 0, 1)[0, 0] for s in streams}) == len(streams)


def test_device_streams_do_not_depend_on_the_shot():
    a = generator(1, "A", "s1")
    b = generator(2, "A", "s2")
    assert_array_equal(
        words(a.device_stream("prnu"), 0, 2, 0, 9), words(b.device_stream("prnu"), 0, 2, 0, 9)
    )


def test_tail_is_never_0_and_keeps_both_ends_apart():
    word = np.array([0, -1, 2**63 - 1, -(2**63)])
    p, upper = tail(word)
    assert_array_equal(upper, [True, False, True, False])
    # smallest magnitude: half a step of 2^-64; largest: just below one half
    np.testing.assert_allclose(p, [2.0**-65, 2.0**-65, 0.5, 0.5], rtol=1e-15)


def test_bits_are_balanced():
    w = words(STREAM, 0, 200, 0, 500).view(np.uint64)
    share = [float(((w >> np.uint64(k)) & np.uint64(1)).mean()) for k in range(64)]
    # standard error 0.5 / sqrt(1e5) = 0.0016; 5 of them
    np.testing.assert_allclose(share, 0.5, atol=0.008)
