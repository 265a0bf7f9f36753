"""Files of a folder of models that the program reads."""

from affordance.files.model_files import list_arm_files, list_model_files


def list_names(paths, folder):
    return [str(path.relative_to(folder)) for path in paths]


def test_arm_is_its_directives_its_package_and_what_they_name(tmp_path):
    texts = {
        "arm.dmd.yaml": "file: package://mine/parts/arm.urdf",
        "package.xml": "<name>mine</name>",
        "parts/arm.urdf": '<mesh filename="package://mine/meshes/hand.obj"/><mesh filename="link.obj"/>',
        "parts/link.obj": "mtllib link.mtl",
        "parts/link.mtl": "map_Kd paint.png",
        "parts/paint.png": "",
        "meshes/hand.obj": "",
        "meshes/other.obj": "",
        "parts/arm.urdf~": "",
        "notes.md": "package://mine/meshes/other.obj",
    }
    for name, text in texts.items():
        (tmp_path / name).parent.mkdir(exist_ok=True)
        (tmp_path / name).write_text(text, encoding="utf-8")
    found = list_names(list_arm_files(tmp_path / "arm.dmd.yaml"), tmp_path)
    assert found == [
        "arm.dmd.yaml",
        "meshes/hand.obj",
        "package.xml",
        "parts/arm.urdf",
        "parts/link.mtl",
        "parts/link.obj",
        "parts/paint.png",
    ]


def test_files_that_name_each_other_are_listed_once(tmp_path):
    (tmp_path / "arm.dmd.yaml").write_text("file: package://mine/other.yaml", encoding="utf-8")
    (tmp_path / "other.yaml").write_text("file: package://mine/arm.dmd.yaml", encoding="utf-8")
    assert list_names(list_arm_files(tmp_path / "arm.dmd.yaml"), tmp_path) == ["arm.dmd.yaml", "other.yaml"]
    assert list_arm_files(tmp_path / "nowhere" / "arm.dmd.yaml") == ()


def test_models_are_the_arm_and_the_tasks_with_their_meshes(models):
    (models / "workshop" / "meshes" / "stray.obj").write_text("", encoding="utf-8")
    found = list_names(list_model_files(models), models)
    assert {
        "arm.sdf",
        "infant.dmd.yaml",
        "infant.sdf",
        "materials.yaml",
        "nail.yaml",
        "tools/weight.yaml",
        "paths/reach.yaml",
    } <= set(found)
    assert "workshop/meshes/mallet.obj" in found
    assert not [name for name in found if "stray" in name or name.endswith((".md", ".py", ".csv"))]
