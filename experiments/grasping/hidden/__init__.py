"""Hidden rewards: drawing them, lessons about them, and knowing when a lesson is enough."""
