"""Programs of the manual's examples, run by the real worker: types, enumerations and calls of many groups."""

from __future__ import annotations

from collections.abc import Callable, Coroutine
from typing import Any

import pytest

from roboglot.model.components.interaction.light import Colour, Light, LightEffect
from roboglot.model.robot import Robot
from tests.protocols.visual.front_end import FrontEnd

Connect = Callable[..., Coroutine[Any, Any, FrontEnd]]

SHOW = """
sequ = MotionSequence()
sequ.name = 'test_sequ'
gait_meta = MotionSequenceGait()
gait_meta.right_forefoot = 1
gait_meta.duration = 1
sequ.gait_list.push_back(gait_meta)
gait_meta.right_forefoot = 0
sequ.gait_list.push_back(gait_meta)
pace_meta = MotionSequencePace()
pace_meta.twist.linear.x = 0.000000
pace_meta.centroid.position.z = 0.020000
pace_meta.weight.linear.x = 50.000000
pace_meta.right_forefoot.w = 0.030000
pace_meta.friction_coefficient = 0.400000
pace_meta.landing_gain = 1.500000
pace_meta.use_mpc_track = 0
pace_meta.duration = 300
sequ.pace_list.push_back(pace_meta)
cyberdog.motion.go_straight(0.4, 1.0)
print(sequ.gait_list.size(), cyberdog.motion.run_sequence(sequ).response.code)
print(cyberdog.led.play_rgb(LedConstraint.target_head, LedConstraint.effect_line_on, 9, 8, 7).response.code)
print(cyberdog.motion.jump3d_left90deg().state.code == StateCode.success)
print(len(cyberdog.tof.get_data().head.left_head.data), cyberdog.audio.get_volume().response.volume >= 0)
words = cyberdog.train.get_training_words_set()
print(words.dictionary.has_key('终止任务'), words.response.training_set.front().type)
print(GestureType.thumb_up, SkeletonType.plank, cyberdog.gesture.turn_on_recognition(30).response.code)
print(cyberdog.personnel.face_recognized([], False, 30).response.empty())
choreographer.push_up(60, 2)
dancer.dance()
cyberdog.task.block('last')
cyberdog.motion.go_straight(0.1, 0.3)
"""


@pytest.mark.slow
@pytest.mark.world("playground", body="cyberdog2")
async def test_a_show(connect: Connect, robot: Robot) -> None:
    app = await connect(robot)
    light = robot[Light]
    before = light.state("head")
    await app.start("show", SHOW)
    await app.until(lambda: light.state("head").colour == Colour(9, 8, 7))
    await app.ends("show", pace=0.2)
    assert await app.printed("show") == [
        "2 0", "0", "True", "64 True", "True vp_task", "9 5 0", "True",
    ]  # fmt: skip
    assert (light.state("head").colour, light.state("head").effect) == (before.colour, LightEffect.OFF)
