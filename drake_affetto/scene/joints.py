"""Joints of any model by their names: what they are and where they stand."""

from collections.abc import Sequence
import dataclasses
import difflib
from typing import Any

import numpy as np
from pydrake.multibody.plant import MultibodyPlant
from pydrake.multibody.tree import ModelInstanceIndex

from drake_affetto.common.errors import InputError, require, shown
from drake_affetto.common.typing import Array


def joint_names(
    plant: MultibodyPlant, model_instance: ModelInstanceIndex
) -> list[str]:
    """The names of the model's joints of one degree of freedom, in order."""
    return [
        plant.get_joint(i).name()
        for i in plant.GetJointIndices(model_instance)
        if plant.get_joint(i).num_velocities() == 1
    ]


def find_joint(
    plant: MultibodyPlant, model_instance: ModelInstanceIndex, name: str
) -> Any:
    """The model's joint `name`.

    Raises:
        InputError: If there is none; the message offers the nearest name.
    """
    if not plant.HasJointNamed(name, model_instance):
        known = joint_names(plant, model_instance)
        near = difflib.get_close_matches(name, known, n=1)
        hint = (
            f"did you mean {near[0]}?"
            if near
            else f"known are {', '.join(known) or 'none'}"
        )
        model = plant.GetModelInstanceName(model_instance)
        raise InputError(f"model {model} has no joint {shown(name)}; {hint}")
    return plant.GetJointByName(name, model_instance)


@dataclasses.dataclass(frozen=True)
class JointSelection:
    """Where n joints stand in their model's state and actuation.

    Attributes:
        model_instance: the model that they belong to.
        names: the joints, in the order of every n-vector.
        lower: (n,) lower limits, rad; of a prismatic joint m.
        upper: (n,) upper limits.
        positions: (n,) indices into the model's q.
        velocities: (n,) indices into the model's v.
        actuators: (n,) indices into the model's actuation input.
        state_matrix: (2n, nq+nv), [q; q̇] of the joints from the model's
            state.
        actuation_matrix: (nu, n), the model's actuation from the joints'
            torques.
    """

    model_instance: ModelInstanceIndex
    names: tuple[str, ...]
    lower: Array
    upper: Array
    positions: Array
    velocities: Array
    actuators: Array
    state_matrix: Array
    actuation_matrix: Array


def select_joints(
    plant: MultibodyPlant,
    names: Sequence[str],
    model_instance: ModelInstanceIndex,
) -> JointSelection:
    """Selects the joints `names` of a model of the finalized `plant`.

    Args:
        model_instance: The model's instance in the plant.

    Raises:
        InputError: For an unknown joint, one named twice, one that has not
            one degree of freedom, or one without an actuator.
    """
    require(
        len(names) > 0 and len(set(names)) == len(names),
        "joints",
        list(names),
        "at least one joint, none of them twice",
    )
    joints = [find_joint(plant, model_instance, name) for name in names]
    # Of an index into the actuation input the joint's: one actuator a joint.
    actuated = [
        int(plant.get_joint_actuator(i).joint().index())
        for i in plant.GetJointActuatorIndices(model_instance)
    ]
    for joint in joints:
        require(
            joint.num_velocities() == 1,
            f"type of joint {joint.name()}",
            joint.type_name(),
            "one with one degree of freedom",
        )
        require(
            int(joint.index()) in actuated,
            f"actuator of joint {joint.name()}",
            None,
            "one in the model: a <transmission> in URDF, in SDF an effort "
            "limit above 0",
        )
    # The instance's own order, found by asking for the numbers 0, 1, 2, ...
    q_order = plant.GetPositionsFromArray(
        model_instance, np.arange(plant.num_positions(), dtype=float)
    ).astype(int)
    v_order = plant.GetVelocitiesFromArray(
        model_instance, np.arange(plant.num_velocities(), dtype=float)
    ).astype(int)
    positions = np.array(
        [int(np.flatnonzero(q_order == j.position_start())[0]) for j in joints]
    )
    velocities = np.array(
        [int(np.flatnonzero(v_order == j.velocity_start())[0]) for j in joints]
    )
    actuators = np.array([actuated.index(int(j.index())) for j in joints])
    n, nq, nv = len(names), len(q_order), len(v_order)
    state_matrix = np.zeros((2 * n, nq + nv))
    state_matrix[np.arange(n), positions] = 1.0
    state_matrix[n + np.arange(n), nq + velocities] = 1.0
    actuation_matrix = np.zeros((len(actuated), n))
    actuation_matrix[actuators, np.arange(n)] = 1.0
    return JointSelection(
        model_instance=model_instance,
        names=tuple(names),
        lower=np.array([j.position_lower_limits()[0] for j in joints]),
        upper=np.array([j.position_upper_limits()[0] for j in joints]),
        positions=positions,
        velocities=velocities,
        actuators=actuators,
        state_matrix=state_matrix,
        actuation_matrix=actuation_matrix,
    )
