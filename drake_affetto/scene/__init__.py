"""The world: models, joints, the drum's place and its workspace."""
