"""Contents of household things, as materials with a wide density."""

from types import MappingProxyType

# Material of each kind, by the word that a person says of a thing. The density of such a material is the mass of a
# thing over its outer volume, walls and air included; models/materials.yaml has the numbers and their sources.
MATERIALS_BY_KIND = MappingProxyType(
    {
        "liquid": "holds_liquid",
        "powder": "holds_powder",
        "dry_food": "holds_dry_food",
        "air": "holds_air",
    }
)
# Material of a thing of which nothing is said.
UNKNOWN = "household_thing"
