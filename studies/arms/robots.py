"""Arms of the package example-robot-data that are studied, with the names used in their files."""

from pathlib import Path
from typing import NamedTuple

from affordance.robots.importer import ImportOptions

_ROBOTS = "cmeel.prefix/share/example-robot-data/robots"


class Robot(NamedTuple):
    """Arm of the package."""

    name: str  # name of the arm in the study
    file: str  # path of its file within the folder of robots
    tip: str  # name of the link or frame that holds objects
    required: bool = True  # true if all four experiments must run on the arm; other arms may be refused with a reason
    up: str = "z"  # axis of the root link that points up

    @property
    def options(self) -> ImportOptions:
        """Options of its import."""
        return ImportOptions(self.tip, up=self.up)


ROBOTS = (
    Robot("panda", "panda_description/urdf/panda.urdf", "panda_hand_tcp"),
    Robot("ur5", "ur_description/urdf/ur5_robot.urdf", "tool0"),
    Robot("ur10", "ur_description/urdf/ur10_robot.urdf", "tool0"),
    Robot("xarm7", "xarm_description/urdf/xarm7.urdf", "link_eef"),
    Robot("baxter_right", "baxter_description/urdf/baxter.urdf", "right_gripper"),
    Robot("baxter_left", "baxter_description/urdf/baxter.urdf", "left_gripper"),
    Robot("z1", "z1_description/urdf/z1.urdf", "gripperStator"),
    Robot("talos", "talos_data/robots/talos_full_v2.urdf", "gripper_left_base_link"),
    Robot("kinova", "kinova_description/robots/kinova.urdf", "j2s6s200_end_effector"),
    Robot(
        "human", "human_description/robots/human.urdf", "right_hand"
    ),  # in the file y is up; with z up the robot would lie down, and upright it cannot follow its path
    Robot("ur3", "ur_description/urdf/ur3_robot.urdf", "tool0", required=False),
    Robot("tiago", "tiago_description/robots/tiago.urdf", "arm_tool_link", required=False),
    Robot("g1", "g1_description/urdf/g1_29dof_rev_1_0.urdf", "left_rubber_hand", required=False),
    Robot("icub", "icub_description/robots/icub.urdf", "l_hand", required=False),
    Robot("pr2", "pr2_description/urdf/pr2.urdf", "r_gripper_tool_frame", required=False),
    Robot("romeo", "romeo_description/urdf/romeo.urdf", "l_wrist", required=False),
    Robot("centauro", "centauro_description/urdf/centauro.urdf", "arm1_8", required=False),
    Robot("so101", "so_arm_description/urdf/so101.urdf", "gripper_frame_link", required=False),
    Robot(
        "anymal-kinova",
        "anymal_b_simple_description/robots/anymal-kinova.urdf",
        "j2s6s200_end_effector",
        required=False,
    ),
    Robot("tiago_pro", "tiago_pro_description/robots/tiago_pro.urdf", "arm_right_tool_link", required=False),
)


def find_folder(folder: Path) -> Path:
    """Returns the folder of robots in the package's folder, or the given folder if it is that already."""
    return folder / _ROBOTS if (folder / _ROBOTS).is_dir() else folder
