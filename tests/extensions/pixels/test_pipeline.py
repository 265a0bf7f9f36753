import numpy as np
import pytest
from helpers.synthetic_pictures import CAMERA, NOISY, PERFECT, STAND, draw_picture, make_ellipsoid
from scipy.spatial.transform import Rotation

from affordance.belief.density_belief import Prior
from affordance.belief.material_memory import MaterialMemory
from affordance.exceptions import HiddenPartError, NoFitError, TooSmallError
from affordance.extensions.pixels import pipeline as see_module
from affordance.extensions.pixels.ellipsoid_fit import UndeterminedError
from affordance.extensions.pixels.pipeline import detect_parts, draw_outline
from affordance.extensions.pixels.rig import DEFAULT_RIG, render
from affordance.extensions.pixels.sensor_noise import SensorNoise
from affordance.files.model_folder import MODELS
from affordance.objects.inertia import Ellipsoid, build_inertia_map
from affordance.objects.load import load_tools
from affordance.objects.materials import load_materials
from affordance.vision.prediction import predict_object

BEECH, STEEL = (0.79, 0.56, 0.35), (0.49, 0.54, 0.6)
PRIOR = Prior(mode=1000.0, sd=4000.0, deviation=0.06)
MATERIALS = load_materials(MODELS / "materials.yaml")
BALL = make_ellipsoid([0.04] * 3, [0.0, 0.0, STAND - 0.04])


def observe(tool, noise: SensorNoise = NOISY, seed=0):
    picture = noise.add_to(render(tool), CAMERA, np.random.default_rng(seed))
    return detect_parts(picture, DEFAULT_RIG, noise).compute_features(DEFAULT_RIG.compute_camera_pose(tool))


@pytest.mark.parametrize("name", ["weight", "com", "novel", "uncommon"])
def test_objects_of_the_experiments_are_made_out(name):
    """Errors of inertial parameters by one look are below 3.5 stated SDs, and all colours are recognised."""
    for tool in load_tools(MODELS / "tools" / f"{name}.yaml", MATERIALS):
        features = observe(tool)
        assert len(features) == len(tool.components)
        looks = {part.looks_like.colour: part.looks_like.density for part in tool.components}
        memory = MaterialMemory.from_densities(looks)
        belief = predict_object(features, memory, PRIOR)
        assert belief.memory.colours == memory.colours  # every one was recognised
        as_it_looks = tool.with_densities(looks).parameters
        rho = memory.belief.untruncated_mean[list(belief.colours)]
        covariance = belief.geometry.compute_covariance(rho)
        error = belief.compute_parameters(rho) - as_it_looks
        assert (np.abs(error) < 3.5 * np.sqrt(np.diag(covariance)) + 1e-4).all()
        assert abs(error[0]) < 0.08 * as_it_looks[0]


def test_features_of_a_perfect_picture_are_those_of_the_object():
    """Places agree to 0.4 mm, sizes and colours to 1.2 %; the renderer's facets make one or two thousandths."""
    (tool, *_) = load_tools(MODELS / "tools" / "novel.yaml", MATERIALS)
    features = sorted(observe(tool, PERFECT), key=lambda part: part.X_TE[0, 3])
    for part, true in zip(features, tool.components, strict=True):
        np.testing.assert_allclose(part.X_TE[:3, 3], true.X_TE[:3, 3], atol=4e-4)
        np.testing.assert_allclose(part.shape.sizes, true.shape.sizes, rtol=0.012)
        np.testing.assert_allclose(part.colour, true.looks_like.colour, atol=0.012)
        assert np.linalg.det(part.X_TE[:3, :3]) == pytest.approx(1.0)
        assert abs(part.X_TE[0, 0]) == pytest.approx(1.0, abs=1e-3)


