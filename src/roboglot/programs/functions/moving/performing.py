"""cyberdog.motion: all motions without parameters, in one table, and walking on a leash (4.4.04)."""

from __future__ import annotations

from roboglot.model.components.motion.gaits import Gait
from roboglot.model.components.motion.legs import FootLift, Legs, Posture
from roboglot.model.components.motion.motions import Motion
from roboglot.programs.functions.moving.limits import outside
from roboglot.programs.functions.moving.outcomes import result
from roboglot.programs.functions.session import Session
from roboglot.programs.functions.table import ABILITIES
from roboglot.programs.worker.values import Record

LEASH = 125

# The manual's name, the firmware's number (response.motion_id) and the motion.
RESULT_MOTIONS: tuple[tuple[str, int, Motion], ...] = (
    ("back_flip", 121, Motion.BACK_FLIP),
    ("front_flip", 122, Motion.FRONT_FLIP),
    ("bow", 123, Motion.BOW),
    ("roll_left", 124, Motion.ROLL_LEFT),
    ("jump_stair", 126, Motion.JUMP_STAIR),
    ("right_somersault", 127, Motion.FLIP_RIGHT),
    ("left_somersault", 128, Motion.FLIP_LEFT),
    ("run_and_jump_front_flip", 129, Motion.RUN_FRONT_FLIP),
    ("jump3d_left90deg", 130, Motion.JUMP_LEFT_TURN),
    ("jump3d_right90deg", 131, Motion.JUMP_RIGHT_TURN),
    ("jump3d_forward60cm", 132, Motion.JUMP_FORWARD_60),
    ("jump3d_forward30cm", 133, Motion.JUMP_FORWARD_30),
    ("jump3d_left20cm", 134, Motion.JUMP_LEFT_20),
    ("jump3d_right20cm", 135, Motion.JUMP_RIGHT_20),
    ("jump3d_up30cm", 136, Motion.JUMP_UP_30),
    ("jump3d_down_stair", 137, Motion.JUMP_DOWN_STAIR),
    ("roll_right", 138, Motion.ROLL_RIGHT),
    ("dance_collection", 140, Motion.DANCE_COLLECTION),
    ("hold_left_hand", 141, Motion.SHAKE_LEFT_HAND),
    ("hold_right_hand", 142, Motion.SHAKE_RIGHT_HAND),
    ("sit_down", 143, Motion.SIT_DOWN),
    ("butt_circle", 144, Motion.HIP_CIRCLE),
    ("head_circle", 145, Motion.HEAD_CIRCLE),
    ("stretch_the_body", 146, Motion.STRETCH),
    ("shake_ass_left", 148, Motion.WAG_LEFT),
    ("shake_ass_right", 149, Motion.WAG_RIGHT),
    ("shake_ass_from_side_to_side", 150, Motion.WAG),
    ("ballet", 151, Motion.BALLET),
    ("space_walk", 152, Motion.MOONWALK),
    ("front_leg_jumping", 153, Motion.JUMPING_JACK_FRONT),
    ("hind_leg_jumping", 154, Motion.JUMPING_JACK_REAR),
    ("lift_the_left_leg_and_nod", 155, Motion.LIFT_LEFT_AND_NOD),
    ("lift_the_right_leg_and_nod", 156, Motion.LIFT_RIGHT_AND_NOD),
    ("left_front_right_back_legs_apart", 157, Motion.SPREAD_LEFT_FRONT),
    ("right_front_left_back_legs_apart", 158, Motion.SPREAD_RIGHT_FRONT),
    ("walk_nodding", 159, Motion.WALK_AND_NOD),
    ("walking_with_divergence_and_adduction_alternately", 160, Motion.WALK_SPREADING),
    ("nodding_in_place", 161, Motion.STEP_AND_NOD),
    ("front_legs_jump_back_and_forth", 162, Motion.FRONT_LEGS_JUMP),
    ("hind_legs_jump_back_and_forth", 163, Motion.REAR_LEGS_JUMP),
    ("alternately_front_leg_lift", 164, Motion.LIFT_FRONT_LEGS),
    ("alternately_hind_leg_lift", 165, Motion.LIFT_REAR_LEGS),
    ("jump_collection", 166, Motion.JUMP_COLLECTION),
    ("stretching_left_and_right", 167, Motion.STEP_STRETCHING),
    ("jump_forward_and_backward", 168, Motion.JUMP_SWINGING),
    ("step_left_and_right", 169, Motion.STEP_SWINGING),
    ("right_leg_back_and_forth_stepping", 170, Motion.STEP_RIGHT_LEG),
    ("left_leg_back_and_forth_stepping", 171, Motion.STEP_LEFT_LEG),
    ("squat_down_on_all_fours", 173, Motion.SQUAT),
    ("push_ups", 174, Motion.PUSH_UP),
    ("bow_to_each_other", 175, Motion.BOW_AND_HEART),
)


class LeashWalk:
    """Walking on a leash, until the program ends."""

    def __init__(self, session: Session) -> None:
        self._legs = session.robot[Legs]

    def close(self) -> None:
        """Restore the normal gait, unless the gait was changed meanwhile."""
        if self._legs.gait is Gait.TROT_PASSIVE:
            self._legs.walk(None)


def _declare(name: str, number: int, motion: Motion) -> None:
    @ABILITIES.on(f"cyberdog.motion.{name}", needs=(Legs,))
    async def perform(session: Session) -> Record:
        """Perform it to its end; a robot that cannot begin it as it stands, sits or lies refuses (3003)."""

        async def do() -> None:
            await session.complete(session.robot[Legs].perform(motion, source=session.source))

        return await result(session, number, do())

    perform.__doc__ = f"Perform the motion {motion.value!r} to its end; refused (3003) where it cannot begin."


for _motion in RESULT_MOTIONS:
    _declare(*_motion)


@ABILITIES.on("cyberdog.motion.walk_the_dog", needs=(Legs,))
async def walk_the_dog(session: Session, front_leg_lift: float = 0.03, back_leg_lift: float = 0.03) -> Record:
    """Stand up if necessary, then go where a person pulls, with this lift of the feet (m).

    Returns at once; lasts until the robot gets another motion, or the program ends.
    """
    wrong = outside(front_leg_lift=front_leg_lift, back_leg_lift=back_leg_lift)

    async def do() -> None:
        legs = session.robot[Legs]
        if legs.posture is not Posture.STANDING:
            await session.complete(legs.stand(source=session.source))
        legs.walk(Gait.TROT_PASSIVE, FootLift(front_leg_lift, back_leg_lift))
        session.part(LeashWalk)

    return await result(session, LEASH, do(), wrong)
