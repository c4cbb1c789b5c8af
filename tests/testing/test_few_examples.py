"""Properties in ``scripts/test``: they take few examples, even if they name a higher number themselves."""

from __future__ import annotations

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from tests.conftest import take_few_examples


@pytest.mark.parametrize(("most", "wanted"), [(5, 5), (1000, 60)])
def test_properties_take_few_of_many_examples(most: int, wanted: int) -> None:
    taken = list[int]()

    @settings(max_examples=60, database=None)
    @given(st.integers())
    def holds(number: int) -> None:
        taken.append(number)

    take_few_examples(holds, most)
    holds()
    assert len(taken) == wanted
