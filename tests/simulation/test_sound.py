"""Sounds on their way, what microphones take down, what the loudspeaker says."""

from __future__ import annotations

import math
import shlex
import sys

import numpy as np
import pytest

from roboglot.model.actions import ActionStatus
from roboglot.model.components.interaction.speaker import TEXT_MAX, Speaker
from roboglot.model.components.sensing.microphone import BLOCK, Microphone
from roboglot.model.errors import InvalidGoal
from roboglot.model.events import SoundPlayed, Spoke
from roboglot.model.geometry import Point, Pose
from roboglot.model.sound import SAMPLE_RATE, claps, tone
from roboglot.simulation.sound.sound import (
    SOURCES_MAX,
    SPEED,
    SoundField,
    Source,
)
from roboglot.simulation.sound.voice import speaking_time
from roboglot.simulation.world.world_files import load_world

CORRIDOR = Point(12.0, 10.0)


@pytest.fixture
def air():
    return SoundField(load_world("office"))


def loudness(air, at, floor=0, start=0.2):
    return float(np.abs(air.heard(at, floor, start, 4800)).max())


def test_sound_fades_with_distance_behind_walls_and_slabs(air):
    air.emit(Source(tone(440, 2.0), CORRIDOR, 0, 0.0, 1.0))
    at_one = loudness(air, Point(13.0, 10.0))
    assert at_one == pytest.approx(0.3 * 32767, rel=0.01)
    assert loudness(air, Point(16.0, 10.0)) == pytest.approx(at_one / 4, rel=0.01)
    behind = loudness(air, Point(13.0, 7.5))  # two and a half metres away, a wall between
    assert behind < 0.2 * at_one / math.hypot(1.0, 2.5)
    assert loudness(air, CORRIDOR, floor=1) < 0.01 * at_one


