"""Meshes as Drake draws them, weighs them and hangs them on the arm."""

import numpy as np
import pytest
from helpers.rendered_labels import render_labels
from helpers.workshop import HAMMERS
from pydrake.geometry import MeshcatVisualizer, Role, StartMeshcat
from pydrake.multibody.tree import CalcSpatialInertia
from pydrake.systems.framework import DiagramBuilder

from affordance.extensions.pixels.camera_sensor import TURNING_RIG, CameraSensor, present
from affordance.objects.array_solids import ColumnSolid
from affordance.objects.drake_geometry import draw_mesh, make_drawn_shape
from affordance.objects.inertia import parameters_from_pseudo_inertia, spatial_inertia_from_parameters
from affordance.plant.load import add_arm


@pytest.mark.parametrize("name", HAMMERS)
def test_drake_finds_the_same_inertia_in_our_own_meshes(name):
    for part in HAMMERS[name].components:
        mesh = draw_mesh(part.shape)
        ours = spatial_inertia_from_parameters(1e3 * parameters_from_pseudo_inertia(part.shape.unit_pseudo_inertia()))
        drakes = CalcSpatialInertia(mesh, 1e3).CopyToFullMatrix6()
        np.testing.assert_allclose(ours.CopyToFullMatrix6(), drakes, atol=1e-5 * np.abs(drakes).max())


def test_parts_are_drawn_in_the_colours_of_their_materials():
    tool = HAMMERS["claw hammer"]
    stand = CameraSensor(TURNING_RIG)
    side, _ = present(tool)
    picture, labels = stand.render(side), render_labels(side, stand.rig)
    for number, part in enumerate(tool.components):
        shown = np.median(picture.colour[labels == number] / 255.0, axis=0)
        tint = shown / shown.sum() - np.array(part.looks_like.colour) / sum(part.looks_like.colour)
        assert (labels == number).sum() > 5000
        assert np.abs(tint).max() < 0.03


def test_arm_holds_meshes_in_meshcat_and_touches_nothing_with_them():
    tool = HAMMERS["claw hammer"].gripped_by(HAMMERS["claw hammer"].grips[0])
    builder = DiagramBuilder()
    arm = add_arm(builder, tool=tool)
    scene_graph = builder.GetSubsystemByName("scene_graph")
    meshcat = StartMeshcat()
    MeshcatVisualizer.AddToBuilder(builder, scene_graph, meshcat)
    diagram = builder.Build()
    diagram.ForcedPublish(diagram.CreateDefaultContext())
    assert meshcat.HasPath("/drake/visualizer/tool")
    inspector = scene_graph.model_inspector()
    frame = arm.plant.GetBodyFrameIdOrThrow(arm.tool.index())
    assert inspector.NumGeometriesForFrameWithRole(frame, Role.kIllustration) == 2
    assert inspector.NumGeometriesForFrameWithRole(frame, Role.kProximity) == 0


def test_columns_are_not_drawn():
    solid = ColumnSolid(np.zeros((1, 2)), np.ones(1), np.array([[0.0, 1.0]]))
    with pytest.raises(NotImplementedError, match="no Drake geometry for ColumnSolid"):
        make_drawn_shape(solid)
