"""Settings of lifts that are computed in closed form: those of all simulations, and how people push and differ."""

from dataclasses import dataclass, fields

from affordance.extensions.people.participant import Participant
from affordance.settings import Settings


@dataclass(frozen=True)
class LiftSettings(Settings):
    """Settings of lifts that are computed in closed form.

    Attributes:
        participant: How simulated people push, and how they differ, in lifts that are computed in closed form.
    """

    participant: Participant = Participant()


def with_participant(settings: Settings) -> LiftSettings:
    """Returns the settings with a participant, by default one without errors."""
    if isinstance(settings, LiftSettings):
        return settings
    return LiftSettings(**{each.name: getattr(settings, each.name) for each in fields(settings)})