def test_a_sound_arrives_late_and_ends(air):
    air.emit(Source(claps(1), CORRIDOR, 0, 1.0, 1.0))
    heard = air.heard(Point(22.0, 10.0), 0, 1.0, SAMPLE_RATE)
    assert np.flatnonzero(heard)[0] / SAMPLE_RATE == pytest.approx(10 / SPEED, abs=0.0005)
    assert np.flatnonzero(heard)[-1] / SAMPLE_RATE <= 10 / SPEED + 0.12
    assert not air.heard(CORRIDOR, 0, 0.0, SAMPLE_RATE // 2).any()


def test_sounds_add_up_within_limits_and_are_silenced(air):
    first = Source(tone(440, 1.0), CORRIDOR, 0, 0.0, 1.0)
    air.emit(first)
    alone = loudness(air, Point(13.0, 10.0))
    air.emit(Source(tone(440, 1.0), CORRIDOR, 0, 0.0, 1.0))
    assert loudness(air, Point(13.0, 10.0)) == pytest.approx(2 * alone, rel=0.01)
    air.silence(first)
    assert loudness(air, Point(13.0, 10.0)) == pytest.approx(alone, rel=0.01)
    for _ in range(SOURCES_MAX - 1):
        air.emit(Source(tone(440, 1.0), CORRIDOR, 0, 0.0, 1.0))
    with pytest.raises(ValueError, match=f"at most {SOURCES_MAX} sounds at once"):
        air.emit(Source(tone(440, 1.0), CORRIDOR, 0, 0.5, 1.0))
    air.emit(Source(tone(440, 1.0), CORRIDOR, 0, 20.0, 1.0))  # the others have ended


async def taken_down(run, seconds):
    """All that the microphone of the first robot hears."""
    blocks = []
    with run.robot[Microphone].subscribe() as listener:
        for _ in range(round(seconds / 0.1)):
            await run.clock.advance(0.1)
            blocks += listener.drain()
    assert listener.dropped == 0
    return blocks


async def test_microphone_gives_gapless_blocks_of_noise_per_seed(simulate):
    blocks = []
    for _ in range(2):
        run = simulate("empty", seed=5)
        blocks.append(await taken_down(run, 0.5))
    assert [len(block.samples) for block in blocks[0]] == [BLOCK] * 25
    assert [block.stamp for block in blocks[0]] == pytest.approx([i * 0.02 for i in range(25)])
    assert all((a.samples == b.samples).all() for a, b in zip(*blocks, strict=True))
    murmur = np.concatenate([block.samples for block in blocks[0]])
    assert murmur.std() == pytest.approx(0.001 * 32767, rel=0.05)


async def test_the_microphone_hears_claps_in_the_world(simulate):
    run = simulate("empty", start=Pose(5, 5))
    run.world.stage.make_sound(claps(2, pause=0.35), Point(5, 7))
    wave = np.concatenate([block.samples for block in await taken_down(run, 1.0)]).astype(float)
    loud = np.flatnonzero(np.abs(wave) > 3000) / SAMPLE_RATE
    starts = loud[np.concatenate(([True], np.diff(loud) > 0.1))]
    assert starts == pytest.approx([2 / SPEED, 0.35 + 2 / SPEED], abs=0.003)


async def test_a_robot_hears_what_another_one_plays(simulate):
    run = simulate("empty", start=Pose(5, 5), robots=("a", "b"))
    other = run.robots["b"][Speaker]
    await other.set_volume(1.0)
    other.play(tone(1000, 0.5))
    wave = np.concatenate([block.samples for block in await taken_down(run, 0.4)]).astype(float)
    peak = np.fft.rfftfreq(len(wave), 1 / SAMPLE_RATE)[np.abs(np.fft.rfft(wave)).argmax()]
    assert peak == pytest.approx(1000, abs=5)


async def test_playing_takes_its_time_and_is_reported(simulate):
    run = simulate("empty")
    with run.robot.events.subscribe(SoundPlayed) as played:
        action = run.robot[Speaker].play(tone(500, 1.0), source="test")
        await run.clock.advance(0.9)
        assert action.status is ActionStatus.EXECUTING
        await run.clock.advance(0.2)
        assert action.status is ActionStatus.SUCCEEDED
        assert [(event.name, event.seconds) for event in played.drain()] == [("tone 500 Hz", 1.0)]


async def test_new_sound_takes_over_and_old_falls_silent(simulate):
    run = simulate("empty", start=Pose(5, 5))
    speaker = run.robot[Speaker]
    old = speaker.play(tone(500, 5.0))
    await run.clock.advance(0.5)
    new = speaker.play(tone(2000, 0.2))
    await run.clock.advance(0.5)
    assert (old.status, new.status) == (ActionStatus.CANCELED, ActionStatus.SUCCEEDED)
    wave = np.concatenate([block.samples for block in await taken_down(run, 0.2)])
    assert np.abs(wave).max() < 1000


async def test_without_voice_text_is_reported_but_not_heard(simulate, monkeypatch, tmp_path):
    monkeypatch.setenv("PATH", str(tmp_path))
    run = simulate("empty")
    with run.robot.events.subscribe(Spoke) as spoke:
        run.robot[Speaker].say("hello, who is there?")
        wave = np.concatenate([block.samples for block in await taken_down(run, 2.0)])
        [event] = spoke.drain()
    assert (event.text, event.audible) == ("hello, who is there?", False)
    assert event.seconds == pytest.approx(speaking_time("hello, who is there?"))
    assert np.abs(wave).max() < 300


FAKE_VOICE = """import sys, wave
text = sys.stdin.read()
with wave.open(sys.stdout.buffer, "wb") as file:
    file.setparams((1, 2, 24000, 0, "NONE", ""))
    file.writeframes(b"\\x00\\x40\\x00\\xc0" * (600 * len(text)))
"""


async def test_with_a_voice_a_text_is_heard(simulate, monkeypatch, tmp_path):
    program = tmp_path / "espeak-ng"
    (tmp_path / "voice.py").write_text(FAKE_VOICE)
    program.write_text(f"#!/bin/sh\nexec {shlex.join([sys.executable, str(tmp_path / 'voice.py')])}\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    run = simulate("empty")
    with run.robot.events.subscribe(Spoke) as spoke:
        run.robot[Speaker].say("0123456789")
        wave = np.concatenate([block.samples for block in await taken_down(run, 1.0)])
        [event] = spoke.drain()
    assert event.audible
    assert event.seconds == pytest.approx(10 * 1200 / 24000)
    assert np.abs(wave).max() > 10_000


@pytest.mark.parametrize("script", ["exit 3", "echo nonsense"])
async def test_a_broken_voice_is_as_good_as_none(simulate, monkeypatch, tmp_path, script):
    program = tmp_path / "espeak-ng"
    program.write_text(f"#!/bin/sh\n{script}\n")
    program.chmod(0o755)
    monkeypatch.setenv("PATH", str(tmp_path))
    run = simulate("empty")
    with run.robot.events.subscribe(Spoke) as spoke:
        run.robot[Speaker].say("hm")
        await run.clock.advance(1.0)
        assert [event.audible for event in spoke.drain()] == [False]


async def test_invalid_texts_and_volumes_are_refused(simulate):
    speaker = simulate("empty").robot[Speaker]
    for text in ("", "  ", "x" * (TEXT_MAX + 1)):
        with pytest.raises(InvalidGoal):
            speaker.say(text)
    for volume in (-0.1, 1.1, math.nan):
        with pytest.raises(InvalidGoal):
            await speaker.set_volume(volume)
    await speaker.set_volume(0.25)
    assert speaker.volume == 0.25


def test_speaking_takes_as_long_as_people_take():
    assert speaking_time("好") == pytest.approx(0.4)
    assert speaking_time("你好,我是一个机器人。很高兴见到你") == pytest.approx(3.6, abs=0.5)
    assert speaking_time("Hello, I am a robot. Pleased to meet you.") == pytest.approx(2.9, abs=0.5)
