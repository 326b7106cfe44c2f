"""The gains file of a study."""

import yaml

from drake_affetto.control.pidf import load_control
from drake_affetto.tuning.gains_file import overlay_text
from drake_affetto.tuning.plan import START_FILE, TunePlan


def test_both_arms_get_the_same_gains():
    names = ["waist_yaw", "right_elbow_flexion", "right_shoulder_flexion"]
    start = load_control(START_FILE).for_joints(names)
    plan = TunePlan(joints=("waist_yaw", "right_elbow_flexion"))
    data = yaml.safe_load(overlay_text(plan, names, start, "heading"))
    assert list(data["gains"]) == [
        "waist_yaw",
        "right_elbow_flexion",
        "left_elbow_flexion",
    ]
    assert (
        data["gains"]["left_elbow_flexion"]
        == data["gains"]["right_elbow_flexion"]
    )
