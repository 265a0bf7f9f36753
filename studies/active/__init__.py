"""Study of active choice: how many holds each rule needs until the choice of tools is right."""
