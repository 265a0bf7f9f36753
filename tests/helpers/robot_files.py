"""Small robots' files for tests: a torso with two arms, a head and a gripper, in all three formats."""

from pathlib import Path

INERTIAL = (
    '<inertial><origin xyz="{x} 0 0.01" rpy="0.1 0.2 0.3"/><mass value="{m}"/>'
    '<inertia ixx="0.004" iyy="0.005" izz="0.006" ixy="1e-4" ixz="-2e-4" iyz="3e-4"/></inertial>'
)
MESH = '<geometry><mesh filename="package://nowhere/meshes/{name}.stl"/></geometry>'


def link(name: str, mass: float = 1.0, x: float = 0.1, *, drawn: bool = True) -> str:
    """A link of a URDF, with a mesh that is nowhere."""
    shape = f"<visual>{MESH}<material name='grey'/></visual><collision>{MESH}</collision>".format(name=name)
    return f'<link name="{name}">{INERTIAL.format(m=mass, x=x)}{shape if drawn else ""}</link>'


def joint(
    name: str,
    parent: str,
    child: str,
    *,
    kind: str = "revolute",
    axis: str = "0 1 0",
    origin: str = "0.25 0 0.02",
    limit: str = 'lower="-2.5" upper="2.4" velocity="3" effort="40"',
    more: str = "",
) -> str:
    """A joint of a URDF."""
    return (
        f'<joint name="{name}" type="{kind}"><parent link="{parent}"/><child link="{child}"/>'
        f'<origin xyz="{origin}" rpy="0.1 -0.2 0.05"/><axis xyz="{axis}"/><limit {limit}/>{more}</joint>'
    )


def build_urdf(*, changes: dict[str, str] | None = None) -> str:
    """A robot on a floating base whose right arm of four joints ends in a gripper; texts in it can be exchanged.

    It holds every trap that is not an error: meshes that are nowhere, a material given twice, friction, damping,
    mimic, safety controller, transmission, Gazebo's elements, an impossible inertia in the head, a sliding joint
    below the torso, and a neck of one joint.
    """
    parts = [
        '<robot name="two_arms"><material name="grey"><color rgba="0.5 0.5 0.5 1"/></material>',
        '<material name="grey"><color rgba="0.5 0.5 0.5 1"/></material><gazebo/>',
        link("pelvis"),
        link("torso"),
        joint("lift", "pelvis", "torso", kind="prismatic", axis="0 0 1"),
        '<link name="head"><inertial><mass value="-1"/><inertia ixx="1" iyy="1" izz="1"/></inertial></link>',
        joint("neck", "torso", "head", axis="0 0 1"),
    ]
    for side in ("right", "left"):
        parts += [
            *(link(f"{side}_{k}", mass=2.0 / (k + 1)) for k in range(1, 5)),
            joint(f"{side}_j1", "torso", f"{side}_1", axis="0 0 1", origin="0 0.1 0.3"),
            joint(f"{side}_j2", f"{side}_1", f"{side}_2", more='<dynamics damping="0.2" friction="1.5"/>'),
            joint(f"{side}_j3", f"{side}_2", f"{side}_3", more='<safety_controller k_velocity="1"/>'),
            joint(f"{side}_j4", f"{side}_3", f"{side}_4", kind="continuous", axis="1 0.2 0"),
            f'<link name="{side}_tool"/>',
            joint(f"{side}_fixed", f"{side}_4", f"{side}_tool", kind="fixed", origin="0.1 0 0"),
            link(f"{side}_finger", mass=0.05, x=0.02),
            link(f"{side}_thumb", mass=0.04, x=0.02),
            joint(
                f"{side}_grip",
                f"{side}_4",
                f"{side}_finger",
                kind="prismatic",
                limit='lower="0" upper="0.04" effort="5" velocity="1"',
            ),
            joint(
                f"{side}_follow",
                f"{side}_4",
                f"{side}_thumb",
                axis="0 0 1",
                more=f'<mimic joint="{side}_grip" multiplier="5" offset="0.1"/>',
            ),
        ]
    parts.append('<transmission name="t"><joint name="right_j1"/></transmission></robot>')
    text = "".join(parts)
    for old, new in (changes or {}).items():
        assert old in text, old
        text = text.replace(old, new)
    return text


