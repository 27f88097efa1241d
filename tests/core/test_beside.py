"""A measured size never reads like the limit that it misses, and a rough one never as a power of ten."""

import numpy as np
import pytest

from footfall.core.beside import beside, roughly


def test_a_size_that_misses_reads_otherwise_than_the_limit(rng):
    for digits in (1, 2, 3):
        for limit in rng.uniform(-2.0, 2.0, 200):
            for miss in (1e-9, -1e-9, *rng.normal(0.0, 10.0**-digits, 10)):
                shown, bound = (float(text) for text in beside(limit + miss, limit, digits))
                assert np.sign(shown - bound) == np.sign(miss)
                # away from the limit, and by no more than needed
                assert abs(shown - (limit + miss)) <= 1.5 * 10.0**-digits + 1e-9
                assert abs(bound - limit) <= 0.5 * 10.0**-digits + 1e-9


@pytest.mark.parametrize(
    ("measured", "limit", "told"),
    [
        (0.0199, 0.02, ("0.019", "0.020")),
        (0.0201, 0.02, ("0.021", "0.020")),
        (0.011, 0.02, ("0.011", "0.020")),
        (0.02, 0.02, ("0.020", "0.020")),
    ],
)
def test_examples(measured, limit, told):
    assert beside(measured, limit) == told


def test_a_rough_size_is_near_and_no_power_of_ten(rng):
    for digits in (1, 2, 3):
        for size in 10.0 ** rng.uniform(-2.0, 6.0, 300):
            told = roughly(size, digits)
            assert "e" not in told
            assert abs(float(told) - size) <= max(0.5 * 10.0**-digits * 10.0 * size, 1e-9)
    assert [roughly(size) for size in (0.0, 0.5, 26.2, 902.3)] == ["0.001", "0.5", "26", "902"]
