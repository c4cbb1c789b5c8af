"""Claps among other sounds, cut into blocks anywhere."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from roboglot.model.claps import ClapCounter
from roboglot.model.sound import SAMPLE_RATE, SoundBlock, claps, tone

BLOCK = 960


def counted(samples):
    counter = ClapCounter()
    blocks = (SoundBlock(i / SAMPLE_RATE, samples[i : i + BLOCK]) for i in range(0, len(samples) - BLOCK, BLOCK))
    return [heard.count for block in blocks if (heard := counter.feed(block)) is not None]


def played(*parts, noise=33.0):
    whole = np.concatenate(parts)
    return (whole + np.random.default_rng(1).standard_normal(len(whole)) * noise).astype(np.int16)


@settings(max_examples=30)
@given(count=st.integers(1, 4), late=st.integers(0, 2 * BLOCK), distance=st.floats(1.0, 15.0))
def test_any_run_is_counted_wherever_blocks_are_cut(count, late, distance):
    quiet = np.zeros(SAMPLE_RATE // 2 + late)
    assert counted(played(quiet, claps(count).samples / distance, np.zeros(2 * SAMPLE_RATE))) == [count]


@pytest.mark.parametrize("sound", [tone(440.0, 1.0), tone(2000.0, 0.2, 1.0)])
def test_other_sounds_are_none(sound):
    assert counted(played(np.zeros(SAMPLE_RATE), sound.samples, np.zeros(2 * SAMPLE_RATE))) == []


def test_claps_are_heard_over_murmur_not_through_roar():
    quiet, two = np.zeros(SAMPLE_RATE), claps(2).samples / 3
    assert counted(played(quiet, two, quiet, quiet, noise=300.0)) == [2]
    assert counted(played(quiet, two, quiet, quiet, noise=6000.0)) == []
