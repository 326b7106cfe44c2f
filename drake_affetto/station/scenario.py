"""A scenario: everything that a station is built from, as typed YAML."""

import dataclasses
import difflib
from pathlib import Path
from typing import Any

from pydrake.multibody.plant import MultibodyPlantConfig
from pydrake.systems.analysis import SimulatorConfig

from drake_affetto.common.errors import (
    InputError,
    naming,
    require,
    require_choice,
    require_range,
    shown,
)
from drake_affetto.common.fields import file_name
from drake_affetto.common.fingerprint import config_values
from drake_affetto.common.resources import models_dir, resolve
from drake_affetto.common.yaml_config import anchored, read_yaml, typed
from drake_affetto.control.pidf_controller import PidfConfig
from drake_affetto.faults.config import Fault
from drake_affetto.motion.dmp_config import DmpConfig
from drake_affetto.perception.blob import BlobConfig
from drake_affetto.perception.config import (
    CameraConfig,
    MirrorConfig,
    RenderConfig,
)
from drake_affetto.perception.gaze import GazeConfig
from drake_affetto.perception.knowledge import CalibrationError
from drake_affetto.perception.optical_map import PlaneExpectation
from drake_affetto.pneumatics.actuation import PneumaticActuationConfig
from drake_affetto.scene.world import ACTIVE_JOINTS, WorldConfig
from drake_affetto.skill.policy import SkillPolicyConfig
from drake_affetto.sound.config import load_sound_config
from drake_affetto.station.body import Body
from drake_affetto.station.drake_config import (
    check_plant_config,
    check_simulator_config,
)
from drake_affetto.station.drum_region import DrumRegion
from drake_affetto.station.fault_wiring import check_faults
from drake_affetto.station.model_check import check_models_once
from drake_affetto.station.supervision import SupervisionConfig
from drake_affetto.station.variation import VariationConfig
from drake_affetto.teaching.stroke import TeacherConfig

# The fields that are Drake's own structs.
_DRAKES: dict[str, Any] = {
    "simulator_config": SimulatorConfig,
    "plant_config": MultibodyPlantConfig,
}

# A file names here the scenario whose values hold where it is silent.
_EXTENDS = "extends"


@dataclasses.dataclass
class LookConfig:
    """How the robot looks for the drum.

    Attributes:
        mode: "centre": the upper body turns until the marker is centered,
            τ = [y_img, q3*]. "fixed_yaw": it turns to a given yaw,
            τ̂ = [x_img, y_img].
        fixed_yaw: that yaw, rad.
    """

    mode: str = "centre"
    fixed_yaw: float = 0.0

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        require_choice(f"{where}.mode", self.mode, "centre", "fixed_yaw")
        require_range(f"{where}.fixed_yaw", self.fixed_yaw, -1.6, 1.6)


@dataclasses.dataclass
class SkillConfig:
    """The parameterized skill (paper Eqs. 3 and 4).

    Attributes:
        n_hidden: H, hidden neurons of the ELM.
        alpha: λ, ridge of its read-out.
        weight_scale: standard deviation of its input weights and biases.
        input_range: lower and upper limit of each task parameter, by which
            inputs are scaled; one pair each.
    """

    n_hidden: int = 50
    alpha: float = 1e-4
    weight_scale: float = 1.0
    input_range: list[list[float]] = dataclasses.field(
        default_factory=lambda: [[0.0, 1.0], [0.0, 1.0]]
    )

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        require_range(f"{where}.n_hidden", self.n_hidden, 1, 10_000)
        require_range(f"{where}.alpha", self.alpha, 0.0, 1e3)
        require_range(f"{where}.weight_scale", self.weight_scale, 1e-3, 1e3)
        require(
            len(self.input_range) == 2
            and all(len(r) == 2 and r[0] < r[1] for r in self.input_range),
            f"{where}.input_range",
            self.input_range,
            "a lower and a greater upper limit for each of 2 task parameters",
        )


