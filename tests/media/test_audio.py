"""Opus packets and WAV files."""

from __future__ import annotations

import io
import wave

import av
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from roboglot.media.opus import OpusEncoder
from roboglot.media.wav import read_wav
from roboglot.model.components.sensing.microphone import BLOCK
from roboglot.model.sound import SAMPLE_RATE, SECONDS_MAX, SoundBlock, claps, tone


def packets(sound, **options):
    encoder = OpusEncoder(**options)
    count = len(sound.samples) // BLOCK
    return [encoder.encode(SoundBlock(i / 50, sound.samples[i * BLOCK : (i + 1) * BLOCK])) for i in range(count)]


def heard(packets_):
    """Each packet alone handed to a decoder, as RoboMaster's clients do."""
    decoder = av.AudioCodecContext.create("opus", "r")
    decoder.sample_rate, decoder.layout = SAMPLE_RATE, "mono"
    parts = []
    for packet in packets_:
        frames = decoder.decode(av.Packet(packet.data))
        assert [frame.samples for frame in frames] == [BLOCK]
        parts.append(frames[0].to_ndarray()[0])
    return np.concatenate(parts)


def test_one_packet_block_and_the_tone_comes_back():
    sound = tone(440, 1.0)
    wave_form = heard(packets(sound))
    assert len(wave_form) == SAMPLE_RATE
    middle = wave_form[10_000:40_000]
    peak = np.fft.rfftfreq(len(middle), 1 / SAMPLE_RATE)[np.abs(np.fft.rfft(middle)).argmax()]
    assert peak == pytest.approx(440, abs=3)
    assert np.abs(middle).max() == pytest.approx(0.3, rel=0.15)


def test_without_vbr_every_packet_has_one_size():
    sizes = {len(packet.data) for packet in packets(claps(3), vbr=False)}
    assert sizes == {80}  # 32 kbit/s
    assert len({len(packet.data) for packet in packets(claps(3), vbr=True)}) > 1


def test_another_block_length_is_refused():
    with pytest.raises(ValueError, match="960"):
        OpusEncoder().encode(SoundBlock(0.0, np.zeros(100, np.int16)))


def wav(samples, rate=SAMPLE_RATE, channels=1, width=2):
    file = io.BytesIO()
    with wave.open(file, "wb") as writer:
        writer.setnchannels(channels)
        writer.setsampwidth(width)
        writer.setframerate(rate)
        writer.writeframes(samples)
    return io.BytesIO(file.getvalue())


def test_a_plain_file_is_read_as_it_is():
    samples = tone(500, 0.1).samples
    assert (read_wav(wav(samples.tobytes())).samples == samples).all()


@pytest.mark.parametrize(
    ("rate", "channels", "width"), [(22050, 1, 2), (44100, 2, 2), (96000, 1, 4), (8000, 1, 1), (16000, 2, 3)]
)
def test_rates_channels_and_widths(rate, channels, width):
    time = np.arange(rate) / rate
    numbers = np.repeat(0.5 * np.sin(2 * np.pi * 300 * time), channels)
    match width:
        case 1:
            data = np.rint(numbers * 127 + 128).astype(np.uint8).tobytes()
        case 3:
            whole = np.rint(numbers * 8_388_607).astype("<i4").view(np.uint8).reshape(-1, 4)
            data = whole[:, :3].tobytes()
        case _:
            data = np.rint(numbers * (2 ** (8 * width - 1) - 1)).astype(f"<i{width}").tobytes()
    sound = read_wav(wav(data, rate, channels, width))
    assert sound.seconds == pytest.approx(1.0, abs=0.001)
    expected = 0.5 * 32767 * np.sin(2 * np.pi * 300 * np.arange(len(sound.samples)) / SAMPLE_RATE)
    assert np.abs(sound.samples - expected)[:-10].max() < 600  # the last sample has no next one


@pytest.mark.slow
def test_too_long_recordings_are_refused():
    with pytest.raises(ValueError, match="more than"):
        read_wav(wav(bytes(int((SECONDS_MAX + 1) * 8000)), rate=8000, width=1))


@given(st.binary(max_size=200))
def test_garbage_is_refused_in_plain_words(junk):
    with pytest.raises(ValueError, match="sound"):
        read_wav(io.BytesIO(junk))


@given(st.integers(0, 60), st.binary(min_size=1, max_size=8))
def test_damaged_file_gives_sound_or_a_plain_refusal(at, junk):
    data = bytearray(wav(tone(300, 0.01).samples.tobytes()).getvalue())
    data[at : at + len(junk)] = junk
    try:
        sound = read_wav(io.BytesIO(bytes(data)))
    except ValueError:
        return
    assert sound.seconds <= SECONDS_MAX
