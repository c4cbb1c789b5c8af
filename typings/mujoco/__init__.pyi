"""What roboglot uses of MuJoCo, which comes without types: fields of its structs are views into one block of memory."""

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

_Floats = NDArray[np.float64]
_Ints = NDArray[np.int32]

class mjtGeom(int):
    mjGEOM_SPHERE: mjtGeom
    mjGEOM_CAPSULE: mjtGeom
    mjGEOM_CYLINDER: mjtGeom
    mjGEOM_BOX: mjtGeom
    mjGEOM_MESH: mjtGeom

class mjtJoint(int):
    mjJNT_SLIDE: mjtJoint
    mjJNT_HINGE: mjtJoint

class mjtTrn(int):
    mjTRN_JOINT: mjtTrn

class mjtIntegrator(int):
    mjINT_IMPLICITFAST: mjtIntegrator

class mjtEnableBit(int):
    mjENBL_SLEEP: mjtEnableBit

class mjtDisableBit(int):
    mjDSBL_CONTACT: mjtDisableBit

class mjtSleepPolicy(int):
    mjSLEEP_NEVER: mjtSleepPolicy

class MjOption:
    timestep: float
    integrator: int
    gravity: ArrayLike
    iterations: int
    enableflags: int
    disableflags: int

class MjsCompiler:
    degree: bool

class MjsGeom: ...
class MjsJoint: ...
class MjsMesh: ...

class MjsActuator:
    forcelimited: bool
    forcerange: ArrayLike
    def set_to_position(self, kp: float, *, dampratio: float = ...) -> None: ...
    def set_to_velocity(self, kv: float) -> None: ...

class MjsBody:
    pos: ArrayLike
    def add_body(
        self,
        *,
        name: str = ...,
        mocap: bool = ...,
        pos: ArrayLike = ...,
        quat: ArrayLike = ...,
        gravcomp: float = ...,
        sleep: mjtSleepPolicy = ...,
    ) -> MjsBody: ...
    def add_joint(
        self,
        *,
        name: str = ...,
        type: mjtJoint = ...,
        axis: ArrayLike = ...,
        limited: bool = ...,
        range: ArrayLike = ...,
        damping: float = ...,
        ref: float = ...,
    ) -> MjsJoint: ...
    def add_geom(
        self,
        *,
        name: str = ...,
        type: mjtGeom = ...,
        size: ArrayLike = ...,
        pos: ArrayLike = ...,
        quat: ArrayLike = ...,
        meshname: str = ...,
        contype: int = ...,
        conaffinity: int = ...,
        condim: int = ...,
        priority: int = ...,
        friction: ArrayLike = ...,
        mass: float = ...,
        gap: float = ...,
    ) -> MjsGeom: ...

class MjSpec:
    worldbody: MjsBody
    option: MjOption
    compiler: MjsCompiler
    def add_actuator(self, *, name: str, trntype: mjtTrn, target: str) -> MjsActuator: ...
    def add_mesh(self, *, name: str, uservert: Sequence[float]) -> MjsMesh: ...
    def compile(self) -> MjModel: ...

class _Named:
    id: int
    name: str

class _NamedBody(_Named):
    geomadr: _Ints
    mocapid: _Ints

class _NamedJoint(_Named):
    qposadr: _Ints
    dofadr: _Ints

class MjModel:
    opt: MjOption
    ngeom: int
    actuator_biasprm: _Floats
    actuator_forcerange: _Floats
    actuator_gainprm: _Floats
    body_bvhadr: _Ints
    body_conaffinity: _Ints
    body_contype: _Ints
    body_geomadr: _Ints
    body_mocapid: _Ints
    body_rootid: _Ints
    body_subtreemass: _Floats
    bvh_aabb: _Floats
    dof_M0: _Floats
    dof_damping: _Floats
    geom_aabb: _Floats
    geom_bodyid: _Ints
    geom_conaffinity: _Ints
    geom_contype: _Ints
    geom_group: _Ints
    geom_pos: _Floats
    geom_rbound: _Floats
    geom_size: _Floats
    geom_type: _Ints
    jnt_range: _Floats
    jnt_stiffness: _Floats
    qpos_spring: _Floats
    def actuator(self, name: str) -> _Named: ...
    def body(self, name: str) -> _NamedBody: ...
    def geom(self, name: str | int) -> _Named: ...
    def joint(self, name: str) -> _NamedJoint: ...
    def __copy__(self) -> MjModel: ...

class _Contacts:
    dist: _Floats
    geom: _Ints
    pos: _Floats

class MjData:
    actuator_force: _Floats
    contact: _Contacts
    ctrl: _Floats
    geom_xmat: _Floats
    geom_xpos: _Floats
    mocap_pos: _Floats
    mocap_quat: _Floats
    ncon: int
    nefc: int
    qacc: _Floats
    qfrc_applied: _Floats
    qpos: _Floats
    qvel: _Floats
    def __init__(self, model: MjModel) -> None: ...

def mj_forward(model: MjModel, data: MjData) -> None: ...
def mj_kinematics(model: MjModel, data: MjData) -> None: ...
def mj_step(model: MjModel, data: MjData, nstep: int = ...) -> None: ...
def mj_ray(
    model: MjModel,
    data: MjData,
    point: _Floats,
    way: _Floats,
    groups: NDArray[np.uint8] | None,
    static: bool,
    without_body: int,
    found: _Ints | None,
) -> float: ...
def mj_multiRay(
    model: MjModel,
    data: MjData,
    point: _Floats,
    ways: _Floats,
    groups: NDArray[np.uint8] | None,
    static: bool,
    without_body: int,
    found: _Ints,
    distances: _Floats,
    normals: _Floats | None,
    count: int,
    reach: float,
) -> None: ...
