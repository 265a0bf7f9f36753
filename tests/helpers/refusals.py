"""Calls that must be refused."""

from collections.abc import Callable

import pytest

from affordance.exceptions import BadValueError


def refuse(call: Callable[..., object], *arguments: object, error: type = BadValueError, **options: object) -> str:
    """Returns the message of the error, of one line, that a call with these arguments must raise."""
    with pytest.raises(error) as caught:
        call(*arguments, **options)
    message = str(caught.value)
    assert "\n" not in message
    return message
