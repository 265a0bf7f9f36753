"""Study of how to move while weighing: designs of motions, compared by the errors of identification."""
