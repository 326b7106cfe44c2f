"""What the drum feels: contact forces that will become its sound."""

from collections.abc import Sequence
import math
from typing import Any

import numpy as np
from pydrake.common.value import Value
from pydrake.math import RigidTransform
from pydrake.multibody.plant import ContactResults, MultibodyPlant
from pydrake.multibody.tree import BodyIndex
from pydrake.systems.framework import (
    BasicVector,
    Context,
    DiagramBuilder,
    InputPort,
    LeafSystem,
)

from drake_affetto.common.errors import require
from drake_affetto.common.systems import connect, input_port, output_port


class DrumMicrophone(LeafSystem):
    """Picks the contacts on drum and table out of a plant's contact results.

    It hears nothing itself: its outputs are the forces that excite the drum,
    sampled at the plant's step, from which
    `drake_affetto.sound.voice.DrumVoice` makes the recording.

    .. pydrake_system::

        name: DrumMicrophone
        input_ports:
        - contact_results
        - body_poses
        output_ports:
        - contact_force
        - knock_force

    Input ports:

    - `contact_results`: abstract `ContactResults` of the plant (point
      contact; hydroelastic surfaces are not listened to).
    - `body_poses`: abstract `list[RigidTransform]`, the plant's port of the
      same name; read only while something touches the head.

    Output ports:

    - `contact_force` (2): force on the head along its inward normal, N,
      never negative, and distance of that force's center from the center of
      the head, m. Both zero without contact.
    - `knock_force` (2): sum of the magnitudes of the contact forces on the
      shell [N] and on the table, N.

    There is no state. With the plant's default of sampled output ports the
    forces are those of the plant's last step.
    """

    def __init__(
        self,
        *,
        head: BodyIndex,
        shell: Sequence[BodyIndex] = (),
        table: Sequence[BodyIndex] = (),
        X_BH: RigidTransform | None = None,
    ):
        """Listens to these bodies of one plant.

        Args:
            head: the body whose collision geometry is the drum's head.
            shell: bodies that count as the drum's shell or rim.
            table: bodies that count as the table.
            X_BH: pose of the head's frame H in the body `head`; Ho is the
                center of the membrane and Hz points out of the drum.

        Raises:
            InputError: if one body is given two parts.
        """
        super().__init__()
        shell_indices = frozenset(int(body) for body in shell)
        table_indices = frozenset(int(body) for body in table)
        self._head = int(head)
        for field, values, others in (
            ("shell", shell_indices, {self._head}),
            ("table", table_indices, {self._head} | shell_indices),
        ):
            require(
                values.isdisjoint(others),
                field,
                sorted(values),
                "bodies that have no other part in the sound",
            )
        self._shell = shell_indices
        self._table = table_indices
        self._drum = shell_indices | {self._head}
        self._still = self._drum | self._table
        self._X_BH = RigidTransform() if X_BH is None else X_BH
        self._contact_results_port: InputPort = self.DeclareAbstractInputPort(
            "contact_results", Value(ContactResults())
        )
        self._body_poses_port: InputPort = self.DeclareAbstractInputPort(
            "body_poses", Value([RigidTransform()])
        )
        contacts = self.input_port_ticket(
            self._contact_results_port.get_index()
        )
        poses = self.input_port_ticket(self._body_poses_port.get_index())
        self.DeclareVectorOutputPort(
            "contact_force", 2, self._calc_contact_force, {contacts, poses}
        )
        self.DeclareVectorOutputPort(
            "knock_force", 2, self._calc_knock_force, {contacts}
        )

    @staticmethod
    def AddToBuilder(
        *,
        builder: DiagramBuilder,
        plant: MultibodyPlant,
        drum_model: str = "drum",
        table_model: str = "table",
        name: str = "drum_microphone",
    ) -> "DrumMicrophone":
        """Adds a microphone at the drum of `plant` and wires its inputs.

        The drum model has the links `shell` and `head` and a frame
        `head_center` on the head; every link of the table model is table.

        Args:
            drum_model: Name of the drum's model.
            table_model: Name of the table's model.
        """
        drum = plant.GetModelInstanceByName(drum_model)
        head = plant.GetBodyByName("head", drum)
        head_center = plant.GetFrameByName("head_center", drum)
        require(
            head_center.body().index() == head.index(),
            "head_center",
            head_center.body().name(),
            "a frame on the link 'head'",
        )
        table: Sequence[BodyIndex] = ()
        if plant.HasModelInstanceNamed(table_model):
            table = plant.GetBodyIndices(
                plant.GetModelInstanceByName(table_model)
            )
        microphone = DrumMicrophone(
            head=head.index(),
            shell=[
                index
                for index in plant.GetBodyIndices(drum)
                if index != head.index()
            ],
            table=table,
            X_BH=head_center.GetFixedPoseInBodyFrame(),
        )
        builder.AddNamedSystem(name, microphone)
        connect(builder, plant, microphone, "contact_results", "body_poses")
        return microphone

    get_contact_results_input_port = input_port("The plant's contact results.")
    get_body_poses_input_port = input_port("The plant's body poses.")
    get_contact_force_output_port = output_port(
        "Normal force on the head [N] and its distance from the center, m."
    )
    get_knock_force_output_port = output_port(
        "Force on the shell and force on the table, N."
    )

    def _calc_contact_force(self, context: Context, output: BasicVector):
        result = output.get_mutable_value()
        result[:] = 0.0
        contacts: Any = self._contact_results_port.Eval(context)
        count = contacts.num_point_pair_contacts()
        if not count:
            return
        head = self._head
        drum = self._drum
        pushes = []
        for i in range(count):
            info = contacts.point_pair_contact_info(i)
            body_A, body_B = int(info.bodyA_index()), int(info.bodyB_index())
            if head == body_B and body_A not in drum:
                pushes.append((1.0, info))
            elif head == body_A and body_B not in drum:
                pushes.append((-1.0, info))
        if not pushes:
            return
        # Reading the poses copies all of them: only now that it matters.
        poses: Any = self._body_poses_port.Eval(context)
        X_HW = poses[head].multiply(self._X_BH).inverse()
        R_HW = X_HW.rotation()
        total = x = y = 0.0
        for sign, info in pushes:
            # Friction along the head, and what pushes its edge sideways, do
            # not move the membrane.
            push = -sign * R_HW.multiply(info.contact_force()).item(2)
            if push <= 0.0:
                continue
            p_HC = X_HW.multiply(info.contact_point())
            total += push
            x += push * p_HC.item(0)
            y += push * p_HC.item(1)
        if total > 0.0:
            result[0] = total
            result[1] = math.hypot(x, y) / total

    def _calc_knock_force(self, context: Context, output: BasicVector):
        result = output.get_mutable_value()
        result[:] = 0.0
        contacts: Any = self._contact_results_port.Eval(context)
        for i in range(contacts.num_point_pair_contacts()):
            info = contacts.point_pair_contact_info(i)
            bodies = int(info.bodyA_index()), int(info.bodyB_index())
            if all(body in self._still for body in bodies):
                # The drum stands on the table: no knock.
                continue
            for part, heard in enumerate((self._shell, self._table)):
                if bodies[0] in heard or bodies[1] in heard:
                    result[part] += float(np.linalg.norm(info.contact_force()))
