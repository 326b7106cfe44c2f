"""Whether the claims hold on robots of other bodies."""

from support import report_data
from support.report_page import make


def test_bodies_stand_beside_the_study_of_one_robot(tmp_path):
    drum = report_data.drum()
    drum["bodies"] = [{"supply": 1.0}] * 3
    page = make(
        tmp_path,
        mirror=report_data.mirror(),
        bodies=report_data.bodies(),
        drum=drum,
    )
    assert {"mirror", "bodies"} <= set(page.sections())
    assert "12 robots, each with other masses" in page.text
    # 1.0, 0.982, ... 0.8: six of them are at least 0.9.
    assert "reached 90 % or more on 6 of 12 bodies" in page.text
    assert "bodies number 6 (89 %), 7 (87 %)" in page.text
    assert "mass: right elbow" in page.text
    assert "-1.00" in page.text
    assert "on 3 of 3 bodies" in page.text


def test_without_bodies_there_is_no_section(tmp_path):
    page = make(tmp_path, mirror=report_data.mirror())
    assert "bodies" not in page.sections()
