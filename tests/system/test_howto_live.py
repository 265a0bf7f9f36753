"""The loops of the page on one's own node, run with stand-ins for a robot and for ROS 2."""

import re
import sys
import textwrap
from pathlib import Path
from types import ModuleType, SimpleNamespace

import numpy as np
import pytest

from affordance import LiveEvent

PAGE = Path(__file__).parents[2] / "docs" / "howto" / "live.md"
JOINTS = ("shoulder", "elbow")


class Live:
    """Stand-in of an identifier, which keeps its samples and finds 2 kg in each."""

    robot = SimpleNamespace(joint_names=JOINTS)

    def __init__(self):
        self.samples = []

    def add(self, t, q, v, signal):
        """Keeps a sample."""
        self.samples.append((t, np.copy(q).tolist(), None if v is None else np.copy(v).tolist(), list(signal)))
        return [LiveEvent("belief", t, {"mass_kg": 2.0})]


def run(heading, **names):
    """Runs the indented code below a heading of the page."""
    section = re.search(rf"^## {heading}\n(.*?)(?=^## |\Z)", PAGE.read_text(encoding="utf-8"), re.M | re.S)[1]
    code = "".join(line for line in section.splitlines(keepends=True) if line.startswith("    ") or not line.strip())
    exec(compile(textwrap.dedent(code), str(PAGE), "exec"), names)


def test_the_node_of_ros_2_finds_its_joints_by_name(monkeypatch):
    told, live = [], Live()

    class Node:
        """Stand-in of rclpy's."""

        def __init__(self, name):
            self.name = name

        def create_subscription(self, kind, topic, take, qos):
            """Keeps the callback."""
            self.take = take

        def get_logger(self):
            """Returns a logger that keeps its lines."""
            return SimpleNamespace(info=told.append)

    def spin(node):
        stamp = SimpleNamespace(sec=3, nanosec=250_000_000)
        names = ["gripper", *JOINTS[::-1]]
        for velocity in ([9.0, 0.2, 0.1], []):
            message = {"position": [9.0, 2.0, 1.0], "velocity": velocity, "effort": [9.0, 20.0, 10.0]}
            node.take(SimpleNamespace(header=SimpleNamespace(stamp=stamp), name=names, **message))

    modules = {
        "rclpy": {"init": lambda: None, "spin": spin},
        "rclpy.node": {"Node": Node},
        "rclpy.qos": {"qos_profile_sensor_data": None},
        "sensor_msgs": {},
        "sensor_msgs.msg": {"JointState": None},
    }
    for name, content in modules.items():
        module = ModuleType(name)
        vars(module).update(content)
        monkeypatch.setitem(sys.modules, name, module)
    run("A node of ROS 2", live=live)
    assert live.samples == [(3.25, [1.0, 2.0], v, [10.0, 20.0]) for v in ([0.1, 0.2], None)]
    assert told == ["belief: 2.0"] * 2


def test_the_loop_of_lerobot_gives_radians_and_currents(capsys):
    live = Live()
    observations = iter([{f"{name}.pos": 90.0, f"{name}.current": 7.0} for name in JOINTS])
    observation = {key: value for each in observations for key, value in each.items()}
    seen = iter([observation] * 3)
    with pytest.raises(StopIteration):
        run("A loop of LeRobot", live=live, names=JOINTS, robot=SimpleNamespace(get_observation=lambda: next(seen)))
    assert len(live.samples) == 3
    t, q, v, current = live.samples[-1]
    assert 0.0 < t < 60.0
    np.testing.assert_allclose(q, np.pi / 2.0)
    assert (v, current) == (None, [7.0, 7.0])
    assert capsys.readouterr().out.split("\n")[0] == "belief 2.0"


def test_the_loop_of_mujoco_gives_its_motors_torques(capsys):
    mujoco = pytest.importorskip("mujoco")
    model = mujoco.MjModel.from_xml_string(
        "<mujoco><worldbody><body><joint name='j' axis='0 1 0'/><geom size='.05' pos='.2 0 0'/></body></worldbody>"
        "<actuator><motor joint='j'/></actuator></mujoco>"
    )
    live = Live()
    names = {"mujoco": mujoco, "model": model, "data": mujoco.MjData(model), "n": 1}
    run("A simulation in MuJoCo", live=live, controller=lambda t: 0.5 * np.sin(t), **names)
    times = np.array([each[0] for each in live.samples])
    np.testing.assert_allclose(np.diff(times), 4.0 * model.opt.timestep)
    torques = np.array([each[3] for each in live.samples])[:, 0]
    np.testing.assert_allclose(torques, 0.5 * np.sin(times - model.opt.timestep), atol=1e-9)
    assert len(capsys.readouterr().out.splitlines()) == len(live.samples) == 5000
