"""The gains of a study as a file that a scenario includes."""

from collections.abc import Sequence

import yaml

from drake_affetto.control.pidf import PidfGains
from drake_affetto.tuning.plan import GAINS, TunePlan


def contralateral(joint: str) -> str | None:
    """The same joint of the other side of the body, or None."""
    for side, other in (("right_", "left_"), ("left_", "right_")):
        if joint.startswith(side):
            return other + joint.removeprefix(side)
    return None


def overlay_text(
    plan: TunePlan, names: Sequence[str], gains: PidfGains, heading: str
) -> str:
    """An overlay of `ControlParameters` with the gains that were searched.

    Both arms get the same gains: the contralateral joints too, unless they
    were searched themselves.

    Args:
        plan: Plan of the study.
        names: Names of the n joints of `gains`.
        gains: Gains of n joints.
        heading: Comment at the top of the file.
    """
    rows: dict[str, list[str]] = {}
    array = gains.to_array()
    for i, joint in enumerate(names):
        if joint in plan.joints:
            rows[joint] = [f"{value:.3e}" for value in array[:, i]]
    for joint in list(rows):
        other = contralateral(joint)
        if other is not None and other not in rows:
            rows[other] = rows[joint]
    lines = [f"# {line}".rstrip() for line in heading.splitlines()]
    lines.append("gains:")
    for joint, row in rows.items():
        pairs = ", ".join(f"{g}: {v}" for g, v in zip(GAINS, row, strict=True))
        lines.append(f"  {joint}: {{{pairs}}}")
    text = "\n".join(lines) + "\n"
    # The text is put together here, so it is read back.
    assert set(yaml.safe_load(text)["gains"]) == set(rows)
    return text


def rounded_gains(gains: PidfGains) -> PidfGains:
    """The gains, rounded as `overlay_text` writes them."""
    return PidfGains.from_array(
        [[float(f"{v:.3e}") for v in row] for row in gains.to_array()]
    )
