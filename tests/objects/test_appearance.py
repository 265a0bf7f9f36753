import pytest

from affordance.objects.appearance import PartAppearance, is_same_object

BRASS, STEEL = (0.83, 0.63, 0.09), (0.49, 0.54, 0.6)
HANDLE = PartAppearance(STEEL, (0.08, 0.015, 0.015), (0.08, 0.0, 0.0))
HEAD = PartAppearance(BRASS, (0.03, 0.02, 0.05), (0.19, 0.0, 0.0))
HAMMER = (HANDLE, HEAD)


def test_an_object_is_itself_in_whatever_order_its_parts_and_axes_are_seen():
    turned = HEAD._replace(sizes=(0.05, 0.03, 0.02))
    assert is_same_object(HAMMER, (turned, HANDLE))


def test_what_the_eye_cannot_tell_apart_is_the_same():
    longer = HANDLE._replace(sizes=(0.082, 0.015, 0.015))
    assert is_same_object(HAMMER, (longer, HEAD))


@pytest.mark.parametrize(
    "other",
    [
        (HANDLE,),
        (HANDLE, HEAD._replace(colour=STEEL)),
        (HANDLE._replace(sizes=(0.084, 0.015, 0.015)), HEAD),
        (HANDLE, HEAD._replace(position=(0.198, 0.0, 0.0))),
        (HANDLE, HEAD._replace(sizes=(0.03, 0.02))),
        (HEAD, HEAD),
    ],
    ids=["fewer parts", "another colour", "5 % longer", "8 mm further out", "another shape", "a part twice"],
)
def test_what_the_eye_can_tell_apart_is_another(other):
    assert not is_same_object(HAMMER, other)
    assert not is_same_object(other, HAMMER)


def test_errors_of_measuring_widen_what_is_the_same():
    blurred = HANDLE._replace(sizes=(0.084, 0.015, 0.015), size_sd=0.01)
    assert is_same_object(HAMMER, (blurred, HEAD))
    displaced = HEAD._replace(position=(0.198, 0.0, 0.0), position_sd=0.001)
    assert is_same_object(HAMMER, (HANDLE, displaced))