@dataclasses.dataclass
class TransferConfig:
    """How the skill is transferred to this scenario's view, by default.

    Attributes:
        mapping: the family of h. "affine": Hτ̂ + c; "similarity": a turn, a
            scale and a shift; "optical": a mirror's plane is learned, and the
            camera is known.
        residual: whether what the map leaves over is learned too, as a smooth
            departure.
        plane: where the optical map expects a mirror.
        errors: how wrongly it knows the camera; drawn once a repeat of a
            study. Nobody measures a camera exactly.
    """

    mapping: str = "affine"
    residual: bool = False
    plane: PlaneExpectation = dataclasses.field(
        default_factory=PlaneExpectation
    )
    errors: CalibrationError = dataclasses.field(
        default_factory=CalibrationError
    )

    def check(self, where: str) -> None:
        """Raises InputError naming the first field that does not fit."""
        known = ("affine", "similarity", "optical")
        require(
            self.mapping in known,
            f"{where}.mapping",
            self.mapping,
            f"one of {', '.join(known)}",
        )
        self.plane.check(f"{where}.plane")
        self.errors.check(f"{where}.errors")


@dataclasses.dataclass(eq=False)
class Scenario:
    """What a station is built from; field names as in Drake's scenarios.

    Two scenarios are equal where all their values are; they can be copied and
    pickled.

    Attributes:
        random_seed: seed of whatever is random in a simulation that is given
            none: a station that is served or watched, or taught by mouse.
            Trials of a study have seeds of their own.
        settling_duration: s, in which the robot comes to rest at its start
            posture before the first trial.
        simulator_config: Drake's own.
        plant_config: Drake's own; its time step is also the actuators'. It
            divides the periods of whatever is sampled: control, camera and
            teacher.
        world: models, the drum's default place, and the robot's posture: of
            active joints the start posture, of others where they are welded.
        active_joints: the joints that move, in the order of every vector; the
            others are welded.
        joint_damping: viscous friction of joints where it is not the model's,
            N m s/rad.
        yaw_joint: the active joint by which the gaze turns (q3).
        drum_region: where trials put the drum.
        camera, mirrors, rendering, blob, gaze: see `perception`.
        look: by turning to the drum, or from a fixed yaw.
        skill, policy: see `skill`.
        transfer: of a skill that was learned in another view.
        dmp: see `motion`.
        control: see `control`.
        pneumatics: see `pneumatics`.
        body: how this robot departs from its model, which its software takes
            it to be; see `station.body`.
        variation: whether the robot varies from trial to trial as the real one
            does; see `variation`.
        sound: YAML file of the drum's voice and of the reward.
        teaching: see `teaching`.
        faults: of the robot and its surroundings in every trial; see `faults`.
        supervisor: who notices them; see `supervision`.
        motion_source: "skill": the robot looks, and moves as its skill says.
            "external": `affetto.desired_state` is an input of the station.
        valve_source: "pidf": the valves are controlled (Eq. 7). "external":
            `affetto.valve_opening` is an input of the station (or
            `affetto.pressure_command` with pressure regulators).
        wire: YAML file of the robot's wire (see `robot.wire`); only where a
            robot is spoken to, or is simulated behind its wire.
        hardware: whether the station drives a robot over that wire, instead of
            simulating one (see `robot.hardware_station`).
    """

    random_seed: int = 0
    settling_duration: float = 2.0
    simulator_config: SimulatorConfig = dataclasses.field(
        default_factory=SimulatorConfig
    )
    plant_config: MultibodyPlantConfig = dataclasses.field(
        default_factory=lambda: MultibodyPlantConfig(
            time_step=0.0025,
            contact_model="point",
            discrete_contact_approximation="lagged",
            use_sampled_output_ports=False,
        )
    )
    world: WorldConfig = dataclasses.field(default_factory=WorldConfig)
    active_joints: list[str] = dataclasses.field(
        default_factory=lambda: list(ACTIVE_JOINTS)
    )
    joint_damping: dict[str, float] = dataclasses.field(default_factory=dict)
    yaw_joint: str = "waist_yaw"
    drum_region: DrumRegion = dataclasses.field(default_factory=DrumRegion)
    camera: CameraConfig = dataclasses.field(default_factory=CameraConfig)
    mirrors: list[MirrorConfig] = dataclasses.field(
        default_factory=lambda: [MirrorConfig()]
    )
    rendering: RenderConfig = dataclasses.field(default_factory=RenderConfig)
    blob: BlobConfig = dataclasses.field(default_factory=BlobConfig)
    gaze: GazeConfig = dataclasses.field(default_factory=GazeConfig)
    look: LookConfig = dataclasses.field(default_factory=LookConfig)
    skill: SkillConfig = dataclasses.field(default_factory=SkillConfig)
    transfer: TransferConfig = dataclasses.field(default_factory=TransferConfig)
    policy: SkillPolicyConfig = dataclasses.field(
        default_factory=SkillPolicyConfig
    )
    dmp: DmpConfig = dataclasses.field(default_factory=DmpConfig)
    control: PidfConfig = dataclasses.field(default_factory=PidfConfig)
    pneumatics: PneumaticActuationConfig = dataclasses.field(
        default_factory=PneumaticActuationConfig
    )
    body: Body = dataclasses.field(default_factory=Body)
    variation: VariationConfig = dataclasses.field(
        default_factory=VariationConfig
    )
    sound: str = file_name("package://drake_affetto/sound.yaml")
    teaching: TeacherConfig = dataclasses.field(default_factory=TeacherConfig)
    faults: list[Fault] = dataclasses.field(default_factory=list)
    supervisor: SupervisionConfig = dataclasses.field(
        default_factory=SupervisionConfig
    )
    motion_source: str = "skill"
    valve_source: str = "pidf"
    wire: str = file_name("")
    hardware: bool = False

    def check(self, where: str = "scenario") -> None:
        """Checks everything that can be checked without building anything.

        Raises:
            InputError: naming the first field that does not fit.
        """
        require_range(f"{where}.random_seed", self.random_seed, 0, 2**31 - 1)
        require_range(
            f"{where}.settling_duration", self.settling_duration, 0.1, 60
        )
        check_plant_config(self.plant_config, f"{where}.plant_config")
        check_simulator_config(
            self.simulator_config, f"{where}.simulator_config"
        )
        require(
            len(set(self.active_joints)) == len(self.active_joints) > 0,
            f"{where}.active_joints",
            self.active_joints,
            "at least one joint, none of them twice",
        )
        require(
            self.yaw_joint in self.active_joints,
            f"{where}.yaw_joint",
            self.yaw_joint,
            f"one of the active joints {', '.join(self.active_joints)}",
        )
        for name, usual in (
            ("motion_source", "skill"),
            ("valve_source", "pidf"),
        ):
            require_choice(
                f"{where}.{name}", getattr(self, name), usual, "external"
            )
        require(
            self.valve_source == "external" or self.pneumatics.mode == "flow",
            f"{where}.pneumatics.mode",
            self.pneumatics.mode,
            "'flow' where the valves are controlled by PIDF (Eq. 7)",
        )
        with naming(f"{where}.sound"):
            load_sound_config(self.sound)
        if self.wire or self.hardware:
            with naming(f"{where}.wire"):
                resolve(self.wire)
        for i, mirror in enumerate(self.mirrors):
            mirror.check(f"{where}.mirrors[{i}]")
        for field in dataclasses.fields(self):
            part: Any = getattr(self, field.name)
            if hasattr(part, "check"):
                part.check(f"{where}.{field.name}")
        check_faults(self, where)
        require(
            bool(self.drum_region.contains(self.world.drum_position)),
            f"{where}.world.drum_position",
            self.world.drum_position,
            f"a place in {where}.drum_region",
        )
        self._check_transfer(where)
        # Last: a rate that is no number above 0 is told as such.
        self._check_periods(where)

    def _check_transfer(self, where: str) -> None:
        """Raises InputError for the optical map where nothing is mirrored."""
        if self.transfer.mapping != "optical":
            return
        mapping = f"{where}.transfer.mapping 'optical'"
        require(
            len(self.mirrors) == 1,
            f"{where}.mirrors",
            [each.frame for each in self.mirrors],
            f"one mirror for {mapping}",
        )
        require(
            self.look.mode == "fixed_yaw",
            f"{where}.look.mode",
            self.look.mode,
            f"'fixed_yaw' for {mapping}",
        )

    # Drake's structs compare by identity and cannot be pickled: their values
    # stand for them.

    def __eq__(self, other: object) -> bool:
        if not isinstance(other, Scenario):
            return NotImplemented
        return bool(config_values(self) == config_values(other))

    __hash__ = None  # type: ignore[assignment]

    def __getstate__(self) -> dict[str, Any]:
        state = dict(vars(self))
        for name in _DRAKES:
            state[name] = config_values(state[name])
        return state

    def __setstate__(self, state: dict[str, Any]) -> None:
        vars(self).update(state)
        for name, kind in _DRAKES.items():
            setattr(self, name, kind(**state[name]))

    def _check_periods(self, where: str) -> None:
        """Raises InputError for a period that is not a number of steps."""
        step = self.plant_config.time_step
        for field, period in (
            ("control.period", self.control.period),
            ("camera.rate", 1.0 / self.camera.rate),
            ("teaching.update_rate", 1.0 / self.teaching.update_rate),
            ("teaching.recording_rate", 1.0 / self.teaching.recording_rate),
        ):
            steps = period / step
            require(
                abs(steps - round(steps)) < 1e-6 * steps,
                f"{where}.plant_config.time_step",
                step,
                f"a divisor of the period of {where}.{field}, {period:g} s",
            )


