"""Gauss rules: weights sum to the length, points inside, polynomials exact, singular ends settled."""

import numpy as np
import pytest

from fubini.errors import OptionError
from fubini.quadrature import adaptive, composite, fixed, gauss


@pytest.mark.parametrize("order", [1, 2, 3, 5, 8, 12, 16, 20])
def test_rule_is_a_certificate(order):
    x, w = gauss(order)
    assert abs(w.sum() - 1.0) < 4e-16 * order
    assert (w > 0).all() and (x > 0).all() and (x < 1).all()
    for degree in range(2 * order):
        assert abs((w * x**degree).sum() - 1.0 / (degree + 1)) < 3e-15
    missed = abs((w * x ** (2 * order)).sum() - 1.0 / (2 * order + 1))
    assert missed > 1e-15 or order > 8  # one degree more is not exact


def test_composite_covers_each_interval():
    breaks = np.array([-1.0, 0.5, 0.75, 4.0])
    x, w = composite(breaks, 4)
    assert np.allclose(w.reshape(3, 4).sum(axis=1), np.diff(breaks), rtol=1e-15)
    assert ((x.reshape(3, 4) > breaks[:-1, None]) & (x.reshape(3, 4) < breaks[1:, None])).all()
    assert np.allclose(fixed(lambda t: t**7, breaks, 4)[:, 0], np.diff(breaks**8 / 8), rtol=1e-14)


def test_adaptive_settles_singular_ends_and_jumps():
    value = adaptive(lambda t: np.stack([np.sqrt(t), t ** (1 / 3), t > 0.3], axis=1), [0.0, 1.0], 1e-14)
    assert np.allclose(value, [2 / 3, 3 / 4, 0.7], rtol=1e-11)


def test_adaptive_ends_on_noise():
    rng = np.random.default_rng(1)
    calls = 0

    def noisy(t):
        nonlocal calls
        calls += len(t)
        return 1.0 + 1e-3 * rng.random(len(t))

    assert abs(adaptive(noisy, [0.0, 1.0], 1e-15)[0] - 1.0005) < 1e-3
    assert calls < 100_000


def test_order_below_one_is_refused():
    with pytest.raises(OptionError):
        gauss(0)