def write_urdf(folder: Path, *, changes: dict[str, str] | None = None) -> Path:
    """Writes it to a file."""
    path = folder / "two_arms.urdf"
    path.write_text(build_urdf(changes=changes))
    return path


SDF = """<sdf version="1.9"><model name="swinger">
<link name="foot"><inertial><mass>5</mass>
<inertia><ixx>0.1</ixx><iyy>0.1</iyy><izz>0.1</izz></inertia></inertial></link>
<link name="upper"><pose relative_to="foot">0 0 0.5 0 0 0.3</pose>
<inertial><pose>0.2 0 0 0.1 0 0</pose><mass>2</mass>
<inertia><ixx>0.01</ixx><iyy>0.02</iyy><izz>0.02</izz></inertia></inertial>
<visual name="v"><geometry><box><size>0.4 0.05 0.05</size></box></geometry></visual>
<collision name="c"><geometry><mesh><uri>model://nowhere/a.stl</uri></mesh></geometry></collision></link>
<link name="lower"><pose relative_to="upper">0.4 0 0 0 0.2 0</pose>
<inertial><mass>1</mass><inertia><ixx>0.01</ixx><iyy>0.02</iyy><izz>0.02</izz></inertia></inertial></link>
<link name="wrist"><pose relative_to="lower">0.3 0 0 0 0 0</pose>
<inertial><mass>0.5</mass><inertia><ixx>0.001</ixx><iyy>0.001</iyy><izz>0.001</izz></inertia></inertial></link>
<joint name="pan" type="revolute"><parent>foot</parent><child>upper</child><axis><xyz>0 0 1</xyz>
<limit><lower>-3</lower><upper>3</upper><velocity>2</velocity><effort>30</effort></limit>
<dynamics><friction>0.7</friction><spring_stiffness>4</spring_stiffness></dynamics></axis></joint>
<joint name="tilt" type="revolute"><pose>0.01 0 0.02 0 0.1 0</pose><parent>upper</parent><child>lower</child>
<axis><xyz>0 1 0</xyz>
<limit><lower>-2</lower><upper>2</upper><velocity>2</velocity><effort>30</effort></limit></axis></joint>
<joint name="bend" type="revolute"><parent>lower</parent><child>wrist</child><axis><xyz>0 1 0</xyz>
<limit><lower>-2</lower><upper>2</upper><velocity>2</velocity><effort>20</effort></limit></axis></joint>
<frame name="grip" attached_to="wrist"><pose>0.1 0 0 0 0 0</pose></frame>
</model></sdf>"""

MJCF = """<mujoco model="reacher"><compiler angle="radian"/>
<default><joint damping="0.1" armature="0.02"/><motor gear="2"/>
<default class="strong"><joint armature="0.05" range="-2 2" frictionloss="0.3"/>
<motor ctrlrange="-10 12" gear="3"/></default></default>
<asset><mesh name="m" file="nowhere.stl"/></asset>
<worldbody><light pos="0 0 3"/><geom type="plane" size="1 1 1"/>
<body name="root" pos="0 0 0.4"><freejoint/><inertial pos="0 0 0" mass="4" diaginertia="0.1 0.1 0.1"/>
<geom type="mesh" mesh="m"/>
<body name="first" pos="0 0 0.1" childclass="strong">
<joint name="a1" axis="0 0 1"/><joint name="a2" axis="0 1 0"/>
<inertial pos="0.1 0 0" mass="1.5" fullinertia="0.01 0.012 0.013 0.001 0 0"/>
<body name="second" pos="0.3 0 0" euler="0.1 0 0.2">
<joint name="a3" axis="0 1 0"/><inertial pos="0.1 0 0" quat="1 0.1 0 0" mass="1" diaginertia="0.01 0.012 0.013"/>
<body name="third" pos="0.25 0 0"><joint name="a4" axis="0 1 0.1" stiffness="3" armature="0.01"/>
<inertial pos="0.05 0 0" mass="0.4" diaginertia="0.001 0.0012 0.0013"/><site name="grip_site" pos="0.1 0 0"/>
</body></body></body></body></worldbody>
<actuator><motor class="strong" joint="a1"/><motor joint="a2" ctrlrange="-9 9"/>
<position joint="a3" forcerange="-8 7"/><motor class="strong" joint="a4"/></actuator>
</mujoco>"""