def scenario_names() -> list[str]:
    """The scenarios that come with the package."""
    return sorted(p.stem for p in (models_dir() / "scenarios").glob("*.yaml"))


def load_scenario(name: str | Path) -> Scenario:
    """Loads a scenario by its name, or from a YAML file of one's own.

    A file may begin with `extends: NAME` (a name or a path); the values of
    that scenario then hold wherever the file is silent.

    Args:
        name: for instance "drumming" or "mirror"; whatever ends in .yaml or
            .yml is a path.

    Raises:
        InputError: if there is no such scenario, it is not YAML, or a field
            is unknown, of the wrong type, out of range, or does not fit the
            models.
    """
    return read_scenario(name)[0]


def read_scenario(name: str | Path) -> tuple[Scenario, list[Path]]:
    """A scenario, and the files that it was read from, its own first.

    Raises:
        InputError: as `load_scenario`.
    """
    path = find_scenario(name)
    files: list[Path] = []
    scenario = _load(path, files)
    scenario.check(path.stem)
    check_models_once(scenario, path.stem)
    return scenario, files


def find_scenario(name: str | Path) -> Path:
    """The file of a scenario, see `load_scenario`.

    Raises:
        InputError: if there is no such scenario.
    """
    text = str(name)
    if text.endswith((".yaml", ".yml")):
        path = Path(text)
        if not path.is_file():
            raise InputError(f"no such scenario file: {text}")
        return path
    path = models_dir() / "scenarios" / f"{text}.yaml"
    if not path.is_file() or Path(text).name != text:
        known = scenario_names()
        near = difflib.get_close_matches(text, known, n=1)
        hint = f"did you mean {near[0]!r}? " if near else ""
        raise InputError(
            f"no scenario {shown(text)}; {hint}known are {', '.join(known)}"
        )
    return path


def _load(path: Path, files: list[Path]) -> Scenario:
    """Reads a scenario; adds its file, and those it extends, to `files`."""
    files.append(path)
    path = path.resolve()
    if path in (each.resolve() for each in files[:-1]):
        raise InputError(f"{path} extends itself")
    data = read_yaml(path)
    base = data.pop(_EXTENDS, None)
    defaults = None
    if base is not None:
        require(
            isinstance(base, str),
            f"{path.stem}.{_EXTENDS}",
            base,
            "the name of a scenario",
        )
        if base.endswith((".yaml", ".yml")):
            base = path.parent / base
        with naming(f"{path.stem}.{_EXTENDS}"):
            found = find_scenario(base)
        defaults = _load(found, files)
    data = anchored(data, Scenario, path.parent)
    return typed(Scenario, data, where=path.stem, defaults=defaults)