def test_uncertainty_of_features_is_that_of_phi():
    """Deformations agree to 1e-4 with finite differences of Phi of the deformed solid."""
    (tool, *_) = load_tools(MODELS / "tools" / "novel.yaml", MATERIALS)
    part = observe(tool)[0]
    memory = MaterialMemory.from_densities({part.colour: 1.0})
    geometry = predict_object([part], memory, PRIOR).geometry
    S = (part.X_TE[:3, :3] * part.shape.sizes**2) @ part.X_TE[:3, :3].T
    for deformation, error in zip(part.deformations, geometry.Phi_errors, strict=True):
        step, changes = 1e-3, []
        for sign in (1.0, -1.0):
            D = np.eye(3) + sign * step * deformation[:3, :3]
            squares, axes = np.linalg.eigh(D @ S @ D.T)
            X_TE = np.eye(4)
            X_TE[:3, :3] = axes * np.array([1.0, 1.0, np.linalg.det(axes)])
            X_TE[:3, 3] = D @ part.X_TE[:3, 3] + sign * step * deformation[:3, 3]
            changes.append(build_inertia_map([Ellipsoid(tuple(np.sqrt(squares)))], [X_TE], [0], 1)[:, 0])
        numeric, atol = (changes[0] - changes[1]) / (2.0 * step), 1e-6 * np.abs(geometry.Phi_errors).max()
        np.testing.assert_allclose(error[:, 0], numeric, rtol=1e-4, atol=atol)


def look(ellipsoids, colours):
    return NOISY.add_to(draw_picture(ellipsoids, colours), CAMERA, np.random.default_rng(0))


def test_part_behind_another_is_said_to_be_hidden():
    behind = make_ellipsoid([0.06, 0.02, 0.02], [0.0, 0.0, STAND - 0.02])
    front = make_ellipsoid([0.05, 0.05, 0.03], [0.035, 0.0, STAND - 0.12])
    picture, hidden = look([behind, front], [BEECH, STEEL]), "% of a part is visible behind other parts"
    with pytest.raises(HiddenPartError, match=rf"\d+ {hidden}, must be at least 50 %"):
        detect_parts(picture, DEFAULT_RIG, NOISY)


def test_one_part_wholly_behind_another_of_its_colour_leaves_no_ellipsoid():
    behind = make_ellipsoid([0.09, 0.03, 0.02], [0.03, 0.02, STAND - 0.02])
    front = make_ellipsoid([0.05, 0.06, 0.03], [-0.02, 0.0, STAND - 0.09])
    with pytest.raises((NoFitError, HiddenPartError)):
        detect_parts(look([behind, front], [BEECH, BEECH]), DEFAULT_RIG, NOISY)


def test_part_of_which_depth_is_missing_is_not_guessed():
    picture = look([BALL], [BEECH])
    picture.depth[200:280, 280:360] = 0.0
    with pytest.raises(TooSmallError, match=r"a part has 0 depth readings and \d+ points of its outline, must have"):
        detect_parts(picture, DEFAULT_RIG, NOISY)


def test_fit_that_fails_is_said_with_the_picture(monkeypatch):
    def fail(*_):
        raise UndeterminedError("readings of a part lie on a line")

    monkeypatch.setattr(see_module, "fit_ellipsoid", fail)
    picture = draw_picture([BALL], [BEECH])
    with pytest.raises(NoFitError, match="lie on a line") as caught:
        detect_parts(picture, DEFAULT_RIG, NOISY)
    assert caught.value.depth is picture.depth


def test_outline_drawn_is_where_rays_graze():
    ellipsoid = make_ellipsoid(
        [0.03, 0.05, 0.08], [-0.1, 0.05, 0.7], Rotation.from_rotvec([0.4, 0.7, 1.1]).as_matrix()
    )
    rays = CAMERA.compute_rays(draw_outline(ellipsoid, CAMERA))
    A = np.linalg.inv(ellipsoid.shape_matrix)
    c = ellipsoid.centre
    alpha, beta = np.einsum("ni,ij,nj->n", rays, A, rays), rays @ A @ c
    np.testing.assert_allclose(beta**2 - alpha * (c @ A @ c - 1.0), 0.0, atol=1e-8 * (beta**2).max())
