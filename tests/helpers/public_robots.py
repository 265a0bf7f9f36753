"""Arms of the package example-robot-data, with the names used in their files."""

from pathlib import Path
from typing import NamedTuple

from affordance.extensions.robots.importer import ImportOptions

_ROBOTS = "cmeel.prefix/share/example-robot-data/robots"


class PublicRobot(NamedTuple):
    """Arm of the package."""

    name: str
    file: str  # path of its file within the folder of robots
    tip: str  # name of the link or frame that holds objects
    up: str = "z"  # axis of the root link that points up

    @property
    def options(self) -> ImportOptions:
        """Options of its import."""
        return ImportOptions(self.tip, up=self.up)


ROBOTS = (
    PublicRobot("panda", "panda_description/urdf/panda.urdf", "panda_hand_tcp"),
    PublicRobot("ur5", "ur_description/urdf/ur5_robot.urdf", "tool0"),
    PublicRobot("ur10", "ur_description/urdf/ur10_robot.urdf", "tool0"),
    PublicRobot("xarm7", "xarm_description/urdf/xarm7.urdf", "link_eef"),
    PublicRobot("baxter_right", "baxter_description/urdf/baxter.urdf", "right_gripper"),
    PublicRobot("baxter_left", "baxter_description/urdf/baxter.urdf", "left_gripper"),
    PublicRobot("z1", "z1_description/urdf/z1.urdf", "gripperStator"),
    PublicRobot("talos", "talos_data/robots/talos_full_v2.urdf", "gripper_left_base_link"),
    PublicRobot("kinova", "kinova_description/robots/kinova.urdf", "j2s6s200_end_effector"),
    # In the file y is up; with z up the robot would lie down, and upright it cannot follow its path.
    PublicRobot("human", "human_description/robots/human.urdf", "right_hand"),
    PublicRobot("ur3", "ur_description/urdf/ur3_robot.urdf", "tool0"),
    PublicRobot("tiago", "tiago_description/robots/tiago.urdf", "arm_tool_link"),
    PublicRobot("g1", "g1_description/urdf/g1_29dof_rev_1_0.urdf", "left_rubber_hand"),
    PublicRobot("icub", "icub_description/robots/icub.urdf", "l_hand"),
    PublicRobot("pr2", "pr2_description/urdf/pr2.urdf", "r_gripper_tool_frame"),
    PublicRobot("romeo", "romeo_description/urdf/romeo.urdf", "l_wrist"),
    PublicRobot("centauro", "centauro_description/urdf/centauro.urdf", "arm1_8"),
    PublicRobot("so101", "so_arm_description/urdf/so101.urdf", "gripper_frame_link"),
    PublicRobot("anymal-kinova", "anymal_b_simple_description/robots/anymal-kinova.urdf", "j2s6s200_end_effector"),
    PublicRobot("tiago_pro", "tiago_pro_description/robots/tiago_pro.urdf", "arm_right_tool_link"),
)


def find_folder(folder: Path) -> Path:
    """Returns the folder of robots in the package's folder, or the given folder if it is that already."""
    return folder / _ROBOTS if (folder / _ROBOTS).is_dir() else folder
