"""Study of active choice: how many holds observers need with each rule until their choices of tools are right."""
