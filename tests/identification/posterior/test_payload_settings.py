import re
import xml.etree.ElementTree as ET

import numpy as np
from helpers.generated_runs import PAYLOAD
from numpy.testing import assert_allclose
from pydrake.multibody.parsing import Parser
from pydrake.multibody.plant import MultibodyPlant

from affordance.identification.posterior.payload_settings import list_payload_settings
from affordance.objects.inertia import parameters_from_spatial_inertia

_LINES = list_payload_settings(PAYLOAD)
_CENTRE = PAYLOAD[1:4] / PAYLOAD[0]


def test_urdf_is_read_as_the_same_body():
    element = ET.fromstring(_LINES["URDF"])
    text = f"<robot name='r'><link name='l'>{ET.tostring(element, encoding='unicode')}</link></robot>"
    plant = MultibodyPlant(0.0)
    Parser(plant).AddModelsFromString(text, "urdf")
    body = plant.GetBodyByName("l")
    plant.WeldFrames(plant.world_frame(), body.body_frame())
    plant.Finalize()
    read = parameters_from_spatial_inertia(body.CalcSpatialInertiaInBodyFrame(plant.CreateDefaultContext()))
    assert_allclose(read, PAYLOAD, rtol=1e-4, atol=1e-6)


def test_urscript_has_moments_about_the_centre_of_mass():
    numbers = [
        float(number) for number in re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", _LINES["Universal Robots (URScript)"])
    ]
    mass, centre, moments = numbers[0], numbers[1:4], numbers[4:]
    assert_allclose(mass, PAYLOAD[0], rtol=1e-4)
    assert_allclose(centre, _CENTRE, atol=1e-5)
    assert_allclose(moments[0], PAYLOAD[4] - mass * (_CENTRE[1] ** 2 + _CENTRE[2] ** 2), rtol=1e-3)


def test_drake_line_can_be_run():
    from pydrake.multibody.tree import RotationalInertia, SpatialInertia

    inertia = eval(
        _LINES["Drake (Python)"], {"SpatialInertia": SpatialInertia, "RotationalInertia": RotationalInertia}
    )
    assert_allclose(parameters_from_spatial_inertia(inertia), PAYLOAD, rtol=1e-4, atol=1e-6)


def test_libfranka_has_a_symmetric_matrix():
    numbers = re.findall(r"-?\d+\.?\d*(?:e-?\d+)?", _LINES["Franka (libfranka)"])
    matrix = np.array([float(number) for number in numbers[4:]]).reshape(3, 3)
    assert_allclose(matrix, matrix.T)
    assert (np.linalg.eigvalsh(matrix) > 0.0).all()
