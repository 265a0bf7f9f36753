"""Study of objects in photographs and in ray-cast pictures."""
