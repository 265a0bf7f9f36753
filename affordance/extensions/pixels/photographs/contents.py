"""Materials that represent household objects with uncertain contents."""

from types import MappingProxyType

# Material by kind of object, as named by a user. Its density is the mass of an object divided by its outer volume,
# including walls and air; numbers and sources are in models/materials.yaml.
MATERIALS_BY_KIND = MappingProxyType(
    {
        "liquid": "holds_liquid",
        "powder": "holds_powder",
        "dry_food": "holds_dry_food",
        "air": "holds_air",
    }
)
# Material of an object of unknown kind.
UNKNOWN = "household_thing"
